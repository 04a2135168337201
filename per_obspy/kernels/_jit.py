"""The one place where compiler options are chosen."""

import numba

#: Threads run free (``nogil``), compiled code is kept on disk, and division by zero gives infinity
#: as in NumPy. ``contract`` allows fused multiply-add and ``nsz`` ignores the sign of zero; the
#: full ``fastmath`` would make ``isnan`` find nothing. No ``parallel=True``: two threads that call
#: such kernels abort the process on Numba's workqueue layer, so the only threads are one level
#: above the kernels.
kernel = numba.njit(
    nogil=True, cache=True, error_model="numpy", fastmath={"contract", "nsz"}, boundscheck=False
)
#: The same for kernels that allocate nothing: without reference counts, which cost short kernels
#: more than arithmetic.
lean = numba.njit(  # type: ignore[call-overload]  # Numba's stubs do not know _nrt
    _nrt=False,
    nogil=True,
    cache=True,
    error_model="numpy",
    fastmath={"contract", "nsz"},
    boundscheck=False,
)
#: The same for small ones of inner loops, which the compiler else leaves out of line as soon as
#: their callers grow.
inlined = numba.njit(  # type: ignore[call-overload]  # Numba's stubs do not know _nrt
    _nrt=False,
    forceinline=True,
    nogil=True,
    cache=True,
    error_model="numpy",
    fastmath={"contract", "nsz"},
    boundscheck=False,
)
