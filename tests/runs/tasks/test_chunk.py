"""Chunks as jobs: each has a part or reasons, a key, and faults that cost one pair only."""

import errno
import json

import pytest

from per_obspy.config import Building, Interpolation, Screening
from per_obspy.errors import Unfinished
from per_obspy.inventory.files.reading import PairInventory
from per_obspy.runs.tasks import chunk
from per_obspy.runs.tasks.chunk import ChunkTask
from per_obspy.runs.tasks.ground_files import ground_files
from per_obspy.runs.tasks.parallel import Workers, finish
from per_obspy.runs.tasks.parts import rejections

HEADER = "pair_id,longitude_1,latitude_1,height_1,longitude_2,latitude_2,height_2,gap\n"
ROWS = [f"p{number},0.3,0.1,10,0.3001,0.1,12,0.05\n" for number in range(7)]


@pytest.fixture
def make_jobs(tmp_path):
    """Return a function that makes the jobs of an inventory, three rows each."""

    def make_jobs(rows=ROWS, **changes):
        (tmp_path / "pairs.csv").write_text(HEADER + "".join(rows))
        inventory = PairInventory([tmp_path / "pairs.csv"])
        # Without stations every pair is rejected, so that no motion is needed
        ground, _ = ground_files([], (), Interpolation())
        common = {"ground": ground, "building": Building(), "screening": Screening()} | changes
        return [
            ChunkTask(
                number=number, chunk=rows, part=tmp_path / "chunks" / f"{number}.parquet", **common
            )
            for number, rows in enumerate(inventory.chunks(3))
        ]

    return make_jobs


def done(jobs):
    return sorted(finish(jobs, Workers(1)), key=lambda part: part.number)


def reasons(parts):
    return {rejection.name: rejection.reasons for rejection in rejections(parts)}


def test_every_row_is_in_a_part(make_jobs):
    parts = done(make_jobs())
    assert [(part.number, part.rows, part.resumed) for part in parts] == [
        (0, 3, False),
        (1, 3, False),
        (2, 1, False),
    ]
    assert set(reasons(parts)) == {f"p{number}" for number in range(7)}


def test_only_what_has_changed_is_done_again(make_jobs):
    before = reasons(done(make_jobs()))
    parts = done(make_jobs())
    assert all(part.resumed for part in parts)
    assert reasons(parts) == before
    # a row of the second chunk
    changed = [*ROWS[:4], ROWS[4].replace("0.05", "0.06"), *ROWS[5:]]
    assert [part.resumed for part in done(make_jobs(changed))] == [True, False, True]


def test_settings_and_ground_motion_are_part_of_the_key(make_jobs):
    ground = make_jobs()[0].ground
    done(make_jobs())
    for change in (
        {"building": Building(damping=0.03)},
        {"screening": Screening(largest_distance=1000.0)},
        {"ground": ground._replace(key="another")},
    ):
        assert not any(part.resumed for part in done(make_jobs(**change)))


@pytest.mark.parametrize("content", ["", "[]", '{"key": "', '{"key": "x", "outputs": {}}'])
def test_a_damaged_status_is_made_again(make_jobs, content):
    parts = done(make_jobs())
    parts[1].status.write_text(content)
    assert [part.resumed for part in done(make_jobs())] == [True, False, True]


def test_a_pair_that_cannot_be_computed_costs_no_other(make_jobs, monkeypatch):
    # would catch a pair that takes its half of the chunk with it
    computed = chunk.risk_rows

    def fails_for_two(pairs, *others):
        if pairs["pair_id"].isin(["p1", "p5"]).any():
            raise ValueError("no luck")
        return computed(pairs, *others)

    # the other pairs of the same chunks keep their own reasons
    monkeypatch.setattr(chunk, "risk_rows", fails_for_two)
    found = reasons(done(make_jobs()))
    assert [name for name, reason in found.items() if reason == ("no luck",)] == ["p1", "p5"]
    assert len(found) == 7


def _is_broken(_):
    raise RuntimeError("no luck")


def test_a_chunk_whose_work_failed_is_done_by_the_next_run(make_jobs, monkeypatch):
    # each row has the reason, and the status is not valid
    monkeypatch.setattr(ChunkTask, "do", _is_broken)
    found = reasons(done(make_jobs()))
    assert set(found.values()) == {("RuntimeError: no luck",)}
    assert len(found) == 7
    monkeypatch.undo()
    parts = done(make_jobs())
    assert not any(part.resumed for part in parts)
    assert json.loads(parts[0].status.read_text())["key"]


MACHINE = [MemoryError("no more"), OSError(errno.EIO, "Input/output error", "S1.nc")]


@pytest.mark.parametrize("error", MACHINE)
def test_a_chunk_at_which_the_machine_failed_has_no_result(make_jobs, monkeypatch, error):
    # would catch 100 000 pairs that are rejected because memory was short
    computed = ChunkTask.do

    def fails_for_one(job):
        if job.number == 1:
            raise error
        return computed(job)

    monkeypatch.setattr(ChunkTask, "do", fails_for_one)
    with pytest.raises(Unfinished, match=r"pairs.csv, lines 5 to 7: ") as unfinished:
        done(make_jobs())
    assert len(unfinished.value.faults) == 1
    monkeypatch.undo()
    assert [part.resumed for part in done(make_jobs())] == [True, False, True]
