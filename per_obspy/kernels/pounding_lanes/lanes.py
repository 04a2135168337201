"""
Sweep of 32 lanes, side by side, through a tile of steps as if no event happened.

In each of its phases a building is one linear equation, so that one step is the same arithmetic for
every building; only the coefficients differ between free, touching and yielding ones. A sweep
records only the extremes at the samples of the tile (a time block of 32 steps). They bound the
motion between the samples, because over a step a function leaves its chord by an eighth of the step
squared times its largest second derivative at most. A row of buildings that may have met, parted,
yielded or passed a maximum in the tile is stepped again from the tile's start by scalar code
(``step_by_step``).

Time is measured in the angle ``omega t`` of each building: velocities are divided by its omega and
accelerations by omega², so that all are displacements (m). All numbers are in one array, row by row
of 32 lanes, because the compiler would have to check every pair of arrays for overlap; each
function is one loop over the lanes, so that it vectorises. The numbers of a building depend on its
row of buildings alone: 32 lanes are always computed.

A number has the index ``at(row, place)``. The buildings of a row are in adjacent lanes, and their
places are these lanes; a row of two has one lane, where the second building has the place of the
first plus ``BANK``. The interface to the next building on the right is in a building's place, so
that one ``stride`` from a building to its right neighbour is all that differs: 1 or ``BANK``.
"""

import math

from per_obspy.kernels._jit import inlined, lean, vectorised

#: Pairs that are computed side by side.
PAIR_LANES = 32
#: Steps of a tile, and of one of rows, of which more buildings are stepped again where one has an
#: event: multiples of the steps that one loop over the lanes takes.
TILE_STEPS, ROW_TILE_STEPS, UNROLLED_STEPS = 32, 16, 4
#: Flags, which add up: building 1 or 2 of a lane may pass a maximum in the tile, an event may
#: happen.
PEAK_FLAGS, EVENT_FLAG = (1, 2), 4
#: Displacements below this (m) are zero: denormal numbers are slow.
SMALLEST_DISPLACEMENT = 1e-140

# rows of a building
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
#: direction from the first building to the last
AXIS_COSINE, AXIS_SINE = 35, 36
#: contact function, positive until the building meets its right neighbour or parts from it
#: (clearance, or contact force per unit mass while they touch): five coefficients, of both
#: displacements, the building's velocity, ground acceleration, and a constant
CONTACT_FUNCTION = 37
#: rounding of the contact function over displacement; its least value at the samples of the tile
CONTACT_ROUNDING, TILE_CONTACT = 42, 43
#: least velocity over omega towards the side that yields, in the tile
TILE_SPEED = 44
#: Rows that lanes have; the others are only in the line of a building.
SWEPT_ROWS = 45
#: growth of the velocity over omega in an impact on the other building of a row of two, over its
#: approach speed (s)
IMPACT_GROWTH = 45
#: first and last building of the cluster for which the coefficients were written
CLUSTER_FIRST, CLUSTER_LAST = 46, 47
#: 1 while the coefficients of a step have to be written again, and while coefficients are not in
#: the lane yet, else 0
IS_STEP_OUTDATED, IS_CHANGED = 48, 49
#: largest rate of the row times the duration of a step; first building only
LARGEST_RATE = 50
STRUCTURE_ROWS = 51
#: Rows of the array: both buildings of a row of two; else room for the states of four steps.
LANE_ROWS = 2 * STRUCTURE_ROWS
BANK = STRUCTURE_ROWS * PAIR_LANES
#: Displacements and velocities after each of the last four steps, where buildings are in adjacent
#: lanes.
STEPPED, STEPPED_VELOCITY = STRUCTURE_ROWS, STRUCTURE_ROWS + UNROLLED_STEPS
# rows after all others, for pairs that never touch: two each, for u2 - u1 and for u1 - u2
#: largest relative displacement so far, and at the samples of the tile
RELATIVE_SO_FAR, TILE_RELATIVE = LANE_ROWS, LANE_ROWS + 2
LANE_ROWS_WITHOUT_CONTACT = LANE_ROWS + 4

#: Rows of two; rows of two that never touch; rows of any length up to 32.
PAIRS, APART, ROWS = 0, 1, 2


