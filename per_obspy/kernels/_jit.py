"""The one place where compiler options are chosen."""

from typing import Any

import numba

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
}

kernel = numba.njit(**OPTIONS)

#: For kernels that allocate no memory: without reference counts, which cost short kernels more
#: than arithmetic.
lean = numba.njit(**(OPTIONS | {"_nrt": False}))

#: For small kernels of inner loops, which the compiler otherwise leaves out of line as soon as
#: their callers grow.
inlined = numba.njit(**(OPTIONS | {"_nrt": False, "forceinline": True}))
