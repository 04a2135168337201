"""
Gaps required by building codes and screening procedures, for comparison with the estimate.

``code_rules.csv`` lists clause, edition, inputs and source of every rule, and whether its form was
verified against a page that quotes it; the names of the others end in ``_unverified``. No rule
here was compared with the code's own printed text. A code means its own inelastic design
displacement; a column that uses the displacement of an event's elastic spectrum instead has
``event_based`` in its name. A cell is empty where the rule lacks an input.
"""

from importlib.resources import files
from typing import NamedTuple

import numpy as np
import pandas as pd
from numpy.typing import ArrayLike, NDArray

from per_obspy import checks
from per_obspy.checks import FloatArray
from per_obspy.config import Codes
from per_obspy.inventory.schema import Column
from per_obspy.inventory.table_columns import joined_names
from per_obspy.screening.values import both, values

INCH, FOOT = 0.0254, 0.3048

#: Share of the height that each side adds in zones I, II, III (NTC Mexico City 2004, 1.10).
NTC_SHARE = {"I": 0.001, "II": 0.003, "III": 0.006}

#: Further height that requires 20 mm more, m, by intensity (GB 50011-2010, 6.1.4).
GB_STEP = {6: 5.0, 7: 4.0, 8: 3.0, 9: 2.0}

#: Gap per storey of the shorter building, m, by seismicity (FEMA P-154, level 1; unverified).
FEMA_GAP = {
    "very_high": 2.0 * INCH,
    "high": 1.5 * INCH,
    "moderately_high": 1.0 * INCH,
    "lower": 0.5 * INCH,
}

#: Heights closer than this count as equal, m.
SAME_HEIGHT = 0.01


class _RuleInputs(NamedTuple):
    """Quantities of every pair that the rules use, lengths in m; NaN where unknown."""

    displacement: tuple[FloatArray, FloatArray]
    storeys: tuple[FloatArray, FloatArray]
    gap: FloatArray
    lower_height: FloatArray
    contact_height: FloatArray
    floor_offset: FloatArray
    aligned: NDArray[np.bool_]  # floors known to be at one level
    alike: NDArray[np.bool_]  # height, system and floors known to match
    concrete_frames: NDArray[np.bool_]  # both buildings
    end_of_row: NDArray[np.bool_]


def code_rules() -> pd.DataFrame:
    """Read the rules: column, unit, clause, edition, inputs, verified (yes/no), source, meaning."""
    with files("per_obspy.screening").joinpath("code_rules.csv").open(encoding="utf-8") as table:
        return pd.read_csv(table, keep_default_na=False)


def rule_columns() -> dict[str, Column]:
    """Return the columns of the rules; each meaning begins with edition and clause."""
    columns = {}
    for rule in code_rules().astype(str).to_dict("records"):
        meaning = f"{rule['edition']}, {rule['clause']}: {rule['meaning']}"
        kind = "float64" if rule["unit"] else "str"
        columns[rule["column"]] = Column(rule["column"], kind, rule["unit"], meaning)
    return columns


def code_columns(
    pairs: pd.DataFrame, displacement_1: ArrayLike, displacement_2: ArrayLike, codes: Codes
) -> pd.DataFrame:
    """
    Compute the gap, factor or flags of each code or screening rule for every pair.

    Parameters
    ----------
    pairs : DataFrame
        Completed pair table; a column ``ntc_zone`` (I, II, III) goes before the setting of that
        name.
    displacement_1, displacement_2 : (n_pairs,) array_like
        Elastic displacement of each building at contact height in the event, m.
    codes : Codes
        Zone, intensity and seismicity of the region, as far as they are known.

    Returns
    -------
    DataFrame
        The columns of ``code_rules.csv`` in that order, on the index of the pairs; gaps in m.

    Raises
    ------
    ValueError
        If a displacement is negative or not finite.
    """
    pair = _rule_inputs(pairs, displacement_1, displacement_2, codes)
    # Elastic displacements of the event, combined by the root of the squares and by their sum
    srss, total = np.hypot(*pair.displacement), np.add(*pair.displacement)
    columns = {
        "required_gap_asce7_event_based": srss,
        "required_gap_ntc2004_event_based": _ntc2004(pair, _zone_share(pairs, codes)),
        "required_gap_gb50011_2010": _gb50011(pair, codes),
        "required_gap_gem": 0.04 * pair.lower_height,
        "required_gap_tbdy2018_event_based_unverified": _tbdy2018(pair),
        "required_gap_ec8_event_based_unverified": srss * np.where(pair.aligned, 0.7, 1.0),
        "required_gap_is1893_event_based_unverified": total * np.where(pair.aligned, 0.5, 1.0),
        "required_gap_e030_unverified": np.maximum(0.006 * pair.lower_height, 0.03),
        "required_gap_fema_p154_unverified": _fema_gap(pair, codes),
        "fema_p154_flags_unverified": _fema_flags(pair, codes),
        "nzsee_iep_factor_unverified": _nzsee_factor(pair),
    }
    return pd.DataFrame(columns, index=pairs.index)


