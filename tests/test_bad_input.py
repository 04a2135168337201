"""
Every kind of wrong file and value through the command line.

A fault of a whole input ends in exit code 2 and one line that names the file and the fault in
it; a wrong row is listed with its line and all its reasons, and the others go on. The rooms'
tests go into detail.
"""

import json
import sys

import numpy as np
import pandas as pd
import pyogrio
import pytest
import shapely

from per_obspy.config import Scenario
from per_obspy.inventory.schema import COLUMNS
from per_obspy.simulation.earthquake import simulate, write_simulation

from .runs.small_run import plain_reports

ROW = {
    "pair_id": "a", "longitude_1": 0.3, "latitude_1": 0.1, "height_1": 10.0,
    "longitude_2": 0.3001, "latitude_2": 0.1, "height_2": 12.0, "gap": 0.05,
}  # fmt: skip
RUN = """
name = "x"
output = "out"
workers = 1
[records]
folder = "records"
[pairs]
file = "pairs.csv"
"""
MAPPED = RUN.replace('"records"\n', '"records"\nshakemap = "grid.xml"\n')
STORED = RUN.replace('file = "pairs.csv"', 'catalog = "catalog.toml"')
DESIGN = 'spectrum = "code.csv"\npairs = "pairs.csv"\noutput = "out"\n'
ENSEMBLE = 'name = "x"\noutput = "out"\n[[scenario]]\nname = "near"\nrun = "run.toml"\n'
CURVE = "period,damping,sd\n0.1,0.05,0.01\n1.0,0.05,0.1\n4.0,0.05,0.4\n"
PDF = b"%PDF-1.4\n%\xe2\xe3\xcf\xd3\n"
FIELDS = "".join(
    f'<grid_field index="{i}" name="{name}" units="{unit}"/>'
    for i, (name, unit) in enumerate(
        [("LON", "dd"), ("LAT", "dd"), *((f"PSA{p}", "%g") for p in ("03", "10", "30"))], 1
    )
)
MAP = (
    f'<shakemap_grid event_id="x"><grid_specification nlon="2" nlat="2"/>{FIELDS}<grid_data>\n'
    "0 1 20 10 3\n1 1 20 10 3\n0 0 20 10 3\n1 0 20 10 3\n</grid_data></shakemap_grid>"
)
INDEX = """[[inventory]]
name = "old town"
file = "pairs.csv"
bounding_box = [0.3, 0.1, 0.3001, 0.1]
crs = "OGC:CRS84"
sha256 = "0000000000000000000000000000000000000000000000000000000000000000"
pairs = 1
source = "a survey"
licence = "CC0-1.0"
date = 2026-11-21
"""


@pytest.fixture(autouse=True, scope="module")
def _plain_reports():
    """Write figures, PDF and page of runs as short files: no test here looks at one."""
    with plain_reports():
        yield


def _table(*rows):
    return pd.DataFrame([ROW | row for row in rows or ({},)]).to_csv(index=False)


