"""
Gaps required by building codes and screening procedures, for comparison with the estimate.

``code_rules.csv`` lists clause, edition, inputs and source of every rule: its form was compared
with a page that quotes it, none with the printed text of the code. A code means its inelastic
design displacement; a column that uses the displacement of an event's elastic spectrum instead has
``event_based`` in its name. A cell is empty where the rule lacks an input; where an input that has
a larger and a smaller answer is unknown, the larger gap is required.
"""

from functools import cache
from importlib.resources import files

import numpy as np
import pandas as pd
from numpy.typing import ArrayLike

from per_obspy import checks
from per_obspy.checks import FloatArray
from per_obspy.config import Codes
from per_obspy.inventory.schema import Column
from per_obspy.inventory.table_columns import numbers_in
from per_obspy.screening.values import BoolArray, Both, Columns, both, values

#: Heights closer than this count as equal, m.
SAME_HEIGHT = 0.01

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


#: Column that compares the gap with all rules that were asked for.
SUFFICES = Column(
    "gap_suffices",
    "str",
    "",
    "no if the gap is below a required_gap_... of the row, yes if it reaches all of them, unknown "
    "if one is empty",
)


def code_rules() -> pd.DataFrame:
    """Read the rules: rule, column, unit, clause, edition, inputs, source, meaning."""
    with files("per_obspy.screening").joinpath("code_rules.csv").open(encoding="utf-8") as table:
        return pd.read_csv(table, keep_default_na=False)


@cache
def rule_columns() -> dict[str, Column]:
    """Return all columns of rules; each meaning begins with edition and clause."""
    columns = {}
    for rule in code_rules().astype(str).to_dict("records"):
        meaning = f"{rule['edition']}, {rule['clause']}: {rule['meaning']}"
        columns[rule["column"]] = Column(rule["column"], "float64", rule["unit"], meaning)
    return columns | {SUFFICES.name: SUFFICES}


@cache
def _rules() -> dict[str, str]:
    """Return column -> rule as a configuration names it."""
    rules = code_rules()
    return dict(zip(rules["column"], rules["rule"], strict=True))


def code_columns(
    pairs: pd.DataFrame, displacement_1: ArrayLike, displacement_2: ArrayLike, codes: Codes
) -> pd.DataFrame:
    """
    Compute the required gap of each rule in ``codes.rules``, and whether the gap suffices.

    Arguments are those of :func:`required_gaps`. There is no column if there is no rule.
    """
    asked = [name for name, rule in _rules().items() if rule in codes.rules]
    if not asked:
        return pd.DataFrame(index=pairs.index)
    required = required_gaps(pairs, displacement_1, displacement_2, codes)[asked]
    # A rule that is not met decides, whatever is unknown
    too_small = required.gt(values(pairs, "gap"), axis=0).any(axis=1)
    unknown = required.isna().any(axis=1)
    answer = np.select([too_small, unknown], ["no", "unknown"], "yes").astype(object)
    return required.assign(**{SUFFICES.name: answer})


def required_gaps(
    pairs: pd.DataFrame, displacement_1: ArrayLike, displacement_2: ArrayLike, codes: Codes
) -> pd.DataFrame:
    """
    Compute the gap of each code or screening rule for every pair.

    Parameters
    ----------
    pairs : DataFrame
        Completed pair table; a column ``ntc_zone`` (I, II, III) goes before the setting of that
        name. ``same_property``, ``importance_1`` and ``importance_2`` are used where the table has
        them.
    displacement_1, displacement_2 : (n_pairs,) array_like
        Elastic displacement of each building at contact height in the event, m.
    codes : Codes
        Zone, intensity and design ground motion of the region, as far as known.

    Returns
    -------
    DataFrame
        The columns of ``code_rules.csv`` in that order, on the index of the pairs; gaps in m.

    Raises
    ------
    ValueError
        If a displacement is negative or not finite.
    """
    sides = (
        checks.not_negative("displacement_1", displacement_1),
        checks.not_negative("displacement_2", displacement_2),
    )
    gaps = _height_gaps(pairs, codes) | _displacement_gaps(pairs, sides, codes)
    return pd.DataFrame(gaps, index=pairs.index).add_prefix("required_gap_")[[*_rules()]]


def _height_gaps(pairs: pd.DataFrame, codes: Codes) -> Columns:
    """Return the gaps of rules that rest on heights and systems alone."""
    lower = np.minimum(*both(pairs, "height"))
    step = np.nan if codes.gb_intensity is None else GB_STEP[codes.gb_intensity]
    # the larger factor of both systems, 100 mm at least; a NaN, an unknown factor, stays
    factor_1, factor_2 = (
        np.asarray(pairs[f"system_{i}"].map(GB_FACTOR), dtype=np.float64) for i in (1, 2)
    )
    frames = np.maximum(factor_1, factor_2) * (0.1 + 0.02 * _started_steps(lower - 15.0, step))
    simplified = _by_zone(pairs, codes, NTC_SIMPLIFIED) * values(pairs, "contact_height")
    return {
        "ntc2004_simplified": _halved(pairs, codes) * 2.0 * np.maximum(0.05, simplified),
        "gb50011_2010": np.maximum(frames, 0.1),
        "gem": 0.04 * lower,
    }


