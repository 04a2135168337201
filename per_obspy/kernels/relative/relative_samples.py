r"""
Relative motion of a block of pairs at the samples: 26 multiply-adds and comparisons per step.

Time runs outside, pairs inside, four steps at a time. The relative displacement ``q1 u1 - q2 u2``
and the relative velocity are linear forms of the shifted states of both structures and the
acceleration. A pair starts at rest before the tile from which its motion counts.

The cubic through values d and slopes v at the ends of a step is bounded by its Bernstein
coefficients, ``d + dt v / 3`` at its start and ``d - dt v / 3`` at its end; near a peak these
exceed it by a third of what the peak exceeds the samples at most.
"""

import numpy as np

from per_obspy.kernels._jit import inlined, kernel
from per_obspy.kernels.oscillator.exact_step import shifted_rest, shifted_step, unshifted
from per_obspy.kernels.spectra.tile_search import SMALLEST_STATE, TILE

#: Pairs next to each other: a constant trip count, which the compiler turns into vectors.
PAIR_LANES = 32

#: Rows of a block's table, one column per pair: two step matrices; the direction; the forms of the
#: relative displacement, and of the relative velocity over the frequency of structure 1; both
#: states and the acceleration; the largest and smallest Bernstein coefficients of the relative
#: displacement and the largest relative velocity of a tile; the squares of the largest states, and
#: of relative displacement and velocity, before tiles; a third of a step, as phase of structure 1;
#: the frame of each structure. One table, because the compiler would have to prove of several
#: arrays that they do not overlap.
DIRECTION, DISTANCE, SLOPE, STATE, EXTREMES, STATE_PEAKS = 8, 10, 15, 20, 25, 28
THIRD, FRAME = 31, 32
PAIR_ROWS = 42
#: Rows that a step uses.
LOCAL = FRAME
#: Rows of a tile's checkpoint: the states before the tile (0 to 3), the largest and the smallest
#: Bernstein coefficient of the relative displacement, and the largest relative velocity over the
#: frequency of structure 1.
GREATEST, LEAST, APPROACH, PAIR_CHECKPOINT_ROWS = 4, 5, 6, 7


@kernel
def pack_pair(pair, dt, table, lane):
    """
    Fill the rows of a pair.

    ``pair`` (8,): circular frequency, damping and participation of structure 1, then of 2; cosine
    and sine of the azimuth.
    """
    table[THIRD, lane] = pair[0] * dt / 3.0
    table[DIRECTION, lane] = pair[6]
    table[DIRECTION + 1, lane] = pair[7]
    table[DISTANCE + 4, lane] = table[SLOPE + 4, lane] = 0.0
    for body in range(2):
        # Step matrix and frame of the shifted states
        matrix, frame = shifted_step(pair[3 * body], pair[3 * body + 1], dt)
        scale, c, s, shift_u, shift_z = frame
        for row in range(4):
            table[4 * body + row, lane] = matrix[row]
        for row in range(5):
            table[FRAME + 5 * body + row, lane] = frame[row]
        # Relative displacement, q1 u1 - q2 u2, as a form of the shifted states
        weight = pair[3 * body + 2] * (1.0 - 2.0 * body)
        table[DISTANCE + 2 * body, lane] = weight * scale * c
        table[DISTANCE + 2 * body + 1, lane] = -weight * scale * s
        table[DISTANCE + 4, lane] += weight * shift_u
        # Relative velocity over the frequency of structure 1
        slope = weight * pair[3 * body] / pair[0]
        table[SLOPE + 2 * body, lane] = slope * scale * s
        table[SLOPE + 2 * body + 1, lane] = slope * scale * c
        table[SLOPE + 4, lane] += slope * shift_z


@kernel
def frame_of(body, table, lane):
    """Return scale, rotation and shift of a structure."""
    row = FRAME + 5 * body
    return (
        table[row, lane],
        table[row + 1, lane],
        table[row + 2, lane],
        table[row + 3, lane],
        table[row + 4, lane],
    )


@kernel
def start_pairs_at_rest(north, east, tile, windows, table, local):
    """Fill the shifted states of the structures that are at rest before a tile."""
    for lane in range(PAIR_LANES):
        if tile != windows[0, lane]:
            continue
        # Acceleration along the pair's azimuth
        acceleration = table[DIRECTION, lane] * north + table[DIRECTION + 1, lane] * east
        for body in range(2):
            along, across = shifted_rest(frame_of(body, table, lane), acceleration)
            local[STATE + 2 * body, lane] = along
            local[STATE + 2 * body + 1, lane] = across


@kernel
def state_of(body, table, lane, along, across, acceleration):
    """Return displacement and velocity over frequency of a structure from its shifted state."""
    return unshifted(frame_of(body, table, lane), along, across, acceleration)