#: Content of files beside pairs.csv -> arguments -> what the line says.
WHOLE = {
    # pair tables
    "empty file": (
        {"pairs.csv": ""},
        "pairs check pairs.csv",
        "pairs.csv: not a CSV table: it is an empty file",
    ),
    "header alone": (
        {"pairs.csv": _table().split("\n")[0] + "\n"},
        "pairs check pairs.csv",
        "pairs.csv: the table has no rows",
    ),
    "PDF as CSV": (
        {"pairs.csv": PDF},
        "pairs check pairs.csv",
        "pairs.csv: not a CSV table: it is a PDF document",
    ),
    "Excel as CSV": (
        {"pairs.csv": b"PK\x03\x04" + PDF},
        "pairs check pairs.csv",
        "pairs.csv: not a CSV table: it is a ZIP",
    ),
    "PDF as Parquet": (
        {"pairs.parquet": PDF},
        "pairs check pairs.parquet",
        "not a Parquet table: it is a PDF document",
    ),
    "damaged UTF-8": (
        {"pairs.csv": _table({"note": "café"}).encode() + b"\xe9 \n"},
        "pairs check pairs.csv",
        "line 3 is not UTF-8",
    ),
    "a number of two readings": (
        {"pairs.csv": _table().replace(",", ";").replace("0.05", "1,234")},
        "pairs check pairs.csv",
        "pairs.csv: line 2: gap = '1,234' is 1.234 or 1234, and no other number decides",
    ),
    "missing column": (
        {"pairs.csv": _table().replace("gap", "ward")},
        "run run.toml",
        "missing column gap (columns found: ",
    ),
    "no such table": (
        {"run.toml": RUN.replace("pairs.csv", "absent.csv")},
        "run run.toml",
        "absent.csv: no such file",
    ),
    "folder as table": (
        {"run.toml": RUN.replace("pairs.csv", "records")},
        "run run.toml",
        "records: unknown suffix ''",
    ),
    # footprints
    "PDF as footprints": (
        {"town.gpkg": PDF},
        "pairs town.gpkg",
        "town.gpkg: not a GeoPackage: it is a PDF document",
    ),
    "pairs as footprints": ({}, "pairs pairs.csv", "pairs.csv: a table of pairs already"),
    "no such footprints": ({}, "pairs absent.csv", "absent.csv: no such file"),
    "unknown output": (
        {"town.gpkg": PDF},
        "pairs town.gpkg -o pairs.xlsx",
        "town.gpkg: not a GeoPackage",
    ),
    # configurations
    "mistyped key": (
        {"run.toml": f"{RUN}[processing]\nhighpas = 1\n"},
        "run run.toml",
        "processing.highpas: unknown key",
    ),
    "per cent": (
        {"run.toml": f"{RUN}[building]\ndamping = 5\n"},
        "run run.toml",
        "building.damping: Input should be less",
    ),
    "millimetres": (
        {"run.toml": f"{RUN}[building]\nstorey_height = 3000\n"},
        "run run.toml",
        "(got 3000), expected: height of a storey",
    ),
    "text for a number": (
        {"run.toml": f"{RUN}[spectra]\ncount = 'many'\n"},
        "run run.toml",
        "spectra.count: Input should",
    ),
    "no TOML": (
        {"run.toml": PDF},
        "run run.toml",
        "run.toml: cannot be read as TOML: is a PDF document",
    ),
    "no such configuration": (
        {},
        "run absent.toml",
        "absent.toml: cannot be read: No such file or directory",
    ),
    "a key one level up": (
        {"s.toml": "magnitude = 7\n"},
        "simulate s.toml -o out",
        "magnitude: unknown key (got 7), it belongs",
    ),
    "not in per cent": (
        {"s.toml": "[scenario]\nlakebed_damping = 10\n"},
        "simulate s.toml -o out",
        "(got 10), expected: of the Kanai-Tajimi filter, fraction of critical",
    ),
    "no section": ({}, "fetch run.toml", "run.toml: has no section [records.fdsn]"),
    "no run yet": ({}, "report run.toml", "run.json: no finished run here"),
    "no stations yet": ({}, "screen run.toml", "stations: no stations here"),
    # records
    "no record": (
        {"notes/a.txt": "Dear colleague"},
        "info notes/a.txt",
        "none of its 1 files is a record; a.txt: ObsPy cannot read it: its format is unknown",
    ),
    "no such folder": ({}, "info absent", "absent: no such folder or file"),
    "no event": ({"event.xml": PDF}, "events event.xml", "event.xml: is no list of events"),
    "no such event": ({}, "events absent.xml", "absent.xml: no such file"),
    "no StationXML": (
        {"records/a.txt": "", "s.xml": PDF},
        "info records --stationxml s.xml",
        "s.xml: is no StationXML",
    ),
    # spectra
    "negative SD": (
        {"code.csv": CURVE.replace("0.1\n", "-0.1\n")},
        "screen design.toml",
        "code.csv: sd = -0.1 m in row 2",
    ),
    "SD in millimetres": (
        {"code.csv": CURVE.replace("0.4", "400")},
        "screen design.toml",
        "sd = 400.0 m in row 3: in other",
    ),
    "a period of 0": (
        {"code.csv": CURVE.replace("1.0,", "0.0,")},
        "screen design.toml",
        "period = 0.0 s in row 2",
    ),
    "a period twice": (
        {"code.csv": CURVE + "1.0,0.05,0.2\n"},
        "screen design.toml",
        "period = 1, damping = 0.05 occurs twice",
    ),
    "PDF as spectrum": (
        {"code.csv": PDF},
        "screen design.toml",
        "code.csv: not a CSV table: it is a PDF document",
    ),
    "no such spectrum": (
        {},
        "screen design.toml",
        "code.csv: cannot be read as CSV: No such file or directory",
    ),
    # ShakeMaps
    "half a map": (
        {"run.toml": MAPPED, "grid.xml": MAP[:200]},
        "run run.toml",
        "grid.xml: cannot be read as XML",
    ),
    "a row short": (
        {"run.toml": MAPPED, "grid.xml": MAP.replace("1 0 20 10 3\n", "")},
        "run run.toml",
        "grid.xml: grid_data has 3 rows",
    ),
    "negative PSA": (
        {"run.toml": MAPPED, "grid.xml": MAP.replace("10", "-10", 1)},
        "run run.toml",
        "grid.xml: ",
    ),
    "a list of stations that ends before the first": (
        {"list.json": '{"type": "Feat'},
        "run list.json pairs.csv",
        "list.json: a damaged station list or layer of outlines: Unterminated string starting at: "
        "line 1 column 10",
    ),
    "half a list of stations": (
        {"run.toml": MAPPED.replace("shakemap", "stationlist"), "grid.xml": '{"features": ['},
        "run run.toml",
        "grid.xml: a damaged station list: Expecting value: line 1 column 15",
    ),
    "no such map": (
        {"run.toml": MAPPED},
        "run run.toml",
        "grid.xml: cannot be read: No such file or directory",
    ),
    # ensembles
    "negative rate": (
        {"e.toml": f"{ENSEMBLE}rate = -1.0\n"},
        "screen e.toml",
        "scenario.0.rate: Input should be greater",
    ),
    "no weight": (
        {"e.toml": f"{ENSEMBLE}weight = 0.0\n"},
        "screen e.toml",
        "weights or rates must have a positive sum",
    ),
    "no such run": (
        {"e.toml": f"{ENSEMBLE}rate = 1.0\n".replace("run.toml", "absent.toml")},
        "screen e.toml",
        "absent.toml: cannot be read",
    ),
    # stored inventories
    "changed file": (
        {"catalog.toml": INDEX},
        "catalog check --index catalog.toml",
        "changed or damaged since it was stored",
    ),
    "gone file": (
        {"catalog.toml": INDEX.replace("pairs.csv", "gone.csv")},
        "catalog check --index catalog.toml",
        "is missing",
    ),
    "half an index": (
        {"catalog.toml": INDEX[:80]},
        "catalog list --index catalog.toml",
        "catalog.toml: cannot be read as TOML",
    ),
    "no index": (
        {},
        "catalog find --bbox 0 0 1 1 --index absent.toml",
        "absent.toml: cannot be read: No such file",
    ),
    "no such name": (
        {
            "run.toml": STORED.replace('toml"\n', 'toml"\nnames = ["new town"]\n'),
            "catalog.toml": INDEX,
        },
        "run run.toml",
        "catalog.toml: names: 'new town' is not stored here",
    ),
    "a name whose file has changed": (
        {
            "run.toml": STORED.replace('toml"\n', 'toml"\nnames = ["old town"]\n'),
            "catalog.toml": INDEX,
        },
        "run run.toml",
        "pairs.csv: changed or damaged since it was stored as 'old town'",
    ),
}


