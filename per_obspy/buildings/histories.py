"""
Exact histories of rows of buildings under the record of their station.

Each building is one oscillator, described by the pairs on both sides of it. The two may differ in
derived or rounded values: a known value goes before a derived one, and of two alike the mean is
taken, so that a row read backwards is the same row. Every contact has two histories: in its row,
and as a pair of the same two buildings alone under the same record, so that their difference is the
effect of the other neighbours. That pair is the one of the risk table, whose record and axis it
has; it is followed here only where the table has no such history.
"""

from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from per_obspy.buildings.contacts import BoolArray, Derived, IntArray
from per_obspy.checks import FloatArray
from per_obspy.pounding.row_maxima import BuildingRows, RowMaxima, row_and_pair_maxima
from per_obspy.screening.population import contact_quantile
from per_obspy.screening.values import Columns, Table, both, values

#: Relative difference of two descriptions of a building beyond which its row is flagged.
NOTED = 0.01

#: Properties of an oscillator that a pair gives as they are.
PROPERTIES = ("period", "damping", "yield_displacement", "hardening")

#: Exact history of a pair: names of its columns among contacts, and in the risk table.
ALONE = {
    "impacts_alone": "impacts",
    "impact_velocity_alone": "impact_velocity_exact",
    "amplification_alone_1": "amplification_exact_1",
    "amplification_alone_2": "amplification_exact_2",
}

#: Columns of contacts that :func:`members_of` reads, besides ``turned``.
NEEDED = (
    "gap", "restitution", "contact_log_std", "derived",
    *(f"{name}_{i}" for name in ("contact_mass", "participation", *PROPERTIES) for i in (1, 2)),
)  # fmt: skip

#: Columns of :func:`row_outcomes`; all but the last are NaN without a history.
OUTCOMES = (
    "impacts",
    "impact_velocity",
    "impact_velocity_84",
    "amplification_left",
    "amplification_right",
    "displacement_left",
    "displacement_right",
    "impacts_alone",
    "impact_velocity_alone",
    "amplification_alone_left",
    "amplification_alone_right",
    "reconciled",
)


def row_outcomes(
    motion: tuple[FloatArray, FloatArray, float],
    contacts: Table,
    first: IntArray,
    azimuth: FloatArray,
) -> Columns:
    """
    Compute ``OUTCOMES`` of every contact, (n_contacts,) each, in its row and for the pair alone.

    The motion is the acceleration to the north and east, m/s², and the sampling interval, s;
    contacts, ``first`` and azimuth are those of :func:`members_of`. Displacements are those of the
    oscillators, m.
    """
    members = members_of(contacts, first, azimuth)
    left, right = members.left, members.right
    wanted = np.zeros(right[-1] + 1, dtype=bool)
    wanted[left] = np.isnan(values(contacts, "impact_velocity_alone")) | members.reconciled
    row, pairs = row_and_pair_maxima(*motion, members.rows, wanted)
    velocity, sizes = row.impact_velocity[left], np.diff(first)
    # Rows depend twice as much on the contact as pairs
    contact_std = values(contacts, "contact_log_std") * np.where(np.repeat(sizes, sizes) > 1, 2, 1)
    # Both buildings of each contact
    amplification = _amplification(row)
    return {
        "impacts": row.impacts[left].astype(np.float64),
        "impact_velocity": velocity,
        "impact_velocity_84": contact_quantile(velocity, contact_std),
        "amplification_left": amplification[left],
        "amplification_right": amplification[right],
        "displacement_left": row.displacement[left],
        "displacement_right": row.displacement[right],
        # Without the others of the row
        **_alone(pairs, members.left, contacts),
        "reconciled": members.reconciled,
    }


def _alone(pairs: RowMaxima, left: IntArray, contacts: Table) -> Columns:
    """Return the outcomes of contacts without the others of their row: computed, or known."""
    hits = pairs.impacts[left, 0], pairs.impact_velocity[left, 0]
    computed = np.stack([*hits, *_amplification(pairs)[left].T])
    # Building 2 of a turned pair is on the left
    is_turned, known = np.asarray(contacts["turned"], dtype=bool), np.empty_like(computed)
    for number, name in enumerate(ALONE):
        known[number] = values(contacts, name)
    known[2:] = np.where(is_turned, known[:1:-1], known[2:])
    outcomes = np.where(np.isnan(computed[1]), known, computed)
    return dict(zip(OUTCOMES[7:11], outcomes, strict=True))


def no_outcomes(count: int) -> Columns:
    """Return empty ``OUTCOMES`` for a number of contacts."""
    empty: Columns = {name: np.full(count, np.nan) for name in OUTCOMES}
    return empty | {"reconciled": np.zeros(count, dtype=bool)}


