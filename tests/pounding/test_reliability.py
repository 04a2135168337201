"""Estimates against exact answers: laws that hold for every record, and the summary of ratios."""

import numpy as np
import pytest
from numpy.testing import assert_allclose, assert_array_equal

from per_obspy.pounding.reliability import (
    SingleHitComparison,
    amplifications,
    compare_gaps,
    compare_single_hit,
    summary,
)

DT, DAMPING = 0.02, 0.05
OTHERS = 0.65, DAMPING  # restitution and damping
PERIODS_1, PERIODS_2 = np.array([0.4, 0.7, 1.1, 0.9]), np.array([0.7, 1.2, 0.5, 0.9])


@pytest.fixture(scope="module")
def motion():
    """Noise under an envelope."""
    time = DT * np.arange(1000)
    return np.exp(-(((time - 8.0) / 4.0) ** 2)) * np.random.default_rng(5).standard_normal(1000)


def test_no_pair_needs_more_than_both_peaks_at_once(motion):
    # caught: radii or peaks of one structure given to the other
    gaps = compare_gaps(motion, DT, PERIODS_1, PERIODS_2, DAMPING)
    assert (
        gaps.exact <= gaps.absolute_sd * (1.0 + 1e-12)
    ).all()  # equal but for rounding where both peaks coincide
    assert_array_equal(gaps.larger_per, np.maximum(gaps.ddc_per, gaps.record_per))


def test_equal_structures_need_no_gap_unless_they_count_as_uncorrelated(motion):
    gaps = compare_gaps(motion, DT, PERIODS_1, PERIODS_2, DAMPING)
    assert gaps.exact[3] == gaps.ddc_sd[3] == gaps.ddc_per[3] == 0.0
    # the correlation of the record is 1 but for rounding, whose root is what remains
    assert gaps.record_per[3] < 1e-6 * gaps.absolute_sd[3]
    assert_allclose(gaps.srss_sd[3], gaps.absolute_sd[3] / np.sqrt(2.0), rtol=1e-12)


def test_gaps_do_not_ask_which_structure_stands_left(motion):
    # caught: the one-sided distance in place of the larger one
    one, other = (
        compare_gaps(motion, DT, PERIODS_1, PERIODS_2, DAMPING),
        compare_gaps(-motion, DT, PERIODS_2, PERIODS_1, DAMPING),
    )
    for here, there in zip(one, other, strict=True):
        # the absolute term: what rounding leaves of the equal pair's correlation
        assert_allclose(here, there, rtol=1e-9, atol=1e-9)


def test_a_gap_above_the_critical_one_changes_nothing(motion):
    compared = compare_single_hit(
        motion, DT, PERIODS_1[:3], PERIODS_2[:3], 1.0 + 1e-9, 1.0, *OTHERS
    )
    assert (compared.status == "no_pounding").all()
    assert not compared.impacts.any()
    assert_array_equal(compared.predicted, compared.per)
    assert_allclose(
        compared.actual, compared.per, rtol=1e-9
    )  # two algorithms for the same closed form


def test_a_gap_below_the_critical_one_is_hit(motion):
    # caught: the critical gap of the other order, which one of the two may never need
    for sign in (1.0, -1.0):
        compared = compare_single_hit(
            sign * motion, DT, PERIODS_1[:3], PERIODS_2[:3], 0.95, 1.0, *OTHERS
        )
        assert (compared.impacts > 0).all()
        assert (compared.predicted >= compared.per)[:, compared.status == "ok"].all()


def test_the_mirror_image_is_the_same_pair(motion):
    # caught: mass ratio or radii that do not follow their structure
    one = compare_single_hit(motion, DT, PERIODS_1[:3], PERIODS_2[:3], 0.8, 4.0, *OTHERS)
    other = compare_single_hit(-motion, DT, PERIODS_2[:3], PERIODS_1[:3], 0.8, 0.25, *OTHERS)
    assert_array_equal(one.status, other.status)
    # rounding before the impacts grows with every impact; there are a few here
    assert_allclose(one.predicted, other.predicted[::-1], rtol=1e-6)
    assert_allclose(one.actual, other.actual[::-1], rtol=1e-6)


def test_the_largest_amplification_leaves_out_what_has_no_single_hit():
    # caught: radii of the two structures divided by each other's
    compared = SingleHitComparison(
        status=np.array(["ok", "no_grazing_state"]),
        per=np.array([[1.0, 2.0], [4.0, 1.0]]),
        predicted=np.array([[2.0, np.nan], [4.0, np.nan]]),
        actual=np.array([[1.0, 2.0], [6.0, 3.0]]),
        impacts=np.array([1, 2]),
    )
    largest = amplifications(compared)
    assert_array_equal(largest, [[2.0], [1.5]])


def test_bias_and_scatter_of_known_ratios():
    # logarithms -0.2 and 0.8, as often: mean 0.3, standard deviation 0.5
    found = summary(np.exp([-0.2, 0.8] * 5), (0.99, 0.5))
    assert_allclose(found.log_std, 0.5, rtol=1e-12)
    assert_allclose(found.median, 0.5 * (np.exp(-0.2) + np.exp(0.8)), rtol=1e-12)
    assert found.below == (0.5, 0.0)
    assert found.cases == 10


@pytest.mark.parametrize("ratio", [[], [1.0, 0.0], [np.nan]])
def test_ratios_that_say_nothing_are_refused(ratio):
    with pytest.raises(ValueError, match="ratio"):
        summary(ratio, (1.0,))


def test_periods_are_one_row_each(motion):
    with pytest.raises(ValueError, match="period_1 and period_2"):
        compare_gaps(motion, DT, [0.5, 0.6], [0.7], DAMPING)
