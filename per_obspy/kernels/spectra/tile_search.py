r"""
The search of tiles of steps for largest values between samples, of blocks of oscillators.

A first pass runs a block over the samples, looks at all of them or at every second or fourth, and
stores, per tile, a checkpoint: the state before it and the largest values looked at. A value
exceeds the larger of two looked at by an eighth of their squared distance in phase times its second
derivative at most. Only tiles where that bound exceeds the largest value are repeated, one
oscillator at a time, exactly between the samples. Displacements are counted in ``a / omega²``, time
as phase. Largest values come in one row (squared radius ``u² + z²``), in two (also ``|u|``) or in
four (also ``|z|`` and absolute acceleration ``|u + 2 xi z|``).
"""

import numpy as np

from per_obspy.kernels._jit import kernel, lean
from per_obspy.kernels.oscillator.exact_step import step_coefficients
from per_obspy.kernels.oscillator.within_step import (
    radius_bound,
    raise_in_step,
    rate_bounds,
    series_terms,
    slacks,
    step_velocity_bound,
    velocity_slack,
    workspace,
)

#: Oscillators next to each other: a constant trip count, which the compiler turns into vectors.
LANES = 64
#: Steps after which the state is stored.
TILE = 64
#: Accumulators next to each other of a reduction, as many as fit into the widest vectors.
SIDE = 8
#: Tiles with a checkpoint at a time: memory stays constant however long the record is.
TILES = 384
#: States below this are set to zero (records are scaled to a peak of order one): denormal numbers
#: are slow.
SMALLEST_STATE = 1e-140


