"""Descriptions by ``per-obspy info`` of every kind of input and result."""

import json

import pandas as pd
import pytest

from per_obspy.config import Scenario
from per_obspy.errors import CatalogError
from per_obspy.runs.inputs.description import MOST_ROWS, describe
from per_obspy.simulation.earthquake import simulate, write_simulation

HEADER = "pair_id,longitude_1,latitude_1,height_1,longitude_2,latitude_2,height_2,gap,ward\n"
ROWS = "a,0.3,0.1,10,0.3002,0.1,12,0.05,N\nb,0.4,0.1,10,0.4002,0.1,30,0,N\nc,0,0,10,0,0,30,-1,S\n"

SHAKEMAP = """<?xml version="1.0"?>
<shakemap_grid xmlns="x" event_id="us1" shakemap_event_type="{kind}">
<grid_specification lon_min="0" lat_min="0" lon_max="1" lat_max="1" nominal_lon_spacing="1"
 nominal_lat_spacing="1" nlon="2" nlat="2"/>
<grid_field index="1" name="LON" units="dd"/><grid_field index="2" name="LAT" units="dd"/>
<grid_field index="3" name="PGA" units="pctg"/><grid_field index="4" name="PSA03" units="pctg"/>
<grid_field index="5" name="PSA10" units="pctg"/><grid_field index="6" name="PSA30" units="pctg"/>
<grid_data>
0 1 10 20 10 5
1 1 40 80 40 20
0 0 10 20 10 5
1 0 20 40 20 10
</grid_data></shakemap_grid>
"""


def _facts(path):
    found = describe(str(path))
    json.dumps(found.values)
    return found, dict(found.lines)


def test_records(tmp_path):
    scenario = Scenario(stations=2, dt=0.02, magnitude=6.5)
    simulation = simulate(scenario)
    write_simulation(simulation, tmp_path)
    found, lines = _facts(tmp_path)
    assert (found.kind, found.title) == ("records", "6 records of 2 stations, 0 rejected")
    assert (lines["stations"], lines["interval"]) == ("XX.S001, XX.S002", "0.02 s")
    assert lines["simulated"] == "6 records are SIMULATED."
    assert "2 stations, 6 records" in lines["earthquake 1"]
    # the largest distance from the mean; counts of 5 micro-m/s2
    peak = max(abs(trace.data - trace.data.mean()).max() for trace in simulation.stream) / 2e5
    assert lines["largest"].startswith(f"{peak:.3g} m/s2 of XX.S00")
    assert len(found.places["^"][0]) == 2
    assert len(found.values["records"]) == 6
    # the description of the earthquake and of the stations beside them
    assert _facts(tmp_path / "event.xml")[1]["magnitude"] == "Mw 6.5"
    assert _facts(tmp_path / "stations.xml")[0].title == "2 stations"


def test_a_pair_table(tmp_path):
    (tmp_path / "pairs.csv").write_text(HEADER + ROWS)
    found, lines = _facts(tmp_path / "pairs.csv")
    assert found.title == "3 rows, 2 usable, 1 rejected"
    assert lines["gap"] == "0 to 0.05 m; 0 in 1 pair, unknown in 0"
    assert lines["height"] == "10 to 30 m"
    assert "period_1 (2)" in lines["derived"]
    assert lines["unknown"] == "ward: carried along unchanged"
    assert lines["rejected"].startswith("line 4: gap = -1")
    assert found.places[""] == (pytest.approx([0.3001, 0.4001]), [0.1, 0.1])
    # a folder with one table stands for it
    assert _facts(tmp_path)[0] == found


def test_a_large_pair_table_is_described_by_its_first_rows(tmp_path):
    count = MOST_ROWS + 1
    row = {"longitude_1": 0.3, "latitude_1": 0.1, "height_1": 10.0, "gap": 0.1}
    row |= {"longitude_2": 0.3001, "latitude_2": 0.1, "height_2": 10.0}
    table = pd.DataFrame(row, index=range(count)).assign(pair_id=range(count))
    table.to_parquet(tmp_path / "pairs.parquet")
    found, _ = _facts(tmp_path / "pairs.parquet")
    assert found.title == "the first 100000 of 100001 rows, 100000 usable, 0 rejected"


