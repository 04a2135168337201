"""
Many pairs against one record: 32 side by side as SIMD lanes, swept a tile of steps at a time as if nothing happened.

In each of its phases a pair is two linear equations, so that one step is the same arithmetic for
every lane; only the coefficients differ between free, touching and yielding pairs. A sweep keeps
nothing but the extremes at the samples of the tile. They bound what lies between the samples,
because over a step a function leaves its chord by an eighth of the step squared times its largest
second derivative at most. A lane that may have met, parted, yielded or passed a maximum in the tile
is walked again from the tile's start by scalar code (``pounding_walk``).

Time is measured in the angle ``omega t`` of each structure: speeds are divided by its omega and
accelerations by omega² and all are displacements. Everything of a lane stands in one array, row by
row of 32 lanes, because the compiler would have to check every pair of arrays for overlap; each
function is one loop over the lanes, so that it vectorises. A lane's numbers depend on nothing but
the pair: 32 lanes are always computed.
"""

import math

from per_obspy.kernels._jit import lean

LANES = 32
#: Steps of a tile: a multiple of what one loop over the lanes takes.
TILE, UNROLLED = 32, 4
#: Flags, which add up: structure 1 or 2 may pass a maximum in the tile, something may happen.
PEAK, EVENT = (1, 2), 4
#: Displacements below this (m) are zero: denormal numbers are slow.
STILL_PLACE = 1e-140

# rows of one structure; those of the second follow after STRUCTURE_ROWS
#: Displacement and speed, now and at the start of the tile.
PLACE, SPEED, START_PLACE, START_SPEED = 0, 1, 2, 3
#: One step: place and speed from place, speed, ground acceleration at both ends, and a constant.
STEP_PLACE, STEP_SPEED = 4, 9
#: Acceleration from place, speed, ground acceleration and a constant.
PULL = 14
#: Extremes at the samples of the tile: both displacements, squared radius.
HIGH, LOW, WIDE = 18, 19, 20
#: Maxima before the tile; infinite where nothing can happen any more.
HIGHEST_PLACE, WIDEST_RADIUS = 21, 22
#: Elastic range: how far from which centre; which side yields.
LIMIT, CENTRE, SIDE = 23, 24, 25
#: omega and angle of a step; what, times the larger acceleration at its ends, bounds how far
#: displacement, speed and power leave their chords inside a step, and by how much the acceleration
#: exceeds its ends.
OMEGA, ANGLE, PLACE_SAG, SPEED_SAG, POWER_SAG, BEND = 26, 27, 28, 29, 30, 31
#: The first two bounds in the tile, and what the squared radius may be in it.
SAG, SAG_OF_SPEED, WIDER = 32, 33, 34
STRUCTURE_ROWS = 35
# rows of the pair
COSINE, SINE = 70, 71
#: What stays positive until something happens, the clearance of a free pair and the contact force
#: per unit mass of a touching one: from both places, speed 1, ground acceleration and a constant;
#: how far below zero it is rounding, over displacement; its least value at the samples of the tile.
GUARD, FLOOR, LEAST = 72, 77, 78
ROWS = 79


@lean
def at(row, lane):
    """Return where a lane's number of a row stands."""
    return row * LANES + lane


@lean
def step(lanes, row, lane, place, speed, here, there):
    """Return what one step makes of place or speed, under the ground acceleration at both its ends."""
    form = lanes[at(row + 2, lane)] * here + (
        lanes[at(row + 3, lane)] * there + lanes[at(row + 4, lane)]
    )
    return lanes[at(row, lane)] * place + (lanes[at(row + 1, lane)] * speed + form)


@lean
def guard(lanes, lane, left, right, speed, ground):
    """Return what stays positive until a pair meets or parts."""
    form = lanes[at(GUARD + 2, lane)] * speed + (
        lanes[at(GUARD + 3, lane)] * ground + lanes[at(GUARD + 4, lane)]
    )
    return lanes[at(GUARD, lane)] * left + (lanes[at(GUARD + 1, lane)] * right + form)


