"""Single hit: invariants of its three steps, limits, and a search by SciPy with other formulas."""

from itertools import product

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from numpy.testing import assert_allclose
from scipy.optimize import brentq

from per_obspy.pounding.critical_gap import critical_gap
from per_obspy.pounding.single_hit import single_hit, transfer_energies

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
    """Return u1, u2, v1, v2 of both branches: free motion from the contact to the grazing state."""
    branches, time = hit.branches, hit.branches.time_before
    u1, v1 = free_motion(branches.displacement_1, branches.velocity_1, arguments[2], time)
    u2, v2 = free_motion(branches.displacement_2, branches.velocity_2, arguments[3], time)
    return u1, u2, v1, v2


def free_motion(displacement, velocity, period, time):
    """Return displacement and velocity of an undamped oscillator after a time."""
    omega = 2 * np.pi / period
    cosine, sine = np.cos(omega * time), np.sin(omega * time)
    after = displacement * cosine + velocity / omega * sine
    return after, velocity * cosine - omega * displacement * sine


@given(pairs)
def test_grazing_state(pair):
    # mutation: the other root of the quadratic; v1 = v2 lost; backtracking with the wrong sign
    arguments = arguments_of(pair)
    radius_1, radius_2, period_1, period_2, *_, largest, _ = arguments
    hit = single_hit(*arguments)
    assert hit.status == "ok"
    u1, u2, v1, v2 = state_at_grazing(hit, arguments)
    omega_1, omega_2 = 2 * np.pi / period_1, 2 * np.pi / period_2
    speed = omega_1 * radius_1 + omega_2 * radius_2

    # equal velocities on both circles, at the critical gap
    assert_allclose(u1 - u2, largest, rtol=0, atol=EXACT * (radius_1 + radius_2))
    assert_allclose(v1, v2, rtol=0, atol=EXACT * speed)
    assert_allclose(np.hypot(u1, v1 / omega_1), radius_1, rtol=EXACT)
    assert_allclose(np.hypot(u2, v2 / omega_2), radius_2, rtol=EXACT)
    assert v1[0] >= 0 >= v1[1]
    # a maximum of u1 - u2: the gap closes, it does not open
    assert np.all(omega_1**2 * u1 >= omega_2**2 * u2 - EXACT * speed**2)


@given(pairs)
def test_contact_at_the_actual_gap_while_closing(pair):
    # mutation: contact at the critical gap; a root at which the structures separate; a time beyond
    # half the periods
    arguments = arguments_of(pair)
    hit = single_hit(*arguments)
    distance = hit.branches.displacement_1 - hit.branches.displacement_2
    assert_allclose(distance, arguments[-1], rtol=0, atol=EXACT * (arguments[0] + arguments[1]))
    assert np.all(hit.branches.velocity_1 >= hit.branches.velocity_2)
    assert np.all(hit.branches.time_before > 0)
    assert np.all(hit.branches.time_before <= (arguments[2] + arguments[3]) / 2 * (1 + EXACT))


@given(pairs)
def test_energy(pair):
    # mutation: radius after impact from the velocity before; E_Tr with the printed sign; masses
    # exchanged
    arguments = arguments_of(pair)
    radius_1, radius_2, period_1, period_2, mass_1, mass_2, *_ = arguments
    branches = single_hit(*arguments).branches
    left = branches.transfer_energy_1, branches.transfer_energy_2
    energy_1 = 0.5 * mass_1 * (2 * np.pi / period_1) ** 2  # per squared radius
    energy_2 = 0.5 * mass_2 * (2 * np.pi / period_2) ** 2
    rounding = 2 * EXACT * (energy_1 * radius_1**2 + energy_2 * radius_2**2)

    # what leaves a structure is missing from its circle, and the pair never gains
    gain_1 = energy_1 * (branches.per_after_1**2 - radius_1**2)
    gain_2 = energy_2 * (branches.per_after_2**2 - radius_2**2)
    assert_allclose(gain_1, -left[0], rtol=0, atol=rounding)
    assert_allclose(gain_2, -left[1], rtol=0, atol=rounding)
    assert np.all(left[0] + left[1] >= -rounding)


@given(pairs)
def test_energies_are_those_of_an_impact_at_its_velocities(pair):
    # mutation: velocities of another branch
    arguments = arguments_of(pair)
    branches = single_hit(*arguments).branches
    radius_1, radius_2, period_1, period_2, mass_1, mass_2, restitution, *_ = arguments
    velocities = branches.velocity_1, branches.velocity_2
    expected = transfer_energies(*velocities, mass_1, mass_2, restitution)
    found = branches.transfer_energy_1, branches.transfer_energy_2
    # rounding of the energies that both structures have
    scale = mass_1 * (radius_1 / period_1) ** 2 + mass_2 * (radius_2 / period_2) ** 2
    assert_allclose(found, expected, rtol=0, atol=EXACT * (2 * np.pi) ** 2 * scale)


