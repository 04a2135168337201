"""``per-obspy screen`` by a design spectrum as a user meets it."""

import json
from pathlib import Path

import pandas as pd
import pytest

from per_obspy.cli.printing import why_nothing
from per_obspy.errors import Rejection
from per_obspy.results.table_files import write_rejected

PAIRS = """\
pair_id,longitude_1,latitude_1,height_1,period_1,longitude_2,latitude_2,height_2,period_2,gap,owner
a,0.3,0.0,12,0.5,0.3001,0.0,12,1.0,0.05,x
b,0.3,0.0,12,0.5,0.3001,0.0,12,9.0,0.05,y
"""


@pytest.fixture
def screened(call, tmp_path):
    """Exit code, output and errors of the command on a small case."""
    (tmp_path / "code.csv").write_text("period,damping,sd\n0.1,0.05,0.01\n4.0,0.05,0.4\n")
    (tmp_path / "pairs.csv").write_text(PAIRS)
    (tmp_path / "design.toml").write_text(
        'spectrum = "code.csv"\npairs = "pairs.csv"\noutput = '
        '"out"\n[screening.codes]\ngb_intensity = 8\nrules = ["gem", "gb50011-2010"]\n'
    )

    return lambda *arguments: call("screen", tmp_path / "design.toml", *arguments)


def test_pairs_are_screened_and_every_column_is_described(screened, tmp_path):
    code, out, _ = screened()
    assert code == 0
    assert "1 pair (1 yes, 0 likely, 0 possible, 0 unlikely, 0 no), 1 rejected" in out
    table = pd.read_csv(tmp_path / "out" / "design.csv")
    described = pd.read_csv(tmp_path / "out" / "design.columns.csv").set_index("name")
    whole, columns = pd.read_parquet(tmp_path / "out" / "design.parquet"), described["meaning"]
    assert columns.index.tolist() == list(whole)
    # The text has the columns that a reader needs, in its own order
    assert len(table.columns) <= 30
    assert set(table) == set(described.index[described["in_csv"] == "yes"])
    assert table["gap_suffices"].tolist() == ["no"]
    assert table["required_gap_gem"].tolist() == [0.48]  # 0.04 of 12 m
    carried = columns[columns.str.startswith("carried")].index.tolist()
    assert carried == ["owner"]
    assert "GB 50011-2010" in columns["required_gap_gb50011_2010"]
    rejected = pd.read_csv(tmp_path / "out" / "rejected.csv")
    assert rejected["reasons"].tolist() == ["period_2 = 9 s is outside the spectrum's 0.1 to 4 s"]
    pd.testing.assert_frame_equal(whole[["gap"]], table[["gap"]])


def test_a_folder_stands_for_its_only_configuration(screened, tmp_path, call):
    code, out, _ = call("screen", tmp_path)
    assert (code, out) == screened()[:2]


def test_coverage_comes_first_and_numbers_have_units(screened):
    _, out, _ = screened()
    lines = out.splitlines()
    assert lines[0].startswith("1 of 2 neighbouring pairs (50 %) have NO VERDICT")
    assert lines[1].startswith("1 of 2 rows of the pair table are screened; left out: 1 (1 out")
    assert "areas most affected: 0.004 N, 0.301 E: 1" in lines[1]
    head = next(line for line in lines if "pair id" in line)
    for unit in ("(s)", "(m)", "(m/s)", "(%)"):
        assert unit in out
    assert "gap (m)" in head


def test_a_pair_of_no_place_is_told_by_its_reason(tmp_path):
    """Catch a last line that names a record of another earthquake while no pair has a station."""
    other = "belongs to another earthquake: starts 2020-01-01, the screened one 2021-01-01"
    record = Rejection("record", "XX.A..HNE", "a.mseed", None, (other,))
    station = Rejection("station", "XX.B", "b", None, ("its coordinates are unknown",))
    pairs = [
        Rejection("pair", f"P{i}", "p.csv", i, ("no station has coordinates",)) for i in (1, 2)
    ]
    write_rejected([record, station, *pairs], tmp_path / "rejected.csv")
    said = why_nothing(tmp_path / "rejected.csv")
    assert said.startswith(f"no usable record or pair: see {tmp_path / 'rejected.csv'}; first pair")
    assert "P1: no station has coordinates; 2 pairs: no station with coordinates" in said
    assert said.endswith("1 station: its coordinates are unknown")
    # It is said where nothing else is there
    write_rejected([record], tmp_path / "rejected.csv")
    assert other in why_nothing(tmp_path / "rejected.csv")


def test_json_is_for_machines(screened):
    code, out, _ = screened("--json")
    said = json.loads(out)
    assert code == 0
    assert (said["pairs"], said["yes"], said["rejected"]) == (1, 1, 1)
    # table, meanings, totals, summary, overview and page; rejections last
    assert [Path(file).name for file in said["files"]] == [
        *("design.csv", "design.parquet", "design.columns.csv", "totals.csv"),
        *("summary.txt", "summary.pdf", "design.kml", "overview.png", "report.html"),
        "rejected.csv",
    ]


def test_a_wrong_spectrum_stops_with_one_line(screened, tmp_path):
    (tmp_path / "code.csv").write_text("period,damping,psa\n0.1,0.05,980\n4.0,0.05,100\n")
    code, _, err = screened()
    assert code == 2
    assert err.count("\n") == 1
    assert "code.csv: psa = 980 m/s2 in row 1: in other units?" in err


def test_a_rate_of_a_spectrum_without_rates_is_refused(screened, tmp_path):
    settings = tmp_path / "design.toml"
    settings.write_text("target_rate = 0.01\n" + settings.read_text())
    code, _, err = screened()
    assert code == 2
    assert "design.toml: target_rate: spectrum is no hazard" in err


def test_nothing_inside_the_spectrum_exits_with_3(screened, tmp_path):
    (tmp_path / "pairs.csv").write_text(PAIRS.replace("12,0.5", "12,7.5"))
    code, _, err = screened()
    assert code == 3
    assert "rejected.csv" in err


def test_results_go_where_they_are_asked_for(screened, tmp_path):
    assert screened("-o", str(tmp_path / "elsewhere"))[0] == 0
    assert (tmp_path / "elsewhere" / "design.csv").is_file()
    assert not (tmp_path / "out").exists()


@pytest.mark.parametrize(
    ("text", "message"),
    [
        (
            'name = "x"\noutput = "out"\n',
            "no ground motion to screen by: give records or simulation",
        ),
        ("[scenario]\nmagnitude = 7.0\n", "no ground motion to screen by"),  # what `simulate` takes
        ("spectrum = ", "cannot be read as TOML"),
        ('spectrum = "code.csv"\npairs = "pairs.csv"\n', "output: Field required"),
        (
            'spectrum = "code.csv"\nsimulation = "s.toml"\noutput = "out"\n',
            "simulation: unknown key",
        ),
        ('simulation = "s.toml"\n', "name: Field required"),
    ],
)
def test_a_configuration_of_another_kind_stops_with_one_line(screened, tmp_path, text, message):
    (tmp_path / "design.toml").write_text(text)
    code, _, err = screened()
    assert code == 2
    assert err.count("\n") == 1
    assert "design.toml: " in err
    assert message in err
