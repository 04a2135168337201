"""
Sweep of 32 buildings, side by side as SIMD lanes, through a tile of steps as if no event happened.

It is the sweep of ``pounding_lanes.lanes`` with one building per lane: the buildings of a row are
in adjacent lanes, and the interface after a building is in its lane. Rows of any length share the
lanes, because the contact function of an interface reads the displacement of the next lane. A lane
has the rows of structure 1 and of the contact function; the rows of structure 2 are room for the
states of the last four steps.
"""

from per_obspy.kernels._jit import lean, vectorised
from per_obspy.kernels.pounding_lanes.lanes import (
    AXIS_COSINE,
    AXIS_SINE,
    CONTACT_FUNCTION,
    CONTACT_ROUNDING,
    DISPLACEMENT,
    EVENT_FLAG,
    PAIR_LANES,
    SMALLEST_DISPLACEMENT,
    START_DISPLACEMENT,
    START_VELOCITY,
    STRUCTURE_ROWS,
    TILE_CONTACT,
    TILE_DISPLACEMENT_ERROR,
    TILE_HIGH,
    TILE_LOW,
    TILE_RADIUS_SQUARED,
    TILE_VELOCITY_ERROR,
    UNROLLED_STEPS,
    VELOCITY,
    at,
    flag_structures,
    ground_extremes,
    load_structure,
    step_structure,
    store_structure,
)

#: Displacements and velocities after each of the last four steps.
STEPPED, STEPPED_VELOCITY = STRUCTURE_ROWS, STRUCTURE_ROWS + UNROLLED_STEPS


@lean
def _contact_value(lanes, lane, displacement, velocity, ground):
    """Return the contact function after a building, from the rows of its states."""
    # displacements on both sides, then the part of the velocity and the ground
    left = lanes[at(displacement, lane)]
    right = lanes[at(displacement, lane + 1)]
    form = lanes[at(CONTACT_FUNCTION + 2, lane)] * lanes[at(velocity, lane)] + (
        lanes[at(CONTACT_FUNCTION + 3, lane)] * ground + lanes[at(CONTACT_FUNCTION + 4, lane)]
    )
    return lanes[at(CONTACT_FUNCTION, lane)] * left + (
        lanes[at(CONTACT_FUNCTION + 1, lane)] * right + form
    )


@vectorised
def start_tile(lanes, north, east):
    """Store the states at the start of a tile, and begin its extremes with them."""
    for lane in range(PAIR_LANES):
        # state, without denormal numbers
        displacement = lanes[at(DISPLACEMENT, lane)]
        velocity = lanes[at(VELOCITY, lane)]
        displacement = displacement if abs(displacement) > SMALLEST_DISPLACEMENT else 0.0
        velocity = velocity if abs(velocity) > SMALLEST_DISPLACEMENT else 0.0
        lanes[at(DISPLACEMENT, lane)] = displacement
        lanes[at(START_DISPLACEMENT, lane)] = displacement
        lanes[at(VELOCITY, lane)] = velocity
        lanes[at(START_VELOCITY, lane)] = velocity
        # extremes of displacement and radius
        lanes[at(TILE_HIGH, lane)] = displacement
        lanes[at(TILE_LOW, lane)] = displacement
        radius_squared = displacement * displacement + velocity * velocity
        lanes[at(TILE_RADIUS_SQUARED, lane)] = radius_squared
    for lane in range(PAIR_LANES):
        # contact function under the ground acceleration along the row
        ground = lanes[at(AXIS_COSINE, lane)] * north + lanes[at(AXIS_SINE, lane)] * east
        contact = _contact_value(lanes, lane, DISPLACEMENT, VELOCITY, ground)
        lanes[at(TILE_CONTACT, lane)] = contact


@vectorised
def advance_one_step(lanes, n0, e0, n1, e1):
    """Step every lane from one north and east acceleration to the next."""
    for lane in range(PAIR_LANES):
        # ground acceleration along the row at both ends of the step
        cosine = lanes[at(AXIS_COSINE, lane)]
        sine = lanes[at(AXIS_SINE, lane)]
        a0 = cosine * n0 + sine * e0
        a1 = cosine * n1 + sine * e1
        motion = load_structure(lanes, 0, lane)
        store_structure(lanes, 0, lane, step_structure(lanes, 0, lane, motion, a0, a1))
    for lane in range(PAIR_LANES):
        # least contact function
        ground = lanes[at(AXIS_COSINE, lane)] * n1 + lanes[at(AXIS_SINE, lane)] * e1
        contact = _contact_value(lanes, lane, DISPLACEMENT, VELOCITY, ground)
        lanes[at(TILE_CONTACT, lane)] = min(lanes[at(TILE_CONTACT, lane)], contact)


