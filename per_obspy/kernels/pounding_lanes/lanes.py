"""
Sweep of 32 pairs, side by side as SIMD lanes, through a tile of steps as if no event happened.

In each of its phases a pair is two linear equations, so that one step is the same arithmetic for
every lane; only the coefficients differ between free, touching and yielding pairs. A sweep records
only the extremes at the samples of the tile (a time block of 32 steps). They bound the motion
between the samples, because over a step a function leaves its chord by an eighth of the step
squared times its largest second derivative at most. A lane that may have met, parted, yielded or
passed a maximum in the tile is stepped again from the tile's start by scalar code
(``step_by_step``).

Time is measured in the angle ``omega t`` of each structure: velocities are divided by its omega and
accelerations by omega², so that all are displacements (m). All numbers of a lane are in one array,
row by row of 32 lanes, because the compiler would have to check every pair of arrays for overlap;
each function is one loop over the lanes, so that it vectorises. The numbers of a lane depend on its
pair alone: 32 lanes are always computed. The constants below are the rows of this array.
"""

import math

from per_obspy.kernels._jit import lean, vectorised

#: Pairs that are computed side by side.
PAIR_LANES = 32
#: Steps of a tile: a multiple of the steps that one loop over the lanes takes.
TILE_STEPS, UNROLLED_STEPS = 32, 4
#: Flags, which add up: structure 1 or 2 may pass a maximum in the tile, an event may happen.
PEAK_FLAGS, EVENT_FLAG = (1, 2), 4
#: Displacements below this (m) are zero: denormal numbers are slow.
SMALLEST_DISPLACEMENT = 1e-140

# rows of structure 1; those of structure 2 follow after STRUCTURE_ROWS
#: displacement and velocity, now and at the start of the tile
DISPLACEMENT, VELOCITY, START_DISPLACEMENT, START_VELOCITY = 0, 1, 2, 3
#: displacement and velocity after a step: five coefficients each, of displacement, velocity, ground
#: acceleration at its start and at its end, and a constant
STEP_DISPLACEMENT, STEP_VELOCITY = 4, 9
#: acceleration: four coefficients, of displacement, velocity, ground acceleration, and a constant
ACCELERATION = 14
#: extremes at the samples of the tile: displacement to both sides, squared radius
TILE_HIGH, TILE_LOW, TILE_RADIUS_SQUARED = 18, 19, 20
#: maxima before the tile; infinite where they can no longer be passed
MAXIMUM_SO_FAR, RADIUS_SQUARED_SO_FAR = 21, 22
#: elastic range: its half width and centre; side that yields (0: none)
YIELD_LIMIT, YIELD_CENTRE, YIELD_SIDE = 23, 24, 25
#: omega (rad/s), angle of a step (rad)
OMEGA, ANGLE = 26, 27
#: error bounds, over the larger acceleration at the ends of a step: of the chords of displacement,
#: velocity and power inside it, and of the larger acceleration itself
DISPLACEMENT_ERROR, VELOCITY_ERROR, POWER_ERROR, ACCELERATION_ERROR = 28, 29, 30, 31
#: error bounds of displacement and velocity in the tile, and upper bound of its squared radius
TILE_DISPLACEMENT_ERROR, TILE_VELOCITY_ERROR, TILE_RADIUS_SQUARED_BOUND = 32, 33, 34
STRUCTURE_ROWS = 35

# rows of the pair
#: direction from structure 1 to 2
AXIS_COSINE, AXIS_SINE = 70, 71
#: contact function, positive until the pair meets or parts (clearance of a free pair, contact force
#: per unit mass of a touching one): five coefficients, of both displacements, velocity 1, ground
#: acceleration, and a constant
CONTACT_FUNCTION = 72
#: rounding of the contact function over displacement; its least value at the samples of the tile
CONTACT_ROUNDING, TILE_CONTACT = 77, 78
#: least velocity over omega of both structures towards the side that yields, in the tile
TILE_SPEED = 79
#: only in the line of a pair: growth of the velocity over omega of both structures in an impact,
#: over its approach speed (s); 1 while coefficients are not in the lane yet, else 0
IMPACT_GROWTH, IS_CHANGED, LANE_ROWS = 81, 83, 84


