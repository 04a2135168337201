"""Amplitudes of stations without a record: the list by hand, and pairs that it screens."""

import json

import numpy as np
import pytest
from numpy.testing import assert_allclose
from obspy import UTCDateTime
from obspy.core.event import Catalog, Event, Origin
from obspy.geodetics import locations2degrees
from screening_samples import make_pairs, make_station

from per_obspy.config import Building, Interpolation, Run, Screening, checked
from per_obspy.constants import EARTH_RADIUS, STANDARD_GRAVITY
from per_obspy.errors import CatalogError
from per_obspy.pounding.correlation import ddc_correlation
from per_obspy.pounding.critical_gap import critical_gap
from per_obspy.records.station_list import read_station_list
from per_obspy.runs.screening import ground_of_run
from per_obspy.screening.assignment import stations_of
from per_obspy.screening.risk import risk_rows
from per_obspy.screening.site_motion import RegionalMotion, prepared_field
from per_obspy.screening.station_amplitudes import amplitude_field

#: Amplitudes in per cent of g of both horizontals, and a vertical that is larger.
LARGE = {"sa(0.3)": 90.0, "sa(1.0)": 40.0, "sa(3.0)": 9.0, "pga": 50.0}
SMALL = {"sa(0.3)": 60.0, "sa(1.0)": 45.0, "sa(3.0)": 5.0, "pga": 30.0}
VERTICAL = {"sa(0.3)": 400.0, "sa(1.0)": 400.0, "sa(3.0)": 400.0, "pga": 400.0}

#: A pair on the place of a station.
HERE = {
    "longitude_2": 20.0,
    **dict.fromkeys(("damping_1", "damping_2"), 0.05),
    **dict.fromkeys(("participation_1", "participation_2"), 1.0),
}


def channel(name, values, flag="0", units="%g"):
    amplitudes = [
        {"name": key, "value": value, "units": units, "flag": flag} for key, value in values.items()
    ]
    return {"name": name, "amplitudes": amplitudes}


def feature(code="AMP", place=(20.0, 10.0), channels=None, **facts):
    channels = channels or [channel("HN1", LARGE), channel("HN2", SMALL), channel("HNZ", VERTICAL)]
    known = {"network": "XX", "code": code, "commType": "UNK", "station_type": "seismic"}
    properties = {**known, "vs30": 300.0, "channels": channels, **facts}
    return {"geometry": {"type": "Point", "coordinates": [*place]}, "properties": properties}


def write_list(path, *features):
    path.write_text(json.dumps({"type": "FeatureCollection", "features": features}))
    return path


def screened(path, rows, records=(), screening=None):
    """Return the rows of pairs by records and a list, and the rejections of both."""
    stations, _ = stations_of(records)
    settings = Interpolation()
    field = prepared_field(records, settings) if records else None
    listed, unused = amplitude_field(read_station_list(path), "list", records, settings, None)
    ground = RegionalMotion(stations, field, None, listed)
    table, rejected = risk_rows(make_pairs(rows), ground, Building(), screening or Screening())
    return table, (*unused, *rejected)


def test_the_demand_at_a_station_by_hand(tmp_path):
    # would catch another unit, a vertical, the smaller horizontal, or a wrong line between periods
    path = write_list(tmp_path / "list.json", feature())
    table, rejected = screened(path, [{**HERE, "period_1": 1.0, "period_2": np.sqrt(0.3)}])
    assert not rejected
    row = table.iloc[0]
    sd = {
        period: share * STANDARD_GRAVITY * (period / (2 * np.pi)) ** 2
        for period, share in ((0.3, 0.90), (1.0, 0.45))
    }
    # in the middle of 0.3 and 1 s on logarithmic axes
    middle = np.sqrt(sd[0.3] * sd[1.0])
    assert_allclose([row["sd_1"], row["sd_2"]], [sd[1.0], middle], rtol=1e-9)
    correlation = ddc_correlation(1.0, 0.05, np.sqrt(0.3), 0.05)
    assert_allclose(row["demand"], critical_gap(sd[1.0], middle, correlation), rtol=1e-9)
    # without a record nothing is said that needs one
    assert (row["demand_rule"], row["station"]) == ("amplitudes", "")
    assert "amplitudes_only" in row["flags"].split()
    assert np.isnan(row["per_1"])
    assert np.isnan(row["demand_exact"])