@lean
def at(row, lane):
    """Return the index of a row of a lane."""
    return row * PAIR_LANES + lane


@lean
def step_value(lanes, row, place, displacement, velocity, ground_start, ground_end):
    """Return displacement or velocity after one step, by the five coefficients from a row on."""
    form = lanes[at(row + 2, place)] * ground_start + (
        lanes[at(row + 3, place)] * ground_end + lanes[at(row + 4, place)]
    )
    return lanes[at(row, place)] * displacement + (lanes[at(row + 1, place)] * velocity + form)


@lean
def contact_value(lanes, place, left, right, velocity, ground):
    """Return the contact function of a building and its neighbour: positive until they meet."""
    form = lanes[at(CONTACT_FUNCTION + 2, place)] * velocity + (
        lanes[at(CONTACT_FUNCTION + 3, place)] * ground + lanes[at(CONTACT_FUNCTION + 4, place)]
    )
    return lanes[at(CONTACT_FUNCTION, place)] * left + (
        lanes[at(CONTACT_FUNCTION + 1, place)] * right + form
    )


@inlined
def _start_structure(lanes, place):
    """Store the state of a building at the start of a tile, and begin its extremes with it."""
    # state, without denormal numbers
    displacement = lanes[at(DISPLACEMENT, place)]
    velocity = lanes[at(VELOCITY, place)]
    displacement = displacement if abs(displacement) > SMALLEST_DISPLACEMENT else 0.0
    velocity = velocity if abs(velocity) > SMALLEST_DISPLACEMENT else 0.0
    lanes[at(DISPLACEMENT, place)] = displacement
    lanes[at(START_DISPLACEMENT, place)] = displacement
    lanes[at(VELOCITY, place)] = velocity
    lanes[at(START_VELOCITY, place)] = velocity
    # extremes of displacement and radius
    lanes[at(TILE_HIGH, place)] = displacement
    lanes[at(TILE_LOW, place)] = displacement
    lanes[at(TILE_RADIUS_SQUARED, place)] = displacement * displacement + velocity * velocity


@vectorised
def start_structures(lanes, kind):
    """Start a tile for the buildings of every lane."""
    for lane in range(PAIR_LANES):
        _start_structure(lanes, lane)
    if kind != ROWS:
        for lane in range(PAIR_LANES):
            _start_structure(lanes, lane + BANK)


@inlined
def _lower_contact(lanes, lane, stride, displacement, velocity, north, east, begins):
    """Lower the least contact function to that of states in these rows, or begin with it."""
    # ground acceleration along the axis, and states on both sides
    ground = lanes[at(AXIS_COSINE, lane)] * north + lanes[at(AXIS_SINE, lane)] * east
    left = lanes[at(displacement, lane)]
    right = lanes[at(displacement, lane + stride)]
    contact = contact_value(lanes, lane, left, right, lanes[at(velocity, lane)], ground)
    least = contact if begins else min(lanes[at(TILE_CONTACT, lane)], contact)
    lanes[at(TILE_CONTACT, lane)] = least


@vectorised
def lower_contacts(lanes, kind, north, east, begins):
    """Lower the least contact functions to those now, or begin with them."""
    if kind == ROWS:
        for lane in range(PAIR_LANES):
            _lower_contact(lanes, lane, 1, DISPLACEMENT, VELOCITY, north, east, begins)
    else:
        for lane in range(PAIR_LANES):
            _lower_contact(lanes, lane, BANK, DISPLACEMENT, VELOCITY, north, east, begins)


@lean
def load_structure(lanes, place):
    """Return displacement, velocity and extremes in the tile of a building."""
    return (
        lanes[at(DISPLACEMENT, place)],
        lanes[at(VELOCITY, place)],
        lanes[at(TILE_HIGH, place)],
        lanes[at(TILE_LOW, place)],
        lanes[at(TILE_RADIUS_SQUARED, place)],
    )


@lean
def store_structure(lanes, place, motion):
    """Store displacement, velocity and extremes in the tile of a building."""
    u, z, high, low, radius_squared = motion
    lanes[at(DISPLACEMENT, place)] = u
    lanes[at(VELOCITY, place)] = z
    lanes[at(TILE_HIGH, place)] = high
    lanes[at(TILE_LOW, place)] = low
    lanes[at(TILE_RADIUS_SQUARED, place)] = radius_squared


