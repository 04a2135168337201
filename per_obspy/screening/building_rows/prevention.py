"""
Measures that would have kept a building from being hit, or softened the hits, by its pairs.

In a row in which no gap closes every building moves as if alone. Gaps that are enough for each pair
are therefore enough for the row, if all of the row are: the measures of the pairs hold.
"""

import numpy as np
import pandas as pd
from numpy.typing import NDArray

from per_obspy.checks import FloatArray
from per_obspy.screening.building_rows.sides import Groups
from per_obspy.screening.values import values

#: Texts of a building without need of a measure, and of one that needs them in other gaps.
NOTHING = "no measure for the likeliest inputs: its gaps are enough"
ELSEWHERE = "wider gaps elsewhere in its row: its own are enough for each pair alone"

#: Text of a building with a gap that is not known.
MEASURE = "measure the gaps that are not known"

#: Missing gap below which it is not written, m.
SHORTEST = 5e-4


def prevention(
    sides: pd.DataFrame, groups: Groups, neighbour: pd.Series
) -> dict[str, FloatArray | NDArray[np.object_]]:
    """
    Return the measures that protect all sides of each building, with a sentence on them.

    Parameters
    ----------
    sides : DataFrame
        With ``missing_gap, supplemental_damping, bumper_restitution, impact_velocity``.
    groups : Groups
        Its buildings.
    neighbour : Series
        Name of the worst neighbour of each.
    """
    missing = values(sides, "missing_gap")
    # Where one pair finds no measure there is none for the building
    damping = values(sides, "supplemental_damping")
    bumper = values(sides, "bumper_restitution")
    found = {
        "missing_gap": _all_known(groups, missing, groups.largest(missing)),
        "supplemental_damping": _all_known(groups, damping, groups.largest(damping)),
        "bumper_restitution": _all_known(groups, bumper, groups.smallest(bumper)),
    }
    hit = groups.largest(np.nan_to_num(values(sides, "impact_velocity"))) > 0.0
    # Buildings that need a measure have sentences of their own
    sentences = np.where(np.isnan(found["missing_gap"]), MEASURE, np.where(hit, ELSEWHERE, NOTHING))
    sentences, needed = sentences.astype(object), np.flatnonzero(found["missing_gap"] > 0.0)
    names = neighbour.to_numpy(dtype=object)[needed].tolist()
    rows = zip(*(column[needed].tolist() for column in found.values()), names, strict=True)
    sentences[needed] = [_sentence(*row) for row in rows]
    return {"prevention": sentences, **found}


def _all_known(groups: Groups, column: FloatArray, reduced: FloatArray) -> FloatArray:
    """Return reduced values, NaN for buildings with a side without a value."""
    return np.where(groups.any(np.isnan(column)), np.nan, reduced)


def _sentence(missing: float, damping: float, bumper: float, neighbour: str) -> str:
    """Return every measure for one building in words."""
    parts = [f"up to {max(missing, SHORTEST):.3f} m more gap (to {neighbour} first)"]
    if damping > 0.0:
        parts.append(f"or {damping:.2f} of critical more damping in it and its neighbours")
    if bumper < 1.0:
        parts.append(f"softened by bumpers of restitution {bumper:.2f} or less")
    return "; ".join(parts)