def test_demands_are_less_certain_away_from_periods_and_stations(tmp_path):
    path = write_list(tmp_path / "list.json", feature())
    gap = 10.0 * screened(path, [HERE])[0]["demand"].iloc[0]
    # far above the demand a contact is the more likely, the less is known
    on_period, far, between = (
        screened(path, [{**HERE, "gap": gap, "period_2": 0.3, **change}])[0]["probability"].iloc[0]
        for change in ({}, {"latitude_1": 10.09, "latitude_2": 10.09}, {"period_1": 1.7})
    )
    assert on_period < far
    assert on_period < between


def test_records_win_where_they_are_near(tmp_path):
    # would catch an exact history that a list takes away, and a far record that hides amplitudes
    record = make_station()  # at 20 E, 10 N
    path = write_list(
        tmp_path / "list.json",
        feature("ONE", (20.001, 10.001), network="other"),
        feature("AMP", (20.0, 10.09)),
    )
    rows = [
        HERE,
        {**HERE, "latitude_1": 10.043, "latitude_2": 10.043},  # within flag_distance of the record
        {**HERE, "latitude_1": 10.088, "latitude_2": 10.088},
        {**HERE, "latitude_1": 10.088, "latitude_2": 10.088, "period_1": 0.2},  # outside the list
        {**HERE, "latitude_1": 10.3, "latitude_2": 10.3},  # out of reach of both
    ]
    table, rejected = screened(path, rows, [record])
    rules = table.set_index("pair_id")["demand_rule"]
    assert (rules == "amplitudes").to_dict() == {"P0": False, "P1": False, "P2": True, "P3": False}
    reasons = {row.name: row.reasons for row in rejected}
    assert reasons["other.ONE"] == ("its amplitudes are not needed: XX.ONE has a record there",)
    assert [reason.split(" are ")[0] for reason in reasons["P4"][1:]] == ["nearest amplitudes"]
    # without the record amplitudes serve all of them
    alone, _ = screened(path, rows[:3])
    assert alone["demand_rule"].eq("amplitudes").all()


def with_distances(places, source, depth):
    """Return stations with their distances from a hypocentre, km, to the metre."""
    features = []
    for number, (east, north) in enumerate(places):
        angle = np.radians(locations2degrees(source[1], source[0], north, east))
        repi = round(EARTH_RADIUS * angle / 1000.0, 3)
        known = {"repi": repi, "rhypo": round(float(np.hypot(repi, depth)), 3)}
        features.append(feature(f"S{number}", (east, north), distances=known))
    return features


def test_the_hypocentre_is_that_of_the_event_else_where_distances_begin(tmp_path):
    # catches: exchanged axes, depth in km, a list that wins over the event
    places = [(20.0, 10.0), (20.4, 10.1), (19.8, 9.6), (21.0, 9.0), (20.2, 11.0)]
    stations = with_distances(places, (20.3, 9.9), 12.0)
    path = write_list(tmp_path / "list.json", *stations)
    records = {"stationlist": str(path)}

    def source(**more):
        given = {"name": "a", "output": "o", "records": {**records, **more}}
        settings = checked(Run, {**given, "pairs": {"file": "p.csv"}})
        return ground_of_run(settings, ())[0].amplitudes.source

    # distances have three digits of a km
    assert_allclose(source()[:2], (20.3, 9.9), atol=1e-4)
    assert_allclose(source()[2], 12_000.0, atol=10.0)
    origin = Origin(time=UTCDateTime(0), longitude=20.5, latitude=9.5, depth=7000.0)
    Catalog([Event(origins=[origin])]).write(str(tmp_path / "event.xml"), "QUAKEML")
    assert source(event=str(tmp_path / "event.xml")) == (20.5, 9.5, 7000.0)
    # stations in line, distances of two places, and too few
    line = with_distances([(20.0 + 0.1 * i, 0.0) for i in range(6)], (20.3, 0.5), 12.0)
    mixed = [*stations[:4], *with_distances(places[4:], (25.0, 9.9), 12.0)]
    for features in (line, mixed, stations[:4]):
        write_list(path, *features)
        assert source() is None