@given(pairs)
def test_seen_from_behind_the_structures_and_the_branches_change_places(pair):
    # mutation: 1 and 2 mixed anywhere; branches stored in the wrong order
    arguments = arguments_of(pair)
    r1, r2, t1, t2, m1, m2, *rest = arguments
    here, there = single_hit(*arguments), single_hit(r2, r1, t2, t1, m2, m1, *rest)
    assert_allclose(here.branches.time_before, there.branches.time_before[::-1], rtol=1e-6)
    # 1e-6 of the contact time: near-double roots of the first contact share it with the pair's own
    # conditioning
    assert_allclose(here.amplification_1, there.amplification_2, rtol=1e-6)
    assert_allclose(here.amplification_2, there.amplification_1, rtol=1e-6)
    assert_allclose(here.envelope_1, there.envelope_2, rtol=EXACT)


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
    assert_allclose(changed.branches.time_before, times, rtol=EXACT)


near_periods = st.floats(0.3, 3.0)
near_pairs = st.tuples(
    radii, radii, near_periods, near_periods, masses, masses, restitutions, correlations
)


@given(near_pairs)
def test_square_root_approach_to_the_critical_gap(pair):
    # mutation: branch signs, m1 for m2 in the shares; amplification linear in the missing gap
    r1, r2, t1, t2, m1, m2, e, correlation = pair
    largest = float(critical_gap(r1, r2, correlation))
    missing = 1e-9 * largest
    hit = single_hit(*pair[:7], largest, largest - missing)
    u1, u2, v, _ = state_at_grazing(hit, (r1, r2, t1, t2))
    w1, w2 = 2 * np.pi / t1, 2 * np.pi / t2
    closing = (1 + e) * np.sqrt(2 * (w1**2 * u1 - w2**2 * u2) * missing)

    # change of each velocity over its speed on the circle; structure 1 is pushed back
    speed_1, speed_2 = w1 * r1, w2 * r2
    change_1 = -m2 / (m1 + m2) * closing / speed_1
    change_2 = m1 / (m1 + m2) * closing / speed_2
    assert_grows_by(hit.branches.amplification_1, v / speed_1, change_1)
    assert_grows_by(hit.branches.amplification_2, v / speed_2, change_2)


def assert_grows_by(amplification, velocity, change):
    """Compare a radius with its first-order growth; velocities over the speed on the circle."""
    # the next term is of the order of the squared change; v itself changes between contact and
    # grazing state by the root of the missing share 1e-9 of the gap
    rest = 3 * change**2 + 50 * np.abs(change) * np.sqrt(1e-9) + 1e-12
    assert np.all(np.abs(amplification - 1 - velocity * change) <= rest)


@given(pairs)
def test_the_single_hit_stays_within_its_bound(pair):
    # mutation: |1 - (1 + e) m2/M| without its sign, the bound's maximum missed by the scan
    hit = single_hit(*arguments_of(pair))
    assert np.all(hit.branches.per_after_1 <= hit.envelope_1 * (1 + EXACT))
    assert np.all(hit.branches.per_after_2 <= hit.envelope_2 * (1 + EXACT))


@given(pairs)
def test_the_bound_is_the_largest_radius_over_all_phases(pair):
    # mutation: a velocity sign left out; the scan too coarse
    arguments = arguments_of(pair)
    hit = single_hit(*arguments)
    largest_1, largest_2 = largest_radii(arguments)
    # the grid is never above the bound; below it by the curvature between its points (1e-3 of the
    # range, squared)
    assert largest_1 * (1 - EXACT) <= hit.envelope_1 <= largest_1 * (1 + 1e-4)
    assert largest_2 * (1 - EXACT) <= hit.envelope_2 <= largest_2 * (1 + 1e-4)


def largest_radii(arguments):
    """Return the largest radii after an impact over a dense grid of phases and all sign pairs."""
    r1, r2, t1, t2, m1, m2, e, _, gap = arguments

    # displacements at which both circles are met at the gap, dense at the ends
    low, high = max(-r1, gap - r2), min(r1, gap + r2)
    x = (low + high) / 2 - (high - low) / 2 * np.cos(np.linspace(0, np.pi, 4001))
    largest_1, largest_2 = r1, r2
    for sign_1, sign_2 in product((1, -1), repeat=2):
        # an impact where the structures close
        v1, v2 = sign_1 * speed_on_circle(x, r1, t1), sign_2 * speed_on_circle(x - gap, r2, t2)
        after_1, after_2 = after_impact(v1, np.minimum(v1, v2), v2, (m1, m2, e))
        largest_1 = max(largest_1, radius(x, after_1, t1).max())
        largest_2 = max(largest_2, radius(x - gap, after_2, t2).max())
    return largest_1, largest_2


def radius(displacement, velocity, period):
    """Return the radius of a state."""
    return np.hypot(displacement, velocity * period / (2 * np.pi))


def speed_on_circle(displacement, radius, period):
    """Return the speed at which an oscillator of a radius passes a displacement."""
    return 2 * np.pi / period * np.sqrt(np.maximum(radius**2 - displacement**2, 0))


def after_impact(v1, slower, v2, impact):
    """Return equations (7) and (8) with the closing velocity v1 - slower."""
    m1, m2, e = impact
    closing = (1 + e) * (v1 - slower)
    return v1 - m2 / (m1 + m2) * closing, v2 + m1 / (m1 + m2) * closing


