"""Response spectra by azimuth: the two components superpose before the maximum is taken."""

from collections.abc import Sequence
from functools import partial
from typing import Any

import numpy as np
from numpy.typing import NDArray

from per_obspy import checks
from per_obspy.checks import ArrayLike, FloatArray
from per_obspy.constants import REFERENCE_DAMPING
from per_obspy.kernels.spectra import azimuth_samples as kernels
from per_obspy.kernels.spectra import azimuth_steps, azimuth_tiles
from per_obspy.kernels.spectra import tile_search as blocks
from per_obspy.spectra.elastic import (
    Oscillators,
    TiledRecord,
    grid_of,
    over_blocks,
    prepare_oscillators,
    row_of,
    stretches,
    tiled_record,
    two_components,
)
from per_obspy.spectra.trace_arguments import takes_traces

#: Phase of a step above which it is cut. Uncut steps spare passes over the samples; but on white
#: noise at T = 2.5 dt the search takes 3 to 15 times as long with 2 as with 1.
LONGEST_PHASE = 1.0
#: A step is cut into 64 parts at most (T = dt / 3.6); shorter periods are exact as well, only
#: slower.
MOST_DOUBLINGS = 6

#: Share of the squared velocity in the square that is largest.
RADIUS, DISPLACEMENT = 1.0, 0.0

#: Every whole degree of a half turn, degrees; the other half repeats it.
EVERY_AZIMUTH = np.arange(180.0)


@takes_traces
def azimuthal_per_spectrum(
    north: ArrayLike,
    east: ArrayLike,
    dt: float,
    periods: ArrayLike,
    damping: ArrayLike = REFERENCE_DAMPING,
    azimuths: ArrayLike = EVERY_AZIMUTH,
) -> FloatArray:
    """
    Compute the pseudo energy radius spectrum along each of many horizontal azimuths.

    Parameters
    ----------
    north, east : (n_samples,) array_like or obspy Trace
        Components of the ground acceleration, m/s², as for `per_spectrum`.
    dt : float
        Time between samples, s; not given with a Trace.
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
    exact for these azimuths, without interpolation between azimuths.

    Examples
    --------
    >>> north, east = [0.0, 3.0, 0.0], [0.0, 4.0, 0.0]
    >>> azimuthal_per_spectrum(north, east, 0.01, [1.0], azimuths=[0, 90]).round(4)
    array([[0.0047, 0.0063]])
    """
    return _spectra((RADIUS,), north, east, dt, periods, damping, azimuths)[0]


def azimuthal_sd_spectrum(
    north: ArrayLike,
    east: ArrayLike,
    dt: float,
    periods: ArrayLike,
    damping: ArrayLike = REFERENCE_DAMPING,
    azimuths: ArrayLike = EVERY_AZIMUTH,
) -> FloatArray:
    """
    Compute the largest displacement along each azimuth, with free vibration, m.

    Arguments and shape of the result are those of `azimuthal_per_spectrum`.
    """
    return _spectra((DISPLACEMENT,), north, east, dt, periods, damping, azimuths)[0]


def azimuthal_spectra(
    north: ArrayLike,
    east: ArrayLike,
    dt: float,
    periods: ArrayLike,
    damping: ArrayLike = REFERENCE_DAMPING,
    azimuths: ArrayLike = EVERY_AZIMUTH,
) -> tuple[FloatArray, FloatArray]:
    """
    Compute `azimuthal_per_spectrum` and `azimuthal_sd_spectrum` from one pass over the record, m.

    Arguments and shapes of both results are those of `azimuthal_per_spectrum`, without traces.
    """
    both = RADIUS, DISPLACEMENT
    per, sd = _spectra(both, north, east, dt, periods, damping, azimuths)
    return per, sd


def sampled_azimuthal_per_spectrum(*arguments: Any, **options: Any) -> FloatArray:
    """
    Compute `azimuthal_per_spectrum` from the maxima at the samples alone, m.

    For benchmarks and tests against programs that look at samples only; arguments as there.
    """
    return _spectra((RADIUS,), *arguments, **options, exact=False)[0]


def sampled_azimuthal_sd_spectrum(*arguments: Any, **options: Any) -> FloatArray:
    """
    Compute `azimuthal_sd_spectrum` from the maxima at the samples of the record alone, m.

    For benchmarks and tests against programs that look at samples only; arguments as there.
    """
    return _spectra((DISPLACEMENT,), *arguments, **options, exact=False)[0]


