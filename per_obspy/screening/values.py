"""Columns of tables and variables of stations as plain arrays."""

import numpy as np
import pandas as pd
import xarray as xr

from per_obspy.checks import FloatArray


def values(table: pd.DataFrame, name: str) -> FloatArray:
    """Return a column as float64; contiguous, because functions of NumPy may differ in the last bit between strides."""
    return np.ascontiguousarray(table[name], dtype=np.float64)


def both(table: pd.DataFrame, name: str) -> tuple[FloatArray, FloatArray]:
    """Return a column of building 1 and that of building 2."""
    return values(table, f"{name}_1"), values(table, f"{name}_2")


def at_contact(table: pd.DataFrame, name: str) -> tuple[FloatArray, FloatArray]:
    """Return a length of both oscillators at contact height: times the participation."""
    (first, second), (share_1, share_2) = both(table, name), both(table, "participation")
    return share_1 * first, share_2 * second


def number(station: xr.Dataset, name: str) -> float:
    """Return a scalar of a station."""
    return float(station[name].item())


def components(station: xr.Dataset) -> tuple[FloatArray, FloatArray, float]:
    """Return north, east (m/s²) and interval (s); a single horizontal counts as north, to be used at azimuth 0."""
    motion = np.ascontiguousarray(station["acceleration"], dtype=np.float64)
    east = motion[1] if len(motion) == 2 else np.zeros_like(motion[0])
    return motion[0], east, number(station, "sampling_interval")
