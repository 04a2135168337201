"""
Formulas of code and screening rules.

Each function takes the quantities of every pair and returns the rule's gap (m), factor or flags,
(n_pairs,). ``code_rules.csv`` lists their clauses and sources. Where an input that has a larger and
a smaller answer is unknown, the larger gap is required.
"""

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from per_obspy.checks import FloatArray
from per_obspy.inventory.table_columns import joined_names

INCH, FOOT = 0.0254, 0.3048

#: Share of the height that each side adds in zones I, II, III (NTC Mexico City 2004, 1.10).
NTC_SHARE = {"I": 0.001, "II": 0.003, "III": 0.006}

#: Share of the height on each side where no displacement was computed (the same clause).
NTC_SIMPLIFIED = {"I": 0.007, "II": 0.009, "III": 0.012}

#: Further height that requires 20 mm more, m, by intensity (GB 50011-2010, 6.1.4).
GB_STEP = {6: 5.0, 7: 4.0, 8: 3.0, 9: 2.0}

#: Gap of a system over that of concrete frames (GB 50011-2010, 6.1.4 and 8.1.4).
GB_FACTOR = {
    "concrete_mrf": 1.0,
    "concrete_frame_wall": 0.7,
    "concrete_wall": 0.5,
    "steel_mrf": 1.5,
    "ebf_brbf": 1.5,
}

#: Storeys up to which a share of the height may replace the displacement (Iran 2800).
IRAN_STOREYS = 8.0

#: Gap per storey of the shorter building, m, by seismicity (FEMA P-154, level 1; unverified).
FEMA_GAP = {
    "very_high": 2.0 * INCH,
    "high": 1.5 * INCH,
    "moderately_high": 1.0 * INCH,
    "lower": 0.5 * INCH,
}


class RuleInputs(NamedTuple):
    """Quantities of every pair that the rules use, lengths in m; NaN where unknown."""

    displacement: tuple[FloatArray, FloatArray]
    storeys: tuple[FloatArray, FloatArray]
    importance: tuple[FloatArray, FloatArray]
    gap: FloatArray
    lower_height: FloatArray
    contact_height: FloatArray
    floor_offset: FloatArray
    system_factor: FloatArray  # of GB 50011, of the system that requires more
    aligned: NDArray[np.bool_]  # floors known to be at one level
    alike: NDArray[np.bool_]  # height, system and floors known to match
    one_property: NDArray[np.bool_]  # known to be
    end_of_row: NDArray[np.bool_]


def root_of_squares(pair: RuleInputs) -> FloatArray:
    """Return the root of the sum of squares of both displacements."""
    return np.hypot(*pair.displacement)


def total(pair: RuleInputs) -> FloatArray:
    """Return the sum of both displacements."""
    return np.add(*pair.displacement)


def by_property(pair: RuleInputs) -> FloatArray:
    """Return the root of squares within one property, the sum on both sides of a property line."""
    return np.where(pair.one_property, root_of_squares(pair), total(pair))


def ec8(pair: RuleInputs) -> FloatArray:
    """Return the gap of EN 1998-1, 4.4.2.7: 0.7 of the gap by property where floors align."""
    return np.where(pair.aligned, 0.7, 1.0) * by_property(pair)


def ntc_mexico(pair: RuleInputs, share: FloatArray) -> FloatArray:
    """Return the sum of both sides: each max(50 mm, displacement + share of the height)."""
    side_1, side_2 = (
        np.maximum(0.05, displacement + share * pair.contact_height)
        for displacement in pair.displacement
    )
    gap: FloatArray = side_1 + side_2
    return gap


def ntc2004(pair: RuleInputs, share: FloatArray) -> FloatArray:
    """Return the gap of NTC Mexico City 2004, 1.10; halved between buildings that are alike."""
    return np.where(pair.alike, 0.5, 1.0) * ntc_mexico(pair, share)


def ntc2004_simplified(pair: RuleInputs, share: FloatArray) -> FloatArray:
    """Return the gap of NTC Mexico City 2004, 1.10, for the simplified method."""
    both_sides = 2.0 * np.maximum(0.05, share * pair.contact_height)
    return np.where(pair.alike, 0.5, 1.0) * both_sides


def gb50011(pair: RuleInputs, step: float) -> FloatArray:
    """Return the gap of GB 50011-2010: of concrete frames, times the factor of the system."""
    frames = 0.1 + 0.02 * started_steps(pair.lower_height - 15.0, step)
    # 100 mm at least; a NaN, an unknown factor, stays
    return np.maximum(pair.system_factor * frames, 0.1)


def gem(pair: RuleInputs) -> FloatArray:
    """Return the gap from which a building counts as detached (GEM)."""
    return 0.04 * pair.lower_height


def tbdy2018(pair: RuleInputs) -> FloatArray:
    """Return the gap of TBDY 2018, 4.9.3; elastic displacements are R / I times reduced ones."""
    least = 0.03 + 0.01 * started_steps(pair.lower_height - 6.0, 3.0)
    share = np.where(pair.aligned, 0.25, 0.5)
    return np.maximum(least, share * root_of_squares(pair))


