"""Warming up reaches the kernels: it would be pointless if its pairs were rejected."""

import gc
from threading import current_thread, main_thread

import pytest

import per_obspy.screening.warmup as warmup


def test_every_pair_is_judged(monkeypatch):
    tables = []
    real = warmup.risk_table
    monkeypatch.setattr(warmup, "risk_table", lambda *arguments: tables.append(real(*arguments)))
    warmup.compile_screening()
    assert sorted(tables[0]["demand_rule"]) == ["exact", "exact", "srss"]
    assert tables[0]["impacts"].min() >= 1


def test_the_first_dataset_is_made_before_the_thread(monkeypatch):
    # would catch two threads importing Dask at once, which ended a run where Dask is installed
    threads = []
    monkeypatch.setattr(warmup, "are_stored", lambda *_: False)
    monkeypatch.setattr(warmup, "_station", lambda: threads.append(current_thread()))
    monkeypatch.setattr(warmup, "compile_screening", lambda: threads.append(current_thread()))
    with warmup.compiling(lambda *_: None):
        pass
    assert threads[0] is main_thread()
    assert threads[1] is not main_thread()
    # workers load what is stored: loading it here as well took half a second of one of two cores
    monkeypatch.setattr(warmup, "are_stored", lambda *_: True)
    with warmup.compiling(lambda *_: None):
        pass
    assert len(threads) == 2


@pytest.mark.parametrize("name", sorted(warmup.PARTS))
def test_every_part_compiles(name):
    # catches arguments that a function refuses: the part would then end in an error
    assert warmup.compile_part(name) == name


def test_what_is_left_of_a_part_is_not_searched_for_garbage(monkeypatch):
    # catches a search through all objects of the compiler after every part: 4 % of the time
    monkeypatch.setitem(warmup.PARTS, "none", lambda: None)
    before = gc.get_freeze_count()
    try:
        warmup.compile_part("none")
        assert gc.get_freeze_count() > before
        assert gc.isenabled()
    finally:
        gc.unfreeze()
