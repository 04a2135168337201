"""Roots and largest values within a step."""

import numpy as np
import pytest
from numpy.testing import assert_allclose

from per_obspy.kernels.oscillator import within_step
from per_obspy.kernels.oscillator.exact_step import step_coefficients


def _series(*coefficients):
    series = np.zeros(within_step.TERMS + 1)
    series[: len(coefficients)] = coefficients
    return series


@pytest.mark.parametrize(
    "roots",
    [(0.1,), (0.2, 0.3), (0.2, 0.2001), (0.05, 0.25, 0.45), (0.1, 0.1 + 1e-7, 0.4), (-0.1, 0.7)],
)
def test_no_root_is_missed(roots):
    # catches a search that trusts the signs at both ends: two close roots change none of them
    coefficients = np.polynomial.polynomial.polyfromroots(roots)
    points = np.empty(within_step.POINTS)
    count = within_step.stationary_phases(_series(*coefficients), 6, 0.5, points)
    assert np.all(np.diff(points[:count]) >= 0)
    assert points[0] == 0.0
    assert points[count - 1] == 0.5
    for root in roots:
        if 0 < root < 0.5:
            # the root's tolerance, 1e-8 of a piece; of a nearly double root the value matters, not
            # the place
            value = abs(np.polynomial.polynomial.polyval(points[:count], coefficients)).min()
            assert np.abs(points[:count] - root).min() < 2e-7 or value < 1e-14


def _largest(u, z, start, end, damping, phase):
    largest = np.zeros(4)
    within_step.largest_in_step(
        u, z, start, end, damping, phase, 15, within_step.workspace(), largest
    )
    return largest


def _dense(case, parts):
    u, z, start, end, damping, phase = case
    values = []
    for part in np.linspace(1 / parts, 1, parts):
        a11, a12, a21, a22, b11, b12, b21, b22 = step_coefficients(1.0, damping, phase * part)
        stop = start + (end - start) * part
        x = a11 * u + a12 * z + b11 * start + b12 * stop
        w = a21 * u + a22 * z + b21 * start + b22 * stop
        values.append((x * x + w * w, abs(x), abs(w), abs(x + 2 * damping * w)))
    return np.max(values, axis=0)


CASES = [
    (1.0, 0.05, -0.5, 0.3, 0.05, 0.3),
    (0.2, -0.9, 0.9, -1.5, 0.0, 0.45),
    (0.0, 0.0, 1.0, -1.0, 0.3, 1.9),
    (-0.7, 0.3, 2.0, 1.0, 0.9, 4.0),
    (0.4, 1.0, -3.0, 3.0, 0.02, 12.0),
]


@pytest.mark.parametrize("case", CASES)
def test_largest_values_of_a_step(case):
    # 4000 values a step miss a peak by (phase / 4000)² / 8 of it
    u, z, *_ = case
    found = np.maximum(_largest(*case), [u * u + z * z, abs(u), abs(z), abs(u + 2 * case[4] * z)])
    dense = np.maximum(
        _dense(case, 4000), [u * u + z * z, abs(u), abs(z), abs(u + 2 * case[4] * z)]
    )
    assert_allclose(found, dense, rtol=1e-5)
    assert np.all(found >= dense * (1 - 1e-12))


@pytest.mark.parametrize("seed", range(40))
def test_a_larger_value_is_found_whatever_the_others_are(seed):
    # catches bounds that are too small: a condition that is not looked at, or values between the
    # samples that exceed them
    random = np.random.default_rng(seed)
    u, z, start, end = random.normal(size=4)
    damping, phase = random.uniform(0, 0.9), random.uniform(0.05, 3.0)
    a11, a12, a21, a22, b11, b12, b21, b22 = step_coefficients(1.0, damping, phase)
    u_end = a11 * u + a12 * z + b11 * start + b12 * end
    z_end = a21 * u + a22 * z + b21 * start + b22 * end
    dense = _dense((u, z, start, end, damping, phase), 200)
    square = max(u * u + z * z, u_end * u_end + z_end * z_end)
    radius = within_step.radius_bound(square, max(abs(start), abs(end)), damping, phase)
    assert radius**2 >= dense[0]
    rates = within_step.rate_bounds(
        radius, max(abs(start), abs(end)), abs(end - start), damping, phase
    )
    ends = np.array(
        [
            (x * x + w * w, abs(x), abs(w), abs(x + 2 * damping * w))
            for x, w in ((u, z), (u_end, z_end))
        ]
    )
    assert np.all(ends.max(axis=0) + within_step.slacks(rates, damping, phase) >= dense)
    slack = within_step.velocity_slack(ends[:, 2].max(), rates, abs(end - start), damping, phase)
    assert ends[:, 2].max() + slack >= dense[2]
    assert (
        within_step.step_velocity_bound(u, z, start, u_end, z_end, end, rates, damping, phase)
        >= dense[2]
    )
    ends_of_step, work = (u, z, start, u_end, z_end, end), within_step.workspace()
    for row in range(4):
        # the others do not count, or are far below
        for others in (np.inf, 0.0):
            known = np.full(4, others)
            known[row] = dense[row] * (1 - 1e-6)
            terms = within_step.series_terms(phase)
            within_step.raise_in_step(ends_of_step, radius, damping, phase, terms, work, known)
            assert max(known[row], ends[:, row].max()) >= dense[row] * (1 - 1e-12)


@pytest.mark.parametrize("damping", [0.0, 0.05, 0.7])
def test_a_root_gives_the_value_of_a_search(damping):
    # mutations: a sign of the correction, the slope of another condition, a step with two roots
    # called certain
    random, roots = np.random.default_rng(8), np.zeros(4)
    for phase in (0.01, 0.1, 0.45):
        a11, a12, a21, a22, b11, b12, b21, b22 = step_coefficients(1.0, damping, phase)
        terms, work = within_step.series_terms(phase), within_step.workspace()
        for u, z, start, end in random.normal(size=(60, 4)) * [1.0, phase, 1.0, 1.0]:
            u_end = a11 * u + a12 * z + b11 * start + b12 * end
            z_end = a21 * u + a22 * z + b21 * start + b22 * end
            peak, jump = max(abs(start), abs(end)), abs(end - start)
            rates = within_step.rate_bounds(
                np.hypot(u, z) + phase * 4.0, peak, jump, damping, phase
            )
            # the values at both ends, which the search includes
            at_ends = [
                (x * x + w * w, abs(x), abs(w), abs(x + 2 * damping * w))
                for x, w in ((u, z), (u_end, z_end))
            ]
            for number in range(4):
                best, expected = np.zeros(4), np.max(at_ends, axis=0)
                within_step.largest_in_step(
                    u, z, start, end, damping, phase, 1 << number, work, expected
                )
                ends = u, z, start, u_end, z_end, end
                if within_step.raise_to_root(
                    number, ends, rates, damping, phase, terms, work, best
                ):
                    roots[number] += best.any()
                    ours = max(best[number], np.max(at_ends, axis=0)[number])
                    # 1e-15 of a shift's third power, and rounding
                    assert_allclose(ours, expected[number], rtol=1e-13)
    assert roots.min() > (15 if damping else 0)
