"""Files of pairs: what is read, and each kind of file that cannot be."""

import numpy as np
import pandas as pd
import pytest
from pandas.testing import assert_frame_equal

from per_obspy import read_pairs
from per_obspy.errors import CatalogError
from per_obspy.inventory.files.reading import PairInventory

HEADER = "pair_id,gap,longitude_1,latitude_1,height_1,longitude_2,latitude_2,height_2,note"
GOOD = "007,0.05,-67.95,-20.35,12,-67.9501,-20.35,9.5,corner shop"


@pytest.fixture
def write(tmp_path):
    def write(content: str | bytes, name: str = "pairs.csv"):
        path = tmp_path / name
        path.write_bytes(content if isinstance(content, bytes) else content.encode())
        return path

    return write


def test_a_good_row(write):
    pairs = read_pairs(write(f"{HEADER}\n{GOOD}\n"))
    assert pairs.loc[0, "pair_id"] == "007"  # an identifier is text, whatever it looks like
    assert pairs.loc[0, ["gap", "height_1", "height_2"]].tolist() == [0.05, 12.0, 9.5]
    assert pairs.loc[0, "note"] == "corner shop"
    assert pairs.attrs["rejected"] == ()


def test_unknown_columns_of_numbers_stay_numbers(write):
    pairs = read_pairs(write(f"{HEADER},floor area ratio\n{GOOD},2.5\n"))
    assert pairs["floor area ratio"].dtype == np.float64


def test_parquet_gives_the_same_as_csv(write, tmp_path):
    pairs = read_pairs(write(f"{HEADER}\n{GOOD}\n{GOOD.replace('007', '008')}\n"))
    pairs.attrs.clear()
    pairs.to_parquet(tmp_path / "pairs.parquet")
    assert_frame_equal(read_pairs(tmp_path / "pairs.parquet"), pairs)


@pytest.mark.parametrize("ending", ["\n", "\r\n"])
def test_byte_order_mark_line_endings_blank_lines_and_spaces(write, ending):
    content = ending.join(
        ["\ufeff" + HEADER.replace("gap", " gap"), "", GOOD.replace("0.05", " 0.05 "), "", ""]
    )
    pairs = read_pairs(write(content))
    assert len(pairs) == 1
    assert pairs.loc[0, "gap"] == 0.05


def test_a_row_names_its_line_also_after_blank_and_broken_lines(write):
    # would catch line numbers counted from the rows that were read
    pairs = read_pairs(
        write(f"{HEADER}\n\n{GOOD}\n008,0.1\n{GOOD.replace('0.05', '-1').replace('007', '009')}\n")
    )
    assert len(pairs) == 1
    assert [(one.name, one.row) for one in pairs.attrs["rejected"]] == [("008", 4), ("009", 5)]
    assert pairs.attrs["rejected"][0].reasons == ("2 columns, the header has 9",)
    assert pairs.attrs["rejected"][1].reasons == ("gap = -1 m is outside 0 to 10 m",)


def test_a_comma_inside_quotes_is_no_separator(write):
    row = GOOD.replace("corner shop", '"shop, corner"')
    pairs = read_pairs(write(f"{HEADER}\n{row}\n"))
    assert pairs.loc[0, "note"] == "shop, corner"


def test_text_in_a_column_of_numbers_is_named_with_its_row(write):
    bad = GOOD.replace("0.05", "five").replace("007", "008")
    (rejection,) = read_pairs(write(f"{HEADER}\n{GOOD}\n{bad}\n")).attrs["rejected"]
    assert rejection[:4] == ("pair", "008", str(rejection.source), 3)
    assert rejection.reasons == ("gap = 'five' is not a number",)


def test_a_whole_column_of_text_rejects_rows_not_the_file(tmp_path):
    table = pd.DataFrame(
        {"pair_id": ["a"], "gap": ["1,5"], "longitude_1": [1.0], "latitude_1": [1.0]}
    )
    table = table.assign(longitude_2=1.0, latitude_2=1.0, height_1=3.0, height_2=3.0)
    table.to_parquet(tmp_path / "pairs.parquet")
    pairs = read_pairs(tmp_path / "pairs.parquet")
    assert pairs.empty
    assert pairs.attrs["rejected"][0].reasons == ("gap = '1,5' is not a number",)


