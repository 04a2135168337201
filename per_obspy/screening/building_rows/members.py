"""
Buildings of a row, each described by the pairs on both sides of it.

The two may differ in derived or rounded values: a known value goes before a derived one, and of
two alike the mean is taken, so that a row read backwards is the same row.
"""

from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from per_obspy.checks import FloatArray
from per_obspy.inventory.building_rows.given import is_derived
from per_obspy.pounding.row_maxima import BuildingRows
from per_obspy.screening.values import Table, both, values

#: Relative difference of two descriptions of a building beyond which its row is flagged.
NOTED = 0.01

#: Columns of contacts that :func:`members_of` reads, besides ``turned``.
NEEDED = (
    "gap",
    "restitution",
    "derived",
    *(
        f"{name}_{i}"
        for name in (
            "period",
            "damping",
            "contact_mass",
            "participation",
            "yield_displacement",
            "hardening",
        )
        for i in (1, 2)
    ),
)

IntArray = NDArray[np.int64]
BoolArray = NDArray[np.bool_]


class Members(NamedTuple):
    """
    Buildings of many rows, row after row.

    Attributes
    ----------
    rows : BuildingRows
        Their oscillators and interfaces.
    left, right : (n_contacts,) ndarray of int
        Numbers of the buildings on both sides of each contact.
    reconciled : (n_contacts,) ndarray of bool
        Whether two descriptions of a building next to the contact differ.
    """

    rows: BuildingRows
    left: IntArray
    right: IntArray
    reconciled: BoolArray


def members_of(contacts: Table, first: IntArray, azimuth: FloatArray) -> Members:
    """
    Return the buildings of rows of contacts.

    Parameters
    ----------
    contacts : Table
        Columns ``NEEDED`` of completed pairs, row after row along the axis of each, and
        ``turned``: whether building 2 comes before building 1.
    first : (n_rows + 1,) ndarray of int
        Place of the first contact of each row, and the end.
    azimuth : (n_rows,) ndarray
        Of the axes, degrees.

    Returns
    -------
    Members

    Notes
    -----
    The modal mass is the contact mass times the square of the participation at that contact, so
    that both pairs of a building share it whatever their contact heights.
    """
    layout = _layout(contacts, first)
    shares = both(contacts, "participation")
    # One oscillator per building
    found = _oscillators(contacts, layout)
    differs = np.any([joined.differs for joined in found.values()], axis=0)
    # Interfaces; the ends of a row have none, where any value will do
    gap, restitution = values(contacts, "gap"), values(contacts, "restitution")
    share_left, share_right = layout.sides(*shares)
    rows = BuildingRows(
        first=first + np.arange(first.size),
        **{name: joined.values for name, joined in found.items()},
        participation_left=layout.at(layout.right, share_right, 1.0),
        participation_right=layout.at(layout.left, share_left, 1.0),
        gap=layout.at(layout.left, gap, 0.0),
        restitution=layout.at(layout.left, restitution, 0.0),
        azimuth=azimuth,
    )
    beside = differs[layout.left] | differs[layout.right]
    return Members(rows, layout.left, layout.right, beside)


def _oscillators(contacts: Table, layout: "_Layout") -> dict[str, "_Joined"]:
    """Return the properties of one oscillator per building."""
    names = ("period", "damping", "yield_displacement", "hardening")
    found = {name: layout.joined(both(contacts, name), name) for name in names}
    return found | {"mass": layout.joined(_modal_masses(contacts), "mass")}


def _modal_masses(contacts: Table) -> tuple[FloatArray, FloatArray]:
    """Return the masses of the oscillators 1 and 2, kg."""
    mass_1, mass_2 = both(contacts, "contact_mass")
    share_1, share_2 = both(contacts, "participation")
    return mass_1 * np.square(share_1), mass_2 * np.square(share_2)


class _Joined(NamedTuple):
    """Property of each building, and whether its two descriptions differ."""

    values: FloatArray
    differs: BoolArray


class _Layout(NamedTuple):
    """Buildings on both sides of each contact, whether its pair is turned, and derived values."""

    left: IntArray
    right: IntArray
    turned: BoolArray
    derived: Any
    buildings: int

    def sides(self, first: FloatArray, second: FloatArray) -> tuple[FloatArray, FloatArray]:
        """Return values of buildings 1 and 2 as those of the left and the right one."""
        return np.where(self.turned, second, first), np.where(self.turned, first, second)

    def at(self, buildings: IntArray, given: FloatArray, other: float) -> FloatArray:
        """Return one value per building: given values for some, another value elsewhere."""
        column = np.full(self.buildings, other)
        column[buildings] = given
        return column

    def joined(self, pair: tuple[FloatArray, FloatArray], name: str) -> _Joined:
        """Return one value per building from the pairs on both sides of it."""
        # 1 where a value is known, else 0
        known = [_is_given(self.derived, f"{name}_{i}", side) for i, side in enumerate(pair, 1)]
        left, right = self.sides(*pair)
        left_known, right_known = self.sides(*known)
        # The contact on the right of a building has it on its left
        found = np.stack([self.at(self.left, left, np.nan), self.at(self.right, right, np.nan)])
        weights = np.stack([self.at(self.left, left_known, 0), self.at(self.right, right_known, 0)])
        exists = ~np.isnan(found)
        weights = np.where(weights.any(axis=0), weights, exists)
        parts = np.where(weights > 0, found, 0.0)
        mean = parts.sum(axis=0) / weights.sum(axis=0)
        return _Joined(mean, _differ(found))


def _layout(contacts: Table, first: IntArray) -> _Layout:
    """Return the indices of the buildings on both sides of each contact."""
    row = np.repeat(np.arange(first.size - 1), np.diff(first))
    # Each row has one building more than contacts
    left = np.arange(row.size) + row
    turned = np.asarray(contacts["turned"], dtype=bool)
    return _Layout(left, left + 1, turned, contacts["derived"], row.size + first.size - 1)


def _is_given(derived: Any, name: str, found: FloatArray) -> FloatArray:
    """Return 1 where a value is known, 0 where it is derived or infinite."""
    return np.asarray(np.isfinite(found) & ~is_derived(derived, name), dtype=np.float64)


def _differ(found: FloatArray) -> BoolArray:
    """Return a mask of buildings whose two descriptions differ by more than the tolerance."""
    low, high = np.fmin(*found), np.fmax(*found)
    # One that yields and one that does not differ, two that do not yield do not
    with np.errstate(invalid="ignore"):
        far = np.isinf(high) | ~(high - low <= NOTED * high)
    return np.asarray(far & (high != low))
