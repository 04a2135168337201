"""Screening in chunks: results do not depend on them, and only changed ones are done again."""

import json
import re
import shutil

import numpy as np
import pandas as pd
import pytest
from numpy.testing import assert_allclose

from per_obspy import read_pairs, risk_table
from per_obspy.cli.pairs import results_in
from per_obspy.errors import CatalogError
from per_obspy.inventory.table_checks import unused_columns
from per_obspy.runs.run import report, run, screen
from per_obspy.runs.screening import SMALLEST_CHUNK, _chunk_rows
from per_obspy.runs.shown_pair import find_pair
from per_obspy.runs.tasks import chunk
from per_obspy.screening.site_motion import HYPOCENTRE
from per_obspy.spectra.storage import read_spectra

from .small_run import SPECTRA, InProcess, page_content, real_reports, write_configuration

pytestmark = pytest.mark.usefixtures("plain_reports")

RESULTS = (
    *("risk.csv", "risk.parquet", "risk.columns.csv", "rejected.csv", "totals.csv"),
    *("rows.parquet", "buildings.parquet", "buildings.csv"),
)
CHUNK = "per_obspy.runs.screening.CHUNK"


@pytest.fixture(scope="module")
def finished(small_run, tmp_path_factory):
    """A run whose inventory has rows that are rejected, in one chunk."""
    folder = tmp_path_factory.mktemp("chunks")
    shutil.copytree(small_run, folder, dirs_exist_ok=True)
    lines = (folder / "out" / "pairs.csv").read_text().splitlines()
    # A name that occurs twice, a broken line, and the first row once more
    lines[20] = lines[20].replace(lines[20].split(",")[0], lines[3].split(",")[0])
    lines[41] = "broken,1"
    (folder / "pairs.csv").write_text("\n".join([*lines, lines[1]]) + "\n")
    write_configuration(folder, '[pairs]\nfile = "pairs.csv"\n')
    return folder, run(folder / "run.toml", executor=InProcess())


@pytest.fixture
def copied(finished, tmp_path):
    shutil.copytree(finished[0], tmp_path, dirs_exist_ok=True)
    return tmp_path


def screened(folder):
    """Screen again and return the counts."""
    return screen(folder / "run.toml", executor=InProcess()).record["counts"]


def results(folder):
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
    ran = pd.read_parquet(folder / "out" / "risk.parquet").set_index("pair_id")
    assert table.index.tolist() == ran.index.tolist()
    numbers = [name for name in ran if pd.api.types.is_numeric_dtype(ran[name])]
    assert "probability" in numbers
    # the same arithmetic in another process, and station files that keep all digits
    expected = table[numbers].to_numpy(np.float64)
    assert_allclose(ran[numbers].to_numpy(np.float64), expected, rtol=1e-8, atol=1e-12)


@pytest.mark.parametrize(("size", "shares", "chunks"), [(7, 1, 9), (25, 1, 3), (25, 3, 8)])
def test_results_do_not_depend_on_chunks(copied, monkeypatch, size, shares, chunks):
    # would catch sums, ranks, names or rejections that depend on where a chunk or share ends
    before = results(copied)
    monkeypatch.setattr(CHUNK, size)
    monkeypatch.setattr("per_obspy.runs.screening._shares", lambda _: shares)
    monkeypatch.setattr("per_obspy.runs.screening.SMALLEST_SHARE", 5)
    shutil.rmtree(copied / "out" / "chunks")
    assert screened(copied)["chunks"] == chunks  # 61 lines, one of them no row
    assert results(copied) == before


