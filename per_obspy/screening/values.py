"""Columns of tables and variables of stations as plain arrays."""

from collections.abc import Iterable, Iterator, Sequence
from typing import Any, Protocol

import numpy as np
import xarray as xr
from numpy.typing import NDArray

from per_obspy.checks import FloatArray
from per_obspy.pounding.correlation import ddc_correlation


class Table(Protocol):
    """
    Columns by name: a DataFrame, or a dict of arrays.

    A dict is faster to make, of which a run with many stations makes thousands.
    """

    def keys(self) -> Iterable[Any]:
        """Return the names of the columns."""

    def __iter__(self) -> Iterator[Any]:
        """Yield the names of the columns."""

    def __contains__(self, name: object, /) -> bool:
        """Return whether there is a column of this name."""

    def __getitem__(self, name: str, /) -> Any:
        """Return a column."""


#: Truth values and row numbers.
BoolArray = NDArray[np.bool_]
IndexArray = NDArray[np.intp]

#: Texts.
TextArray = NDArray[np.object_]

#: Of building 1 and building 2.
Both = tuple[FloatArray, FloatArray]

#: A table as plain arrays.
Columns = dict[str, NDArray[Any]]


def chosen(table: Table, rows: NDArray[Any]) -> Columns:
    """Return the rows of a table by index or mask."""
    return {name: np.asarray(table[name])[rows] for name in table}


def only(table: Table, names: Iterable[str]) -> Columns:
    """Return some columns of a table, as far as it has them; rows of few are chosen faster."""
    return {name: np.asarray(table[name]) for name in names if name in table}


def joined(parts: Sequence[tuple[NDArray[np.intp], Columns]]) -> Columns:
    """Join parts with equal columns in the order of their row numbers."""
    order = np.argsort(np.concatenate([rows for rows, _ in parts]))
    columns = {}
    for name in parts[0][1]:
        columns[name] = np.concatenate([part[name] for _, part in parts])[order]
    return columns


def values(table: Table, name: str) -> FloatArray:
    """Return a column as float64."""
    # Contiguous: functions of NumPy may differ in the last bit between strides
    return np.ascontiguousarray(table[name], dtype=np.float64)


def both(table: Table, name: str) -> tuple[FloatArray, FloatArray]:
    """Return the columns of a property for buildings 1 and 2."""
    return values(table, f"{name}_1"), values(table, f"{name}_2")


def oscillators(table: Table) -> tuple[FloatArray, FloatArray, FloatArray, FloatArray]:
    """Return period, s, and damping of building 1, then those of building 2."""
    (period_1, period_2), (damping_1, damping_2) = both(table, "period"), both(table, "damping")
    return period_1, damping_1, period_2, damping_2


def pair_correlation(table: Table) -> FloatArray:
    """Return the correlation of both responses to white noise by eq. (16)."""
    return np.asarray(ddc_correlation(*oscillators(table)))


def at_contact(table: Table, name: str) -> tuple[FloatArray, FloatArray]:
    """Return a length of both oscillators at contact height: times the participation."""
    length_1, length_2 = both(table, name)
    participation_1, participation_2 = both(table, "participation")
    return participation_1 * length_1, participation_2 * length_2


def strength_is_assumed(table: Table) -> tuple[BoolArray, BoolArray]:
    """Return masks of buildings 1 and 2 with the yield displacement of HAZUS, which none gave."""
    first, second = (
        values(table, f"yield_displacement_{i}") == values(table, f"hazus_yield_{i}")
        for i in (1, 2)
    )
    return first, second


def stay_linear(table: Table) -> Columns:
    """Return the columns by which buildings of an assumed strength do not yield."""
    columns: Columns = {}
    for i, is_assumed in enumerate(strength_is_assumed(table), start=1):
        linear = {"yield_displacement": np.inf, "yield_log_std": 0.0, "hardening": 0.0}
        for name, value in linear.items():
            column = f"{name}_{i}"
            columns[column] = np.where(is_assumed, value, values(table, column))
    return columns


def number(station: xr.Dataset, name: str) -> float:
    """Return a scalar of a station."""
    return float(station[name].item())


def components(station: xr.Dataset) -> tuple[FloatArray, FloatArray, float]:
    """
    Return the acceleration to the north and east (m/s²) and the sampling interval (s).

    A single horizontal counts as north, to be used at azimuth 0.
    """
    motion = np.ascontiguousarray(station["acceleration"], dtype=np.float64)
    east = motion[1] if len(motion) == 2 else np.zeros_like(motion[0])
    return motion[0], east, number(station, "sampling_interval")


def motion_along(station: xr.Dataset, azimuth: float) -> FloatArray:
    """Return the acceleration along an azimuth (degrees), or that of the only sensor, m/s²."""
    north, east, _ = components(station)
    angle = np.radians(azimuth) if station.sizes["horizontal"] == 2 else 0.0
    along: FloatArray = north * np.cos(angle) + east * np.sin(angle)
    return along
