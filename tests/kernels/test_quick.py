"""Less work for Numba's Python code: per_obspy.kernels._quick."""

import gc

import numpy as np
import pytest
from numba import config, types
from numba.core.compiler import Flags
from numba.core.errors import TypingError
from numba.core.registry import cpu_target
from numba.core.typing.templates import AbstractTemplate
from numba.np import arrayobj

from per_obspy.kernels import _jit, _quick

pytestmark = pytest.mark.skipif(bool(config.DISABLE_JIT), reason="kernels run uncompiled")


def test_options_are_the_key_that_numba_has_for_them():
    # catches functions of Numba that are compiled once more, and options taken for others
    plain = Flags()
    plain.nrt = True
    quick = _quick.QuickFlags(plain)
    assert quick.copy() == quick == plain == quick
    assert hash(quick) == hash(plain)
    assert quick.values() == plain.values()
    quick.release_gil = True
    assert quick != plain


@pytest.mark.parametrize("searched", [True, False])
def test_garbage_is_searched_again_after_a_failed_compilation(searched):
    @_jit.lean
    def wrong(value):
        return value.missing

    before = gc.isenabled()
    try:
        (gc.enable if searched else gc.disable)()
        with pytest.raises(TypingError, match="missing"):
            wrong(1.0)
        assert gc.isenabled() is searched
    finally:
        (gc.enable if before else gc.disable)()


class _Counting:
    """Typing context that counts what it is asked for, and finds a call with named arguments."""

    def __init__(self, found):
        self.found, self.count = found, 0

    def resolve_function_type(self, *_):
        self.count += 1
        return self.found


class _Sum(AbstractTemplate):
    """A function that Numba is asked to type."""

    key = "sum"


SUM = types.Function(_Sum)


@pytest.mark.parametrize(
    ("found", "function", "named", "count"),
    [
        ("signature", SUM, {}, 1),
        # catches a call that could not be typed yet, and is never again
        (None, SUM, {}, 2),
        # catches one signature for calls that name other arguments, and for other methods
        ("signature", SUM, {"key": types.float64}, 2),
        ("signature", types.float64, {}, 2),
    ],
)
def test_a_signature_is_looked_up_once(monkeypatch, found, function, named, count):
    monkeypatch.setattr(_quick.KnownCalls, "signatures", {})
    context = _Counting(found)
    for _ in range(2):
        known = _quick.KnownCalls(context)
        assert known.resolve_function_type(function, (types.float64,), named) == found
    assert context.count == count
    # other types are another call
    assert known.resolve_function_type(function, (types.int64,), named) == found
    assert context.count == count + 1


def test_a_known_call_is_what_numba_finds():
    context, arguments = cpu_target.typing_context, (types.float64, types.int64)
    known = _quick.KnownCalls(context)
    context.refresh()
    function = context.resolve_value_type(max)
    assert known.callstack is context.callstack
    for _ in range(2):
        assert known.resolve_function_type(
            function, arguments, {}
        ) == context.resolve_function_type(function, arguments, {})


def test_an_assignment_of_another_shape_is_an_error_without_text_to_compile():
    # catches twenty functions for the text of the error, compiled by every process
    detailed = arrayobj.raise_with_shape_context

    @_jit.kernel
    def first_two(values):
        pair = np.zeros(2)
        pair[:] = values
        return pair.sum()

    assert first_two(np.ones(2)) == 2.0
    with pytest.raises(ValueError, match=r"^cannot assign slice from input of different size$"):
        first_two(np.ones(3))
    # what others compile keeps its text
    assert arrayobj.raise_with_shape_context is detailed
