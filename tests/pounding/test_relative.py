"""Exact relative displacement: SciPy on a fine grid, symmetry, limits, free vibration, azimuths."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.signal import cont2discrete, lfilter

from per_obspy.pounding.pair_histories import pounding_histories
from per_obspy.pounding.relative import (
    approach,
    directional_relative_displacement,
    relative_displacement,
)

dampings = st.floats(0.01, 0.3)
periods = st.floats(0.05, 4.0)
DT = 0.02


def noise(count=300, seed=3):
    rng = np.random.default_rng(seed)
    return rng.standard_normal(count) * np.sin(
        np.linspace(0, np.pi, count)
    )  # m/s², ends at rest but for rounding


def displacement(acceleration, dt, period, damping, parts, tail):
    """Return SciPy's first-order hold with each sample cut into parts and a tail of zeros."""
    omega = 2 * np.pi / period
    padded = np.concatenate([acceleration, np.zeros(tail)])
    time = np.arange((padded.size - 1) * parts + 1) / parts
    ground = np.interp(time, np.arange(padded.size), padded)
    # u over a is -1 / (s² + 2 ξ ω s + ω²)
    system = [-1.0], [1.0, 2 * damping * omega, omega**2]
    above, below, _ = cont2discrete(system, dt / parts, method="foh")
    return lfilter(above.ravel(), below, ground)


@pytest.mark.parametrize(("period_1", "period_2", "share_1", "share_2"), [
    (0.5, 0.8, 1.0, 1.0), (0.06, 1.5, 1.0, 1.4), (0.05, 0.07, 1.2, 1.0), (2.0, 2.1, 1.0, 1.0),
])  # fmt: skip
def test_against_scipy_on_a_fine_grid(period_1, period_2, share_1, share_2):
    # mutation: peaks at samples only (6 % at T = 2.5 dt); participation on the wrong structure; no
    # free vibration
    ground = noise()
    found = relative_displacement(ground, DT, period_1, 0.05, period_2, 0.02, share_1, share_2)
    parts = 40
    apart = share_1 * displacement(ground, DT, period_1, 0.05, parts, 500)
    apart = apart - share_2 * displacement(ground, DT, period_2, 0.02, parts, 500)
    # the grid misses at most the curvature over half a part: (2 pi/T dt/parts/2)²/2, 1e-3 at T =
    # 0.05 s
    missed = (2 * np.pi / min(period_1, period_2) * DT / parts / 2) ** 2
    assert apart.max() * (1 - 1e-9) <= found.one_before_two <= apart.max() * (1 + missed)
    assert -apart.min() * (1 - 1e-9) <= found.two_before_one <= -apart.min() * (1 + missed)
    assert found.largest == max(found.one_before_two, found.two_before_one)


@pytest.mark.parametrize(("period_1", "period_2"), [(0.5, 0.8), (0.15, 1.5), (2.0, 2.1)])
def test_approach_against_scipy(period_1, period_2):
    # mutation: the other direction, a participation left out, displacement over the frequency
    ground = noise()
    found = approach(ground, 0.0 * ground, DT, period_1, 0.05, period_2, 0.02, 0.0, 1.2, 0.9)
    parts = 200
    apart = 1.2 * displacement(ground, DT, period_1, 0.05, parts, 500)
    apart = apart - 0.9 * displacement(ground, DT, period_2, 0.02, parts, 500)
    both = relative_displacement(ground, DT, period_1, 0.05, period_2, 0.02, 1.2, 0.9)
    assert found.displacement == both.one_before_two
    # velocity by differences of the fine grid: at the samples, half a part away
    velocity = np.gradient(apart, DT / parts)[::parts]
    assert found.velocity == pytest.approx(velocity.max(), rel=2e-3)


@given(periods, dampings, periods, dampings)
@settings(max_examples=25)
def test_exchanging_the_structures_exchanges_the_orders(period_1, damping_1, period_2, damping_2):
    # mutation: a sign of one structure; the maximum of |u1 - u2| given as both orders
    ground = noise()
    there = relative_displacement(ground, DT, period_1, damping_1, period_2, damping_2)
    back = relative_displacement(ground, DT, period_2, damping_2, period_1, damping_1)
    assert there.one_before_two == pytest.approx(back.two_before_one, rel=1e-9, abs=1e-15)
    turned = relative_displacement(-ground, DT, period_1, damping_1, period_2, damping_2)
    assert turned.one_before_two == pytest.approx(there.two_before_one, rel=1e-9, abs=1e-15)


@given(periods, dampings, periods, dampings)
@settings(max_examples=25)
def test_twice_the_motion_and_more_samples(period_1, damping_1, period_2, damping_2):
    # mutation: an absolute tolerance; the maximum between samples depending on where the samples
    # are
    ground = noise(150)
    once = relative_displacement(ground, DT, period_1, damping_1, period_2, damping_2)
    twice = relative_displacement(2 * ground, DT, period_1, damping_1, period_2, damping_2)
    assert twice.largest == pytest.approx(2 * once.largest, rel=1e-12)
    finer = np.interp(np.arange(149 * 4 + 1) / 4, np.arange(150), ground)
    same = relative_displacement(finer, DT / 4, period_1, damping_1, period_2, damping_2)
    # structures all but equal part by rounding only: 1e-15 of radii below 0.1 m
    np.testing.assert_allclose(same, once, rtol=1e-9, atol=1e-16)


