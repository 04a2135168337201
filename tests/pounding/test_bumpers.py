"""Bumpers: the target is met and just met, contact models against SciPy's integration."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from scipy.integrate import solve_ivp

from per_obspy.pounding.bumpers import (
    bumper_restitution,
    jankowski_damping,
    kelvin_voigt_damping,
    kelvin_voigt_restitution,
    mahmoud_jankowski_damping,
    required_restitution,
)
from per_obspy.pounding.critical_gap import critical_gap
from per_obspy.pounding.single_hit import single_hit

lengths, periods, masses = st.floats(0.1, 2.0), st.floats(0.2, 4.0), st.floats(1.0, 50.0)


pairs = st.tuples(lengths, lengths, periods, periods, masses, masses)


@given(pairs, st.floats(-0.9, 0.9), st.floats(0.0, 0.98), st.floats(1.0, 3.0))
def test_the_target_is_met_and_just_met(pair, correlation, fraction, target):
    # mutation: one branch or one structure left out, the smaller root, e for 1 + e
    largest = float(critical_gap(pair[0], pair[1], correlation))
    gaps = largest, fraction * largest
    restitution = required_restitution(*pair, *gaps, target)

    def worst(e):
        hit = single_hit(*pair, e, *gaps)
        return max(hit.branches.amplification_1.max(), hit.branches.amplification_2.max())

    if np.isnan(restitution):
        assert worst(0.0) > target - 1e-9
    elif restitution == 1.0:
        assert worst(1.0) <= target + 1e-9
    else:
        assert worst(float(restitution)) == pytest.approx(target, rel=1e-9)
        assert worst(min(1.0, float(restitution) + 1e-4)) > target - 1e-9


def test_targets_broadcast_and_pairs_without_answer():
    found = required_restitution(
        0.3, [0.4, 0.4, 0.05], 1.0, 1.3, 1.0, 1.0, [0.5, 0.5, 0.1], [0.2, 0.6, 0.05], [[1.1], [1.3]]
    )
    assert found.shape == (2, 3)
    assert np.all(found[:, 1] == 1.0)  # no pounding: any restitution is enough
    assert np.all(np.isnan(found[:, 2]))  # no grazing state
    assert found[0, 0] < found[1, 0]


def test_a_moat_wall_accepts_any_restitution():
    assert required_restitution(1.0, 0.0, 2.0, 1.0, 5.0, np.inf, 1.0, 0.3, 1.0) == 1.0


def contact(damping, tension):
    """Velocity after a unit impact on a spring and dashpot of unit mass and frequency, by SciPy."""

    def motion(_, state):
        return [state[1], -2 * damping * state[1] - state[0]]

    def end(_, state):
        return state[0] if tension else state[0] + 2 * damping * state[1]

    # contact begins at a penetration of 0, which must not end it
    end.terminal, end.direction = True, -1.0
    start = 1e-9 if tension else 0.0
    solution = solve_ivp(motion, (0, 10), [start, 1.0], events=end, rtol=1e-11, atol=1e-12)
    return -solution.y_events[0][0][1], solution.t_events[0][0]


@pytest.mark.parametrize("tension", [True, False])
@pytest.mark.parametrize("damping", [0.05, 0.3, 0.8])
def test_kelvin_voigt_against_integration(damping, tension):
    # mutation: acos for atan2 (wrong above 0.71), the phase of the other rule
    velocity, time = contact(damping, tension)
    assert kelvin_voigt_restitution(damping, tension) == pytest.approx(velocity, abs=1e-8)
    mass = 2.0  # two masses of 4 kg: reduced mass 2 kg; frequency 1 rad/s
    bumper = bumper_restitution(mass, 2 * damping * mass, 4.0, 4.0, 20.0, tension)
    assert bumper.damping == pytest.approx(damping)
    assert bumper.contact_time == pytest.approx(time, abs=1e-7)


@given(st.floats(1e-6, 1.0))
def test_inverse(restitution):
    # mutation: log10 for log, a missing square
    damping = kelvin_voigt_damping(restitution)
    assert kelvin_voigt_restitution(damping) == pytest.approx(restitution, rel=1e-9)


def test_limits():
    assert kelvin_voigt_damping(0.0) == 1.0
    assert kelvin_voigt_damping(1.0) == 0.0
    for damping in (mahmoud_jankowski_damping, jankowski_damping):
        assert damping(1.0) == 0.0
        assert np.all(np.diff(damping(np.linspace(0.1, 1.0, 50))) < 0)
    for tension in (True, False):
        assert kelvin_voigt_restitution(0.0, tension) == 1.0


def test_mahmoud_jankowski_against_the_integration_of_its_contact():
    # damped while approaching, elastic while parting. The formula is approximate: its authors
    # equate the work of the dashpot with that of undamped motion; 0.03 covers that for restitutions
    # of 0.5 and more
    for restitution in (0.5, 0.65, 0.8, 0.95):
        damping = float(mahmoud_jankowski_damping(restitution))

        def motion(_, state, damping=damping):
            return [state[1], -2 * damping * max(state[1], 0.0) - state[0]]

        def end(_, state):
            return state[0]

        end.terminal, end.direction = True, -1.0
        solution = solve_ivp(
            motion, (0, 10), [1e-9, 1.0], events=end, rtol=1e-9, atol=1e-10, max_step=0.01
        )
        assert -solution.y_events[0][0][1] == pytest.approx(restitution, abs=0.03)


def test_contact_time_decides_whether_the_impact_is_instant():
    contact_time = np.pi / np.sqrt(np.array([4e8, 4e6]) / 1e5)
    # up to a tenth of the shortest period
    for share, instant in ((0.0999, True), (0.1001, False)):
        found = bumper_restitution([4e8, 4e6], 0.0, 2e5, 2e5, contact_time / share)
        np.testing.assert_allclose(found.contact_time, contact_time, rtol=1e-12)
        assert list(found.instant) == [instant, instant]
        assert np.all(found.restitution == 1.0)