def _rule_inputs(
    pairs: pd.DataFrame, displacement_1: ArrayLike, displacement_2: ArrayLike, codes: Codes
) -> _RuleInputs:
    """Return the quantities that the rules use, from a completed pair table."""
    displacement = (
        checks.not_negative("displacement_1", displacement_1),
        checks.not_negative("displacement_2", displacement_2),
    )
    # NaN, an unknown offset, is not aligned
    floor_offset = values(pairs, "floor_offset")
    aligned = np.abs(floor_offset) <= codes.floor_tolerance

    # Structural systems and heights; the position in the row is optional
    system_1, system_2 = pairs["system_1"].to_numpy(object), pairs["system_2"].to_numpy(object)
    height_1, height_2 = both(pairs, "height")
    position = pairs["position"] if "position" in pairs else pd.Series("", index=pairs.index)
    return _RuleInputs(
        displacement=displacement,
        storeys=both(pairs, "storeys"),
        gap=values(pairs, "gap"),
        lower_height=np.minimum(height_1, height_2),
        contact_height=values(pairs, "contact_height"),
        floor_offset=floor_offset,
        aligned=aligned,
        alike=aligned & _same_structure(pairs),
        concrete_frames=(system_1 == "concrete_mrf") & (system_2 == "concrete_mrf"),
        end_of_row=(position == "end").to_numpy(bool),
    )


def _same_structure(pairs: pd.DataFrame) -> NDArray[np.bool_]:
    """Return which pairs have buildings of the same height and the same system, not derived."""
    height_1, height_2 = both(pairs, "height")
    derived = pairs["derived"].str.contains(r"\bsystem_[12]\b", regex=True).to_numpy(bool)
    same_system = pairs["system_1"].to_numpy(object) == pairs["system_2"].to_numpy(object)
    same: NDArray[np.bool_] = ~derived & same_system & (np.abs(height_1 - height_2) < SAME_HEIGHT)
    return same


def _zone_share(pairs: pd.DataFrame, codes: Codes) -> FloatArray:
    """Return the share of the height that NTC 2004 adds in the pair's zone, NaN if unknown."""
    zone = pd.Series(codes.ntc_zone, index=pairs.index, dtype=object)
    # A valid zone of the pair itself goes before that of the region
    if "ntc_zone" in pairs:
        zone = pairs["ntc_zone"].where(pairs["ntc_zone"].isin(list(NTC_SHARE)), zone)
    return np.asarray(zone.map(NTC_SHARE), dtype=np.float64)


def _ntc2004(pair: _RuleInputs, share: FloatArray) -> FloatArray:
    """Return the gap of NTC Mexico City 2004, 1.10; halved between buildings that are alike."""
    side_1, side_2 = (
        np.maximum(0.05, displacement + share * pair.contact_height)
        for displacement in pair.displacement
    )
    gap: FloatArray = np.where(pair.alike, 0.5, 1.0) * (side_1 + side_2)
    return gap


def _gb50011(pair: _RuleInputs, codes: Codes) -> FloatArray:
    """Return the gap of GB 50011-2010, 6.1.4, between concrete frames."""
    step = np.nan if codes.gb_intensity is None else GB_STEP[codes.gb_intensity]
    gap = 0.1 + 0.02 * _started_steps(pair.lower_height - 15.0, step)
    return np.where(pair.concrete_frames, gap, np.nan)


def _tbdy2018(pair: _RuleInputs) -> FloatArray:
    """Return the gap of TBDY 2018: a share of the displacements, at least that of the height."""
    least = 0.03 + 0.01 * _started_steps(pair.lower_height - 6.0, 3.0)
    share = np.where(pair.aligned, 0.25, 0.5)
    gap: FloatArray = np.maximum(least, share * np.add(*pair.displacement))
    return gap


def _started_steps(height: FloatArray, step: float) -> FloatArray:
    """Return the number of steps that a further height has started; rounding starts none."""
    steps: FloatArray = np.maximum(np.ceil(height / step - 1e-9), 0.0)
    return steps


def _fema_gap(pair: _RuleInputs, codes: Codes) -> FloatArray:
    """Return the gap of FEMA P-154: a length per storey of the building with fewer storeys."""
    per_storey = np.nan if codes.fema_seismicity is None else FEMA_GAP[codes.fema_seismicity]
    gap: FloatArray = per_storey * np.minimum(*pair.storeys)
    return gap


def _fema_flags(pair: _RuleInputs, codes: Codes) -> NDArray[np.object_]:
    """Return the names of the adjacency conditions of FEMA P-154 that each pair meets."""
    flags = {
        "separation": pair.gap < _fema_gap(pair, codes),
        "floor_misalignment": np.abs(pair.floor_offset) > 2.0 * FOOT,
        "height_difference": np.abs(np.subtract(*pair.storeys)) >= 2.0,
        "end_of_row": pair.end_of_row,
    }
    # Pounding is possible where the gap is too small and one of the other conditions is met
    others = flags["floor_misalignment"] | flags["height_difference"] | flags["end_of_row"]
    flags["pounding"] = flags["separation"] & others
    return joined_names(flags)


def _nzsee_factor(pair: _RuleInputs) -> FloatArray:
    """Return the pounding factor of the NZSEE initial evaluation procedure."""
    # By gap over height of the lower building: below 0.5 %, up to 1 %, above
    ratio = pair.gap / pair.lower_height
    near, middle = ratio < 0.005, ratio <= 0.01
    aligned = np.select([near, middle], [0.7, 0.8], 1.0)
    misaligned = np.select([near, middle], [0.4, 0.7], 0.8)
    known = ~np.isnan(ratio) & ~np.isnan(pair.floor_offset)
    return np.where(known, np.where(pair.aligned, aligned, misaligned), np.nan)