@pytest.fixture
def write(tmp_path, monkeypatch):
    """Write files into the current folder, next to correct ones."""
    monkeypatch.chdir(tmp_path)

    def write(files):
        for name, content in {
            "pairs.csv": _table(),
            "run.toml": RUN,
            "design.toml": DESIGN,
            **files,
        }.items():
            (tmp_path / name).parent.mkdir(exist_ok=True)
            (tmp_path / name).write_bytes(
                content if isinstance(content, bytes) else content.encode()
            )

    return write


@pytest.mark.parametrize("fault", WHOLE)
def test_a_wrong_file_ends_in_one_line(write, call, fault):
    # would catch a traceback, a bare errno, a line that does not name the file, and a fault found
    # only in the end
    files, arguments, message = WHOLE[fault]
    write(files)
    code, _, err = call(*arguments.split())
    said = [line for line in err.splitlines() if not line.startswith("finding records")]
    assert (code, len(said)) == (2, 1), err
    assert said[0].startswith("per-obspy: ")
    assert message in said[0]
    assert "Errno" not in err


ROWS = {
    "swapped": (
        {"longitude_1": 19.4, "latitude_1": -99.1, "longitude_2": 19.4, "latitude_2": -99.1},
        "swapped",
    ),
    "metres": ({"longitude_1": 485000, "latitude_1": 2149000}, "metres of a projection?"),
    "at 0, 0": ({"longitude_1": 0, "latitude_1": 0}, "is a placeholder"),
    "far apart": ({"longitude_1": 5}, "km apart"),
    "gap in millimetres": (
        {"gap": 50},
        "gap = 50 m is outside 0 to 10 m (given in millimetres or centimetres by mistake?)",
    ),
    "negative gap": ({"gap": -0.05}, "gap = -0.05 m is outside"),
    "text for a place": ({"longitude_1": "x"}, "longitude_1 = 'x' is not a number"),
    "height of 0": ({"height_1": 0}, "height_1 = 0 m is outside"),
    "no height": ({"height_2": ""}, "none of height_2, storeys_2, period_2 is a number"),
    "period of 1 ms": ({"period_1": 0.001}, "period_1 = 0.001 s is outside"),
    "storeys that are a list": (
        {"height_1": "", "storeys_1": "3;4"},
        "none of height_1, storeys_1, period_1 is a number, one is needed: storeys_1 = '3;4'",
    ),
    "period in milliseconds": (
        {"period_2": 500},
        "period_2 = 500 s is outside 0.01 to 20 s (in milliseconds?)",
    ),
    "negative mass": ({"mass_1": -2e5}, "mass_1 = -200000 kg is outside"),
    "restitution": ({"restitution": 1.5}, "restitution = 1.5 is outside 0 to 1"),
    "per cent": (
        {"damping_1": 5},
        "damping_1 = 5 is outside 0 to 1 (a fraction is expected, not per cent)",
    ),
    "28 m floor": ({"storeys_1": 1, "height_1": 28}, "makes floors of 28 m"),
    "same name": ({"pair_id": "a"}, "pair_id = 'a' occurs in an earlier row"),
    "same building": (
        {"building_id_1": "h", "building_id_2": "h"},
        "a building has no gap to itself",
    ),
    "half observed": ({"observed": 0.5}, "observed = 0.5 is neither 0 nor 1"),
}


