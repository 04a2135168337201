"""Screening in chunks: results do not depend on them, only what has changed is done again, each stage works alone."""

import json
import re
import shutil
import sys

import numpy as np
import pandas as pd
import pyogrio
import pytest
from numpy.testing import assert_allclose

from per_obspy import read_pairs, risk_table
from per_obspy.errors import CatalogError, MissingExtra
from per_obspy.inventory.catalogue import Origin, add_inventory
from per_obspy.jobs import chunk
from per_obspy.pipeline.run import report, run, screen
from per_obspy.screening.ground_motion.site_motion import HYPOCENTRE
from per_obspy.spectra.storage import read_spectra

from .test_run import SPECTRA, Here, _configuration

RESULTS = ("risk.csv", "risk.parquet", "risk.columns.csv", "rejected.csv", "totals.csv")


@pytest.fixture(scope="module")
def finished(tmp_path_factory):
    """A run whose inventory has rows that are rejected, in one chunk."""
    folder = tmp_path_factory.mktemp("chunks")
    run(_configuration(folder), executor=Here())
    shutil.copy(folder / "out" / "pairs.csv", folder / "pairs.csv")
    lines = (folder / "pairs.csv").read_text().splitlines()
    lines[20] = lines[20].replace(lines[20].split(",")[0], lines[3].split(",")[0])
    lines[41] = "broken,1"
    (folder / "pairs.csv").write_text("\n".join([*lines, lines[1]]) + "\n")
    _configuration(folder, '[pairs]\nfile = "pairs.csv"\n')
    return folder, run(folder / "run.toml", executor=Here())


@pytest.fixture
def copied(finished, tmp_path):
    shutil.copytree(finished[0], tmp_path, dirs_exist_ok=True)
    return tmp_path


def _bytes(folder):
    """Return the results; rejections name files, whose folder does not matter."""
    return {
        name: re.sub(rb"[^,\n]*/pairs.csv", b"", (folder / "out" / name).read_bytes())
        for name in RESULTS
    }


def test_the_function_gives_the_table_of_the_run(finished):
    # would catch: a hypocentre that only the run knows
    folder, _ = finished
    shards = sorted((folder / "out" / "stations").rglob("*.nc"))
    spectra = [read_spectra(shard) for shard in shards]
    assert len(spectra) == 3
    assert all(HYPOCENTRE[0] in station.attrs for station in spectra)
    table = risk_table(spectra, read_pairs(folder / "pairs.csv")).set_index("pair_id")
    ran = pd.read_csv(folder / "out" / "risk.csv").set_index("pair_id")
    assert table.index.tolist() == ran.index.tolist()
    numbers = [name for name in ran if pd.api.types.is_numeric_dtype(ran[name])]
    assert "probability" in numbers
    # risk.csv has nine digits
    expected = table[numbers].to_numpy(np.float64)
    assert_allclose(ran[numbers].to_numpy(np.float64), expected, rtol=1e-8, atol=1e-12)


