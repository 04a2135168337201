"""
Complete a pair table: what a row does not give is derived or assumed, and the column ``derived`` says which.

Nothing given is changed. The order matters: storeys and heights first, then periods and masses,
which need them, and contact quantities last.
"""

from collections.abc import Callable

import numpy as np
import pandas as pd
from numpy.typing import NDArray

from per_obspy import config
from per_obspy.checks import FloatArray
from per_obspy.constants import STANDARD_GRAVITY
from per_obspy.inventory.cells import numbers_in
from per_obspy.inventory.contact import (
    contact_mass,
    contact_participation,
    floor_offset,
    floors_misaligned,
)
from per_obspy.inventory.naming import joined_names
from per_obspy.inventory.periods import asce7_period, ec8_period, period_log_std

#: Standard acceleration of gravity, m/s2.

_FORMULAS: dict[str, Callable[[FloatArray, NDArray[np.str_]], FloatArray]] = {
    "asce7": asce7_period,
    "ec8": ec8_period,
}

#: Columns of the table under work, and for each derived one the rows in which it was.
Columns = dict[str, FloatArray]
Derived = dict[str, NDArray[np.bool_]]


def completed_pairs(pairs: pd.DataFrame, building: config.Building) -> pd.DataFrame:
    """
    Return the pairs with everything that the physics needs, every derived value marked.

    Parameters
    ----------
    pairs : DataFrame
        As :func:`~per_obspy.inventory.files.reading.read_pairs` gives them.
    building : config.Building
        What to assume where the table is silent.

    Returns
    -------
    pairs : DataFrame
        All columns of the input and, for each building, ``storeys, height, system, period,
        period_log_std, damping, damping_log_std, mass, participation, contact_mass,
        yield_displacement, hardening``; for the pair ``longitude, latitude, azimuth,
        contact_height, floor_offset, floors_misaligned, gap_std, restitution`` and ``derived``: the
        names of the derived columns, separated by blanks, empty if none. Units as in the schema.

    Notes
    -----
    * Height from storeys and storeys from height by the storey height. Where neither is known both stay NaN, the
      participation is 1 (a plain oscillator) and the building weighs as much as its neighbour.
    * The contact is at the top of the lower building of those whose height is known.
    * A building without yield displacement and yield coefficient stays linear (infinite yield displacement); a pair
      without azimuth keeps NaN, which means every direction. Neither counts as derived.
    * Log-standard deviations of given periods and dampings are 0 unless the table gives them.
    """
    columns: Columns = {}
    derived: Derived = {}
    system = {i: _system(pairs, i, derived) for i in (1, 2)}
    for i in (1, 2):
        _add_size(columns, derived, pairs, i, building)
        _add_period(columns, derived, pairs, i, system[i].to_numpy(dtype=str), building)
        _add_strength(columns, derived, pairs, i)
    _add_contact(columns, derived, pairs, building)
    _add_masses(columns, derived, pairs, building)
    _add_place(columns, pairs)
    texts = {f"system_{i}": system[i] for i in (1, 2)} | {"derived": joined_names(derived)}
    flags = {
        "floors_misaligned": floors_misaligned(
            np.nan_to_num(columns["floor_offset"]), building.floor_tolerance
        )
    }
    return pairs.assign(**columns, **texts, **flags)


def _fill(
    columns: Columns, derived: Derived, name: str, given: FloatArray, values: FloatArray | float
) -> None:
    """Add a column: the given values, elsewhere the others; those that are numbers count as derived."""
    empty = np.isnan(given)
    columns[name] = np.where(empty, values, given)
    derived[name] = empty & ~np.isnan(columns[name])


def _system(pairs: pd.DataFrame, i: int, derived: Derived) -> pd.Series:
    name = f"system_{i}"
    given = pairs[name] if name in pairs.columns else pd.Series("", index=pairs.index)
    derived[name] = (given == "").to_numpy(dtype=bool)
    return given.where(given != "", "other")


def _add_size(
    columns: Columns, derived: Derived, pairs: pd.DataFrame, i: int, building: config.Building
) -> None:
    height, storeys = numbers_in(pairs, f"height_{i}"), numbers_in(pairs, f"storeys_{i}")
    _fill(columns, derived, f"height_{i}", height, storeys * building.storey_height)
    _fill(
        columns,
        derived,
        f"storeys_{i}",
        storeys,
        np.maximum(np.rint(height / building.storey_height), 1.0),
    )


def _add_period(
    columns: Columns,
    derived: Derived,
    pairs: pd.DataFrame,
    i: int,
    system: NDArray[np.str_],
    building: config.Building,
) -> None:
    height, period = columns[f"height_{i}"], numbers_in(pairs, f"period_{i}")
    # a row without height has a period, or it would have been rejected; 1 m stands in where nothing
    # is derived
    formula = _FORMULAS[building.period_formula](np.where(np.isnan(height), 1.0, height), system)
    _fill(columns, derived, f"period_{i}", period, np.where(np.isnan(height), np.nan, formula))
    spread = np.where(np.isnan(period), period_log_std(system), 0.0)
    columns[f"period_log_std_{i}"] = _first(numbers_in(pairs, f"period_log_std_{i}"), spread)
    damping = numbers_in(pairs, f"damping_{i}")
    _fill(columns, derived, f"damping_{i}", damping, building.damping)
    spread = np.where(np.isnan(damping), building.damping_log_std, 0.0)
    columns[f"damping_log_std_{i}"] = _first(numbers_in(pairs, f"damping_log_std_{i}"), spread)