@pytest.mark.parametrize(
    ("content", "name", "message"),
    [
        (b"", "pairs.csv", "not a CSV table: it is an empty file"),
        (f"{HEADER}\n", "pairs.csv", "the table has no rows"),
        (f"{HEADER}\n\n\n", "pairs.csv", "the table has no rows"),
        (f"{HEADER.replace('gap,', '')}\n{GOOD.replace('0.05,', '')}\n", "pairs.csv", "missing column gap "),
        (
            f"{HEADER.replace('height_2', 'hoehe_2')}\n{GOOD}\n",
            "pairs.csv",
            "missing column height_2 or storeys_2 or period_2 ",
        ),
        (f"{HEADER}\n{GOOD}\n".replace(",", ";"), "pairs.csv", "columns are separated by semicolons, commas are"),
        (f"{HEADER},gap\n{GOOD},0.1\n", "pairs.csv", "column gap stands more than once"),
        (f"{HEADER}\n{GOOD.replace('shop', 'café')}\n".encode("latin-1"), "pairs.csv",
         "line 2 is not UTF-8 .byte 0xe9 at position 57"),
        (f"{HEADER}\n{GOOD}\n".encode("utf-16"), "pairs.csv", "line 1 is not UTF-8"),
        (f"{HEADER}é\n{GOOD}\n".encode("latin-1"), "pairs.csv", "line 1 is not UTF-8"),
        (b"PAR1 no, it is not", "pairs.parquet", "not a Parquet table"),
        (b"", "pairs.parquet", "not a Parquet table"),
        (f"{HEADER}\n{GOOD}\n".replace(",", "\t"), "pairs.csv", "columns are separated by tabulators, commas are exp"),
        (f"{HEADER.upper()}\n{GOOD}\n", "pairs.csv", r"missing column pair_id, .*, did you mean PAIR_ID\?$"),
        (b"%PDF-1.4\n%\xe2\xe3\n", "pairs.csv", "not a CSV table: it is a PDF document"),
        (b"%PDF-1.4\n", "pairs.parquet", "not a Parquet table: it is a PDF document"),
        (b"PK\x03\x04" + bytes(range(256)), "pairs.csv", "it is a ZIP archive, as Excel workbooks are"),
        (bytes(100), "pairs.csv", "not a CSV table: it holds zero bytes"),
        (f"{HEADER}\n{GOOD}".encode() + b"\xc3", "pairs.csv", "line 2 is not UTF-8"),
        (b"x", "town.gpkg", r"expected .csv or .parquet; per-obspy pairs makes such a table of footprints"),
        (b"x", "pairs.xlsx", r"unknown suffix '.xlsx', expected .csv or .parquet"),
    ],
)  # fmt: skip
def test_files_that_are_wrong_as_a_whole(write, content, name, message):
    path = write(content, name)
    with pytest.raises(CatalogError, match=message) as error:
        read_pairs(path)
    assert str(error.value).startswith(f"{path}: ")
    assert "\n" not in str(error.value)


@pytest.mark.parametrize("damage", ["cut", "zeroed"])
def test_a_damaged_parquet_table(write, tmp_path, damage):
    read_pairs(write(f"{HEADER}\n{GOOD}\n")).to_parquet(tmp_path / "whole.parquet")
    whole = (tmp_path / "whole.parquet").read_bytes()
    damaged = {"cut": whole[: len(whole) // 2], "zeroed": whole[:40] + bytes(300) + whole[340:]}[
        damage
    ]
    with pytest.raises(CatalogError, match=r"damaged\.parquet: not a Parquet table"):
        read_pairs(write(damaged, "damaged.parquet"))


def test_truth_values_are_observations(write, tmp_path):
    # would catch a column with empty cells, which pandas gives as objects
    table = read_pairs(
        write("\n".join([HEADER, GOOD, GOOD.replace("007", "008"), GOOD.replace("007", "009")]))
    )
    table.assign(observed=[True, False, None]).to_parquet(tmp_path / "seen.parquet")
    assert_frame_equal(
        read_pairs(tmp_path / "seen.parquet")[["observed"]],
        pd.DataFrame({"observed": [1, 0, np.nan]}),
    )


def test_an_index_of_pandas_is_a_column_or_nothing(write, tmp_path):
    # would catch names that become the index, and an index of numbers that becomes a column
    table = read_pairs(write("\n".join([HEADER, GOOD, GOOD.replace("007", "008")])))
    table.attrs = {}
    table.set_index("pair_id").to_parquet(tmp_path / "named.parquet")
    assert read_pairs(tmp_path / "named.parquet")["pair_id"].tolist() == ["007", "008"]
    table.set_axis([5, 9]).to_parquet(tmp_path / "numbered.parquet")
    assert_frame_equal(read_pairs(tmp_path / "numbered.parquet"), table)


def test_names_that_are_no_text(write, tmp_path):
    table = read_pairs(write(f"{HEADER}\n{GOOD}\n"))
    table.assign(pair_id=[[1]]).to_parquet(tmp_path / "lists.parquet")
    with pytest.raises(CatalogError, match=r"lists\.parquet: .*[Uu]nsupported cast from list"):
        PairInventory([tmp_path / "lists.parquet"])


def test_a_table_of_broken_lines_alone_says_so_line_by_line(write):
    pairs = read_pairs(write(f"{HEADER}\n{GOOD.replace('corner', chr(34) + 'corner')}\n008,0.1\n"))
    assert pairs.empty
    assert [one.row for one in pairs.attrs["rejected"]] == [2]


def test_missing_file_and_folder(tmp_path):
    with pytest.raises(CatalogError, match="no such file"):
        read_pairs(tmp_path / "nowhere.csv")
    (tmp_path / "folder.csv").mkdir()
    with pytest.raises(CatalogError, match="no such file"):
        read_pairs(tmp_path / "folder.csv")
