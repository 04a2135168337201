"""Largest relative displacements of a pair that never touches, exact between samples."""

from per_obspy.kernels._jit import inlined, lean
from per_obspy.kernels.polynomial_roots import first_fall, size_and_curvature, value_and_slope
from per_obspy.kernels.pounding_events.motion import EVENT_FUNCTION, OPENING, TAYLOR, U
from per_obspy.kernels.pounding_events.row_history import is_settled, reach_in_free_vibration
from per_obspy.kernels.pounding_lanes.free_impacts import opening_rate
from per_obspy.kernels.pounding_lanes.lanes import (
    DISPLACEMENT_ERROR,
    OMEGA,
    STRUCTURE_ROWS,
    VELOCITY_ERROR,
)


@inlined
def raise_relative_to(row, relative):
    """Raise the largest relative displacements, u2 - u1 in line 0 and u1 - u2 in line 1, to one."""
    row[0, OPENING] = max(row[0, OPENING], relative)
    row[1, OPENING] = max(row[1, OPENING], -relative)


@lean
def raise_relative(row, span, terms):
    """Raise the largest relative displacements to those of a piece, exact between its ends."""
    _raise_relative_at(row, terms, 0.0)
    _raise_relative_at(row, terms, span)
    # rate of u2 - u1; its bound may exclude larger values inside
    for n in range(1, terms):
        row[0, EVENT_FUNCTION + n - 1] = n * (row[1, TAYLOR + n] - row[0, TAYLOR + n])
    size, _ = size_and_curvature(row, 0, EVENT_FUNCTION, terms - 1, span)
    reach = span * (size + abs(row[0, EVENT_FUNCTION]))
    relative = row[1, U] - row[0, U]
    if relative + reach <= row[0, OPENING] and reach - relative <= row[1, OPENING]:
        return
    # values at the roots of the rate, one after another; its sign changes at each
    value, slope = value_and_slope(row, 0, EVENT_FUNCTION, terms - 1, 0.0)
    sign = 1.0 if value > 0.0 or (value == 0.0 and slope > 0.0) else -1.0
    time = first_fall(row, 0, EVENT_FUNCTION, terms - 1, sign, 0.0, span, 0.0)
    while time >= 0.0:
        _raise_relative_at(row, terms, time)
        sign = -sign
        time = first_fall(row, 0, EVENT_FUNCTION, terms - 1, sign, time, span, 0.0)


@lean
def _raise_relative_at(row, terms, time):
    """Raise the largest relative displacements to the one at a time of the piece."""
    left, _ = value_and_slope(row, 0, TAYLOR, terms, time)
    right, _ = value_and_slope(row, 1, TAYLOR, terms, time)
    raise_relative_to(row, right - left)


@inlined
def may_exceed_relative(pair, row, left, right, next_left, next_right):
    """
    Return whether the relative displacement may pass its largest values inside a step.

    Raise these values to the one at the start; the end is not certain before it is known that no
    structure leaves its branch. The rate leaves its chord by ``error`` at most, so that it has no
    root where the sum of its ends is too large.
    """
    second = STRUCTURE_ROWS
    strength = max(abs(left[2]), abs(next_left[2]))
    other_strength = max(abs(right[2]), abs(next_right[2]))
    # relative displacement and its rate at both ends
    before = right[0] - left[0]
    after = next_right[0] - next_left[0]
    rate = opening_rate(pair, left, right)
    next_rate = opening_rate(pair, next_left, next_right)
    raise_relative_to(row, before)
    # the rate may have a root
    error = (
        pair[OMEGA] * pair[VELOCITY_ERROR] * strength
        + pair[second + OMEGA] * pair[second + VELOCITY_ERROR] * other_strength
    )
    turns = abs(rate + next_rate) <= abs(next_rate - rate) + 2.0 * error
    # the largest values may be passed
    margin = (
        pair[DISPLACEMENT_ERROR] * strength + pair[second + DISPLACEMENT_ERROR] * other_strength
    )
    opens = max(before, after) + margin > row[0, OPENING]
    return turns & (opens | (margin - min(before, after) > row[1, OPENING]))


@lean
def is_relative_settled(row):
    """Return whether free vibration can no longer raise a displacement or the relative one."""
    low_1, high_1 = reach_in_free_vibration(row, 0)
    low_2, high_2 = reach_in_free_vibration(row, 1)
    return (
        is_settled(row) and high_2 - low_1 <= row[0, OPENING] and high_1 - low_2 <= row[1, OPENING]
    )