def _first(given: FloatArray, values: FloatArray | float) -> FloatArray:
    return np.where(np.isnan(given), values, given)


def _add_strength(columns: Columns, derived: Derived, pairs: pd.DataFrame, i: int) -> None:
    """Yield displacement ``C_y g (T / 2 pi)**2`` from the yield coefficient; infinite where neither is given."""
    name = f"yield_displacement_{i}"
    coefficient = numbers_in(pairs, f"yield_coefficient_{i}")
    _fill(
        columns,
        derived,
        name,
        numbers_in(pairs, name),
        coefficient * STANDARD_GRAVITY * (columns[f"period_{i}"] / 2 / np.pi) ** 2,
    )
    columns[name] = _first(columns[name], np.inf)
    columns[f"hardening_{i}"] = _first(numbers_in(pairs, f"hardening_{i}"), 0.0)


def _add_contact(
    columns: Columns, derived: Derived, pairs: pd.DataFrame, building: config.Building
) -> None:
    lower = np.fmin(columns["height_1"], columns["height_2"])
    _fill(columns, derived, "contact_height", numbers_in(pairs, "contact_height"), lower)
    for i in (1, 2):
        storeys, height, known = _sized(columns, i)
        contact = np.where(known, np.fmin(columns["contact_height"], height), 1.0)
        participation = np.where(known, contact_participation(storeys, height, contact), 1.0)
        _fill(
            columns,
            derived,
            f"participation_{i}",
            numbers_in(pairs, f"participation_{i}"),
            participation,
        )
    offset = np.where(
        _measured(pairs),
        floor_offset(*_sized(columns, 1)[1::-1], *_sized(columns, 2)[1::-1]),
        np.nan,
    )
    _fill(columns, derived, "floor_offset", numbers_in(pairs, "floor_offset"), offset)
    _fill(columns, derived, "restitution", numbers_in(pairs, "restitution"), building.restitution)
    columns["gap_std"] = _first(numbers_in(pairs, "gap_std"), 0.0)


def _sized(columns: Columns, i: int) -> tuple[FloatArray, FloatArray, NDArray[np.bool_]]:
    """Return storeys and height, 1 where they are unknown, and where they are known."""
    known = ~np.isnan(columns[f"height_{i}"])
    return (
        np.where(known, columns[f"storeys_{i}"], 1.0),
        np.where(known, columns[f"height_{i}"], 1.0),
        known,
    )


def _measured(pairs: pd.DataFrame) -> NDArray[np.bool_]:
    """Return where heights and storeys of both buildings are given: only then do floors say where they are."""
    names = [f"{name}_{i}" for name in ("height", "storeys") for i in (1, 2)]
    return np.asarray(~np.any([np.isnan(numbers_in(pairs, name)) for name in names], axis=0))


def _add_masses(
    columns: Columns, derived: Derived, pairs: pd.DataFrame, building: config.Building
) -> None:
    masses = []
    for i in (1, 2):
        area = _first(numbers_in(pairs, f"area_{i}"), building.area)
        derived_mass = area * columns[f"storeys_{i}"] * building.mass_per_area
        masses.append(_first(numbers_in(pairs, f"mass_{i}"), derived_mass))
    nothing_known = building.area * building.mass_per_area
    for i, mass, neighbour in zip((1, 2), masses, masses[::-1], strict=True):
        assumed = _first(_first(mass, neighbour), nothing_known)
        _fill(columns, derived, f"mass_{i}", numbers_in(pairs, f"mass_{i}"), assumed)
        storeys, height, known = _sized(columns, i)
        contact = np.where(known, np.fmin(columns["contact_height"], height), 1.0)
        at_contact = contact_mass(columns[f"mass_{i}"], storeys, height, contact)
        columns[f"contact_mass_{i}"] = np.where(known, at_contact, columns[f"mass_{i}"])


def _add_place(columns: Columns, pairs: pd.DataFrame) -> None:
    """Add the middle of the pair, across the date line too, and the azimuth."""
    east = (
        numbers_in(pairs, "longitude_2") - numbers_in(pairs, "longitude_1") + 180.0
    ) % 360.0 - 180.0
    columns["longitude"] = (numbers_in(pairs, "longitude_1") + east / 2.0 + 180.0) % 360.0 - 180.0
    columns["latitude"] = (numbers_in(pairs, "latitude_1") + numbers_in(pairs, "latitude_2")) / 2.0
    columns["azimuth"] = numbers_in(pairs, "azimuth")
