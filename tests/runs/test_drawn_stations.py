"""Record and spectra of a station for a drawing."""

import json

import numpy as np
import pytest
import xarray as xr

from per_obspy.runs.worst_pairs import INTERVALS, drawn_station


def station(north, east=None, interval=0.01):
    """Return a station with this motion and PER twice SD."""
    motion = np.stack([north] if east is None else [north, east])
    periods, count = np.array([0.1, 1.0, 10.0]), len(motion)
    sd = np.ones((count + 1, 2, 3)) * np.array([0.01, 0.02, 0.03])
    sd[0] *= 2.0
    # The vertical is the largest, and is not to be taken
    sd[-1] *= 50.0
    return xr.Dataset(
        {
            "acceleration": (("horizontal", "time"), motion),
            "sd": (("component", "damping", "period"), sd),
            "per": (("component", "damping", "period"), 2.0 * sd),
            "sampling_interval": interval,
            "shortest_usable_period": 0.1,
            "longest_usable_period": np.nan,
        },
        coords={"period": periods, "damping": [0.05, 0.2]},
        attrs={"horizontals": count},
    )


def test_every_peak_stays_however_short_it_is():
    motion = 0.1 * np.sin(np.linspace(0, 400, 60_000))
    motion[31_234] = 4.56
    motion[40_001] = -3.21
    drawn = drawn_station(station(motion, motion[::-1].copy()))
    assert len(drawn["north"]) == 2 * INTERVALS
    assert max(drawn["north"]) == max(drawn["east"]) == 4.56
    assert min(drawn["north"]) == -3.21
    # The peak lies where it is in time
    place = drawn["start"] + drawn["step"] * (drawn["north"].index(4.56) // 2 + 0.5)
    assert place == pytest.approx(312.34, abs=drawn["step"])


def test_radii_are_those_of_the_larger_horizontal_in_cm():
    drawn = drawn_station(station(np.ones(500), np.ones(500)))
    assert drawn["sd"] == [2.0, 4.0, 6.0]
    assert drawn["per"] == [4.0, 8.0, 12.0]
    assert (drawn["damping"], drawn["period"]) == (0.05, [0.1, 1.0, 10.0])


def test_one_horizontal_and_unknown_numbers_are_json():
    drawn = drawn_station(station(np.zeros(100)))
    assert drawn["east"] == []
    assert drawn["usable"] == [0.1, None]
    json.dumps(drawn, allow_nan=False)
