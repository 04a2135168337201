"""
Quantities of rows of a pair table and of their buildings, by name, in SI and degrees.

A value is NaN where it is missing or impossible; NaN compares as false, which is meant throughout:
a missing value is not odd.
"""

from functools import cached_property

import numpy as np
import pandas as pd
import pyarrow as pa

from per_obspy.checks import FloatArray
from per_obspy.inventory.schema import COLUMNS
from per_obspy.inventory.table_columns import metres_between

#: Largest distance between the two positions of a pair, m; neighbours' centres lie closer.
LARGEST_SEPARATION = 1000.0

#: Height of one storey, m: a hall may have 12 m, but 28 m is a mistake in height or storeys.
STOREY_HEIGHTS = (2.0, 12.0)


class Rows:
    """
    Columns of some rows as attributes, NaN where a cell or a column is missing.

    Parameters
    ----------
    table : Table or DataFrame
        Rows of pairs.
    suffix : str, optional
        ``"_1"`` or ``"_2"`` for the columns of one building.
    """

    def __init__(self, table: pa.Table | pd.DataFrame, suffix: str = "") -> None:
        self.table, self.suffix = table, suffix
        self._names = frozenset(getattr(table, "column_names", getattr(table, "columns", ())))

    def has(self, name: str) -> bool:
        """Return whether the table has a column, whose name lacks the building's number."""
        return f"{name}{self.suffix}" in self._names

    def __getattr__(self, name: str) -> FloatArray:
        column = COLUMNS.get(f"{name}{self.suffix}")
        if column is None or column.dtype == "str":
            raise AttributeError(name)
        # Kept, as most are asked for several times
        numbers = np.full(len(self.table), np.nan)
        if self.has(name):
            numbers = np.asarray(self.table[column.name].to_numpy(), dtype=np.float64)
        setattr(self, name, numbers)
        return numbers

    @cached_property
    def storey(self) -> FloatArray:
        """The height of a storey of one building."""
        return self.height / self.storeys

    @cached_property
    def highest(self) -> FloatArray:
        """The height of one building, or the highest that its storeys may make."""
        return np.where(np.isnan(self.height), STOREY_HEIGHTS[1] * self.storeys, self.height)


class PairRows(Rows):
    """Quantities of pairs, with the rows of building 1 and of building 2."""

    def __init__(self, table: pa.Table | pd.DataFrame) -> None:
        super().__init__(table)
        self.buildings = (Rows(table, "_1"), Rows(table, "_2"))

    @cached_property
    def way(self) -> tuple[FloatArray, FloatArray]:
        """The way east and north from building 1 to building 2, m."""
        first, second = self.buildings
        return metres_between(first.longitude, first.latitude, second.longitude, second.latitude)

    @cached_property
    def separation(self) -> FloatArray:
        """The distance of the positions; NaN unless both are on the Earth."""
        is_valid = np.ones(len(self.table), dtype=bool)
        for one in self.buildings:
            is_valid &= (np.abs(one.longitude) <= 180.0) & (np.abs(one.latitude) <= 90.0)
        return np.where(is_valid, np.hypot(*self.way), np.nan)

    @cached_property
    def distance(self) -> FloatArray:
        """The separation; NaN where the row is refused for it."""
        return np.where(self.separation <= LARGEST_SEPARATION, self.separation, np.nan)

    @cached_property
    def lower_roof(self) -> FloatArray:
        """The height of the lower building; without height the highest that storeys may make."""
        return np.fmin(*(one.highest for one in self.buildings))

    @cached_property
    def storey(self) -> FloatArray:
        """The height of the higher storeys."""
        return np.fmax(*(one.storey for one in self.buildings))