def _spectra(
    shares: tuple[float, ...],
    north: ArrayLike,
    east: ArrayLike,
    dt: float,
    periods: ArrayLike,
    damping: ArrayLike = REFERENCE_DAMPING,
    azimuths: ArrayLike = EVERY_AZIMUTH,
    *,
    exact: bool = True,
) -> list[FloatArray]:
    """Return the largest ``sqrt(u² + share z²)`` along each azimuth, one array per share."""
    components = two_components(north, east)
    dt = checks.number("dt", dt, checks.positive)
    (periods, dampings), shape = grid_of(periods, damping)
    half_turn = row_of("azimuths", azimuths, checks.finite) % 180.0

    # The kernels take azimuths of a half turn in ascending order
    ascending = np.argsort(half_turn)
    places = np.argsort(ascending)
    fan = _fan(np.radians(half_turn[ascending]))

    # Oscillators whose steps are cut into equally many parts run together
    lengths = np.empty((len(shares), periods.size, half_turn.size))
    parts = _parts(2.0 * np.pi * dt / periods, exact)
    for count in np.unique(parts).tolist():
        chosen = np.flatnonzero(parts == count)
        oscillators = prepare_oscillators(dt / count, periods[chosen], dampings[chosen])
        record = _record_with_steps_cut(components, count)
        # Back to the order of the arguments
        ordered = _lengths(record, oscillators, fan, shares, exact)
        lengths[:, chosen] = ordered[..., places]
    return [spectrum.reshape(*shape, half_turn.size) for spectrum in lengths]


def _lengths(
    record: TiledRecord,
    oscillators: Oscillators,
    fan: tuple[FloatArray, FloatArray],
    shares: tuple[float, ...],
    exact: bool,
) -> FloatArray:
    """Return the largest lengths of oscillators, (shares, n, azimuths of the fan), m."""
    work = partial(_block_squares, record, shares=shares, fan=fan, exact=exact)
    squares = over_blocks(work, oscillators, record)
    lengths = np.sqrt(squares) / oscillators.omegas**2 * record.scale
    return lengths.T.reshape(oscillators.size, len(shares), -1).swapaxes(0, 1)


def _parts(phases: FloatArray, exact: bool) -> NDArray[np.int64]:
    """Return the number of parts of a step, a power of two: bounds between samples stay tight."""
    if not exact:
        return np.ones(phases.size, dtype=np.int64)
    doublings = np.ceil(np.log2(np.maximum(phases / LONGEST_PHASE, 1.0)))
    return np.asarray(2 ** np.minimum(doublings, MOST_DOUBLINGS), dtype=np.int64)


def _record_with_steps_cut(components: Sequence[FloatArray], count: int) -> TiledRecord:
    """Return a record with more samples on the same straight lines, the closing ramp included."""
    if count > 1:
        whole = np.arange(components[0].size + 1)
        steps = np.arange(count * components[0].size + 1) / count
        components = [np.interp(steps, whole, np.append(one, 0.0)) for one in components]
    return tiled_record(*components)


def _fan(angles: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Return directions and edges of groups of ascending azimuths (rad) for the kernels."""
    # The last azimuth fills up the last group
    whole = np.pad(angles, (0, -angles.size % kernels.GROUP), mode="edge")
    groups = whole.reshape(-1, kernels.GROUP)
    firsts, lasts = groups[:, 0], groups[:, -1]
    places = _places(groups)
    turned = [np.cos(whole), np.sin(whole), np.cos(2.0 * whole), np.sin(2.0 * whole)]
    directions = np.stack([*turned, places])

    # Edges of a group: twice the angle of its first and last azimuth, and the rise between them
    rise = 1.0 - np.cos(lasts - firsts)
    ends = [row[start :: kernels.GROUP] for start in (0, kernels.GROUP - 1) for row in turned[2:]]
    edges = np.stack([*ends, rise])
    return directions, np.pad(edges, ((0, 0), (0, -rise.size % kernels.GROUP)))


def _places(groups: FloatArray) -> FloatArray:
    """Return the places of azimuths between the first and the last of their group, 0 to 1."""
    firsts, lasts = groups[:, :1], groups[:, -1:]
    places: FloatArray = (groups - firsts) / np.where(lasts > firsts, lasts - firsts, 1.0)
    return places.ravel()


def _block_squares(
    record: TiledRecord,
    block: Oscillators,
    *,
    shares: tuple[float, ...],
    fan: tuple[FloatArray, FloatArray],
    exact: bool,
) -> FloatArray:
    """Return the largest squares of one block, scaled acceleration / omega², (rows, lanes)."""
    table = np.empty((azimuth_tiles.ROWS, blocks.LANES))
    tile_states = np.empty((blocks.TILES, 6, blocks.LANES))
    largest = np.zeros((len(shares), blocks.LANES, fan[0].shape[1]))
    azimuth_tiles.pack(block.phases, block.dampings, table)

    # All lanes run together, then each is turned into every azimuth
    for stretch in stretches(record):
        azimuth_tiles.run_azimuth_tiles(*stretch[:4], table, tile_states)
        for share, squares in zip(shares, largest, strict=True):
            azimuth_steps.raise_azimuths(
                *stretch[:4], tile_states, *block[:2], share, exact, *fan, squares[: block.size]
            )

    # In free vibration the radius never grows, the displacement may
    if DISPLACEMENT in shares:
        displacements = largest[shares.index(DISPLACEMENT)]
        kernels.free_displacements(table[:4], block.dampings, block.size, fan[0], displacements)
    # In memory, azimuths stay next to each other
    return np.concatenate(largest, axis=1).T


def rotd(spectrum: ArrayLike, percentile: float) -> FloatArray:
    """
    Compute a percentile over azimuths, the last axis (RotD50: median, RotD100: largest).

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