def test_free_vibration_after_the_record_counts():
    # a pulse of one step leaves both at rest in displacement: all relative displacement comes later
    pulse = np.array([0.0, 1.0, 0.0])
    found = relative_displacement(pulse, 0.01, 2.0, 0.0, 1.0, 0.0)
    time = np.linspace(0.0, 20.0, 200001)
    apart = -0.01 * (np.sin(np.pi * time) / np.pi - np.sin(2 * np.pi * time) / (2 * np.pi))
    assert found.largest == pytest.approx(
        abs(apart).max(), rel=1e-3
    )  # the pulse is not an impulse: (w dt)²
    padded = relative_displacement(
        np.concatenate([pulse, np.zeros(4000)]), 0.01, 2.0, 0.0, 1.0, 0.0
    )
    np.testing.assert_allclose(padded, found, rtol=1e-12)


def test_a_record_that_does_not_end_at_zero_is_closed_by_a_ramp():
    open_end = relative_displacement([0.0, 1.0, 2.0], 0.05, 0.6, 0.05, 1.0, 0.05)
    closed = relative_displacement([0.0, 1.0, 2.0, 0.0], 0.05, 0.6, 0.05, 1.0, 0.05)
    assert open_end == closed


def test_twins_never_approach_each_other_but_unequal_participation_parts_them():
    ground = noise()
    assert relative_displacement(ground, DT, 1.0, 0.05, 1.0, 0.05).largest == 0.0
    alone = relative_displacement(ground, DT, 1.0, 0.05, 1.0, 0.05, 1.5, 1.0)
    wide = relative_displacement(ground, DT, 1.0, 0.05, 1.0, 0.05, 3.0, 2.0)
    assert wide.largest == pytest.approx(2 * alone.largest, rel=1e-12)


@given(periods, dampings, st.floats(-9.0, -5.0))
@settings(max_examples=25)
def test_nearly_equal_structures_part_in_proportion_to_their_difference(period, damping, logarithm):
    # mutation: an absolute margin; a peak left out because it is small beside the radii. The
    # difference of two motions that agree to a part d carries rounding of 1e-16 / d of itself, some
    # hundred times over
    ground, difference = noise(), 10.0**logarithm
    reference = (
        relative_displacement(ground, DT, period, damping, period * (1 + 1e-5), damping).largest
        / 1e-5
    )
    found = (
        relative_displacement(
            ground, DT, period, damping, period * (1 + difference), damping
        ).largest
        / difference
    )
    assert found == pytest.approx(reference, rel=1e-2 + 1e-12 / difference)
    assert (
        relative_displacement(ground, DT, period, damping, period * (1 + 1e-15), damping).largest
        < 1e-13
    )


@given(st.floats(0.0, 360.0))
@settings(max_examples=20)
def test_azimuth(azimuth):
    # mutation: sine and cosine exchanged; degrees taken for radians
    north, east = noise(seed=1), noise(seed=2)
    along = np.cos(np.radians(azimuth)) * north + np.sin(np.radians(azimuth)) * east
    here = directional_relative_displacement(north, east, DT, 0.7, 0.05, 1.1, 0.05, azimuth)
    np.testing.assert_allclose(
        here, relative_displacement(along, DT, 0.7, 0.05, 1.1, 0.05), rtol=1e-11
    )
    behind = directional_relative_displacement(north, east, DT, 0.7, 0.05, 1.1, 0.05, azimuth + 180)
    assert behind.one_before_two == pytest.approx(here.two_before_one, rel=1e-11)


def test_many_pairs_answer_as_each_alone():
    # mutation: pairs of a block that mix; the order of sorting not undone
    rng = np.random.default_rng(5)
    north, east = noise(120, 1), noise(120, 2)
    structures = rng.uniform([0.1, 0.01, 0.1, 0.01], [3.0, 0.2, 3.0, 0.2], (70, 4)).T
    azimuth = rng.uniform(0, 360, 70)
    together = directional_relative_displacement(north, east, DT, *structures, azimuth)
    for pair in (0, 31, 64, 69):
        alone = directional_relative_displacement(
            north, east, DT, *structures[:, pair], azimuth[pair]
        )
        assert alone == tuple(field[pair] for field in together)


def test_the_exact_history_first_touches_at_the_largest_relative_displacement():
    # mutation: a peak missed between samples or after the record, on either side. The history
    # shares no code with it
    ground = noise(400)
    period_1, period_2 = np.random.default_rng(9).uniform(0.2, 2.0, (2, 30))
    gap = relative_displacement(ground, DT, period_1, 0.05, period_2, 0.05).one_before_two
    apart, touching = (
        pounding_histories(
            ground, DT, period_1, 0.05, 1.0, period_2, 0.05, 1.0, gap * factor, 0.65
        ).impact_velocity
        for factor in (1 + 1e-9, 1 - 1e-6)
    )
    assert np.all(apart == 0.0)
    assert np.all(touching > 0.0)


def test_components_of_different_length_are_refused():
    with pytest.raises(ValueError, match="equally long"):
        directional_relative_displacement([0.0, 1.0], [0.0], 0.01, 1.0, 0.05, 2.0, 0.05, 0.0)
