"""One generation of machine code per kernel: per_obspy.kernels._linking."""

import numpy as np
import pytest
from numba import types
from numba.core.codegen import JITCodeLibrary
from numba.core.errors import TypingError

from per_obspy.kernels import _jit, _linking

pytestmark = pytest.mark.compiled


@_jit.inlined
def _half(value):
    return 0.5 * value


@_jit.lean
def _sum_of_halves(values):
    total = 0.0
    for value in values:
        total += _half(value)
    return total


@_jit.kernel
def _mean_of_halves(values):
    copy = np.empty(values.size)
    for k in range(values.size):
        copy[k] = values[k]
    return _sum_of_halves(copy) / values.size


@_jit.kernel
def _both(values):
    # one function directly and as part of another one
    return _mean_of_halves(values), _sum_of_halves(values)


VALUES = np.array([1.0, 2.0, 6.0])


def test_a_chain_of_functions_gives_the_value_of_the_formula():
    assert _both(VALUES) == (1.5, 4.5)


def test_only_the_kernel_that_python_calls_has_machine_code(monkeypatch):
    # catches machine code that is generated once more for every caller: twice the time to compile
    @_jit.lean
    def inner(value):
        return 2.0 * value

    @_jit.kernel
    def middle(value):
        return inner(value) + 1.0

    @_jit.kernel
    def outer(value):
        return middle(inner(value))

    generated = []
    generate = JITCodeLibrary._finalize_specific

    def listed(library):
        generated.append(library.name.rpartition(".")[2])
        generate(library)

    monkeypatch.setattr(JITCodeLibrary, "_finalize_specific", listed)
    assert outer(1.0) == 5.0
    assert [name for name in generated if name in {"inner", "middle", "outer"}] == ["outer"]


def test_where_internals_of_numba_differ_functions_are_compiled_as_it_does_by_itself(monkeypatch):
    # catches a new Numba under which no kernel runs, though every function compiles
    @_jit.lean
    def inner(values):
        return 2.0 * values[0]

    @_jit.kernel
    def outer(values):
        return inner(values) + 1.0

    monkeypatch.setattr(_linking, "INTERNALS", ("_name_of_another_numba",))
    assert outer(VALUES) == 3.0
    assert inner.kernel.overloads


def test_a_function_that_python_calls_too_gives_the_same():
    _both(VALUES)
    assert (_mean_of_halves(VALUES), _sum_of_halves(values=VALUES), _half(3.0)) == (1.5, 4.5, 1.5)


def test_a_signature_is_compiled_once():
    signature = (types.float64,)
    assert _half.compile(signature) is _half.compile(signature)


def test_a_call_that_has_no_types_is_an_error_of_the_caller():
    @_jit.lean
    def wrong(value):
        return value.missing

    @_jit.kernel
    def outer(value):
        return wrong(value)

    with pytest.raises(TypingError, match="missing"):
        outer(1.0)


@_jit.lean
def _limited(value):
    return min(value, 2.0)


@_jit.lean
def _limited_product(values):
    return _limited(values[0]) * _limited(values[1])


@_jit.lean
def _limited_sum(values):
    return _limited(values[0]) + _limited(values[1])


@_jit.kernel
def _of_one_round(values):
    total = 0.0
    for number in range(1):
        # left out by the compiler; the first call of a function that the other one calls too
        if number:
            total += _limited_sum(values)
        total += _limited_product(values)
    return total


def test_a_function_is_linked_though_its_first_caller_is_left_out():
    assert _of_one_round(VALUES) == 2.0


@pytest.mark.parametrize(("decorator", "codes"), [(_jit.lean, 1), (_jit.kernel, 3)])
def test_constants_have_code_of_their_own_only_where_they_are_merged_too_late(decorator, codes):
    # catches scalar functions compiled once more for each constant: a tenth of the time to compile
    @decorator
    def element(values, k):
        return values[k]

    @_jit.kernel
    def total(values, k):
        return element(values, 0) + element(values, 1) + element(values, k)

    assert total(VALUES, 2) == 9.0
    assert len(element.overloads) == codes