@lean
def step_structure(lanes, place, motion, ground, next_ground):
    """Return displacement, velocity and extremes of a building after a step."""
    u, z, high, low, radius_squared = motion
    after = step_value(lanes, STEP_DISPLACEMENT, place, u, z, ground, next_ground)
    z = step_value(lanes, STEP_VELOCITY, place, u, z, ground, next_ground)
    return after, z, max(high, after), min(low, after), max(radius_squared, after * after + z * z)


@inlined
def _step_once(lanes, place, n0, e0, n1, e1):
    """Step a building from one north and east acceleration to the next."""
    # ground acceleration along the axis at both ends of the step
    cosine = lanes[at(AXIS_COSINE, place)]
    sine = lanes[at(AXIS_SINE, place)]
    a0 = cosine * n0 + sine * e0
    a1 = cosine * n1 + sine * e1
    motion = step_structure(lanes, place, load_structure(lanes, place), a0, a1)
    store_structure(lanes, place, motion)


@vectorised
def advance_one_step(lanes, kind, n0, e0, n1, e1):
    """Step the buildings of every lane once."""
    if kind == ROWS:
        for lane in range(PAIR_LANES):
            _step_once(lanes, lane, n0, e0, n1, e1)
    else:
        for lane in range(PAIR_LANES):
            _step_once(lanes, lane, n0, e0, n1, e1)
            _step_once(lanes, lane + BANK, n0, e0, n1, e1)


@vectorised
def advance_pairs(lanes, n0, e0, n1, e1, n2, e2, n3, e3, n4, e4):
    """Step both buildings of every lane four times, without a store between the steps."""
    for lane in range(PAIR_LANES):
        # load direction, least contact function, states and extremes of both buildings
        cosine = lanes[at(AXIS_COSINE, lane)]
        sine = lanes[at(AXIS_SINE, lane)]
        least = lanes[at(TILE_CONTACT, lane)]
        left = load_structure(lanes, lane)
        right = load_structure(lanes, lane + BANK)
        # first step, from a0 to a1: ground accelerations along the pair
        a0 = cosine * n0 + sine * e0
        a1 = cosine * n1 + sine * e1
        left = step_structure(lanes, lane, left, a0, a1)
        right = step_structure(lanes, lane + BANK, right, a0, a1)
        least = min(least, contact_value(lanes, lane, left[0], right[0], left[1], a1))
        # second step
        a2 = cosine * n2 + sine * e2
        left = step_structure(lanes, lane, left, a1, a2)
        right = step_structure(lanes, lane + BANK, right, a1, a2)
        least = min(least, contact_value(lanes, lane, left[0], right[0], left[1], a2))
        # third step
        a3 = cosine * n3 + sine * e3
        left = step_structure(lanes, lane, left, a2, a3)
        right = step_structure(lanes, lane + BANK, right, a2, a3)
        least = min(least, contact_value(lanes, lane, left[0], right[0], left[1], a3))
        # fourth step
        a4 = cosine * n4 + sine * e4
        left = step_structure(lanes, lane, left, a3, a4)
        right = step_structure(lanes, lane + BANK, right, a3, a4)
        least = min(least, contact_value(lanes, lane, left[0], right[0], left[1], a4))
        store_structure(lanes, lane, left)
        store_structure(lanes, lane + BANK, right)
        lanes[at(TILE_CONTACT, lane)] = least


