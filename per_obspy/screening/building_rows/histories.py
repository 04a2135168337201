"""
Exact histories of rows of buildings under the record of their station.

Every contact is followed twice: in its row, and as a pair of the same two buildings alone under the
same motion, so that their difference is the effect of the other neighbours.
"""

import numpy as np
from numpy.typing import NDArray

from per_obspy.checks import FloatArray
from per_obspy.pounding.history.row_maxima import RowMaxima, row_maxima
from per_obspy.screening.building_rows.members import IntArray, Members, alone, members_of
from per_obspy.screening.values import Columns, Table

#: Columns of :func:`row_outcomes`; all but the last are NaN without a history.
OUTCOMES = (
    "impacts",
    "impact_velocity",
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
    Compute the outcome of every contact, in its row and for the pair alone.

    Parameters
    ----------
    motion : tuple
        Acceleration to the north and east, m/s², and the sampling interval, s.
    contacts : Table
        Columns ``members.NEEDED`` and ``turned``, row after row.
    first : (n_rows + 1,) ndarray of int
        Place of the first contact of each row, and the end.
    azimuth : (n_rows,) ndarray
        Of the axes, degrees.

    Returns
    -------
    dict of (n_contacts,) ndarray
        ``OUTCOMES``; displacements are those of the oscillators, m.
    """
    members = members_of(contacts, first, azimuth)
    found = row_maxima(*motion, members.rows)
    amplification = _amplification(found)
    # Both buildings of each contact
    left, right = members.left, members.right
    outcome: Columns = {
        "impacts": found.impacts[left].astype(np.float64),
        "impact_velocity": found.impact_velocity[left],
        "amplification_left": amplification[left],
        "amplification_right": amplification[right],
        "displacement_left": found.displacement[left],
        "displacement_right": found.displacement[right],
    }
    return {**outcome, **_alone(motion, members, outcome), "reconciled": members.reconciled}


def no_outcomes(count: int) -> Columns:
    """Return empty ``OUTCOMES`` for a number of contacts."""
    empty: Columns = {name: np.full(count, np.nan) for name in OUTCOMES}
    return empty | {"reconciled": np.zeros(count, dtype=bool)}


def _alone(
    motion: tuple[FloatArray, FloatArray, float], members: Members, outcome: Columns
) -> Columns:
    """Return the outcome of each pair without its row; a row of two buildings equals its pair."""
    names = ("impacts", "impact_velocity", "amplification_left", "amplification_right")
    columns = {name: outcome[name].copy() for name in names}
    # Contacts of rows of three and more
    rows = members.rows
    sizes = np.diff(rows.first)
    longer = np.flatnonzero(np.repeat(sizes, sizes - 1) > 2)
    if longer.size:
        # Two buildings each
        azimuth = np.repeat(rows.azimuth, sizes - 1)[longer]
        found = row_maxima(*motion, alone(rows, members.left[longer], azimuth))
        amplification = _amplification(found)
        columns["impacts"][longer] = found.impacts[::2]
        columns["impact_velocity"][longer] = found.impact_velocity[::2]
        columns["amplification_left"][longer] = amplification[::2]
        columns["amplification_right"][longer] = amplification[1::2]
    return {_name_alone(name): column for name, column in columns.items()}


def _name_alone(name: str) -> str:
    """Return the name of an outcome column for the pair without its row."""
    for side in ("_left", "_right"):
        if name.endswith(side):
            return f"{name.removesuffix(side)}_alone{side}"
    return f"{name}_alone"


def _amplification(found: RowMaxima) -> NDArray[np.float64]:
    """Return the largest radius with contact over that without, 1 where there is no motion."""
    free = found.free_radius
    return np.divide(found.radius, free, out=np.ones_like(free), where=free > 0)
