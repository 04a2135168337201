"""Stations against each other in a run: flags, rejections, trust, resumed and screened again."""

import json
import shutil
from collections import Counter

import numpy as np
import obspy
import pandas as pd
import pytest

from per_obspy.cli.run import print_result
from per_obspy.config import Scenario
from per_obspy.runs.run import report, run, screen
from per_obspy.simulation.earthquake import simulate, write_simulation

from .small_run import InProcess

LARGE, SMALL, COPY, ORIGINAL, LOST_SIGN, EMPTY = (f"XX.S{i:03}" for i in (1, 2, 3, 4, 5, 6))

pytestmark = pytest.mark.usefixtures("plain_reports")

CONFIGURATION = """
name = "compared"
output = "out"
workers = 1
[records]
folder = "records"
event = "records/event.xml"
{trust}
[pairs]
file = "pairs.csv"
[spectra]
count = 40
dampings = [0.05]
azimuth_step = 30
"""


def _write(folder, trust=""):
    """Write the configuration, and return its path."""
    file = folder / "run.toml"
    file.write_text(CONFIGURATION.format(trust=trust))
    return file


def _times(records, code, factor):
    """Multiply the samples of a station's file."""
    path = records / f"{code}.mseed"
    stream = obspy.read(path)
    for trace in stream:
        trace.data = np.asarray(np.round(trace.data * factor), dtype=np.float64)
        trace.stats.mseed.encoding = "FLOAT64"
    stream.write(str(path), format="MSEED")


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    """Twelve simulated stations, six of which are wrong in some way, and one pair at each."""
    folder = tmp_path_factory.mktemp("compared")
    records = folder / "records"
    place = {"latitude": 38.0, "longitude": -122.0}
    places = place | {
        f"{part}_{name}": value for part in ("city", "lakebed") for name, value in place.items()
    }
    scenario = Scenario(stations=12, magnitude=6.0, dt=0.02, seed=4, **places)
    write_simulation(simulate(scenario), records)
    inventory = obspy.read_inventory(records / "stations.xml")
    rows = [
        f"p{station.code},{station.longitude},{station.latitude},"
        f"{station.longitude + 0.0002},{station.latitude},9,12,0.05"
        for station in inventory[0]
    ]
    header = "pair_id,longitude_1,latitude_1,longitude_2,latitude_2,height_1,height_2,gap"
    (folder / "pairs.csv").write_text("\n".join([header, *rows]) + "\n")
    # units, samples of another station, places
    _times(records, LARGE, 1 / 981.0)
    _times(records, SMALL, 0.01)
    stream = obspy.read(records / f"{ORIGINAL}.mseed")
    for trace in stream:
        trace.data = np.asarray(trace.data // 2, dtype=np.int32)
        trace.stats.station = COPY.split(".")[1]
    stream.write(str(records / f"{COPY}.mseed"), format="MSEED")
    for station in inventory[0]:
        name = f"XX.{station.code}"
        east, north = station.longitude, station.latitude
        place = {LOST_SIGN: (-east, north), EMPTY: (0.0, 0.0)}.get(name, (east, north))
        for part in (station, *station):
            part.longitude, part.latitude = place
    inventory.write(str(records / "stations.xml"), format="STATIONXML")
    return folder


@pytest.fixture(scope="module")
def finished(folder):
    """The run without trust: its results, before the next run changes them."""
    result = run(_write(folder), executor=InProcess())
    shutil.copytree(result.folder, folder / "first")
    return result._replace(folder=folder / "first")


def _stations(folder):
    table = pd.read_csv(folder / "stations.csv", keep_default_na=False)
    return table.set_index("station")


def test_good_stations_are_used_without_a_flag(finished):
    table = _stations(finished.folder)
    good = table.drop(index=[LARGE, SMALL, COPY, ORIGINAL, LOST_SIGN, EMPTY])
    assert (good["state"] == "used").all()
    assert not good["flags"].str.contains("implausible|repeated").any()


def test_wrong_stations_are_flagged_or_rejected_with_figures(finished):
    table = _stations(finished.folder)
    assert table["state"].to_dict().items() >= {
        LARGE: "rejected", SMALL: "used", COPY: "used",
        ORIGINAL: "used", LOST_SIGN: "rejected", EMPTY: "rejected",
    }.items()  # fmt: skip
    assert "implausible_amplitude" in table.loc[SMALL, "flags"]
    assert "deviations, as by a wrong unit (m/s2 taken for cm/s2)" in table.loc[SMALL, "warnings"]
    assert "repeated_record" in table.loc[COPY, "flags"]
    assert f"its record is that of {COPY}" in table.loc[ORIGINAL, "warnings"]
    assert finished.record["warnings"]["implausible_amplitude"] == [SMALL]


def test_rejected_stations_are_rows_with_the_way_to_lift_them(finished):
    rejected = pd.read_csv(finished.folder / "rejected.csv").set_index("name")["reasons"]
    for name, part in {
        LARGE: "as by a wrong unit (g taken for cm/s2)",
        LOST_SIGN: "km from it, as by a lost sign",
        EMPTY: "coordinates 0, 0 are an empty field",
    }.items():
        assert part in rejected[name]
        assert f'records.trust = ["{name}"]' in rejected[name]
    # no pair has their records
    risk = pd.read_parquet(finished.folder / "risk.parquet")
    assert not {LARGE, LOST_SIGN, EMPTY} & set(risk["station"])
    facts = finished.record["stations"]
    assert set(facts["rejected"]) == {LARGE, LOST_SIGN, EMPTY}
    assert finished.record["partial"]


def test_pairs_have_the_flags_of_their_station(finished):
    risk = pd.read_parquet(finished.folder / "risk.parquet")
    for flag, names in {
        "implausible_amplitude": {SMALL},
        "repeated_record": {COPY, ORIGINAL},
    }.items():
        flagged = risk["flags"].str.split().map(lambda flags, flag=flag: flag in flags)
        assert set(risk.loc[flagged, "station"]) == names
        assert flagged.sum() == risk["station"].isin(names).sum()


@pytest.fixture(scope="module")
def trusted(folder, finished):
    """The next run, of which one rejection is lifted."""
    assert finished.record["trusted"] == {"kept": [], "plausible": [], "unknown": []}
    trust = f'trust = ["{LARGE}", "XX.S012", "XX.NONE"]'
    return run(_write(folder, trust), executor=InProcess())


def test_trust_lifts_a_rejection_by_name_and_keeps_the_flag(trusted, capsys):
    # the two trusted stations are processed again, as their checks of plausibility only warn
    assert trusted.record["counts"]["stations_resumed"] == 10
    assert trusted.record["trusted"] == {
        "kept": [LARGE], "plausible": ["XX.S012"], "unknown": ["XX.NONE"],
    }  # fmt: skip
    table = _stations(trusted.folder)
    assert table.loc[LARGE, "state"] == "used"
    assert "implausible_amplitude" in table.loc[LARGE, "flags"].split()
    assert table.loc[LOST_SIGN, "state"] == "rejected"
    risk = pd.read_parquet(trusted.folder / "risk.parquet")
    assert risk.loc[risk["station"] == LARGE, "flags"].str.contains("implausible_amplitude").all()
    assert (risk["station"] == LARGE).any()
    print_result(trusted)
    printed = capsys.readouterr().out
    assert f"used although implausible (records.trust): {LARGE}" in printed
    assert "records.trust: no records of XX.NONE" in printed
    assert "2 stations with an implausible amplitude (XX.S001, XX.S002)" in printed


def test_a_run_is_up_to_date_and_its_stations_are_whole(folder, trusted):
    again = run(folder / "run.toml", executor=InProcess())
    assert again.did_nothing
    assert again.record["trusted"] == trusted.record["trusted"]


def test_screening_again_compares_the_stations_again(folder, trusted):
    before = _stations(trusted.folder)
    screened = screen(folder / "run.toml", executor=InProcess())
    assert screened.record["trusted"] == trusted.record["trusted"]
    pd.testing.assert_frame_equal(_stations(screened.folder), before)
    # nothing has changed for any chunk
    counts = screened.record["counts"]
    assert counts["chunks_resumed"] == counts["chunks"]


def test_a_chunk_is_computed_again_when_flags_change(folder, trusted):
    # would catch: pairs of a resumed chunk without the flags that another station brings
    first = json.loads((folder / "first" / "run.json").read_text())
    assert first["counts"]["chunks_resumed"] == 0
    assert trusted.record["counts"]["chunks_resumed"] == 0


def test_a_report_has_the_same_stations(folder, trusted):
    names = Counter(trusted.record["outputs"])
    assert Counter(report(folder / "run.toml").record["outputs"]) == names
