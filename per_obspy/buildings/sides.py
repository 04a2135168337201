"""
Table of buildings: one row per building, from the sides on which neighbours can hit it.

A side is a contact seen from one of its buildings. A building is hit if any neighbour hits it.
Pairs that share a building share the earthquake too: the probability lies between that of one
common cause, which is the largest of its pairs, and that of independent pairs.
"""

from collections.abc import Mapping

import numpy as np
import pandas as pd
from numpy.typing import ArrayLike, NDArray

from per_obspy.buildings.columns import BUILDING_FLAGS, COMPASS, FLAGS
from per_obspy.checks import FloatArray
from per_obspy.inventory.table_columns import joined_names
from per_obspy.screening.ranking import UNKNOWN_CLASS, risk_class
from per_obspy.screening.values import values

#: Columns of the risk table that a side of a building needs, besides those of its interface.
OF_PAIRS = (
    "rank", "state", "probability", "weighted_velocity", "missing_gap",
    "supplemental_damping", "bumper_restitution", "floors_misaligned", "demand",
    *(f"{name}_{i}" for name in ("longitude", "latitude", "importance", "occupants", "period")
      for i in (1, 2)),
)  # fmt: skip

#: Impact velocity for which the worst unknown gap of a building stands in the ranking, m/s.
UNKNOWN = "velocity_of_unknown"

#: Texts of a building without need of a measure, and of one that needs them in other gaps.
NOTHING = "no measure for the likeliest inputs: its gaps are enough"
ELSEWHERE = "wider gaps elsewhere in its row: its own are enough for each pair alone"

#: Text of a building with a gap that is not known.
MEASURE = "measure the gaps that are not known"

#: Missing gap below which it is not written, m.
SHORTEST = 5e-4

BoolArray = NDArray[np.bool_]


def directions(azimuth: ArrayLike, flags: ArrayLike) -> dict[str, FloatArray]:
    """
    Return the directions from the building on each side of interfaces to the other one, degrees.

    They are NaN if the axis of the row, from its first to its last building, is unknown.
    """
    # Many rows share few texts
    codes, texts = pd.factorize(np.asarray(flags, dtype=object))
    known = np.array(["unknown_azimuth" not in text for text in texts], dtype=bool)[codes]
    axis = np.where(known, np.asarray(azimuth, dtype=np.float64), np.nan)
    return {"direction_left": axis % 360.0, "direction_right": (axis + 180.0) % 360.0}


class Sides:
    """
    Sides of buildings, and reductions to buildings.

    Their ``building_number`` never falls, so that all sides of a building are together.
    """

    def __init__(self, table: pd.DataFrame) -> None:
        number = table["building_number"].to_numpy(np.int64)
        self.table = table
        self.starts = np.flatnonzero(np.diff(number, prepend=number[:1] - 1))
        self.sizes = np.diff(self.starts, append=number.size)
        self.building = np.repeat(np.arange(self.starts.size), self.sizes)

    def __getitem__(self, name: str) -> FloatArray:
        """Return a column of numbers of the sides."""
        return values(self.table, name)

    def sum(self, column: FloatArray) -> FloatArray:
        """Return the sum of each building; NaN counts as 0, unless it has only NaN."""
        known = np.logical_or.reduceat(~np.isnan(column), self.starts)
        return np.where(known, np.add.reduceat(np.nan_to_num(column), self.starts), np.nan)

    def largest(self, column: FloatArray) -> FloatArray:
        """Return the largest value of each building, NaN if it has none."""
        return np.asarray(np.fmax.reduceat(column, self.starts))

    def smallest(self, column: FloatArray) -> FloatArray:
        """Return the smallest value of each building, NaN if it has none."""
        return np.asarray(np.fmin.reduceat(column, self.starts))

    def any(self, column: BoolArray) -> BoolArray:
        """Return whether any side of each building is true."""
        return np.asarray(np.logical_or.reduceat(column, self.starts))

    def distinct(self, name: str, where: BoolArray) -> NDArray[np.int64]:
        """Return the number of different values of a column in some sides of each building."""
        some = self.table[name][where].groupby(self.building[where]).nunique()
        return np.asarray(some.reindex(range(self.starts.size), fill_value=0), dtype=np.int64)


