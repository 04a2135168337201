"""
Completion of a pair table by derived or assumed values, named row by row in the column ``derived``.

Given values are never changed. The order matters: storeys and heights first, then periods, which
need them, then contact quantities, and masses last.
"""

from collections.abc import Callable

import numpy as np
import pandas as pd
from numpy.typing import NDArray

from per_obspy import config
from per_obspy.checks import FloatArray
from per_obspy.constants import STANDARD_GRAVITY
from per_obspy.inventory.contact_height import (
    contact_mass,
    contact_participation,
    effective_mass_ratio,
    floor_offset,
    floors_misaligned,
)
from per_obspy.inventory.periods import asce7_period, ec8_period, period_log_std
from per_obspy.inventory.table_columns import joined_names, numbers_in

#: Periods from heights in m and structural systems, by the name of the formula.
_FORMULAS: dict[str, Callable[[FloatArray, NDArray[np.str_]], FloatArray]] = {
    "asce7": asce7_period,
    "ec8": ec8_period,
}


def completed_pairs(pairs: pd.DataFrame, building: config.Building) -> pd.DataFrame:
    """
    Return the pairs with everything that the physics needs, every derived value marked.

    Parameters
    ----------
    pairs : DataFrame
        From :func:`~per_obspy.inventory.files.reading.read_pairs`.
    building : config.Building
        Values to assume where the table has none.

    Returns
    -------
    pairs : DataFrame
        All columns of the input and, for each building, ``storeys, height, height_log_std, system,
        period, period_log_std, damping, damping_log_std, mass, participation, contact_mass,
        yield_displacement, hardening``; for the pair ``longitude, latitude, azimuth,
        contact_height, floor_offset, floors_misaligned, gap_std, restitution`` and ``derived``: the
        names of the derived columns, separated by blanks, empty if none. Units as in the schema.

    Notes
    -----
    * Height from storeys and storeys from height by the storey height. Where neither is known both
      stay NaN, the participation is 1 (a plain oscillator) and the building weighs as much as its
      neighbour.
    * The contact is at the top of the lower building of those whose height is known.
    * A yield coefficient is a share of the total weight. The yield displacement of the oscillator
      follows from it with the effective mass of a first mode that grows linearly with height, all
      the mass where neither height nor storeys are known.
    * A building without yield displacement and yield coefficient stays linear (infinite yield
      displacement); a pair without azimuth keeps NaN, which means every direction. Neither counts
      as derived.
    * An empty gap is a lognormal one of the median and deviation in ``building``, if it has one;
      else it stays NaN.
    * Log-standard deviations of given periods and dampings are 0 unless the table gives them.
    * A height from storeys has the deviation of the storey height, and with it that of the storeys
      where the table gives ``height_log_std``. A derived period has the height's deviation too.
    * A height with a deviation is an estimate and counts as derived.
    """
    table = _Completion(pairs, building)
    for i in (1, 2):
        table.add_building(i)
    table.add_contact()
    table.add_gap()
    for i in (1, 2):
        table.add_mass(i)
    table.add_place()
    # Texts and flags
    columns, derived = table.columns, table.derived
    offset = np.nan_to_num(columns["floor_offset"])
    return pairs.assign(
        **columns,
        system_1=table.systems[1],
        system_2=table.systems[2],
        derived=joined_names(derived),
        floors_misaligned=floors_misaligned(offset, building.floor_tolerance),
    )