@lean
def at(row, lane):
    """Return the index of a row of a lane."""
    return row * PAIR_LANES + lane


@lean
def step_value(lanes, row, lane, displacement, velocity, ground_start, ground_end):
    """Return displacement or velocity after one step, by the five coefficients from a row on."""
    form = lanes[at(row + 2, lane)] * ground_start + (
        lanes[at(row + 3, lane)] * ground_end + lanes[at(row + 4, lane)]
    )
    return lanes[at(row, lane)] * displacement + (lanes[at(row + 1, lane)] * velocity + form)


@lean
def contact_value(lanes, lane, left, right, velocity, ground):
    """Return the contact function of a lane: positive until its pair meets or parts."""
    form = lanes[at(CONTACT_FUNCTION + 2, lane)] * velocity + (
        lanes[at(CONTACT_FUNCTION + 3, lane)] * ground + lanes[at(CONTACT_FUNCTION + 4, lane)]
    )
    return lanes[at(CONTACT_FUNCTION, lane)] * left + (
        lanes[at(CONTACT_FUNCTION + 1, lane)] * right + form
    )


@vectorised
def start_tile(lanes, north, east):
    """Store the states at the start of a tile, and begin its extremes with them."""
    for lane in range(PAIR_LANES):
        for first in (0, STRUCTURE_ROWS):
            # state, without denormal numbers
            displacement = lanes[at(first + DISPLACEMENT, lane)]
            velocity = lanes[at(first + VELOCITY, lane)]
            displacement = displacement if abs(displacement) > SMALLEST_DISPLACEMENT else 0.0
            velocity = velocity if abs(velocity) > SMALLEST_DISPLACEMENT else 0.0
            lanes[at(first + DISPLACEMENT, lane)] = displacement
            lanes[at(first + START_DISPLACEMENT, lane)] = displacement
            lanes[at(first + VELOCITY, lane)] = velocity
            lanes[at(first + START_VELOCITY, lane)] = velocity
            # extremes of displacement and radius
            lanes[at(first + TILE_HIGH, lane)] = displacement
            lanes[at(first + TILE_LOW, lane)] = displacement
            radius_squared = displacement * displacement + velocity * velocity
            lanes[at(first + TILE_RADIUS_SQUARED, lane)] = radius_squared
        # contact function under the ground acceleration along the pair
        ground = lanes[at(AXIS_COSINE, lane)] * north + lanes[at(AXIS_SINE, lane)] * east
        left = lanes[at(DISPLACEMENT, lane)]
        right = lanes[at(STRUCTURE_ROWS + DISPLACEMENT, lane)]
        velocity = lanes[at(VELOCITY, lane)]
        lanes[at(TILE_CONTACT, lane)] = contact_value(lanes, lane, left, right, velocity, ground)


@lean
def load_structure(lanes, first, lane):
    """Return displacement, velocity and extremes in the tile of a structure."""
    return (
        lanes[at(first + DISPLACEMENT, lane)],
        lanes[at(first + VELOCITY, lane)],
        lanes[at(first + TILE_HIGH, lane)],
        lanes[at(first + TILE_LOW, lane)],
        lanes[at(first + TILE_RADIUS_SQUARED, lane)],
    )


@lean
def store_structure(lanes, first, lane, motion):
    """Store displacement, velocity and extremes in the tile of a structure."""
    u, z, high, low, radius_squared = motion
    lanes[at(first + DISPLACEMENT, lane)] = u
    lanes[at(first + VELOCITY, lane)] = z
    lanes[at(first + TILE_HIGH, lane)] = high
    lanes[at(first + TILE_LOW, lane)] = low
    lanes[at(first + TILE_RADIUS_SQUARED, lane)] = radius_squared


@lean
def step_structure(lanes, first, lane, motion, ground, next_ground):
    """Return displacement, velocity and extremes of a structure after a step."""
    u, z, high, low, radius_squared = motion
    after = step_value(lanes, first + STEP_DISPLACEMENT, lane, u, z, ground, next_ground)
    z = step_value(lanes, first + STEP_VELOCITY, lane, u, z, ground, next_ground)
    return after, z, max(high, after), min(low, after), max(radius_squared, after * after + z * z)


