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

#: Completed columns by name, and for each column that may be derived a mask of the derived rows.
Columns = dict[str, FloatArray]
Derived = dict[str, NDArray[np.bool_]]


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
    columns: Columns = {}
    derived: Derived = {}
    system = {i: _system(pairs, i, derived) for i in (1, 2)}
    # Each building's oscillator
    for i in (1, 2):
        _add_size(columns, derived, pairs, i, building)
        _add_height_deviation(columns, derived, pairs, i, building)
        _add_period(columns, derived, pairs, i, system[i].to_numpy(dtype=str), building)
        _add_strength(columns, derived, pairs, i)
    # Quantities that need both buildings
    _add_contact(columns, derived, pairs, building)
    _add_masses(columns, derived, pairs, building)
    _add_place(columns, pairs)
    # Texts and flags
    offset = np.nan_to_num(columns["floor_offset"])
    return pairs.assign(
        **columns,
        system_1=system[1],
        system_2=system[2],
        derived=joined_names(derived),
        floors_misaligned=floors_misaligned(offset, building.floor_tolerance),
    )


def _add_column(
    columns: Columns, derived: Derived, name: str, given: FloatArray, values: FloatArray | float
) -> None:
    """Add a column of given values, filled up by others; the filled rows count as derived."""
    empty = np.isnan(given)
    columns[name] = np.where(empty, values, given)
    derived[name] = empty & ~np.isnan(columns[name])


def _given_or(given: FloatArray, values: FloatArray | float) -> FloatArray:
    """Return the given values, and other values where they are NaN."""
    return np.where(np.isnan(given), values, given)


def _system(pairs: pd.DataFrame, i: int, derived: Derived) -> pd.Series:
    """Return the structural systems of building i, ``other`` where the table has none."""
    name = f"system_{i}"
    given = pairs[name] if name in pairs.columns else pd.Series("", index=pairs.index)
    derived[name] = (given == "").to_numpy(dtype=bool)
    return given.where(given != "", "other")


def _add_size(
    columns: Columns, derived: Derived, pairs: pd.DataFrame, i: int, building: config.Building
) -> None:
    """Add height, m, and storeys of building i, each from the other by the storey height."""
    height, storeys = numbers_in(pairs, f"height_{i}"), numbers_in(pairs, f"storeys_{i}")
    _add_column(columns, derived, f"height_{i}", height, storeys * building.storey_height)
    counted = np.maximum(np.rint(height / building.storey_height), 1.0)
    _add_column(columns, derived, f"storeys_{i}", storeys, counted)


def _add_height_deviation(
    columns: Columns, derived: Derived, pairs: pd.DataFrame, i: int, building: config.Building
) -> None:
    """Add the logarithmic standard deviation of the height of building i, 0 where it is exact."""
    name = f"height_{i}"
    given = _given_or(numbers_in(pairs, f"height_log_std_{i}"), 0.0)
    # That of storeys and of the height of a storey
    is_counted = derived[name]
    columns[f"height_log_std_{i}"] = np.where(
        is_counted, np.hypot(given, building.storey_height_log_std), given
    )
    derived[name] = (is_counted | (given > 0.0)) & ~np.isnan(columns[name])


def _add_period(
    columns: Columns,
    derived: Derived,
    pairs: pd.DataFrame,
    i: int,
    system: NDArray[np.str_],
    building: config.Building,
) -> None:
    """Add period, s, and damping of building i with their logarithmic standard deviations."""
    height, period = columns[f"height_{i}"], numbers_in(pairs, f"period_{i}")
    # A row without height has a period, or it would have been rejected: 1 m is a placeholder
    unknown = np.isnan(height)
    formula = _FORMULAS[building.period_formula](np.where(unknown, 1.0, height), system)
    _add_column(columns, derived, f"period_{i}", period, np.where(unknown, np.nan, formula))
    scatter = period_log_std(system, columns[f"height_log_std_{i}"])
    spread = np.where(np.isnan(period), scatter, 0.0)
    columns[f"period_log_std_{i}"] = _given_or(numbers_in(pairs, f"period_log_std_{i}"), spread)
    # Damping as a fraction of critical
    damping = numbers_in(pairs, f"damping_{i}")
    _add_column(columns, derived, f"damping_{i}", damping, building.damping)
    spread = np.where(np.isnan(damping), building.damping_log_std, 0.0)
    columns[f"damping_log_std_{i}"] = _given_or(numbers_in(pairs, f"damping_log_std_{i}"), spread)


