"""
Records and oscillators cut for the kernels, and threads: one block of oscillators each.

A record is scaled by a power of two to a peak of order one (exactly undone afterwards), closed by
one ramp to zero, and filled up with zeros to whole tiles. Results do not depend on the number of
threads: a block is computed by one of them.
"""

import math
from collections.abc import Callable, Iterator, Sequence
from typing import NamedTuple, TypeVar

import numpy as np
from numpy.typing import NDArray

from per_obspy.checks import FloatArray
from per_obspy.kernels.spectra import tile_search as blocks
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


def select_tiles(
    stretch: TiledRecord, block: Oscillators, tile_states: FloatArray, largest: FloatArray
) -> NDArray[np.int64]:
    """
    Raise the largest values to the samples of a stretch and select tiles for the search between.

    Returns
    -------
    selected : (n, 2) ndarray of int
        Tile and lane wherever the bounds allow a larger value between the samples.
    """
    tiles = stretch.peaks.shape[1]
    selected = np.empty((tiles * blocks.LANES, 2), dtype=np.int64)
    count = blocks.choose_tiles(
        tile_states, stretch.peaks, stretch.jumps, *block[:3], block.size, largest, selected
    )
    return selected[:count]


def raise_between_samples(
    stretch: TiledRecord,
    block: Oscillators,
    tile_states: FloatArray,
    states: FloatArray,
    selected: NDArray[np.int64],
    largest: FloatArray,
) -> None:
    """Raise the largest values by the motion between the samples of tiles, from their states."""
    blocks.search_tiles(*stretch[:4], *block[:3], tile_states, states, selected, largest)


def raise_to_samples(stretch: TiledRecord, tile_states: FloatArray, largest: FloatArray) -> None:
    """Raise the largest values to those at the samples of a stretch."""
    blocks.raise_to_tiles(tile_states, stretch.peaks.shape[1], largest)


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