def grazing_state(arguments, sign):
    """Return displacement of 1 and common velocity, where both circles have the same velocity."""
    r1, r2, t1, t2, *_, largest, _ = arguments
    w1, w2 = 2 * np.pi / t1, 2 * np.pi / t2

    def difference(x):
        return w1**2 * (r1**2 - x**2) - w2**2 * (r2**2 - (x - largest) ** 2)

    # by a root search in place of the quadratic
    x = brentq(difference, max(-r1, largest - r2), min(r1, largest + r2), xtol=1e-15, rtol=1e-15)
    return x, sign * w1 * np.sqrt(r1**2 - x**2)


def first_root(function, times):
    """Return the first root of a function that is positive at first, by sampling and bisection."""
    end = 1 + int(np.argmax(function(times[1:]) <= 0))
    return brentq(function, times[end - 1], times[end], xtol=1e-15)


def reference(arguments, sign):
    """Return time, and both amplifications, of Fig. 5 by root searches and sampled free motion."""
    r1, r2, t1, t2, m1, m2, e, largest, gap = arguments
    x, v = grazing_state(arguments, sign)

    def states(time):
        """Return u1, v1, u2, v2 at a time before the grazing state."""
        return *free_motion(x, v, t1, -time), *free_motion(x - largest, v, t2, -time)

    def clearance(time):
        u1, _, u2, _ = states(time)
        return u1 - u2 - gap

    # the last contact before the grazing state
    time = first_root(clearance, np.linspace(0, (t1 + t2) / 2, 20001))

    # equations (7), (8) and the radii
    u1, v1, u2, v2 = states(time)
    after_1, after_2 = after_impact(v1, v2, v2, (m1, m2, e))
    return np.array([time, radius(u1, after_1, t1) / r1, radius(u2, after_2, t2) / r2])


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
            assert_allclose(found, reference(arguments, sign), rtol=1e-9)


def test_equal_periods_have_a_closed_form():
    # the grazing state turned back by arccos(g/g_cr); closing velocity w sqrt(g_cr² - g²)
    gap = np.array([0.0, 0.1, 0.3, 0.49])
    hit = single_hit(0.3, 0.4, 2.0, 2.0, 1.0, 3.0, 0.65, 0.5, gap)
    assert_allclose(
        hit.branches.time_before, np.tile(np.arccos(gap / 0.5) / np.pi, (2, 1)), rtol=1e-13
    )
    assert_allclose(hit.impact_velocity, np.pi * np.sqrt(0.25 - gap**2), rtol=1e-13)


def test_a_moat_wall_only_takes_energy():
    # mutation: 0/0 for the wall's amplification, NaN for its energy
    gap = np.array([0.0, 0.2, 0.9])
    hit = single_hit(1.0, 0.0, 2.0, 1.0, 5.0, np.inf, 0.6, 1.0, gap)
    assert np.all(hit.status == "ok")
    assert_allclose(hit.per_after_1, np.sqrt(gap**2 + 0.36 * (1 - gap**2)), rtol=1e-12)
    assert np.all(hit.amplification_1 == 1)
    assert np.all(hit.amplification_2 == 1)
    assert np.all(hit.per_after_2 == 0)
    mirrored = single_hit(0.0, 1.0, 1.0, 2.0, np.inf, 5.0, 0.6, 1.0, gap)
    assert_allclose(mirrored.per_after_2, hit.per_after_1, rtol=1e-12)


@given(pairs)
def test_an_infinite_mass_feels_nothing_and_a_plastic_impact_ends_the_relative_motion(pair):
    # mutation: shares of infinite mass; 1 - e for 1 + e
    r1, r2, t1, t2, m1, _, e, largest, gap = arguments_of(pair)
    hit = single_hit(r1, r2, t1, t2, m1, np.inf, e, largest, gap)
    assert_allclose(hit.branches.per_after_2, r2, rtol=EXACT)
    impulse = (1 + e) * m1 * (hit.branches.velocity_1 - hit.branches.velocity_2)
    assert_allclose(hit.branches.transfer_energy_2, -impulse * hit.branches.velocity_2, rtol=EXACT)
    plastic = single_hit(r1, r2, t1, t2, m1, 2 * m1, 0.0, largest, gap).branches
    scale = 2 * np.pi * (r1 / t1 + r2 / t2)
    assert_allclose(plastic.velocity_after_1, plastic.velocity_after_2, rtol=0, atol=EXACT * scale)


def test_status():
    # mutation: numbers where there is no single hit, a status of the neighbouring pair
    largest, gap = [0.5, 0.5, 3.0, 3.0, 0.2], [0.5, 0.4, 3.5, 0.1, 0.1]
    per_2 = [0.8, 0.8, 0.8, 0.8, 0.3]
    hit = single_hit(1.0, per_2, 1.0, 1.4, 1.0, 1.0, 0.65, largest, gap)
    assert list(hit.status) == [
        "no_pounding",
        "ok",
        "no_pounding",
        "inconsistent_critical_gap",
        "no_grazing_state",
    ]
    # the estimate is missing only where there is none
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
    assert_allclose(
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