def _add_strength(columns: Columns, derived: Derived, pairs: pd.DataFrame, i: int) -> None:
    """Add yield displacement, m, and hardening of building i; infinite and 0 where unknown."""
    name = f"yield_displacement_{i}"
    # C_y g (T / 2 pi)**2 from the base shear C_y M g, which the effective mass of the mode causes
    storeys, _, _ = _size(columns, i)
    coefficient = numbers_in(pairs, f"yield_coefficient_{i}") / effective_mass_ratio(storeys)
    from_coefficient = coefficient * STANDARD_GRAVITY * (columns[f"period_{i}"] / 2 / np.pi) ** 2
    _add_column(columns, derived, name, numbers_in(pairs, name), from_coefficient)
    columns[name] = _given_or(columns[name], np.inf)
    columns[f"hardening_{i}"] = _given_or(numbers_in(pairs, f"hardening_{i}"), 0.0)


def _add_contact(
    columns: Columns, derived: Derived, pairs: pd.DataFrame, building: config.Building
) -> None:
    """Add the contact, the participations of the buildings, restitution and the gap's deviation."""
    # Contact at the top of the lower building whose height is known
    lower = np.fmin(columns["height_1"], columns["height_2"])
    _add_column(columns, derived, "contact_height", numbers_in(pairs, "contact_height"), lower)
    # Also where the table has taken it from an estimated height
    deviation = np.fmax(columns["height_log_std_1"], columns["height_log_std_2"])
    derived["contact_height"] |= (deviation > 0.0) & (columns["contact_height"] == lower)
    for i in (1, 2):
        _add_participation(columns, derived, pairs, i)
    _add_floor_offset(columns, derived, pairs)
    given = numbers_in(pairs, "restitution")
    _add_column(columns, derived, "restitution", given, building.restitution)
    _add_gap(columns, derived, pairs, building)


def _add_gap(
    columns: Columns, derived: Derived, pairs: pd.DataFrame, building: config.Building
) -> None:
    """Add gap and its deviation, m: those of the assumed lognormal gap where it is unknown."""
    gap, deviation = numbers_in(pairs, "gap"), numbers_in(pairs, "gap_std")
    # A deviation may be a default of the command that made the table
    if "gap_std_source" in pairs:
        derived["gap_std"] = (pairs["gap_std_source"] == "assumed").to_numpy(dtype=bool)
    if building.gap is None:
        columns["gap"], columns["gap_std"] = gap, _given_or(deviation, 0.0)
        return
    # Mean and standard deviation of the lognormal distribution
    variance = building.gap_log_std**2
    mean = building.gap * np.exp(variance / 2.0)
    _add_column(columns, derived, "gap", gap, mean)
    spread = np.where(derived["gap"], mean * np.sqrt(np.expm1(variance)), _given_or(deviation, 0.0))
    columns["gap_std"] = spread


def _add_participation(columns: Columns, derived: Derived, pairs: pd.DataFrame, i: int) -> None:
    """Add the participation of building i at the contact, 1 where its height is unknown."""
    storeys, height, known = _size(columns, i)
    contact = _contact_on(columns, height, known)
    participation = np.where(known, contact_participation(storeys, height, contact), 1.0)
    name = f"participation_{i}"
    _add_column(columns, derived, name, numbers_in(pairs, name), participation)