def test_pairs_outside_the_given_periods_are_rejected(tmp_path):
    path = write_list(tmp_path / "list.json", feature())
    table, rejected = screened(path, [{**HERE, "period_1": 0.2, "period_2": 0.5}])
    assert table.empty
    expected = "periods 0.2 s and 0.5 s are outside the amplitudes' 0.3 s to 3 s"
    assert [row.reasons for row in rejected] == [(expected,)]


#: Stations of a list that cannot be used -> part of the reason.
HOSTILE = {
    "two periods": (feature(channels=[channel("UNK", {"sa(1.0)": 3.0})]), "at 1 s, two are needed"),
    "flag": (feature(channels=[channel("HN1", LARGE, "Outlier")]), "HN1 sa(0.3): flag Outlier"),
    "unit": (feature(channels=[channel("HN1", LARGE, units="g")]), "sa(0.3): unit 'g', expected"),
    "negative": (feature(channels=[channel("N", {"sa(1)": -1, "sa(3)": 1.0})]), "sa(1) = -1 %g"),
    "too large": (feature(channels=[channel("N", {"sa(1)": 4e3, "sa(3)": 1})]), "sa(1) = 4000"),
    "no number": (feature(channels=[channel("N", {"sa(1)": "x", "sa(3)": 1})]), "sa(1) = 'x' %g"),
    "null": (feature(channels=[channel("N", {"sa(1)": None, "sa(3)": "null"})]), "no period"),
    "no channels": (feature(channels={"a": 1}), "no period"),
    "displacement": (feature(channels=[channel("N", {"sa(1)": 1, "sa(20)": 50})]), "= 49.7 m"),
    "place": (feature(place=(200.0, 10.0)), "coordinates = [200.0, 10.0]"),
    "no place": ({**feature(), "geometry": None}, "coordinates = []"),
    "placeholder": (feature(place=(0, 0)), "0, 0 are a placeholder"),
    "code": (feature("../x"), "station code '../x'"),
    "no properties": ({"type": "Feature"}, "it has no network and code"),
}


@pytest.mark.parametrize(("hostile", "reason"), HOSTILE.values(), ids=HOSTILE)
def test_a_hostile_station_is_a_row_and_the_others_are_used(tmp_path, hostile, reason):
    people = feature("UTM:(59G 063)", station_type="macroseismic")
    found = read_station_list(write_list(tmp_path / "list.json", hostile, people, feature("GOOD")))
    assert [station.name for station in found.stations] == ["XX.GOOD"]
    (row,) = found.rejected
    assert reason in "; ".join(row.reasons)
    assert found.intensities == 1


def test_a_doubtful_channel_is_named_and_the_other_used(tmp_path):
    channels = [channel("HN1", LARGE, "Outlier"), channel("HN2", SMALL)]
    (station,) = read_station_list(
        write_list(tmp_path / "list.json", feature(channels=channels))
    ).stations
    assert station.channels == ("HN2",)
    assert "HN1 sa(0.3): flag Outlier" in station.warnings


@pytest.mark.parametrize(
    "text", ["[]", "{}", '{"features": 3}', '{"features": [', "[" * 100_000, "\xff"]
)
def test_a_file_that_is_no_list(tmp_path, text):
    (tmp_path / "list.json").write_text(text, encoding="latin-1")
    with pytest.raises(CatalogError, match=r"list\.json: (is no list|a damaged station list)"):
        read_station_list(tmp_path / "list.json")
