"""Response spectra by azimuth: the two components superpose before the maximum is taken."""

from functools import partial

import numpy as np
from numpy.typing import ArrayLike, NDArray

from per_obspy import checks
from per_obspy.checks import FloatArray
from per_obspy.kernels.spectra import azimuth_samples as kernels
from per_obspy.kernels.spectra import azimuth_steps
from per_obspy.kernels.spectra import tile_search as blocks
from per_obspy.spectra.elastic import grid_of, row_of, two_components
from per_obspy.spectra.oscillator_blocks import (
    Ground,
    Oscillators,
    over_blocks,
    prepare_ground,
    prepare_oscillators,
    stretches,
)

#: Phase of a step above which it is cut: at T = 5 dt the search between samples took fifty times
#: the pass over them.
LONGEST_PHASE = 0.5
#: A step is cut into 64 parts at most (T = dt / 3.6); shorter periods are exact as well, only
#: slower.
MOST_DOUBLINGS = 6

#: Every whole degree of a half turn; the other half repeats it.
AZIMUTHS = np.arange(0, 180)


def azimuthal_per_spectrum(
    north: ArrayLike,
    east: ArrayLike,
    dt: float,
    periods: ArrayLike,
    damping: ArrayLike = 0.05,
    azimuths: ArrayLike = AZIMUTHS,
) -> FloatArray:
    """
    Pseudo energy radius spectrum along each of many horizontal azimuths.

    Parameters
    ----------
    north, east : (n_samples,) array_like
        Components of the ground acceleration, m/s², as for `per_spectrum`.
    dt : float
        Time between samples, s.
    periods : (n_periods,) array_like
        Undamped periods, s.
    damping : float or (n_damping,) array_like
        Fraction of critical, at least 0 and below 1.
    azimuths : (n_azimuths,) array_like
        Degrees clockwise from north.

    Returns
    -------
    per : (n_periods, n_azimuths) or (n_damping, n_periods, n_azimuths) ndarray
        `per_spectrum` of ``north cos(azimuth) + east sin(azimuth)``, m.

    Raises
    ------
    ValueError
        If an argument is not finite, out of range or of the wrong shape.

    Notes
    -----
    Exact, between samples too, along each azimuth given, so that every percentile of `rotd` is
    exact for these azimuths. Nothing is interpolated between azimuths.

    Examples
    --------
    >>> azimuthal_per_spectrum([0.0, 3.0, 0.0], [0.0, 4.0, 0.0], 0.01, [1.0], azimuths=[0, 90]).round(4)
    array([[0.0047, 0.0063]])
    """
    return _spectrum(north, east, dt, periods, damping, azimuths, share=1.0, exact=True)


def azimuthal_sd_spectrum(
    north: ArrayLike,
    east: ArrayLike,
    dt: float,
    periods: ArrayLike,
    damping: ArrayLike = 0.05,
    azimuths: ArrayLike = AZIMUTHS,
) -> FloatArray:
    """Return the largest displacement along each azimuth, with free vibration, as `azimuthal_per_spectrum`, m."""
    return _spectrum(north, east, dt, periods, damping, azimuths, share=0.0, exact=True)


def sampled_azimuthal_per_spectrum(
    north: ArrayLike,
    east: ArrayLike,
    dt: float,
    periods: ArrayLike,
    damping: ArrayLike = 0.05,
    azimuths: ArrayLike = AZIMUTHS,
) -> FloatArray:
    """Return what `azimuthal_per_spectrum` would if only the samples were looked at, m."""
    return _spectrum(north, east, dt, periods, damping, azimuths, share=1.0, exact=False)


def sampled_azimuthal_sd_spectrum(
    north: ArrayLike,
    east: ArrayLike,
    dt: float,
    periods: ArrayLike,
    damping: ArrayLike = 0.05,
    azimuths: ArrayLike = AZIMUTHS,
) -> FloatArray:
    """Return what `azimuthal_sd_spectrum` would if only the samples of the record were looked at, m."""
    return _spectrum(north, east, dt, periods, damping, azimuths, share=0.0, exact=False)


def _spectrum(
    north: ArrayLike,
    east: ArrayLike,
    dt: float,
    periods: ArrayLike,
    damping: ArrayLike,
    azimuths: ArrayLike,
    share: float,
    exact: bool,
) -> FloatArray:
    """Return the largest ``sqrt(u² + share z²)`` along each azimuth."""
    components = two_components(north, east)
    dt = checks.number("dt", dt, checks.positive)
    (periods, dampings), shape = grid_of(periods, damping)
    given = row_of(
        "azimuths", checks.finite("azimuths", np.atleast_1d(checks.numbers("azimuths", azimuths)))
    )
    ascending = np.argsort(given % 180.0)
    fan = _fan(np.radians(given[ascending] % 180.0))
    lengths = np.empty((given.size, periods.size))
    parts = _parts(2.0 * np.pi * dt / periods) if exact else np.ones(periods.size, dtype=np.int64)
    for count in np.unique(parts).tolist():
        some = parts == count
        ground = prepare_ground(*(_with_steps_cut(component, count) for component in components))
        oscillators = prepare_oscillators(dt / count, periods[some], dampings[some])
        work = partial(_block_squares, ground, share=share, fan=fan, exact=exact)
        squares = over_blocks(work, oscillators, ground)
        lengths[np.ix_(ascending, some)] = (
            np.sqrt(squares[: given.size]) / oscillators.omegas**2 * ground.scale
        )
    return lengths.T.reshape(*shape, given.size)