def _add_floor_offset(columns: Columns, derived: Derived, pairs: pd.DataFrame) -> None:
    """Add the floor offset, m; NaN unless heights and storeys of both buildings are known."""
    storeys_1, height_1, _ = _size(columns, 1)
    storeys_2, height_2, _ = _size(columns, 2)
    offset = floor_offset(height_1, storeys_1, height_2, storeys_2)
    located = np.where(_floors_given(pairs), offset, np.nan)
    _add_column(columns, derived, "floor_offset", numbers_in(pairs, "floor_offset"), located)


def _size(columns: Columns, i: int) -> tuple[FloatArray, FloatArray, NDArray[np.bool_]]:
    """Return storeys and height of building i, 1 where unknown, and the mask of the known ones."""
    known = ~np.isnan(columns[f"height_{i}"])
    storeys = np.where(known, columns[f"storeys_{i}"], 1.0)
    height = np.where(known, columns[f"height_{i}"], 1.0)
    return storeys, height, known


def _contact_on(columns: Columns, height: FloatArray, known: NDArray[np.bool_]) -> FloatArray:
    """Return the contact height on a building, at most the height of it, m; 1 where unknown."""
    return np.where(known, np.fmin(columns["contact_height"], height), 1.0)


def _floors_given(pairs: pd.DataFrame) -> NDArray[np.bool_]:
    """Return the rows that give heights and storeys of both buildings, hence heights of floors."""
    names = ("height_1", "height_2", "storeys_1", "storeys_2")
    return np.asarray(~np.any([np.isnan(numbers_in(pairs, name)) for name in names], axis=0))


def _add_masses(
    columns: Columns, derived: Derived, pairs: pd.DataFrame, building: config.Building
) -> None:
    """Add total masses and generalised masses at the contact, kg."""
    mass_1 = _mass_by_area(columns, pairs, 1, building)
    mass_2 = _mass_by_area(columns, pairs, 2, building)
    # A mass that is not known is the neighbour's; where neither is, that of one storey
    one_storey = building.area * building.mass_per_area
    for i, mass, neighbour in ((1, mass_1, mass_2), (2, mass_2, mass_1)):
        assumed = _given_or(_given_or(mass, neighbour), one_storey)
        _add_column(columns, derived, f"mass_{i}", numbers_in(pairs, f"mass_{i}"), assumed)
        # The whole mass where the height of the contact is unknown
        storeys, height, known = _size(columns, i)
        contact = _contact_on(columns, height, known)
        at_contact = contact_mass(columns[f"mass_{i}"], storeys, height, contact)
        columns[f"contact_mass_{i}"] = np.where(known, at_contact, columns[f"mass_{i}"])


def _mass_by_area(
    columns: Columns, pairs: pd.DataFrame, i: int, building: config.Building
) -> FloatArray:
    """Return masses of building i, kg: given, or from floor area and storeys; NaN if unknown."""
    area = _given_or(numbers_in(pairs, f"area_{i}"), building.area)
    derived_mass = area * columns[f"storeys_{i}"] * building.mass_per_area
    return _given_or(numbers_in(pairs, f"mass_{i}"), derived_mass)


def _add_place(columns: Columns, pairs: pd.DataFrame) -> None:
    """Add the middle of the pair, across the date line too, and the azimuth."""
    # Longitude of the middle on the shorter way around the Earth
    longitude_1, longitude_2 = numbers_in(pairs, "longitude_1"), numbers_in(pairs, "longitude_2")
    latitude_1, latitude_2 = numbers_in(pairs, "latitude_1"), numbers_in(pairs, "latitude_2")
    east = (longitude_2 - longitude_1 + 180.0) % 360.0 - 180.0
    columns["longitude"] = (longitude_1 + east / 2.0 + 180.0) % 360.0 - 180.0
    columns["latitude"] = (latitude_1 + latitude_2) / 2.0
    columns["azimuth"] = numbers_in(pairs, "azimuth")