def _displacement_gaps(pairs: pd.DataFrame, sides: Both, codes: Codes) -> Columns:
    """Return the gaps of rules that rest on the displacements of both sides, m."""
    total, squares = np.add(*sides), np.hypot(*sides)
    contact, lower = values(pairs, "contact_height"), np.minimum(*both(pairs, "height"))
    one_property, aligned = _one_property(pairs), _aligned(pairs, codes)
    # without a ground acceleration the largest share of the height, that of 0.5 g
    italy = contact * (0.01 * min(2.0 * (codes.italy_ground or 0.5), 1.0))
    turkey = 0.03 + 0.01 * _started_steps(lower - 6.0, 3.0)
    return {
        "asce7_event_based": np.where(one_property, squares, total),
        "ntc2004_event_based": _ntc2004(pairs, sides, codes),
        # elastic displacements are R / I times reduced ones
        "tbdy2018_event_based": np.maximum(turkey, np.where(aligned, 0.25, 0.5) * squares),
        "ntc2018_italy_event_based": np.maximum(total, italy),
        "is1893_amended_event_based": np.where(aligned, 0.5, 1.0) * total,
        "e030_event_based": np.maximum(np.maximum(0.006 * lower, 0.03), 2.0 / 3.0 * total),
        "iran2800_event_based": _iran2800(pairs, sides, 0.005 * contact),
        "rpa2024_event_based": np.maximum(0.04, squares),
    }


def _ntc2004(pairs: pd.DataFrame, sides: Both, codes: Codes) -> FloatArray:
    """Return the sum of both sides, each its displacement and a share of the contact height."""
    added = _by_zone(pairs, codes, NTC_SHARE) * values(pairs, "contact_height")
    gaps = (np.maximum(0.05, side + added) for side in sides)
    return _halved(pairs, codes) * np.add(*gaps)


def _iran2800(pairs: pd.DataFrame, sides: Both, share: FloatArray) -> FloatArray:
    """
    Return the sum of both sides of the property line by Iran's standard 2800.

    Within one property the root of the sum of squares of two displacements is enough; a share of
    the height of either building keeps the sum.
    """
    gap, by_displacement = np.zeros_like(share), _one_property(pairs)
    for i, displacement in enumerate(sides, start=1):
        # the share alone only where storeys are few and importance is known to be ordinary
        few = values(pairs, f"storeys_{i}") <= IRAN_STOREYS
        simple = few & (numbers_in(pairs, f"importance_{i}") <= 1.0)
        gap += np.where(simple, share, np.maximum(share, displacement))
        by_displacement = by_displacement & ~simple & (displacement >= share)
    return np.where(by_displacement, np.hypot(*sides), gap)


def _started_steps(further: FloatArray, step: float) -> FloatArray:
    """Return the number of started steps of a further height, m; round-off starts none."""
    return np.maximum(np.ceil(further / step - 1e-9), 0.0)


def _one_property(pairs: pd.DataFrame) -> BoolArray:
    """Return a mask of pairs that are known to be within one property."""
    if "same_property" not in pairs:
        return np.zeros(len(pairs), dtype=bool)
    return (pairs["same_property"] == "yes").to_numpy(bool)


def _aligned(pairs: pd.DataFrame, codes: Codes) -> BoolArray:
    return np.abs(values(pairs, "floor_offset")) <= codes.floor_tolerance


def _halved(pairs: pd.DataFrame, codes: Codes) -> FloatArray:
    """Return 0.5 for pairs whose floors, given heights and systems are known to match, else 1."""
    derived = pairs["derived"].str.contains(r"\bsystem_[12]\b", regex=True).to_numpy(bool)
    same_system = pairs["system_1"].to_numpy(object) == pairs["system_2"].to_numpy(object)
    same_height = np.abs(np.subtract(*both(pairs, "height"))) < SAME_HEIGHT
    # a derived system is no evidence
    alike = _aligned(pairs, codes) & ~derived & same_system & same_height
    return np.where(alike, 0.5, 1.0)


def _by_zone(pairs: pd.DataFrame, codes: Codes, shares: dict[str, float]) -> FloatArray:
    """Return the fraction of the height for the pair's zone of Mexico City, NaN if unknown."""
    zone = pd.Series(codes.ntc_zone, index=pairs.index, dtype=object)
    # a valid zone of the pair itself goes before that of the region
    if "ntc_zone" in pairs:
        zone = pairs["ntc_zone"].where(pairs["ntc_zone"].isin(list(shares)), zone)
    return np.asarray(zone.map(shares), dtype=np.float64)
