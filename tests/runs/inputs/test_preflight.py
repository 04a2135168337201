"""
Faults of later stages stop a run before its first record is read.

Covers per_obspy.runs.inputs.extras too: libraries that are not installed.
"""

import datetime
import shutil
import sys
import threading
import time

import pytest

from per_obspy.config import Run, load
from per_obspy.errors import CatalogError, MissingExtra
from per_obspy.inventory.catalogue import Origin, add_inventory
from per_obspy.runs import stages
from per_obspy.runs.ensemble import screen_scenarios
from per_obspy.runs.pairs import check_inputs
from per_obspy.runs.run import report, run, screen
from per_obspy.screening import warmup

from ..small_run import write_configuration

PAIRS = '[pairs]\nfile = "pairs.csv"\n'
HEADER = "pair_id,longitude_1,latitude_1,height_1,longitude_2,latitude_2,height_2,gap\n"
RECORDS = 'name = "x"\noutput = "out"\n[records]\nfolder = "absent"\n'


@pytest.mark.parametrize(
    ("before", "after", "missing"),
    [("", "[totals]\nh3 = 8\n", "h3"), ("geopackage = true\n", "", "pyogrio")],
)
def test_a_missing_extra_is_named_before_anything_is_computed(
    tmp_path, monkeypatch, before, after, missing
):
    # would catch a run of an hour that ends with this
    write_configuration(tmp_path, f"{before}{PAIRS}{after}")
    files = sorted(tmp_path.rglob("*"))
    monkeypatch.setitem(sys.modules, missing, None)
    reason = rf"{missing} not installed: pip install 'per_obspy\[gis\]'"
    for stage in (run, screen, report):
        with pytest.raises(MissingExtra, match=reason):
            stage(tmp_path / "run.toml")
    assert sorted(tmp_path.rglob("*")) == files


FAULTS = {
    "no table": ("", PAIRS, r"pairs\.csv: no such file"),
    "missing column": (HEADER.replace("gap", "ward") + "\n", PAIRS, "missing column gap"),
    "no catalog": ("", '[pairs]\ncatalog = "none.toml"\nnames = ["x"]\n', r"none\.toml"),
    "no map": (HEADER, f'shakemap = "grid.xml"\n{PAIRS}', r"grid\.xml"),
}


@pytest.mark.parametrize("fault", FAULTS)
def test_wrong_inputs_are_found_before_records(tmp_path, fault):
    # the folder of records is missing too, which is found later
    table, text, reason = FAULTS[fault]
    if table:
        (tmp_path / "pairs.csv").write_text(table)
    (tmp_path / "run.toml").write_text(RECORDS + text)
    with pytest.raises(CatalogError, match=reason):
        check_inputs(load(tmp_path / "run.toml", Run), tmp_path / "out")


def test_a_whole_table_passes(tmp_path):
    (tmp_path / "pairs.csv").write_text(f"{HEADER}a,0,0,10,0,0,12,0.1\n")
    (tmp_path / "run.toml").write_text(RECORDS + PAIRS)
    check_inputs(load(tmp_path / "run.toml", Run), tmp_path / "out")
    with pytest.raises(CatalogError, match="absent: no such folder or file"):
        run(tmp_path / "run.toml")
    shutil.rmtree(tmp_path / "out")


AREA = '[totals]\narea = "district"\n'


@pytest.mark.parametrize("source", ["file", "names", "catalog", "simulated"])
def test_an_area_that_the_pairs_lack_is_found_before_records(tmp_path, source):
    # would catch a run that does all stations and then ends with this
    (tmp_path / "pairs.csv").write_text(f"{HEADER}a,0.1,0.1,10,0.1001,0.1,12,0.1\n")
    origin = Origin("x", "by hand", "CC0-1.0", datetime.date(2026, 1, 1))
    add_inventory(tmp_path / "catalog.toml", tmp_path / "pairs.csv", origin)
    pairs = {
        "file": PAIRS,
        "names": '[pairs]\ncatalog = "catalog.toml"\nnames = ["x"]\n',
        "catalog": '[pairs]\ncatalog = "catalog.toml"\n',
        "simulated": "[pairs.simulated]\ncount = 10\n",
    }[source]
    (tmp_path / "run.toml").write_text(RECORDS + pairs + AREA)
    with pytest.raises(CatalogError, match="totals: area: the pair table has no column 'district'"):
        check_inputs(load(tmp_path / "run.toml", Run), tmp_path / "out")
    (tmp_path / "run.toml").write_text(RECORDS + pairs + AREA.replace("district", "gap"))
    check_inputs(load(tmp_path / "run.toml", Run), tmp_path / "out")


def test_an_ensemble_checks_all_its_runs_before_the_first(tmp_path):
    write_configuration(tmp_path)
    # The second of two runs lacks the area
    wrong = (tmp_path / "run.toml").read_text().replace('"out"', '"other"') + AREA
    (tmp_path / "wrong.toml").write_text(wrong)
    scenarios = [
        f'[[scenario]]\nname = "{name}"\nrun = "{name}.toml"\nweight = 0.5\n'
        for name in ("run", "wrong")
    ]
    (tmp_path / "ensemble.toml").write_text('name = "e"\noutput = "joined"\n' + "".join(scenarios))
    with pytest.raises(CatalogError, match="no column 'district'"):
        screen_scenarios(tmp_path / "ensemble.toml")
    assert not (tmp_path / "out").exists()


def test_no_thread_is_alive_after_a_run_that_fails(tmp_path, monkeypatch):
    # would catch an interpreter that aborts at its end because a thread still compiles
    write_configuration(tmp_path)
    monkeypatch.setattr(warmup, "compile_screening", lambda: time.sleep(0.5))

    def fails(*_):
        raise CatalogError("stations", "no luck")

    monkeypatch.setattr(stages, "finished_stations", fails)
    before = set(threading.enumerate())
    with pytest.raises(CatalogError, match="no luck"):
        run(tmp_path / "run.toml")
    assert set(threading.enumerate()) <= before