@lean
def start_tile(lanes, north, east):
    """Keep the states at the start of a tile, and let its extremes begin with them."""
    for lane in range(LANES):
        for first in (0, STRUCTURE_ROWS):
            place, speed = lanes[at(first + PLACE, lane)], lanes[at(first + SPEED, lane)]
            place, speed = (
                place if abs(place) > STILL_PLACE else 0.0,
                speed if abs(speed) > STILL_PLACE else 0.0,
            )
            lanes[at(first + PLACE, lane)] = lanes[at(first + START_PLACE, lane)] = place
            lanes[at(first + SPEED, lane)] = lanes[at(first + START_SPEED, lane)] = speed
            lanes[at(first + HIGH, lane)] = lanes[at(first + LOW, lane)] = place
            lanes[at(first + WIDE, lane)] = place * place + speed * speed
        ground = lanes[at(COSINE, lane)] * north + lanes[at(SINE, lane)] * east
        left, right = lanes[at(PLACE, lane)], lanes[at(STRUCTURE_ROWS + PLACE, lane)]
        lanes[at(LEAST, lane)] = guard(lanes, lane, left, right, lanes[at(SPEED, lane)], ground)


@lean
def _step(lanes, first, lane, place, speed, high, low, wide, here, there):
    """Return displacement and speed of a structure after a step, and its extremes."""
    after = step(lanes, first + STEP_PLACE, lane, place, speed, here, there)
    speed = step(lanes, first + STEP_SPEED, lane, place, speed, here, there)
    return after, speed, max(high, after), min(low, after), max(wide, after * after + speed * speed)


@lean
def advance_one(lanes, n0, e0, n1, e1):
    """Step every lane from one north and east acceleration to the next."""
    second = STRUCTURE_ROWS
    for lane in range(LANES):
        cosine, sine, least = lanes[at(COSINE, lane)], lanes[at(SINE, lane)], lanes[at(LEAST, lane)]
        u1, z1 = lanes[at(PLACE, lane)], lanes[at(SPEED, lane)]
        u2, z2 = lanes[at(second + PLACE, lane)], lanes[at(second + SPEED, lane)]
        high_1, low_1, wide_1 = lanes[at(HIGH, lane)], lanes[at(LOW, lane)], lanes[at(WIDE, lane)]
        high_2, low_2 = lanes[at(second + HIGH, lane)], lanes[at(second + LOW, lane)]
        wide_2 = lanes[at(second + WIDE, lane)]
        a0 = cosine * n0 + sine * e0
        a1 = cosine * n1 + sine * e1
        u1, z1, high_1, low_1, wide_1 = _step(lanes, 0, lane, u1, z1, high_1, low_1, wide_1, a0, a1)
        u2, z2, high_2, low_2, wide_2 = _step(
            lanes, second, lane, u2, z2, high_2, low_2, wide_2, a0, a1
        )
        least = min(least, guard(lanes, lane, u1, u2, z1, a1))
        lanes[at(PLACE, lane)], lanes[at(SPEED, lane)] = u1, z1
        lanes[at(second + PLACE, lane)], lanes[at(second + SPEED, lane)] = u2, z2
        lanes[at(HIGH, lane)], lanes[at(LOW, lane)], lanes[at(WIDE, lane)] = high_1, low_1, wide_1
        lanes[at(second + HIGH, lane)], lanes[at(second + LOW, lane)] = high_2, low_2
        lanes[at(second + WIDE, lane)], lanes[at(LEAST, lane)] = wide_2, least


