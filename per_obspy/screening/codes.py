"""
What building codes and screening procedures ask of a gap, beside the estimate.

Clause, edition, inputs and source of every rule stand in ``code_rules.csv``, and whether its form
was verified against a page that quotes it; the names of the others end in ``_unverified``. No rule
here was compared with the code's own printed text. A code means its own inelastic design
displacement; where the displacement of an event's elastic spectrum stands in for it, the name of
the column says ``event_based``. A cell is empty where the rule lacks an input.
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

INCH, FOOT = 0.0254, 0.3048

#: Share of the height that each side adds in zones I, II, III (NTC Mexico City 2004, 1.10).
NTC_SHARE = {"I": 0.001, "II": 0.003, "III": 0.006}

#: Further height that asks for 20 mm more, m, by intensity (GB 50011-2010, 6.1.4).
GB_STEP = {6: 5.0, 7: 4.0, 8: 3.0, 9: 2.0}

#: Gap for every storey of the shorter building, m, by seismicity (FEMA P-154, level 1; unverified).
FEMA_GAP = {
    "very_high": 2.0 * INCH,
    "high": 1.5 * INCH,
    "moderately_high": 1.0 * INCH,
    "lower": 0.5 * INCH,
}

#: Heights closer than this count as equal, m.
SAME_HEIGHT = 0.01


class _Pair(NamedTuple):
    """What the rules use of every pair; NaN where it is unknown."""

    displacement: tuple[FloatArray, FloatArray]
    storeys: tuple[FloatArray, FloatArray]
    gap: FloatArray
    lower_height: FloatArray
    contact_height: FloatArray
    floors: FloatArray  # offset, m
    aligned: NDArray[np.bool_]  # known to be
    alike: NDArray[np.bool_]  # height, system and floors known to match
    frames: NDArray[np.bool_]  # both concrete frames
    end: NDArray[np.bool_]  # of the row


def code_rules() -> pd.DataFrame:
    """Return the rules: column, unit, clause, edition, inputs, verified (yes or no), source, meaning."""
    with files("per_obspy.screening").joinpath("code_rules.csv").open(encoding="utf-8") as table:
        return pd.read_csv(table, keep_default_na=False)


def rule_columns() -> dict[str, Column]:
    """Return the columns of the rules with unit and meaning; the meaning leads with clause and edition."""
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
    Return what each code or screening rule says of every pair.

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
    pair = _pair(pairs, displacement_1, displacement_2, codes)
    columns = {
        "required_gap_asce7_event_based": np.hypot(*pair.displacement),
        "required_gap_ntc2004_event_based": _ntc2004(pair, _zone_share(pairs, codes)),
        "required_gap_gb50011_2010": _gb50011(pair, codes),
        "required_gap_gem": 0.04 * pair.lower_height,
        "required_gap_tbdy2018_event_based_unverified": _tbdy2018(pair),
        "required_gap_ec8_event_based_unverified": np.hypot(*pair.displacement)
        * np.where(pair.aligned, 0.7, 1.0),
        "required_gap_is1893_event_based_unverified": np.add(*pair.displacement)
        * np.where(pair.aligned, 0.5, 1.0),
        "required_gap_e030_unverified": np.maximum(0.006 * pair.lower_height, 0.03),
        "required_gap_fema_p154_unverified": _fema_gap(pair, codes),
        "fema_p154_flags_unverified": _fema_flags(pair, codes),
        "nzsee_iep_factor_unverified": _nzsee_factor(pair),
    }
    return pd.DataFrame(columns, index=pairs.index)


def _pair(
    pairs: pd.DataFrame, displacement_1: ArrayLike, displacement_2: ArrayLike, codes: Codes
) -> _Pair:
    displacement = (
        checks.not_negative("displacement_1", displacement_1),
        checks.not_negative("displacement_2", displacement_2),
    )
    height_1, height_2, storeys_1, storeys_2, gap, contact_height, floors = (
        pairs[name].to_numpy(np.float64)
        for name in (
            "height_1",
            "height_2",
            "storeys_1",
            "storeys_2",
            "gap",
            "contact_height",
            "floor_offset",
        )
    )
    aligned = np.abs(floors) <= codes.floor_tolerance
    system_1, system_2 = pairs["system_1"].to_numpy(object), pairs["system_2"].to_numpy(object)
    given = ~pairs["derived"].str.contains(r"\bsystem_[12]\b", regex=True).to_numpy(bool)
    alike = aligned & given & (system_1 == system_2) & (np.abs(height_1 - height_2) < SAME_HEIGHT)
    position = pairs["position"] if "position" in pairs else pd.Series("", index=pairs.index)
    return _Pair(
        displacement=displacement,
        storeys=(storeys_1, storeys_2),
        gap=gap,
        lower_height=np.minimum(height_1, height_2),
        contact_height=contact_height,
        floors=floors,
        aligned=aligned,
        alike=alike,
        frames=(system_1 == "concrete_mrf") & (system_2 == "concrete_mrf"),
        end=(position == "end").to_numpy(bool),
    )


def _zone_share(pairs: pd.DataFrame, codes: Codes) -> FloatArray:
    """Return the share of the height that NTC 2004 adds in the pair's zone, NaN where the zone is unknown."""
    region = pd.Series(codes.ntc_zone, index=pairs.index, dtype=object)
    zone = (
        pairs["ntc_zone"].where(pairs["ntc_zone"].isin(list(NTC_SHARE)), region)
        if "ntc_zone" in pairs
        else region
    )
    return np.asarray(zone.map(NTC_SHARE), dtype=np.float64)


