"""Histories of many pairs at once, so short that they also run uncompiled."""

import math

import numpy as np
import pytest
from numpy.testing import assert_allclose

from per_obspy.pounding.pair_histories import pounding_histories
from per_obspy.pounding.row_history import pounding_history
from per_obspy.pounding.structure import Structure

PULSE = -4.0 * np.sin(2 * np.pi * np.arange(40) * 0.02 / 0.8)


@pytest.mark.parametrize("restitution", [0.0, 0.5])
@pytest.mark.parametrize("limit", [0.01, math.inf])
def test_lanes_agree_with_the_row(restitution, limit):
    # catches: lanes and rows that differ in phase handling
    structures = [Structure(0.9, 0.05, 2.0, limit, 0.1), Structure(0.4, 0.05, 1.0, limit, 0.1)]
    history = pounding_history(PULSE, 0.02, structures, 0.005, restitution, free_vibration=False)
    maxima = pounding_histories(
        PULSE, 0.02, 0.9, 0.05, 2.0, 0.4, 0.05, 1.0, 0.005, restitution,
        yield_displacement_1=limit, yield_displacement_2=limit, hardening_1=0.1, hardening_2=0.1,
        free_vibration=False,
    )  # fmt: skip
    assert len(history.impacts) > 0
    assert history.closure <= 1e-10  # required
    # bounces end earlier in the lanes
    assert_allclose(maxima.per, history.per, rtol=1e-5)
    assert_allclose(maxima.displacement_maxima, history.displacement_maxima, rtol=1e-5)


def test_free_vibration_is_followed_until_it_is_settled():
    # catches: maxima of the record alone; the pulse ends long before the slow structure turns
    arguments = (0.02, 4.0, 0.02, 1.0, 3.0, 0.02, 1.0, 10.0, 0.5)
    forced = pounding_histories(PULSE[:20], *arguments, free_vibration=False)
    followed = pounding_histories(PULSE[:20], *arguments)
    assert (followed.displacement_maxima > 2.0 * forced.displacement_maxima).all()
    for i, period in enumerate((4.0, 3.0)):
        structures = [Structure(period, 0.02, 1.0), Structure(0.5, 0.02, 1.0)]
        expected = pounding_history(PULSE[:20], 0.02, structures, 10.0, 0.5).displacement_maxima[0]
        assert_allclose(followed.displacement_maxima[i], expected, rtol=1e-9)  # both are exact
