"""Correlation along any azimuth: the stationarity formula against the integrals themselves."""

import numpy as np
import pytest
from numpy.testing import assert_allclose, assert_array_equal
from scipy.signal import cont2discrete, lfilter

from per_obspy.pounding.correlation import ddc_correlation, directional_correlation, worst_azimuth
from per_obspy.pounding.relative import directional_relative_displacement

DT = 0.01
RANDOM = np.random.default_rng(5)
NORTH, EAST = RANDOM.normal(size=(2, 1500)) * np.hanning(1500)
NORTH[-1] = 0.3  # the record has to be closed


def _displacement(acceleration, period, damping):
    """Return the response on a grid ten times finer, with the free vibration, by SciPy."""
    omega, padded = 2 * np.pi / period, np.append(acceleration, np.zeros(60_000))
    fine = np.arange(10 * (padded.size - 1) + 1) * DT / 10
    ground = np.interp(fine, np.arange(padded.size) * DT, padded)
    # first-order hold: exact for piecewise-linear acceleration
    system = [-1.0], [1.0, 2 * damping * omega, omega**2]
    above, below, _ = cont2discrete(system, DT / 10, method="foh")
    return lfilter(above.ravel(), below, ground)


@pytest.mark.parametrize(
    ("oscillators", "azimuth"),
    [((1.0, 0.05, 1.3, 0.05), 33.0), ((0.3, 0.02, 2.0, 0.1), 120.0), ((5.0, 0.05, 0.2, 0.03), 0.0)],
)
def test_against_the_integrals_of_responses_by_scipy(oscillators, azimuth):
    # would catch: a wrong sign or factor in the formula, a swapped component, a missing tail, an
    # unclosed record
    motion = NORTH * np.cos(np.radians(azimuth)) + EAST * np.sin(np.radians(azimuth))
    first, second = _displacement(motion, *oscillators[:2]), _displacement(motion, *oscillators[2:])
    expected = first @ second / np.sqrt(first @ first * (second @ second))
    pair = [np.array([value]) for value in oscillators]
    # the sum over a grid of T/200 at worst replaces the integral: an error of 1e-9 in three trials,
    # 1e-7 with margin
    assert_allclose(
        directional_correlation(NORTH, EAST, DT, *pair, [[azimuth]]), expected, atol=1e-7
    )


@pytest.fixture
def pairs():
    return (
        RANDOM.uniform(0.1, 3.0, 30),
        np.full(30, 0.05),
        RANDOM.uniform(0.1, 3.0, 30),
        np.full(30, 0.02),
    )


def test_exchange_of_the_buildings(pairs):
    # would catch: damping of one building attached to the other
    azimuths = np.arange(0.0, 180.0, 7.0)[None]
    once = directional_correlation(NORTH, EAST, DT, *pairs, azimuths)
    swapped = directional_correlation(NORTH, EAST, DT, *pairs[2:], *pairs[:2], azimuths)
    assert_allclose(once, swapped, atol=1e-12)  # the same sums in another order


def test_turning_the_sensors_turns_the_azimuths(pairs):
    # would catch: cos and sin exchanged, a lost cross term
    east_is_north = directional_correlation(EAST, -NORTH, DT, *pairs, [[20.0]])
    assert_allclose(
        east_is_north, directional_correlation(NORTH, EAST, DT, *pairs, [[110.0]]), atol=1e-12
    )


def test_size_and_sign_of_the_motion_do_not_matter(pairs):
    once = directional_correlation(NORTH, EAST, DT, *pairs, [[45.0]])
    assert_allclose(
        directional_correlation(-7 * NORTH, -7 * EAST, DT, *pairs, [[45.0]]), once, atol=1e-12
    )


def test_white_noise_tends_to_equation_16():
    noise = np.random.default_rng(6).normal(size=(2, 400_000))
    pair = [np.array([value]) for value in (1.0, 0.05, 1.1, 0.05)]
    # 4000 s of noise, correlation time 1/(xi omega) = 3 s: about 1300 independent values, standard
    # error 0.03
    assert_allclose(
        directional_correlation(*noise, DT, *pair, [[0.0]]),
        ddc_correlation(*pair)[:, None],
        atol=0.1,
    )


@pytest.mark.parametrize(("period", "damping", "expected"), [
    (1.0, 0.05, 1.0), (1.0, 0.0, 1.0), (1.2, 0.0, 0.0),
])  # fmt: skip
def test_equal_oscillators_move_as_one_and_undamped_ones_only_then(period, damping, expected):
    pair = [1.0], [damping], [period], [damping]
    assert directional_correlation(NORTH, EAST, DT, *pair, [[0.0]]).tolist() == [[expected]]


def test_results_do_not_depend_on_the_company(pairs):
    # would catch: lanes that leak into each other, a block that is not full
    together = directional_correlation(NORTH, EAST, DT, *pairs, [[10.0]])
    alone = [
        directional_correlation(NORTH, EAST, DT, *(p[i : i + 1] for p in pairs), [[10.0]])[0]
        for i in range(30)
    ]
    assert_array_equal(together, alone)


def test_an_azimuth_without_motion_has_no_correlation():
    with pytest.raises(ValueError, match="no motion along an azimuth"):
        directional_correlation(0 * NORTH, EAST, DT, [1.0], [0.05], [1.2], [0.05], [[0.0]])


class TestWorstAzimuth:
    def test_motion_along_one_line_is_worst_along_it(self):
        # mutation: cos and sin exchanged, the azimuth of the opposite order
        towards = _worst(0.6 * NORTH, 0.8 * NORTH)
        line = np.degrees(np.arctan2(0.8, 0.6))
        assert min(abs(towards - line), abs(towards - line - 180.0)) < 1e-9
        # the motion reversed closes the gap from the other side
        assert abs(_worst(-0.6 * NORTH, -0.8 * NORTH) - towards) == pytest.approx(180.0)

    def test_no_other_azimuth_is_worse(self):
        # mutation: the largest component in place of the largest length
        pair = 1.0, 0.05, 0.4, 0.05
        found = directional_relative_displacement(NORTH, EAST, DT, *pair, _worst(NORTH, EAST))
        azimuths = np.arange(0.0, 360.0, 5.0)
        others = directional_relative_displacement(NORTH, EAST, DT, *pair, azimuths)
        # the vector is looked at at the samples: (omega dt)²/8 at 0.4 s
        assert found.one_before_two >= others.one_before_two.max() * (1.0 - 4e-3)

    def test_equal_structures_never_part(self):
        same = [1.0], [0.05], [1.0], [0.05], [1.0], [1.0]
        assert worst_azimuth(NORTH, EAST, DT, *same).tolist() == [0.0]
        assert worst_azimuth(NORTH, EAST, DT, [], [], [], [], [], []).size == 0


def _worst(north, east):
    """Return the worst azimuth of one pair."""
    return worst_azimuth(north, east, DT, [1.0], [0.05], [0.4], [0.05], [1.0], [1.0])[0]
