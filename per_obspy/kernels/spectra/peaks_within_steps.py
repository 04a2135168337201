r"""
Largest squares within many independent steps of one oscillator, side by side.

As in `between`, by Taylor series and the roots of ``z`` and ``2 xi z + a``. Where the linear term
of such a condition outweighs all others it has one root at most, which Newton's method finds from
the chord; every other step is left to `between`.
"""

import numpy as np

from per_obspy.kernels._jit import kernel
from per_obspy.kernels.oscillator.within_step import (
    INVERSES,
    LONGEST_SPAN,
    ROOT_TOLERANCE,
    largest_in_step,
    series_terms,
    workspace,
)
from per_obspy.kernels.spectra.blocks import LANES

NEWTON_STEPS = 6


@kernel
def raise_to_peaks(problems, places, count, oscillator, best):
    """
    Raise the largest squares at the places to those within the steps.

    ``problems`` (4, lanes): u, z and the acceleration at the start, and the acceleration at the
    end. Only the first ``count`` are looked at.
    """
    _, phase, damping, share = oscillator
    squares, doubts = np.zeros(LANES), np.ones(LANES)
    for row in range(4):
        problems[row, count:] = 0.0
    if phase <= LONGEST_SPAN:
        doubts[:] = 0.0
        _peaks(problems, phase, damping, share, squares, doubts)
    here, wanted, work = np.empty(4), np.zeros(4, np.bool_), workspace()
    wanted[0], wanted[1] = share == 1.0, True
    for lane in range(count):
        if doubts[lane] > 0.0:
            here[:] = 0.0
            u, z, start, end = (
                problems[0, lane],
                problems[1, lane],
                problems[2, lane],
                problems[3, lane],
            )
            largest_in_step(u, z, start, end, damping, phase, wanted, work, here)
            squares[lane] = here[0] if share == 1.0 else here[1] * here[1]
        best[places[lane]] = max(best[places[lane]], squares[lane])


@kernel
def _peaks(problems, phase, damping, share, squares, doubts):
    """Raise the squares to those at the roots of the conditions; mark the lanes where these are not sure."""
    pairs = (series_terms(phase) + 1) // 2
    motion, condition = np.empty((2 * pairs + 2, LANES)), np.empty((2 * pairs, LANES))
    _fill_motion(problems, phase, damping, motion)
    roots = np.empty(LANES)
    for number in range(2 if share == 1.0 else 1):
        _fill_condition(number, problems, phase, damping, motion, condition)
        _find_roots(condition, phase, roots, doubts)
        _raise_squares(motion, roots, share, squares)


@kernel
def _fill_motion(problems, phase, damping, motion):
    """Fill the Taylor coefficients of the displacements, as `between.fill_series`."""
    twice = 2.0 * damping
    for lane in range(LANES):
        u, z, start, end = (
            problems[0, lane],
            problems[1, lane],
            problems[2, lane],
            problems[3, lane],
        )
        motion[0, lane], motion[1, lane] = u, z
        motion[2, lane] = -0.5 * (twice * z + u + start)
        motion[3, lane] = -(2.0 * twice * motion[2, lane] + z + (end - start) / phase) / 6.0
    for n in range(2, motion.shape[0] - 2):
        factor, inverse = twice * (n + 1), INVERSES[n]
        for lane in range(LANES):
            motion[n + 2, lane] = -(factor * motion[n + 1, lane] + motion[n, lane]) * inverse


@kernel
def _fill_condition(number, problems, phase, damping, motion, condition):
    """Fill the coefficients of ``z`` (number 0) or ``2 xi z + a`` (1)."""
    level = 1.0 if number == 0 else 2.0 * damping
    for n in range(condition.shape[0]):
        factor = level * (n + 1)
        for lane in range(LANES):
            condition[n, lane] = factor * motion[n + 1, lane]
    if number == 1:
        for lane in range(LANES):
            condition[0, lane] += problems[2, lane]
            condition[1, lane] += (problems[3, lane] - problems[2, lane]) / phase


@kernel
def _evaluate(series, phases, values, slopes):
    """Fill the values and the derivatives of the series at their phases, two of an even number of terms at a time."""
    values[:] = 0.0
    slopes[:] = 0.0
    for n in range(series.shape[0] - 1, 0, -2):
        for lane in range(LANES):
            phase, value = phases[lane], values[lane]
            between = value * phase + series[n, lane]
            slopes[lane] = (slopes[lane] * phase + value) * phase + between
            values[lane] = between * phase + series[n - 1, lane]


@kernel
def _find_roots(condition, phase, roots, doubts):
    """Fill the root of each condition within the step, or its start where there is none; mark what is not sure."""
    higher, values, slopes = np.zeros(LANES), np.empty(LANES), np.empty(LANES)
    highest, tolerances = np.empty(LANES), np.empty(LANES)
    for n in range(condition.shape[0] - 1, 1, -1):
        for lane in range(LANES):
            higher[lane] = higher[lane] * phase + n * abs(condition[n, lane])
    roots[:] = phase
    _evaluate(condition, roots, values, slopes)
    for lane in range(LANES):
        start, end = condition[0, lane], values[lane]
        steep = higher[lane] * phase < abs(condition[1, lane])
        crossing = steep and start * end < 0.0
        doubts[lane] = doubts[lane] if steep else 1.0
        roots[lane] = phase * start / (start - end) if crossing else 0.0
        highest[lane] = phase if crossing else 0.0
        tolerances[lane] = ROOT_TOLERANCE * phase * abs(condition[1, lane]) if crossing else np.inf
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
    _evaluate(condition, roots, values, slopes)
    for lane in range(LANES):
        doubts[lane] = 1.0 if abs(values[lane]) > tolerances[lane] else doubts[lane]


@kernel
def _raise_squares(motion, phases, share, squares):
    """Raise the squares to those at the phases."""
    u, z = np.empty(LANES), np.empty(LANES)
    _evaluate(motion, phases, u, z)
    for lane in range(LANES):
        squares[lane] = max(squares[lane], u[lane] * u[lane] + share * z[lane] * z[lane])
