"""
Response spectra of linear oscillators, exact for records that are linear between samples.

A record is scaled by a power of two to a peak of order one (exactly undone afterwards), closed by
one ramp to zero, and filled up with zeros to whole tiles. Results do not depend on the number of
threads: a block is computed by one of them.
"""

import math
from collections.abc import Callable, Iterator, Sequence
from typing import Any, NamedTuple, TypeVar

import numpy as np
from numpy.typing import NDArray

from per_obspy import checks
from per_obspy.checks import ArrayLike, FloatArray
from per_obspy.constants import REFERENCE_DAMPING
from per_obspy.kernels.maxima.oscillator_maxima import largest_responses
from per_obspy.kernels.spectra import radius, response
from per_obspy.kernels.spectra import tile_search as blocks
from per_obspy.spectra.trace_arguments import takes_trace
from per_obspy.threads import map_in_threads

Part = TypeVar("Part")
Result = TypeVar("Result")

#: Steps of all oscillators together below which starting threads costs more than it saves.
STEPS_WORTH_THREADS = 20_000_000


#: Of the scale of a record, as a power of two: its inverse must be finite.
SMALLEST_EXPONENT = -1022


class TiledRecord(NamedTuple):
    """
    Two components of a record, or of a stretch of it, ready for the kernels.

    A whole number of tiles and one sample; ``peaks`` and ``jumps`` (component, tile) are the
    largest acceleration and the largest change over a step; samples were divided by ``scale``.
    """

    north: FloatArray
    east: FloatArray
    peaks: FloatArray
    jumps: FloatArray
    scale: float


class Oscillators(NamedTuple):
    """
    Oscillators under a record.

    Phase of one step, damping, weights of north and east (2, n), omega in rad/s; only the first
    ``size`` count, the others fill up a block.
    """

    phases: FloatArray
    dampings: FloatArray
    weights: FloatArray
    omegas: FloatArray
    size: int