class _Completion:
    """
    Columns of a pair table as far as they are complete.

    Attributes
    ----------
    columns : dict
        Completed columns by name.
    derived : dict
        Column that may be derived -> mask of the derived rows.
    systems : dict
        Building -> its structural systems, ``other`` where the table has none.
    """

    def __init__(self, pairs: pd.DataFrame, building: config.Building) -> None:
        self.pairs, self.building = pairs, building
        self.columns: dict[str, FloatArray] = {}
        self.derived: dict[str, NDArray[np.bool_]] = {}
        self.systems: dict[int, pd.Series] = {}
        # Masonry and anything unknown
        empty = pd.Series("", index=pairs.index)
        for i in (1, 2):
            system = pairs.get(name := f"system_{i}", empty)
            self.derived[name] = (system == "").to_numpy(dtype=bool)
            self.systems[i] = system.where(system != "", "other")

    def given(self, name: str, otherwise: FloatArray | float = np.nan) -> FloatArray:
        """Return the given values of a column, and other values where there are none."""
        values = numbers_in(self.pairs, name)
        return np.where(np.isnan(values), otherwise, values)

    def fill(self, name: str, values: FloatArray | float) -> FloatArray:
        """Add a column of given values, filled up by others; the filled rows count as derived."""
        columns, derived = self.columns, self.derived
        columns[name] = self.given(name, values)
        derived[name] = np.isnan(self.given(name)) & ~np.isnan(columns[name])
        return columns[name]

    def add_building(self, i: int) -> None:
        """Add size, period, damping and strength of building i."""
        given, building = self.given, self.building
        # Height, m, and storeys, each from the other by the storey height
        counted = np.maximum(np.rint(given(f"height_{i}") / building.storey_height), 1.0)
        height = self.fill(f"height_{i}", given(f"storeys_{i}") * building.storey_height)
        self.fill(f"storeys_{i}", counted)
        # Deviation of the storeys and of the height of a storey
        is_counted, spread = self.derived[f"height_{i}"], given(f"height_log_std_{i}", 0.0)
        self.derived[f"height_{i}"] = (is_counted | (spread > 0.0)) & ~np.isnan(height)
        spread = np.where(is_counted, np.hypot(spread, building.storey_height_log_std), spread)
        self.columns[f"height_log_std_{i}"] = spread
        self._add_period(i, spread)
        self._add_strength(i)

    def _add_period(self, i: int, height_log_std: FloatArray) -> None:
        """Add period, s, and damping of building i with their logarithmic standard deviations."""
        system, building = self.systems[i].to_numpy(dtype=str), self.building
        # A row without height has a period, or it would have been rejected: 1 m is a placeholder
        height = self.columns[f"height_{i}"]
        known, formula = ~np.isnan(height), _FORMULAS[building.period_formula]
        period = np.where(known, formula(np.where(known, height, 1.0), system), np.nan)
        # Damping as a fraction of critical
        assumed: dict[str, tuple[FloatArray | float, FloatArray | float]] = {
            "period": (period, period_log_std(system, height_log_std)),
            "damping": (building.damping, building.damping_log_std),
        }
        for name, (value, deviation) in assumed.items():
            spread = np.where(np.isnan(self.given(f"{name}_{i}")), deviation, 0.0)
            self.fill(f"{name}_{i}", value)
            self.columns[f"{name}_log_std_{i}"] = self.given(f"{name}_log_std_{i}", spread)

    def _add_strength(self, i: int) -> None:
        """Add yield displacement, m, and hardening of building i; infinite and 0 where unknown."""
        # C_y g (T / 2 pi)**2 from the base shear C_y M g, which the effective mass causes
        share = effective_mass_ratio(self._storeys(i))
        coefficient = self.given(f"yield_coefficient_{i}") / share * STANDARD_GRAVITY
        radius = (self.columns[f"period_{i}"] / 2 / np.pi) ** 2
        strength = self.fill(f"yield_displacement_{i}", coefficient * radius)
        self.columns[f"yield_displacement_{i}"] = np.where(np.isnan(strength), np.inf, strength)
        self.columns[f"hardening_{i}"] = self.given(f"hardening_{i}", 0.0)

    def _storeys(self, i: int) -> FloatArray:
        """Return the storeys of building i, 1 where its size is unknown."""
        return np.where(np.isnan(self.columns[f"height_{i}"]), 1.0, self.columns[f"storeys_{i}"])

    def _size(self, i: int) -> tuple[FloatArray, FloatArray, FloatArray]:
        """Return storeys, height and contact height, m, of building i; 1 where unknown."""
        height = self.columns[f"height_{i}"]
        contact = np.fmin(self.columns["contact_height"], height)
        unknown = np.isnan(height)
        return self._storeys(i), np.where(unknown, 1.0, height), np.where(unknown, 1.0, contact)

    def add_contact(self) -> None:
        """Add contact height, participations at it, floor offset and restitution."""
        columns = self.columns
        # Contact at the top of the lower building whose height is known
        lower = np.fmin(columns["height_1"], columns["height_2"])
        contact = self.fill("contact_height", lower)
        # Also where the table has taken it from an estimated height
        deviation = np.fmax(columns["height_log_std_1"], columns["height_log_std_2"])
        self.derived["contact_height"] |= (deviation > 0.0) & (contact == lower)
        # A plain oscillator where the height is unknown
        for i in (1, 2):
            known = ~np.isnan(columns[f"height_{i}"])
            participation = contact_participation(*self._size(i))
            self.fill(f"participation_{i}", np.where(known, participation, 1.0))
        self._add_floor_offset()
        self.fill("restitution", self.building.restitution)

    def _add_floor_offset(self) -> None:
        """Add the floor offset, m; NaN unless heights and storeys of both buildings are given."""
        # Of floors that are equally high within a building
        given = [self.given(f"{name}_{i}") for name in ("height", "storeys") for i in (1, 2)]
        (storeys_1, height_1, _), (storeys_2, height_2, _) = self._size(1), self._size(2)
        offset = floor_offset(height_1, storeys_1, height_2, storeys_2)
        self.fill("floor_offset", np.where(np.isnan(given).any(axis=0), np.nan, offset))

    def add_place(self) -> None:
        """Add the middle of the pair, across the date line too, and the azimuth."""
        given, columns = self.given, self.columns
        # On the shorter way around the Earth
        east = (given("longitude_2") - given("longitude_1") + 180.0) % 360.0 - 180.0
        columns["longitude"] = (given("longitude_1") + east / 2.0 + 180.0) % 360.0 - 180.0
        columns["latitude"] = (given("latitude_1") + given("latitude_2")) / 2.0
        columns["azimuth"] = given("azimuth")

    def add_mass(self, i: int) -> None:
        """Add total mass and generalised mass at the contact, kg, of building i."""
        # A mass that is not known is the neighbour's; where neither is, that of one storey
        mass, neighbour = self._mass_by_area(i), self._mass_by_area(3 - i)
        assumed = np.where(np.isnan(mass), neighbour, mass)
        one_storey = self.building.area * self.building.mass_per_area
        mass = self.fill(f"mass_{i}", np.where(np.isnan(assumed), one_storey, assumed))
        # The whole mass where the height of the contact is unknown
        known = ~np.isnan(self.columns[f"height_{i}"])
        at_contact = contact_mass(mass, *self._size(i))
        self.columns[f"contact_mass_{i}"] = np.where(known, at_contact, mass)

    def _mass_by_area(self, i: int) -> FloatArray:
        """Return masses of building i, kg: given, or from area and storeys; NaN if unknown."""
        area = self.given(f"area_{i}", self.building.area)
        mass = area * self.columns[f"storeys_{i}"] * self.building.mass_per_area
        return self.given(f"mass_{i}", mass)

    def add_gap(self) -> None:
        """Add gap and its deviation, m: those of the assumed lognormal gap where it is unknown."""
        deviation, building = self.given("gap_std", 0.0), self.building
        # A deviation may be a default of the command that made the table
        if "gap_std_source" in self.pairs:
            is_assumed = self.pairs["gap_std_source"] == "assumed"
            self.derived["gap_std"] = is_assumed.to_numpy(dtype=bool)
        self.columns["gap"], self.columns["gap_std"] = self.given("gap"), deviation
        if building.gap is not None:
            # Mean and standard deviation of the lognormal distribution
            variance = building.gap_log_std**2
            mean = building.gap * np.exp(variance / 2.0)
            self.fill("gap", mean)
            spread = mean * np.sqrt(np.expm1(variance))
            self.columns["gap_std"] = np.where(self.derived["gap"], spread, deviation)