def ntc2018_italy(pair: RuleInputs, ground: float) -> FloatArray:
    """Return the gap of NTC Italy 2018, 7.2.1, at a ground acceleration a_g S, in g."""
    least = 0.01 * pair.contact_height * min(2.0 * ground, 1.0)
    return np.maximum(total(pair), least)


def is1893_amended(pair: RuleInputs) -> FloatArray:
    """Return the gap of IS 1893:2016 with amendment 1: half of the sum where floors align."""
    return np.where(pair.aligned, 0.5, 1.0) * total(pair)


def e030(pair: RuleInputs) -> FloatArray:
    """Return the gap of E.030, 33.2: the largest of three conditions."""
    least = np.maximum(0.006 * pair.lower_height, 0.03)
    return np.maximum(least, 2.0 / 3.0 * total(pair))


def iran2800(pair: RuleInputs) -> FloatArray:
    """
    Return the sum of both sides of the property line by Iran's standard 2800.

    Within one property the root of the sum of squares of two displacements is enough; a share of
    the height of either building keeps the sum.
    """
    share = 0.005 * pair.contact_height
    total_gap, by_displacement = np.zeros_like(share), np.ones(share.shape, dtype=bool)
    for displacement, storeys, importance in zip(
        pair.displacement, pair.storeys, pair.importance, strict=True
    ):
        # The share alone only where storeys are few and importance is known to be ordinary
        simple = (storeys <= IRAN_STOREYS) & (importance <= 1.0)
        total_gap += np.where(simple, share, np.maximum(share, displacement))
        by_displacement &= ~simple & (displacement >= share)
    return np.where(pair.one_property & by_displacement, root_of_squares(pair), total_gap)


def rpa99(pair: RuleInputs) -> FloatArray:
    """Return the gap of RPA 99 version 2003, 5.8."""
    return np.maximum(0.04, 0.015 + total(pair))


def rpa2024(pair: RuleInputs) -> FloatArray:
    """Return the gap of RPA 2024, 5.8."""
    return np.maximum(0.04, root_of_squares(pair))


def nch433(pair: RuleInputs) -> FloatArray:
    """Return the gap of NCh433, 5.10, each side at least 0.002 of the height and 15 mm."""
    least = np.maximum(0.002 * pair.contact_height, 0.015)
    side_1, side_2 = (np.maximum(displacement, least) for displacement in pair.displacement)
    gap: FloatArray = side_1 + side_2
    return gap


def started_steps(height: FloatArray, step: float) -> FloatArray:
    """Return the number of started steps of an additional height; round-off starts none."""
    steps: FloatArray = np.maximum(np.ceil(height / step - 1e-9), 0.0)
    return steps


def fema_gap(pair: RuleInputs, per_storey: float) -> FloatArray:
    """Return the gap of FEMA P-154: a length per storey of the building with fewer storeys."""
    gap: FloatArray = per_storey * np.minimum(*pair.storeys)
    return gap


def fema_flags(pair: RuleInputs, per_storey: float) -> NDArray[np.object_]:
    """Return the names of the adjacency conditions of FEMA P-154 that each pair meets."""
    flags = {
        "separation": pair.gap < fema_gap(pair, per_storey),
        "floor_misalignment": np.abs(pair.floor_offset) > 2.0 * FOOT,
        "height_difference": np.abs(np.subtract(*pair.storeys)) >= 2.0,
        "end_of_row": pair.end_of_row,
    }
    # Pounding is possible where the gap is too small and one of the other conditions is met
    others = flags["floor_misalignment"] | flags["height_difference"] | flags["end_of_row"]
    flags["pounding"] = flags["separation"] & others
    return joined_names(flags)


def nzsee_factor(pair: RuleInputs) -> FloatArray:
    """Return the pounding factor D of NZSEE's initial evaluation: the smaller of D1 and D2."""
    # By gap over height of the lower building: below 0.5 %, up to 1 %, above
    ratio = pair.gap / pair.lower_height
    near, middle = ratio < 0.005, ratio <= 0.01
    # D1, by the floors
    aligned = np.select([near, middle], [0.7, 0.8], 1.0)
    misaligned = np.select([near, middle], [0.4, 0.7], 0.8)
    by_floors = np.where(pair.aligned, aligned, misaligned)
    # D2, by the difference in storeys: more than four, two to four, fewer
    difference = np.abs(np.subtract(*pair.storeys))
    tall = np.select([near, middle], [0.4, 0.7], 1.0)
    taller = np.select([near, middle], [0.7, 0.9], 1.0)
    by_height = np.select([difference > 4.0, difference >= 2.0], [tall, taller], 1.0)
    known = ~np.isnan(ratio) & ~np.isnan(pair.floor_offset) & ~np.isnan(difference)
    return np.where(known, np.minimum(by_floors, by_height), np.nan)
