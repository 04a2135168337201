"""
Many pairs against one record: 32 side by side as SIMD lanes, each left to scalar code only where something happens.

In each of its phases a pair is two linear equations, so that one step is the same arithmetic for every lane; only the
coefficients differ between free, touching and yielding pairs. After a step, bounds by the Bernstein control points of
cubic Hermite interpolation tell which lanes may have met, parted, yielded, unloaded or passed a maximum inside the
step. Those are repeated from the step's start, event by event, by the code of single histories.

Everything of a lane stands in one array, row by row of 32 lanes, because the compiler would have to check every pair of
arrays for overlap. A lane's numbers depend on nothing but the pair: 32 lanes are always computed.
"""

from ._jit import kernel

LANES = 32

# rows of one structure; those of the second follow after STRUCTURE_ROWS
PLACE, SPEED, NEXT_PLACE, NEXT_SPEED = 0, 1, 2, 3
#: One step: place and speed from place, speed, ground acceleration at both ends, and a constant.
STEP_PLACE, STEP_SPEED = 4, 9
#: Acceleration from place, speed, ground acceleration and a constant.
PULL = 14
STIFF, FLEXIBILITY, LARGEST_PLACE, LARGEST_RADIUS = 18, 19, 20, 21
LIMIT, CENTRE, SIDE, PLACE_MARGIN, SPEED_MARGIN = 22, 23, 24, 25, 26
STRUCTURE_ROWS = 27
# rows of the pair
COSINE, SINE = 54, 55
#: The clearance, or in contact the force per unit mass: from both places, speed 1, ground acceleration and a constant.
GUARD = 56
MARGIN_SHARE, FORCE_FLOOR, ACTIVE = 61, 62, 63
ROWS = 64


@kernel
def at(row, lane):
    """Return where a lane's number of a row stands."""
    return row * LANES + lane


@kernel
def _linear(lanes, row, lane, place, speed, ground):
    """Return a linear form of place, speed and ground acceleration, with its constant."""
    constant = lanes[at(row + 3, lane)]
    form = lanes[at(row + 2, lane)] * ground + constant
    return lanes[at(row, lane)] * place + (lanes[at(row + 1, lane)] * speed + form)


@kernel
def _step(lanes, row, lane, place, speed, ground, next_ground):
    """Return what one step makes of place or speed."""
    drive = lanes[at(row + 3, lane)] * next_ground + lanes[at(row + 4, lane)]
    form = lanes[at(row + 2, lane)] * ground + drive
    return lanes[at(row, lane)] * place + (lanes[at(row + 1, lane)] * speed + form)


@kernel
def _hull(first, first_rate, last, last_rate, third):
    """Return the least and largest Bernstein control point of a cubic, ``third`` being a third of the step."""
    early, late = first + third * first_rate, last - third * last_rate
    return min(first, last, early, late), max(first, last, early, late)


@kernel
def _step_structure(lanes, first, lane, ground, next_ground, slope, duration):
    """
    Step one structure; return its start, its end, its pulls, its margin, and whether something may happen in between.

    Something: a displacement or radius above its maximum between the ends, yielding, or unloading.
    """
    third = duration / 3.0
    place, speed = lanes[at(first + PLACE, lane)], lanes[at(first + SPEED, lane)]
    next_place = _step(lanes, first + STEP_PLACE, lane, place, speed, ground, next_ground)
    next_speed = _step(lanes, first + STEP_SPEED, lane, place, speed, ground, next_ground)
    pull = _linear(lanes, first + PULL, lane, place, speed, ground)
    next_pull = _linear(lanes, first + PULL, lane, next_place, next_speed, next_ground)
    lanes[at(first + NEXT_PLACE, lane)], lanes[at(first + NEXT_SPEED, lane)] = next_place, next_speed

    flexibility, active = lanes[at(first + FLEXIBILITY, lane)], lanes[at(ACTIVE, lane)]
    radius = place * place + flexibility * speed * speed
    next_radius = next_place * next_place + flexibility * next_speed * next_speed
    highest = max(lanes[at(first + LARGEST_PLACE, lane)], active * abs(place))
    widest = max(lanes[at(first + LARGEST_RADIUS, lane)], active * radius)
    lanes[at(first + LARGEST_PLACE, lane)], lanes[at(first + LARGEST_RADIUS, lane)] = highest, widest

    strength = abs(pull) + abs(next_pull)
    speed_margin = lanes[at(first + SPEED_MARGIN, lane)] * strength
    low, high = _hull(speed, pull, next_speed, next_pull, third)
    low, high = low - speed_margin, high + speed_margin
    passing = max(abs(place), abs(next_place)) + 0.5 * duration * max(-low, high)
    happens = (low <= 0.0) & (high >= 0.0) & (passing > highest)
    happens |= _may_widen(
        lanes, first, lane, (place, speed, pull), (next_place, next_speed, next_pull), slope, duration,
        (max(radius, next_radius), widest),
    )  # fmt: skip

    margin, centre = lanes[at(first + PLACE_MARGIN, lane)] * strength, lanes[at(first + CENTRE, lane)]
    left, right = _hull(place - centre, speed, next_place - centre, next_speed, third)
    side = lanes[at(first + SIDE, lane)]
    happens |= max(-left, right) + margin > lanes[at(first + LIMIT, lane)]
    early, late = side * (speed + third * pull), side * (next_speed - third * next_pull)
    happens |= min(early, late, side * next_speed) < 0.0
    return (place, speed, pull), (next_place, next_speed, next_pull), margin, happens


