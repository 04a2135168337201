"""What is wrong with later stages stops a run before its first record is read."""

import shutil
import sys

import pytest

from per_obspy.config import Run, load
from per_obspy.errors import CatalogError, MissingExtra
from per_obspy.pipeline.preflight import check_inputs
from per_obspy.pipeline.run import report, run, screen

from .small_run import write_configuration

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
    "missing column": (HEADER.replace("gap", "Gap") + "\n", PAIRS, "missing column gap"),
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
        check_inputs(load(tmp_path / "run.toml", Run))


def test_a_whole_table_passes(tmp_path):
    (tmp_path / "pairs.csv").write_text(f"{HEADER}a,0,0,10,0,0,12,0.1\n")
    (tmp_path / "run.toml").write_text(RECORDS + PAIRS)
    check_inputs(load(tmp_path / "run.toml", Run))
    with pytest.raises(CatalogError, match="absent: no such folder or file"):
        run(tmp_path / "run.toml")
    shutil.rmtree(tmp_path / "out")