@vectorised
def advance_one_step(lanes, n0, e0, n1, e1):
    """Step every lane from one north and east acceleration to the next."""
    second = STRUCTURE_ROWS
    for lane in range(PAIR_LANES):
        # ground acceleration along the pair at both ends of the step
        cosine = lanes[at(AXIS_COSINE, lane)]
        sine = lanes[at(AXIS_SINE, lane)]
        a0 = cosine * n0 + sine * e0
        a1 = cosine * n1 + sine * e1
        # states and extremes of both structures, and the least contact function
        left = step_structure(lanes, 0, lane, load_structure(lanes, 0, lane), a0, a1)
        right = step_structure(lanes, second, lane, load_structure(lanes, second, lane), a0, a1)
        contact = contact_value(lanes, lane, left[0], right[0], left[1], a1)
        lanes[at(TILE_CONTACT, lane)] = min(lanes[at(TILE_CONTACT, lane)], contact)
        store_structure(lanes, 0, lane, left)
        store_structure(lanes, second, lane, right)


@vectorised
def advance_four_steps(lanes, n0, e0, n1, e1, n2, e2, n3, e3, n4, e4):
    """Step every lane four times, without a store between the steps."""
    second = STRUCTURE_ROWS
    for lane in range(PAIR_LANES):
        # load direction, least contact function, states and extremes of both structures
        cosine = lanes[at(AXIS_COSINE, lane)]
        sine = lanes[at(AXIS_SINE, lane)]
        least = lanes[at(TILE_CONTACT, lane)]
        left = load_structure(lanes, 0, lane)
        right = load_structure(lanes, second, lane)
        # first step, from a0 to a1: ground accelerations along the pair
        a0 = cosine * n0 + sine * e0
        a1 = cosine * n1 + sine * e1
        left = step_structure(lanes, 0, lane, left, a0, a1)
        right = step_structure(lanes, second, lane, right, a0, a1)
        least = min(least, contact_value(lanes, lane, left[0], right[0], left[1], a1))
        # second step
        a2 = cosine * n2 + sine * e2
        left = step_structure(lanes, 0, lane, left, a1, a2)
        right = step_structure(lanes, second, lane, right, a1, a2)
        least = min(least, contact_value(lanes, lane, left[0], right[0], left[1], a2))
        # third step
        a3 = cosine * n3 + sine * e3
        left = step_structure(lanes, 0, lane, left, a2, a3)
        right = step_structure(lanes, second, lane, right, a2, a3)
        least = min(least, contact_value(lanes, lane, left[0], right[0], left[1], a3))
        # fourth step
        a4 = cosine * n4 + sine * e4
        left = step_structure(lanes, 0, lane, left, a3, a4)
        right = step_structure(lanes, second, lane, right, a3, a4)
        least = min(least, contact_value(lanes, lane, left[0], right[0], left[1], a4))
        store_structure(lanes, 0, lane, left)
        store_structure(lanes, second, lane, right)
        lanes[at(TILE_CONTACT, lane)] = least


@vectorised
def lower_speeds(lanes, begins):
    """Lower the least speeds towards the sides that yield to those now, or begin with them."""
    for lane in range(PAIR_LANES):
        for i in range(2):
            first = i * STRUCTURE_ROWS
            speed = lanes[at(first + YIELD_SIDE, lane)] * lanes[at(first + VELOCITY, lane)]
            least = speed if begins else min(lanes[at(TILE_SPEED + i, lane)], speed)
            lanes[at(TILE_SPEED + i, lane)] = least


@vectorised
def _flag_yielding(lanes, flags):
    """Flag every lane in which a structure yields now."""
    for lane in range(PAIR_LANES):
        side = lanes[at(YIELD_SIDE, lane)]
        other_side = lanes[at(STRUCTURE_ROWS + YIELD_SIDE, lane)]
        flags[lane] = 1 if (side != 0.0) | (other_side != 0.0) else 0