def _amplification(maxima: RowMaxima) -> NDArray[np.float64]:
    """Return the largest radius with contact over that without, 1 where there is no motion."""
    free = maxima.free_radius
    return np.divide(maxima.radius, free, out=np.ones_like(free), where=free > 0)


class Members(NamedTuple):
    """Buildings of many rows, row after row."""

    #: Their oscillators and interfaces.
    rows: BuildingRows
    #: Numbers of the buildings on both sides of each contact. Shape (n_contacts,).
    left: IntArray
    right: IntArray
    #: Whether two descriptions of a building next to the contact differ. Shape (n_contacts,).
    reconciled: BoolArray


def members_of(contacts: Table, first: IntArray, azimuth: FloatArray) -> Members:
    """
    Return the buildings of rows of contacts.

    Contacts have the columns ``NEEDED`` of completed pairs, row after row along the axis of each
    (degrees), and ``turned``: whether building 2 comes before building 1. ``first``, (n_rows + 1,),
    is the place of the first contact of each row, and the end.

    The modal mass is the contact mass times the square of the participation at that contact, so
    that both pairs of a building share it whatever their contact heights.
    """
    # Each row has one building more than contacts
    row = np.repeat(np.arange(first.size - 1), np.diff(first))
    layout = _Layout(np.arange(row.size) + row, np.asarray(contacts["turned"], dtype=bool))
    left, right = layout.left, layout.left + 1
    oscillators, differs = _oscillators(contacts, layout)
    # Interfaces; the ends of a row have none, where any value will do
    share = layout.beside(both(contacts, "participation"), 1.0)
    rows = BuildingRows(
        first=first + np.arange(first.size),
        **oscillators,
        participation_left=share[1],
        participation_right=share[0],
        gap=layout.spread(left, values(contacts, "gap"), 0.0),
        restitution=layout.spread(left, values(contacts, "restitution"), 0.0),
        azimuth=azimuth,
    )
    return Members(rows, left, right, differs[left] | differs[right])


def _oscillators(contacts: Table, layout: "_Layout") -> tuple[dict[str, FloatArray], BoolArray]:
    """Return the properties of one oscillator per building, and whether descriptions differ."""
    (mass_1, mass_2), (share_1, share_2) = (
        both(contacts, name) for name in ("contact_mass", "participation")
    )
    pairs = {name: both(contacts, name) for name in PROPERTIES}
    pairs["mass"] = mass_1 * np.square(share_1), mass_2 * np.square(share_2)
    # Two descriptions of each building become one
    oscillators, differs, derived = {}, list[BoolArray](), Derived(contacts["derived"])
    for name, (one, two) in pairs.items():
        descriptions = layout.beside((one, two), np.nan)
        # 1 where a value is known, else 0
        known_1 = np.isfinite(one) & ~derived.has(f"{name}_1")
        known_2 = np.isfinite(two) & ~derived.has(f"{name}_2")
        oscillators[name] = _reconcile(descriptions, layout.beside((known_1, known_2), 0.0))
        differs.append(_differ(descriptions))
    return oscillators, np.any(differs, axis=0)


class _Layout(NamedTuple):
    """Buildings on the left of each contact, and whether its pair is turned."""

    left: IntArray
    turned: BoolArray

    def spread(self, buildings: IntArray, column: NDArray[Any], other: float) -> FloatArray:
        """Return one value per building: given values for some, another value elsewhere."""
        whole = np.full(self.left[-1] + 2, other)
        whole[buildings] = column
        return whole

    def beside(self, pair: tuple[NDArray[Any], NDArray[Any]], other: float) -> FloatArray:
        """Return values of buildings 1 and 2 as those from the right and from the left contact."""
        on_left, on_right = (np.where(self.turned, *sides) for sides in (pair[::-1], pair))
        parts = [(self.left, on_left), (self.left + 1, on_right)]
        return np.stack([self.spread(*part, other) for part in parts])


def _reconcile(descriptions: FloatArray, is_known: FloatArray) -> FloatArray:
    """Return one value per building: the mean of its known descriptions, else of all."""
    weights = np.where(is_known.any(axis=0), is_known, ~np.isnan(descriptions))
    parts = np.where(weights > 0, descriptions, 0.0)
    return np.asarray(parts.sum(axis=0) / weights.sum(axis=0))


def _differ(descriptions: FloatArray) -> BoolArray:
    """Return whether the two descriptions of each building differ by more than the tolerance."""
    low, high = np.fmin(*descriptions), np.fmax(*descriptions)
    # One that yields and one that does not differ, two that do not yield do not
    with np.errstate(invalid="ignore"):
        far = np.isinf(high) | ~(high - low <= NOTED * high)
    return np.asarray(far & (high != low))