@pytest.mark.parametrize("fault", ROWS)
def test_a_wrong_row_is_told_with_its_line_and_the_others_go_on(write, call, fault):
    row, message = ROWS[fault]
    write({"pairs.csv": _table({}, {"pair_id": "b"} | row, {"pair_id": "c"})})
    code, out, _ = call("pairs", "check", "pairs.csv")
    assert code == 0
    assert "pairs.csv: 2 usable pairs, 0 of them touching, 1 rejected rows" in out
    assert message in next(line for line in out.splitlines() if line.startswith("  line 3, "))


def test_a_run_lists_every_wrong_row_and_judges_the_others(write, call, tmp_path):
    # would catch a fault that stops the chunk in which it stands
    rows = [{"pair_id": fault} | row for fault, (row, _) in ROWS.items()]
    write({"pairs.csv": _table({}, *rows)})
    write_simulation(simulate(Scenario(stations=1, dt=0.02)), tmp_path / "records")
    code, out, _ = call("run", "run.toml", "--json")
    assert code == 0
    counts = json.loads(out)["counts"]
    assert (counts["pairs"], counts["rejected_pair"]) == (1, len(ROWS))
    rejected = pd.read_csv("out/rejected.csv").query("kind == 'pair'").set_index("row")["reasons"]
    assert rejected.index.tolist() == list(range(3, 3 + len(ROWS)))
    for reason, (_, message) in zip(rejected, ROWS.values(), strict=True):
        assert message in reason


