"""Pairs that yield: linear limit, single oscillators, sampled differences, scaling."""

import numpy as np
import pytest
from numpy.testing import assert_allclose, assert_array_equal
from scipy.integrate import solve_ivp

from per_obspy.pounding import relative
from per_obspy.pounding.pair_histories import pounding_histories
from per_obspy.pounding.relative import (
    approach,
    directional_relative_displacement,
    yielding_approach,
    yielding_relative_displacement,
)
from per_obspy.pounding.row_history import pounding_history
from per_obspy.pounding.structure import Structure
from per_obspy.spectra.bilinear import bilinear_response

DT = 0.01


@pytest.fixture(scope="module")
def ground():
    """Two components of smoothed noise under an envelope, about 3 m/s²; the last sample is zero."""
    noise = np.random.default_rng(3).normal(size=(2, 1200))
    smooth = np.array([np.convolve(one, np.ones(5) / 5, mode="same") for one in noise])
    return 6.0 * smooth * np.hanning(1200)


@pytest.fixture(scope="module")
def pairs():
    """Random pairs, some so stiff that sampling intervals are cut."""
    random, count = np.random.default_rng(4), 64
    # undamped ones and every azimuth among them
    return {
        "period_1": random.uniform(0.05, 2.5, count),
        "damping_1": random.uniform(0.0, 0.2, count),
        "period_2": random.uniform(0.1, 2.5, count),
        "damping_2": random.uniform(0.0, 0.2, count),
        "azimuth": random.uniform(0.0, 360.0, count),
        "participation_1": random.uniform(0.8, 1.5, count),
        "participation_2": random.uniform(0.8, 1.5, count),
    }


@pytest.fixture(scope="module")
def strength(ground, pairs):
    """Yield displacements that give strength ratios from 1 to 6, and hardening."""
    random, count = np.random.default_rng(5), 64
    elastic = yielding_relative_displacement(ground, DT, **pairs).displacement_maxima
    return {
        "yield_displacement_1": elastic[0] / random.uniform(1.0, 6.0, count),
        "hardening_1": random.uniform(0.0, 0.1, count),
        "yield_displacement_2": elastic[1] / random.uniform(1.0, 6.0, count),
        "hardening_2": random.uniform(0.0, 0.1, count),
    }


def test_structures_that_never_yield_are_linear(ground, pairs):
    # catches: a maximum missed between samples, the two orders exchanged, free vibration left out
    found = yielding_relative_displacement(ground, DT, **pairs)
    linear = directional_relative_displacement(*ground, DT, **pairs)
    # both are exact; undamped pairs are followed equally long after the record
    assert_allclose(found.one_before_two, linear.one_before_two, rtol=1e-9)
    assert_allclose(found.two_before_one, linear.two_before_one, rtol=1e-9)
    assert_array_equal(found.largest, np.maximum(found.one_before_two, found.two_before_one))


def test_a_gap_is_closed_exactly_below_the_largest_relative_displacement(ground, pairs, strength):
    # catches: a yielding step whose relative displacement was taken as if it had stayed elastic
    apart = yielding_relative_displacement(ground, DT, **pairs, **strength).one_before_two
    contact = {"mass_1": 1.0, "mass_2": 2.0, "restitution": 0.6}
    for share, pounds in ((1.0 + 1e-9, False), (1.0 - 1e-9, True)):  # rounding is far below 1e-9
        history = pounding_histories(ground, DT, gap=share * apart, **contact, **pairs, **strength)
        assert_array_equal(history.impact_velocity > 0.0, pounds)


def test_openings_below_what_is_expected_are_found(ground, pairs, strength, monkeypatch):
    # catches: the second run left out, which finds what yields far less than a linear pair opens
    found = yielding_relative_displacement(ground, DT, **pairs, **strength)
    for expected in (0.0, 1.0, 100.0):
        monkeypatch.setattr(relative, "EXPECTED_OPENING", expected)
        again = yielding_relative_displacement(ground, DT, **pairs, **strength)
        # the same search of other tiles beside it
        assert_allclose(again.one_before_two, found.one_before_two, rtol=1e-9)
        assert_allclose(again.two_before_one, found.two_before_one, rtol=1e-9)
        assert_allclose(again.residual, found.residual, rtol=1e-9, atol=1e-12)


def test_twins_that_yield_never_part(ground, pairs, strength):
    # catches: a pair taken for twins that yields otherwise, and what it was told to expect kept
    twins = {name: both[name.replace("2", "1")] for both in (pairs, strength) for name in both}
    assert not yielding_relative_displacement(ground, DT, **twins).largest.any()
    twins["yield_displacement_2"] = twins["yield_displacement_1"] / 2.0
    weaker = yielding_relative_displacement(ground, DT, **twins)
    yields = weaker.displacement_maxima[1] > twins["yield_displacement_2"]
    assert yields.any()
    assert_array_equal(weaker.largest > 0.0, yields)