@kernel
def _may_widen(lanes, first, lane, start, end, slope, duration, radii):
    """Tell whether the squared radius may exceed its maximum where ``u'' + omega² u`` is zero inside the step."""
    stiff = lanes[at(first + STIFF, lane)]
    by_place, by_speed = lanes[at(first + PULL, lane)], lanes[at(first + PULL + 1, lane)]
    jerk = lanes[at(first + PULL + 2, lane)] * slope
    rate = stiff * start[1] + by_place * start[1] + by_speed * start[2] + jerk
    next_rate = stiff * end[1] + by_place * end[1] + by_speed * end[2] + jerk
    power, next_power = stiff * start[0] + start[2], stiff * end[0] + end[2]
    low, high = _hull(power, rate, next_power, next_rate, duration / 3.0)
    # (r + e)² <= 1.125 r² + 9 e², e = duration / 2 times the largest rate of r, |u'' + omega² u| / omega
    largest = duration * max(-low, high)
    bound = 1.125 * radii[0] + 2.25 * lanes[at(first + FLEXIBILITY, lane)] * largest * largest
    return (low <= 0.0) & (high >= 0.0) & (bound > radii[1])


@kernel
def step_lanes(lanes, flags, north, east, next_north, next_east, duration):
    """Step every lane as if nothing happened; flag those where something may."""
    for lane in range(LANES):
        cosine, sine = lanes[at(COSINE, lane)], lanes[at(SINE, lane)]
        ground, next_ground = cosine * north + sine * east, cosine * next_north + sine * next_east
        slope = (next_ground - ground) / duration
        start_1, end_1, margin_1, happens_1 = _step_structure(lanes, 0, lane, ground, next_ground, slope, duration)
        start_2, end_2, margin_2, happens_2 = _step_structure(
            lanes, STRUCTURE_ROWS, lane, ground, next_ground, slope, duration
        )
        by_1, by_2 = lanes[at(GUARD, lane)], lanes[at(GUARD + 1, lane)]
        by_speed, by_ground = lanes[at(GUARD + 2, lane)], lanes[at(GUARD + 3, lane)]
        constant = lanes[at(GUARD + 4, lane)]
        third = duration / 3.0
        guard = by_1 * start_1[0] + by_2 * start_2[0] + by_speed * start_1[1] + by_ground * ground + constant
        last = by_1 * end_1[0] + by_2 * end_2[0] + by_speed * end_1[1] + by_ground * next_ground + constant
        rate = by_1 * start_1[1] + by_2 * start_2[1] + by_speed * start_1[2] + by_ground * slope
        last_rate = by_1 * end_1[1] + by_2 * end_2[1] + by_speed * end_1[2] + by_ground * slope
        least = min(last, guard + third * rate, last - third * last_rate)
        floor = lanes[at(FORCE_FLOOR, lane)] * lanes[at(LARGEST_PLACE, lane)]
        closes = least < lanes[at(MARGIN_SHARE, lane)] * (margin_1 + margin_2) - floor
        happens = (closes | happens_1 | happens_2) & (lanes[at(ACTIVE, lane)] > 0.0)
        flags[lane] = 1 if happens else 0


@kernel
def count_flags(flags):
    """Return how many lanes are flagged."""
    count = 0
    for lane in range(LANES):
        count += flags[lane]
    return count


@kernel
def accept_step(lanes):
    """Make the ends of the step the starts of the next."""
    for lane in range(LANES):
        for first in (0, STRUCTURE_ROWS):
            lanes[at(first + PLACE, lane)] = lanes[at(first + NEXT_PLACE, lane)]
            lanes[at(first + SPEED, lane)] = lanes[at(first + NEXT_SPEED, lane)]