@vectorised
def advance_buildings(lanes, n0, e0, n1, e1, n2, e2, n3, e3, n4, e4):
    """Step the building of every lane four times; its states are needed by the lane before."""
    for lane in range(PAIR_LANES):
        # direction, state and extremes
        cosine = lanes[at(AXIS_COSINE, lane)]
        sine = lanes[at(AXIS_SINE, lane)]
        motion = load_structure(lanes, lane)
        # first step, from a0 to a1: ground accelerations along the row
        a0 = cosine * n0 + sine * e0
        a1 = cosine * n1 + sine * e1
        motion = step_structure(lanes, lane, motion, a0, a1)
        lanes[at(STEPPED, lane)] = motion[0]
        lanes[at(STEPPED_VELOCITY, lane)] = motion[1]
        # second step
        a2 = cosine * n2 + sine * e2
        motion = step_structure(lanes, lane, motion, a1, a2)
        lanes[at(STEPPED + 1, lane)] = motion[0]
        lanes[at(STEPPED_VELOCITY + 1, lane)] = motion[1]
        # third step
        a3 = cosine * n3 + sine * e3
        motion = step_structure(lanes, lane, motion, a2, a3)
        lanes[at(STEPPED + 2, lane)] = motion[0]
        lanes[at(STEPPED_VELOCITY + 2, lane)] = motion[1]
        # fourth step
        a4 = cosine * n4 + sine * e4
        motion = step_structure(lanes, lane, motion, a3, a4)
        lanes[at(STEPPED + 3, lane)] = motion[0]
        lanes[at(STEPPED_VELOCITY + 3, lane)] = motion[1]
        store_structure(lanes, lane, motion)
    for lane in range(PAIR_LANES):
        # least contact function after these steps
        _lower_contact(lanes, lane, 1, STEPPED, STEPPED_VELOCITY, n1, e1, False)
        _lower_contact(lanes, lane, 1, STEPPED + 1, STEPPED_VELOCITY + 1, n2, e2, False)
        _lower_contact(lanes, lane, 1, STEPPED + 2, STEPPED_VELOCITY + 2, n3, e3, False)
        _lower_contact(lanes, lane, 1, STEPPED + 3, STEPPED_VELOCITY + 3, n4, e4, False)


@vectorised
def raise_relative(lanes, begins):
    """Raise the relative displacements of the tile to those now, or begin with them."""
    for lane in range(PAIR_LANES):
        relative = lanes[at(DISPLACEMENT, lane + BANK)] - lanes[at(DISPLACEMENT, lane)]
        # to either side
        opening = relative if begins else max(lanes[at(TILE_RELATIVE, lane)], relative)
        closing = -relative if begins else max(lanes[at(TILE_RELATIVE + 1, lane)], -relative)
        lanes[at(TILE_RELATIVE, lane)] = opening
        lanes[at(TILE_RELATIVE + 1, lane)] = closing


@inlined
def _lower_speed(lanes, place, begins):
    """Lower the least speed of a building towards the side that yields, or begin with it."""
    speed = lanes[at(YIELD_SIDE, place)] * lanes[at(VELOCITY, place)]
    least = speed if begins else min(lanes[at(TILE_SPEED, place)], speed)
    lanes[at(TILE_SPEED, place)] = least


@vectorised
def lower_speeds(lanes, kind, begins):
    """Lower the least speeds towards the sides that yield to those now, or begin with them."""
    for lane in range(PAIR_LANES):
        _lower_speed(lanes, lane, begins)
    if kind != ROWS:
        for lane in range(PAIR_LANES):
            _lower_speed(lanes, lane + BANK, begins)


@vectorised
def _flag_yielding(lanes, flags, kind):
    """Flag every lane in which a building yields now."""
    for lane in range(PAIR_LANES):
        flags[lane] = 1 if lanes[at(YIELD_SIDE, lane)] != 0.0 else 0
    if kind != ROWS:
        for lane in range(PAIR_LANES):
            flags[lane] |= 1 if lanes[at(YIELD_SIDE, lane + BANK)] != 0.0 else 0


@inlined
def _sum_of(flags):
    """Return the sum of the flags of all lanes."""
    total = 0
    for lane in range(PAIR_LANES):
        total += flags[lane]
    return total


