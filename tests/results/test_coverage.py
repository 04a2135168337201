"""Coverage of a screening: kinds of reasons, counts, and the account of a search."""

import json
import tracemalloc

import numpy as np
import pandas as pd
import pyarrow.parquet as pq
import pytest

from per_obspy.errors import Rejection
from per_obspy.inventory.checking import checked_pairs
from per_obspy.inventory.files.writing import write_pairs
from per_obspy.results.coverage import (
    MOST_KINDS,
    OTHERS,
    Coverage,
    CoverageTally,
    Search,
    as_metadata,
    kind_of,
    search_account,
    search_of_table,
)
from per_obspy.results.table_files import write_rejected

PLACE = {"longitude_1": 20.0, "latitude_1": 10.0, "longitude_2": 20.0001, "latitude_2": 10.0}
GOOD = {"pair_id": "P", "gap": 0.1, "height_1": 9.0, "height_2": 9.0, **PLACE}


@pytest.mark.parametrize(
    ("change", "expected"),
    [
        ({"height_1": np.nan}, "no height, storeys or period"),
        ({"gap": -0.1}, "gap: out of range"),
        ({"longitude_2": np.nan}, "longitude: empty"),
        ({"longitude_1": 2345678.0}, "longitude: out of range"),
        ({"longitude_1": 0.0, "latitude_1": 0.0}, "position 0, 0"),
        ({"latitude_2": 11.0}, "positions too far apart"),
        ({"storeys_1": 30.0}, "height and storeys disagree"),
        ({"contact_height": 12.0}, "contact height above the lower building"),
        ({"building_id_1": "B", "building_id_2": "B"}, "a building paired with itself"),
    ],
)
def test_reasons_of_the_checks_have_kinds_without_values(change, expected):
    table = pd.DataFrame([GOOD | change])
    (rejection,) = checked_pairs(table, "pairs.csv").attrs["rejected"]
    assert kind_of(rejection.reasons) == expected


@pytest.mark.parametrize(
    ("reasons", "expected"),
    [
        (["nearest station XX.A is 91234 m away, beyond 30000 m"], "no station within reach"),
        (["no station has coordinates"], "no station with coordinates"),
        # A map is asked where no station serves a pair: it decides
        (
            ["no station has coordinates", "longitude = 3 is outside the ShakeMap's 4 to 5"],
            "outside the ShakeMap",
        ),
        (["period_1 = 9 s is outside the spectrum's 0.01 to 4 s"], "outside the spectrum"),
        (["footprints overlap by 12 m2, 30% of the smaller one"], "footprints overlap"),
        (["pair_id = 'A' occurs in an earlier row already"], "repeated"),
        (["7 columns, the header has 9"], "broken line"),
        (["something 12.5 odd about 'Torre 7'"], "something … odd about …"),
        ([], OTHERS),
    ],
)
def test_other_reasons_have_kinds_too(reasons, expected):
    assert kind_of(reasons) == expected


def test_every_row_counts_once_and_the_most_frequent_kind_comes_first():
    tally = CoverageTally()
    for reasons, times in ((["gap is empty", "gap = 'x' is not a number"], 2), (["no gap"], 5)):
        tally.add(Rejection("pair", "P", "", None, tuple(reasons)) for _ in range(times))
    found = tally.coverage({"pairs": 13, "rejected_pair": 7})
    assert list(found.left_out.items()) == [("no gap", 5), ("gap: empty", 2)]
    assert sum(found.left_out.values()) == found.rows - found.screened


def test_a_million_different_reasons_take_no_memory():
    tally = CoverageTally()
    letters = "abcdefghijklmnopqrstuvwxyz"
    tracemalloc.start()
    words = ("".join(letters[(n >> shift) % 26] for shift in (0, 4, 8, 12)) for n in range(50_000))
    tally.add(Rejection("pair", "", "", None, (f"odd {word}",)) for word in words)
    _, peak = tracemalloc.get_traced_memory()
    tracemalloc.stop()
    found = tally.coverage({"pairs": 0, "rejected_pair": 50_000})
    assert len(found.left_out) == MOST_KINDS + 1
    assert list(found.left_out)[-1] == OTHERS
    assert sum(found.left_out.values()) == 50_000
    # Counters of some hundred texts; the texts themselves would be 4 MB
    assert peak < 1_000_000