@vectorised
def advance_four_steps(lanes, n0, e0, n1, e1, n2, e2, n3, e3, n4, e4):
    """Step every lane four times, without a load of its state between the steps."""
    for lane in range(PAIR_LANES):
        # direction, state and extremes
        cosine = lanes[at(AXIS_COSINE, lane)]
        sine = lanes[at(AXIS_SINE, lane)]
        motion = load_structure(lanes, 0, lane)
        # first step, from a0 to a1: ground accelerations along the row
        a0 = cosine * n0 + sine * e0
        a1 = cosine * n1 + sine * e1
        motion = step_structure(lanes, 0, lane, motion, a0, a1)
        lanes[at(STEPPED, lane)] = motion[0]
        lanes[at(STEPPED_VELOCITY, lane)] = motion[1]
        # second step
        a2 = cosine * n2 + sine * e2
        motion = step_structure(lanes, 0, lane, motion, a1, a2)
        lanes[at(STEPPED + 1, lane)] = motion[0]
        lanes[at(STEPPED_VELOCITY + 1, lane)] = motion[1]
        # third step
        a3 = cosine * n3 + sine * e3
        motion = step_structure(lanes, 0, lane, motion, a2, a3)
        lanes[at(STEPPED + 2, lane)] = motion[0]
        lanes[at(STEPPED_VELOCITY + 2, lane)] = motion[1]
        # fourth step
        a4 = cosine * n4 + sine * e4
        motion = step_structure(lanes, 0, lane, motion, a3, a4)
        lanes[at(STEPPED + 3, lane)] = motion[0]
        lanes[at(STEPPED_VELOCITY + 3, lane)] = motion[1]
        # store
        store_structure(lanes, 0, lane, motion)
    for lane in range(PAIR_LANES):
        # least contact function after these steps
        cosine = lanes[at(AXIS_COSINE, lane)]
        sine = lanes[at(AXIS_SINE, lane)]
        least = lanes[at(TILE_CONTACT, lane)]
        a1 = cosine * n1 + sine * e1
        a2 = cosine * n2 + sine * e2
        a3 = cosine * n3 + sine * e3
        a4 = cosine * n4 + sine * e4
        contact_1 = _contact_value(lanes, lane, STEPPED, STEPPED_VELOCITY, a1)
        contact_2 = _contact_value(lanes, lane, STEPPED + 1, STEPPED_VELOCITY + 1, a2)
        contact_3 = _contact_value(lanes, lane, STEPPED + 2, STEPPED_VELOCITY + 2, a3)
        contact_4 = _contact_value(lanes, lane, STEPPED + 3, STEPPED_VELOCITY + 3, a4)
        least = min(least, contact_1, contact_2, contact_3, contact_4)
        lanes[at(TILE_CONTACT, lane)] = least


@lean
def flag_contacts(lanes, flags):
    """Flag lanes whose building may meet its right neighbour, or part from it."""
    for lane in range(PAIR_LANES):
        # error bound of the contact function between the samples
        own = lanes[at(TILE_DISPLACEMENT_ERROR, lane)]
        margin = abs(lanes[at(CONTACT_FUNCTION, lane)]) * own
        neighbour = lanes[at(TILE_DISPLACEMENT_ERROR, lane + 1)]
        margin += abs(lanes[at(CONTACT_FUNCTION + 1, lane)]) * neighbour
        margin += abs(lanes[at(CONTACT_FUNCTION + 2, lane)]) * lanes[at(TILE_VELOCITY_ERROR, lane)]
        # its rounding
        reach = max(lanes[at(TILE_HIGH, lane)], -lanes[at(TILE_LOW, lane)])
        rounding = lanes[at(CONTACT_ROUNDING, lane)] * reach
        flags[lane] |= EVENT_FLAG if lanes[at(TILE_CONTACT, lane)] - margin < -rounding else 0


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
    # four steps at a time
    k = 0
    while k + UNROLLED_STEPS <= count:
        n0 = ground[0, k]
        n1 = ground[0, k + 1]
        n2 = ground[0, k + 2]
        n3 = ground[0, k + 3]
        n4 = ground[0, k + 4]
        e0 = ground[1, k]
        e1 = ground[1, k + 1]
        e2 = ground[1, k + 2]
        e3 = ground[1, k + 3]
        e4 = ground[1, k + 4]
        advance_four_steps(lanes, n0, e0, n1, e1, n2, e2, n3, e3, n4, e4)
        k += UNROLLED_STEPS
    # remaining steps
    while k < count:
        advance_one_step(lanes, ground[0, k], ground[1, k], ground[0, k + 1], ground[1, k + 1])
        k += 1
    # flags
    peak, jump = ground_extremes(ground, count)
    for lane in range(PAIR_LANES):
        flags[lane] = 0
    flag_structures(lanes, flags, 0, peak, jump)
    flag_contacts(lanes, flags)
    total = 0
    for lane in range(PAIR_LANES):
        total += flags[lane]
    return total
