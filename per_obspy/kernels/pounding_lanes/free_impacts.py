"""
Plain impacts: a free pair whose clearance, as its bounds show, closes once in what is left of a step, or not at all.

Most steps of a pounding pair in which something happens consist of such pieces. What is not plain
is left, from the start of the step or from the last impact on, to the event code of single
histories.
"""

import math

from per_obspy.kernels._jit import inlined, lean
from per_obspy.kernels.polynomial_roots import value_and_slope
from per_obspy.kernels.pounding_events.contact import lingers, meet, strike
from per_obspy.kernels.pounding_events.motion import BOUNCES, SHAPE, STILL, TERMS, V
from per_obspy.kernels.pounding_lanes.lanes import (
    ANGLE,
    BEND,
    OMEGA,
    PLACE,
    PULL,
    SPEED,
    SPEED_SAG,
    STRUCTURE_ROWS,
)
from per_obspy.kernels.pounding_lanes.lanes import GUARD as CLOSING
from per_obspy.kernels.pounding_lanes.maxima_in_step import may_rise, may_yield, raise_inside, state
from per_obspy.kernels.pounding_lanes.pair_rows import load_pair

#: A clearance below this share of displacements and gap is not certain to be open.
OPEN = 1e-12
#: What becomes of a clearance in a piece.
UNFORESEEN, STAYS_OPEN, CLOSES_ONCE, CLOSES_NOW = 0, 1, 2, 3
#: Share of a step over which cubics are exact but for rounding, and whose square is rounding; most
#: looks at a contact.
NEAR, LAST, MOST_LOOKS = 1e-4, 1e-9, 10


@inlined
def _clearance(pair, left, right):
    """Return the clearance of a free pair."""
    return pair[CLOSING + 4] - left[0] + right[0]


@inlined
def opening(pair, left, right):
    """Return the rate at which the clearance grows, 1/s of a displacement."""
    return pair[STRUCTURE_ROWS + OMEGA] * right[1] - pair[OMEGA] * left[1]


@lean
def course(pair, left, right, next_left, next_right, share):
    """
    Tell whether a clearance rises, and whether it falls, all through a piece of this share of a step, and is hollow.

    Its rate leaves the chord by ``sag`` at most; the rate falls all through (hollow) or grows where
    the bounds of its own rate have one sign.
    """
    second, omega, other_omega = STRUCTURE_ROWS, pair[OMEGA], pair[STRUCTURE_ROWS + OMEGA]
    first = omega * max(abs(left[2]), abs(next_left[2]))
    other = other_omega * max(abs(right[2]), abs(next_right[2]))
    sag = share * (pair[SPEED_SAG] * first + pair[second + SPEED_SAG] * other)
    bend = omega * pair[BEND] * first + other_omega * pair[second + BEND] * other
    change = other_omega * other_omega * right[2] - omega * omega * left[2]
    next_change = other_omega * other_omega * next_right[2] - omega * omega * next_left[2]
    hollow, grows = max(change, next_change) + bend < 0.0, min(change, next_change) - bend > 0.0
    rate, next_rate = opening(pair, left, right), opening(pair, next_left, next_right)
    rises = (min(rate, next_rate) > sag) | (grows & (rate > 0.0)) | (hollow & (next_rate > 0.0))
    falls = (max(rate, next_rate) < -sag) | (hollow & (rate < 0.0)) | (grows & (next_rate < 0.0))
    return rises, falls, hollow & (rate > 0.0)


@lean
def foreseen(pair, left, right, next_left, next_right, share):
    """Tell what becomes of the clearance of a free pair in a piece of this share of a step, between two states."""
    rises, falls, turns = course(pair, left, right, next_left, next_right, share)
    if rises:
        return STAYS_OPEN
    if not (falls | turns):
        return UNFORESEEN
    is_open = _clearance(pair, left, right) > OPEN * (
        abs(left[0]) + abs(right[0]) + pair[CLOSING + 4]
    )
    if falls & (not is_open):
        return CLOSES_NOW
    return CLOSES_ONCE if _clearance(pair, next_left, next_right) < 0.0 else STAYS_OPEN