def oscillator(number, along, pairs, strength, index):
    """Return the response of structure 1 or 2 of a pair on its own."""
    arguments = [pairs[f"{name}_{number}"][index] for name in ("period", "damping")]
    arguments.append(strength[f"yield_displacement_{number}"][index])
    arguments.append(strength[f"hardening_{number}"][index])
    return bilinear_response(pairs[f"participation_{number}"][index] * along, DT, *arguments)


def test_radii_and_displacements_are_those_of_single_oscillators(ground, pairs, strength):
    # catches: drive or yield displacement without participation. The kernels share no code.
    found = yielding_relative_displacement(ground, DT, **pairs, **strength)
    angle = np.radians(pairs["azimuth"])
    for index in range(8):
        along = np.cos(angle[index]) * ground[0] + np.sin(angle[index]) * ground[1]
        for i in (1, 2):
            alone = oscillator(i, along, pairs, strength, index)
            # events are located to about 1e-12 of a step by either
            assert_allclose(
                found.displacement_maxima[i - 1, index], alone.displacement_maximum, rtol=1e-8
            )
            assert_allclose(found.per[i - 1, index], alone.displacement_radius, rtol=1e-8)
            assert_allclose(found.residual[i - 1, index], alone.residual, rtol=1e-6, atol=1e-12)


def test_against_sampled_differences_of_single_histories(ground, pairs, strength):
    # catches: OPENING of the two lines exchanged
    found = yielding_relative_displacement(ground, DT, **pairs, **strength)
    angle = np.radians(pairs["azimuth"])
    for index in np.flatnonzero(np.minimum(pairs["period_1"], pairs["period_2"]) > 0.5)[:6]:
        along = np.cos(angle[index]) * ground[0] + np.sin(angle[index]) * ground[1]
        along = np.append(along, np.zeros(3000))
        first = oscillator(1, along, pairs, strength, index).displacement
        second = oscillator(2, along, pairs, strength, index).displacement
        sampled = np.max(first - second)
        # between samples a motion of period T exceeds its samples by at most (pi dt / T)² / 2, here
        # 0.002
        assert sampled * (1.0 - 1e-9) <= found.one_before_two[index] <= 1.01 * sampled


def test_motion_the_other_way_exchanges_the_orders(ground, pairs, strength):
    one, other = (
        yielding_relative_displacement(way * ground, DT, **pairs, **strength) for way in (1.0, -1.0)
    )
    # the same arithmetic with other signs
    assert_allclose(one.one_before_two, other.two_before_one, rtol=1e-12)


def test_scaling_ground_and_strength_scales_displacements(ground, pairs, strength):
    scaled = {name: 3.0 * value if "yield" in name else value for name, value in strength.items()}
    one = yielding_relative_displacement(ground, DT, **pairs, **strength)
    other = yielding_relative_displacement(3.0 * ground, DT, **pairs, **scaled)
    assert_allclose(other.largest, 3.0 * one.largest, rtol=1e-9)  # events located to rounding


def test_a_pair_does_not_depend_on_the_others(ground, pairs, strength):
    whole = yielding_relative_displacement(ground, DT, **pairs, **strength)
    part = {name: values[17:20] for name, values in {**pairs, **strength}.items()}
    alone = yielding_relative_displacement(ground, DT, **part)
    assert_array_equal(whole.one_before_two[17:20], alone.one_before_two)
    assert_array_equal(whole.per[:, 17:20], alone.per)


def test_the_approach_of_populations_is_nearly_exact(ground, pairs, strength):
    # catches: yielding to one side only, plastic displacement that does not drive, hardening of 1,
    # free vibration left out, pairs that share steps of other pairs. The kernels share no step.
    both = pairs | strength | {"damping_1": 0.02 + pairs["damping_1"]}
    found, exact = (
        function(ground, DT, **both)
        for function in (yielding_approach, yielding_relative_displacement)
    )
    error = np.abs(found.displacement / exact.one_before_two - 1.0)
    # steps of 0.35 rad miss a peak by 1 - cos(0.175) at most, and bend p by as much
    assert error.max() < 0.03
    assert np.median(error) < 1e-3
    # a pulse of 0.2 s, whose largest approach comes after it
    pulse = np.zeros((2, 21)) + np.sin(np.linspace(0.0, np.pi, 21))
    after = yielding_approach(pulse, DT, **both).displacement
    assert_allclose(
        after, yielding_relative_displacement(pulse, DT, **both).one_before_two, rtol=0.03
    )
    # a pair does not depend on the others
    alone = yielding_approach(ground, DT, **{name: one[17:20] for name, one in both.items()})
    assert_array_equal(np.stack(alone), np.stack(found)[:, 17:20])
    # linear ones: the same steps, but for the peaks between them
    linear = yielding_approach(ground, DT, **pairs)
    reference = approach(*ground, DT, **pairs)
    assert_allclose(linear.displacement, reference.displacement, rtol=0.016)
    assert_allclose(linear.velocity, reference.velocity, rtol=0.03)


