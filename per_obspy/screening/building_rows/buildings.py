"""
Table of buildings: one row per building, from the sides on which neighbours can hit it.

A building is hit if any neighbour hits it. Pairs that share a building share the earthquake too:
the probability lies between that of one common cause, which is the largest of its pairs, and that
of independent pairs.
"""

from collections.abc import Mapping

import numpy as np
import pandas as pd
from numpy.typing import NDArray

from per_obspy.checks import FloatArray
from per_obspy.inventory.table_columns import joined_names
from per_obspy.screening.building_rows.prevention import prevention
from per_obspy.screening.building_rows.row_columns import BUILDING_FLAGS, COMPASS, FLAGS
from per_obspy.screening.building_rows.sides import Groups
from per_obspy.screening.ranking import risk_class
from per_obspy.screening.uncertainty.unknown_gaps import UNKNOWN_CLASS
from per_obspy.screening.values import values


def building_table(sides: pd.DataFrame, classes: Mapping[str, float], angle: float) -> pd.DataFrame:
    """
    Return one row per building, in the order of their numbers.

    Parameters
    ----------
    sides : DataFrame
        Interfaces as seen from one of their buildings, all of a building one after the other:
        columns of its row and pair without ``_left``, ``_right``, ``_1`` and ``_2``, with
        ``neighbour_number``, ``neighbour_id``, ``direction`` (towards it, degrees) and ``area``.
    classes : mapping of str to float
        Name and smallest severity of each risk class, m/s, descending to 0.
    angle : float
        Rows whose axes differ by more make their building a corner, degrees.

    Returns
    -------
    DataFrame
        The columns ``row_columns.BUILDINGS`` without ``rank``, and ``building_number``.
    """
    # The worst side of each building
    groups = Groups(sides["building_number"].to_numpy(np.int64))
    severity = _severity(sides)
    worst = _worst(severity, sides, groups)
    largest = severity[worst]
    of_worst = sides.iloc[worst].reset_index(drop=True)
    # All columns in any order
    columns = {
        "building_number": of_worst["building_number"],
        "building_id": of_worst["building_id"],
        "severity": largest,
        "risk_class": _classes(largest, classes),
        **_chances(sides, groups),
        "position": _position(sides, groups, angle),
        **_hits(sides, groups),
        "worst_neighbour": of_worst["neighbour_id"],
        "worst_pair": of_worst["pair_id"],
        "worst_azimuth": of_worst["direction"],
        **prevention(sides, groups, of_worst["neighbour_id"]),
        "floors_misaligned": groups.any(sides["floors_misaligned"].to_numpy(bool)),
        **_rows(sides, groups),
        **{name: of_worst[name] for name in ("area", "longitude", "latitude")},
        **{name: groups.largest(values(sides, name)) for name in ("importance", "occupants")},
        "flags": _flags(sides, groups),
    }
    return pd.DataFrame(columns)


def _classes(severity: FloatArray, classes: Mapping[str, float]) -> NDArray[np.object_]:
    """Return the risk class of each building; that of unknown gaps if no gap is known."""
    named = risk_class(np.nan_to_num(severity), dict(classes))
    return np.where(np.isnan(severity), UNKNOWN_CLASS, named).astype(object)


def _severity(sides: pd.DataFrame) -> FloatArray:
    """Return the expected impact velocity of the pair, increased by the effect of the row, m/s."""
    added = values(sides, "impact_velocity") - values(sides, "impact_velocity_alone")
    # A row that softens a hit once does not so in the next earthquake
    more: FloatArray = np.nan_to_num(np.maximum(added, 0.0))
    return values(sides, "expected_impact_velocity") + more


def _worst(severity: FloatArray, sides: pd.DataFrame, groups: Groups) -> NDArray[np.intp]:
    """Return the index of the worst side of each building: by severity, then rank of the pair."""
    building = sides["building_number"].to_numpy(np.int64)
    order = np.lexsort([values(sides, "rank"), -severity, building])
    return order[groups.starts]


def _chances(sides: pd.DataFrame, groups: Groups) -> dict[str, FloatArray]:
    """Return both bounds of the probability that any neighbour of known gap hits the building."""
    probability = values(sides, "probability")
    common = groups.largest(probability)
    # Rounding must not take the bound of independent pairs below the other one
    missed = groups.product(1.0 - np.nan_to_num(probability))
    independent = np.maximum(1.0 - missed, common)
    return {"probability_independent": independent, "probability_common": common}