def tiled_record(north: FloatArray, east: FloatArray | None = None) -> TiledRecord:
    """Prepare a record of two components, or of one that every oscillator feels."""
    components = [north] if east is None else [north, east]
    # A power of two is exactly undone afterwards
    peak = max(float(np.abs(component).max()) for component in components)
    scale = 2.0 ** max(math.floor(math.log2(peak)), SMALLEST_EXPONENT) if peak > 0.0 else 1.0
    scaled = [_closed(component, scale) for component in components]

    peaks, jumps = np.zeros((2, 2, (scaled[0].size - 1) // blocks.TILE))
    for number, component in enumerate(scaled):
        blocks.tile_extremes(component, peaks[number], jumps[number])
    return TiledRecord(scaled[0], scaled[-1], peaks, jumps, scale)


def _closed(acceleration: FloatArray, scale: float) -> FloatArray:
    """Return the scaled record, filled up with zeros to whole tiles and one sample."""
    tiles = -(-acceleration.size // blocks.TILE)
    closed = np.zeros(tiles * blocks.TILE + 1)
    # The inverse of a power of two is exact, and dividing takes three times as long
    np.multiply(acceleration, 1.0 / scale, out=closed[: acceleration.size])
    return closed


def prepare_oscillators(
    dt: float, periods: FloatArray, dampings: FloatArray, azimuths: FloatArray | None = None
) -> Oscillators:
    """Return paired oscillators (n,) that feel the first component, or their azimuths (degrees)."""
    omegas = 2.0 * np.pi / periods
    # Shares of both components
    weights = np.zeros((2, periods.size))
    weights[0] = 1.0
    if azimuths is not None:
        angles = np.radians(azimuths)
        weights[:] = np.cos(angles), np.sin(angles)
    return Oscillators(
        phases=omegas * dt,
        dampings=dampings.copy(),
        weights=weights,
        omegas=omegas,
        size=periods.size,
    )


def stretches(record: TiledRecord) -> Iterator[TiledRecord]:
    """Yield consecutive stretches of the record: the tiles whose states are kept at a time."""
    for first in range(0, record.peaks.shape[1], blocks.TILES):
        last = first + blocks.TILES
        # Neighbouring stretches share the sample between them
        samples = slice(first * blocks.TILE, last * blocks.TILE + 1)
        peaks = record.peaks[:, first:last].copy()
        jumps = record.jumps[:, first:last].copy()
        yield TiledRecord(record.north[samples], record.east[samples], peaks, jumps, record.scale)


def raise_between_samples(
    stretch: TiledRecord, block: Oscillators, tile_states: FloatArray, largest: FloatArray
) -> None:
    """Raise the largest values to those of a stretch, between the samples too."""
    limits = np.concatenate([stretch.peaks, stretch.jumps])
    oscillators = np.stack([block.phases, block.dampings, *block.weights])
    # Lanes that fill the block up are left out
    windows = np.zeros((2, blocks.LANES))
    windows[1, : block.size], windows[1, block.size :] = np.inf, -1.0
    blocks.raise_between_samples(
        1, stretch.north, stretch.east, limits, oscillators, 0, windows, tile_states, largest
    )


def over_blocks(
    work: Callable[[Oscillators], FloatArray], oscillators: Oscillators, record: TiledRecord
) -> FloatArray:
    """Compute rows for each block of oscillators, (rows, n), in threads where that pays."""
    parts = [_block(oscillators, first) for first in range(0, oscillators.size, blocks.LANES)]
    rows = in_threads(work, parts, oscillators.size * record.north.size)
    return np.concatenate(rows, axis=1)[:, : oscillators.size]


def in_threads(work: Callable[[Part], Result], parts: Sequence[Part], steps: int) -> list[Result]:
    """Return the result of each part, in threads if this many steps of oscillators pay for them."""
    if steps < STEPS_WORTH_THREADS:
        return [work(part) for part in parts]
    return map_in_threads(work, parts)


def _block(oscillators: Oscillators, first: int) -> Oscillators:
    """Return one block, filled up with copies of the last oscillator."""
    size = min(blocks.LANES, oscillators.size - first)
    lanes = first + np.minimum(np.arange(blocks.LANES), size - 1)
    return Oscillators(
        phases=oscillators.phases[lanes],
        dampings=oscillators.dampings[lanes],
        weights=np.ascontiguousarray(oscillators.weights[:, lanes]),
        omegas=oscillators.omegas[lanes],
        size=size,
    )


class ResponseSpectra(NamedTuple):
    """
    Largest responses of linear oscillators, each (n_periods,) or (n_damping, n_periods).

    Attributes
    ----------
    per : ndarray
        Pseudo energy radius, the largest ``sqrt(u² + (v / omega)²)``, m.
    sd : ndarray
        Largest displacement relative to the ground, m.
    sv : ndarray
        Largest velocity relative to the ground, m/s.
    sa : ndarray
        Largest absolute acceleration, m/s².
    psv : ndarray
        Pseudo velocity ``omega * sd``, m/s.
    psa : ndarray
        Pseudo acceleration ``omega² * sd``, m/s².
    """

    per: FloatArray
    sd: FloatArray
    sv: FloatArray
    sa: FloatArray
    psv: FloatArray
    psa: FloatArray


@takes_trace
def per_spectrum(
    acceleration: ArrayLike, dt: float, periods: ArrayLike, damping: ArrayLike = REFERENCE_DAMPING
) -> FloatArray:
    """
    Compute the pseudo energy radius spectrum of one component of ground acceleration.

    Parameters
    ----------
    acceleration : (n_samples,) array_like or obspy Trace
        Ground acceleration, m/s², linear between samples; the structure is at rest at the first
        sample, and a last sample that is not zero is followed by a ramp of one ``dt`` to zero.
    dt : float
        Time between samples, s; not given with a Trace.
    periods : (n_periods,) array_like
        Undamped periods ``2 pi / omega``, s.
    damping : float or (n_damping,) array_like
        Fraction of critical, at least 0 and below 1.

    Returns
    -------
    per : (n_periods,) or (n_damping, n_periods) ndarray
        Largest radius ``sqrt(u² + (v / omega)²)``, m, between samples as well as at them.

    Raises
    ------
    ValueError
        If an argument is not finite, out of range or of the wrong shape.

    Notes
    -----
    ``u`` and ``v`` are displacement and velocity relative to the ground (Valles-Mattox & Reinhorn
    1996, eq. (11) and (12)). In the free vibration after the record the radius never grows, so that
    none is added. Bounds of the second derivative of ``r²`` limit the steps in which a maximum
    between samples can lie; there it is found from the roots of ``v`` and of
    ``2 xi omega v + a``.

    Straight lines between samples act on the record as a low-pass. Where periods are close to
    ``dt``, :func:`per_obspy.spectra.band_limited.band_limited` interpolates the record first.

    References
    ----------
    Nigam, N. C. & Jennings, P. C. (1969), Calculation of response spectra from strong-motion
    earthquake records, BSSA 59(2), 909-922.

    Examples
    --------
    A constant acceleration of an undamped oscillator: the static displacement, doubled.

    >>> per_spectrum([9.81] * 400, 0.005, [1.0], damping=0.0).round(6)
    array([0.49698])
    """
    return _radii(acceleration, dt, periods, damping)


@takes_trace
def response_spectra(
    acceleration: ArrayLike, dt: float, periods: ArrayLike, damping: ArrayLike = REFERENCE_DAMPING
) -> ResponseSpectra:
    """
    Compute PER, SD, SV, SA, PSV and PSA spectra of one component of ground acceleration.

    Parameters
    ----------
    acceleration : (n_samples,) array_like or obspy Trace
        Ground acceleration, m/s², as for `per_spectrum`.
    dt : float
        Time between samples, s; not given with a Trace.
    periods : (n_periods,) array_like
        Undamped periods, s.
    damping : float or (n_damping,) array_like
        Fraction of critical, at least 0 and below 1.

    Returns
    -------
    ResponseSpectra
        Six arrays (n_periods,) or (n_damping, n_periods): m, m, m/s, m/s², m/s, m/s². Between
        samples as well as at them; SD, SV and SA include the free vibration after the record.

    Raises
    ------
    ValueError
        If an argument is not finite, out of range or of the wrong shape.

    Examples
    --------
    >>> spectra = response_spectra([9.81] * 400, 0.005, [1.0], damping=0.0)
    >>> spectra.sa.round(6)
    array([19.62])
    """
    return _responses(acceleration, dt, periods, damping)


def sampled_per_spectrum(*arguments: Any, **options: Any) -> FloatArray:
    """
    Compute `per_spectrum` from the maxima at the samples alone, m.

    For benchmarks and tests against programs that look at samples only; arguments as there.
    """
    return _radii(*arguments, **options, exact=False)


def sampled_response_spectra(*arguments: Any, **options: Any) -> ResponseSpectra:
    """
    Compute `response_spectra` from the maxima at the samples alone.

    For benchmarks and tests against programs that look at samples only; arguments as there.
    """
    return _responses(*arguments, **options, exact=False)


def _arguments(
    acceleration: ArrayLike, dt: float, periods: ArrayLike, damping: ArrayLike
) -> tuple[TiledRecord, Oscillators, tuple[int, ...]]:
    """Return the checked record, the oscillators of the grid, and the shape of the result."""
    record = checks.record("acceleration", acceleration)
    dt = checks.number("dt", dt, checks.positive)
    grid, shape = grid_of(periods, damping)
    return tiled_record(record), prepare_oscillators(dt, *grid), shape


def grid_of(
    periods: ArrayLike, damping: ArrayLike
) -> tuple[tuple[FloatArray, FloatArray], tuple[int, ...]]:
    """Return every damping with every period as paired rows, and the shape of the grid."""
    row = row_of("periods", periods)
    # A single damping leaves the result one-dimensional
    dampings = checks.fraction_of_critical("damping", damping)
    if dampings.ndim > 1 or dampings.size == 0:
        raise ValueError(
            f"damping must be a number or one row of numbers, got the shape {dampings.shape}"
        )
    grid = np.tile(row, dampings.size), np.repeat(dampings, row.size)
    return grid, (*dampings.shape, row.size)


def two_components(north: ArrayLike, east: ArrayLike) -> tuple[FloatArray, FloatArray]:
    """Return two components of the same length."""
    components = checks.record("north", north), checks.record("east", east)
    if components[0].size != components[1].size:
        raise ValueError(
            "north and east must be equally long, "
            f"got {components[0].size} and {components[1].size}"
        )
    return components


def row_of(
    name: str,
    values: ArrayLike,
    check: Callable[[str, ArrayLike], FloatArray] = checks.positive,
) -> FloatArray:
    """Return one row of at least one value that passes a check; a single number is one row."""
    row = np.atleast_1d(check(name, values))
    if row.ndim != 1 or row.size == 0:
        raise ValueError(f"{name} must be one row of at least one value, got the shape {row.shape}")
    return row


def _radius_block(record: TiledRecord, block: Oscillators, exact: bool) -> FloatArray:
    """Return the largest squared radii, (1, lanes), in units of scaled acceleration / omega²."""
    table = np.empty((radius.ROWS, blocks.LANES))
    tile_states = np.empty((blocks.TILES, 3, blocks.LANES))
    largest = np.zeros((1, blocks.LANES))
    radius.pack(block.phases, block.dampings, table)

    for stretch in stretches(record):
        # At every eighth step, then at all samples of tiles that may hold more
        radius.run_strides(stretch.north, table, tile_states)
        extremes = stretch.peaks[0], stretch.jumps[0]
        oscillators = block.phases, block.dampings, table
        radius.raise_to_samples(stretch.north, *extremes, *oscillators, tile_states, largest)
        if exact:
            raise_between_samples(stretch, block, tile_states, largest)
    return largest


def _response_block(record: TiledRecord, block: Oscillators, exact: bool) -> FloatArray:
    """Return the largest squared radii, displacements, velocities, accelerations, (4, lanes)."""
    packed = np.empty((response.ROWS, blocks.LANES))
    tile_states = np.empty((blocks.TILES, 6, blocks.LANES))
    largest = np.zeros((4, blocks.LANES))
    response.pack_response(block.weights, block.phases, block.dampings, packed)

    for stretch in stretches(record):
        # At all samples
        response.run_response_tiles(stretch.north, stretch.east, packed, tile_states)
        if exact:
            raise_between_samples(stretch, block, tile_states, largest)
        else:
            blocks.raise_to_tiles(tile_states, stretch.peaks.shape[1], largest)
    response.free_vibration(packed, block.dampings, largest)
    return largest


def _radii(
    acceleration: ArrayLike,
    dt: float,
    periods: ArrayLike,
    damping: ArrayLike = REFERENCE_DAMPING,
    *,
    exact: bool = True,
) -> FloatArray:
    """Return the largest radius of each oscillator of a grid, m, between samples too if exact."""
    record, oscillators, shape = _arguments(acceleration, dt, periods, damping)
    squares = over_blocks(lambda block: _radius_block(record, block, exact), oscillators, record)
    return np.reshape(np.sqrt(squares[0]) / oscillators.omegas**2 * record.scale, shape)


def _responses(
    acceleration: ArrayLike,
    dt: float,
    periods: ArrayLike,
    damping: ArrayLike = REFERENCE_DAMPING,
    *,
    exact: bool = True,
) -> ResponseSpectra:
    """Return the six spectra of a grid of oscillators, between samples too if exact."""
    record, oscillators, shape = _arguments(acceleration, dt, periods, damping)
    largest = over_blocks(lambda block: _response_block(record, block, exact), oscillators, record)
    largest[0] = np.sqrt(largest[0])
    # Radius, displacement, velocity / omega and acceleration / omega², m
    omegas = oscillators.omegas
    per, sd, sv, sa = largest / omegas**2 * record.scale
    spectra = per, sd, sv * omegas, sa * omegas**2, sd * omegas, sd * omegas**2
    return ResponseSpectra(*(values.reshape(shape) for values in spectra))


#: Longest phase of a stride, rad, for an undamped oscillator, and by how much damping shortens it,
#: which bends the radius. Results depend on it by rounding alone; fastest in trials.
STRIDE_PHASE, SHORTER_BY_DAMPING = 1.1, 8.0
#: Steps in a stride: only the samples at its ends are evaluated at first.
STRIDES = (1, 2, 4)
#: Groups of tiles, at most, in which the window of an oscillator is searched for.
GROUPS = 128
#: Oscillators that a thread takes at a time.
PART = 1024


class OscillatorMaxima(NamedTuple):
    """Largest radius and largest displacement of each oscillator, (n,), m."""

    per: FloatArray
    sd: FloatArray


def azimuth_maxima(
    north: ArrayLike,
    east: ArrayLike,
    dt: float,
    periods: ArrayLike,
    dampings: ArrayLike,
    azimuths: ArrayLike,
) -> OscillatorMaxima:
    """
    Compute largest radius and displacement of oscillators, each along a separate azimuth.

    Parameters
    ----------
    north, east : (n_samples,) array_like
        Components of the ground acceleration, m/s², as for `per_spectrum`.
    dt : float
        Time between samples, s.
    periods, dampings, azimuths : array_like
        Undamped periods, s, fractions of critical, and degrees clockwise from north, broadcast to
        the shape (n,).

    Returns
    -------
    OscillatorMaxima
        Two arrays (n,), m, exact between samples, with the free vibration after the record.

    Raises
    ------
    ValueError
        If an argument is not finite, out of range or of the wrong shape.

    Notes
    -----
    Bounds of the energy limit the part of the record that can hold the largest response of an
    oscillator: the motion before is left out where less than 1e-12 of it remains by then, the
    motion after it altogether.
    """
    record = tiled_record(*two_components(north, east))
    oscillators = _paired(dt, periods, dampings, azimuths)
    # Peak acceleration of groups of tiles, for the search of an oscillator's window
    width = -(-record.peaks.shape[1] // GROUPS)
    firsts = np.arange(0, record.peaks.shape[1], width)
    groups = np.maximum.reduceat(record.peaks, firsts, axis=1)
    limits = np.concatenate([record.peaks, record.jumps])

    rows = np.stack([oscillators.phases, oscillators.dampings, *oscillators.weights])
    largest = np.empty((2, oscillators.size))

    def work(part: tuple[int, NDArray[np.int64]]) -> None:
        stride, members = part
        largest_responses(
            stride, record.north, record.east, limits, groups, width, rows, members, largest
        )

    # The kernel gives the squared radius and the displacement, scaled acceleration / omega²
    in_threads(work, _parts(oscillators), oscillators.size * record.north.size)
    largest[0] = np.sqrt(largest[0])
    return OscillatorMaxima(*(largest / oscillators.omegas**2 * record.scale))


def _paired(dt: float, periods: ArrayLike, dampings: ArrayLike, azimuths: ArrayLike) -> Oscillators:
    """Return checked oscillators, (n,)."""
    dt = checks.number("dt", dt, checks.positive)
    period, damping, azimuth = np.broadcast_arrays(
        np.atleast_1d(checks.positive("periods", periods)),
        checks.fraction_of_critical("dampings", dampings),
        checks.finite("azimuths", azimuths),
    )
    return prepare_oscillators(dt, row_of("periods", period), damping, azimuth)


def _parts(oscillators: Oscillators) -> list[tuple[int, NDArray[np.int64]]]:
    """Return parts of oscillators with their stride; those of equal decay are together."""
    phase = STRIDE_PHASE / (1.0 + SHORTER_BY_DAMPING * oscillators.dampings)
    longest = np.floor(phase / oscillators.phases)
    index = np.clip(np.searchsorted(STRIDES, longest, side="right") - 1, 0, None)
    strides = np.array(STRIDES)[index]

    # Sorted by decay per step, so that the windows of a part are about equally long
    order = np.argsort(oscillators.phases * oscillators.dampings, kind="stable")
    parts = []
    for stride in STRIDES:
        members = order[strides[order] == stride]
        firsts = range(0, members.size, PART)
        parts += [(stride, members[first : first + PART]) for first in firsts]
    return parts
