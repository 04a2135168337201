import pytest
from obspy import Stream, Trace
from obspy.core import AttribDict

from per_obspy.processing.usable_periods import usable_periods_noted


@pytest.mark.parametrize(("lowpass", "dt", "shortest"), [(25.0, 0.001, 0.05), (25.0, 0.02, 0.1)])
def test_usable_periods_stay_inside_corners_and_sampling(lowpass, dt, shortest):
    trace = Trace(header={"delta": dt, "per_obspy": AttribDict(highpass=0.1, lowpass=lowpass)})
    out = usable_periods_noted(Stream([trace]), usable=0.8)[0].stats.per_obspy
    assert out.longest_period == pytest.approx(8.0)
    assert out.shortest_period == pytest.approx(shortest)
    assert "longest_period" not in trace.stats.per_obspy