@inlined
def _structure_flag(lanes, place, peak_flag, peak, jump):
    """
    Bound a building between the samples; return its flags if it may peak or yield.

    ``peak`` and ``jump`` are the largest acceleration (north, east) in the tile, and its largest
    change over a step. The radius grows inside a step only from an end to a root of the power
    (``raise_maxima`` of ``maxima_in_step``).
    """
    # extremes at the samples
    cosine = abs(lanes[at(AXIS_COSINE, place)])
    sine = abs(lanes[at(AXIS_SINE, place)])
    high = lanes[at(TILE_HIGH, place)]
    low = lanes[at(TILE_LOW, place)]
    reach = max(high, -low)
    radius = math.sqrt(lanes[at(TILE_RADIUS_SQUARED, place)])
    # largest acceleration at the samples, by its coefficients
    by_displacement = lanes[at(ACCELERATION, place)]
    by_velocity = abs(lanes[at(ACCELERATION + 1, place)])
    by_ground = abs(lanes[at(ACCELERATION + 2, place)])
    constant = abs(lanes[at(ACCELERATION + 3, place)])
    strength = (
        abs(by_displacement) * reach
        + by_velocity * radius
        + by_ground * (cosine * peak[0] + sine * peak[1])
        + constant
    )
    # error bounds of displacement and velocity, and largest acceleration inside a step
    angle = lanes[at(ANGLE, place)]
    inside = (1.0 + lanes[at(ACCELERATION_ERROR, place)]) * strength
    error = lanes[at(DISPLACEMENT_ERROR, place)] * strength
    lanes[at(TILE_DISPLACEMENT_ERROR, place)] = error
    lanes[at(TILE_VELOCITY_ERROR, place)] = lanes[at(VELOCITY_ERROR, place)] * strength
    # largest change of the power u'' + omega² u over a step, and by it the largest radius
    fastest = radius + 0.5 * angle * inside
    change = angle * (abs(1.0 + by_displacement) * fastest + by_velocity * inside)
    change += by_ground * (cosine * jump[0] + sine * jump[1])
    power_error = 8.0 * lanes[at(POWER_ERROR, place)] * strength
    widest = radius + 0.125 * angle * (change + power_error)
    lanes[at(TILE_RADIUS_SQUARED_BOUND, place)] = widest * widest
    # maxima so far that may be passed
    is_further = reach + error > lanes[at(MAXIMUM_SO_FAR, place)]
    rises = is_further | (widest * widest > lanes[at(RADIUS_SQUARED_SO_FAR, place)])
    # elastic range that may be left
    centre = lanes[at(YIELD_CENTRE, place)]
    distance = max(high - centre, centre - low)
    yields = distance + error > lanes[at(YIELD_LIMIT, place)]
    return (peak_flag if rises else 0) | (EVENT_FLAG if yields else 0)


@vectorised
def flag_structures(lanes, flags, kind, peak, jump):
    """Bound all buildings between the samples; flag lanes where one may peak or yield."""
    for lane in range(PAIR_LANES):
        flags[lane] = _structure_flag(lanes, lane, PEAK_FLAGS[0], peak, jump)
    if kind != ROWS:
        for lane in range(PAIR_LANES):
            flags[lane] |= _structure_flag(lanes, lane + BANK, PEAK_FLAGS[1], peak, jump)


@inlined
def _may_unload(lanes, place):
    """Return whether a yielding building may unload in the tile."""
    # From the nearer of two samples UNROLLED_STEPS apart the velocity falls for half of these steps
    # at most, in each by angle times the largest acceleration: less than four of its error bounds
    fall = 2.0 * UNROLLED_STEPS * lanes[at(TILE_VELOCITY_ERROR, place)]
    return (lanes[at(YIELD_SIDE, place)] != 0.0) & (lanes[at(TILE_SPEED, place)] <= fall)


@vectorised
def flag_unloading(lanes, flags, kind):
    """Flag lanes in which a yielding building may unload."""
    for lane in range(PAIR_LANES):
        flags[lane] |= EVENT_FLAG if _may_unload(lanes, lane) else 0
    if kind != ROWS:
        for lane in range(PAIR_LANES):
            flags[lane] |= EVENT_FLAG if _may_unload(lanes, lane + BANK) else 0


@inlined
def _may_meet_or_part(lanes, lane, stride):
    """Return whether a building may meet its right neighbour, or part from it, in the tile."""
    # error bound of the contact function between the samples
    own = lanes[at(TILE_DISPLACEMENT_ERROR, lane)]
    other = lanes[at(TILE_DISPLACEMENT_ERROR, lane + stride)]
    margin = abs(lanes[at(CONTACT_FUNCTION, lane)]) * own
    margin += abs(lanes[at(CONTACT_FUNCTION + 1, lane)]) * other
    margin += abs(lanes[at(CONTACT_FUNCTION + 2, lane)]) * lanes[at(TILE_VELOCITY_ERROR, lane)]
    # its rounding
    reach = max(lanes[at(TILE_HIGH, lane)], -lanes[at(TILE_LOW, lane)])
    rounding = lanes[at(CONTACT_ROUNDING, lane)] * reach
    return lanes[at(TILE_CONTACT, lane)] - margin < -rounding


