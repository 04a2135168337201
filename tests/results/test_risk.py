"""The risk table on disk: ranks, text of the worst rows, pieces, single rows."""

import csv
import json
from pathlib import Path

import duckdb
import numpy as np
import pandas as pd
import pyarrow as pa
import pyarrow.parquet as pq
import pytest

from per_obspy.inventory.files.reading import read_pairs
from per_obspy.results import ranked_table as ranked_tables
from per_obspy.results import risk
from per_obspy.results.parts import write_part
from per_obspy.results.ranked_table import ranked_table
from per_obspy.results.risk import write_risk, write_worst
from per_obspy.screening.columns import CSV_COLUMNS
from per_obspy.screening.ranking import KEYS, in_order

COUNT = 300
FACTS = {"name": "a run", "simulated": "true"}


@pytest.fixture(scope="module")
def rows():
    """Rows of a risk table in the order of the inventory."""
    random = np.random.default_rng(7)
    # Text that CSV has to quote, empty cells, and numbers of many digits
    columns = {
        "pair_id": [f'pair "{number}", north' for number in random.permutation(COUNT)],
        "state": random.choice(["yes", "likely", "no"], COUNT),
        "probability": random.uniform(0, 1, COUNT),
        "weighted_velocity": random.choice([0.1, 1e-17 / 3, np.nan], COUNT),
        "station": random.choice(["", "XX.S001"], COUNT),
        "impacts": random.choice([0.0, 3.0, np.nan], COUNT),
    }
    return pd.DataFrame(columns)


@pytest.fixture
def parts(rows, tmp_path):
    paths = []
    for number, first in enumerate(range(0, COUNT, 100)):
        piece = rows.iloc[first : first + 100]
        paths.append(tmp_path / "chunks" / f"{number:06}.parquet")
        write_part(in_order(piece), number, paths[-1])
    return paths


@pytest.fixture
def expected(rows):
    """The whole table as pandas orders it in memory."""
    table = in_order(rows).drop(columns=list(KEYS))
    table.insert(0, "rank", np.arange(1, COUNT + 1))
    return table


def test_the_whole_is_ranked_and_counted(parts, expected, tmp_path):
    written = write_risk(parts, tmp_path, FACTS, csv_rows=COUNT)
    table = pd.read_parquet(tmp_path / "risk.parquet")
    pd.testing.assert_frame_equal(table, expected, check_dtype=False)
    assert written.states == expected["state"].value_counts().to_dict()
    # its facts, and the meaning of every column
    metadata = pq.read_schema(tmp_path / "risk.parquet").metadata
    assert FACTS.items() <= json.loads(metadata[b"per_obspy"]).items()
    columns = pd.read_csv(tmp_path / "risk.columns.csv")
    assert set(table) <= set(columns["name"])
    assert written.files == [
        tmp_path / f"risk{end}" for end in (".parquet", ".csv", ".columns.csv")
    ]


def _text(table, folder):
    """Return a table as the database writes it."""
    whole = pa.Table.from_pandas(table, preserve_index=False)
    with duckdb.connect() as database:
        database.register("whole", whole)
        query = "COPY whole TO $path (FORMAT csv, HEADER)"
        database.execute(query, {"path": str(folder / "expected.csv")})
    return (folder / "expected.csv").read_bytes()


SIZES = [(1, 1), (1, 50), (7, 1), (7, 50), (7, 299), (50, 50), (50, 120), (1000, 120), (1000, 5000)]


@pytest.mark.parametrize(("size", "csv_rows"), SIZES)
def test_text_of_the_worst_rows_does_not_depend_on_pieces(
    parts, tmp_path, monkeypatch, size, csv_rows
):
    # would catch a row too many, a header in the middle, and numbers in other digits than those of
    # the database that reads the whole table
    monkeypatch.setattr(risk, "ROWS", size)
    monkeypatch.setattr(ranked_tables, "ROWS", size)
    write_risk(parts, tmp_path, FACTS, csv_rows)
    path = tmp_path / "risk.parquet"
    # Numbers of five digits, of two by the contact law, by Python's own formatting
    table = pd.read_parquet(path).head(csv_rows)
    for name, digits in (("probability", 5), ("weighted_velocity", 2)):
        table[name] = [float(f"{value:.{digits - 1}e}") for value in table[name]]
    table["impacts"] = table["impacts"].astype("Int64")
    short = [name for name in CSV_COLUMNS if name in table]
    assert "impacts" not in short
    assert (tmp_path / "risk.csv").read_bytes() == _text(table[short], tmp_path)
    # all columns from the whole table
    write_worst(path, csv_rows, tmp_path / "again.csv")
    assert (tmp_path / "again.csv").read_bytes() == _text(table, tmp_path)
    assert sorted(path.name for path in tmp_path.glob(".*")) == []