@pytest.mark.parametrize(("screened", "many"), [(100, False), (67, False), (66, True), (0, True)])
def test_a_third_without_a_verdict_is_much(screened, many):
    assert Coverage(99 if screened == 66 else 100, screened).lacks_many == many


def test_neighbours_that_the_search_left_out_count_as_well():
    """All rows of the table are screened, and yet three quarters have no verdict."""
    found = Coverage(449, 449, search=Search(449, {"no height, storeys or period": 1469}))
    assert found.pairs == 1918
    assert found.lacks_many
    # A table that was shortened after the search lost those pairs too
    assert Coverage(400, 400, search=Search(449, {"repeated": 1})).pairs == 450


def test_a_record_holds_it_and_an_older_one_what_it_counted():
    found = Coverage(
        9, 5, {"repeated": 4}, [("ward", 4)], Search(9, {"a": 1}, {"b": 2}, [("c", 1)])
    )
    stored = json.loads(json.dumps({"coverage": found.as_record()}))
    back = Coverage.of_record(stored)
    assert (back.rows, back.screened, back.left_out) == (9, 5, {"repeated": 4})
    assert back.search.neighbours == 10
    assert [tuple(area) for area in back.areas] == [("ward", 4)]
    old = Coverage.of_record({"counts": {"pairs": 5, "rejected_pair": 4}})
    assert (old.rows, old.screened, old.left_out) == (9, 5, {OTHERS: 4})


REJECTED = [
    Rejection("pair", "A/B", "houses.gpkg", None, ("none of height_1, storeys_1 is a number",)),
    Rejection("pair", "A/C", "houses.gpkg", None, ("none of height_1, storeys_1 is a number",)),
    Rejection("building", "feature 3", "houses.gpkg", 3, ("no geometry",)),
]


@pytest.mark.parametrize("name", ["pairs.parquet", "pairs.csv"])
def test_a_pair_table_carries_the_account_of_its_search(tmp_path, name):
    account = search_account(1, REJECTED, ["r0 c0", "r0 c0"])
    write_pairs(pd.DataFrame([GOOD]), tmp_path / name, as_metadata(account))
    if name == "pairs.csv":
        write_rejected(REJECTED, tmp_path / "pairs.rejected.csv")
    found = search_of_table(tmp_path / name, 1)
    assert found.neighbours == 3
    assert found.left_out == {"no height, storeys or period": 2}
    assert found.buildings == {"no outline": 1}
    # The table itself is what it was, for pandas too
    if name == "pairs.parquet":
        assert pd.read_parquet(tmp_path / name).to_dict("records") == [GOOD]
        assert [tuple(area) for area in found.areas] == [("r0 c0", 2)]


@pytest.mark.parametrize(
    "text",
    [
        "",
        "name,reasons\nA,b\n",
        "kind,name,source,row,reasons\nstation,XX.A,,,clipped\n",
        "kind,name,source,row,reasons\npair,A\n",
    ],
)
def test_another_table_of_that_name_is_no_account(tmp_path, text):
    (tmp_path / "pairs.rejected.csv").write_text(text)
    assert search_of_table(tmp_path / "pairs.csv", 7) is None


@pytest.mark.parametrize("text", [b"", b"[]", b"{", b'{"pairs": 1, "odd": 2}', b"\xff"])
def test_damaged_metadata_are_no_account(tmp_path, text):
    write_pairs(pd.DataFrame([GOOD]), tmp_path / "pairs.parquet", {b"per_obspy_search": text})
    assert b"per_obspy_search" in pq.read_schema(tmp_path / "pairs.parquet").metadata
    assert search_of_table(tmp_path / "pairs.parquet", 1) is None