@lean
def _sum_of(flags):
    """Return the sum of the flags of all lanes."""
    total = 0
    for lane in range(PAIR_LANES):
        total += flags[lane]
    return total


@vectorised
def flag_structures(lanes, flags, i, peak, jump):
    """
    Bound structure i of every lane between the samples; flag lanes where it may peak or yield.

    ``peak`` and ``jump`` are the largest acceleration (north, east) in the tile, and its largest
    change over a step. The radius grows inside a step only from an end to a root of the power
    (``raise_maxima_inside`` of ``maxima_in_step``).
    """
    first = i * STRUCTURE_ROWS
    for lane in range(PAIR_LANES):
        # extremes at the samples
        cosine = abs(lanes[at(AXIS_COSINE, lane)])
        sine = abs(lanes[at(AXIS_SINE, lane)])
        high = lanes[at(first + TILE_HIGH, lane)]
        low = lanes[at(first + TILE_LOW, lane)]
        reach = max(high, -low)
        radius = math.sqrt(lanes[at(first + TILE_RADIUS_SQUARED, lane)])
        # largest acceleration at the samples, by its coefficients
        by_displacement = lanes[at(first + ACCELERATION, lane)]
        by_velocity = abs(lanes[at(first + ACCELERATION + 1, lane)])
        by_ground = abs(lanes[at(first + ACCELERATION + 2, lane)])
        constant = abs(lanes[at(first + ACCELERATION + 3, lane)])
        strength = (
            abs(by_displacement) * reach
            + by_velocity * radius
            + by_ground * (cosine * peak[0] + sine * peak[1])
            + constant
        )
        # error bounds of displacement and velocity, and largest acceleration inside a step
        angle = lanes[at(first + ANGLE, lane)]
        inside = (1.0 + lanes[at(first + ACCELERATION_ERROR, lane)]) * strength
        error = lanes[at(first + DISPLACEMENT_ERROR, lane)] * strength
        lanes[at(first + TILE_DISPLACEMENT_ERROR, lane)] = error
        lanes[at(first + TILE_VELOCITY_ERROR, lane)] = (
            lanes[at(first + VELOCITY_ERROR, lane)] * strength
        )
        # largest change of the power u'' + omega² u over a step, and by it the largest radius
        fastest = radius + 0.5 * angle * inside
        change = angle * (abs(1.0 + by_displacement) * fastest + by_velocity * inside)
        change += by_ground * (cosine * jump[0] + sine * jump[1])
        power_error = 8.0 * lanes[at(first + POWER_ERROR, lane)] * strength
        widest = radius + 0.125 * angle * (change + power_error)
        lanes[at(first + TILE_RADIUS_SQUARED_BOUND, lane)] = widest * widest
        # maxima so far that may be passed
        is_further = reach + error > lanes[at(first + MAXIMUM_SO_FAR, lane)]
        rises = is_further | (widest * widest > lanes[at(first + RADIUS_SQUARED_SO_FAR, lane)])
        # elastic range that may be left
        centre = lanes[at(first + YIELD_CENTRE, lane)]
        distance = max(high - centre, centre - low)
        yields = distance + error > lanes[at(first + YIELD_LIMIT, lane)]
        flags[lane] |= (PEAK_FLAGS[i] if rises else 0) | (EVENT_FLAG if yields else 0)


@vectorised
def flag_unloading(lanes, flags):
    """Flag lanes in which a yielding structure may unload."""
    # From the nearer of two samples UNROLLED_STEPS apart the velocity falls for half of these steps
    # at most, in each by angle times the largest acceleration: less than four of its error bounds
    for lane in range(PAIR_LANES):
        for i in range(2):
            first = i * STRUCTURE_ROWS
            fall = 2.0 * UNROLLED_STEPS * lanes[at(first + TILE_VELOCITY_ERROR, lane)]
            yields = lanes[at(first + YIELD_SIDE, lane)] != 0.0
            unloads = yields & (lanes[at(TILE_SPEED + i, lane)] <= fall)
            flags[lane] |= EVENT_FLAG if unloads else 0