def test_a_table_without_a_usable_row_is_not_usable(tmp_path):
    (tmp_path / "pairs.csv").write_text(HEADER + ROWS.splitlines()[2])
    found, _ = _facts(tmp_path / "pairs.csv")
    assert not found.usable


@pytest.mark.real_data
def test_footprints(real_data):
    folder = real_data / "inventories" / "footprints"
    found, lines = _facts(folder / "san_jose_pilot_region_all_fields.gpkg")
    # four null geometries are in the file on purpose
    assert found.title == "911 outlines, 4 rejected"
    assert "n_storeys (657)" in lines["columns"]
    assert lines["rejected"].endswith("no geometry")
    # the pilot region in San José, Costa Rica
    assert all(-84.2 < one < -84.0 for one in found.places[""][0])


@pytest.mark.parametrize("kind", ["ACTUAL", "SCENARIO"])
def test_a_shakemap(tmp_path, kind):
    (tmp_path / "grid.xml").write_text(SHAKEMAP.format(kind=kind))
    found, lines = _facts(tmp_path / "grid.xml")
    assert found.title == "2 by 2 points"
    # 40 % of gravity
    assert lines["largest"] == "3.92 m/s2 of PGA"
    assert lines["periods"] == "0.3 s, 1 s, 3 s"
    assert ("SIMULATED" in lines["earthquake"]) == (kind == "SCENARIO")
    # the strongest corner, half of it, and a quarter of it
    assert found.places["#"] == ([1.0, 1.0], [0.0, 1.0])
    assert found.places["+"] == ([0.0, 0.0], [0.0, 1.0])


def test_a_design_spectrum(tmp_path):
    (tmp_path / "design.csv").write_text("period,damping,sd\n0.1,0.05,0.01\n2.0,0.05,0.3\n")
    found, lines = _facts(tmp_path / "design.csv")
    assert (found.title, lines["periods"]) == ("2 periods, 1 dampings", "0.1 to 2 s")
    assert lines["largest"] == "0.3 m of displacement"


def test_configurations(tmp_path):
    (tmp_path / "run.toml").write_text(
        'name = "x"\noutput = "out"\n[records]\nfolder = "absent"\n[pairs.simulated]\n'
        "count = 7\n[spectra]\ncount = 100\n"
    )
    found, lines = _facts(tmp_path / "run.toml")
    assert lines["pairs.simulated.count"] == "7"
    assert lines["results"].endswith("out (not there yet)")
    # what has its default is not listed
    assert "spectra.count" not in lines
    (tmp_path / "e.toml").write_text(
        'name = "e"\noutput = "o"\n[[scenario]]\nname = "near"\nrun = "run.toml"\nweight = 1\n'
    )
    found, lines = _facts(tmp_path / "e.toml")
    assert (found.title, lines["near"]) == ("1 scenario", str(tmp_path / "run.toml"))
    (tmp_path / "s.toml").write_text("[scenario]\nmagnitude = 6.5\nstations = 3\n")
    assert _facts(tmp_path / "s.toml")[1]["stations"] == "3"
    (tmp_path / "wrong.toml").write_text("name = 1\n")
    with pytest.raises(CatalogError, match=r"wrong\.toml: "):
        describe(str(tmp_path / "wrong.toml"))


def test_an_identifier_is_not_looked_up():
    found, _ = _facts("us7000abcd")
    assert (found.kind, found.title) == ("identifier of an earthquake", "not looked up")


def test_damaged_results_are_one_line(tmp_path):
    (tmp_path / "run.json").write_text("{")
    with pytest.raises(CatalogError, match=r"run\.json: cannot be read"):
        describe(str(tmp_path))
    (tmp_path / "spectra.nc").write_bytes(b"CDF\x01" + bytes(100))
    with pytest.raises(CatalogError, match="holds no spectra of stations"):
        describe(str(tmp_path / "spectra.nc"))
