r"""
Largest squares within many independent steps of one oscillator, computed next to each other.

As in `within_step`, by Taylor series and the roots of ``z`` and ``2 xi z + a``. Where the linear
term of such a condition outweighs all others it has one root at most, which Newton's method finds
from the chord; every other step is left to `within_step`.
"""

import math

import numpy as np

from per_obspy.kernels._jit import kernel
from per_obspy.kernels.oscillator.within_step import (
    INVERSES,
    LONGEST_SPAN,
    ROOT_TOLERANCE,
    TERMS,
    largest_in_step,
    series_terms,
    workspace,
)
from per_obspy.kernels.spectra.tile_search import LANES

NEWTON_STEPS = 6

#: Rows of the memory of all problems: largest squares, and 1 where in doubt; root, value and slope
#: there, bound of the second derivative, end of the search and tolerance of a condition; then the
#: piece of a step, and the series of displacement and condition.
SQUARE, DOUBT, ROOT, VALUE, SLOPE, BEND, HIGHEST, TOLERANCE, PIECE = range(9)
DISPLACEMENT = PIECE + 4
CONDITION = DISPLACEMENT + TERMS + 2
ROWS = CONDITION + TERMS


@kernel
def raise_to_step_peaks(problems, azimuths, count, oscillator, best):
    """
    Raise the largest squares along the problems' azimuths to those within their steps.

    ``problems`` (4, lanes): u, z and the acceleration at the start, and the acceleration at the
    end. Only the first ``count`` are looked at.
    """
    _, phase, damping, share = oscillator
    # One piece of memory: twenty take longer than the arithmetic
    room = np.empty((ROWS, LANES))
    squares, doubts = room[SQUARE], room[DOUBT]
    squares[:] = 0.0
    doubts[:] = 0.0
    for row in range(4):
        problems[row, count:] = 0.0
    # All problems next to each other, in pieces short enough for the series
    _raise_to_pieces(problems, phase, damping, share, room)
    # Doubtful ones alone: at z = 0, for the radius also at 2 xi z + a = 0
    selected = 3 if share == 1.0 else 2
    for lane in range(count):
        if doubts[lane] > 0.0:
            largest, work = np.zeros(4), workspace()
            u, z = problems[0, lane], problems[1, lane]
            start, end = problems[2, lane], problems[3, lane]
            largest_in_step(u, z, start, end, damping, phase, selected, work, largest)
            squares[lane] = largest[0] if share == 1.0 else largest[1] * largest[1]
        best[azimuths[lane]] = max(best[azimuths[lane]], squares[lane])


@kernel
def _raise_to_pieces(problems, phase, damping, share, room):
    """Raise the squares to those within steps that are cut into pieces of equal length."""
    pieces = math.ceil(phase / LONGEST_SPAN)
    span = phase / pieces
    # An even number of terms
    pairs = (series_terms(span) + 1) // 2
    displacement = room[DISPLACEMENT : DISPLACEMENT + 2 * pairs + 2]
    condition = room[CONDITION : CONDITION + 2 * pairs]
    piece = room[PIECE:DISPLACEMENT]
    piece[:] = problems
    for lane in range(LANES):
        piece[3, lane] = piece[2, lane] + (piece[3, lane] - piece[2, lane]) / pieces
    # At the roots of both conditions, piece by piece
    for number in range(pieces):
        if number > 0:
            _advance(displacement, span, room)
        _fill_displacement(piece, span, damping, displacement)
        for kind in range(2 if share == 1.0 else 1):
            _fill_condition(kind, piece, span, damping, displacement, condition)
            _find_roots(condition, span, room)
            _raise_squares(displacement, share, room)


@kernel
def _advance(displacement, span, room):
    """Move the problems to the next piece of their step: state, and accelerations at its ends."""
    u, z, piece = room[VALUE], room[SLOPE], room[PIECE:DISPLACEMENT]
    room[ROOT] = span
    _evaluate(displacement, room[ROOT], u, z)
    # The acceleration goes on along its straight line
    for lane in range(LANES):
        piece[0, lane], piece[1, lane] = u[lane], z[lane]
        change = piece[3, lane] - piece[2, lane]
        piece[2, lane], piece[3, lane] = piece[3, lane], piece[3, lane] + change


