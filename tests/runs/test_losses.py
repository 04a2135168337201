"""Losses of rows are counted against the run before and against a limit."""

import json

import numpy as np
import pyarrow as pa
import pytest

from per_obspy.config import Run, Totals
from per_obspy.errors import Rejection
from per_obspy.inventory.files.raw_rows import RawRows
from per_obspy.runs.losses import areas_left_out, losses, number_of_rows

SETTINGS = {"name": "lost", "output": "out", "records": {"folder": "records"}}


def _settings(share=None):
    """Return the settings of a run, with a limit if it is given."""
    limit = {} if share is None else {"largest_rejected_share": share}
    return Run.model_validate({**SETTINGS, "pairs": {"file": "pairs.csv", **limit}})


@pytest.mark.parametrize("content", ["", "[]", "{}", '{"counts": {}}', '{"counts": 3}'])
def test_a_record_without_counts_has_no_rows(tmp_path, content):
    (tmp_path / "run.json").write_text(content)
    assert number_of_rows(tmp_path / "run.json") is None
    assert number_of_rows(tmp_path / "absent.json") is None


def test_rows_are_used_and_rejected_pairs(tmp_path):
    (tmp_path / "run.json").write_text(json.dumps({"counts": {"pairs": 80, "rejected_pair": 3}}))
    assert number_of_rows(tmp_path / "run.json") == 83


def test_a_table_that_shrinks_is_a_loss_and_one_that_grows_is_none():
    counts = {"pairs": 6, "rejected_pair": 0}
    (sentence,) = losses(_settings(), counts, 83)
    assert "6 rows, 83 in the previous run" in sentence
    # rejected rows are no lost rows: the table still holds them
    assert losses(_settings(), {"pairs": 60, "rejected_pair": 23}, 83) == []
    assert losses(_settings(), counts, 6) == losses(_settings(), counts, None) == []


@pytest.mark.parametrize(("rejected", "is_loss"), [(10, False), (11, True)])
def test_a_share_of_rejected_rows_above_the_limit_is_a_loss(rejected, is_loss):
    # the limit itself is allowed
    found = losses(_settings(0.1), {"pairs": 100 - rejected, "rejected_pair": rejected}, None)
    assert bool(found) == is_loss
    if is_loss:
        assert "11 of 100 rows (11%)" in found[0]
        assert "largest_rejected_share = 0.1" in found[0]


def test_no_rows_are_no_loss():
    assert losses(_settings(0.0), {"pairs": 0, "rejected_pair": 0}, None) == []


def test_a_table_without_names_of_pairs_counts_rows_with_a_line():
    # would catch a screening by a spectrum that ends without a result where a pair is left out
    table = pa.table(
        {"longitude_1": ["20"], "latitude_1": ["10"], "longitude_2": ["20"], "latitude_2": ["10"]}
    )
    rows = RawRows("pairs.csv", table, np.array([2]), ())
    rejected = [Rejection("pair", "line 2", "", None, ("too far",))]
    assert areas_left_out(Totals(), rejected, rows) == {}