@kernel
def tile_extremes(acceleration, peaks, jumps):
    """
    Fill the largest acceleration and the largest change over a step of each tile.

    Parameters
    ----------
    acceleration : (tiles * TILE + 1,) ndarray
        Ground acceleration, scaled to a peak of order one.
    peaks : (tiles,) ndarray
        Receives the largest absolute acceleration of each tile, in the unit of the acceleration.
    jumps : (tiles,) ndarray
        Receives the largest absolute change over one step of each tile, in the same unit.
    """
    peak = np.empty(SIDE)
    jump = np.empty(SIDE)
    for tile in range((acceleration.size - 1) // TILE):
        # Every SIDE-th step of the tile in its own accumulator
        first = tile * TILE
        for k in range(SIDE):
            peak[k] = abs(acceleration[first])
            jump[k] = 0.0
        for i in range(first, first + TILE, SIDE):
            for k in range(SIDE):
                start, end = acceleration[i + k], acceleration[i + k + 1]
                peak[k], jump[k] = max(peak[k], abs(end)), max(jump[k], abs(end - start))
        # Largest of the accumulators
        peaks[tile] = peak[0]
        jumps[tile] = jump[0]
        for k in range(1, SIDE):
            peaks[tile] = max(peaks[tile], peak[k])
            jumps[tile] = max(jumps[tile], jump[k])


@kernel
def raise_to_tiles(checkpoints, tiles, largest):
    """
    Raise the largest values to those at the samples of the tiles.

    Parameters
    ----------
    checkpoints : (TILES, 2 + quantities, LANES) ndarray
        Rows: the state before a tile (2), then its largest sampled values.
    tiles : int
        Number of tiles that are filled.
    largest : (quantities, LANES) ndarray
        Largest values, raised in place, in the same rows and units.
    """
    for tile in range(tiles):
        for row in range(largest.shape[0]):
            for lane in range(LANES):
                largest[row, lane] = max(largest[row, lane], checkpoints[tile, 2 + row, lane])


@kernel
def raise_between_samples(
    stride, north, east, limits, oscillators, begin, windows, checkpoints, largest
):
    """
    Raise the largest values to those between the samples of all tiles that count.

    Parameters
    ----------
    stride : int
        Steps from one sample that was looked at to the next.
    north, east : (tiles * TILE + 1,) ndarray
        Components of the ground acceleration, scaled to a peak of order one.
    limits : (4, tiles) ndarray
        Largest absolute acceleration of north and of east in each tile, then their largest changes
        over a step, from `tile_extremes`.
    oscillators : (4, lanes) ndarray
        Rows: phase ``omega * dt`` of a step (rad), fraction of critical, factors of north and east.
    begin : int
        Number of the first tile.
    windows : (2, lanes) ndarray
        Numbers of the first and the last tile that count for each oscillator.
    checkpoints : (TILES, 2 + quantities, lanes) ndarray
        Rows: the state before a tile (2), then its largest values looked at.
    largest : (quantities, lanes) ndarray
        Largest values so far, raised in place.
    """
    quantities, lanes = largest.shape
    tiles = limits.shape[1]
    leaders, threshold = np.empty((quantities, lanes)), np.empty((quantities, lanes))
    excess = np.empty(lanes)
    # Room of one tile: motion, marks of its steps, series, largest values that it can exceed
    room = np.empty((3, TILE + 1)), np.empty(TILE), workspace(), np.empty(4)
    # The tiles with the largest samples first: they raise the thresholds of all others
    _raise_to_windows(checkpoints, begin, tiles, windows, largest, leaders)
    for lane in range(lanes):
        for row in range(quantities):
            tile = int(leaders[row, lane])
            is_searched = False
            for earlier in range(row):
                is_searched |= leaders[earlier, lane] == leaders[row, lane]
            if tile >= 0 and not is_searched:
                _search_tile(
                    stride, north, east, limits, tile, oscillators, lane, checkpoints, room, largest
                )
    # Then every other tile whose samples come close enough to the largest values
    _fill_thresholds(stride, limits, oscillators, windows, largest, threshold)
    for tile in range(tiles):
        if not _any_beyond(checkpoints[tile], threshold, excess):
            continue
        for lane in range(lanes):
            is_open = excess[lane] > 0.0 and windows[0, lane] <= begin + tile <= windows[1, lane]
            for row in range(quantities):
                is_open &= leaders[row, lane] != tile
            if is_open:
                _search_tile(
                    stride, north, east, limits, tile, oscillators, lane, checkpoints, room, largest
                )


@kernel
def _raise_to_windows(checkpoints, begin, tiles, windows, largest, leaders):
    """Raise the largest values to those looked at in windows; fill their tiles, -1 for none."""
    leaders[:] = -1.0
    for tile in range(tiles):
        number, index = float(begin + tile), float(tile)
        for row in range(largest.shape[0]):
            for lane in range(largest.shape[1]):
                # Values count inside the oscillator's window only
                inside = windows[0, lane] <= number and number <= windows[1, lane]
                value = checkpoints[tile, 2 + row, lane] if inside else 0.0
                leaders[row, lane] = index if value > largest[row, lane] else leaders[row, lane]
                largest[row, lane] = max(largest[row, lane], value)


@lean
def _bounds(stride, limits, tile, oscillators, lane, square, velocity):
    """
    Return bounds of radius and rates in a tile, and of how far values exceed those looked at.

    From the largest squared radius looked at; the velocity of every sample has a tighter bound.
    """
    phase, damping = oscillators[0, lane], oscillators[1, lane]
    north, east = abs(oscillators[2, lane]), abs(oscillators[3, lane])
    # Largest acceleration and change over a step along the azimuth
    peak = north * limits[0, tile] + east * limits[1, tile]
    jump = north * limits[2, tile] + east * limits[3, tile]
    radius = radius_bound(square, peak, damping, stride * phase)
    rates = rate_bounds(radius, peak, jump, damping, phase)
    square_slack, displacement, _, absolute = slacks(rates, damping, phase)
    # A stride is so many steps: its squared length counts
    wide = float(stride * stride)
    own = velocity_slack(velocity, rates, jump, damping, phase)
    return radius, rates, (wide * square_slack, wide * displacement, own, absolute)


@kernel
def _fill_thresholds(stride, limits, oscillators, windows, largest, threshold):
    """Fill the values looked at in a tile above which larger ones may lie between them."""
    # Strongest motion of any tile
    strongest = np.zeros((4, 1))
    for row in range(4):
        for tile in range(limits.shape[1]):
            strongest[row, 0] = max(strongest[row, 0], limits[row, tile])
    for lane in range(largest.shape[1]):
        # Bounds from the largest values so far
        velocity = largest[2, lane] if largest.shape[0] > 2 else 0.0
        _, _, slack = _bounds(stride, strongest, 0, oscillators, lane, largest[0, lane], velocity)
        for row in range(largest.shape[0]):
            counts = windows[0, lane] <= windows[1, lane]
            threshold[row, lane] = largest[row, lane] - slack[row] if counts else np.inf


@kernel
def _any_beyond(checkpoint, threshold, excess):
    """Fill by how much oscillators exceed their thresholds in a tile; return whether any does."""
    excess[:] = -np.inf
    for row in range(threshold.shape[0]):
        for lane in range(excess.size):
            excess[lane] = max(excess[lane], checkpoint[2 + row, lane] - threshold[row, lane])
    # Without branches: of most tiles no lane is beyond
    count = 0
    for lane in range(excess.size):
        count += excess[lane] > 0.0
    return count > 0


@lean
def _search_tile(stride, north, east, limits, tile, oscillators, lane, checkpoints, room, largest):
    """Raise the largest values of an oscillator to those in one tile, exact between the samples."""
    quantities = largest.shape[0]
    phase, damping = oscillators[0, lane], oscillators[1, lane]
    motion, marks, work, best = room
    # Values that the tile can exceed; the others become infinite
    square = checkpoints[tile, 2, lane]
    velocity = checkpoints[tile, 4, lane] if quantities > 2 else 0.0
    radius, rates, slack = _bounds(stride, limits, tile, oscillators, lane, square, velocity)
    is_open = False
    for row in range(4):
        best[row] = np.inf
        if row < quantities and checkpoints[tile, 2 + row, lane] + slack[row] > largest[row, lane]:
            best[row] = largest[row, lane]
            is_open = True
    if not is_open:
        return
    # States at every sample, of which not all were looked at
    _rerun(north, east, tile, oscillators, lane, checkpoints, motion, best)
    # Steps that may hold larger values
    _mark(motion, rates, damping, phase, best, marks)
    terms = series_terms(phase)
    for i in range(TILE):
        if marks[i] > 0.0:
            # State and acceleration before and after the step
            u, z, start = motion[0, i], motion[1, i], motion[2, i]
            u_end, z_end, end = motion[0, i + 1], motion[1, i + 1], motion[2, i + 1]
            ends = u, z, start, u_end, z_end, end
            raise_in_step(ends, radius, damping, phase, terms, work, best)
    for row in range(quantities):
        largest[row, lane] = best[row] if best[row] < np.inf else largest[row, lane]


@lean
def _rerun(north, east, tile, oscillators, lane, checkpoints, motion, best):
    """Fill acceleration and states at a tile's samples; raise radius and displacement to them."""
    to_north, to_east = oscillators[2, lane], oscillators[3, lane]
    for i in range(TILE + 1):
        motion[2, i] = to_north * north[tile * TILE + i] + to_east * east[tile * TILE + i]
    # From the state before the tile
    step = step_coefficients(1.0, oscillators[1, lane], oscillators[0, lane])
    a11, a12, a21, a22, b11, b12, b21, b22 = step
    u, z = checkpoints[tile, 0, lane], checkpoints[tile, 1, lane]
    motion[0, 0], motion[1, 0] = u, z
    square, displacement = 0.0, 0.0
    for i in range(TILE):
        # One exact step (Nigam & Jennings)
        start, end = motion[2, i], motion[2, i + 1]
        u, z = (
            a11 * u + (a12 * z + (b11 * start + b12 * end)),
            a21 * u + (a22 * z + (b21 * start + b22 * end)),
        )
        motion[0, i + 1], motion[1, i + 1] = u, z
        square, displacement = max(square, u * u + z * z), max(displacement, abs(u))
    # Infinite values stay
    best[0], best[1] = max(best[0], square), max(best[1], displacement)


@kernel
def _mark(motion, rates, damping, phase, best, marks):
    """Mark the steps of a tile that may hold more than the largest values by a positive number."""
    slack = slacks(rates, damping, phase)
    viscosity = 2.0 * damping
    # Values at the samples above which larger ones may lie between them
    square, displacement = best[0] - slack[0], best[1] - slack[1]
    velocity, absolute = best[2], best[3] - slack[3]
    for i in range(TILE):
        u, z, u_end, z_end = motion[0, i], motion[1, i], motion[0, i + 1], motion[1, i + 1]
        # Squared radius and displacement
        marks[i] = max(
            max(u * u + z * z, u_end * u_end + z_end * z_end) - square,
            max(abs(u), abs(u_end)) - displacement,
        )
    if min(velocity, absolute) < np.inf:
        for i in range(TILE):
            u, z, start = motion[0, i], motion[1, i], motion[2, i]
            u_end, z_end, end = motion[0, i + 1], motion[1, i + 1], motion[2, i + 1]
            # Absolute acceleration; velocity by its own bound
            larger = max(abs(u + viscosity * z), abs(u_end + viscosity * z_end))
            bound = step_velocity_bound(u, z, start, u_end, z_end, end, rates, damping, phase)
            marks[i] = max(marks[i], larger - absolute, bound - velocity)