@pytest.mark.parametrize("workers", [1, 2, 8, 64])
def test_chunks_are_small_enough_for_every_worker(workers):
    # would catch an inventory in one chunk, on which one worker works while the others wait
    for count in (1, 10_000, 30_000, 100_000, 1_000_000, 30_000_000):
        rows = _chunk_rows(count, workers)
        assert SMALLEST_CHUNK <= rows <= chunk.CHUNK
        assert rows == SMALLEST_CHUNK or -(-count // rows) >= 2 * workers
        # a few pairs more leave the finished chunks as they are
        assert _chunk_rows(count + count // 100, workers) == rows


def set_dataset(folder, pairs):
    """Let the ranked table be a dataset by cell from so many pairs on."""
    lines = f'dataset_from = {pairs}\ndataset_cell = 0.1\n[pairs]\nfile = "pairs.csv"\n'
    write_configuration(folder, lines)


def _untimed(files: dict[str, bytes]) -> dict[str, bytes]:
    """Return files without the line of their time of issue."""
    return {name: re.sub(rb"\nIssued [^\n]*", b"", content) for name, content in files.items()}


def test_a_dataset_by_cell_gives_the_same_results(copied, call):
    # would catch a reader that takes the first cell for the worst pairs, or totals of one cell
    before, out = results(copied), copied / "out"
    one = pd.read_parquet(out / "risk.parquet")
    read_from_it = {name: (out / name).read_bytes() for name in ("risk.kml", "summary.txt")}
    set_dataset(copied, len(one))
    record = run(copied / "run.toml", executor=InProcess()).record
    cells = sorted(path.relative_to(out).as_posix() for path in (out / "risk").iterdir())
    assert len(cells) > 1
    assert set(cells) <= set(record["outputs"])
    whole = pd.concat([pd.read_parquet(out / name) for name in cells])
    pd.testing.assert_frame_equal(whole.sort_values("rank", ignore_index=True), one)
    # everything that is made of it
    (out / "risk.parquet").write_bytes(before["risk.parquet"])
    assert results(copied) == before
    (out / "risk.parquet").unlink()
    # but for the time of issue
    read = {name: (out / name).read_bytes() for name in read_from_it}
    assert _untimed(read) == _untimed(read_from_it)
    # again from the dataset alone
    totals = (out / "totals.csv").read_bytes()
    report(copied / "run.toml")
    assert (out / "totals.csv").read_bytes() == totals
    assert find_pair("#2", out).row["pair_id"] == one["pair_id"][1]
    status, said, _ = call("info", out)
    assert status == 0
    assert one["pair_id"][0] in said
    # a cell that has changed is found out
    (out / cells[0]).write_bytes(b"PAR1")
    with pytest.raises(CatalogError, match="has changed since the run wrote it"):
        report(copied / "run.toml")


def test_fewer_pairs_are_one_file_again(copied):
    before, out = results(copied), copied / "out"
    pairs = len(pd.read_parquet(out / "risk.parquet"))
    (out / "risk").mkdir()
    (out / "risk" / "lat0_lon0.parquet").write_bytes(before["risk.parquet"])
    set_dataset(copied, pairs + 1)
    screened(copied)
    assert results(copied) == before
    assert not (out / "risk").exists()


@pytest.mark.usefixtures("forked")
def test_results_do_not_depend_on_workers(copied, monkeypatch):
    before = results(copied)
    shutil.rmtree(copied / "out" / "rows")
    for name in (CHUNK, "per_obspy.buildings.search.CHUNK"):
        monkeypatch.setattr(name, 20)
    text = (copied / "run.toml").read_text()
    (copied / "run.toml").write_text(text.replace("workers = 1", "workers = 2"))
    screen(copied / "run.toml")
    assert results(copied) == before


def test_only_a_chunk_that_changed_is_done_again(copied, monkeypatch):
    monkeypatch.setattr(CHUNK, 20)
    assert run(copied / "run.toml", executor=InProcess()).did_nothing
    screened(copied)
    # another gap of one pair of the second chunk
    lines = (copied / "pairs.csv").read_text().splitlines()
    header, row = lines[0].split(","), lines[30].split(",")
    row[header.index("gap")] = "0.123"
    lines[30] = ",".join(row)
    (copied / "pairs.csv").write_text("\n".join(lines) + "\n")
    counts = run(copied / "run.toml", executor=InProcess()).record["counts"]
    assert (counts["stations_resumed"], counts["chunks"], counts["chunks_resumed"]) == (3, 3, 2)
    # the new gap is in the table, and there are three parts only
    table = pd.read_parquet(copied / "out" / "risk.parquet").set_index("pair_id")
    assert table.loc[row[header.index("pair_id")], "gap"] == 0.123
    assert not list((copied / "out" / "chunks").glob("00000[3-9]*"))


def test_a_damaged_part_is_done_again(copied):
    before = results(copied)
    part = copied / "out" / "chunks" / "000000.parquet"
    part.write_bytes(part.read_bytes()[:-9])
    assert screened(copied)["chunks_resumed"] == 0
    assert results(copied) == before


def test_parts_of_a_longer_inventory_are_removed(copied, monkeypatch):
    monkeypatch.setattr(CHUNK, 20)
    screened(copied)
    lines = (copied / "pairs.csv").read_text().splitlines()
    (copied / "pairs.csv").write_text("\n".join(lines[:11]) + "\n")
    # names that a longer inventory, a killed run or a user may have left
    for name in ("000009.parquet", ".000004.1.part.json", "notes.json"):
        (copied / "out" / "chunks" / name).write_text("{}")
    assert screened(copied)["pairs"] == 10
    left = sorted(path.name for path in (copied / "out" / "chunks").iterdir())
    assert left == ["000000.json", "000000.parquet"]


def test_a_pair_that_cannot_be_computed_costs_no_other(copied, monkeypatch):
    # would catch a row that takes its chunk with it
    computed = chunk.risk_rows
    victim = pd.read_csv(copied / "pairs.csv")["pair_id"].iloc[4]

    def fails_for_victim(pairs, *others):
        if (pairs["pair_id"] == victim).any():
            raise ValueError("period_1 is not to my taste")
        return computed(pairs, *others)

    # every other pair keeps its row
    monkeypatch.setattr(chunk, "risk_rows", fails_for_victim)
    shutil.rmtree(copied / "out" / "chunks")
    before = len(pd.read_parquet(copied / "out" / "risk.parquet"))
    assert screened(copied)["pairs"] == before - 1
    rejected = pd.read_csv(copied / "out" / "rejected.csv").set_index("name")
    assert rejected.loc[victim, "reasons"] == "period_1 is not to my taste"


def _is_broken(_task):
    raise RuntimeError("no luck")


def test_a_worker_that_fails_leaves_a_reason_for_every_pair(copied, monkeypatch):
    monkeypatch.setattr(chunk.ChunkTask, "do", _is_broken)
    shutil.rmtree(copied / "out" / "chunks")
    result = screen(copied / "run.toml", executor=InProcess())
    assert result.record["state"] == "nothing_usable"
    reasons = pd.read_csv(copied / "out" / "rejected.csv")["reasons"]
    assert reasons.eq("RuntimeError: no luck").sum() == 60
    # the next run does not take that for done
    monkeypatch.undo()
    assert screened(copied)["chunks_resumed"] == 0


def test_after_screening_alone_a_run_compares_everything_again(copied):
    screened(copied)
    assert not run(copied / "run.toml", executor=InProcess()).did_nothing
    assert run(copied / "run.toml", executor=InProcess()).did_nothing


def test_screening_needs_whole_stations(copied):
    next((copied / "out" / "stations").glob("*.nc")).write_bytes(b"nothing")
    with pytest.raises(CatalogError, match="damaged"):
        screened(copied)
    shutil.rmtree(copied / "out" / "stations")
    with pytest.raises(CatalogError, match="no stations here"):
        screened(copied)


def test_a_large_table_has_only_its_worst_rows_as_text(copied):
    write_configuration(copied, 'csv_rows = 5\n[pairs]\nfile = "pairs.csv"\n')
    run(copied / "run.toml", executor=InProcess())
    whole = pd.read_parquet(copied / "out" / "risk.parquet")
    worst = pd.read_csv(copied / "out" / "risk.csv", dtype={"pair_id": str})
    assert worst["pair_id"].tolist() == whole["pair_id"].tolist()[:5]


def test_an_area_that_the_inventory_does_not_name(copied):
    write_configuration(copied, '[pairs]\nfile = "pairs.csv"\n[totals]\narea = "ward"\n')
    with pytest.raises(CatalogError, match="area: the pair table has no column 'ward'"):
        run(copied / "run.toml", executor=InProcess())


#: A ShakeMap with the same motion everywhere, in % g.
MAP = """\
<shakemap_grid xmlns="http://earthquake.usgs.gov/eqcenter/shakemap" event_id="x"
 shakemap_version="3" shakemap_event_type="ACTUAL">
<event event_timestamp="2026-11-01T11:58:02UTC" magnitude="6.7" lon="0.4" lat="0.1" depth="11.2"/>
<grid_specification lon_min="{west}" lon_max="{east}" lat_min="-0.5" lat_max="0.5"
 nlon="3" nlat="3" nominal_lon_spacing="0.8" nominal_lat_spacing="0.5"/>
<grid_field index="1" name="LON" units="dd"/><grid_field index="2" name="LAT" units="dd"/>
<grid_field index="3" name="PGA" units="pctg"/><grid_field index="4" name="PSA03" units="pctg"/>
<grid_field index="5" name="PSA10" units="pctg"/><grid_field index="6" name="PSA30" units="pctg"/>
<grid_data>
{rows}
</grid_data></shakemap_grid>
"""


def write_shakemap(path, longitudes=(-0.5, 0.3, 1.1)):
    """Write a ShakeMap with three columns, from north to south."""
    places = [f"{east} {north}" for north in (0.5, 0.0, -0.5) for east in longitudes]
    rows = "\n".join(f"{place} 20 50 25 6" for place in places)
    path.write_text(MAP.format(west=longitudes[0], east=longitudes[-1], rows=rows))


def write_map_configuration(folder, reach):
    """Write a run with records, and with a ShakeMap for pairs that no station reaches."""
    shutil.copytree(folder / "out" / "simulated", folder / "records")
    write_shakemap(folder / "grid.xml")
    (folder / "map.toml").write_text(
        'name = "map"\noutput = "map"\ngeopackage = true\n'
        '[records]\nfolder = "records"\nshakemap = "grid.xml"\n'
        f'[pairs]\nfile = "pairs.csv"\n[screening]\nlargest_distance = {reach}\n{SPECTRA}'
    )


@pytest.mark.parametrize("reach", [1000.0, 1.0])
def test_a_map_serves_pairs_that_no_station_reaches(copied, reach):
    # reach 1 m: no pair has a station, there is no worst pair with a record to draw
    write_map_configuration(copied, reach)
    with real_reports():
        record = run(copied / "map.toml", executor=InProcess()).record
    table = pd.read_parquet(copied / "map" / "risk.parquet")
    mapped = table["demand_rule"] == "shakemap"
    assert mapped.any()
    assert mapped.all() == (reach == 1.0)
    # pairs of the map have neither a station nor a history
    assert table["distance"].isna().equals(mapped)
    assert table["impacts"].isna().equals(mapped)
    assert table["flags"].str.contains("shakemap_demand").equals(mapped)
    assert record["counts"]["pairs"] + record["counts"]["rejected_pair"] == 61
    assert ("figures/worst_pair.png" in record["outputs"]) == (not mapped.all())
    # everything that people look at is there, with or without a record
    people = {"summary.pdf", "summary.txt", "figures/overview.png"}
    people |= {f"risk.{suffix}" for suffix in ("gpkg", "qgz", "geoparquet", "kml")}
    assert people <= set(record["outputs"])
    assert record["faults"] == []
    # the page and the summary name the map, and where no record does, its earthquake
    text = (copied / "map" / "summary.txt").read_text()
    assert "Motion of ShakeMap x, version 3" in text.replace("\n", " ")
    page = page_content(copied / "map" / "report.html")
    assert "Motion of ShakeMap x, version 3" in page["event"]
    assert "no displacement history" in page["provenance"][-1][1]
    assert page["epicentre"] is not None
    # and can be written again, in another language, also where no station was needed
    report(copied / "map.toml")
    screen(copied / "map.toml", executor=InProcess())


def write_station_list(path, pairs, share=1.0):
    """Write amplitudes of stations at the first and last pair, and one report of people."""
    table = pd.read_csv(pairs, comment="#")
    places = table[["longitude_1", "latitude_1"]].iloc[[0, -1, 0]].to_numpy().tolist()
    values = {"sa(0.1)": 60.0, "sa(1.0)": 40.0 * share, "sa(5.0)": 3.0, "pga": 30.0}
    amplitudes = [{"name": key, "value": one, "units": "%g"} for key, one in values.items()]
    features = [
        {
            "geometry": {"type": "Point", "coordinates": place},
            "properties": {
                "network": "ZZ",
                "code": f"A{i}",
                "commType": "UNK",
                "vs30": 400.0,
                "station_type": "macroseismic" if i == 2 else "seismic",
                "channels": [{"name": "UNK", "amplitudes": amplitudes}],
            },
        }
        for i, place in enumerate(places)
    ]
    path.write_text(json.dumps({"type": "FeatureCollection", "features": features}))


def test_amplitudes_serve_pairs_far_from_every_record(copied):
    # among the records, where would be found what is no record; would catch amplitudes that a
    # second run, a changed list or a screening without records does not see
    write_map_configuration(copied, 20_000.0)
    write_station_list(copied / "records" / "list.json", copied / "pairs.csv")
    text = (copied / "map.toml").read_text()
    text = text.replace('shakemap = "grid.xml"', 'stationlist = "records/list.json"')
    (copied / "map.toml").write_text(text.replace("[screening]", "[screening]\nflag_distance = 1"))
    record = run(copied / "map.toml", executor=InProcess()).record
    table = pd.read_parquet(copied / "map" / "risk.parquet")
    alone = table["demand_rule"] == "amplitudes"
    assert alone.any()
    assert not alone.all()
    assert table["flags"].str.contains("amplitudes_only").equals(alone)
    counts = record["counts"]
    assert (counts["stations_amplitudes_only"], counts["intensities_left_out"]) == (2, 1)
    stations = pd.read_csv(copied / "map" / "stations.csv").set_index("station")
    assert stations.loc["ZZ.A0", ["state", "flags", "pairs"]].tolist() == [
        "used",
        "amplitudes_only",
        0,
    ]
    assert counts["rejected_file"] == 0
    assert run(copied / "map.toml", executor=InProcess()).did_nothing
    write_station_list(copied / "records" / "list.json", copied / "pairs.csv", share=2.0)
    counts = run(copied / "map.toml", executor=InProcess()).record["counts"]
    assert (counts["stations_resumed"], counts["chunks_resumed"]) == (3, 0)


def test_a_changed_map_changes_every_chunk(copied):
    write_map_configuration(copied, 300.0)
    run(copied / "map.toml", executor=InProcess())
    assert run(copied / "map.toml", executor=InProcess()).did_nothing
    # stations stay, but every chunk may need the map
    write_shakemap(copied / "grid.xml", longitudes=(-0.5, 0.2, 1.1))
    counts = run(copied / "map.toml", executor=InProcess()).record["counts"]
    assert (counts["stations_resumed"], counts["chunks_resumed"]) == (3, 0)


@pytest.fixture(scope="module")
def half_lost(finished, tmp_path_factory):
    """A run of 60 pairs, of which 20 are far from every station and 8 have no height or period."""
    folder = tmp_path_factory.mktemp("lost")
    shutil.copytree(finished[0] / "out" / "stations", folder / "out" / "stations")
    table = pd.read_csv(finished[0] / "out" / "pairs.csv").assign(ward="Port")
    far = table.index < 20
    table.loc[far, ["longitude_1", "longitude_2"]] += 50.0
    table.loc[far, "ward"] = "Desert"
    sizes = [f"{name}_1" for name in ("height", "storeys", "period") if f"{name}_1" in table]
    table.loc[20:27, sizes] = np.nan
    table.to_csv(folder / "pairs.csv", index=False)
    with real_reports():
        write_configuration(folder, '[pairs]\nfile = "pairs.csv"\n[totals]\narea = "ward"\n')
        return folder, run(folder / "run.toml", executor=InProcess()).record


def test_what_is_left_out_is_counted_with_reasons_and_areas(half_lost):
    folder, record = half_lost
    rejected = pd.read_csv(folder / "out" / "rejected.csv")
    found = record["coverage"]
    assert (found["rows"], found["screened"]) == (60, 32)
    # Counted once more from the tables themselves
    assert found["screened"] == len(pd.read_parquet(folder / "out" / "risk.parquet"))
    assert sum(found["left_out"].values()) == (rejected["kind"] == "pair").sum()
    assert list(found["left_out"].items()) == [
        ("no station within reach", 20),
        ("no height, storeys or period", 8),
    ]
    assert [tuple(area) for area in found["areas"]] == [("Desert", 20), ("Port", 8)]


def test_coverage_is_the_first_number_everywhere(half_lost, call):
    folder, _ = half_lost
    warning = "28 of 60 neighbouring pairs (47 %) have NO VERDICT"
    account = "32 of 60 rows of the pair table are screened; left out: 28 (20 no station"
    code, said, _ = call("run", folder / "run.toml")
    assert code == 0
    # Up to date, simulated, and then what has no verdict
    assert warning in said.splitlines()[2]
    assert account in said.splitlines()[3]
    content = page_content(folder / "out" / "report.html")
    assert content["warns"]
    assert content["coverage"][0].startswith(warning)
    assert content["coverage"][1].startswith(account)
    text = (folder / "out" / "summary.txt").read_text()
    assert text.startswith("28 of 60 neighbouring pairs (47 percent) have NO VERDICT")


@pytest.mark.parametrize("size", [7, 25])
def test_coverage_does_not_depend_on_chunks(half_lost, tmp_path, monkeypatch, size):
    folder, record = half_lost
    shutil.copytree(folder, tmp_path, dirs_exist_ok=True)
    shutil.rmtree(tmp_path / "out" / "chunks")
    monkeypatch.setattr(CHUNK, size)
    again = screen(tmp_path / "run.toml", executor=InProcess()).record
    assert again["coverage"] == record["coverage"]


def test_a_report_alone_says_the_same(half_lost, tmp_path):
    folder, record = half_lost
    shutil.copytree(folder, tmp_path, dirs_exist_ok=True)
    before = (tmp_path / "out" / "summary.txt").read_bytes()
    with real_reports():
        assert report(tmp_path / "run.toml").record["coverage"] == record["coverage"]
    assert (tmp_path / "out" / "summary.txt").read_bytes() == before


def test_cells_are_named_with_their_places_across_the_date_line(half_lost, tmp_path):
    folder, _ = half_lost
    shutil.copytree(folder, tmp_path, dirs_exist_ok=True)
    table = pd.read_csv(tmp_path / "pairs.csv")
    table.loc[:19, ["longitude_1", "longitude_2"]] = 179.9999, -179.9997
    table.loc[:19, ["latitude_1", "latitude_2"]] = 0.004
    # Without a name of its own a place has that of its cell
    table.drop(columns="ward").to_csv(tmp_path / "pairs.csv", index=False)
    write_configuration(tmp_path, '[pairs]\nfile = "pairs.csv"\n')
    found = screen(tmp_path / "run.toml", executor=InProcess()).record["coverage"]
    name, count = found["areas"][0]
    assert count == 20
    north, east = re.fullmatch(r"([\d.]+) N, ([\d.]+) [EW]", name).groups()
    # Half a cell of 1 km at most; at 180 degrees east is west
    assert_allclose([float(north), float(east)], [0.004, 180.0], atol=0.0046)


def test_an_aftershock_starts_from_the_results_of_the_main_shock(copied):
    # catches: results that are read but not used, in no key, or of the run itself
    configuration = copied / "run.toml"
    text = configuration.read_text()
    shutil.copytree(copied / "out", copied / "main")
    main = pd.read_parquet(copied / "main" / "risk.parquet").set_index("pair_id")
    configuration.write_text(f'after = "main"\n{text}')
    counts = run(configuration, executor=InProcess()).record["counts"]
    found = pd.read_parquet(copied / "out" / "risk.parquet").set_index("pair_id")
    words = found["after_damage"].value_counts()
    assert counts["after_damage_unknown"] == words["unknown"] > 0
    assert counts["after_damage_residual"] == words.get("residual", 0)
    assert not (found.loc[found["after_damage"] == "unknown", "state"] == "no").any()
    assert run(configuration, executor=InProcess()).did_nothing
    # other results of the same name are another input
    earlier = main.assign(after_damage="unknown", rank=range(1, 1 + len(main)))
    earlier.reset_index().to_parquet(copied / "main" / "risk.parquet")
    assert screened(copied)["after_damage_unknown"] == len(found)
    # without it the results are those of before
    configuration.write_text(text)
    screened(copied)
    again = pd.read_parquet(copied / "out" / "risk.parquet").set_index("pair_id")
    pd.testing.assert_frame_equal(again, main)


@pytest.mark.parametrize(
    ("after", "problem"),
    [("out", "of this run itself"), ("nowhere", "no finished run"), ("cut", "damaged")],
)
def test_a_run_starts_from_finished_results_of_another(copied, after, problem):
    configuration = copied / "run.toml"
    configuration.write_text(f'after = "{after}"\n{configuration.read_text()}')
    # one whose table is cut off
    (copied / "cut").mkdir()
    (copied / "cut" / "run.json").write_bytes((copied / "out" / "run.json").read_bytes())
    table = (copied / "out" / "risk.parquet").read_bytes()
    (copied / "cut" / "risk.parquet").write_bytes(table[:3000])
    with pytest.raises(CatalogError, match=f"{after}.*: after: .*{problem}"):
        screen(configuration, executor=InProcess())


def test_a_check_of_pairs_knows_every_column_of_a_result(finished):
    table = read_pairs(finished[0] / "out" / "risk.parquet")
    assert {"state", "demand_exact"} <= set(results_in(table))
    assert unused_columns(table, results_in(table)) == []
    # without a result a column of that name is the user's
    assert results_in(table.drop(columns="state")) == []
