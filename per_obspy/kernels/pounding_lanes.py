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

#: Flags, which add up: a displacement or a radius may pass its maximum, of the second structure four times as much; an
#: event.
TURN, WIDEN, SECOND, EVENT = 1, 2, 4, 16

# rows of one structure; those of the second follow after STRUCTURE_ROWS
#: Displacement and velocity, at the start of the last step too.
PLACE, SPEED, START_PLACE, START_SPEED = 0, 1, 2, 3
#: One step: place and speed from place, speed, ground acceleration at both ends, and a constant.
STEP_PLACE, STEP_SPEED = 4, 9
#: Acceleration from place, speed, ground acceleration and a constant.
PULL = 14
STIFF, FLEXIBILITY = 18, 19
#: Maxima before the last step; infinite where nothing can happen any more.
HIGHEST_PLACE, WIDEST_RADIUS = 20, 21
LIMIT, CENTRE, SIDE = 22, 23, 24
#: How far displacement and power may leave their bounds, times the accelerations; and the former for the last step.
PLACE_MARGIN, POWER_MARGIN, MARGIN = 25, 26, 27
COSINE, SINE = 28, 29
STRUCTURE_ROWS = 30
# rows of the pair
#: The gap, infinite in contact.
CLEAR = 60
#: Force of a contact per unit mass: from both places, speed 1, ground acceleration and a constant; above any if free.
FORCE, FORCE_FLOOR = 61, 66
ROWS = 67


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
def _pull(lanes, lane, place, speed, ground):
    """Return the acceleration of a structure."""
    form = lanes[at(PULL + 2, lane)] * ground + lanes[at(PULL + 3, lane)]
    return lanes[at(PULL, lane)] * place + (lanes[at(PULL + 1, lane)] * speed + form)


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
def move(own, flags, weight, ground, duration):
    """
    Step one structure of every lane as if nothing happened, and raise its maxima to the step's start.

    ``ground`` is north, east, next north and next east. Add to the flags, times a weight, where the structure may pass
    a maximum inside the step.
    """
    north, east, next_north, next_east = ground
    squared = 33.0 / 64.0 * duration * duration
    for lane in range(LANES):
        cosine, sine = own[at(COSINE, lane)], own[at(SINE, lane)]
        here, there = cosine * north + sine * east, cosine * next_north + sine * next_east
        place, speed = own[at(PLACE, lane)], own[at(SPEED, lane)]
        next_place = _step(own, STEP_PLACE, lane, place, speed, here, there)
        next_speed = _step(own, STEP_SPEED, lane, place, speed, here, there)
        own[at(START_PLACE, lane)], own[at(START_SPEED, lane)] = place, speed
        own[at(PLACE, lane)], own[at(SPEED, lane)] = next_place, next_speed
        pull, next_pull = _pull(own, lane, place, speed, here), _pull(own, lane, next_place, next_speed, there)
        strength = abs(pull) + abs(next_pull)
        own[at(MARGIN, lane)] = own[at(PLACE_MARGIN, lane)] * strength
        flexibility = own[at(FLEXIBILITY, lane)]
        radius = place * place + flexibility * (speed * speed)
        highest, widest = max(own[at(HIGHEST_PLACE, lane)], abs(place)), max(own[at(WIDEST_RADIUS, lane)], radius)
        own[at(HIGHEST_PLACE, lane)], own[at(WIDEST_RADIUS, lane)] = highest, widest
        larger = max(radius, next_place * next_place + flexibility * (next_speed * next_speed))
        bend = duration * abs(next_pull - pull)
        turns = _turns(place, next_place, speed, next_speed, bend, duration, highest)
        stiff, margin = own[at(STIFF, lane)], own[at(POWER_MARGIN, lane)] * strength
        power, next_power = stiff * place + pull, stiff * next_place + next_pull
        widens = _widens(power, next_power, margin, squared * flexibility, larger, widest)
        flags[lane] += (weight * TURN if turns else 0) + (weight * WIDEN if widens else 0)


