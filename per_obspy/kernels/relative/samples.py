r"""
Relative displacement of a block of pairs at the samples: seventeen multiply-adds and comparisons a step of a pair.

Time runs outside, pairs inside, four steps at a time. The relative displacement is a linear form of
the shifted states of both structures and the acceleration.
"""

import numpy as np

from per_obspy.kernels._jit import kernel
from per_obspy.kernels.oscillator.shifted_step import shifted_rest, shifted_step, unshifted

#: Pairs side by side: a constant trip count, which the compiler turns into vectors.
LANES = 32
#: Steps after which the states are kept.
TILE = 64
#: States below this are set to zero: denormal numbers are slow.
SMALLEST_STATE = 1e-140

#: Rows of a block's table, one column a pair: two step matrices; the direction; the forms of the
#: relative displacement, and of the relative velocity over the frequency of structure 1; both
#: states and the acceleration; the largest and smallest relative displacement of a tile; the
#: squares of the largest states, and of relative displacement and velocity, before tiles; the frame
#: of each structure. One table, because the compiler would have to prove of several arrays that
#: they do not overlap.
DIRECTION, DISTANCE, SLOPE, STATE, EXTREMES, REACH, FRAME, ROWS = 8, 10, 15, 20, 25, 27, 30, 40
LOCAL = FRAME  # rows that a step uses
#: Rows of what is kept of a tile: the states before it, the largest and the smallest relative
#: displacement.
KEPT, HIGHEST, LOWEST = 6, 4, 5


@kernel
def pack_pair(pair, dt, table, lane):
    """Fill the rows of a pair: circular frequency, damping, participation of 1, of 2; cosine, sine of the azimuth."""
    table[DIRECTION, lane], table[DIRECTION + 1, lane] = pair[6], pair[7]
    table[DISTANCE + 4, lane] = table[SLOPE + 4, lane] = 0.0
    for body in range(2):
        matrix, frame = shifted_step(pair[3 * body], pair[3 * body + 1], dt)
        scale, c, s, shift_u, shift_z = frame
        for row in range(4):
            table[4 * body + row, lane] = matrix[row]
        for row in range(5):
            table[FRAME + 5 * body + row, lane] = frame[row]
        weight = pair[3 * body + 2] * (1.0 - 2.0 * body)
        slope = weight * pair[3 * body] / pair[0]
        table[DISTANCE + 2 * body, lane], table[DISTANCE + 2 * body + 1, lane] = (
            weight * scale * c,
            -weight * scale * s,
        )
        table[SLOPE + 2 * body, lane], table[SLOPE + 2 * body + 1, lane] = (
            slope * scale * s,
            slope * scale * c,
        )
        table[DISTANCE + 4, lane] += weight * shift_u
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
def start_at_rest(north, east, table):
    """Fill the shifted states of structures at rest under the first accelerations; nothing has been reached."""
    table[REACH : REACH + 3] = 0.0
    for lane in range(LANES):
        acceleration = table[DIRECTION, lane] * north + table[DIRECTION + 1, lane] * east
        for body in range(2):
            along, across = shifted_rest(frame_of(body, table, lane), acceleration)
            table[STATE + 2 * body, lane], table[STATE + 2 * body + 1, lane] = along, across


@kernel
def state_of(body, table, lane, along, across, acceleration):
    """Return displacement and velocity over frequency of a structure from its shifted state."""
    return unshifted(frame_of(body, table, lane), along, across, acceleration)


@kernel
def run_tiles(north, east, table, kept):
    """Advance a block; keep, per tile, the states before it and the largest and smallest relative displacement."""
    local = np.empty((LOCAL, LANES))  # of a size that the compiler knows, so that it makes vectors
    local[:] = table[:LOCAL]
    for first in range(0, north.size - 1, TILE):
        _open_tile(north[first], east[first], local, kept[first // TILE])
        _run_tile(north, east, first, local)
        for lane in range(LANES):
            kept[first // TILE, HIGHEST, lane] = local[EXTREMES, lane]
            kept[first // TILE, LOWEST, lane] = local[EXTREMES + 1, lane]
    table[:LOCAL] = local


@kernel
def _open_tile(north, east, t, kept):
    """Keep the states before a tile, raise the reach to them, and start the largest and smallest value with theirs."""
    for lane in range(LANES):
        u, z = _flushed(t[20, lane]), _flushed(t[21, lane])
        w, y = _flushed(t[22, lane]), _flushed(t[23, lane])
        p = t[8, lane] * north + t[9, lane] * east
        distance = (t[10, lane] * u + t[11, lane] * z) + (
            t[12, lane] * w + (t[13, lane] * y + t[14, lane] * p)
        )
        slope = (t[15, lane] * u + t[16, lane] * z) + (
            t[17, lane] * w + (t[18, lane] * y + t[19, lane] * p)
        )
        t[20, lane], t[21, lane], t[22, lane], t[23, lane], t[24, lane] = u, z, w, y, p
        t[25, lane], t[26, lane] = distance, distance
        t[27, lane], t[28, lane] = max(t[27, lane], u * u + z * z), max(t[28, lane], w * w + y * y)
        t[29, lane] = max(t[29, lane], distance * distance + slope * slope)
        kept[0, lane], kept[1, lane], kept[2, lane], kept[3, lane] = u, z, w, y


@kernel
def _flushed(value):
    return value if abs(value) > SMALLEST_STATE else 0.0


@kernel
def _run_tile(north, east, first, t):
    """Advance a block over a tile, four steps at a time."""
    for i in range(first + 1, first + TILE + 1, 4):
        north_1, north_2, north_3, north_4 = north[i], north[i + 1], north[i + 2], north[i + 3]
        east_1, east_2, east_3, east_4 = east[i], east[i + 1], east[i + 2], east[i + 3]
        for lane in range(LANES):
            p1, p2 = (
                t[8, lane] * north_1 + t[9, lane] * east_1,
                t[8, lane] * north_2 + t[9, lane] * east_2,
            )
            p3, p4 = (
                t[8, lane] * north_3 + t[9, lane] * east_3,
                t[8, lane] * north_4 + t[9, lane] * east_4,
            )
            u, z, w, y, d1 = _moved(
                t, lane, t[20, lane], t[21, lane], t[22, lane], t[23, lane], t[24, lane], p1
            )
            u, z, w, y, d2 = _moved(t, lane, u, z, w, y, p1, p2)
            u, z, w, y, d3 = _moved(t, lane, u, z, w, y, p2, p3)
            u, z, w, y, d4 = _moved(t, lane, u, z, w, y, p3, p4)
            t[20, lane], t[21, lane], t[22, lane], t[23, lane], t[24, lane] = u, z, w, y, p4
            early, late = max(d1, d2), max(d3, d4)
            t[25, lane] = max(t[25, lane], early, late)
            early, late = min(d1, d2), min(d3, d4)
            t[26, lane] = min(t[26, lane], early, late)


@kernel
def _moved(t, lane, u, z, w, y, start, end):
    """Return the states after one step and their relative displacement."""
    u, z = t[0, lane] * u + (t[1, lane] * z + start), t[2, lane] * u + t[3, lane] * z
    w, y = t[4, lane] * w + (t[5, lane] * y + start), t[6, lane] * w + t[7, lane] * y
    return (
        u,
        z,
        w,
        y,
        (t[10, lane] * u + t[11, lane] * z)
        + (t[12, lane] * w + (t[13, lane] * y + t[14, lane] * end)),
    )