def _parts(phases: FloatArray) -> NDArray[np.int64]:
    """Return into how many parts a step is cut, so that the bounds between samples stay tight: a power of two."""
    doublings = np.ceil(np.log2(np.maximum(phases / LONGEST_PHASE, 1.0)))
    return np.asarray(2 ** np.minimum(doublings, MOST_DOUBLINGS), dtype=np.int64)


def _with_steps_cut(acceleration: FloatArray, count: int) -> FloatArray:
    """Return more samples on the same straight lines, the closing ramp included."""
    if count == 1:
        return acceleration
    closed = np.append(acceleration, 0.0)
    cut: FloatArray = np.interp(
        np.arange(count * acceleration.size + 1) / count, np.arange(closed.size), closed
    )
    return cut


def _fan(angles: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Return directions and edges of groups of the ascending azimuths (rad), the last one repeated, for the kernels."""
    whole = np.pad(angles, (0, -angles.size % kernels.GROUP), mode="edge")
    directions = np.stack([np.cos(whole), np.sin(whole), np.cos(2.0 * whole), np.sin(2.0 * whole)])
    firsts = slice(None, None, kernels.GROUP)
    lasts = slice(kernels.GROUP - 1, None, kernels.GROUP)
    rise = 1.0 - np.cos(whole[lasts] - whole[firsts])
    edges = np.concatenate([directions[2:, firsts], directions[2:, lasts], rise[np.newaxis]])
    return directions, np.pad(edges, ((0, 0), (0, -rise.size % kernels.GROUP)))


def _block_squares(
    ground: Ground,
    block: Oscillators,
    *,
    share: float,
    fan: tuple[FloatArray, FloatArray],
    exact: bool,
) -> FloatArray:
    """Return the largest squares of one block, (azimuths, lanes), in units of the scaled acceleration / omega²."""
    packed, state = np.empty((8, blocks.LANES)), np.zeros((4, blocks.LANES))
    kept = np.empty((blocks.TILES, 6, blocks.LANES))
    steps = np.empty((blocks.TILES * blocks.TILE, azimuth_steps.COLUMNS))
    largest = np.zeros((blocks.LANES, fan[0].shape[1]))
    kernels.pack_steps(block.phases, block.dampings, packed)
    for stretch in stretches(ground):
        kernels.run_azimuth_tiles(stretch.north, stretch.east, packed, state, kept)
        for lane in range(block.wanted):
            oscillator = kernels.Oscillator(
                lane, float(block.phases[lane]), float(block.dampings[lane]), share
            )
            kernels.raise_azimuths_to_samples(*stretch[:2], kept, oscillator, fan[0], largest[lane])
            if exact:
                count = azimuth_steps.list_steps(
                    *stretch[:4], kept, oscillator, fan[0], largest[lane], steps
                )
                azimuth_steps.search_steps(steps[:count], oscillator, *fan, largest[lane])
    if share == 0.0:
        kernels.free_displacements(state, block.dampings, block.wanted, fan[0], largest)
    return largest.T


def rotd(spectrum: ArrayLike, percentile: float) -> FloatArray:
    """
    Percentile over the azimuths of a spectrum, its last axis (RotD50 is the median, RotD100 the largest).

    Parameters
    ----------
    spectrum : (..., n_azimuths) array_like
        From `azimuthal_per_spectrum` or `azimuthal_sd_spectrum`.
    percentile : float
        From 0 to 100.

    Returns
    -------
    (...) ndarray
        In the unit of the spectrum.

    Raises
    ------
    ValueError
        If the percentile lies outside 0 to 100, or a value is not finite.

    References
    ----------
    Boore, D. M. (2010), Orientation-independent, nongeometric-mean measures of seismic intensity
    from two horizontal components of motion, BSSA 100(4), 1830-1835.

    Examples
    --------
    >>> rotd([[1.0, 3.0, 2.0]], 50)
    array([2.])
    """
    values = checks.finite("spectrum", spectrum)
    if values.ndim == 0 or values.shape[-1] == 0:
        raise ValueError(
            f"spectrum must have azimuths on its last axis, got the shape {values.shape}"
        )
    share = checks.number(
        "percentile", percentile, lambda name, given: checks.between(name, given, 0.0, 100.0)
    )
    return np.asarray(np.percentile(values, share, axis=-1))
