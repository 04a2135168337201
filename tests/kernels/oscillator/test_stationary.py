"""Stationary values from the root of a cubic, against the search of within_step."""

import numpy as np
import pytest
from numpy.testing import assert_allclose

from per_obspy.kernels.oscillator.exact_step import step_coefficients
from per_obspy.kernels.oscillator.stationary import raise_to_root
from per_obspy.kernels.oscillator.within_step import (
    largest_in_step,
    rate_bounds,
    series_terms,
    workspace,
)


def _ends(u, z, start, end, phase, damping):
    """Return state and acceleration before and after a step."""
    a11, a12, a21, a22, b11, b12, b21, b22 = step_coefficients(1.0, damping, phase)
    u_end = a11 * u + a12 * z + b11 * start + b12 * end
    z_end = a21 * u + a22 * z + b21 * start + b22 * end
    return u, z, start, u_end, z_end, end


def _rates(ends, phase, damping):
    u, z, start, _, _, end = ends
    peak = max(abs(start), abs(end))
    return rate_bounds(np.hypot(u, z) + phase * 4.0, peak, abs(end - start), damping, phase)


@pytest.mark.parametrize("damping", [0.0, 0.05, 0.7])
def test_a_root_gives_the_value_of_a_search(damping):
    # mutations: a sign of the correction, the slope of the other condition, a step with two roots
    # called certain
    random, found = np.random.default_rng(8), 0
    for phase in (0.01, 0.1, 0.45):
        for u, z, start, end in random.normal(size=(60, 4)) * [1.0, phase, 1.0, 1.0]:
            ends = _ends(u, z, start, end, phase, damping)
            rates, terms = _rates(ends, phase, damping), series_terms(phase)
            # squared radius and displacement at both ends, which the search includes
            at_ends = np.array([(x * x + w * w, abs(x)) for x, w in (ends[:2], ends[3:5])])
            for number in (0, 1):
                best, expected = np.zeros(4), np.zeros(4)
                selected = np.arange(4) == number
                largest_in_step(u, z, start, end, damping, phase, selected, workspace(), expected)
                if raise_to_root(number, ends, rates, damping, phase, terms, workspace(), best):
                    found += best.any()
                    ours = np.maximum(best[:2], at_ends.max(axis=0))
                    searched = np.maximum(expected[:2], at_ends[0])
                    # 1e-15 of a shift's third power, and rounding
                    assert_allclose(ours[number], searched[number], rtol=1e-13)
    assert found > 50  # roots