def test_the_table_is_read_in_pieces(parts, expected, tmp_path, monkeypatch):
    write_risk(parts, tmp_path, FACTS, COUNT)
    monkeypatch.setattr(ranked_tables, "ROWS", 11)
    columns = ["rank", "state", "no such column"]
    with ranked_table([tmp_path / "risk.parquet"], columns) as table:
        pieces = list(table.pieces())
    assert max(map(len, pieces)) == 11
    whole = pd.concat(pieces, ignore_index=True)
    pd.testing.assert_frame_equal(whole, expected[["rank", "state"]], check_dtype=False)


def test_a_row_is_found_in_whichever_group_it_is(parts, expected, tmp_path, monkeypatch):
    monkeypatch.setattr(risk, "ROWS", 50)
    write_risk(parts, tmp_path, FACTS, COUNT)
    # first and last rows of groups
    with ranked_table([tmp_path / "risk.parquet"], ["rank"]) as table:
        assert table.pairs == COUNT
        assert pq.read_metadata(tmp_path / "risk.parquet").num_row_groups == COUNT // 50
        for rank in (1, 50, 51, 300):
            assert table.row(rank)["pair_id"] == expected["pair_id"][rank - 1]
        with pytest.raises(IndexError):
            table.row(COUNT + 1)


#: Names of folders that are patterns, addresses or worse to one library or another.
FOLDERS = ["run [2]", "out*", "a?b", "{x,y}", "it's", "new\nline", "a!b", "http:", "a::b", "%41"]


@pytest.mark.parametrize("name", FOLDERS)
@pytest.mark.parametrize("is_relative", [False, True])
def test_names_of_folders_are_literal(rows, expected, tmp_path, monkeypatch, name, is_relative):
    # would catch the rows of the folder that the name matches as a pattern: run 2, out1, acb
    for other in ("run 2", "out1", "acb", "x", "A"):
        write_part(in_order(rows.head(3)), 5, tmp_path / other / "000000.parquet")
        write_part(in_order(rows.head(3)), 6, tmp_path / other / "risk.parquet")
    monkeypatch.chdir(tmp_path)
    folder = Path(name) if is_relative else tmp_path / name
    write_part(in_order(rows), 0, folder / "000000.parquet")
    write_risk([folder / "000000.parquet"], folder, FACTS, csv_rows=COUNT)
    write_worst(folder / "risk.parquet", COUNT, folder / "again.csv")
    with ranked_table([folder / "risk.parquet"], ["pair_id"]) as table:
        pairs = pd.concat(table.pieces())["pair_id"].tolist()
    assert pairs == expected["pair_id"].tolist()
    again, short = (pd.read_csv((folder / name).absolute()) for name in ("again.csv", "risk.csv"))
    pd.testing.assert_frame_equal(again[list(short)], short)
    assert len(short) == COUNT


NAMES = ["pair_id", "gap", "longitude_1", "latitude_1", "longitude_2", "latitude_2"]


def test_no_text_of_the_table_is_a_formula_and_pairs_join_again(tmp_path):
    # would catch formulas in identifiers, carried columns and headers, and pairs that a table made
    # of all columns names otherwise than the inventory
    texts = [
        "=1+1",
        "+a",
        "-b",
        "@c",
        "\tx",
        "'=d",
        "''-e",
        "\uff1df",
        "-1",
        "plain, quoted",
        " =g",
    ]
    count = len(texts)
    table = pd.DataFrame({"pair_id": texts, "state": "yes", "station": "XX.A", "=note()": texts})
    table = table.assign(gap=0.1, probability=0.5, demand_ratio=0.1, height_1=-0.0, height_2=9.0)
    table = table.assign(**{name: -1.0 - np.arange(count) / 1e5 for name in NAMES[2:]})
    table = table.assign(height_1=9.0, Gap=1, gap_=2)
    write_part(in_order(table), 0, tmp_path / "part.parquet")
    write_risk([tmp_path / "part.parquet"], tmp_path, FACTS, csv_rows=COUNT)
    write_worst(tmp_path / "risk.parquet", COUNT, tmp_path / "whole.csv")
    with (tmp_path / "risk.csv").open(encoding="utf-8", newline="") as file:
        short = list(csv.reader(file))
    with (tmp_path / "whole.csv").open(encoding="utf-8", newline="") as file:
        written = list(csv.reader(file))
    for text in (cell for row in (*short, *written) for cell in row):
        is_number = text.lstrip("-").replace(".", "").isdecimal()
        assert is_number or not text.strip().startswith(("=", "+", "-", "@", "\uff1d"))
    assert "-1.00001" in {cell for row in written for cell in row}
    # names that differ in case only stay what they are
    assert {"gap", "Gap", "gap_", "'=note()"} <= set(written[0])
    # as a pair table
    ids = [text.strip() for text in texts]
    again = read_pairs(tmp_path / "whole.csv")
    assert again.attrs["rejected"] == ()
    assert set(again["pair_id"]) == set(ids)
    assert {text.strip() for text in again["=note()"]} == set(ids)