#: Cells that are not needed: their text, and what the row becomes.
NOT_NEEDED = {
    "text for a gap": ({"gap": "five"}, "gap = 'five' is not a number", "unknown"),
    "a range": ({"gap": "0.03-0.05"}, "gap = '0.03-0.05' is read as 0.04 m, with a devi", ""),
    "unknown system": ({"system_1": "paper"}, "system_1 = 'paper' is unknown", ""),
    "text for an azimuth": ({"azimuth": "north"}, "azimuth = 'north' is not a number", ""),
}


def test_a_cell_that_is_not_needed_is_told_and_its_row_is_screened(write, call, tmp_path):
    # among small chunks and plain rows: parts with and without notes make one table
    rows = [{"pair_id": name} | row for name, (row, _, _) in NOT_NEEDED.items()]
    write({"pairs.csv": _table({}, {"pair_id": "bitişik", "gap": "bitişik"}, *rows)})
    code, out, _ = call("pairs", "check", "pairs.csv")
    assert code == 0
    assert "pairs.csv: 6 usable pairs, 1 of them touching, 0 rejected rows" in out
    assert f"{len(rows)} rows with a doubtful cell, which are screened:" in out
    write_simulation(simulate(Scenario(stations=1, dt=0.02)), tmp_path / "records")
    assert call("run", "run.toml")[0] == 0
    risk = pd.read_parquet("out/risk.parquet").set_index("pair_id")
    for name, (_, note, state) in NOT_NEEDED.items():
        assert note in out
        assert note in risk.loc[name, "cell_notes"]
        assert "doubtful_cell" in risk.loc[name, "flags"].split()
        assert (risk.loc[name, "state"] == "unknown") == (state == "unknown")
    assert "doubtful_cell" not in risk.loc["bitişik", "flags"]
    assert risk.loc["bitişik", "gap"] == 0.0
    # an even distribution between both ends
    assert float(risk.loc["a range", "gap"]) == pytest.approx(0.04)
    assert float(risk.loc["a range", "gap_std"]) == pytest.approx(0.02 / 12**0.5, rel=1e-3)


def test_a_pair_without_a_gap_is_kept(write, call, tmp_path):
    write({"pairs.csv": _table({}, {"pair_id": "b", "gap": ""})})
    write_simulation(simulate(Scenario(stations=1, dt=0.02)), tmp_path / "records")
    code, out, _ = call("run", "run.toml")
    assert code == 0
    assert "1 unknown; 0 rejected" in out
    row = pd.read_csv("out/risk.csv").set_index("pair_id").loc["b"]
    assert row["demand"] > 0
    assert (row["state"], row["risk_class"]) == ("unknown", "gap unknown")
    assert np.isnan(row["probability"])


def test_the_ends_of_every_range_can_be_computed(write, call, tmp_path):
    # would catch a range of the schema that is wider than what the physics takes: a check of an
    # argument deep inside would name a value that nobody gave
    yielding = {"yield_displacement_1": 0.005, "yield_displacement_2": 0.01, "hardening_1": 0.05}
    numbers = {
        name: one
        for name, one in COLUMNS.items()
        if one.dtype == "float64" and name[:4] not in ("long", "lati")
    }
    ends = [
        (name, end)
        for name, one in numbers.items()
        for end in (one.low, one.high)
        if np.isfinite(end)
    ]
    write(
        {
            "pairs.csv": _table(
                *(yielding | {"pair_id": f"{name} {end}", name: end} for name, end in ends)
            )
        }
    )
    write_simulation(simulate(Scenario(stations=1, dt=0.02)), tmp_path / "records")
    code, out, _ = call("run", "run.toml", "--json")
    assert code == 0
    counts = json.loads(out)["counts"]
    assert counts["pairs"] + counts["rejected_pair"] == len(ends)
    reasons = pd.read_csv("out/rejected.csv").query("kind == 'pair'")["reasons"]
    assert len(reasons) < 10
    # what else a row may break: floors of such heights, and a contact above the lower building
    assert reasons.str.contains("makes floors of|contact_height = ").all(), reasons.tolist()


