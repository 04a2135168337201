"""
Quantities of rows of a pair table and of their buildings, by name, in SI and degrees.

A value is NaN where it is missing or impossible; NaN compares as false, which is meant throughout:
a missing value is not odd.
"""

from functools import cached_property

import numpy as np
import pandas as pd
import pyarrow as pa
from numpy.typing import NDArray

from per_obspy.checks import FloatArray
from per_obspy.inventory.schema import COLUMNS
from per_obspy.inventory.table_columns import metres_between

#: Largest distance between the two positions of a pair, m; neighbours' centres lie closer.
LARGEST_SEPARATION = 1000.0

#: Height of one storey, m: a hall may have 12 m, but 28 m is a mistake in height or storeys.
STOREY_HEIGHTS = (2.0, 12.0)

#: Positions closer than this give no reliable direction, m.
LINE = 2.0

#: Height of a storey, m, where either height or storeys are unknown; only few towers are higher.
STOREY, TOWER = 3.0, 300.0

#: Period of frames, s: 0.0466 h**0.9 (ASCE 7-16, table 12.8-2, concrete frames, h in m).
FRAME_PERIOD, FRAME_EXPONENT = 0.0466, 0.9


class _Rows:
    """Columns of some rows as attributes, NaN where a cell or a column is missing."""

    suffix = ""

    def __init__(self, table: pa.Table | pd.DataFrame) -> None:
        self.table = table
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


class PairRows(_Rows):
    """Quantities of pairs."""

    @cached_property
    def buildings(self) -> "tuple[BuildingRows, BuildingRows]":
        """Quantities of building 1 and of building 2."""
        return BuildingRows(self, 1), BuildingRows(self, 2)

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
    def direction(self) -> FloatArray:
        """The direction of the way, degrees from north; NaN where it is not reliable."""
        direction = np.rad2deg(np.arctan2(*self.way))
        return np.where(self.distance >= LINE, direction, np.nan)

    def angle_to(self, azimuth: FloatArray) -> FloatArray:
        """Return the angle between azimuths and the direction, 0 to 180 degrees."""
        angle = azimuth - self.direction
        return np.abs(angle - 360.0 * np.rint(angle / 360.0))

    @cached_property
    def angle(self) -> FloatArray:
        """The angle between the azimuth and the direction, 0 to 180 degrees."""
        return self.angle_to(self.azimuth)

    @cached_property
    def apart(self) -> FloatArray:
        """The distance of the positions beyond the gap."""
        return self.distance - np.minimum(np.fmax(self.gap, 0.0), 10.0)

    @cached_property
    def roots(self) -> FloatArray:
        """Sum of the roots of the areas of both buildings, m."""
        first, second = self.buildings
        return np.sqrt(first.area) + np.sqrt(second.area)

    @cached_property
    def open_gaps(self) -> FloatArray:
        """The gaps above 0, without the other rows."""
        return self.gap[self.gap > 0.0]

    @cached_property
    def lower_roof(self) -> FloatArray:
        """The height of the lower building; without height the highest that storeys may make."""
        first, second = self.buildings
        return np.fmin(first.highest, second.highest)

    @cached_property
    def storey(self) -> FloatArray:
        """The height of the higher storeys."""
        first, second = self.buildings
        return np.fmax(first.storey, second.storey)


class BuildingRows(_Rows):
    """Quantities of building 1 or 2 of pairs."""

    def __init__(self, pairs: PairRows, number: int) -> None:
        super().__init__(pairs.table)
        self.pairs, self.suffix = pairs, f"_{number}"

    @cached_property
    def size(self) -> FloatArray:
        """The height, from storeys where it is not given."""
        return np.where(np.isnan(self.height), STOREY * self.storeys, self.height)

    @cached_property
    def storey(self) -> FloatArray:
        """The height of a storey."""
        return self.height / self.storeys

    @cached_property
    def highest(self) -> FloatArray:
        """The height; where it is not given the highest that the storeys may make."""
        return np.where(np.isnan(self.height), STOREY_HEIGHTS[1] * self.storeys, self.height)

    @cached_property
    def period_ratio(self) -> FloatArray:
        """The period over that of frames of the height."""
        possible = (self.size > 0.0) & (self.size <= TOWER) & (self.period > 0.0)
        possible &= self.period <= COLUMNS["period_1"].high
        ratio = np.full(possible.size, np.nan)
        # Few rows of most tables give periods
        frame = FRAME_PERIOD * self.size[possible] ** FRAME_EXPONENT
        ratio[possible] = self.period[possible] / frame
        return ratio

    @cached_property
    def storey_mass(self) -> FloatArray:
        """The mass per storey; of one storey where nothing tells how many there are."""
        counted = np.fmax(np.where(self.size > 0.0, self.size / STOREY, 1.0), 1.0)
        counted = np.fmax(np.where(self.storeys > 0.0, self.storeys, counted), 1.0)
        return np.where(self.mass > 0.0, self.mass, np.nan) / counted

    @cached_property
    def alone(self) -> NDArray[np.bool_]:
        """Whether the height has neither storeys nor a period beside it."""
        possible = (self.height > 0.0) & (self.height < 1e6)
        return possible & np.isnan(self.storeys) & np.isnan(self.period)

    @cached_property
    def lone_heights(self) -> FloatArray:
        """Heights without storeys and period, which may be in feet, or numbers of storeys."""
        return self.height[self.alone]

    @cached_property
    def lone_distances(self) -> FloatArray:
        """Distances of the positions of the lone heights, NaN below what is reliable."""
        distance = self.pairs.distance[self.alone]
        return np.where(distance >= LINE, distance, np.nan)