@kernel
def _fill_displacement(problems, phase, damping, displacement):
    """Fill the Taylor coefficients of the displacements, as `within_step.fill_series`."""
    viscosity = 2.0 * damping
    for lane in range(LANES):
        u, z = problems[0, lane], problems[1, lane]
        start, end = problems[2, lane], problems[3, lane]
        # State and acceleration at the start
        displacement[0, lane] = u
        displacement[1, lane] = z
        second = -0.5 * (viscosity * z + u + start)
        displacement[2, lane] = second
        force_rate = 2.0 * viscosity * second + z + (end - start) / phase
        displacement[3, lane] = -force_rate / 6.0
    # Each later term from the two before
    for n in range(2, displacement.shape[0] - 2):
        factor, inverse = viscosity * (n + 1), INVERSES[n]
        for lane in range(LANES):
            force = factor * displacement[n + 1, lane] + displacement[n, lane]
            displacement[n + 2, lane] = -force * inverse


@kernel
def _fill_condition(number, problems, phase, damping, displacement, condition):
    """Fill the coefficients of ``z`` (number 0) or ``2 xi z + a`` (1)."""
    level = 1.0 if number == 0 else 2.0 * damping
    for n in range(condition.shape[0]):
        factor = level * (n + 1)
        for lane in range(LANES):
            condition[n, lane] = factor * displacement[n + 1, lane]
    # Acceleration, linear over the step
    if number == 1:
        for lane in range(LANES):
            condition[0, lane] += problems[2, lane]
            condition[1, lane] += (problems[3, lane] - problems[2, lane]) / phase


@kernel
def _evaluate(series, phases, values, slopes):
    """Fill the values and the derivatives of the series at their phases, by Horner's rule."""
    values[:] = 0.0
    slopes[:] = 0.0
    # Two of an even number of terms at a time
    for n in range(series.shape[0] - 1, 0, -2):
        for lane in range(LANES):
            phase, value = phases[lane], values[lane]
            half = value * phase + series[n, lane]
            slopes[lane] = (slopes[lane] * phase + value) * phase + half
            values[lane] = half * phase + series[n - 1, lane]


@kernel
def _find_roots(condition, phase, room):
    """Fill the root of each condition within the step, or its start; mark the lanes in doubt."""
    doubts, roots, values, slopes = room[DOUBT], room[ROOT], room[VALUE], room[SLOPE]
    bends, highest, tolerances = room[BEND], room[HIGHEST], room[TOLERANCE]
    bends[:] = 0.0
    # Bound of the second derivative
    for n in range(condition.shape[0] - 1, 1, -1):
        for lane in range(LANES):
            bends[lane] = bends[lane] * phase + (n * (n - 1)) * abs(condition[n, lane])
    roots[:] = phase
    _evaluate(condition, roots, values, slopes)
    for lane in range(LANES):
        # One root at most where the slope keeps its sign; begin at that of the chord
        start, end = condition[0, lane], values[lane]
        steep = bends[lane] * phase < abs(condition[1, lane])
        crossing = steep and start * end < 0.0
        # None where the chord keeps further from zero than the condition from the chord
        sag = 0.125 * phase * phase * bends[lane]
        clear = start * end > 0.0 and min(abs(start), abs(end)) > sag
        doubts[lane] = doubts[lane] if steep or clear else 1.0
        roots[lane] = phase * start / (start - end) if crossing else 0.0
        # Lanes without a root stay at the start of the step
        highest[lane] = phase if crossing else 0.0
        tolerances[lane] = ROOT_TOLERANCE * phase * abs(condition[1, lane]) if crossing else np.inf
    # Newton's method, on all lanes until each has converged
    for _ in range(NEWTON_STEPS):
        _evaluate(condition, roots, values, slopes)
        open_lanes = 0
        for lane in range(LANES):
            far = abs(values[lane]) > tolerances[lane]
            open_lanes += far
            change = values[lane] / slopes[lane] if far else 0.0
            roots[lane] = min(max(roots[lane] - change, 0.0), highest[lane])
        if open_lanes == 0:
            return
    # Lanes that have not converged are in doubt
    _evaluate(condition, roots, values, slopes)
    for lane in range(LANES):
        doubts[lane] = 1.0 if abs(values[lane]) > tolerances[lane] else doubts[lane]


@kernel
def _raise_squares(displacement, share, room):
    """Raise the squares to those at the roots."""
    squares, u, z = room[SQUARE], room[VALUE], room[SLOPE]
    _evaluate(displacement, room[ROOT], u, z)
    for lane in range(LANES):
        squares[lane] = max(squares[lane], u[lane] * u[lane] + share * z[lane] * z[lane])