@vectorised
def flag_contacts(lanes, flags):
    """Flag lanes whose pair may meet or part."""
    second = STRUCTURE_ROWS
    for lane in range(PAIR_LANES):
        # error bound of the contact function between the samples
        margin = abs(lanes[at(CONTACT_FUNCTION, lane)]) * lanes[at(TILE_DISPLACEMENT_ERROR, lane)]
        margin += (
            abs(lanes[at(CONTACT_FUNCTION + 1, lane)])
            * lanes[at(second + TILE_DISPLACEMENT_ERROR, lane)]
        )
        margin += abs(lanes[at(CONTACT_FUNCTION + 2, lane)]) * lanes[at(TILE_VELOCITY_ERROR, lane)]
        # its rounding
        reach = max(lanes[at(TILE_HIGH, lane)], -lanes[at(TILE_LOW, lane)])
        rounding = lanes[at(CONTACT_ROUNDING, lane)] * reach
        flags[lane] |= EVENT_FLAG if lanes[at(TILE_CONTACT, lane)] - margin < -rounding else 0


@lean
def ground_extremes(ground, count):
    """Return the largest acceleration of a tile (north, east), and its largest change."""
    peak_north = abs(ground[0, 0])
    peak_east = abs(ground[1, 0])
    jump_north = 0.0
    jump_east = 0.0
    # step by step
    for k in range(count):
        peak_north = max(peak_north, abs(ground[0, k + 1]))
        peak_east = max(peak_east, abs(ground[1, k + 1]))
        jump_north = max(jump_north, abs(ground[0, k + 1] - ground[0, k]))
        jump_east = max(jump_east, abs(ground[1, k + 1] - ground[1, k]))
    return (peak_north, peak_east), (jump_north, jump_east)


@lean
def flag_tile(lanes, flags, ground, count):
    """Flag every lane in which an event or a maximum may lie in the tile just stepped through."""
    peak, jump = ground_extremes(ground, count)
    for lane in range(PAIR_LANES):
        flags[lane] = 0
    flag_structures(lanes, flags, 0, peak, jump)
    flag_structures(lanes, flags, 1, peak, jump)
    flag_contacts(lanes, flags)


@lean
def sweep_tile(lanes, flags, ground, count):
    """
    Step every lane through a tile as if no event happened, and flag lanes where one may.

    Parameters
    ----------
    lanes : (LANE_ROWS * PAIR_LANES,) ndarray
        Numbers of all lanes at the start of the tile, then at its end.
    flags : (PAIR_LANES,) ndarray of int
        Receives the flags of each lane: sums of PEAK_FLAGS and EVENT_FLAG.
    ground : (2, TILE_STEPS + 1) ndarray
        North and east acceleration at the tile's samples, m/s².
    count : int
        Number of steps of the tile.

    Returns
    -------
    int
        Sum of the flags.
    """
    start_tile(lanes, ground[0, 0], ground[1, 0])
    _flag_yielding(lanes, flags)
    yields = _sum_of(flags) > 0
    if yields:
        lower_speeds(lanes, True)
    # four steps at a time
    k = 0
    while k + UNROLLED_STEPS <= count:
        n0, n1, n2, n3 = ground[0, k], ground[0, k + 1], ground[0, k + 2], ground[0, k + 3]
        e0, e1, e2, e3 = ground[1, k], ground[1, k + 1], ground[1, k + 2], ground[1, k + 3]
        n4, e4 = ground[0, k + 4], ground[1, k + 4]
        advance_four_steps(lanes, n0, e0, n1, e1, n2, e2, n3, e3, n4, e4)
        if yields:
            lower_speeds(lanes, False)
        k += UNROLLED_STEPS
    # remaining steps
    while k < count:
        advance_one_step(lanes, ground[0, k], ground[1, k], ground[0, k + 1], ground[1, k + 1])
        if yields:
            lower_speeds(lanes, False)
        k += 1
    # flags
    flag_tile(lanes, flags, ground, count)
    if yields:
        flag_unloading(lanes, flags)
    return _sum_of(flags)