@vectorised
def flag_contacts(lanes, flags, kind):
    """Flag lanes whose building may meet its right neighbour, or part from it."""
    if kind == ROWS:
        for lane in range(PAIR_LANES):
            flags[lane] |= EVENT_FLAG if _may_meet_or_part(lanes, lane, 1) else 0
    else:
        for lane in range(PAIR_LANES):
            flags[lane] |= EVENT_FLAG if _may_meet_or_part(lanes, lane, BANK) else 0


@vectorised
def flag_relative(lanes, flags):
    """Flag lanes whose relative displacement may pass its largest values in the tile."""
    for lane in range(PAIR_LANES):
        # error bound between the samples
        margin = lanes[at(TILE_DISPLACEMENT_ERROR, lane)]
        margin += lanes[at(TILE_DISPLACEMENT_ERROR, lane + BANK)]
        opens = lanes[at(TILE_RELATIVE, lane)] + margin > lanes[at(RELATIVE_SO_FAR, lane)]
        closes = lanes[at(TILE_RELATIVE + 1, lane)] + margin > lanes[at(RELATIVE_SO_FAR + 1, lane)]
        flags[lane] |= EVENT_FLAG if opens | closes else 0


@inlined
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
def _advance_four_steps(kind, lanes, ground, k):
    """Step all lanes four times from the k-th step of the tile on."""
    # north and east acceleration at the samples
    n0, n1, n2, n3 = ground[0, k], ground[0, k + 1], ground[0, k + 2], ground[0, k + 3]
    e0, e1, e2, e3 = ground[1, k], ground[1, k + 1], ground[1, k + 2], ground[1, k + 3]
    n4, e4 = ground[0, k + 4], ground[1, k + 4]
    # contact functions of rows read the states of the next lane
    if kind == PAIRS:
        advance_pairs(lanes, n0, e0, n1, e1, n2, e2, n3, e3, n4, e4)
    else:
        advance_buildings(lanes, n0, e0, n1, e1, n2, e2, n3, e3, n4, e4)


@inlined
def _follow_contacts(kind, lanes, ground, k, begins):
    """Follow contact functions, or relative displacements without contact, to the k-th sample."""
    if kind == APART:
        raise_relative(lanes, begins)
    else:
        lower_contacts(lanes, kind, ground[0, k], ground[1, k], begins)


@lean
def sweep_tile(kind, lanes, flags, ground, count):
    """
    Step every lane through a tile as if no event happened, and flag lanes where one may.

    Parameters
    ----------
    kind : int
        PAIRS, APART or ROWS.
    lanes : (LANE_ROWS * PAIR_LANES,) ndarray
        Numbers of all lanes at the start of the tile, then at its end; for APART those of
        LANE_ROWS_WITHOUT_CONTACT rows.
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
    start_structures(lanes, kind)
    _flag_yielding(lanes, flags, kind)
    yields = _sum_of(flags) > 0
    _follow_contacts(kind, lanes, ground, 0, True)
    k = 0
    while k < count:
        # speeds of yielding buildings at every fourth sample
        if yields and k % UNROLLED_STEPS == 0:
            lower_speeds(lanes, kind, k == 0)
        if kind != APART and k + UNROLLED_STEPS <= count:
            _advance_four_steps(kind, lanes, ground, k)
            k += UNROLLED_STEPS
        else:
            # the rest of the tile, or a sample at a time
            n0, e0, n1, e1 = ground[0, k], ground[1, k], ground[0, k + 1], ground[1, k + 1]
            advance_one_step(lanes, kind, n0, e0, n1, e1)
            k += 1
            _follow_contacts(kind, lanes, ground, k, False)
    # maxima and yielding, unloading, then contacts
    peak, jump = ground_extremes(ground, count)
    flag_structures(lanes, flags, kind, peak, jump)
    if yields:
        lower_speeds(lanes, kind, False)
        flag_unloading(lanes, flags, kind)
    if kind == APART:
        flag_relative(lanes, flags)
    else:
        flag_contacts(lanes, flags, kind)
    return _sum_of(flags)
