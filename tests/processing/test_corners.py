import numpy as np
import pytest
from obspy import Trace
from obspy.core import AttribDict

from per_obspy.config import Processing
from per_obspy.processing.earthquake import fallback_highpass
from per_obspy.processing.filter.corners import (
    clean_corner,
    highest_corner,
    lowest_highpass,
    share_corners,
    with_usable_periods,
)

SETTINGS = Processing()
TABLE = SETTINGS.fallback_highpass


def trace(highpass=0.1, lowpass=30.0):
    numbers = AttribDict(
        highpass=highpass, lowpass=lowpass, highpass_source="noise", lowpass_source="noise"
    )
    return Trace(np.zeros(1000), {"delta": 0.01, "per_obspy": numbers})


@pytest.mark.parametrize(
    ("magnitude", "corner"), [(2.0, 0.5), (3.5, 0.3), (5.4, 0.3), (7.1, 0.1), (None, 0.08)]
)
def test_the_table_is_used_from_each_magnitude_on(magnitude, corner):
    found = fallback_highpass(magnitude, TABLE, 0.08)
    assert found.frequency == corner
    assert ("constant" if magnitude is None else "table") in found.reason


def test_a_magnitude_below_the_table_gets_the_constant():
    assert fallback_highpass(1.0, {3.0: 0.3}, 0.08).frequency == 0.08


def test_both_horizontals_get_the_narrower_band():
    out = share_corners([trace(0.1, 20.0), trace(0.3, 30.0)])
    first, second = (trace.stats.per_obspy for trace in out)
    assert (first.highpass, first.lowpass) == (second.highpass, second.lowpass) == (0.3, 20.0)
    assert first.own_highpass == 0.1
    assert (first.highpass_source, second.highpass_source) == ("shared", "noise")


def test_limits_from_length_and_sampling():
    assert lowest_highpass(trace()).frequency == pytest.approx(0.1)
    assert highest_corner(trace(), 40.0).frequency == pytest.approx(37.5)
    assert highest_corner(trace(), 20.0).frequency == 20.0


def test_the_reason_names_the_limit():
    clean = clean_corner(trace(), lowest_highpass(trace()), 0.5, SETTINGS)
    assert clean.reason == "one cycle in the record"


@pytest.mark.parametrize(("lowpass", "dt", "shortest"), [(25.0, 0.001, 0.05), (25.0, 0.02, 0.1)])
def test_usable_periods_stay_inside_corners_and_sampling(lowpass, dt, shortest):
    trace = Trace(header={"delta": dt, "per_obspy": AttribDict(highpass=0.1, lowpass=lowpass)})
    out = with_usable_periods(trace, usable=0.8).stats.per_obspy
    assert out.longest_period == pytest.approx(8.0)
    assert out.shortest_period == pytest.approx(shortest)
    assert "longest_period" not in trace.stats.per_obspy