@kernel
def run_pair_tiles(north, east, first_tile, windows, table, checkpoints):
    """
    Advance a block; store, per tile, the states before it and the extreme relative motion.

    ``north`` and ``east``: a whole number of tiles and one sample, the first of them of the number
    ``first_tile``; ``windows`` (2, lanes): the tile before which each pair is at rest, and the last
    one that counts; ``checkpoints`` (tile, row, lane).
    """
    local = np.empty((LOCAL, PAIR_LANES))  # of a size that the compiler knows: it makes vectors
    local[:] = table[:LOCAL]
    for first in range(0, north.size - 1, TILE):
        # Pairs that start here, and the states before the tile
        tile = first_tile + first // TILE
        start_pairs_at_rest(north[first], east[first], tile, windows, table, local)
        _open_tile(north[first], east[first], tile, windows, local, checkpoints[first // TILE])
        _run_tile(north, east, first, local)
        for lane in range(PAIR_LANES):
            checkpoints[first // TILE, GREATEST, lane] = local[EXTREMES, lane]
            checkpoints[first // TILE, LEAST, lane] = local[EXTREMES + 1, lane]
            checkpoints[first // TILE, APPROACH, lane] = local[EXTREMES + 2, lane]
    table[:LOCAL] = local


@kernel
def _open_tile(north, east, tile, windows, t, checkpoint):
    """Store the states before a tile, and start its largest and smallest values with theirs."""
    for lane in range(PAIR_LANES):
        # Shifted states of structures 1 (u, z) and 2 (w, y); denormal numbers become zero
        u, z = _flushed(t[20, lane]), _flushed(t[21, lane])
        w, y = _flushed(t[22, lane]), _flushed(t[23, lane])
        # Relative displacement and velocity at the first sample
        p = t[8, lane] * north + t[9, lane] * east
        distance = (t[10, lane] * u + t[11, lane] * z) + (
            t[12, lane] * w + (t[13, lane] * y + t[14, lane] * p)
        )
        slope = (t[15, lane] * u + t[16, lane] * z) + (
            t[17, lane] * w + (t[18, lane] * y + t[19, lane] * p)
        )
        # Start of the tile: states, acceleration, first Bernstein coefficient, velocity
        t[20, lane], t[21, lane], t[22, lane], t[23, lane], t[24, lane] = u, z, w, y, p
        first = distance + t[31, lane] * slope
        t[25, lane], t[26, lane], t[27, lane] = max(distance, first), min(distance, first), slope
        # Squares of the largest states before tiles that count, for the bounds
        counts = 1.0 if windows[0, lane] <= tile <= windows[1, lane] else 0.0
        t[28, lane] = max(t[28, lane], counts * (u * u + z * z))
        t[29, lane] = max(t[29, lane], counts * (w * w + y * y))
        t[30, lane] = max(t[30, lane], counts * (distance * distance + slope * slope))
        # Checkpoint
        checkpoint[0, lane], checkpoint[1, lane] = u, z
        checkpoint[2, lane], checkpoint[3, lane] = w, y


@kernel
def _flushed(value):
    return value if abs(value) > SMALLEST_STATE else 0.0


@inlined
def _run_tile(north, east, first, t):
    """Advance a block over a tile, four steps at a time."""
    for i in range(first + 1, first + TILE + 1, 4):
        # Samples of four steps, of both components
        north_1, north_2, north_3, north_4 = north[i], north[i + 1], north[i + 2], north[i + 3]
        east_1, east_2, east_3, east_4 = east[i], east[i + 1], east[i + 2], east[i + 3]
        for lane in range(PAIR_LANES):
            # Acceleration along the pair's azimuth
            p1 = t[8, lane] * north_1 + t[9, lane] * east_1
            p2 = t[8, lane] * north_2 + t[9, lane] * east_2
            p3 = t[8, lane] * north_3 + t[9, lane] * east_3
            p4 = t[8, lane] * north_4 + t[9, lane] * east_4
            # Four steps of both structures, with their relative displacement d and velocity v
            u, z, w, y, d1, v1 = _moved(
                t, lane, t[20, lane], t[21, lane], t[22, lane], t[23, lane], t[24, lane], p1
            )
            u, z, w, y, d2, v2 = _moved(t, lane, u, z, w, y, p1, p2)
            u, z, w, y, d3, v3 = _moved(t, lane, u, z, w, y, p2, p3)
            u, z, w, y, d4, v4 = _moved(t, lane, u, z, w, y, p3, p4)
            t[20, lane], t[21, lane], t[22, lane], t[23, lane], t[24, lane] = u, z, w, y, p4
            # Distance of the Bernstein coefficients from the samples
            s1, s2 = abs(t[31, lane] * v1), abs(t[31, lane] * v2)
            s3, s4 = abs(t[31, lane] * v3), abs(t[31, lane] * v4)
            # Largest of them
            early = max(d1 + s1, d2 + s2)
            late = max(d3 + s3, d4 + s4)
            t[25, lane] = max(t[25, lane], early, late)
            # Smallest of them
            early = min(d1 - s1, d2 - s2)
            late = min(d3 - s3, d4 - s4)
            t[26, lane] = min(t[26, lane], early, late)
            # Largest relative velocity
            early = max(v1, v2)
            late = max(v3, v4)
            t[27, lane] = max(t[27, lane], early, late)


@inlined
def _moved(t, lane, u, z, w, y, start, end):
    """Return the states after one step and their relative displacement and velocity."""
    # Shifted steps of structures 1 (u, z) and 2 (w, y)
    u, z = t[0, lane] * u + (t[1, lane] * z + start), t[2, lane] * u + t[3, lane] * z
    w, y = t[4, lane] * w + (t[5, lane] * y + start), t[6, lane] * w + t[7, lane] * y
    # Their forms q1 u1 - q2 u2 and q1 v1 - q2 v2
    distance = (t[10, lane] * u + t[11, lane] * z) + (
        t[12, lane] * w + (t[13, lane] * y + t[14, lane] * end)
    )
    slope = (t[15, lane] * u + t[16, lane] * z) + (
        t[17, lane] * w + (t[18, lane] * y + t[19, lane] * end)
    )
    return u, z, w, y, distance, slope
