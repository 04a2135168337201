"""Stations against each other: wrong places, records of other stations, what is said of them."""

import time

import numpy as np
import pytest
import xarray as xr

from per_obspy.screening.amplitudes import Earthquake
from per_obspy.screening.station_comparison import compare_stations

PERIODS = np.geomspace(0.05, 10.0, 60)
NOWHERE = Earthquake()


def station(number, longitude, latitude, pga=1.0, shape=None):
    """Return the spectra of a station with a shape of its own, without motion."""
    random = np.random.default_rng(number)
    per = np.exp(random.normal(scale=0.5, size=(3, 1, 60))) if shape is None else shape
    return xr.Dataset(
        {
            "per": (("component", "damping", "period"), per),
            "pga": ("component", [pga, 0.9 * pga, 0.5 * pga]),
            "pgv": ("component", [0.1 * pga, 0.09 * pga, 0.05 * pga]),
            "vs30": np.nan,
            "site_class": "",
        },
        coords={
            "period": PERIODS,
            "damping": [0.05],
            "station": f"XX.S{number}",
            "longitude": longitude,
            "latitude": latitude,
        },
        attrs={"horizontals": 2},
    )


def places(middle, size=8):
    """Return places within 0.4 degrees of a middle."""
    random = np.random.default_rng(1)
    return [tuple(np.array(middle) + random.uniform(-0.4, 0.4, 2)) for _ in range(size)]


def flags(stations, source=NOWHERE):
    """Return the flags of stations, and whether they are rejected."""
    found = compare_stations(stations, source)
    return {name: (one.flags, bool(one.rejected)) for name, one in found.items()}


PLACE = "implausible_place"


@pytest.mark.parametrize("middle", [(-117.6, 35.8), (172.6, -43.5), (29.0, 41.0), (-71.6, -33.6)])
@pytest.mark.parametrize(
    "reading",
    [
        lambda east, north: (north, east),
        lambda east, north: (-east, north),
        lambda east, north: (east, -north),
        lambda east, north: (abs(north), abs(east)),
        lambda east, north: (abs(east), abs(north)),
        lambda *_: (0.0, 0.0),
    ],
)
def test_exchanged_coordinates_and_lost_signs_are_seen(middle, reading):
    around = places(middle)
    wrong = reading(*around[3])
    if wrong == around[3] or abs(wrong[1]) > 90.0:
        return  # no error, or one that no reader takes
    around[3] = wrong
    found = compare_stations([station(i, *place) for i, place in enumerate(around)], NOWHERE)
    assert list(found) == ["XX.S3"]
    assert found["XX.S3"].flags == (PLACE,)
    assert found["XX.S3"].rejected == found["XX.S3"].warnings
    # the sentence has the right place
    if wrong != (0.0, 0.0):
        east, north = places(middle)[3]
        assert f"{north:.4f}, {east:.4f} would be" in found["XX.S3"].rejected[0]


def test_two_exchanged_of_eight_do_not_move_the_middle():
    around = places((29.0, 41.0))
    around[1], around[6] = around[1][::-1], around[6][::-1]
    expected = ((PLACE,), True)
    stations = [station(i, *place) for i, place in enumerate(around)]
    assert flags(stations) == {"XX.S1": expected, "XX.S6": expected}


def test_a_station_far_away_is_no_error_by_itself():
    # a station of a global network: no other reading of its place is near
    around = [*places((29.0, 41.0)), (11.3, 47.9)]
    assert not flags([station(i, *place) for i, place in enumerate(around)])


def test_stations_on_both_sides_of_the_equator_and_of_greenwich_are_no_error():
    around = [(-0.3, 0.2), (0.4, -0.3), (0.1, 0.5), (-0.2, -0.4), (0.3, 0.3), (0.0, 0.1)]
    assert not flags([station(i, *place) for i, place in enumerate(around)])


def test_stations_around_180_degrees_are_near_to_each_other():
    around = [(179.8, -17.0), (-179.9, -17.2), (179.5, -16.9), (-179.6, -17.1), (179.9, -17.3)]
    assert not flags([station(i, *place) for i, place in enumerate(around)])


def test_an_epicentre_alone_flags_and_does_not_reject():
    exchanged = station(1, 35.8, -117.6 + 180.0), station(2, 117.6, 35.8)
    found = flags(exchanged[1:], Earthquake(-117.6, 35.8, 8000.0, 7.1))
    assert found == {"XX.S2": ((PLACE,), False)}
    assert not flags(exchanged[1:])


def test_stations_of_unknown_place_are_left_out():
    assert not flags([station(1, np.nan, np.nan), station(2, np.nan, np.nan)])
    assert not flags([])


@pytest.mark.parametrize("factor", [1.0, 0.37, 100.0])
def test_the_record_of_another_station_is_seen_whatever_its_scale(factor):
    around = places((29.0, 41.0))
    stations = [station(i, *place) for i, place in enumerate(around)]
    shape = factor * stations[2]["per"].to_numpy()
    # components in another order, and one of its own
    own = stations[5]["per"].to_numpy()[:1]
    copy = np.concatenate([shape[1:2], shape[:1], own])
    stations[5] = station(5, *around[5], shape=copy)
    found = compare_stations(stations, NOWHERE)
    assert set(found) == {"XX.S2", "XX.S5"}
    assert found["XX.S5"].flags == ("repeated_record",)
    assert "is that of XX.S2" in found["XX.S5"].warnings[0]
    assert not found["XX.S5"].rejected


def test_two_codes_of_one_instrument_are_no_error():
    around = places((29.0, 41.0))
    stations = [station(i, *place) for i, place in enumerate(around)]
    east, north = around[2]
    same = station(9, east + 0.001, north, shape=stations[2]["per"].to_numpy())
    assert not flags([*stations, same])


def test_records_of_one_shape_within_a_few_percent_are_not_the_same():
    # sensors a few kilometres apart differ more at some period
    around = places((29.0, 41.0))
    stations = [station(i, *place) for i, place in enumerate(around)]
    bent = stations[2]["per"].to_numpy() * (1.0 + 0.1 * np.sin(np.log(PERIODS)))
    stations[5] = station(5, *around[5], shape=bent)
    assert not flags(stations)


def test_many_stations_take_bounded_time():
    # 600 stations, 1 800 components: 0.6 s on the machine of 26 November 2026, 20 times that here
    random = np.random.default_rng(2)
    around = random.uniform((140.0, 35.0), (143.0, 38.0), (600, 2))
    stations = [station(i, *place) for i, place in enumerate(around)]
    began = time.process_time()
    assert not flags(stations)
    assert time.process_time() - began < 12.0


def test_everything_about_a_station_is_said_at_once():
    around = places((29.0, 41.0))
    stations = [station(i, *place) for i, place in enumerate(around)]
    stations[5] = station(5, *around[5], pga=981.0, shape=stations[2]["per"].to_numpy())
    # 80 km away: peaks of all are about equal
    found = compare_stations(stations, Earthquake(28.0, 41.0, 1e4, 6.0))["XX.S5"]
    assert found.flags == ("implausible_amplitude", "repeated_record")
    assert len(found.warnings) == 2
    assert found.rejected == found.warnings[:1]
