"""Peaks of many steps next to each other against those of one step after the other."""

import numpy as np
import pytest
from numpy.testing import assert_allclose

from per_obspy.kernels.oscillator import within_step
from per_obspy.kernels.oscillator.exact_step import step_coefficients
from per_obspy.kernels.spectra.azimuth_samples import Oscillator
from per_obspy.kernels.spectra.peaks_within_steps import raise_to_step_peaks
from per_obspy.kernels.spectra.tile_search import LANES


def _alone(problem, phase, damping):
    """Return the largest squared radius and displacement in one step."""
    largest = np.zeros(4)
    within_step.largest_in_step(*problem, damping, phase, 3, within_step.workspace(), largest)
    return largest[0], largest[1] ** 2


@pytest.mark.parametrize("share", [0.0, 1.0])
@pytest.mark.parametrize(
    ("phase", "damping"),
    [(0.02, 0.0), (0.1, 0.05), (0.45, 0.3), (0.499, 0.0), (0.9, 0.0), (2.0, 0.05)],
)
def test_peaks_of_a_block_are_those_of_each_step(phase, damping, share):
    # catches lanes mixed up, a root taken for sure where there may be two, and azimuths exchanged
    problems = np.random.default_rng(4).normal(size=(4, LANES))
    problems[1] *= phase  # displacement peaks within the step
    azimuths = np.random.default_rng(5).permutation(LANES)
    best, count = np.zeros(LANES), LANES - 3
    u, z, start, end = problems.copy()
    oscillator = Oscillator(0, phase, damping, share)
    raise_to_step_peaks(problems, azimuths, count, oscillator, best)
    a11, a12, a21, a22, b11, b12, b21, b22 = step_coefficients(1.0, damping, phase)
    u_end = a11 * u + a12 * z + b11 * start + b12 * end
    z_end = a21 * u + a22 * z + b21 * start + b22 * end
    samples = np.maximum(u**2 + share * z**2, u_end**2 + share * z_end**2)
    expected = [
        _alone((u[i], z[i], start[i], end[i]), phase, damping)[0 if share else 1]
        for i in range(count)
    ]
    # samples count on both sides: only peaks above them matter
    found = np.maximum(best[azimuths[:count]], samples[:count])
    # both find a root to 1e-8 of the step, and the square changes by the square of that
    assert_allclose(found, np.maximum(expected, samples[:count]), rtol=1e-13)
    assert np.all(best[azimuths[count:]] == 0.0)


@pytest.mark.parametrize("share", [0.0, 1.0])
def test_two_roots_between_ends_of_one_sign_are_found(share):
    # catches a condition that is taken for free of roots because it has one sign at both ends: z
    # vanishes twice, at a largest and a smallest displacement
    phase, damping = 0.4, 0.05
    first, second = np.random.default_rng(6).uniform(0.05, 0.95, (2, LANES)) * phase
    # z = (t - first) (t - second) to second order, with u of its own
    z, rate, bend = first * second, -(first + second), 2.0
    u = np.random.default_rng(7).normal(size=LANES) * 1e-3
    start = -(2.0 * damping * z + u) - rate
    end = start + phase * (-2.0 * damping * rate - z - bend)
    best, order = np.zeros(LANES), np.arange(LANES)
    problems = np.stack([u, z, start, end])
    raise_to_step_peaks(problems.copy(), order, LANES, Oscillator(0, phase, damping, share), best)
    expected = np.array(
        [_alone(problem, phase, damping)[0 if share else 1] for problem in problems.T]
    )
    a11, a12, _, _, b11, b12, _, _ = step_coefficients(1.0, damping, phase)
    u_end = a11 * u + a12 * z + b11 * start + b12 * end
    inside = expected > np.maximum(u**2, u_end**2) * (1.0 + 1e-9)
    assert share or inside.sum() > LANES // 4
    ends = np.maximum(u**2, u_end**2) if share == 0.0 else 0.0
    assert_allclose(np.maximum(best, ends)[inside], expected[inside], rtol=1e-13)