@inlined
def _first_guess(start, slope, end):
    """Return where the parabola with this start, slope and end at 1 falls through zero."""
    bend = end - start - slope
    root = math.sqrt(max(slope * slope - 4.0 * bend * start, 0.0))
    return 2.0 * start / (root - slope) if slope <= 0.0 else -0.5 * (slope + root) / bend


@inlined
def _rate(pair, first, now, change):
    """Return how fast an acceleration grows, per step, over which the ground changes by so much."""
    return pair[first + ANGLE] * (pair[first + PULL] * now[1] + pair[first + PULL + 1] * now[2]) + (
        pair[first + PULL + 2] * change
    )


@inlined
def inside(pair, row, i, start, change, share):
    """
    Return the state of structure i after a share of a step, over all of which the ground changes by so much.

    As the ground is linear, the acceleration y is in free vibration: with B, twice the integral of
    its response to a unit rate, and dots for shares of the step, ``y = y0 (1 - k B') + y0' B''``
    where ``B'' + d B' + k B = share``.
    """
    first, (place, speed, pull) = i * STRUCTURE_ROWS, start
    angle, rate = pair[first + ANGLE], _rate(pair, first, start, change)
    damping, stiffness = -angle * pair[first + PULL + 1], -angle * angle * pair[first + PULL]
    cubic, slope = value_and_slope(row, i, SHAPE + 3, int(row[0, TERMS]) - 3, share)
    shape, shape_rate = share * share * share * cubic, share * share * (3.0 * cubic + share * slope)
    moved = share * speed + angle * (pull * (shape_rate + damping * shape) + rate * shape)
    faster = pull * (share - stiffness * shape) + rate * shape_rate
    pulled = pull * (1.0 - stiffness * shape_rate) + rate * (
        share - damping * shape_rate - stiffness * shape
    )
    return place + angle * moved, speed + angle * faster, pulled


@inlined
def _near(pair, first, now, rate, share):
    """Return the state a share of a step later or earlier, so near that the acceleration is linear."""
    angle = share * pair[first + ANGLE]
    place = now[0] + angle * (now[1] + angle * (0.5 * now[2] + rate * share / 6.0))
    return place, now[1] + angle * (now[2] + 0.5 * rate * share), now[2] + rate * share


@lean
def meeting(pair, row, left, right, next_left, next_right, share, segment):
    """
    Return the share of a step after which the clearance, which closes once in a piece, falls to zero, and both states.

    Looks at the clearance where the last one said, by its cubic, that it is zero; the share is -1
    if that does not end.
    """
    second, change = STRUCTURE_ROWS, segment.slope * segment.duration
    omega, other_omega = pair[OMEGA] * segment.duration, pair[second + OMEGA] * segment.duration
    start, end = _clearance(pair, left, right), _clearance(pair, next_left, next_right)
    time = share * _first_guess(start, opening(pair, left, right) * segment.duration * share, end)
    for _ in range(MOST_LOOKS):
        hit_left, hit_right = (
            inside(pair, row, 0, left, change, time),
            inside(pair, row, 1, right, change, time),
        )
        rate, other_rate = _rate(pair, 0, hit_left, change), _rate(pair, second, hit_right, change)
        value, slope = (
            _clearance(pair, hit_left, hit_right),
            other_omega * hit_right[1] - omega * hit_left[1],
        )
        bend = 0.5 * (other_omega * other_omega * hit_right[2] - omega * omega * hit_left[2])
        twist = (other_omega * other_omega * other_rate - omega * omega * rate) / 6.0
        inverse = 1.0 / slope
        step = -value * inverse
        step -= step * step * bend * inverse
        last = -(value + step * (slope + step * (bend + step * twist))) * inverse
        step += last
        time += step
        if (abs(step) <= NEAR) & (abs(last) <= LAST):
            is_in = (0.0 < time < share - OPEN) & (slope < 0.0)
            hit_left = _near(pair, 0, hit_left, rate, step)
            return (
                time if is_in else -1.0,
                hit_left,
                _near(pair, second, hit_right, other_rate, step),
            )
    return -1.0, left, right


