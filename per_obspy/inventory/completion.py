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
)
from per_obspy.inventory.periods import (
    SOFT_CLASSES,
    SOFT_VS30,
    asce7_period,
    ec8_period,
    period_correlation,
    period_log_std,
)
from per_obspy.inventory.places import place_names
from per_obspy.inventory.strength import (
    CAPACITY_LOG_STD,
    hazus_hardening,
    hazus_yield_displacement,
)
from per_obspy.inventory.table_columns import joined_names, numbers_in

#: Log-standard deviation of the impact velocity of a pair by the contact law, where the restitution
#: is assumed (docs/reliability.md).
CONTACT_LOG_STD = 0.1

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
        hazus_yield, yield_displacement, yield_log_std, hardening``; for the pair
        ``period_correlation, longitude, latitude, azimuth, contact_height, floor_offset,
        floors_misaligned, soft_ground, gap_std, restitution, contact_log_std``, ``place`` and names
        of buildings by :func:`~per_obspy.inventory.places.place_names`, and ``derived``: the names
        of the derived columns, separated by blanks, empty if none. Units as in the schema.

    Notes
    -----
    * Height from storeys and storeys from height by the storey height. Where neither is known both
      stay NaN, the participation is 1 (a plain oscillator) and the building weighs as much as its
      neighbour.
    * The contact is at the top of the lower building of those whose height is known.
    * A yield coefficient is a share of the total weight. The yield displacement of the oscillator
      follows from it with the effective mass of a first mode that grows linearly with height, all
      the mass where neither height nor storeys are known.
    * A building without yield displacement and yield coefficient has the strength of HAZUS if
      ``building.strength`` says so and its system is known, else it stays linear (infinite yield
      displacement); a pair without azimuth keeps NaN, which means every direction. Neither counts
      as derived.
    * An empty gap is a lognormal one of the median and deviation in ``building``, if it has one;
      else it stays NaN.
    * Log-standard deviations of given periods and dampings are 0 unless the table gives them.
    * A height from storeys has the deviation of the storey height, and with it that of the storeys
      where the table gives ``height_log_std``. A derived period has the height's deviation too.
    * A height with a deviation is an estimate and counts as derived.
    * Periods of which one is given have uncorrelated deviations, unless the table gives a
      correlation.
    """
    table = _Columns(pairs)
    # Unknown systems are one
    systems = {f"system_{i}": _system(table, i) for i in (1, 2)}
    # Sizes and periods before contacts and masses, which need those of both
    for i in (1, 2):
        _add_size(table, i, building)
        system = systems[f"system_{i}"].to_numpy(dtype=str)
        _add_period(table, i, building, system)
        _add_strength(table, i, building, system)
    _add_period_correlation(table, *systems.values())
    _add_contact(table)
    _add_impact(table, building)
    _add_gap(table, building)
    for i in (1, 2):
        _add_mass(table, i, building)
    _add_place(table)
    offset = np.nan_to_num(table.columns["floor_offset"])
    return pairs.assign(
        **place_names(pairs),
        **table.columns,
        **systems,
        derived=joined_names(table.derived),
        # Floors may hit columns of the other building, which is outside the method
        floors_misaligned=np.abs(offset) > building.floor_tolerance,
        soft_ground=_soft_ground(pairs),
    )


class _Columns:
    """
    Columns of a pair table as far as they are complete.

    Attributes
    ----------
    columns : dict
        Completed columns by name.
    derived : dict
        Column that may be derived -> mask of the derived rows.
    """

    def __init__(self, pairs: pd.DataFrame) -> None:
        self.pairs = pairs
        self.columns: dict[str, FloatArray] = {}
        self.derived: dict[str, NDArray[np.bool_]] = {}

    def given(self, name: str, otherwise: FloatArray | float = np.nan) -> FloatArray:
        """Return the given values of a column, and other values where there are none."""
        values = numbers_in(self.pairs, name)
        return np.where(np.isnan(values), otherwise, values)

    def fill(self, name: str, values: FloatArray | float) -> FloatArray:
        """Add a column of given values, filled up by others; the filled rows count as derived."""
        self.columns[name] = self.given(name, values)
        is_missing = np.isnan(numbers_in(self.pairs, name))
        self.derived[name] = is_missing & ~np.isnan(self.columns[name])
        return self.columns[name]

    def storeys(self, i: int) -> FloatArray:
        """Return the storeys of building i, NaN where its height is unknown."""
        return np.where(np.isnan(self.columns[f"height_{i}"]), np.nan, self.columns[f"storeys_{i}"])


def _system(table: _Columns, i: int) -> pd.Series:
    """Return the structural system of building i: other for anything unknown."""
    name, unknown = f"system_{i}", pd.Series("", index=table.pairs.index)
    given = table.pairs.get(name, unknown)
    table.derived[name] = (given == "").to_numpy(dtype=bool)
    return given.where(given != "", "other")


def _add_size(table: _Columns, i: int, building: config.Building) -> None:
    """Add height, m, and storeys of building i, each from the other by the storey height."""
    counted = np.maximum(np.rint(table.given(f"height_{i}") / building.storey_height), 1.0)
    height = table.fill(f"height_{i}", table.given(f"storeys_{i}") * building.storey_height)
    table.fill(f"storeys_{i}", counted)
    # Deviation of the storeys and of the height of a storey
    is_counted, spread = table.derived[f"height_{i}"], table.given(f"height_log_std_{i}", 0.0)
    table.derived[f"height_{i}"] = (is_counted | (spread > 0.0)) & ~np.isnan(height)
    spread = np.where(is_counted, np.hypot(spread, building.storey_height_log_std), spread)
    table.columns[f"height_log_std_{i}"] = spread


def _add_period(
    table: _Columns, i: int, building: config.Building, system: NDArray[np.str_]
) -> None:
    """Add period, s, and damping of building i with their logarithmic standard deviations."""
    # A row without height has a period, or it would have been rejected: 1 m is a placeholder
    height, formula = table.columns[f"height_{i}"], _FORMULAS[building.period_formula]
    known = ~np.isnan(height)
    period = np.where(known, formula(np.where(known, height, 1.0), system), np.nan)
    spread = table.columns[f"height_log_std_{i}"]
    scatter = period_log_std(system, spread, _soft_ground(table.pairs))
    # Damping as a fraction of critical
    assumed: dict[str, tuple[FloatArray | float, FloatArray | float]] = {
        "period": (period, scatter),
        "damping": (building.damping, building.damping_log_std),
    }
    for name, (value, deviation) in assumed.items():
        spread = np.where(np.isnan(table.given(f"{name}_{i}")), deviation, 0.0)
        table.fill(f"{name}_{i}", value)
        table.columns[f"{name}_log_std_{i}"] = table.given(f"{name}_log_std_{i}", spread)


def _soft_ground(pairs: pd.DataFrame) -> NDArray[np.bool_]:
    """Return where the ground is soft by its shear-wave velocity, or by its class without one."""
    vs30 = numbers_in(pairs, "vs30")
    site_class = pairs.get("site_class", pd.Series("", index=pairs.index))
    by_class = site_class.isin(SOFT_CLASSES).to_numpy(bool)
    return np.where(np.isnan(vs30), by_class, vs30 < SOFT_VS30)


def _add_period_correlation(table: _Columns, *systems: pd.Series) -> None:
    """Add the correlation of the residuals of both periods; 0 where one of them is given."""
    storeys = (table.columns[f"storeys_{i}"] for i in (1, 2))
    both_derived = table.derived["period_1"] & table.derived["period_2"]
    likeness = np.where(both_derived, period_correlation(*systems, *storeys), 0.0)
    table.fill("period_correlation", likeness)
    table.derived["period_correlation"] &= both_derived


def _add_strength(
    table: _Columns, i: int, building: config.Building, system: NDArray[np.str_]
) -> None:
    """
    Add yield displacement, m, and hardening of building i; infinite and 0 where unknown.

    The yield displacement of HAZUS is beside them, by which a building without one is judged.
    """
    period, storeys, name = (
        table.columns[f"period_{i}"],
        table.storeys(i),
        f"yield_displacement_{i}",
    )
    assumed = hazus_yield_displacement(period, system, storeys, building.code_level)
    table.columns[f"hazus_yield_{i}"] = assumed
    # Where nothing is given, that of HAZUS if it is asked for
    strength = _given_strength(table, i)
    is_assumed = np.isnan(strength) & ~np.isnan(assumed) & (building.strength == "hazus")
    strength = table.fill(name, np.where(is_assumed, assumed, strength))
    table.columns[name] = np.where(np.isnan(strength), np.inf, strength)
    # Its hardening and deviation
    hardening = np.where(is_assumed, hazus_hardening(system, storeys), 0.0)
    table.columns[f"hardening_{i}"] = table.given(f"hardening_{i}", hardening)
    spread = np.where(is_assumed, CAPACITY_LOG_STD, 0.0)
    table.columns[f"yield_log_std_{i}"] = table.given(f"yield_log_std_{i}", spread)


def _given_strength(table: _Columns, i: int) -> FloatArray:
    """Return the yield displacement of building i, m, given itself or as a coefficient; or NaN."""
    # C_y g (T / 2 pi)**2 from the base shear C_y M g, which the effective mass causes
    share = np.nan_to_num(effective_mass_ratio(table.storeys(i)), nan=1.0)
    coefficient = table.given(f"yield_coefficient_{i}") / share * STANDARD_GRAVITY
    radius = (table.columns[f"period_{i}"] / 2 / np.pi) ** 2
    return table.given(f"yield_displacement_{i}", coefficient * radius)


def _add_contact(table: _Columns) -> None:
    """Add contact height, participations at it and floor offset."""
    columns = table.columns
    # Contact at the top of the lower building whose height is known
    lower = np.fmin(columns["height_1"], columns["height_2"])
    contact = table.fill("contact_height", lower)
    # Also where the table has taken it from an estimated height
    deviation = np.fmax(columns["height_log_std_1"], columns["height_log_std_2"])
    table.derived["contact_height"] |= (deviation > 0.0) & (contact == lower)
    # A plain oscillator where the height is unknown
    for i in (1, 2):
        height = columns[f"height_{i}"]
        share = contact_participation(table.storeys(i), height, np.minimum(contact, height))
        table.fill(f"participation_{i}", np.nan_to_num(share, nan=1.0))
    # Of floors that are equally high within a building, where all is given
    sizes = [table.given(f"{name}_{i}") for i in (1, 2) for name in ("height", "storeys")]
    offset = np.where(np.isnan(sizes).any(axis=0), np.nan, floor_offset(*sizes))
    table.fill("floor_offset", offset)


def _add_impact(table: _Columns, building: config.Building) -> None:
    """Add the restitution and the deviation of impact velocities by the contact."""
    table.fill("restitution", building.restitution)
    # A given restitution is that of an instant impact
    deviation = np.where(table.derived["restitution"], CONTACT_LOG_STD, 0.0)
    table.columns["contact_log_std"] = table.given("contact_log_std", deviation)


def _add_gap(table: _Columns, building: config.Building) -> None:
    """Add gap and its deviation, m: those of the assumed lognormal gap where it is unknown."""
    deviation = table.given("gap_std", 0.0)
    # A deviation may be a default of the command that made the table
    if "gap_std_source" in table.pairs:
        is_assumed = table.pairs["gap_std_source"].isin(("assumed", "learned"))
        table.derived["gap_std"] = is_assumed.to_numpy(dtype=bool)
    table.columns["gap"], table.columns["gap_std"] = table.given("gap"), deviation
    if building.gap is not None:
        # Mean and standard deviation of the lognormal distribution
        variance = building.gap_log_std**2
        mean = building.gap * np.exp(variance / 2.0)
        table.fill("gap", mean)
        spread = mean * np.sqrt(np.expm1(variance))
        table.columns["gap_std"] = np.where(table.derived["gap"], spread, deviation)


def _add_mass(table: _Columns, i: int, building: config.Building) -> None:
    """Add total mass and generalised mass at the contact, kg, of building i."""
    columns = table.columns
    # A mass that is not known is the neighbour's; where neither is, that of one storey
    assumed: FloatArray | float = building.area * building.mass_per_area
    for k in (3 - i, i):
        area = table.given(f"area_{k}", building.area)
        mass = table.given(f"mass_{k}", area * columns[f"storeys_{k}"] * building.mass_per_area)
        assumed = np.where(np.isnan(mass), assumed, mass)
    mass = table.fill(f"mass_{i}", assumed)
    # The whole mass where the height of the contact is unknown
    height = columns[f"height_{i}"]
    contact = np.minimum(columns["contact_height"], height)
    at_contact = contact_mass(mass, table.storeys(i), height, contact)
    columns[f"contact_mass_{i}"] = np.where(np.isnan(height), mass, at_contact)


def _add_place(table: _Columns) -> None:
    """Add the middle of the pair, across the date line too, and the azimuth."""
    given, columns = table.given, table.columns
    # On the shorter way around the Earth
    east = (given("longitude_2") - given("longitude_1") + 180.0) % 360.0 - 180.0
    columns["longitude"] = (given("longitude_1") + east / 2.0 + 180.0) % 360.0 - 180.0
    columns["latitude"] = (given("latitude_1") + given("latitude_2")) / 2.0
    columns["azimuth"] = given("azimuth")
