"""
Check arguments: each function returns a float64 array or raises ``ValueError``.

NaN and infinity are refused everywhere, because a running maximum hides a NaN behind an ordinary
number.
"""

from collections.abc import Callable

import numpy as np
from numpy import typing
from numpy.typing import NDArray
from typing_extensions import TypeAliasType

# named, so that signatures print these names instead of the types that they are short for
ArrayLike = TypeAliasType("ArrayLike", typing.ArrayLike)
FloatArray = TypeAliasType("FloatArray", NDArray[np.float64])


def numbers(name: str, values: ArrayLike) -> FloatArray:
    """Return the values as float64; refuse text, complex numbers and masked samples."""
    if np.ma.is_masked(values):
        raise ValueError(f"{name} has masked values: fill or split the gaps first")
    array = np.asarray(values)
    if array.dtype.kind not in "biuf":
        raise ValueError(f"{name} must be real numbers, got {array.dtype} ({values!r:.60})")
    return np.asarray(array, dtype=np.float64)


def _require(name: str, array: FloatArray, good: NDArray[np.bool_], demand: str) -> FloatArray:
    # Counted, because ``all`` of a single number takes three times as long
    if np.count_nonzero(good) < good.size:
        index = np.unravel_index(int(np.argmin(good)), good.shape)
        place = f" at index {', '.join(map(str, index))}" if index else ""
        raise ValueError(f"{name} must be {demand}, got {array[index]}{place}")
    return array


def finite(name: str, values: ArrayLike) -> FloatArray:
    """Return finite values."""
    array = numbers(name, values)
    return _require(name, array, np.isfinite(array), "finite")


def positive(name: str, values: ArrayLike) -> FloatArray:
    """Return finite values above zero."""
    array = finite(name, values)
    return _require(name, array, array > 0, "positive")


def positive_or_infinite(name: str, values: ArrayLike) -> FloatArray:
    """Return values above zero; infinity is allowed (mass of a wall, yield displacement)."""
    array = numbers(name, values)
    return _require(name, array, array > 0, "positive")


def not_negative(name: str, values: ArrayLike) -> FloatArray:
    """Return finite values of at least zero."""
    array = finite(name, values)
    return _require(name, array, array >= 0, "zero or more")


def between(name: str, values: ArrayLike, low: float, high: float) -> FloatArray:
    """Return values in the closed interval from low to high."""
    array = finite(name, values)
    return _require(name, array, (array >= low) & (array <= high), f"between {low:g} and {high:g}")


def fraction_of_critical(name: str, values: ArrayLike) -> FloatArray:
    """Return damping ratios: at least 0, below 1."""
    array = finite(name, values)
    return _require(name, array, (array >= 0) & (array < 1), "at least 0 and below 1")


def record(name: str, values: ArrayLike) -> FloatArray:
    """Return one contiguous component of ground motion, (n_samples,), of at least one sample."""
    array = finite(name, values)
    if array.ndim != 1 or array.size == 0:
        raise ValueError(f"{name} must be one row of samples, got the shape {array.shape}")
    return np.ascontiguousarray(array)


def number(name: str, value: ArrayLike, check: Callable[[str, ArrayLike], FloatArray]) -> float:
    """Return a single number that passes the check."""
    array = check(name, value)
    if array.ndim:
        raise ValueError(f"{name} must be a single number, got the shape {array.shape}")
    return float(array)
