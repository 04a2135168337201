"""Table of stations: one row per station, with used records, rejections and warnings."""

import numpy as np
import pandas as pd
import pytest
from obspy import Stream, Trace
from obspy.core import AttribDict

import per_obspy
from per_obspy.constants import EARTH_RADIUS
from per_obspy.errors import Rejection
from per_obspy.results.station_summary import COLUMNS, station_table, write_stations

PERIODS = [0.2, 0.5]


def _station(name, channels=("HNN", "HNE", "HNZ"), coordinates=True, **known):
    """Return the Dataset of a station whose acceleration is A w cos(w t), A = 0.1 m/s."""
    time = np.arange(0.0, 20.0, 0.01)
    motion = 0.1 * 2.0 * np.pi * np.cos(2.0 * np.pi * time)
    # Corners differ by component
    traces = []
    for i, channel in enumerate(channels, start=1):
        header = {
            "network": "XX",
            "station": name,
            "channel": channel,
            "delta": 0.01,
            "units": "m/s2",
            "source": f"folder/{name}.mseed",
            "per_obspy": AttribDict(
                highpass=0.1 * i, highpass_source="noise", lowpass=20.0 / i, longest_period=4.0
            ),
        }
        header["per_obspy"].update(known)
        if coordinates:
            header["coordinates"] = AttribDict(latitude=10.0, longitude=20.0, elevation=30.0)
        traces.append(Trace(motion / i, header))
    # As a job of a station notes the earthquake
    dataset = per_obspy.station_spectra(Stream(traces), PERIODS)
    dataset.attrs |= {
        "hypocentre_longitude": 20.0,
        "hypocentre_latitude": 11.0,
        "hypocentre_depth": 10e3,
    }
    return dataset


def _table(*stations, rejected=(), pairs=None):
    return station_table(stations, rejected, pairs or {}).set_index("station")


def test_a_row_has_what_was_used():
    row = _table(_station("ONE"), pairs={"XX.ONE": 7}).loc["XX.ONE"]
    assert (row["state"], row["pairs"], row["flags"]) == ("used", 7, "")
    # step 0.01 s of a sine of 1 s: the peak between samples is off by (w dt)^2 / 8 = 5e-4
    assert (row["pga"], row["pgv"]) == pytest.approx((0.1 * 2.0 * np.pi, 0.1), rel=1e-3)
    # the narrower band of the two horizontals: the first has 0.1 to 20 Hz, the second 0.2 to 10 Hz
    assert (row["highpass"], row["lowpass"], row["longest_usable_period"]) == (0.2, 10.0, 4.0)
    assert row["highpass_source"] == "noise"
    assert row["components"] == "HNE HNN HNZ" or row["components"] == "HNN HNE HNZ"
    assert (row["source_files"], row["record_level"]) == ("ONE.mseed", "raw")
    # one degree of latitude, and a depth of 10 km
    degree = EARTH_RADIUS * np.pi / 180.0
    assert row["epicentral_distance"] == pytest.approx(degree, rel=1e-12)
    assert row["hypocentral_distance"] == pytest.approx(np.hypot(degree, 10e3), rel=1e-12)
    assert np.isnan(row["vs30"])


def test_every_warning_is_there():
    known = {"record_flags": "second_event", "warnings": "another event: 0.5", "notes": "short"}
    row = _table(_station("ONE", channels=("HNN", "HNZ"), **known)).loc["XX.ONE"]
    assert row["flags"] == "second_event one_horizontal"
    assert row["warnings"] == "HNN: another event: 0.5; HNZ: another event: 0.5"
    assert row["notes"] == "HNN: short; HNZ: short"


def test_rejected_stations_have_their_reasons():
    rejected = [
        Rejection("file", "a.txt", "a.txt", None, ("unknown format",)),
        Rejection("record", "XX.TWO..HNN", "two", None, ("clipped", "too short")),
        Rejection("record", "XX.TWO..HNE", "two", None, ("clipped",)),
        Rejection("record", "XX.ONE..HNZ", "one", None, ("spike",)),
        Rejection("station", "XX.LOST", "", None, ("its coordinates are unknown",)),
    ]
    unplaced = _station("LOST", coordinates=False)
    table = _table(_station("ONE"), unplaced, rejected=rejected)
    assert table["state"].to_dict() == {
        "XX.LOST": "rejected",
        "XX.ONE": "used",
        "XX.TWO": "rejected",
    }
    assert table.loc["XX.TWO", "rejected"] == "HNN: clipped; too short; HNE: clipped"
    # a component that was left out of a station that is used
    assert table.loc["XX.ONE", "rejected"] == "HNZ: spike"
    assert table["pairs"].tolist() == [0, 0, 0]
    assert np.isnan(table.loc["XX.TWO", "pga"])


def test_without_stations_the_table_is_empty(tmp_path):
    summary = write_stations([], [], {}, tmp_path)
    assert pd.read_csv(summary.files[0]).columns.tolist() == list(COLUMNS)
    assert summary.warnings == {}


def test_hostile_text_of_headers_breaks_no_table(tmp_path):
    hostile = _station(
        "ONE", warnings='=HYPERLINK("http://x")\r\n@a,"b"', record_flags="second_event"
    )
    hostile["warnings"] = ((), "=1+1")
    hostile["site_class"] = ((), "@soft\nrock")
    rejected = [Rejection("station", "=1.2", "+cmd", None, ("-x\r\ny",))]
    summary = write_stations([hostile], rejected, {}, tmp_path)
    assert summary.warnings == {"second_event": ["XX.ONE"]}
    # One line per station, and no cell that begins a formula
    rows = (tmp_path / "stations.csv").read_text(encoding="utf-8").splitlines()
    assert len(rows) == 3
    table = pd.read_csv(tmp_path / "stations.csv", keep_default_na=False).set_index("station")
    assert table.loc["XX.ONE", "warnings"] == "'=1+1"
    assert table.loc["XX.ONE", "site_class"] == "'@soft rock"
    assert table.loc["'=1.2", "rejected"] == "'-x  y"


def test_every_column_is_explained(tmp_path):
    write_stations([_station("ONE")], [], {}, tmp_path)
    columns = pd.read_csv(tmp_path / "stations.columns.csv", keep_default_na=False)
    assert columns["name"].tolist() == list(pd.read_csv(tmp_path / "stations.csv").columns)
    assert columns["meaning"].str.len().min() > 5
