r"""
Relative motion of a block of pairs at the samples: 16 multiply-adds per step.

Time runs outside, pairs inside, four steps at a time. The state of a structure is shifted by its
part that follows the acceleration at the end of a step, so that the acceleration at the start is
the only input, and counted in what it adds to the relative displacement ``q1 u1 - q2 u2`` and to a
third of its change per step: both are differences of states and a multiple of the acceleration.
A pair starts at rest before the tile from which its motion counts.

The cubic through values d and slopes v at the ends of a step is bounded by its Bernstein
coefficients, ``d + dt v / 3`` at its start and ``d - dt v / 3`` at its end; near a peak these
exceed it by a third of what the peak exceeds the samples at most.
"""

from per_obspy.kernels._aligned import aligned_line
from per_obspy.kernels._jit import inlined, kernel, lean, vectorised
from per_obspy.kernels.oscillator.exact_step import step_coefficients
from per_obspy.kernels.spectra.tile_search import SMALLEST_STATE, TILE

#: Pairs next to each other: a constant trip count, which the compiler turns into vectors.
PAIR_LANES = 32
#: Instead of a participation of zero, by which states could not be divided.
SMALLEST_SHARE = 1e-60

#: Rows of a block's table, one column per pair: matrix and input of a step of structure 1, then of
#: 2; the direction; what the acceleration adds to relative displacement and reach, a third of the
#: displacement's change per step; both states and the acceleration; the largest and smallest
#: Bernstein coefficients of the relative displacement and the largest reach of a tile; the squares
#: of the largest states, and of relative displacement and velocity over the frequency of structure
#: 1, before tiles; whether a tile counts; the latter over the reach; displacement and velocity of
#: structure 1 and 2 over those of the state; the shift of each structure. One table, because the
#: compiler would have to prove of several arrays that they do not overlap.
STEP_ROWS, DIRECTION, FOLLOWED, STATE, EXTREMES, STATE_PEAKS = 6, 12, 14, 16, 21, 24
COUNTS, PER_REACH, UNITS, SHIFT, PAIR_ROWS = 27, 28, 29, 33, 37
#: Rows that a step uses, and where each begins in one line of memory: it needs one pointer.
LOCAL = SHIFT
A11, A12, A21, A22, A1, A2 = (row * PAIR_LANES for row in range(STEP_ROWS))
B11, B12, B21, B22, B1, B2 = (row * PAIR_LANES for row in range(STEP_ROWS, DIRECTION))
NORTH, EAST, OF_DISTANCE, OF_REACH = (row * PAIR_LANES for row in range(DIRECTION, STATE))
U, Z, W, Y, P = (row * PAIR_LANES for row in range(STATE, EXTREMES))
HIGH, LOW, FAST = (row * PAIR_LANES for row in range(EXTREMES, STATE_PEAKS))
SQUARE_1, SQUARE_2, SQUARE, COUNTED = (row * PAIR_LANES for row in range(STATE_PEAKS, PER_REACH))
PER, U_UNIT, Z_UNIT, W_UNIT, Y_UNIT = (row * PAIR_LANES for row in range(PER_REACH, SHIFT))
#: Rows of a tile's checkpoint: the states before the tile (0 to 3), the largest and the smallest
#: Bernstein coefficient of the relative displacement, and the largest reach: relative velocity
#: times a third of a step.
GREATEST, LEAST, APPROACH, PAIR_CHECKPOINT_ROWS = 4, 5, 6, 7


@lean
def pack_pair(pair, dt, table, lane):
    """
    Fill the rows of a pair.

    ``pair`` (8,): circular frequency, damping and participation of structure 1, then of 2; cosine
    and sine of the azimuth.
    """
    table[DIRECTION, lane], table[DIRECTION + 1, lane] = pair[6], pair[7]
    table[PER_REACH, lane] = 3.0 / (pair[0] * dt)
    table[FOLLOWED, lane] = table[FOLLOWED + 1, lane] = 0.0
    for body in range(2):
        # Displacement and velocity over frequency in the relative displacement and reach
        omega, share = pair[3 * body], max(pair[3 * body + 2], SMALLEST_SHARE)
        coefficients = step_coefficients(omega, pair[3 * body + 1], dt)
        units = share, share * omega * dt / 3.0
        _pack_structure(body, coefficients, units, table, lane)


