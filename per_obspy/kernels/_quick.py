"""
Numba's own Python code in less time.

Compiling a kernel searches for no garbage meanwhile, has options that compare quickly, finds the
type of a call once, and compiles no text for the error of an assignment.
"""

import gc
from collections.abc import Iterator
from contextlib import contextmanager
from typing import Any, ClassVar

from numba.core.compiler import Flags
from numba.core.types import Function
from numba.extending import overload
from numba.np import arrayobj

#: Value of every compiler option that is not set.
DEFAULTS = {name: option.default for name, option in Flags.options.items()}


class QuickFlags(Flags):
    """Compiler options of one function, which Numba compares with others some 100 000 times."""

    __slots__ = ()

    def __hash__(self) -> int:
        """Return what Numba returns: it is the same for all options."""
        return OPTIONS_HASH

    def values(self) -> dict[str, Any]:
        """Return the values by name, without a call for each."""
        return DEFAULTS | self._values


OPTIONS_HASH = hash(Flags())


class KnownCalls:
    """
    Numba's typing context, which finds the type of a call once.

    Numba looks for the type of every addition of two numbers, and of every element of an array,
    through all functions of that name, several times for each place in the code.
    """

    #: Signatures by the type of the function and those of its arguments, for all kernels.
    signatures: ClassVar[dict[tuple[Any, ...], Any]] = {}

    def __init__(self, context: Any) -> None:
        """Take the context that looks them up."""
        self._context = context

    def __getattr__(self, name: str) -> Any:
        """Return what the context has."""
        return getattr(self._context, name)

    def resolve_function_type(self, function: Any, arguments: Any, named: Any) -> Any:
        """Return the signature of a call; no error is kept, as it can be one of an earlier pass."""
        # Kernels know their own signatures
        if named or type(function) is not Function:
            return self._context.resolve_function_type(function, arguments, named)
        key = function, *arguments
        if key not in self.signatures:
            found = self._context.resolve_function_type(function, arguments, named)
            if found is None:
                return None
            self.signatures[key] = found
        return self.signatures[key]


def _raise_other_shape(_source: Any, _part: Any) -> None:
    """Raise an error, compiled: an array is assigned to a part of another shape."""


@overload(_raise_other_shape)
def _overload_other_shape(_source: Any, _part: Any) -> Any:
    """Return the code of `_raise_other_shape`, for any shapes."""

    def raise_other_shape(_source: Any, _part: Any) -> None:
        raise ValueError("cannot assign slice from input of different size")

    return raise_other_shape


@contextmanager
def short_error() -> Iterator[None]:
    """Compile no text with the two shapes into an assignment: it takes twenty functions."""
    detailed = arrayobj.raise_with_shape_context
    arrayobj.raise_with_shape_context = _raise_other_shape
    try:
        yield
    finally:
        arrayobj.raise_with_shape_context = detailed


@contextmanager
def kept_garbage() -> Iterator[None]:
    """Search for no garbage in cycles: compilation makes many objects and few cycles."""
    is_searched = gc.isenabled()
    gc.disable()
    try:
        yield
    finally:
        if is_searched:
            gc.enable()
