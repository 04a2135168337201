"""Compilation of all kernels ahead of use."""

import importlib
import os

import pytest
from numba import config

from per_obspy.errors import Unfinished
from per_obspy.kernels import _jit
from per_obspy.runs.tasks import kernels, parallel, worker_start

#: A part that compiles one small kernel instead of many large ones.
SMALL_PART = """
import os
from per_obspy.kernels._jit import kernel

@kernel
def third(value):
    return value / 3.0

def compile_part(name):
    assert third(3.0) == 1.0
    with open(os.path.join(os.path.dirname(__file__), f"{name}.process"), "w") as file:
        file.write(str(os.getpid()))
    return name
"""


def test_all_parts_are_compiled_in_processes(call, tmp_path, monkeypatch):
    # catches a kernel that is compiled but not stored for others, and a command without progress
    (tmp_path / "small_part.py").write_text(SMALL_PART)
    monkeypatch.syspath_prepend(tmp_path)
    monkeypatch.setattr(worker_start, "LOADED", ("per_obspy.kernels._jit",))
    small_part = importlib.import_module("small_part")
    monkeypatch.setattr(kernels, "compile_part", small_part.compile_part)
    monkeypatch.setattr(parallel, "usable_processors", lambda: 2)
    code, out, err = call("warm-up")
    assert code == 0
    assert out == "all kernels are compiled\n"
    total = len(kernels.PARTS)
    assert f"{kernels.COMPILING}: {total} of {total}" in err
    # Every part once, none in the process of the command
    done_in = {file.stem: int(file.read_text()) for file in tmp_path.glob("*.process")}
    assert set(done_in) == set(kernels.PARTS)
    assert os.getpid() not in done_in.values()
    assert config.DISABLE_JIT or list((tmp_path / "__pycache__").glob("small_part.third-*.nbc"))


def test_a_part_that_fails_is_named(monkeypatch):
    # catches a warm-up that claims success although a later run would have to compile
    def fails(name):
        if name == "histories":
            raise ValueError("no room")
        return name

    monkeypatch.setattr(kernels, "compile_part", fails)
    monkeypatch.setattr(parallel, "usable_processors", lambda: 1)
    with pytest.raises(Unfinished, match=r"histories cannot be compiled: .*no room"):
        kernels.compile_kernels(lambda *_: None)


def test_kernels_that_cannot_be_stored_are_refused(call, monkeypatch):
    # catches an image whose kernels every start compiles again, although its warm-up succeeded
    def no_folder(function):
        raise RuntimeError(f"cannot cache function {function.__name__!r}: no locator available")

    monkeypatch.setattr(_jit, "SharedCache", no_folder)
    code, out, err = call("warm-up")
    assert code == 75
    assert not out
    assert "compiled kernels: cannot be written: set NUMBA_CACHE_DIR" in err
