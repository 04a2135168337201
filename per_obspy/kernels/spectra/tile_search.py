r"""
Blocks of oscillators, tiles of steps, and the search of tiles for largest values between samples.

A first pass runs a block over the samples and stores, per tile, a checkpoint: the state before it
and the largest sampled values. Only tiles where a bound exceeds the largest value found are
repeated, one oscillator at a time, exactly between the samples. Displacements are counted in ``a /
omega²``, time as phase. Largest values come in one row (squared radius ``u² + z²``) or in four
(also ``|u|``, ``|z|`` and absolute acceleration ``|u + 2 xi z|``).
"""

import numpy as np

from per_obspy.kernels._jit import kernel
from per_obspy.kernels.oscillator.exact_step import step_coefficients
from per_obspy.kernels.oscillator.stationary import raise_within_step
from per_obspy.kernels.oscillator.within_step import (
    largest_in_step,
    radius_bound,
    rate_bounds,
    sags,
    select_conditions,
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
TILES = 256
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
def _thresholds(peaks, jumps, phases, dampings, weights, largest, threshold):
    """Fill the sampled value of a tile above which a larger one may lie between its samples."""
    # Strongest motion of any tile
    peak = np.zeros(2)
    jump = np.zeros(2)
    for component in range(2):
        for tile in range(peaks.shape[1]):
            peak[component] = max(peak[component], peaks[component, tile])
            jump[component] = max(jump[component], jumps[component, tile])
    for lane in range(LANES):
        # Along the azimuth of the oscillator
        north, east = abs(weights[0, lane]), abs(weights[1, lane])
        lane_peak = north * peak[0] + east * peak[1]
        lane_jump = north * jump[0] + east * jump[1]
        # Bounds from the largest radius so far
        radius = radius_bound(largest[0, lane], lane_peak, dampings[lane], phases[lane])
        rates = rate_bounds(radius, lane_peak, lane_jump, dampings[lane], phases[lane])
        slack = slacks(rates, dampings[lane], phases[lane])
        for row in range(largest.shape[0]):
            threshold[row, lane] = largest[row, lane] - slack[row]
        if largest.shape[0] > 1:
            more = velocity_slack(largest[2, lane], rates, lane_jump, dampings[lane], phases[lane])
            threshold[2, lane] = largest[2, lane] - more


@kernel
def choose_tiles(checkpoints, peaks, jumps, phases, dampings, weights, lanes, largest, chosen):
    """
    Raise the largest values to the samples and list the tiles that may hold larger ones in between.

    Parameters
    ----------
    checkpoints : (TILES, 2 + quantities, LANES) ndarray
        Rows: the state before a tile (2), then its largest sampled values.
    peaks, jumps : (2, tiles) ndarray
        Largest absolute acceleration and change over a step, from `tile_extremes`, of either
        component.
    phases, dampings : (LANES,) ndarray
        Phase ``omega * dt`` of a step, rad; fraction of critical.
    weights : (2, LANES) ndarray
        Factors of the north and the east component, dimensionless.
    lanes : int
        Number of oscillators that count; the others fill the block up.
    largest : (quantities, LANES) ndarray
        Largest values so far, raised in place.
    chosen : (tiles * LANES, 2) ndarray of int
        Receives (tile, lane) of the tiles to search.

    Returns
    -------
    count : int
        Number of rows of ``chosen`` that are filled.
    """
    tiles, quantities = peaks.shape[1], largest.shape[0]
    raise_to_tiles(checkpoints, tiles, largest)
    threshold = np.empty((quantities, LANES))
    _thresholds(peaks, jumps, phases, dampings, weights, largest, threshold)
    # List the tiles beyond the threshold of any quantity
    count = 0
    for tile in range(tiles):
        # Of most tiles no lane is beyond
        if not _any_beyond(checkpoints, tile, threshold):
            continue
        for lane in range(lanes):
            beyond = checkpoints[tile, 2, lane] > threshold[0, lane]
            for row in range(1, quantities):
                beyond |= checkpoints[tile, 2 + row, lane] > threshold[row, lane]
            if beyond:
                chosen[count, 0] = tile
                chosen[count, 1] = lane
                count += 1
    return count


@kernel
def _any_beyond(checkpoints, tile, threshold):
    """Return whether a tile is beyond the threshold of any quantity and lane."""
    count = 0
    for row in range(threshold.shape[0]):
        for lane in range(LANES):
            count += checkpoints[tile, 2 + row, lane] > threshold[row, lane]
    return count > 0


@kernel
def search_tiles(
    north, east, peaks, jumps, phases, dampings, weights, checkpoints, states, chosen, largest
):
    """
    Raise the largest values to those between the samples of the chosen tiles.

    Parameters
    ----------
    north, east : (tiles * TILE + 1,) ndarray
        Components of the ground acceleration, scaled to a peak of order one.
    peaks, jumps : (2, tiles) ndarray
        Largest absolute acceleration and change over a step, from `tile_extremes`, of either
        component.
    phases, dampings : (LANES,) ndarray
        Phase ``omega * dt`` of a step, rad; fraction of critical.
    weights : (2, LANES) ndarray
        Factors of the north and the east component, dimensionless.
    checkpoints : (TILES, 2 + quantities, LANES) ndarray
        Rows: the state before a tile (2), then its largest sampled values.
    states : (count, 2) ndarray
        Displacement and velocity ``z = v / omega`` before each chosen tile.
    chosen : (count, 2) ndarray of int
        Tile and lane to search, from `choose_tiles`.
    largest : (quantities, LANES) ndarray
        Largest values so far, raised in place.
    """
    quantities = largest.shape[0]
    work = workspace()
    selected = np.empty(4, np.bool_)
    current = np.full(4, np.inf)
    motion = np.empty((3, TILE + 1))
    marks = np.empty(TILE)
    for number in range(chosen.shape[0]):
        tile, lane = chosen[number]
        phase, damping = phases[lane], dampings[lane]
        to_north, to_east = weights[0, lane], weights[1, lane]
        # Bounds of this tile; leave it out if they do not exceed the largest values any more
        peak = abs(to_north) * peaks[0, tile] + abs(to_east) * peaks[1, tile]
        jump = abs(to_north) * jumps[0, tile] + abs(to_east) * jumps[1, tile]
        radius = radius_bound(checkpoints[tile, 2, lane], peak, damping, phase)
        rates = rate_bounds(radius, peak, jump, damping, phase)
        sampled = checkpoints[tile, 2:, lane]
        if not _open(sampled, rates, jump, damping, phase, largest[:, lane], current):
            continue
        # States at the samples of the tile
        motion[0, 0] = states[number, 0]
        motion[1, 0] = states[number, 1]
        for i in range(TILE + 1):
            motion[2, i] = to_north * north[tile * TILE + i] + to_east * east[tile * TILE + i]
        _rerun(step_coefficients(1.0, damping, phase), motion)
        # Find the steps that may hold larger values
        _mark(motion, rates, damping, phase, quantities, current, marks)
        bounds = radius, rates, slacks(rates, damping, phase), sags(rates, damping, phase)
        _search_steps(motion, marks, bounds, damping, phase, quantities, work, selected, current)
        # Infinity marks values that this tile cannot raise
        for row in range(quantities):
            largest[row, lane] = current[row] if current[row] < np.inf else largest[row, lane]


@kernel
def _search_steps(motion, marks, bounds, damping, phase, quantities, work, selected, current):
    """Raise the largest values to those at the stationary points of the marked steps."""
    terms = series_terms(phase)
    for i in range(TILE):
        if marks[i] <= 0.0:
            continue
        # State and acceleration before and after the step
        u, z, start = motion[0, i], motion[1, i], motion[2, i]
        u_end, z_end, end = motion[0, i + 1], motion[1, i + 1], motion[2, i + 1]
        ends = (u, z, start, u_end, z_end, end)
        # The radius alone mostly has one root per step
        if quantities == 1:
            raise_within_step(ends, bounds, damping, phase, terms, 1, selected, work, current)
        elif select_conditions(*ends, damping, phase, bounds[0], quantities, current, selected):
            largest_in_step(u, z, start, end, damping, phase, selected, work, current)


@kernel
def _open(sampled, rates, jump, damping, phase, largest, current):
    """
    Copy those largest values that a tile can exceed; return whether there are any.

    The others become infinity.
    """
    slack = slacks(rates, damping, phase)
    any_beyond = False
    for row in range(largest.size):
        # The velocity has a tighter bound of its own
        more = velocity_slack(sampled[2], rates, jump, damping, phase) if row == 2 else slack[row]
        exceeds = sampled[row] + more > largest[row]
        current[row] = largest[row] if exceeds else np.inf
        any_beyond |= exceeds
    return any_beyond


@kernel
def _rerun(coefficients, motion):
    """Fill displacement and velocity at the samples of a tile from those in the first column."""
    a11, a12, a21, a22, b11, b12, b21, b22 = coefficients
    u, z = motion[0, 0], motion[1, 0]
    for i in range(TILE):
        # One exact step (Nigam & Jennings)
        start, end = motion[2, i], motion[2, i + 1]
        u_end = a11 * u + (a12 * z + (b11 * start + b12 * end))
        z_end = a21 * u + (a22 * z + (b21 * start + b22 * end))
        u = u_end
        z = z_end
        motion[0, i + 1] = u
        motion[1, i + 1] = z


@kernel
def _mark(motion, rates, damping, phase, quantities, current, marks):
    """Mark the steps of a tile that may hold more than the largest values by a positive number."""
    slack = slacks(rates, damping, phase)
    viscosity = 2.0 * damping
    # Values at the samples above which larger ones may lie between them
    radius = current[0] - slack[0]
    displacement = current[1] - slack[1]
    velocity = current[2]
    absolute = current[3] - slack[3]
    # Squared radius
    for i in range(TILE):
        u, z, u_end, z_end = motion[0, i], motion[1, i], motion[0, i + 1], motion[1, i + 1]
        marks[i] = max(u * u + z * z, u_end * u_end + z_end * z_end) - radius
    if quantities > 1:
        for i in range(TILE):
            u, z, start = motion[0, i], motion[1, i], motion[2, i]
            u_end, z_end, end = motion[0, i + 1], motion[1, i + 1], motion[2, i + 1]
            # Displacement and absolute acceleration
            marks[i] = max(marks[i], max(abs(u), abs(u_end)) - displacement)
            larger = max(abs(u + viscosity * z), abs(u_end + viscosity * z_end))
            marks[i] = max(marks[i], larger - absolute)
            # Velocity, by its own bound
            bound = step_velocity_bound(u, z, start, u_end, z_end, end, rates, damping, phase)
            marks[i] = max(marks[i], bound - velocity)