@inlined
def put(pair, left, right):
    """Give a pair the displacement and speed of two states."""
    pair[PLACE], pair[SPEED] = left[0], left[1]
    pair[STRUCTURE_ROWS + PLACE], pair[STRUCTURE_ROWS + SPEED] = right[0], right[1]


@lean
def _after_impact(pair, row, log, left, right, segment, elapsed):
    """Let a pair in these states hit, after a share of the step; return its states then."""
    put(pair, left, right)
    load_pair(pair, row)
    strike(row, log, 0, segment.start + elapsed * segment.duration)
    ground, second = (
        segment.acceleration + elapsed * segment.slope * segment.duration,
        STRUCTURE_ROWS,
    )
    hit_left = state(pair, 0, left[0], row[0, V] / pair[OMEGA], ground)
    return hit_left, state(pair, second, right[0], row[1, V] / pair[second + OMEGA], ground)


@lean
def _raise_both(pair, row, left, right, next_left, next_right, change, share):
    """Raise the maxima of both structures to those of a piece."""
    if may_rise(pair, row, 0, left, next_left):
        raise_inside(pair, row, 0, left, next_left, change, share)
    if may_rise(pair, row, 1, right, next_right):
        raise_inside(pair, row, 1, right, next_right, change, share)


@lean
def next_impact(pair, row, left, right, next_left, next_right, share, segment):
    """
    Return the share of a step until the impact in a piece of it, and both states then.

    The share is infinite, and the states are those at the end, if there is no impact; it is -1 if
    that is unforeseen.
    """
    fate = foreseen(pair, left, right, next_left, next_right, share)
    if may_yield(pair, 0, left, next_left) or may_yield(pair, STRUCTURE_ROWS, right, next_right):
        fate = UNFORESEEN
    if fate == CLOSES_ONCE:
        return meeting(pair, row, left, right, next_left, next_right, share, segment)
    if fate == CLOSES_NOW:
        return 0.0, left, right
    return math.inf if fate == STAYS_OPEN else -1.0, next_left, next_right


@lean
def bounce(pair, row, log, left, right, next_left, next_right, segment):
    """
    Carry a free pair through a step of plain impacts, from two states to the two that it would have without.

    Return the time until which that was possible: the duration of the step, when ``pair`` has the
    state; else that of the last impact, when the row has it; or -1 if nothing was done.
    """
    elapsed, change = 0.0, segment.slope * segment.duration  # times as shares of the step
    while True:
        rest = 1.0 - elapsed
        share, next_left, next_right = next_impact(
            pair, row, left, right, next_left, next_right, rest, segment
        )
        if share < 0.0 or (
            share <= rest and opening(pair, next_left, next_right) >= -row[0, STILL]
        ):
            break
        _raise_both(pair, row, left, right, next_left, next_right, change, min(share, rest))
        if share > rest:
            put(pair, next_left, next_right)
            return segment.duration
        elapsed += share
        left, right = _after_impact(pair, row, log, next_left, next_right, segment, elapsed)
        if lingers(row, 0, segment.acceleration + elapsed * change):
            break
        next_left = inside(pair, row, 0, left, change, 1.0 - elapsed)
        next_right = inside(pair, row, 1, right, change, 1.0 - elapsed)
    if row[0, BOUNCES] == 0.0:
        return -1.0
    meet(row, log, segment, elapsed * segment.duration, 0)
    return elapsed * segment.duration