def _position(sides: pd.DataFrame, groups: Groups, angle: float) -> NDArray[np.object_]:
    """Return the position of each building among its neighbours."""
    known = ~np.isnan(values(sides, "direction"))
    axis = np.where(known, values(sides, "azimuth"), np.nan)
    # Azimuths from 0 and from 90 degrees: axes that are near each other are so in one of them
    spreads = []
    for zero in (0.0, 90.0):
        turned = (axis + zero) % 180.0
        spreads.append(np.nan_to_num(groups.largest(turned) - groups.smallest(turned)))
    corner = np.minimum(*spreads) > angle
    # Two neighbours in one row, or one
    inside = groups.largest(_contacts_in_row(sides)) == 2
    single = groups.largest(values(sides, "buildings")) == 2
    names = np.where(single & (groups.sizes == 1), "single", "end")
    position: NDArray[np.object_] = np.where(inside, "inside", names).astype(object)
    position[corner] = "corner"
    return position


def _contacts_in_row(sides: pd.DataFrame) -> FloatArray:
    """Return the number of sides with neighbours in the same row, for the building of each side."""
    row, _ = pd.factorize(sides["row_id"])
    building = sides["building_number"].to_numpy(np.int64)
    # Sides of a building are ordered by their rows
    begins = (np.diff(building, prepend=-1) != 0) | (np.diff(row, prepend=-1) != 0)
    sizes = np.diff(np.flatnonzero(begins), append=building.size)
    return np.repeat(sizes, sizes).astype(np.float64)


def _hits(sides: pd.DataFrame, groups: Groups) -> dict[str, FloatArray | NDArray[np.int64]]:
    """Return numbers of neighbours and of hits, by compass side too, and the largest of them."""
    # Neighbours, each once
    velocity = values(sides, "impact_velocity")
    neighbour = sides["neighbour_number"].to_numpy(np.int64)
    every = np.ones(neighbour.size, dtype=bool)
    can_hit = (sides["state"] != "no").to_numpy() | (velocity > 0.0)
    return {
        "neighbours": groups.distinct(neighbour, every),
        "neighbours_that_can_hit": groups.distinct(neighbour, can_hit),
        **_impacts(sides, groups),
        "impact_velocity": groups.largest(velocity),
        "amplification_row": groups.largest(values(sides, "amplification")),
        "amplification_pair": groups.largest(values(sides, "amplification_alone")),
    }


def _impacts(sides: pd.DataFrame, groups: Groups) -> dict[str, FloatArray]:
    """Return the numbers of hits in total and by compass side."""
    impacts = values(sides, "impacts")
    found = {"impacts": groups.sum(impacts)}
    # The quarter of the compass in which the neighbour is
    quarter = np.floor((values(sides, "direction") + 45.0) % 360.0 / 90.0) * 90.0
    for side, middle in COMPASS.items():
        here = np.where(np.isnan(impacts), np.nan, np.where(quarter == middle, impacts, 0.0))
        found[f"impacts_{side}"] = groups.sum(here)
    return found


def _rows(
    sides: pd.DataFrame, groups: Groups
) -> dict[str, NDArray[np.object_] | NDArray[np.int64]]:
    """Return the names of the rows of each building, and the length of the longest."""
    names = groups.texts(sides["row_id"].to_numpy(object), " ".join)
    longest = groups.largest(values(sides, "buildings")).astype(np.int64)
    return {"rows": names, "longest_row": longest}


def _flags(sides: pd.DataFrame, groups: Groups) -> NDArray[np.object_]:
    """Return the flags of each building, including those of its rows."""
    # Many rows share few texts
    codes, texts = pd.factorize(sides["flags"])
    words = [str(text).split(" ") for text in texts]
    raised = {}
    for name in FLAGS:
        raised[name] = groups.any(np.array([name in found for found in words])[codes])
    # And of the building itself
    hit, alone = values(sides, "impact_velocity"), values(sides, "impact_velocity_alone")
    own = (hit > 0.0) & (alone == 0.0), sides["floors_misaligned"].to_numpy(bool)
    for name, rows in zip(BUILDING_FLAGS, own, strict=True):
        raised[name] = groups.any(rows)
    return joined_names(raised)
