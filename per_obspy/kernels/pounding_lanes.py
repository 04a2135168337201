"""
Many pairs against one record: 32 side by side as SIMD lanes, each left to scalar code only where something happens.

In each of its phases a pair is two linear equations, so that one step is the same arithmetic for every lane; only the
coefficients differ between free, touching and yielding pairs. After a step, bounds by the Bernstein control points of
cubic Hermite interpolation tell which lanes may have met, parted, yielded, unloaded or passed a maximum inside the
step. Those are repeated from the step's start, event by event, by the code of single histories.

Everything of a lane stands in one array, row by row of 32 lanes, because the compiler would have to check every pair of
arrays for overlap; each function is one loop over the lanes, so that it vectorises. A lane's numbers depend on nothing
but the pair: 32 lanes are always computed.
"""

from ._jit import kernel

LANES = 32

#: Flags, which add up: a maximum of the first or second structure, an event.
LEFT_PEAK, RIGHT_PEAK, EVENT = 1, 2, 4

# rows of one structure; those of the second follow after STRUCTURE_ROWS
PLACE, SPEED, NEXT_PLACE, NEXT_SPEED = 0, 1, 2, 3
#: One step: place and speed from place, speed, ground acceleration at both ends, and a constant.
STEP_PLACE, STEP_SPEED = 4, 9
#: Acceleration from place, speed, ground acceleration and a constant.
PULL = 14
STIFF, FLEXIBILITY, LARGEST_PLACE, LARGEST_RADIUS = 18, 19, 20, 21
LIMIT, CENTRE, SIDE, PLACE_MARGIN, POWER_MARGIN = 22, 23, 24, 25, 26
#: Of the current step: ground acceleration and acceleration at its ends, and the sum of the accelerations' sizes, to
#: which the error of the bounds is proportional.
GROUND, NEXT_GROUND, START_PULL, END_PULL, STRENGTH = 27, 28, 29, 30, 31
#: 1, or 0 where nothing can happen any more.
ACTIVE = 32
STRUCTURE_ROWS = 33
# rows of the pair
COSINE, SINE = 66, 67
#: The gap, infinite in contact.
CLEAR = 68
#: Force of a contact per unit mass: from both places, speed 1, ground acceleration and a constant; above any if free.
FORCE = 69
FORCE_FLOOR = 74
ROWS = 75


@kernel
def at(row, lane):
    """Return where a lane's number of a row stands."""
    return row * LANES + lane


@kernel
def _step(lanes, row, lane, place, speed, ground, next_ground):
    """Return what one step makes of place or speed."""
    drive = lanes[at(row + 3, lane)] * next_ground + lanes[at(row + 4, lane)]
    form = lanes[at(row + 2, lane)] * ground + drive
    return lanes[at(row, lane)] * place + (lanes[at(row + 1, lane)] * speed + form)


@kernel
def _pull(lanes, row, lane, place, speed, ground):
    """Return the acceleration of a structure."""
    form = lanes[at(row + 2, lane)] * ground + lanes[at(row + 3, lane)]
    return lanes[at(row, lane)] * place + (lanes[at(row + 1, lane)] * speed + form)


@kernel
def shake(lanes, north, east, next_north, next_east):
    """Write the ground acceleration of every lane at both ends of the step."""
    for lane in range(LANES):
        cosine, sine = lanes[at(COSINE, lane)], lanes[at(SINE, lane)]
        ground, next_ground = cosine * north + sine * east, cosine * next_north + sine * next_east
        lanes[at(GROUND, lane)], lanes[at(NEXT_GROUND, lane)] = ground, next_ground
        lanes[at(STRUCTURE_ROWS + GROUND, lane)], lanes[at(STRUCTURE_ROWS + NEXT_GROUND, lane)] = ground, next_ground


@kernel
def _turns(place, next_place, speed, next_speed, bend, duration, highest):
    """
    Tell whether a displacement may pass its maximum where the velocity has a root inside the step.

    The velocity leaves its chord by a quarter of ``bend`` at most, so that it has no root where |v0 + v1| is larger
    than |v0 - v1| by half of it; from an end to a root the displacement grows by an eighth of the step times that.
    """
    spread = abs(speed - next_speed) + 0.5 * bend
    reach = max(abs(place), abs(next_place)) + 0.125 * duration * spread
    return (abs(speed + next_speed) <= spread) & (reach > highest)