@pytest.mark.parametrize("size", [1, 7, 25])
def test_results_do_not_depend_on_chunks(copied, monkeypatch, size):
    # would catch sums, ranks or names that depend on where a chunk ends
    before = _bytes(copied)
    monkeypatch.setattr("per_obspy.pipeline.screening.CHUNK", size)
    shutil.rmtree(copied / "out" / "chunks")
    result = screen(copied / "run.toml", executor=Here())
    assert result.record["counts"]["chunks"] == -(-60 // size)  # 61 lines, one of them no row
    assert _bytes(copied) == before


def test_results_do_not_depend_on_workers(copied, monkeypatch):
    before = _bytes(copied)
    monkeypatch.setattr("per_obspy.pipeline.screening.CHUNK", 20)
    screen(copied / "run.toml")
    assert _bytes(copied) == before


def test_only_a_chunk_that_changed_is_done_again(copied, monkeypatch):
    monkeypatch.setattr("per_obspy.pipeline.screening.CHUNK", 20)
    assert run(copied / "run.toml", executor=Here()).did_nothing
    screen(copied / "run.toml", executor=Here())
    text = (copied / "pairs.csv").read_text().splitlines()
    header, row = text[0].split(","), text[30].split(",")
    row[header.index("gap")] = "0.123"
    (copied / "pairs.csv").write_text("\n".join([*text[:30], ",".join(row), *text[31:]]) + "\n")
    result = run(copied / "run.toml", executor=Here())
    counts = result.record["counts"]
    assert (counts["stations_resumed"], counts["chunks"], counts["chunks_resumed"]) == (3, 3, 2)
    table = pd.read_parquet(copied / "out" / "risk.parquet").set_index("pair_id")
    assert table.loc[row[header.index("pair_id")], "gap"] == 0.123
    assert not list((copied / "out" / "chunks").glob("00000[3-9]*"))


def test_a_damaged_part_is_done_again(copied):
    before = _bytes(copied)
    part = copied / "out" / "chunks" / "000000.parquet"
    part.write_bytes(part.read_bytes()[:-9])
    assert screen(copied / "run.toml", executor=Here()).record["counts"]["chunks_resumed"] == 0
    assert _bytes(copied) == before


def test_parts_of_a_longer_inventory_are_forgotten(copied, monkeypatch):
    monkeypatch.setattr("per_obspy.pipeline.screening.CHUNK", 20)
    screen(copied / "run.toml", executor=Here())
    (copied / "pairs.csv").write_text(
        "\n".join((copied / "pairs.csv").read_text().splitlines()[:11]) + "\n"
    )
    result = screen(copied / "run.toml", executor=Here())
    assert result.record["counts"]["pairs"] == 10
    assert [path.name for path in sorted((copied / "out" / "chunks").iterdir())] == [
        "000000.json",
        "000000.parquet",
    ]


def test_a_pair_that_cannot_be_computed_is_lost_alone(copied, monkeypatch):
    # would catch one row that takes its chunk with it
    real = chunk.risk_rows
    victim = pd.read_csv(copied / "pairs.csv")["pair_id"].iloc[4]

    def fails_for_one(pairs, *others):
        if (pairs["pair_id"] == victim).any():
            raise ValueError("period_1 is not to my taste")
        return real(pairs, *others)

    monkeypatch.setattr(chunk, "risk_rows", fails_for_one)
    shutil.rmtree(copied / "out" / "chunks")
    before = len(pd.read_parquet(copied / "out" / "risk.parquet"))
    result = screen(copied / "run.toml", executor=Here())
    assert result.record["counts"]["pairs"] == before - 1
    rejected = pd.read_csv(copied / "out" / "rejected.csv").set_index("name")
    assert rejected.loc[victim, "reasons"] == "period_1 is not to my taste"


def test_a_worker_that_fails_leaves_a_reason_for_every_pair(copied, monkeypatch):
    def fails(_):
        raise MemoryError("no more")

    monkeypatch.setattr(chunk, "do_chunk", fails)
    shutil.rmtree(copied / "out" / "chunks")
    result = screen(copied / "run.toml", executor=Here())
    assert result.record["state"] == "nothing_usable"
    assert (
        pd.read_csv(copied / "out" / "rejected.csv")["reasons"].eq("MemoryError: no more").sum()
        == 60
    )
    monkeypatch.undo()
    assert screen(copied / "run.toml", executor=Here()).record["counts"]["chunks_resumed"] == 0


def test_after_screening_alone_a_run_looks_at_everything_again(copied):
    screen(copied / "run.toml", executor=Here())
    assert not run(copied / "run.toml", executor=Here()).did_nothing
    assert run(copied / "run.toml", executor=Here()).did_nothing


def test_a_report_alone_makes_its_files_again(copied):
    (copied / "out" / "figures" / "overview.png").unlink()
    (copied / "out" / "totals.csv").unlink()
    before = json.loads((copied / "out" / "run.json").read_text())
    report(copied / "run.toml")
    assert json.loads((copied / "out" / "run.json").read_text()) == before
    assert run(copied / "run.toml", executor=Here()).did_nothing


def test_stages_say_what_they_lack(copied):
    (copied / "out" / "risk.parquet").write_bytes(b"nothing")
    with pytest.raises(CatalogError, match="not as the run left it"):
        report(copied / "run.toml")
    (copied / "out" / "run.json").unlink()
    with pytest.raises(CatalogError, match="no finished run here"):
        report(copied / "run.toml")
    next((copied / "out" / "stations").glob("*.nc")).write_bytes(b"nothing")
    with pytest.raises(CatalogError, match="damaged"):
        screen(copied / "run.toml", executor=Here())
    shutil.rmtree(copied / "out" / "stations")
    with pytest.raises(CatalogError, match="no stations here"):
        screen(copied / "run.toml", executor=Here())


def test_a_large_table_has_only_its_worst_rows_as_text(copied):
    _configuration(copied, 'csv_rows = 5\n[pairs]\nfile = "pairs.csv"\n')
    run(copied / "run.toml", executor=Here())
    whole = pd.read_parquet(copied / "out" / "risk.parquet")
    worst = pd.read_csv(copied / "out" / "risk.csv", dtype={"pair_id": str})
    assert worst["pair_id"].tolist() == whole["pair_id"].tolist()[:5]


def test_an_area_that_the_inventory_does_not_name(copied):
    _configuration(copied, '[pairs]\nfile = "pairs.csv"\n[totals]\narea = "ward"\n')
    with pytest.raises(CatalogError, match="area: the pair table has no column 'ward'"):
        run(copied / "run.toml", executor=Here())


def test_stored_inventories_are_found_by_name_and_by_region(copied):
    pairs = pd.read_csv(copied / "pairs.csv", dtype=str, on_bad_lines="skip").dropna(
        subset="latitude_2"
    )
    pairs = pairs.drop_duplicates("pair_id")
    far = pairs.assign(longitude_1="10", longitude_2="10.0001", pair_id="far" + pairs["pair_id"])
    for name, table in {"here": pairs.iloc[:30], "too": pairs.iloc[30:], "far": far}.items():
        table.to_csv(copied / f"{name}.csv", index=False)
        origin = Origin(name, "a test", "none", pd.Timestamp("2026-01-01").date())
        add_inventory(copied / "catalog.toml", copied / f"{name}.csv", origin)
    _configuration(copied, '[pairs]\ncatalog = "catalog.toml"\nnames = ["too"]\n')
    named = run(copied / "run.toml", executor=Here()).record["counts"]
    assert named["pairs"] == len(pairs) - 30
    _configuration(copied, '[pairs]\ncatalog = "catalog.toml"\n')
    touched = run(copied / "run.toml", executor=Here()).record["counts"]
    assert touched["pairs"] == len(pairs)
    assert touched["rejected_pair"] == 0  # the far one was not even read
    (copied / "here.csv").write_text("changed")
    with pytest.raises(CatalogError, match="changed or damaged since it was stored as 'here'"):
        run(copied / "run.toml", executor=Here())
    _configuration(copied, '[pairs]\ncatalog = "catalog.toml"\nnames = ["elsewhere"]\n')
    with pytest.raises(CatalogError, match="'elsewhere' is not stored here"):
        run(copied / "run.toml", executor=Here())


def _shakemap(path, longitudes=(-0.5, 0.3, 1.1), latitudes=(0.5, 0.0, -0.5)):
    """Write a ShakeMap with the same motion everywhere, in % g."""
    names = ("LON", "LAT", "PGA", "PSA03", "PSA10", "PSA30")
    units = dict.fromkeys(names, "pctg") | {"LON": "dd", "LAT": "dd"}
    fields = "".join(
        f'<grid_field index="{i}" name="{name}" units="{units[name]}"/>'
        for i, name in enumerate(names, start=1)
    )
    rows = "\n".join(f"{east} {north} 20 50 25 6" for north in latitudes for east in longitudes)
    size = f'nlon="{len(longitudes)}" nlat="{len(latitudes)}" nominal_lon_spacing="0.8" nominal_lat_spacing="0.5"'
    box = f'lon_min="{longitudes[0]}" lat_min="{latitudes[-1]}" lon_max="{longitudes[-1]}" lat_max="{latitudes[0]}"'
    head = '<shakemap_grid xmlns="http://earthquake.usgs.gov/eqcenter/shakemap" event_id="x" shakemap_event_type="ACTUAL">'
    path.write_text(
        f"{head}<grid_specification {box} {size}/>{fields}<grid_data>\n{rows}\n</grid_data></shakemap_grid>"
    )


@pytest.mark.parametrize("reach", [300.0, 1.0])
def test_a_map_serves_pairs_that_no_station_reaches(copied, reach):
    # reach 1 m: no pair has a station, there is no worst pair with a record to draw
    shutil.copytree(copied / "out" / "simulated", copied / "records")
    _shakemap(copied / "grid.xml")
    (copied / "map.toml").write_text(
        'name = "map"\noutput = "map"\n[records]\nfolder = "records"\nshakemap = "grid.xml"\n'
        f'[pairs]\nfile = "pairs.csv"\n[screening]\nlargest_distance = {reach}\n{SPECTRA}'
    )
    record = run(copied / "map.toml", executor=Here()).record
    table = pd.read_parquet(copied / "map" / "risk.parquet")
    mapped = table["demand_rule"] == "shakemap"
    assert mapped.any()
    assert mapped.all() == (reach == 1.0)
    assert table["distance"].isna().equals(mapped)
    assert table["impacts"].isna().equals(mapped)
    assert table["flags"].str.contains("shakemap_demand").equals(mapped)
    assert record["counts"]["pairs"] + record["counts"]["rejected_pair"] == 61
    assert ("figures/worst_pair.png" in record["outputs"]) == (not mapped.all())
    assert run(copied / "map.toml", executor=Here()).did_nothing
    _shakemap(copied / "grid.xml", longitudes=(-0.5, 0.2, 1.1))
    assert run(copied / "map.toml", executor=Here()).record["counts"]["chunks_resumed"] == 0


@pytest.mark.parametrize(
    ("kind", "shape"),
    [
        ("", "Polygon"),
        ("[totals]\nh3 = 6\n", "Polygon"),
        ('[totals]\narea = "position"\n', "Point"),
    ],
)
def test_totals_are_a_layer_too(copied, kind, shape):
    _configuration(copied, f'geopackage = true\n[pairs]\nfile = "pairs.csv"\n{kind}')
    result = run(copied / "run.toml", executor=Here())
    assert {"risk.gpkg", "totals.gpkg", "totals.csv"} <= set(result.record["outputs"])
    information = pyogrio.read_info(copied / "out" / "totals.gpkg")
    table = pd.read_csv(copied / "out" / "totals.csv", dtype={"area": str})
    assert (information["features"], information["geometry_type"]) == (len(table), shape)
    assert list(information["fields"]) == list(table)
    assert table["pairs"].sum() == result.record["counts"]["pairs"]
    if "h3" in kind:
        assert table["area"].str.fullmatch("86[0-9a-f]{7}f{6}").all()  # an H3 index of resolution 6


@pytest.mark.parametrize(
    ("before", "after", "missing"),
    [("", "[totals]\nh3 = 8\n", "h3"), ("geopackage = true\n", "", "pyogrio")],
)
def test_a_missing_extra_is_told_before_anything_is_computed(
    copied, monkeypatch, before, after, missing
):
    # would catch a run of an hour that ends with this
    _configuration(copied, f'{before}[pairs]\nfile = "pairs.csv"\n{after}')
    files = sorted(copied.rglob("*"))
    monkeypatch.setitem(sys.modules, missing, None)
    for stage in (run, screen, report):
        with pytest.raises(
            MissingExtra, match=rf"{missing} not installed: pip install 'per_obspy\[gis\]'"
        ):
            stage(copied / "run.toml")
    assert sorted(copied.rglob("*")) == files
