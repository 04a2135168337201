"""
Records and oscillators cut for the kernels, and the only threads: one block of oscillators each.

A record is scaled by a power of two to a peak of order one (exactly undone afterwards), closed by
one ramp to zero, and filled up with zeros to whole tiles. Results do not depend on the number of
threads: a block is computed by one of them.
"""

import os
from collections.abc import Callable, Iterator, Sequence
from concurrent.futures import ThreadPoolExecutor
from typing import NamedTuple, TypeVar

import numpy as np
from numpy.typing import NDArray

from per_obspy.checks import FloatArray
from per_obspy.kernels.spectra import tile_search as blocks

Part = TypeVar("Part")
Result = TypeVar("Result")

#: Steps of all oscillators together below which starting threads costs more than it saves.
STEPS_WORTH_THREADS = 20_000_000


class Ground(NamedTuple):
    """
    Two components of a record, or of a stretch of it, ready for the kernels.

    A whole number of tiles and one sample; ``peaks`` and ``jumps`` (component, tile) are the
    largest acceleration and the largest change over a step; ``scale`` is what the samples were
    divided by.
    """

    north: FloatArray
    east: FloatArray
    peaks: FloatArray
    jumps: FloatArray
    scale: float


class Oscillators(NamedTuple):
    """Phase of one step, damping, weights of north and east (2, n), omega in rad/s; the first ``wanted`` count."""

    phases: FloatArray
    dampings: FloatArray
    weights: FloatArray
    omegas: FloatArray
    wanted: int


def prepare_ground(north: FloatArray, east: FloatArray | None = None) -> Ground:
    """Return one component, felt as it is, or two."""
    components = [north] if east is None else [north, east]
    peak = max(float(np.abs(component).max()) for component in components)
    scale = float(2.0 ** np.floor(np.log2(peak))) if peak > 0.0 else 1.0
    scaled = [_closed(component, scale) for component in components]
    peaks, jumps = np.zeros((2, 2, (scaled[0].size - 1) // blocks.TILE))
    for number, component in enumerate(scaled):
        blocks.tile_extremes(component, peaks[number], jumps[number])
    return Ground(scaled[0], scaled[-1], peaks, jumps, scale)


def _closed(acceleration: FloatArray, scale: float) -> FloatArray:
    tiles = -(-acceleration.size // blocks.TILE)
    closed = np.zeros(tiles * blocks.TILE + 1)
    np.divide(acceleration, scale, out=closed[: acceleration.size])
    return closed


def prepare_oscillators(
    dt: float, periods: FloatArray, dampings: FloatArray, azimuths: FloatArray | None = None
) -> Oscillators:
    """Return paired oscillators (n,) that feel the first component, or their own azimuths (degrees) of two."""
    omegas = 2.0 * np.pi / periods
    angles = np.zeros(periods.size) if azimuths is None else np.radians(azimuths)
    return Oscillators(
        omegas * dt,
        dampings.copy(),
        np.stack([np.cos(angles), np.sin(angles)]),
        omegas,
        periods.size,
    )


def stretches(ground: Ground) -> Iterator[Ground]:
    """Yield consecutive stretches of the record: as many tiles as are kept at a time."""
    for first in range(0, ground.peaks.shape[1], blocks.TILES):
        samples = slice(first * blocks.TILE, (first + blocks.TILES) * blocks.TILE + 1)
        tiles = slice(first, first + blocks.TILES)
        peaks, jumps = ground.peaks[:, tiles].copy(), ground.jumps[:, tiles].copy()
        yield Ground(ground.north[samples], ground.east[samples], peaks, jumps, ground.scale)


def choose(
    stretch: Ground, block: Oscillators, kept: FloatArray, largest: FloatArray
) -> NDArray[np.int64]:
    """Raise the largest values to the samples of a stretch; return (tile, lane) where more may lie in between."""
    tiles = stretch.peaks.shape[1]
    chosen = np.empty((tiles * blocks.LANES, 2), dtype=np.int64)
    count = blocks.choose_tiles(
        kept, stretch.peaks, stretch.jumps, *block[:3], block.wanted, largest, chosen
    )
    return chosen[:count]


def raise_between(
    stretch: Ground,
    block: Oscillators,
    kept: FloatArray,
    states: FloatArray,
    chosen: NDArray[np.int64],
    largest: FloatArray,
) -> None:
    """Raise the largest values by what lies between the samples of the chosen tiles, from the states before them."""
    blocks.search_tiles(*stretch[:4], *block[:3], kept, states, chosen, largest)


def raise_to_samples(stretch: Ground, kept: FloatArray, largest: FloatArray) -> None:
    """Raise the largest values to those at the samples of a stretch."""
    blocks.raise_to_tiles(kept, stretch.peaks.shape[1], largest)


def over_blocks(
    work: Callable[[Oscillators], FloatArray], oscillators: Oscillators, ground: Ground
) -> FloatArray:
    """Return the rows that the work gives for each block of oscillators, (rows, n); in threads where that pays."""
    parts = [_block(oscillators, first) for first in range(0, oscillators.wanted, blocks.LANES)]
    rows = in_threads(work, parts, oscillators.wanted * ground.north.size)
    return np.concatenate(rows, axis=1)[:, : oscillators.wanted]


def in_threads(work: Callable[[Part], Result], parts: Sequence[Part], steps: int) -> list[Result]:
    """Return what the work gives for each part, in threads where that many steps of all oscillators are worth them."""
    threads = min(len(parts), len(os.sched_getaffinity(0)))
    if threads == 1 or steps < STEPS_WORTH_THREADS:
        return [work(part) for part in parts]
    with ThreadPoolExecutor(threads) as pool:
        return list(pool.map(work, parts))


def _block(oscillators: Oscillators, first: int) -> Oscillators:
    """Return one block, filled up with copies of the last oscillator."""
    count = min(blocks.LANES, oscillators.wanted - first)
    lanes = first + np.minimum(np.arange(blocks.LANES), count - 1)
    weights = np.ascontiguousarray(oscillators.weights[:, lanes])
    return Oscillators(
        oscillators.phases[lanes],
        oscillators.dampings[lanes],
        weights,
        oscillators.omegas[lanes],
        count,
    )