def building_table(table: pd.DataFrame, classes: Mapping[str, float], angle: float) -> pd.DataFrame:
    """
    Return one row per building, in the order of their numbers.

    Parameters
    ----------
    table : DataFrame
        Interfaces as seen from one of their buildings, all of a building one after the other:
        columns of its row and pair without ``_left``, ``_right``, ``_1`` and ``_2``, with
        ``neighbour_number``, ``neighbour_id``, ``direction`` (towards it, degrees), ``area`` and
        ``UNKNOWN``.
    classes : mapping of str to float
        Name and smallest severity of each risk class, m/s, descending to 0.
    angle : float
        Rows whose axes differ by more make their building a corner, degrees.

    Returns
    -------
    DataFrame
        The columns ``columns.BUILDINGS`` without ``rank``, ``building_number``, and ``UNKNOWN``.
    """
    sides = Sides(table)
    severity = _severity(sides)
    # The worst side of each building: by severity, then rank of the pair
    worst = np.lexsort([sides["rank"], -severity, sides.building])[sides.starts]
    largest, of_worst = severity[worst], table.iloc[worst].reset_index(drop=True)
    columns = {
        **of_worst[["building_number", "building_id", "area", "longitude", "latitude"]],
        "worst_neighbour": of_worst["neighbour_id"],
        "worst_pair": of_worst["pair_id"],
        "worst_azimuth": of_worst["direction"],
        "severity": largest,
        "risk_class": _classes(largest, classes),
        "position": _position(sides, angle),
        # Of all sides
        **_chances(sides),
        **_hits(sides),
        **_prevention(sides, of_worst["neighbour_id"]),
        "floors_misaligned": sides.any(table["floors_misaligned"].to_numpy(bool)),
        "rows": _rows(sides),
        "longest_row": sides.largest(sides["buildings"]).astype(np.int64),
        **{name: sides.largest(sides[name]) for name in ("importance", "occupants")},
        "flags": _flags(sides),
        UNKNOWN: sides.largest(sides[UNKNOWN]),
    }
    return pd.DataFrame(columns)


def _severity(sides: Sides) -> FloatArray:
    """Return the weighted impact velocity of the pair, increased by the effect of the row, m/s."""
    added = sides["impact_velocity"] - sides["impact_velocity_alone"]
    # A row that softens a hit once does not so in the next earthquake
    more: FloatArray = np.nan_to_num(np.maximum(added, 0.0))
    return sides["weighted_velocity"] + more


def _classes(severity: FloatArray, classes: Mapping[str, float]) -> NDArray[np.object_]:
    """Return the risk class of each building; that of unknown gaps if no gap is known."""
    named = risk_class(np.nan_to_num(severity), dict(classes))
    return np.where(np.isnan(severity), UNKNOWN_CLASS, named).astype(object)


def _chances(sides: Sides) -> dict[str, FloatArray]:
    """Return both bounds of the probability that any neighbour of known gap hits the building."""
    common = sides.largest(sides["probability"])
    missed = np.multiply.reduceat(1.0 - np.nan_to_num(sides["probability"]), sides.starts)
    # Rounding must not take the bound of independent pairs below the other one
    independent = np.maximum(1.0 - missed, common)
    return {"probability_independent": independent, "probability_common": common}


def _position(sides: Sides, angle: float) -> NDArray[np.object_]:
    """Return the position of each building among its neighbours."""
    axis = np.where(np.isnan(sides["direction"]), np.nan, sides["azimuth"])
    # Azimuths from 0 and from 90 degrees: axes that are near each other are so in one of them
    spreads = []
    for zero in (0.0, 90.0):
        turned = (axis + zero) % 180.0
        spreads.append(np.nan_to_num(sides.largest(turned) - sides.smallest(turned)))
    corner = np.minimum(*spreads) > angle
    # Two neighbours in one row, or one
    in_row = sides.table.groupby(["building_number", "row_id"])["row_id"].transform("size")
    inside = sides.largest(in_row.to_numpy(np.float64)) == 2
    single = (sides.largest(sides["buildings"]) == 2) & (sides.sizes == 1)
    names = np.select([corner, inside, single], ["corner", "inside", "single"], "end")
    return names.astype(object)