@kernel
def _widens(power, next_power, margin, squared_change, radius, widest):
    """
    Tell whether a squared radius may pass its maximum where the power ``u'' + omega² u`` has a root inside the step.

    As ``(r + e)² <= 33/32 r² + 33 e²`` and r grows from an end to the root at most by an eighth of the step times
    ``(|p0 - p1| + margin) / omega``, which is e.
    """
    spread = abs(power - next_power) + margin
    bound = 1.03125 * radius + squared_change * spread * spread
    return (abs(power + next_power) <= spread) & (bound > widest)


@kernel
def move(own, flags, peak, duration):
    """
    Step one structure of every lane as if nothing happened, and raise its maxima to the step's start.

    Flag lanes where it may pass a maximum inside the step by ``peak``.
    """
    squared = 33.0 / 64.0 * duration * duration
    for lane in range(LANES):
        ground, next_ground = own[at(GROUND, lane)], own[at(NEXT_GROUND, lane)]
        place, speed = own[at(PLACE, lane)], own[at(SPEED, lane)]
        next_place = _step(own, STEP_PLACE, lane, place, speed, ground, next_ground)
        next_speed = _step(own, STEP_SPEED, lane, place, speed, ground, next_ground)
        pull = _pull(own, PULL, lane, place, speed, ground)
        next_pull = _pull(own, PULL, lane, next_place, next_speed, next_ground)
        own[at(NEXT_PLACE, lane)], own[at(NEXT_SPEED, lane)] = next_place, next_speed
        own[at(START_PULL, lane)], own[at(END_PULL, lane)] = pull, next_pull
        strength = abs(pull) + abs(next_pull)
        own[at(STRENGTH, lane)] = strength
        flexibility, active = own[at(FLEXIBILITY, lane)], own[at(ACTIVE, lane)]
        radius = place * place + flexibility * (speed * speed)
        highest = max(own[at(LARGEST_PLACE, lane)], active * abs(place))
        widest = max(own[at(LARGEST_RADIUS, lane)], active * radius)
        own[at(LARGEST_PLACE, lane)], own[at(LARGEST_RADIUS, lane)] = highest, widest
        larger = max(radius, next_place * next_place + flexibility * (next_speed * next_speed))
        bend = duration * abs(next_pull - pull)
        turns = _turns(place, next_place, speed, next_speed, bend, duration, highest)
        stiff, margin = own[at(STIFF, lane)], own[at(POWER_MARGIN, lane)] * strength
        power, next_power = stiff * place + pull, stiff * next_place + next_pull
        widens = _widens(power, next_power, margin, squared * flexibility, larger, widest)
        flags[lane] |= peak if turns | widens else 0


@kernel
def flag_yielding(own, flags, duration):
    """Flag lanes where a bilinear structure may yield or unload inside the step."""
    third = duration / 3.0
    for lane in range(LANES):
        speed, next_speed, side = own[at(SPEED, lane)], own[at(NEXT_SPEED, lane)], own[at(SIDE, lane)]
        early = side * (speed + third * own[at(START_PULL, lane)])
        late = side * (next_speed - third * own[at(END_PULL, lane)])
        centre, after = own[at(CENTRE, lane)], own[at(NEXT_PLACE, lane)]
        stretch = max(abs(own[at(PLACE, lane)] + third * speed - centre), abs(after - third * next_speed - centre))
        margin = own[at(PLACE_MARGIN, lane)] * own[at(STRENGTH, lane)]
        yields = max(stretch, abs(after - centre)) + margin > own[at(LIMIT, lane)]
        flags[lane] |= EVENT if yields | (min(early, late, side * next_speed) < 0.0) else 0


