"""Files of pairs by their suffix, and Parquet files: booleans, row numbers, damage."""

import datetime

import numpy as np
import pandas as pd
import pytest
from pandas.testing import assert_frame_equal

from per_obspy import read_pairs
from per_obspy.errors import CatalogError
from per_obspy.inventory.files.formats import pair_file

PDF = b"%PDF-1.4\n"

#: content, name and message of files that are no pair table
WRONG_FILES = [
    (b"PAR1 no, it is not", "pairs.parquet", "not a Parquet table"),
    (b"", "pairs.parquet", "not a Parquet table"),
    (PDF, "pairs.parquet", "not a Parquet table: it is a PDF document"),
    (
        b"x",
        "town.gpkg",
        r"expected \.csv, .* or \.txt; per-obspy pairs makes such a table of footprints",
    ),
    (b"x", "pairs.xlsx", "not a readable workbook .* not a zip file"),
    (b"x", "pairs.ods", "not a readable workbook .* not a zip file"),
    (b"x", "pairs.numbers", "unknown suffix '.numbers', .* save the workbook as .xlsx"),
]


@pytest.mark.parametrize(("content", "name", "message"), WRONG_FILES)
def test_files_that_are_no_pair_table(tmp_path, content, name, message):
    (tmp_path / name).write_bytes(content)
    with pytest.raises(CatalogError, match=message) as error:
        pair_file(tmp_path / name)
    assert str(error.value).startswith(f"{tmp_path / name}: ")
    assert "\n" not in str(error.value)


@pytest.fixture
def table():
    """Three pairs as they are written to Parquet."""
    place = {"longitude_1": 0.3, "latitude_1": 0.1, "longitude_2": 0.3001, "latitude_2": 0.1}
    sizes = {"height_1": 9.0, "height_2": 12.0}
    names = pd.DataFrame({"pair_id": ["007", "008", "009"]})
    return names.assign(gap=[0.05, 0.1, 0.2], **place, **sizes).assign(
        latitude_2=[0.1, 0.1001, 0.1002]
    )


@pytest.mark.parametrize("damage", ["cut", "zeroed"])
def test_a_damaged_parquet_table(table, tmp_path, damage):
    table.to_parquet(tmp_path / "whole.parquet")
    whole = (tmp_path / "whole.parquet").read_bytes()
    # half the file, or zeros over its first pages
    if damage == "cut":
        damaged = whole[: len(whole) // 2]
    else:
        damaged = whole[:40] + bytes(300) + whole[340:]
    (tmp_path / "damaged.parquet").write_bytes(damaged)
    with pytest.raises(CatalogError, match=r"damaged\.parquet: not a Parquet table"):
        read_pairs(tmp_path / "damaged.parquet")


def test_booleans_are_observations(table, tmp_path):
    # would catch a column with empty cells, which pandas gives as objects
    table.assign(observed=[True, False, None]).to_parquet(tmp_path / "seen.parquet")
    observed = read_pairs(tmp_path / "seen.parquet")[["observed"]]
    assert_frame_equal(observed, pd.DataFrame({"observed": [1, 0, np.nan]}))


def test_an_index_of_pandas_is_a_column_or_left_out(table, tmp_path):
    # would catch names that become the index, and an index of numbers that becomes a column
    table.set_index("pair_id").to_parquet(tmp_path / "named.parquet")
    assert read_pairs(tmp_path / "named.parquet")["pair_id"].tolist() == ["007", "008", "009"]
    table.set_axis([5, 9, 7]).to_parquet(tmp_path / "numbered.parquet")
    found = read_pairs(tmp_path / "numbered.parquet")
    assert found.columns.tolist() == [
        "pair_id", "gap", "longitude_1", "latitude_1", "height_1",
        "longitude_2", "latitude_2", "height_2",
    ]  # fmt: skip
    assert_frame_equal(found, table[found.columns], check_dtype=False)


#: Values of a column that are no numbers, although programs turn them into some.
NO_NUMBERS = [
    [True, False, True],
    [True, None, False],
    pd.to_datetime(["2020-01-01"] * 3),
    pd.to_timedelta([1, 2, 3], unit="s"),
    [datetime.date(2020, 1, 1)] * 3,
    ["true", "yes", "TRUE"],
]


@pytest.mark.parametrize("values", NO_NUMBERS)
@pytest.mark.parametrize("name", ["gap", "height_1", "longitude_2", "mass_1"])
def test_truth_values_and_dates_are_no_numbers(table, tmp_path, name, values):
    # would catch a gap of 1 m that is a yes, and heights in nanoseconds since 1970
    wrong = table.assign(**{name: values})
    kinds = [".parquet", ".csv"]
    for kind in kinds:
        path = tmp_path / f"wrong{kind}"
        wrong.to_parquet(path) if kind == ".parquet" else wrong.to_csv(path, index=False)
        found = read_pairs(path)
        given = pd.Series(values).notna()
        # A row that can be screened without the cell is kept, with a note
        notes = found["cell_notes"].tolist() if "cell_notes" in found else []
        said = [*notes, *(row.reasons[0] for row in found.attrs["rejected"])]
        assert sum("is not a number" in text for text in said) == given.sum()
        is_needed = name in ("height_1", "longitude_2")
        assert len(found.attrs["rejected"]) == (len(given) if is_needed else 0)
        assert found[name].isna().all()