def _hits(sides: Sides) -> dict[str, FloatArray | NDArray[np.int64]]:
    """Return numbers of neighbours and of hits, by compass side too, and the largest of them."""
    # Neighbours, each once
    velocity, impacts = sides["impact_velocity"], sides["impacts"]
    every = np.ones(velocity.size, dtype=bool)
    can_hit = (sides.table["state"] != "no").to_numpy(bool) | (velocity > 0.0)
    columns: dict[str, FloatArray | NDArray[np.int64]] = {
        "neighbours": sides.distinct("neighbour_number", every),
        "neighbours_that_can_hit": sides.distinct("neighbour_number", can_hit),
        "impacts": sides.sum(impacts),
    }
    # The quarter of the compass in which the neighbour is
    quarter = np.floor((sides["direction"] + 45.0) % 360.0 / 90.0) * 90.0
    for side, middle in COMPASS.items():
        here = np.where(np.isnan(impacts), np.nan, np.where(quarter == middle, impacts, 0.0))
        columns[f"impacts_{side}"] = sides.sum(here)
    return columns | {
        "impact_velocity": sides.largest(velocity),
        "impact_velocity_84": sides.largest(sides["impact_velocity_84"]),
        "amplification_row": sides.largest(sides["amplification"]),
        "amplification_pair": sides.largest(sides["amplification_alone"]),
    }


def _prevention(sides: Sides, neighbour: pd.Series) -> dict[str, FloatArray | NDArray[np.object_]]:
    """
    Return the measures that protect all sides of each building, with a sentence on them.

    In a row in which no gap closes every building moves as if alone. Gaps that are enough for each
    pair are therefore enough for the row, if all of the row are: the measures of the pairs hold.
    """
    measures = {}
    for name in ("missing_gap", "supplemental_damping", "bumper_restitution"):
        column = sides[name]
        strongest = sides.smallest if name == "bumper_restitution" else sides.largest
        # Where one pair finds no measure there is none for the building
        measures[name] = np.where(sides.any(np.isnan(column)), np.nan, strongest(column))
    missing, hit = measures["missing_gap"], sides.largest(sides["impact_velocity"]) > 0.0
    sentences = np.select([np.isnan(missing), hit], [MEASURE, ELSEWHERE], NOTHING).astype(object)
    # Buildings that need a measure have sentences of their own
    places = np.flatnonzero(missing > 0.0)
    names = neighbour.to_numpy(object)[places].tolist()
    needed = [column[places].tolist() for column in measures.values()]
    sentences[places] = [measures_sentence(*one) for one in zip(*needed, names, strict=True)]
    return {"prevention": sentences, **measures}


def measures_sentence(missing: float, damping: float, bumper: float, neighbour: str) -> str:
    """Return every measure for one building in words."""
    sentence = f"up to {max(missing, SHORTEST):.3f} m more gap (to {neighbour} first)"
    if damping > 0.0:
        sentence += f"; or {damping:.2f} of critical more damping in it and its neighbours"
    if bumper < 1.0:
        sentence += f"; softened by bumpers of restitution {bumper:.2f} or less"
    return sentence


def _rows(sides: Sides) -> NDArray[np.object_]:
    """Return the names of the rows of each building."""
    names = sides.table["row_id"].to_numpy(object)
    rows = names[sides.starts]
    # Few buildings are in several rows
    several = sides.any(np.asarray(names != rows[sides.building], dtype=bool))
    for number in np.flatnonzero(several).tolist():
        first = sides.starts[number]
        rows[number] = " ".join(dict.fromkeys(names[first : first + sides.sizes[number]].tolist()))
    return rows


def _flags(sides: Sides) -> NDArray[np.object_]:
    """Return the flags of each building, including those of its rows."""
    # Many rows share few texts
    codes, texts = pd.factorize(sides.table["flags"])
    words, raised = [str(text).split(" ") for text in texts], {}
    for name in FLAGS:
        raised[name] = sides.any(np.array([name in some for some in words])[codes])
    # And of the building itself
    hit = (sides["impact_velocity"] > 0.0) & (sides["impact_velocity_alone"] == 0.0)
    own = hit, sides.table["floors_misaligned"].to_numpy(bool)
    for name, rows in zip(BUILDING_FLAGS, own, strict=True):
        raised[name] = sides.any(rows)
    return joined_names(raised)
