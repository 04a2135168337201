"""Compiler options of all kernels: per_obspy.kernels._jit."""

import math
from pathlib import Path
from threading import Thread

import numpy as np
import pytest
from filelock import FileLock
from numba.core import caching

from per_obspy.kernels import _jit

DECORATORS = [_jit.kernel, _jit.lean, _jit.vectorised, _jit.inlined]


@pytest.mark.parametrize("decorator", DECORATORS)
def test_nan_is_found(decorator):
    # would catch: full fastmath, under which a kernel takes NaN for a number
    @decorator
    def is_nan(value):
        return math.isnan(value)

    assert is_nan(math.nan)
    assert not is_nan(1.0)


@pytest.mark.compiled
@pytest.mark.parametrize("decorator", DECORATORS)
def test_division_by_zero_gives_infinity(decorator):
    # would catch: Python's error model, which raises
    @decorator
    def quotient(above, below):
        return above / below

    assert quotient(1.0, 0.0) == math.inf


@pytest.mark.compiled
@pytest.mark.parametrize("decorator", DECORATORS)
def test_kernels_release_the_interpreter_and_are_stored(decorator):
    @decorator
    def double(value):
        return 2.0 * value

    assert double(1.5) == 3.0
    assert double.targetoptions["nogil"]
    assert double.stats.cache_path is not None


@pytest.mark.compiled
def test_stored_kernels_are_loaded_without_a_call(monkeypatch):
    # would catch a server that loads nothing, so that each of its workers does so again
    def triple(value):
        return 3.0 * value

    assert _jit.kernel(triple)(1.5) == 4.5
    again, never = _jit.kernel(triple), _jit.kernel(lambda value: 4.0 * value)
    monkeypatch.setattr(_jit, "_kernels", [again.kernel, never.kernel])
    assert _jit.are_stored(again)
    assert not _jit.are_stored(again, never)
    _jit.load_stored()
    assert list(again.kernel.stats.cache_hits.values()) == [1]
    assert not never.kernel.overloads


@pytest.mark.compiled
@pytest.mark.parametrize("kind", ["nbi", "nbc"])
def test_damaged_compiled_code_is_compiled_again(kind, monkeypatch):
    # would catch a file that was cut, for example by a full disk, which ended every later run
    def fourfold(value):
        return 4.0 * value

    kernel = _jit.kernel(fourfold)
    assert kernel(1.5) == 6.0
    files = list(Path(kernel.stats.cache_path).glob(f"*fourfold*.{kind}"))
    assert files
    for file in files:
        file.write_bytes(file.read_bytes()[:40])
    again = _jit.kernel(fourfold)
    monkeypatch.setattr(_jit, "_kernels", [again.kernel])
    _jit.load_stored()
    assert again(1.5) == 6.0
    # and stored whole
    third = _jit.kernel(fourfold)
    assert third(1.5) == 6.0
    assert list(third.kernel.stats.cache_hits.values()) == [1]


def test_sums_keep_their_order():
    # would catch: reassociation, after which a result depends on the length of a vector
    @_jit.kernel
    def total(values):
        result = 0.0
        for i in range(values.size):
            result += values[i]
        return result

    values = np.random.default_rng(0).normal(size=1001) * 10.0 ** np.arange(-8, 9).repeat(60)[:1001]
    expected = 0.0
    for value in values.tolist():
        expected += value
    assert total(values) == expected


@pytest.mark.compiled
def test_without_a_folder_for_compiled_code_kernels_are_compiled_and_one_line_warns(
    monkeypatch, caplog
):
    # would catch a read-only installation without a home, in which no module can be imported
    monkeypatch.setattr(caching.CacheImpl, "_locator_classes", [])
    _jit._warn_without_cache.cache_clear()
    for decorator in DECORATORS:

        @decorator
        def double(value):
            return 2.0 * value

        assert double(1.5) == 3.0
        assert double.targetoptions["nogil"]
    (message,) = caplog.messages
    assert "set NUMBA_CACHE_DIR to a folder that can be written" in message
    assert "\n" not in message


@pytest.mark.compiled
def test_code_that_names_a_module_of_an_earlier_version_is_compiled_again(monkeypatch):
    # catches an upgrade after which a command ends, because another file was taken out
    @_jit.kernel
    def fifth(value):
        return value / 5.0

    def gone(*_):
        raise ModuleNotFoundError("No module named 'per_obspy.kernels._earlier'")

    monkeypatch.setattr(caching.FunctionCache, "load_overload", gone)
    assert fifth(5.0) == 1.0


@pytest.mark.compiled
@pytest.mark.parametrize("decorator", DECORATORS)
def test_compiled_code_is_saved_by_one_process_at_a_time(decorator, monkeypatch):
    # catches two processes that save two signatures under one name: one of them is then loaded for
    # the other, which computes something else
    @decorator
    def third(value):
        return value / 3.0

    # the cache alone, as a kernel that is on the disk already would not be saved
    saved = []
    monkeypatch.setattr(
        caching.FunctionCache, "save_overload", lambda _, *overload: saved.append(overload)
    )
    folder = Path(third.stats.cache_path)
    folder.mkdir(parents=True, exist_ok=True)
    with FileLock(folder / ".lock"):
        saving = Thread(target=third._cache.save_overload, args=("signature", "code"))
        saving.start()
        saving.join(0.3)
        assert saving.is_alive()
        assert saved == []
    saving.join()
    assert saved == [("signature", "code")]
