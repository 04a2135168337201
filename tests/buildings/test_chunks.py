"""Chunks of rows as jobs: keys, resumed parts, and rows without a record."""

from pathlib import Path

import numpy as np
import pandas as pd
import pyarrow as pa
import pytest

from per_obspy.buildings.columns import ROWS
from per_obspy.runs.tasks import building_rows
from per_obspy.runs.tasks.building_rows import RowsTask
from per_obspy.runs.tasks.parallel import Workers, finish
from per_obspy.runs.tasks.parts import rejections


def contacts(**changes):
    """Return a row of three buildings and a row of two, with the columns of their interfaces."""
    table = {column.name: np.zeros(3) for column in ROWS if column.dtype != "str"}
    texts = {column.name: np.array(["a", "b", "c"]) for column in ROWS if column.dtype == "str"}
    table |= texts | {"row_id": np.array(["R-a", "R-a", "R-c"])}
    return pa.Table.from_pandas(pd.DataFrame(table | {"flags": ["", "", "fork"]} | changes))


@pytest.fixture
def jobs(tmp_path):
    def jobs(**changes):
        part = tmp_path / "rows" / "000000.parquet"
        return [RowsTask(number=0, contacts=contacts(**changes), station=None, part=part)]

    return jobs


def done(jobs):
    return list(finish(jobs, Workers(1)))


def test_without_a_record_there_is_no_history(jobs):
    (part,) = done(jobs())
    table = pd.read_parquet(part.path)
    assert table["impacts"].isna().all()
    assert table["flags"].tolist() == ["", "", "fork"]
    assert list(rejections([part])) == []


def test_the_same_chunk_is_not_done_again(jobs):
    assert not done(jobs())[0].resumed
    assert done(jobs())[0].resumed
    assert not done(jobs(gap=np.full(3, 0.1)))[0].resumed


def test_a_chunk_that_fails_has_a_reason_for_every_row_and_is_done_again(jobs, monkeypatch):
    computed = building_rows.no_outcomes

    def failing(_count):
        monkeypatch.setattr(building_rows, "no_outcomes", computed)
        raise TypeError("a fault of the program")

    monkeypatch.setattr(building_rows, "no_outcomes", failing)
    (part,) = done(jobs())
    assert part.failed
    assert {rejection.name for rejection in rejections([part])} == {"R-a", "R-c"}
    assert pd.read_parquet(part.path)["flags"].tolist() == [
        "no_history",
        "no_history",
        "fork no_history",
    ]
    assert not done(jobs())[0].resumed


def test_a_chunk_is_named_by_its_rows(jobs):
    (job,) = jobs()
    assert job.name == "rows of buildings from R-a to R-c"
    assert job.part == Path(job.part)
