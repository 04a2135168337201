"""Rows of structures: the critical gap decides, laws of impact and energy, contact, the end."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from numpy.testing import assert_allclose, assert_array_equal
from scipy.integrate import solve_ivp

from per_obspy.pounding.relative import relative_displacement
from per_obspy.pounding.row_history import pounding_history
from per_obspy.pounding.structure import Structure
from per_obspy.spectra.elastic import per_spectrum

from .made_up import shaking

DT = 0.02


PAIRS = [
    ((1.5, 0.05, 4.0), (0.6, 0.02, 1.0), 0.03, 0.65),
    ((0.5, 0.02, 1.0), (0.8, 0.10, 5.0), 0.015, 1.0),
    ((2.5, 0.00, 2.0), (0.3, 0.05, 3.0), 0.08, 0.3),
]


def pair(first, second, **yielding):
    return [Structure(*first, **yielding), Structure(*second, **yielding)]


WITHOUT_GAP = [(first, second, restitution) for first, second, _, restitution in PAIRS]


class TestCriticalGap:
    @pytest.mark.parametrize(("first", "second", "restitution"), WITHOUT_GAP)
    def test_decides_between_none_and_one_impact(self, first, second, restitution):
        # catches: contact declared by the cubic bound instead of the exact solution, grazes missed
        # between samples
        structures, acceleration = pair(first, second), shaking(12.0)
        critical = relative_displacement(acceleration, DT, *first[:2], *second[:2]).one_before_two
        wide = pounding_history(acceleration, DT, structures, critical * (1 + 1e-9), restitution)
        near = pounding_history(acceleration, DT, structures, critical * (1 - 1e-6), restitution)
        assert len(wide.impacts) == 0
        assert len(near.impacts) >= 1
        assert (
            near.impacts["velocity_before_1"][0] - near.impacts["velocity_before_2"][0] < 0.02
        )  # a graze

    @pytest.mark.parametrize(("first", "second", "restitution"), WITHOUT_GAP)
    def test_wide_gap_gives_the_spectrum(self, first, second, restitution):
        # catches: a radius without its maximum between samples, maxima that leave out free
        # vibration
        acceleration = shaking(12.0)
        history = pounding_history(acceleration, DT, pair(first, second), 10.0, restitution)
        for structure, per in zip(pair(first, second), history.per, strict=True):
            expected = per_spectrum(
                np.append(acceleration, 0.0), DT, [structure.period], structure.damping
            )
            assert_allclose(per, expected[0], rtol=1e-9)  # both are exact; the required agreement


ANY_PAIR = st.tuples(
    st.floats(0.15, 3.0), st.floats(0.0, 0.2), st.floats(0.1, 10.0),
    st.floats(0.15, 3.0), st.floats(0.0, 0.2), st.floats(0.1, 10.0),
    st.sampled_from([0.0, 0.005, 0.03]), st.sampled_from([0.0, 0.3, 0.65, 1.0]),
    st.sampled_from([np.inf, 0.01, 0.05]), st.sampled_from([0.0, 0.05, 0.3]), st.integers(0, 1000),
)  # fmt: skip


def run(case, seconds=4.0, **keywords):
    t1, x1, m1, t2, x2, m2, gap, restitution, limit, hardening, seed = case
    structures = pair((t1, x1, m1), (t2, x2, m2), yield_displacement=limit, hardening=hardening)
    return pounding_history(shaking(seconds, seed), DT, structures, gap, restitution, **keywords)


class TestInvariants:
    @settings(max_examples=60, deadline=None)
    @given(ANY_PAIR)
    def test_energies_close(self, case):
        # catches: wrong sign of (9) or (10), contact work or hysteretic work left out
        assert run(case).closure <= 1e-10  # required by (3), (4)

    @settings(max_examples=40, deadline=None)
    @given(ANY_PAIR)
    def test_impacts_obey_momentum_restitution_and_energy(self, case):
        # catches: (7) with m1 in place of m2, a gain in place of a loss
        impacts, (_, _, m1, _, _, m2, _, e, *_) = run(case).impacts, case
        v1, v2 = impacts["velocity_before_1"], impacts["velocity_before_2"]
        change_1, change_2 = impacts["velocity_after_1"] - v1, impacts["velocity_after_2"] - v2
        assert (v1 > v2).all()

        # momentum stays, and the relative velocity is reversed by e, but for rounding
        rounding = 1e-12 * (1 + np.abs(v1) + np.abs(v2))
        assert (np.abs(m1 * change_1 + m2 * change_2) <= (m1 + m2) * rounding).all()
        assert (np.abs(change_2 - change_1 - (1 + e) * (v1 - v2)) <= 2 * rounding).all()

        # the loss is a difference of energies
        loss = 0.5 * (1 - e**2) * m1 * m2 / (m1 + m2) * (v1 - v2) ** 2
        assert_allclose(impacts["energy_loss"], loss, rtol=1e-9, atol=1e-12 * (m1 + m2))

    @settings(max_examples=20, deadline=None)
    @given(ANY_PAIR)
    def test_impacts_take_place_at_the_gap(self, case):
        # catches: a contact before or after the clearance is zero
        impacts = run(case).impacts
        distance = impacts["displacement_1"] - impacts["displacement_2"]
        assert_allclose(distance, case[6], rtol=0, atol=1e-13)

    @settings(max_examples=40, deadline=None)
    @given(ANY_PAIR)
    def test_structures_never_overlap(self, case):
        # catches: contacts missed between samples, drift of clusters
        history = run(case)
        # approaches slower than 1e-11 of the ground velocity count as rest, and drift for seconds
        assert (history.displacement[0] - history.displacement[1] <= case[6] + 1e-10).all()

    @settings(max_examples=25, deadline=None)
    @given(ANY_PAIR, st.floats(0.1, 20.0))
    def test_scaling(self, case, factor):
        # catches: an absolute tolerance where a relative one belongs
        t1, x1, m1, t2, x2, m2, gap, e, limit, hardening, seed = case
        acceleration = shaking(1.0, seed)
        structures = pair((t1, x1, m1), (t2, x2, m2), yield_displacement=limit, hardening=hardening)
        larger = pair(
            (t1, x1, 3 * m1),
            (t2, x2, 3 * m2),
            yield_displacement=factor * limit,
            hardening=hardening,
        )
        once = pounding_history(acceleration, DT, structures, gap, e, free_vibration=False)
        more = pounding_history(
            factor * acceleration, DT, larger, factor * gap, e, free_vibration=False
        )
        count = min(10, len(once.impacts))
        if e == 1.0 or count < 10:  # long sequences are chaotic
            assert_allclose(
                more.impacts["time"][:count], once.impacts["time"][:count], rtol=1e-9, atol=1e-9
            )

    @pytest.mark.parametrize("restitution", [0.0, 0.65, 1.0])
    def test_mirror(self, restitution):
        # catches: anything that is not symmetric in left and right
        row = [
            Structure(1.3, 0.05, 3.0),
            Structure(0.5, 0.05, 1.0, 0.02, 0.1),
            Structure(0.9, 0.02, 2.0),
        ]
        acceleration = shaking(4.0)
        once = pounding_history(
            acceleration, DT, row, [0.02, 0.03], restitution, free_vibration=False
        )
        mirrored = pounding_history(
            -acceleration, DT, row[::-1], [0.03, 0.02], restitution, free_vibration=False
        )
        assert len(once.impacts) > 3
        assert_allclose(
            mirrored.displacement[::-1], -once.displacement, rtol=0, atol=1e-9
        )  # a few impacts' growth
        assert_array_equal(1 - mirrored.impacts["left"], once.impacts["left"])

    def test_infinitely_wide_gap_is_uncoupled(self):
        # catches: coupling through the cluster equation
        alone = pounding_history(shaking(12.0), DT, pair(*PAIRS[0][:2]), 1e6, 0.5)
        other = pounding_history(shaking(12.0), DT, pair(PAIRS[0][0], (3.0, 0.2, 9.0)), 1e6, 0.5)
        count = min(alone.time.size, other.time.size)
        assert_allclose(
            alone.displacement[0, :count], other.displacement[0, :count], rtol=0, atol=1e-15
        )

    def test_inputs_stay_unchanged(self):
        acceleration, gaps = shaking(2.0), np.array([0.01])
        before = acceleration.copy()
        pounding_history(acceleration, DT, pair(*PAIRS[0][:2]), gaps, 0.5)
        assert_array_equal(acceleration, before)
        assert_array_equal(gaps, [0.01])


def joined_displacement(structures, times):
    """Return the displacement of structures that move as one under a ramp of 1 m/s², by SciPy."""
    mass = sum(s.mass for s in structures)
    stiffness = sum(s.mass * s.frequency**2 for s in structures) / mass
    damping = sum(2 * s.mass * s.damping * s.frequency for s in structures) / mass

    def rate(t, y):
        return [y[1], t / times[-1] - damping * y[1] - stiffness * y[0]]

    # as accurate as the solver can be
    accuracy = {"method": "DOP853", "rtol": 1e-12, "atol": 1e-15}
    return solve_ivp(rate, (0, times[-1]), [0.0, 0.0], t_eval=times, **accuracy).y[0]


class TestContact:
    def test_plastic_impact_keeps_contact_until_tension(self):
        # catches: e = 0 treated as a very small bounce; release by displacement instead of force
        structures, acceleration = pair((1.5, 0.05, 4.0), (0.6, 0.05, 1.0)), shaking(6.0)
        history = pounding_history(acceleration, DT, structures, 0.03, 0.0)
        clearance = 0.03 - history.displacement[0] + history.displacement[1]
        touching = clearance < 1e-12
        assert touching.sum() > 5
        assert_allclose(
            history.velocity[0, touching], history.velocity[1, touching], rtol=0, atol=1e-12
        )
        assert len(history.impacts) < 20

    def test_identical_structures_that_touch_never_part(self):
        # catches: rounding of a force that is zero taken for tension
        history = pounding_history(shaking(12.0), DT, [Structure(1.0, 0.05, 3.0)] * 2, 0.0, 0.65)
        assert len(history.impacts) == 0
        assert_allclose(history.displacement[0], history.displacement[1], rtol=0, atol=1e-13)

    def test_touching_pair_moves_as_one_structure_while_pressed(self):
        # catches: contact opened at the start, masses not added
        # a push to the right presses: the stiff one is right
        structures = pair((1.0, 0.05, 2.0), (0.5, 0.05, 1.0))
        push = -np.linspace(0.0, 1.0, 20)
        history = pounding_history(push, DT, structures, 0.0, 0.5, free_vibration=False)
        assert len(history.impacts) == 0
        joined = joined_displacement(structures, DT * np.arange(20))
        assert_allclose(history.displacement, [joined, joined], rtol=0, atol=1e-11)

    def test_wall(self):
        # catches: infinite mass turned into NaN
        wall = Structure(1.0, 0.05, np.inf, participation=0.0)
        history = pounding_history(shaking(12.0), DT, [Structure(1.5, 0.1, 1.0), wall], 0.03, 0.5)
        impacts = history.impacts
        assert len(impacts) > 1
        assert_allclose(
            impacts["velocity_after_1"], -0.5 * impacts["velocity_before_1"], rtol=1e-12
        )
        assert_array_equal(history.displacement[1], 0.0)
        assert history.closure <= 1e-10

    def test_joints_between_abutments_open_by_the_decks_motion(self):
        # catches: closing taken for opening, a joint at a wall left out
        wall = Structure(1.0, 0.0, np.inf, participation=0.0)
        row = [wall, Structure(1.5, 0.05, 4.0), Structure(0.7, 0.05, 2.0), wall]
        record = shaking(12.0)
        fine = np.interp(np.arange(0, record.size - 1, 1 / 32), np.arange(record.size), record)
        history = pounding_history(fine, DT / 32, row, 0.02, 0.5)
        opening = np.diff(history.displacement, axis=0).max(axis=1)
        assert (history.opening_maxima >= opening).all()
        # between samples a little more, where impacts end it
        assert_allclose(history.opening_maxima, opening, rtol=0.01)

    def test_heavy_neighbour_is_not_moved(self):
        # catches: impulse shared wrongly; limit of masses
        heavy = pair((1.5, 0.05, 1e-9), (0.6, 0.05, 1.0))
        free = pounding_history(shaking(12.0), DT, heavy, 10.0, 0.5)
        hit = pounding_history(shaking(12.0), DT, heavy, 0.02, 0.5)
        assert len(hit.impacts) > 3
        assert_allclose(
            hit.displacement_maxima[1], free.displacement_maxima[1], rtol=1e-7
        )  # mass ratio 1e-9

    @pytest.mark.parametrize("restitution", [0.0, 0.65, 0.99, 1.0])
    @pytest.mark.parametrize("gaps", [0.0, 0.02, [0.02, 0.0, 0.01]])
    def test_rows_end_and_close(self, gaps, restitution):
        # catches: endless chatter in a row, released interfaces that must stay closed
        wall = Structure(0.3, 0.02, np.inf, participation=0.0)
        yielding = Structure(1.0, 0.02, 3e5, 0.03)
        row = [Structure(1.5, 0.05, 4e5), Structure(0.6, 0.05, 2e5), yielding, wall]
        history = pounding_history(shaking(8.0), DT, row, gaps, restitution)
        assert history.closure <= 1e-10
        clearance = np.diff(history.displacement, axis=0) + np.reshape(gaps, (-1, 1))
        assert clearance.min() > -1e-12


class TestEndOfRecord:
    def test_closing_ramp_and_free_vibration(self):
        # catches: a step at the end of a record that does not end at zero; free vibration left out
        acceleration = np.full(30, 2.0)
        acceleration[0] = 0.0
        history = pounding_history(
            acceleration, DT, pair((1.5, 0.0, 1.0), (1.0, 0.0, 1.0)), 0.1, 1.0
        )
        padded = np.concatenate([acceleration, np.zeros(400)])
        same = pounding_history(
            padded, DT, pair((1.5, 0.0, 1.0), (1.0, 0.0, 1.0)), 0.1, 1.0, free_vibration=False
        )
        count = same.time.size
        assert_allclose(
            history.displacement[:, :count], same.displacement, rtol=0, atol=1e-11
        )  # after some impacts
        assert history.time[-1] > same.time[-1]

    def test_without_free_vibration_ends_with_the_record(self):
        history = pounding_history(
            np.ones(30), DT, pair(*PAIRS[0][:2]), 0.1, 1.0, free_vibration=False
        )
        assert history.time.size == 30


class TestBadInput:
    def test_two_walls(self):
        wall = Structure(1.0, 0.05, np.inf, participation=0.0)
        with pytest.raises(ValueError, match="infinite"):
            pounding_history(shaking(1.0), DT, [wall, wall], 0.1, 0.5)


def test_impacts_of_each_gap_are_counted_against_its_fastest():
    # catches: one limit for a complete row, whose fast gap would hide all impacts of a slow one
    row = [Structure(1.5, 0.05, 4.0), Structure(0.6, 0.05, 1.0), Structure(0.9, 0.05, 2.0)]
    impacts = pounding_history(shaking(6.0), DT, row, 0.0, 0.65).impacts
    assert not impacts["counted"].all()
    for _, of_gap in impacts.groupby("left"):
        speed = of_gap["velocity_before_1"] - of_gap["velocity_before_2"]
        least = max(0.001, 0.01 * speed.max())
        assert_array_equal(of_gap["counted"], speed > least)
    assert impacts["left"].nunique() == 2
