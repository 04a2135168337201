"""The one place where compiler options are chosen."""

import logging
from collections.abc import Callable
from contextlib import suppress
from functools import lru_cache
from multiprocessing import parent_process
from pathlib import Path
from pickle import UnpicklingError
from typing import Any

import numba
from filelock import FileLock
from numba.core.caching import FunctionCache

from per_obspy.kernels._linking import (
    FunctionCompiler,
    LeanCompiler,
    LinkedFunction,
    VectorCompiler,
)

#: Options of every kernel. No ``parallel=True``: two threads that call such kernels abort the
#: process on Numba's workqueue layer, so the only threads are one level above the kernels.
OPTIONS: dict[str, Any] = {
    # Threads run free while a kernel computes
    "nogil": True,
    # Compiled code is stored on disk
    "cache": True,
    # Division by zero gives infinity as in NumPy
    "error_model": "numpy",
    # Fused multiply-add is allowed and the sign of zero ignored; the full set of options would
    # make ``isnan`` find no NaN
    "fastmath": {"contract", "nsz"},
    "boundscheck": False,
    # No function pointer for C, which no kernel needs
    "no_cfunc_wrapper": True,
    # The compiler decides what it merges: without this, all that an `inlined` function calls takes
    # its option over, and kernels have ten times as much code
    "forceinline": False,
}


#: Part of Numba's error where no folder can be written.
NO_FOLDER = "no locator available"


#: Errors of Numba where a file of compiled code is damaged.
_DAMAGE = (
    *(EOFError, UnpicklingError, ImportError, AttributeError),
    *(LookupError, TypeError, ValueError),
)


class SharedCache(FunctionCache):
    """Compiled code of one kernel on disk, which several processes may save at the same time."""

    def load_overload(self, sig: Any, target_context: Any) -> Any:
        """Load one signature; none of a damaged file, or of a module that is gone."""
        try:
            return super().load_overload(sig, target_context)
        except _DAMAGE:
            # It is compiled and saved again
            with suppress(OSError):
                self.flush()
            return None

    def save_overload(self, sig: Any, data: Any) -> None:
        """Save one signature; without the lock two processes could give two of them one name."""
        # A folder that cannot be written costs time only: the next start compiles again
        with suppress(OSError):
            self._impl.locator.ensure_cache_path()
            with FileLock(str(Path(self.cache_path) / ".lock")):
                super().save_overload(sig, data)

    def stored_signatures(self, target_context: Any) -> list[Any]:
        """Return the signatures that are stored for this version and processor."""
        codegen = target_context.codegen()
        try:
            keys = list(self._cache_file._load_index())
        except _DAMAGE:
            return []
        return [key[0] for key in keys if key == self._index_key(key[0], codegen)]


#: Every kernel that Python may call.
_kernels = list[Any]()


def load_stored() -> None:
    """Load the code of all kernels that is stored, for all processes that begin as a copy."""
    # Another Numba: each process loads what it calls
    with suppress(AttributeError, TypeError):
        for kernel in _kernels:
            for signature in kernel._cache.stored_signatures(kernel.targetctx):
                kernel.compile(signature)


def are_stored(*kernels: Any) -> bool:
    """Return whether code of all these kernels is stored, so that it is only loaded."""
    with suppress(AttributeError, TypeError):
        return all(one.kernel._cache.stored_signatures(one.kernel.targetctx) for one in kernels)
    return False


def can_be_stored() -> bool:
    """Return whether there is a folder in which compiled kernels can be stored."""
    try:
        SharedCache(can_be_stored)
    except RuntimeError as error:
        if NO_FOLDER not in str(error):
            raise
        return False
    return True


def _compiler(
    compiler: type[FunctionCompiler], **options: Any
) -> Callable[[Callable[..., Any]], Any]:
    """Return a decorator that compiles with some options, stored on disk where that is possible."""

    def compiled(function: Callable[..., Any]) -> Any:
        try:
            kernel = numba.njit(**OPTIONS | options)(function)
            # Without the compiler the kernel is the function itself
            if kernel is function:
                return function
            kernel._cache = SharedCache(function)
            _kernels.append(kernel)
        except RuntimeError as error:
            # Neither the package's folder nor that of the user can be written
            if NO_FOLDER not in str(error):
                raise
            _warn_without_cache()
            kernel = numba.njit(**OPTIONS | options | {"cache": False})(function)
        return LinkedFunction(kernel, compiler)

    return compiled


@lru_cache(1)
def _warn_without_cache() -> None:
    """Warn once, in the process that starts the others, that every run compiles anew."""
    if parent_process() is None:
        logging.getLogger("per_obspy").warning(
            "per-obspy: compiled kernels cannot be stored, every start compiles them again for "
            "about a minute: set NUMBA_CACHE_DIR to a folder that can be written"
        )


kernel = _compiler(FunctionCompiler)

#: For functions that allocate no memory, one code for all constants: without reference counts,
#: which cost short kernels more than arithmetic.
lean = _compiler(LeanCompiler, _nrt=False)

#: The same for loops over lanes, which become vectors before they are merged into their callers.
vectorised = _compiler(VectorCompiler, _nrt=False)

#: For small kernels of inner loops, which the compiler otherwise leaves out of line as soon as
#: their callers grow.
inlined = _compiler(LeanCompiler, _nrt=False, forceinline=True)
