"""Warming up reaches the kernels: it would be pointless if its pairs were rejected."""

import per_obspy.screening.warmup as warmup


def test_every_pair_is_judged(monkeypatch):
    tables = []
    real = warmup.risk_table
    monkeypatch.setattr(warmup, "risk_table", lambda *arguments: tables.append(real(*arguments)))
    warmup.compile_screening()
    assert sorted(tables[0]["demand_rule"]) == ["exact", "exact", "srss"]
    assert tables[0]["impacts"].min() >= 1