def test_every_fault_of_a_row_is_told(write, call):
    write(
        {
            "pairs.csv": _table(
                {}, {"pair_id": "b", "gap": 50, "height_1": 0, "mass_2": -2, "restitution": 2}
            )
        }
    )
    _, out, _ = call("pairs", "check", "pairs.csv")
    told = next(line for line in out.splitlines() if line.startswith("  line 3, b: "))
    reasons = told.removeprefix("  line 3, b: ").split("; ")
    assert [reason.split(" = ")[0] for reason in reasons] == [
        "gap", "restitution", "height_1", "mass_2",
    ]  # fmt: skip


def test_swapped_coordinates_that_would_reach_the_stations_are_suspected(write, call, tmp_path):
    # both orders are places on earth: only the stations can tell
    write(
        {
            "pairs.csv": _table(
                dict.fromkeys(("longitude_1", "longitude_2"), 0.0)
                | {"latitude_1": 0.3, "latitude_2": 0.3}
            )
        }
    )
    write_simulation(simulate(Scenario(stations=1, dt=0.02)), tmp_path / "records")
    code, _, err = call("run", "run.toml")
    assert code == 3
    assert "see" in err.splitlines()[-1]
    (reason,) = pd.read_csv("out/rejected.csv").set_index("name").loc[["a"], "reasons"]
    assert "with longitude = 0 and latitude = 0.3 exchanged, XX.S001 would be" in reason
    assert reason.endswith("are they swapped?")


def _write_layer(path, polygons, crs="EPSG:4326", kind="Polygon"):
    wkb = shapely.to_wkb(np.array(polygons, dtype=object), output_dimension=3)
    pyogrio.raw.write(
        path, wkb, [np.full(len(polygons), 9.0)], ["height"], geometry_type=kind, crs=crs
    )


HOUSES = [shapely.box(0.3 + 1e-4 * i, 0.0, 0.3 + 1e-4 * (i + 1), 1e-4) for i in range(3)]
LAYERS = {
    "empty layer": ([], {}, "town.gpkg: the layer has no features"),
    "points": (
        [shapely.Point(0, 0)],
        {"kind": "Point"},
        "town.gpkg: the layer holds points, not footprints",
    ),
    "swapped": (
        [shapely.box(19.4, -99.1, 19.5, -99.0)] * 2,
        {},
        "feature 1: coordinates 19.4, -99.1 lie outside",
    ),
    "metres as degrees": (
        [shapely.box(5e5, 2e6, 5e5 + 9, 2e6 + 9)] * 2,
        {},
        "feature 1: coordinates 500000, 2e+06 lie",
    ),
    "degrees as metres": (
        HOUSES,
        {"crs": "EPSG:32631"},
        "feature 1: coordinates 0.3, 0 are degrees",
    ),
}


@pytest.mark.parametrize("fault", LAYERS)
def test_a_wrong_layer_ends_in_one_line(write, call, tmp_path, fault):
    polygons, options, message = LAYERS[fault]
    write({})
    _write_layer(tmp_path / "town.gpkg", polygons, **options)
    code, _, err = call("pairs", "town.gpkg")
    assert (code, err.count("\n")) == (2, 1)
    assert message in err


def test_polygons_with_heights_are_footprints(write, call, tmp_path):
    write({})
    _write_layer(
        tmp_path / "town.gpkg",
        [shapely.force_3d(house, 3700.0) for house in HOUSES],
        kind="Polygon Z",
    )
    code, out, _ = call("pairs", "town.gpkg", "-o", "found.csv")
    assert code == 0
    assert "2 pairs, 2 of them touching, 0 rejected" in out


@pytest.mark.parametrize("extra", ["geopackage = true\n", "[totals]\nh3 = 8\n"])
def test_a_missing_extra_is_told_before_anything_is_read(write, call, monkeypatch, extra):
    for module in ("pyogrio", "h3"):
        monkeypatch.setitem(sys.modules, module, None)
    write({"run.toml": f"{extra}{RUN}" if extra.startswith("geo") else f"{RUN}{extra}"})
    code, _, err = call("run", "run.toml")
    assert (code, err.count("\n")) == (2, 1)
    assert "not installed: pip install 'per_obspy[gis]'" in err
