"""
Exact histories of rows of buildings under the record of their station.

Every contact is followed twice: in its row, and as a pair of the same two buildings alone under the
same motion, so that their difference is the effect of the other neighbours.
"""

import numpy as np
from numpy.typing import NDArray

from per_obspy.checks import FloatArray
from per_obspy.pounding.row_maxima import RowMaxima, row_and_pair_maxima
from per_obspy.screening.building_rows.members import IntArray, members_of
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
    found, pairs = row_and_pair_maxima(*motion, members.rows)
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
    return {**outcome, **_alone(pairs, left), "reconciled": members.reconciled}


def no_outcomes(count: int) -> Columns:
    """Return empty ``OUTCOMES`` for a number of contacts."""
    empty: Columns = {name: np.full(count, np.nan) for name in OUTCOMES}
    return empty | {"reconciled": np.zeros(count, dtype=bool)}


def _alone(pairs: RowMaxima, left: IntArray) -> Columns:
    """Return the outcome of each pair without its row."""
    amplification = _amplification(pairs)
    return {
        "impacts_alone": pairs.impacts[left, 0].astype(np.float64),
        "impact_velocity_alone": pairs.impact_velocity[left, 0],
        "amplification_alone_left": amplification[left, 0],
        "amplification_alone_right": amplification[left, 1],
    }


def _amplification(found: RowMaxima) -> NDArray[np.float64]:
    """Return the largest radius with contact over that without, 1 where there is no motion."""
    free = found.free_radius
    return np.divide(found.radius, free, out=np.ones_like(free), where=free > 0)