@lean
def _pack_structure(body, coefficients, units, table, lane):
    """Fill the rows of a structure, which is counted in units of its displacement and velocity."""
    a11, a12, a21, a22, b11, b12, b21, b22 = coefficients
    along, across = units
    # Step matrix
    row = STEP_ROWS * body
    table[row, lane], table[row + 1, lane] = a11, a12 * along / across
    table[row + 2, lane], table[row + 3, lane] = a21 * across / along, a22
    # The shifted state is driven by the acceleration at the start only
    table[row + 4, lane] = along * (a11 * b12 + a12 * b22 + b11)
    table[row + 5, lane] = across * (a21 * b12 + a22 * b22 + b21)
    # Units, shift, and what the shift adds to the relative motion
    unit, shift = UNITS + 2 * body, SHIFT + 2 * body
    table[unit, lane], table[unit + 1, lane] = 1.0 / along, 1.0 / across
    table[shift, lane], table[shift + 1, lane] = b12, b22
    sign = 1.0 - 2.0 * body
    table[FOLLOWED, lane] += sign * along * b12
    table[FOLLOWED + 1, lane] += sign * across * b22


@lean
def shift_of(body, table, lane):
    """Return displacement and velocity over frequency that follow an acceleration of 1."""
    return table[SHIFT + 2 * body, lane], table[SHIFT + 2 * body + 1, lane]


@lean
def state_of(body, table, lane, along, across, acceleration):
    """Return displacement and velocity over frequency of a structure from its shifted state."""
    shift_u, shift_z = shift_of(body, table, lane)
    u = table[UNITS + 2 * body, lane] * along + shift_u * acceleration
    z = table[UNITS + 2 * body + 1, lane] * across + shift_z * acceleration
    return u, z


@kernel
def run_pair_tiles(north, east, first_tile, windows, table, checkpoints):
    """
    Advance a block; store, per tile, the states before it and the extreme relative motion.

    ``north`` and ``east``: a whole number of tiles and one sample, the first of them of the number
    ``first_tile``; ``windows`` (2, lanes): the tile before which each pair is at rest, and the last
    one that counts; ``checkpoints`` (tile, row, lane).
    """
    local = aligned_line(table, LOCAL, PAIR_LANES)
    for first in range(0, north.size - 1, TILE):
        # Pairs that start here, and the states before the tile
        tile, place = first_tile + first // TILE, first // TILE
        if _count_lanes(tile, windows, local):
            _start_at_rest(north[first], east[first], tile, windows, table, local)
        _open_tile(north[first], east[first], local)
        _copy_rows(local, STATE, 4, checkpoints[place, :GREATEST])
        _run_tile(north, east, first, local)
        # Its largest values
        _copy_rows(local, EXTREMES, 3, checkpoints[place, GREATEST:])
    _copy_rows(local, STATE, COUNTS - STATE, table[STATE:COUNTS])


@vectorised
def _count_lanes(tile, windows, local):
    """Fill whether a tile counts; return the number of pairs that are at rest before it."""
    starts = 0
    for lane in range(PAIR_LANES):
        begins, ends = windows[0, lane], windows[1, lane]
        local[COUNTED + lane] = 1.0 if (begins <= tile) & (tile <= ends) else 0.0
        starts += 1 if begins == tile else 0
    return starts


@vectorised
def _start_at_rest(north, east, tile, windows, table, local):
    """Fill the shifted states of the structures that are at rest before a tile."""
    for lane in range(PAIR_LANES):
        if tile != windows[0, lane]:
            continue
        # Acceleration along the pair's azimuth
        acceleration = table[DIRECTION, lane] * north + table[DIRECTION + 1, lane] * east
        for row in range(4):
            rest = -table[SHIFT + row, lane] / table[UNITS + row, lane] * acceleration
            local[(STATE + row) * PAIR_LANES + lane] = rest


@vectorised
def _copy_rows(local, first, count, rows):
    """Copy some rows of a block's line of memory."""
    for row in range(count):
        for lane in range(PAIR_LANES):
            rows[row, lane] = local[(first + row) * PAIR_LANES + lane]


