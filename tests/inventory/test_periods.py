"""Period formulas: published values, scaling and the promise that they are no lower bounds."""

import numpy as np
import pytest
from numpy.testing import assert_allclose, assert_array_equal

from per_obspy import asce7_period, ec8_period
from per_obspy.inventory.periods import period_log_std
from per_obspy.inventory.schema import SYSTEMS

FEET = 0.3048


# Goel & Chopra (1997), best-fit lines for measured periods, height in feet: T = 0.035 H**0.80 for
# steel and T = 0.018 H**0.90 for concrete moment frames. Published with two digits: 3 %.
@pytest.mark.parametrize(
    ("system", "coefficient", "exponent"), [("steel_mrf", 0.035, 0.8), ("concrete_mrf", 0.018, 0.9)]
)
def test_moment_frames_follow_the_best_fit_to_measured_periods(system, coefficient, exponent):
    feet = np.array([30.0, 100.0, 400.0])
    assert_allclose(asce7_period(feet * FEET, system), coefficient * feet**exponent, rtol=0.03)


@pytest.mark.parametrize(
    ("system", "exponent"),
    [("steel_mrf", 0.8), ("concrete_mrf", 0.9), ("ebf_brbf", 0.75), ("other", 0.75)],
)
def test_asce7_scales_with_a_power_of_height(system, exponent):
    # would catch exponents attached to the wrong system
    once, twice = asce7_period([12.0, 24.0], system)
    assert_allclose(twice / once, 2.0**exponent, rtol=1e-14)  # round-off only


def test_eurocode_coefficients():
    # 16 m to the power of 3/4 is exactly 8 m
    assert_allclose(
        ec8_period(16.0, SYSTEMS), [0.68, 0.60, 0.40, 0.40, 0.60, *3 * [0.40]], rtol=1e-14
    )


def test_eurocode_ends_at_forty_metres():
    heights = [40.0, 40.1]
    found = ec8_period(heights, "concrete_mrf")
    assert_allclose(found[0], 0.075 * 40.0**0.75, rtol=1e-14)
    assert found[1] == asce7_period(40.1, "concrete_mrf")


@pytest.mark.parametrize("formula", [asce7_period, ec8_period])
def test_heights_and_systems_broadcast(formula):
    found = formula([[10.0], [20.0], [60.0]], ["steel_mrf", "other"])
    assert found.shape == (3, 2)
    assert found[2, 1] == formula(60.0, "other")


@pytest.mark.parametrize("formula", [asce7_period, ec8_period])
@pytest.mark.parametrize("height", [0.0, -3.0, np.nan, np.inf])
def test_impossible_heights(formula, height):
    with pytest.raises(ValueError, match=f"height.*{height:g}"):
        formula([9.0, height], "other")


@pytest.mark.parametrize("formula", [asce7_period, ec8_period])
def test_unknown_system_is_named(formula):
    with pytest.raises(ValueError, match=r"steel_mrf.*got 'brick'"):
        formula([9.0, 9.0], ["other", "brick"])


def test_walls_and_unknown_systems_scatter_more():
    assert_array_equal(period_log_std(SYSTEMS), [0.3, 0.3, 0.4, 0.4, 0.3, *3 * [0.4]])


@pytest.mark.parametrize(
    ("system", "lower"), [("steel_mrf", (0.0724, 0.8)), ("concrete_mrf", (0.0466, 0.9))]
)
def test_medians_lie_above_the_lower_bound_of_the_code(system, lower):
    # would catch the best-fit ratio forgotten or divided by
    height = np.array([5.0, 50.0])
    assert (asce7_period(height, system) > 1.1 * lower[0] * height ** lower[1]).all()
