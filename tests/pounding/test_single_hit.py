"""Single hit: the invariants of its three steps, its limits, and a search by SciPy that shares no formula with it."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from scipy.optimize import brentq

from per_obspy.pounding.critical_gap import critical_gap
from per_obspy.pounding.impact import transfer_energies
from per_obspy.pounding.single_hit import single_hit

radii = st.floats(0.05, 2.0)
periods = st.floats(0.1, 5.0)
masses = st.floats(1.0, 100.0)
restitutions = st.floats(0.0, 1.0)
correlations = st.floats(-0.95, 0.95)  # away from v = 0, where square roots halve the digits
fractions = st.floats(0.0, 0.99)
pairs = st.tuples(
    radii, radii, periods, periods, masses, masses, restitutions, correlations, fractions
)
EXACT = 1e-9  # what is required; rounding reaches 1e-13 here


def arguments_of(pair):
    *first, correlation, fraction = pair
    largest = float(critical_gap(first[0], first[1], correlation))
    return (*first, largest, fraction * largest)


def state_at_grazing(hit, arguments):
    """Free motion from the contact at the actual gap forward to the grazing state: u1, u2, v1, v2 of both branches."""
    _, _, period_1, period_2, *_ = arguments
    states = []
    for u, v, period in (
        (hit.branches.displacement_1, hit.branches.velocity_1, period_1),
        (hit.branches.displacement_2, hit.branches.velocity_2, period_2),
    ):
        omega = 2 * np.pi / period
        cosine, sine = (
            np.cos(omega * hit.branches.time_before),
            np.sin(omega * hit.branches.time_before),
        )
        states.append((u * cosine + v / omega * sine, v * cosine - omega * u * sine))
    return states[0][0], states[1][0], states[0][1], states[1][1]


@given(pairs)
def test_grazing_state(pair):
    # mutation: the other root of the quadratic; v1 = v2 lost; backtracking with the wrong sign
    arguments = arguments_of(pair)
    radius_1, radius_2, period_1, period_2, *_, largest, _ = arguments
    hit = single_hit(*arguments)
    assert hit.status == "ok"
    u1, u2, v1, v2 = state_at_grazing(hit, arguments)
    speed = 2 * np.pi * (radius_1 / period_1 + radius_2 / period_2)
    np.testing.assert_allclose(u1 - u2, largest, rtol=0, atol=EXACT * (radius_1 + radius_2))
    np.testing.assert_allclose(v1, v2, rtol=0, atol=EXACT * speed)
    np.testing.assert_allclose(np.hypot(u1, v1 * period_1 / (2 * np.pi)), radius_1, rtol=EXACT)
    np.testing.assert_allclose(np.hypot(u2, v2 * period_2 / (2 * np.pi)), radius_2, rtol=EXACT)
    assert v1[0] >= 0 >= v1[1]
    # a maximum of u1 - u2: the gap closes, it does not open
    assert np.all(
        (2 * np.pi / period_1) ** 2 * u1 >= (2 * np.pi / period_2) ** 2 * u2 - EXACT * speed**2
    )


@given(pairs)
def test_contact_at_the_actual_gap_while_closing(pair):
    # mutation: contact at the critical gap; a root at which the structures separate; a time beyond
    # half the periods
    arguments = arguments_of(pair)
    hit = single_hit(*arguments)
    distance = hit.branches.displacement_1 - hit.branches.displacement_2
    np.testing.assert_allclose(
        distance, arguments[-1], rtol=0, atol=EXACT * (arguments[0] + arguments[1])
    )
    assert np.all(hit.branches.velocity_1 >= hit.branches.velocity_2)
    assert np.all(hit.branches.time_before > 0)
    assert np.all(hit.branches.time_before <= (arguments[2] + arguments[3]) / 2 * (1 + EXACT))


@given(pairs)
def test_energy(pair):
    # mutation: radius after impact from the velocity before; E_Tr with the printed sign; masses
    # exchanged
    arguments = arguments_of(pair)
    radius_1, radius_2, period_1, period_2, mass_1, mass_2, restitution, *_ = arguments
    branches = single_hit(*arguments).branches
    stiffness_1, stiffness_2 = (
        mass_1 * (2 * np.pi / period_1) ** 2,
        mass_2 * (2 * np.pi / period_2) ** 2,
    )
    scale = stiffness_1 * radius_1**2 + stiffness_2 * radius_2**2
    gain_1 = 0.5 * stiffness_1 * (branches.per_after_1**2 - radius_1**2)
    gain_2 = 0.5 * stiffness_2 * (branches.per_after_2**2 - radius_2**2)
    np.testing.assert_allclose(gain_1, -branches.transfer_energy_1, rtol=0, atol=EXACT * scale)
    np.testing.assert_allclose(gain_2, -branches.transfer_energy_2, rtol=0, atol=EXACT * scale)
    loss = branches.transfer_energy_1 + branches.transfer_energy_2
    assert np.all(loss >= -EXACT * scale)
    expected = transfer_energies(
        branches.velocity_1, branches.velocity_2, mass_1, mass_2, restitution
    )
    np.testing.assert_allclose(branches.transfer_energy_1, expected[0], rtol=0, atol=EXACT * scale)
    np.testing.assert_allclose(branches.transfer_energy_2, expected[1], rtol=0, atol=EXACT * scale)


@given(pairs)
def test_seen_from_behind_the_structures_and_the_branches_change_places(pair):
    # mutation: 1 and 2 mixed anywhere; branches stored in the wrong order
    arguments = arguments_of(pair)
    r1, r2, t1, t2, m1, m2, *rest = arguments
    here, there = single_hit(*arguments), single_hit(r2, r1, t2, t1, m2, m1, *rest)
    np.testing.assert_allclose(
        here.branches.time_before, there.branches.time_before[::-1], rtol=1e-6
    )
    # 1e-6 of the contact time: near-double roots of the first contact share it with the pair's own
    # conditioning
    np.testing.assert_allclose(here.amplification_1, there.amplification_2, rtol=1e-6)
    np.testing.assert_allclose(here.amplification_2, there.amplification_1, rtol=1e-6)
    np.testing.assert_allclose(here.envelope_1, there.envelope_2, rtol=EXACT)


@given(pairs, st.sampled_from([2.0**-5, 0.25, 8.0]), st.sampled_from(["length", "time", "mass"]))
def test_units_cancel(pair, factor, dimension):
    # mutation: a radius, period or mass that enters without its partner. Powers of two keep every
    # digit
    arguments = arguments_of(pair)
    scaled = {"length": {0, 1, 7, 8}, "time": {2, 3}, "mass": {4, 5}}[dimension]
    changed = single_hit(
        *(x * factor if place in scaled else x for place, x in enumerate(arguments))
    )
    hit = single_hit(*arguments)
    assert changed.amplification_1 == pytest.approx(hit.amplification_1, rel=EXACT)
    assert changed.amplification_2 == pytest.approx(hit.amplification_2, rel=EXACT)
    times = hit.branches.time_before * (factor if dimension == "time" else 1)
    np.testing.assert_allclose(changed.branches.time_before, times, rtol=EXACT)


@given(
    st.tuples(
        radii,
        radii,
        st.floats(0.3, 3.0),
        st.floats(0.3, 3.0),
        masses,
        masses,
        restitutions,
        correlations,
    )
)
def test_square_root_approach_to_the_critical_gap(pair):
    # mutation: branch signs, m1 for m2 in the shares; amplification linear in the missing gap
    r1, r2, t1, t2, m1, m2, e, correlation = pair
    largest = float(critical_gap(r1, r2, correlation))
    missing = 1e-9 * largest
    hit = single_hit(r1, r2, t1, t2, m1, m2, e, largest, largest - missing)
    u1, u2, v, _ = state_at_grazing(hit, (r1, r2, t1, t2))
    w1, w2 = 2 * np.pi / t1, 2 * np.pi / t2
    closing = np.sqrt(2 * (w1**2 * u1 - w2**2 * u2) * missing)
    share_1, share_2 = (1 + e) * m2 / (m1 + m2), (1 + e) * m1 / (m1 + m2)
    slope_1, slope_2 = (
        -v * share_1 * closing / (w1 * r1) ** 2,
        v * share_2 * closing / (w2 * r2) ** 2,
    )
    # the next term of the expansion is of the order of the missing gap times (closing acceleration
    # / own)
    rest_1, rest_2 = (
        3 * (share * closing / (w * r)) ** 2
        for share, w, r in ((share_1, w1, r1), (share_2, w2, r2))
    )
    third = (
        closing * np.sqrt(missing / largest) * 50
    )  # the change of v between contact and grazing state
    assert np.all(
        abs(hit.branches.amplification_1 - 1 - slope_1)
        <= rest_1 + share_1 * third / (w1 * r1) + 1e-12
    )
    assert np.all(
        abs(hit.branches.amplification_2 - 1 - slope_2)
        <= rest_2 + share_2 * third / (w2 * r2) + 1e-12
    )


@given(pairs)
def test_the_single_hit_stays_within_its_bound(pair):
    # mutation: |1 - (1 + e) m2/M| without its sign, the bound's maximum missed by the scan
    hit = single_hit(*arguments_of(pair))
    assert np.all(hit.branches.per_after_1 <= hit.envelope_1 * (1 + EXACT))
    assert np.all(hit.branches.per_after_2 <= hit.envelope_2 * (1 + EXACT))


@given(pairs)
def test_the_bound_is_the_largest_radius_over_all_phases(pair):
    # mutation: a velocity sign left out; the scan too coarse. Here: a dense grid of phases and all
    # four sign pairs
    arguments = arguments_of(pair)
    r1, r2, t1, t2, m1, m2, e, _, gap = arguments
    hit = single_hit(*arguments)
    low, high = max(-r1, gap - r2), min(r1, gap + r2)
    x = (low + high) / 2 - (high - low) / 2 * np.cos(np.linspace(0, np.pi, 4001))
    speed_1 = 2 * np.pi / t1 * np.sqrt(np.maximum(r1**2 - x**2, 0))
    speed_2 = 2 * np.pi / t2 * np.sqrt(np.maximum(r2**2 - (x - gap) ** 2, 0))
    largest = [r1, r2]
    for v1, v2 in ((s1 * speed_1, s2 * speed_2) for s1 in (1, -1) for s2 in (1, -1)):
        closing = np.maximum(v1 - v2, 0)
        after_1, after_2 = (
            v1 - (1 + e) * m2 / (m1 + m2) * closing,
            v2 + (1 + e) * m1 / (m1 + m2) * closing,
        )
        largest[0] = max(largest[0], np.hypot(x, after_1 * t1 / (2 * np.pi)).max())
        largest[1] = max(largest[1], np.hypot(x - gap, after_2 * t2 / (2 * np.pi)).max())
    # the grid is never above the bound; below it by the curvature between its points (1e-3 of the
    # range, squared)
    assert largest[0] * (1 - EXACT) <= hit.envelope_1 <= largest[0] * (1 + 1e-4)
    assert largest[1] * (1 - EXACT) <= hit.envelope_2 <= largest[1] * (1 + 1e-4)


def reference(arguments, sign):
    """Fig. 5 by root searches: common velocity on both circles, sampled free motion backwards, equations (7), (8)."""
    r1, r2, t1, t2, m1, m2, e, largest, gap = arguments
    w1, w2 = 2 * np.pi / t1, 2 * np.pi / t2

    def difference(x):
        return w1**2 * (r1**2 - x**2) - w2**2 * (r2**2 - (x - largest) ** 2)

    x = brentq(difference, max(-r1, largest - r2), min(r1, largest + r2), xtol=1e-15, rtol=1e-15)
    v = sign * w1 * np.sqrt(r1**2 - x**2)

    def state(t):
        u1 = x * np.cos(w1 * t) - v / w1 * np.sin(w1 * t)
        u2 = (x - largest) * np.cos(w2 * t) - v / w2 * np.sin(w2 * t)
        v1 = v * np.cos(w1 * t) + w1 * x * np.sin(w1 * t)
        v2 = v * np.cos(w2 * t) + w2 * (x - largest) * np.sin(w2 * t)
        return u1, u2, v1, v2

    times = np.linspace(0, (t1 + t2) / 2, 20001)[1:]
    u1, u2, _, _ = state(times)
    end = int(np.argmax(u1 - u2 <= gap))
    t = brentq(
        lambda t: state(t)[0] - state(t)[1] - gap,
        times[end - 1] if end else 0.0,
        times[end],
        xtol=1e-15,
    )
    u1, u2, v1, v2 = state(t)
    after_1 = v1 - (1 + e) * m2 / (m1 + m2) * (v1 - v2)
    after_2 = v2 + (1 + e) * m1 / (m1 + m2) * (v1 - v2)
    return np.array([t, np.hypot(u1, after_1 / w1) / r1, np.hypot(u2, after_2 / w2) / r2])


def test_against_root_searches():
    # mutation: anything in the three steps, above all a first contact that jumps over the first
    # root
    rng = np.random.default_rng(11)
    for _ in range(60):
        pair = (
            *rng.uniform(0.1, 1, 2),
            *rng.uniform(0.3, 3, 2),
            *rng.uniform(1, 5, 2),
            *rng.uniform([0, -0.9, 0.02], [1, 0.9, 0.98]),
        )
        arguments = arguments_of(pair)
        branches = single_hit(*arguments).branches
        for place, sign in enumerate((1, -1)):
            found = [
                branches.time_before[place],
                branches.amplification_1[place],
                branches.amplification_2[place],
            ]
            np.testing.assert_allclose(found, reference(arguments, sign), rtol=1e-9)


def test_equal_periods_have_a_closed_form():
    # the grazing state turned back by arccos(g/g_cr); closing velocity w sqrt(g_cr² - g²)
    gap = np.array([0.0, 0.1, 0.3, 0.49])
    hit = single_hit(0.3, 0.4, 2.0, 2.0, 1.0, 3.0, 0.65, 0.5, gap)
    np.testing.assert_allclose(
        hit.branches.time_before, np.tile(np.arccos(gap / 0.5) / np.pi, (2, 1)), rtol=1e-13
    )
    np.testing.assert_allclose(hit.impact_velocity, np.pi * np.sqrt(0.25 - gap**2), rtol=1e-13)


def test_a_moat_wall_only_takes_energy():
    # mutation: 0/0 for the wall's amplification, NaN for its energy
    gap = np.array([0.0, 0.2, 0.9])
    hit = single_hit(1.0, 0.0, 2.0, 1.0, 5.0, np.inf, 0.6, 1.0, gap)
    assert np.all(hit.status == "ok")
    np.testing.assert_allclose(hit.per_after_1, np.sqrt(gap**2 + 0.36 * (1 - gap**2)), rtol=1e-12)
    assert np.all(hit.amplification_1 == 1)
    assert np.all(hit.amplification_2 == 1)
    assert np.all(hit.per_after_2 == 0)
    mirrored = single_hit(0.0, 1.0, 1.0, 2.0, np.inf, 5.0, 0.6, 1.0, gap)
    np.testing.assert_allclose(mirrored.per_after_2, hit.per_after_1, rtol=1e-12)


@given(pairs)
def test_an_infinite_mass_feels_nothing_and_a_plastic_impact_ends_the_relative_motion(pair):
    # mutation: shares of infinite mass; 1 - e for 1 + e
    r1, r2, t1, t2, m1, _, e, largest, gap = arguments_of(pair)
    hit = single_hit(r1, r2, t1, t2, m1, np.inf, e, largest, gap)
    np.testing.assert_allclose(hit.branches.per_after_2, r2, rtol=EXACT)
    impulse = (1 + e) * m1 * (hit.branches.velocity_1 - hit.branches.velocity_2)
    np.testing.assert_allclose(
        hit.branches.transfer_energy_2, -impulse * hit.branches.velocity_2, rtol=EXACT
    )
    plastic = single_hit(r1, r2, t1, t2, m1, 2 * m1, 0.0, largest, gap).branches
    scale = 2 * np.pi * (r1 / t1 + r2 / t2)
    np.testing.assert_allclose(
        plastic.velocity_after_1, plastic.velocity_after_2, rtol=0, atol=EXACT * scale
    )


def test_status():
    per_1, largest, gap = (
        [1.0, 1.0, 1.0, 1.0, 1.0],
        [0.5, 0.5, 3.0, 3.0, 0.2],
        [0.5, 0.4, 3.5, 0.1, 0.1],
    )
    hit = single_hit(per_1, [0.8, 0.8, 0.8, 0.8, 0.3], 1.0, 1.4, 1.0, 1.0, 0.65, largest, gap)
    assert list(hit.status) == [
        "no_pounding",
        "ok",
        "no_pounding",
        "inconsistent_critical_gap",
        "no_grazing_state",
    ]
    known = np.array([True, True, True, False, False])
    for field in (
        hit.amplification_1,
        hit.amplification_2,
        hit.per_after_1,
        hit.per_after_2,
        hit.impact_velocity,
    ):
        assert np.all(np.isfinite(field) == known)
    assert np.all(np.isfinite(hit.envelope_1) & np.isfinite(hit.envelope_2))
    assert np.all(hit.amplification_1[[0, 2]] == 1)
    assert np.all(hit.per_after_1[[0, 2]] == 1.0)
    assert np.all(hit.impact_velocity[[0, 2]] == 0)


def test_tangent_circles_are_clamped():
    # rho = -1 and rho = 1 give the sum and the difference of the radii but for rounding; v = 0
    # there
    hit = single_hit(0.1, 0.2, 1.0, 0.7, 1.0, 1.0, 0.5, critical_gap(0.1, 0.2, -1.0), 0.1)
    assert hit.status == "ok"
    np.testing.assert_allclose(
        hit.branches.time_before[0], hit.branches.time_before[1], rtol=1e-6
    )  # v ~ sqrt(rounding)
    assert (
        single_hit(0.3, 0.1, 1.0, 1.0, 1.0, 1.0, 0.5, critical_gap(0.3, 0.1, 1.0), 0.1).status
        == "ok"
    )


def test_broadcasting_blocks_and_unchanged_inputs():
    gaps = np.linspace(0.0, 0.4, 71)  # more than two blocks of the kernel
    kept = gaps.copy()
    table = single_hit(np.array([[0.3], [0.35]]), 0.4, 1.0, 1.3, 1.0, 2.0, 0.65, 0.5, gaps)
    assert table.status.shape == table.envelope_1.shape == (2, 71)
    assert table.branches.time_before.shape == (2, 2, 71)
    one = single_hit(0.35, 0.4, 1.0, 1.3, 1.0, 2.0, 0.65, 0.5, gaps[68])
    assert one.amplification_1 == table.amplification_1[1, 68]
    np.testing.assert_array_equal(gaps, kept)


@pytest.mark.parametrize(("place", "value", "name"), [
    (0, -1.0, "per_1"), (1, np.inf, "per_2"), (2, 0.0, "period_1"), (3, np.nan, "period_2"), (4, 0.0, "mass_1"),
    (5, -1.0, "mass_2"), (6, 1.1, "restitution"), (7, -0.1, "critical_gap"), (8, -0.1, "gap"),
])  # fmt: skip
def test_bad_arguments_are_named(place, value, name):
    arguments = [0.3, 0.4, 1.0, 1.3, 1.0, 2.0, 0.65, 0.5, 0.2]
    arguments[place] = value
    with pytest.raises(ValueError, match=name):
        single_hit(*arguments)