@inlined
def _open_tile(north, east, t):
    """Start the largest and smallest values of a tile with those of the states before it."""
    for lane in range(PAIR_LANES):
        # Shifted states of structures 1 (u, z) and 2 (w, y); denormal numbers become zero
        u, z = _flushed(t[U + lane]), _flushed(t[Z + lane])
        w, y = _flushed(t[W + lane]), _flushed(t[Y + lane])
        # Relative displacement and reach at the first sample
        p = t[NORTH + lane] * north + t[EAST + lane] * east
        distance = (u - w) + t[OF_DISTANCE + lane] * p
        reach = (z - y) + t[OF_REACH + lane] * p
        # Start of the tile: states, acceleration, first Bernstein coefficient, reach
        t[U + lane], t[Z + lane], t[W + lane], t[Y + lane], t[P + lane] = u, z, w, y, p
        first = distance + reach
        t[HIGH + lane], t[LOW + lane] = max(distance, first), min(distance, first)
        t[FAST + lane] = reach
        # Squares of the largest states before tiles that count, for the bounds
        counts = t[COUNTED + lane]
        u, z = t[U_UNIT + lane] * u, t[Z_UNIT + lane] * z
        w, y = t[W_UNIT + lane] * w, t[Y_UNIT + lane] * y
        slope = t[PER + lane] * reach
        t[SQUARE_1 + lane] = max(t[SQUARE_1 + lane], counts * (u * u + z * z))
        t[SQUARE_2 + lane] = max(t[SQUARE_2 + lane], counts * (w * w + y * y))
        square = distance * distance + slope * slope
        t[SQUARE + lane] = max(t[SQUARE + lane], counts * square)


@inlined
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
            p1 = t[NORTH + lane] * north_1 + t[EAST + lane] * east_1
            p2 = t[NORTH + lane] * north_2 + t[EAST + lane] * east_2
            p3 = t[NORTH + lane] * north_3 + t[EAST + lane] * east_3
            p4 = t[NORTH + lane] * north_4 + t[EAST + lane] * east_4
            # Four steps of both structures, with their relative displacement d and reach s
            u, z, w, y = t[U + lane], t[Z + lane], t[W + lane], t[Y + lane]
            u, z, w, y, d1, s1 = _moved(t, lane, u, z, w, y, t[P + lane], p1)
            u, z, w, y, d2, s2 = _moved(t, lane, u, z, w, y, p1, p2)
            u, z, w, y, d3, s3 = _moved(t, lane, u, z, w, y, p2, p3)
            u, z, w, y, d4, s4 = _moved(t, lane, u, z, w, y, p3, p4)
            t[U + lane], t[Z + lane], t[W + lane], t[Y + lane], t[P + lane] = u, z, w, y, p4
            # Largest reach
            early, late = max(s1, s2), max(s3, s4)
            t[FAST + lane] = max(t[FAST + lane], early, late)
            # Distance of the Bernstein coefficients from the samples
            s1, s2, s3, s4 = abs(s1), abs(s2), abs(s3), abs(s4)
            # Largest of them
            early = max(d1 + s1, d2 + s2)
            late = max(d3 + s3, d4 + s4)
            t[HIGH + lane] = max(t[HIGH + lane], early, late)
            # Smallest of them
            early = min(d1 - s1, d2 - s2)
            late = min(d3 - s3, d4 - s4)
            t[LOW + lane] = min(t[LOW + lane], early, late)


@inlined
def _moved(t, lane, u, z, w, y, start, end):
    """Return the states after one step and their relative displacement and reach."""
    # Shifted steps of structures 1 (u, z) and 2 (w, y)
    u, z = (
        t[A11 + lane] * u + (t[A12 + lane] * z + t[A1 + lane] * start),
        t[A21 + lane] * u + (t[A22 + lane] * z + t[A2 + lane] * start),
    )
    w, y = (
        t[B11 + lane] * w + (t[B12 + lane] * y + t[B1 + lane] * start),
        t[B21 + lane] * w + (t[B22 + lane] * y + t[B2 + lane] * start),
    )
    # Their differences, and what follows the acceleration at the end
    distance = (u - w) + t[OF_DISTANCE + lane] * end
    reach = (z - y) + t[OF_REACH + lane] * end
    return u, z, w, y, distance, reach