@kernel
def flag_hits(lanes, flags, duration):
    """Flag lanes whose clearance may close inside the step."""
    third, second = duration / 3.0, STRUCTURE_ROWS
    for lane in range(LANES):
        gap = lanes[at(CLEAR, lane)]
        start = gap + (lanes[at(second + PLACE, lane)] - lanes[at(PLACE, lane)])
        end = gap + (lanes[at(second + NEXT_PLACE, lane)] - lanes[at(NEXT_PLACE, lane)])
        early = start + third * (lanes[at(second + SPEED, lane)] - lanes[at(SPEED, lane)])
        late = end - third * (lanes[at(second + NEXT_SPEED, lane)] - lanes[at(NEXT_SPEED, lane)])
        margin = lanes[at(PLACE_MARGIN, lane)] * lanes[at(STRENGTH, lane)]
        margin += lanes[at(second + PLACE_MARGIN, lane)] * lanes[at(second + STRENGTH, lane)]
        flags[lane] |= EVENT if min(end, early, late) < margin else 0


@kernel
def flag_releases(lanes, flags, duration):
    """Flag lanes whose contact may open inside the step."""
    third, rate_of_ground = duration / 3.0, 1.0 / duration
    for lane in range(LANES):
        ground, next_ground = lanes[at(GROUND, lane)], lanes[at(NEXT_GROUND, lane)]
        by_1, by_2 = lanes[at(FORCE, lane)], lanes[at(FORCE + 1, lane)]
        by_speed, by_ground = lanes[at(FORCE + 2, lane)], lanes[at(FORCE + 3, lane)]
        constant, second = lanes[at(FORCE + 4, lane)], STRUCTURE_ROWS
        speed, next_speed = lanes[at(SPEED, lane)], lanes[at(NEXT_SPEED, lane)]
        start = by_1 * lanes[at(PLACE, lane)] + by_2 * lanes[at(second + PLACE, lane)]
        start += by_speed * speed + (by_ground * ground + constant)
        end = by_1 * lanes[at(NEXT_PLACE, lane)] + by_2 * lanes[at(second + NEXT_PLACE, lane)]
        end += by_speed * next_speed + (by_ground * next_ground + constant)
        change = by_ground * (next_ground - ground) * rate_of_ground
        rate = (by_1 + by_2) * speed + by_speed * lanes[at(START_PULL, lane)] + change
        end_rate = (by_1 + by_2) * next_speed + by_speed * lanes[at(END_PULL, lane)] + change
        least = min(end, start + third * rate, end - third * end_rate)
        flags[lane] |= EVENT if least < -lanes[at(FORCE_FLOOR, lane)] * lanes[at(LARGEST_PLACE, lane)] else 0


@kernel
def count_flags(own, flags):
    """Return the sum of the flags, those of lanes at rest left out."""
    for lane in range(LANES):
        flags[lane] = flags[lane] if own[at(ACTIVE, lane)] > 0.0 else 0
    count = 0
    for lane in range(LANES):
        count += flags[lane]
    return count


@kernel
def step_lanes(block, flags, duration, bilinear, touching):
    """
    Step every lane as if nothing happened, flag those where something may, and return the sum of the flags.

    ``block`` is all lanes' array, its half of the first structures, and the rest from the second structures on.
    """
    lanes, left, right = block
    for lane in range(LANES):
        flags[lane] = 0
    move(left, flags, LEFT_PEAK, duration)
    move(right, flags, RIGHT_PEAK, duration)
    flag_hits(lanes, flags, duration)
    if bilinear:
        flag_yielding(left, flags, duration)
        flag_yielding(right, flags, duration)
    if touching:
        flag_releases(lanes, flags, duration)
    return count_flags(left, flags)


@kernel
def accept_step(lanes):
    """Make the ends of the step the starts of the next."""
    for lane in range(LANES):
        lanes[at(PLACE, lane)] = lanes[at(NEXT_PLACE, lane)]
        lanes[at(SPEED, lane)] = lanes[at(NEXT_SPEED, lane)]
        lanes[at(STRUCTURE_ROWS + PLACE, lane)] = lanes[at(STRUCTURE_ROWS + NEXT_PLACE, lane)]
        lanes[at(STRUCTURE_ROWS + SPEED, lane)] = lanes[at(STRUCTURE_ROWS + NEXT_SPEED, lane)]
