"""Warming up reaches the kernels: it would be pointless if its pairs were rejected."""

import pytest

import per_obspy.screening.warmup as warmup


def test_every_pair_is_judged(monkeypatch):
    tables = []
    real = warmup.risk_table
    monkeypatch.setattr(warmup, "risk_table", lambda *arguments: tables.append(real(*arguments)))
    warmup.compile_screening()
    assert sorted(tables[0]["demand_rule"]) == ["exact", "exact", "srss"]
    assert tables[0]["impacts"].min() >= 1


@pytest.mark.parametrize("name", sorted(warmup.PARTS))
def test_every_part_compiles(name):
    # catches arguments that a function refuses: the part would then end in an error
    assert warmup.compile_part(name) == name