@lean
def advance_four(lanes, n0, e0, n1, e1, n2, e2, n3, e3, n4, e4):
    """Step every lane four times, without a store between."""
    second = STRUCTURE_ROWS
    for lane in range(LANES):
        cosine, sine, least = lanes[at(COSINE, lane)], lanes[at(SINE, lane)], lanes[at(LEAST, lane)]
        u1, z1 = lanes[at(PLACE, lane)], lanes[at(SPEED, lane)]
        u2, z2 = lanes[at(second + PLACE, lane)], lanes[at(second + SPEED, lane)]
        high_1, low_1, wide_1 = lanes[at(HIGH, lane)], lanes[at(LOW, lane)], lanes[at(WIDE, lane)]
        high_2, low_2 = lanes[at(second + HIGH, lane)], lanes[at(second + LOW, lane)]
        wide_2 = lanes[at(second + WIDE, lane)]
        a0 = cosine * n0 + sine * e0
        a1 = cosine * n1 + sine * e1
        u1, z1, high_1, low_1, wide_1 = _step(lanes, 0, lane, u1, z1, high_1, low_1, wide_1, a0, a1)
        u2, z2, high_2, low_2, wide_2 = _step(
            lanes, second, lane, u2, z2, high_2, low_2, wide_2, a0, a1
        )
        least = min(least, guard(lanes, lane, u1, u2, z1, a1))
        a2 = cosine * n2 + sine * e2
        u1, z1, high_1, low_1, wide_1 = _step(lanes, 0, lane, u1, z1, high_1, low_1, wide_1, a1, a2)
        u2, z2, high_2, low_2, wide_2 = _step(
            lanes, second, lane, u2, z2, high_2, low_2, wide_2, a1, a2
        )
        least = min(least, guard(lanes, lane, u1, u2, z1, a2))
        a3 = cosine * n3 + sine * e3
        u1, z1, high_1, low_1, wide_1 = _step(lanes, 0, lane, u1, z1, high_1, low_1, wide_1, a2, a3)
        u2, z2, high_2, low_2, wide_2 = _step(
            lanes, second, lane, u2, z2, high_2, low_2, wide_2, a2, a3
        )
        least = min(least, guard(lanes, lane, u1, u2, z1, a3))
        a4 = cosine * n4 + sine * e4
        u1, z1, high_1, low_1, wide_1 = _step(lanes, 0, lane, u1, z1, high_1, low_1, wide_1, a3, a4)
        u2, z2, high_2, low_2, wide_2 = _step(
            lanes, second, lane, u2, z2, high_2, low_2, wide_2, a3, a4
        )
        least = min(least, guard(lanes, lane, u1, u2, z1, a4))
        lanes[at(PLACE, lane)], lanes[at(SPEED, lane)] = u1, z1
        lanes[at(second + PLACE, lane)], lanes[at(second + SPEED, lane)] = u2, z2
        lanes[at(HIGH, lane)], lanes[at(LOW, lane)], lanes[at(WIDE, lane)] = high_1, low_1, wide_1
        lanes[at(second + HIGH, lane)], lanes[at(second + LOW, lane)] = high_2, low_2
        lanes[at(second + WIDE, lane)], lanes[at(LEAST, lane)] = wide_2, least


@lean
def flag_structures(lanes, flags, i, peak, jump):
    """
    Bound one structure of every lane between the samples, and flag where it may pass a maximum or its elastic range.

    ``peak`` and ``jump`` are the largest acceleration (north, east) in the tile, and its largest
    change over a step. The radius grows inside a step only from an end to a root of the power
    (``raise_maxima`` of ``pounding_search``).
    """
    first = i * STRUCTURE_ROWS
    for lane in range(LANES):
        cosine, sine = abs(lanes[at(COSINE, lane)]), abs(lanes[at(SINE, lane)])
        high, low = lanes[at(first + HIGH, lane)], lanes[at(first + LOW, lane)]
        reach, radius = max(high, -low), math.sqrt(lanes[at(first + WIDE, lane)])
        by_place, by_speed = lanes[at(first + PULL, lane)], abs(lanes[at(first + PULL + 1, lane)])
        by_ground, constant = (
            abs(lanes[at(first + PULL + 2, lane)]),
            abs(lanes[at(first + PULL + 3, lane)]),
        )
        strength = (
            abs(by_place) * reach
            + by_speed * radius
            + by_ground * (cosine * peak[0] + sine * peak[1])
            + constant
        )
        angle, inside = (
            lanes[at(first + ANGLE, lane)],
            (1.0 + lanes[at(first + BEND, lane)]) * strength,
        )
        sag = lanes[at(first + PLACE_SAG, lane)] * strength
        lanes[at(first + SAG, lane)] = sag
        lanes[at(first + SAG_OF_SPEED, lane)] = lanes[at(first + SPEED_SAG, lane)] * strength
        change = angle * (abs(1.0 + by_place) * (radius + 0.5 * angle * inside) + by_speed * inside)
        change += by_ground * (cosine * jump[0] + sine * jump[1])
        widest = radius + 0.125 * angle * (
            change + 8.0 * lanes[at(first + POWER_SAG, lane)] * strength
        )
        lanes[at(first + WIDER, lane)] = widest * widest
        further = reach + sag > lanes[at(first + HIGHEST_PLACE, lane)]
        rises = further | (widest * widest > lanes[at(first + WIDEST_RADIUS, lane)])
        centre = lanes[at(first + CENTRE, lane)]
        yields = max(high - centre, centre - low) + sag > lanes[at(first + LIMIT, lane)]
        flags[lane] |= (PEAK[i] if rises else 0) | (EVENT if yields else 0)