def test_what_the_approach_leaves_out_changes_nothing(ground, pairs, strength):
    # catches: a start after the first yielding, a record left before its last maximum, a motion
    # below what was expected, yielding or a maximum that strides miss, pairs that depend on others
    noise = 0.003 * np.random.default_rng(6).normal(size=(2, 3000))
    # a pause, a weak shock, and after another pause the main one, which fades
    record = np.hstack([noise, ground / 20.0, noise, ground, ground[:, ::-1] / 5.0, noise])
    both = pairs | strength | {"damping_1": 0.05 + pairs["damping_1"]}
    # some hardly separate, so that they do not reach what is expected; slow ones have long strides
    both |= {"period_2": np.where(np.arange(64) % 4, both["period_2"], both["period_1"])}
    for name in ("damping", "participation"):
        other = 0.999 * both[f"{name}_1"]
        both[f"{name}_2"] = np.where(np.arange(64) % 4, both[f"{name}_2"], other)
    both["yield_displacement_2"][::8] = both["yield_displacement_1"][::8] = np.inf
    found, exact = (
        function(record, DT / 2.0, **both)
        for function in (yielding_approach, yielding_relative_displacement)
    )
    # steps of at most 0.35 rad; where one structure yields and its like does not, they differ by
    # less than either moves
    assert_allclose(found.displacement, exact.one_before_two, rtol=0.05, atol=1e-5)
    # alone, no other pair needs the rounds that a pair leaves out
    every = [{name: value[i] for name, value in both.items()} for i in range(12)]
    alone = np.array([yielding_approach(record, DT / 2.0, **one) for one in every]).T
    assert_array_equal(alone, np.stack(found)[:, :12])


def rest_by_ode(pulse, period, damping, yields, hardening):
    """Integrate an oscillator and its elastoplastic spring; return where it will rest."""
    omega, end = 2.0 * np.pi / period, DT * (pulse.size - 1)

    def rate(time, state):
        u, v, stretch = state
        ground = np.interp(time, DT * np.arange(pulse.size), pulse, right=0.0)
        force = omega**2 * (hardening * u + (1.0 - hardening) * stretch)
        is_sliding = abs(stretch) >= yields and stretch * v > 0.0
        return v, -ground - 2.0 * damping * omega * v - force, 0.0 if is_sliding else v

    # the plastic part stays from the first periods on, long before the motion fades
    span = (0.0, end + 4.0 * period)
    state = solve_ivp(rate, span, (0.0, 0.0, 0.0), max_step=DT / 8, rtol=1e-9, atol=1e-12)
    return (1.0 - hardening) * (state.y[0, -1] - state.y[2, -1])


def test_a_pulse_leaves_the_displacement_of_an_independent_integration():
    # catches: plastic displacement taken for that at rest, exchanged structures, a sign
    pulse = -4.0 * np.sin(np.linspace(0.0, np.pi, 41))
    ground = np.stack([pulse, np.zeros_like(pulse)])
    given = {"period_1": 0.9, "damping_1": 0.15, "period_2": 0.3, "damping_2": 0.15, "azimuth": 0.0}
    yields = {"yield_displacement_1": 0.03, "hardening_1": 0.2}
    apart = yielding_relative_displacement(ground, DT, **given, **yields).residual
    # the solver steps over the ends of yielding, by DT / 8 at most
    assert_allclose(apart[0], rest_by_ode(pulse, 0.9, 0.15, 0.03, 0.2), rtol=5e-3)
    assert apart[0] > 0.01
    assert apart[1] == 0.0
    # from the other side, both are exchanged
    turned = {f"{name[:-1]}{3 - int(name[-1])}": value for name, value in yields.items()}
    swapped = {"period_1": 0.3, "damping_1": 0.15, "period_2": 0.9, "damping_2": 0.15}
    other = yielding_relative_displacement(-ground, DT, azimuth=0.0, **swapped, **turned).residual
    assert_allclose(other[::-1], -apart, rtol=1e-9)  # located to rounding


def test_impacts_leave_what_the_history_of_the_pair_ends_with(ground, pairs, strength):
    # catches: residuals of the pair without contact. Both kernels are exact in different ways
    several = {name: values[40:46] for name, values in {**pairs, **strength}.items()}
    contact = {"mass_1": 1.0, "mass_2": 2.0, "restitution": 0.6}
    apart = yielding_relative_displacement(ground, DT, **several)
    found = pounding_histories(ground, DT, gap=0.3 * apart.one_before_two, **contact, **several)
    assert (np.abs(found.residual - apart.residual) > 1e-4).any()
    for index in range(6):
        one = {name: values[index] for name, values in several.items()}
        angle = np.radians(one.pop("azimuth"))
        along = np.cos(angle) * ground[0] + np.sin(angle) * ground[1]
        structures = [
            Structure(mass=float(i), **{n[:-2]: v for n, v in one.items() if n.endswith(f"_{i}")})
            for i in (1, 2)
        ]
        history = pounding_history(along, DT, structures, 0.3 * apart.one_before_two[index], 0.6)
        for i, structure in enumerate(structures):
            rest = (1.0 - structure.hardening) * history.plastic_displacement[i, -1]
            # impacts magnify rounding; five digits are seen
            assert_allclose(found.residual[i, index], rest, rtol=1e-4, atol=1e-9)
