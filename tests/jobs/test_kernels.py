"""Compilation of all kernels ahead of use."""

import pytest

from per_obspy.errors import Unfinished
from per_obspy.jobs import kernels


def test_all_parts_are_compiled_in_processes(call):
    # catches a part that a spawned process cannot import, and a command without progress
    code, out, err = call("warm-up")
    assert code == 0
    assert out == "all kernels are compiled\n"
    total = len(kernels.PARTS) + 1
    assert f"compiling kernels: {total} of {total}" in err


def test_a_part_that_fails_is_named(monkeypatch):
    # catches a warm-up that claims success although a later run would have to compile
    def fails(name):
        if name == "rows":
            raise ValueError("no room")
        return name

    monkeypatch.setattr(kernels, "compile_part", fails)
    monkeypatch.setattr(kernels, "usable_processors", lambda: 1)
    with pytest.raises(Unfinished, match=r"rows cannot be compiled: .*no room"):
        kernels.compile_kernels(lambda *_: None)