@lean
def flag_pairs(lanes, flags):
    """Flag lanes whose pair may meet or part."""
    second = STRUCTURE_ROWS
    for lane in range(LANES):
        margin = abs(lanes[at(GUARD, lane)]) * lanes[at(SAG, lane)]
        margin += abs(lanes[at(GUARD + 1, lane)]) * lanes[at(second + SAG, lane)]
        margin += abs(lanes[at(GUARD + 2, lane)]) * lanes[at(SAG_OF_SPEED, lane)]
        floor = lanes[at(FLOOR, lane)] * max(lanes[at(HIGH, lane)], -lanes[at(LOW, lane)])
        flags[lane] |= EVENT if lanes[at(LEAST, lane)] - margin < -floor else 0


@lean
def extremes(ground, count):
    """Return the largest acceleration of a tile (north, east), and the largest change over a step."""
    peak_north, peak_east, jump_north, jump_east = abs(ground[0, 0]), abs(ground[1, 0]), 0.0, 0.0
    for k in range(count):
        peak_north, peak_east = (
            max(peak_north, abs(ground[0, k + 1])),
            max(peak_east, abs(ground[1, k + 1])),
        )
        jump_north = max(jump_north, abs(ground[0, k + 1] - ground[0, k]))
        jump_east = max(jump_east, abs(ground[1, k + 1] - ground[1, k]))
    return (peak_north, peak_east), (jump_north, jump_east)


@lean
def flag_tile(lanes, flags, ground, count):
    """Flag every lane to which something may happen in the tile that has just been stepped through."""
    peak, jump = extremes(ground, count)
    for lane in range(LANES):
        flags[lane] = 0
    flag_structures(lanes, flags, 0, peak, jump)
    flag_structures(lanes, flags, 1, peak, jump)
    flag_pairs(lanes, flags)


@lean
def sweep(lanes, flags, ground, count):
    """
    Step every lane through a tile, as if nothing happened; flag those where something may; return the sum of flags.

    ``ground`` (2, TILE + 1) is the north and east acceleration at the tile's samples, of which
    ``count + 1`` are used.
    """
    start_tile(lanes, ground[0, 0], ground[1, 0])
    k = 0
    while k + UNROLLED <= count:
        n0, n1, n2, n3, n4 = (
            ground[0, k],
            ground[0, k + 1],
            ground[0, k + 2],
            ground[0, k + 3],
            ground[0, k + 4],
        )
        e0, e1, e2, e3, e4 = (
            ground[1, k],
            ground[1, k + 1],
            ground[1, k + 2],
            ground[1, k + 3],
            ground[1, k + 4],
        )
        advance_four(lanes, n0, e0, n1, e1, n2, e2, n3, e3, n4, e4)
        k += UNROLLED
    while k < count:
        advance_one(lanes, ground[0, k], ground[1, k], ground[0, k + 1], ground[1, k + 1])
        k += 1
    flag_tile(lanes, flags, ground, count)
    total = 0
    for lane in range(LANES):
        total += flags[lane]
    return total