@kernel
def flag_hits(lanes, flags, duration):
    """Flag lanes whose clearance may close inside the step."""
    third, second = duration / 3.0, STRUCTURE_ROWS
    for lane in range(LANES):
        gap = lanes[at(CLEAR, lane)]
        start = gap + (lanes[at(second + START_PLACE, lane)] - lanes[at(START_PLACE, lane)])
        end = gap + (lanes[at(second + PLACE, lane)] - lanes[at(PLACE, lane)])
        early = start + third * (lanes[at(second + START_SPEED, lane)] - lanes[at(START_SPEED, lane)])
        late = end - third * (lanes[at(second + SPEED, lane)] - lanes[at(SPEED, lane)])
        margin = lanes[at(MARGIN, lane)] + lanes[at(second + MARGIN, lane)]
        flags[lane] += EVENT if min(end, early, late) < margin else 0


@kernel
def flag_yielding(own, flags, ground, duration):
    """Flag lanes where a bilinear structure may yield or unload inside the step."""
    north, east, next_north, next_east = ground
    third = duration / 3.0
    for lane in range(LANES):
        cosine, sine, side = own[at(COSINE, lane)], own[at(SINE, lane)], own[at(SIDE, lane)]
        place, speed = own[at(START_PLACE, lane)], own[at(START_SPEED, lane)]
        next_place, next_speed = own[at(PLACE, lane)], own[at(SPEED, lane)]
        pull = _pull(own, lane, place, speed, cosine * north + sine * east)
        next_pull = _pull(own, lane, next_place, next_speed, cosine * next_north + sine * next_east)
        early, late = side * (speed + third * pull), side * (next_speed - third * next_pull)
        unloads = min(early, late, side * next_speed) < 0.0
        centre = own[at(CENTRE, lane)]
        before, after = place + third * speed - centre, next_place - third * next_speed - centre
        stretch = max(abs(before), abs(after), abs(next_place - centre)) + own[at(MARGIN, lane)]
        flags[lane] |= EVENT if unloads | (stretch > own[at(LIMIT, lane)]) else 0


@kernel
def flag_releases(lanes, flags, ground, duration):
    """Flag lanes whose contact may open inside the step."""
    north, east, next_north, next_east = ground
    third, rate_of_ground, second = duration / 3.0, 1.0 / duration, STRUCTURE_ROWS
    for lane in range(LANES):
        cosine, sine = lanes[at(COSINE, lane)], lanes[at(SINE, lane)]
        here, there = cosine * north + sine * east, cosine * next_north + sine * next_east
        by_1, by_2 = lanes[at(FORCE, lane)], lanes[at(FORCE + 1, lane)]
        by_speed, by_ground = lanes[at(FORCE + 2, lane)], lanes[at(FORCE + 3, lane)]
        place, speed = lanes[at(START_PLACE, lane)], lanes[at(START_SPEED, lane)]
        next_place, next_speed = lanes[at(PLACE, lane)], lanes[at(SPEED, lane)]
        start = by_1 * place + by_2 * lanes[at(second + START_PLACE, lane)] + by_speed * speed
        start += by_ground * here + lanes[at(FORCE + 4, lane)]
        end = by_1 * next_place + by_2 * lanes[at(second + PLACE, lane)] + by_speed * next_speed
        end += by_ground * there + lanes[at(FORCE + 4, lane)]
        change = by_ground * (there - here) * rate_of_ground
        rate = (by_1 + by_2) * speed + by_speed * _pull(lanes, lane, place, speed, here) + change
        end_rate = (by_1 + by_2) * next_speed + by_speed * _pull(lanes, lane, next_place, next_speed, there) + change
        least = min(end, start + third * rate, end - third * end_rate)
        flags[lane] |= EVENT if least < -lanes[at(FORCE_FLOOR, lane)] * lanes[at(HIGHEST_PLACE, lane)] else 0


@kernel
def step_lanes(block, flags, ground, duration, bilinear, touching):
    """
    Step every lane as if nothing happened, flag those where something may, and return the sum of the flags.

    ``block`` is all lanes' array, its half of the first structures, and the rest from the second structures on;
    ``ground`` is the acceleration: north, east, next north, next east.
    """
    lanes, left, right = block
    for lane in range(LANES):
        flags[lane] = 0
    move(left, flags, 1, ground, duration)
    move(right, flags, SECOND, ground, duration)
    flag_hits(lanes, flags, duration)
    if bilinear:
        flag_yielding(left, flags, ground, duration)
        flag_yielding(right, flags, ground, duration)
    if touching:
        flag_releases(lanes, flags, ground, duration)
    total = 0
    for lane in range(LANES):
        total += flags[lane]
    return total
