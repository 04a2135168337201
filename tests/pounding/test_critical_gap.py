"""Equation (15): bounds, limits and scaling."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from per_obspy.pounding.critical_gap import absolute_gap, critical_gap, srss_gap

radii = st.floats(0.0, 1e3)
correlations = st.floats(-1.0, 1.0)
ROUNDING = 1e-14  # a handful of operations on doubles


@given(radii, radii, correlations)
def test_it_stays_between_difference_and_sum(per_1, per_2, correlation):
    # mutation: the sign of the last term, a missing factor 2
    assert abs(per_1 - per_2) <= critical_gap(per_1, per_2, correlation) <= per_1 + per_2


@given(radii, radii, correlations)
def test_exchanging_the_structures_changes_nothing(per_1, per_2, correlation):
    # mutation: r1 in place of r2
    there, back = critical_gap(per_1, per_2, correlation), critical_gap(per_2, per_1, correlation)
    assert there == pytest.approx(back, rel=ROUNDING)


@given(radii, radii, correlations, st.floats(0.001, 1000.0))
def test_twice_the_radii_need_twice_the_gap(per_1, per_2, correlation, factor):
    # mutation: a forgotten square root
    once = critical_gap(per_1, per_2, correlation)
    # 1e-7 of the radii: where rho is 1 and the radii agree but for rounding, the gap is that
    # rounding
    # numbers below the smallest normal one have fewer digits
    tolerance = 1e-7 * factor * (per_1 + per_2) + 1000.0 * np.finfo(float).tiny
    assert critical_gap(factor * per_1, factor * per_2, correlation) == pytest.approx(
        factor * once, abs=tolerance
    )


@given(radii, radii)
def test_limits_of_the_correlation(per_1, per_2):
    # mutation: SRSS and ABS exchanged
    assert critical_gap(per_1, per_2, 1.0) == abs(per_1 - per_2)
    assert critical_gap(per_1, per_2, -1.0) == pytest.approx(
        absolute_gap(per_1, per_2), rel=ROUNDING
    )
    # abs: the square root of a denormal product is exact to its own size only
    assert critical_gap(per_1, per_2, 0.0) == pytest.approx(
        srss_gap(per_1, per_2), rel=1e-13, abs=1e-150
    )


@given(st.floats(0.01, 100.0), st.floats(0.01, 100.0), st.floats(-0.99, 0.99))
def test_law_of_cosines(per_1, per_2, correlation):
    # an independent reading: the third side of a triangle whose angle has this cosine
    angle = np.arccos(correlation)
    side = abs(per_1 - per_2 * np.exp(1j * angle))
    assert critical_gap(per_1, per_2, correlation) == pytest.approx(side, rel=1e-12)


def test_no_cancellation_for_nearly_equal_structures():
    # 1 - 1e-12: the printed form keeps four digits of the gap, sqrt(2e-12) r
    correlation = 1.0 - 2.0**-40
    assert critical_gap(1.0, 1.0, correlation) == pytest.approx(2.0**-19.5, rel=1e-14)


def test_broadcasting_and_plain_rules():
    assert critical_gap([[1.0], [2.0]], [1.0, 2.0, 3.0], 0.5).shape == (2, 3)
    assert srss_gap(5.0, 12.0) == 13.0
    assert absolute_gap(5.0, 12.0) == 17.0