def _ntc2004(pair: _Pair, share: FloatArray) -> FloatArray:
    first, second = (
        np.maximum(0.05, side + share * pair.contact_height) for side in pair.displacement
    )
    gap: FloatArray = np.where(pair.alike, 0.5, 1.0) * (first + second)
    return gap


def _gb50011(pair: _Pair, codes: Codes) -> FloatArray:
    step = np.nan if codes.gb_intensity is None else GB_STEP[codes.gb_intensity]
    gap = 0.1 + 0.02 * _started(pair.lower_height - 15.0, step)
    return np.where(pair.frames, gap, np.nan)


def _tbdy2018(pair: _Pair) -> FloatArray:
    least = 0.03 + 0.01 * _started(pair.lower_height - 6.0, 3.0)
    gap: FloatArray = np.maximum(
        least, np.where(pair.aligned, 0.25, 0.5) * np.add(*pair.displacement)
    )
    return gap


def _started(height: FloatArray, step: float) -> FloatArray:
    """Return how many steps a further height has started; a rounding error starts none."""
    steps: FloatArray = np.maximum(np.ceil(height / step - 1e-9), 0.0)
    return steps


def _fema_gap(pair: _Pair, codes: Codes) -> FloatArray:
    each = np.nan if codes.fema_seismicity is None else FEMA_GAP[codes.fema_seismicity]
    gap: FloatArray = each * np.minimum(*pair.storeys)
    return gap


def _fema_flags(pair: _Pair, codes: Codes) -> NDArray[np.object_]:
    flags = {
        "separation": pair.gap < _fema_gap(pair, codes),
        "floor_misalignment": np.abs(pair.floors) > 2.0 * FOOT,
        "height_difference": np.abs(np.subtract(*pair.storeys)) >= 2.0,
        "end_of_row": pair.end,
    }
    others = flags["floor_misalignment"] | flags["height_difference"] | flags["end_of_row"]
    flags["pounding"] = flags["separation"] & others
    return joined_names(flags)


def _nzsee_factor(pair: _Pair) -> FloatArray:
    ratio = pair.gap / pair.lower_height
    near, middle = ratio < 0.005, ratio <= 0.01
    aligned = np.select([near, middle], [0.7, 0.8], 1.0)
    misaligned = np.select([near, middle], [0.4, 0.7], 0.8)
    known = ~np.isnan(ratio) & ~np.isnan(pair.floors)
    return np.where(known, np.where(pair.aligned, aligned, misaligned), np.nan)
