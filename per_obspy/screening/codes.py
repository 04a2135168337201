"""
Gaps required by building codes and screening procedures, for comparison with the estimate.

``code_rules.csv`` lists clause, edition, inputs and source of every rule, and whether its form was
verified against a page that quotes it; the names of the others end in ``_unverified``. No rule
here was compared with the printed text of the code. A code means its inelastic design
displacement; a column that uses the displacement of an event's elastic spectrum instead has
``event_based`` in its name. A cell is empty where the rule lacks an input.
"""

from importlib.resources import files
from typing import Any

import numpy as np
import pandas as pd
from numpy.typing import ArrayLike, NDArray

from per_obspy import checks
from per_obspy.checks import FloatArray
from per_obspy.config import Codes
from per_obspy.inventory.schema import Column
from per_obspy.inventory.table_columns import numbers_in
from per_obspy.screening import code_formulas as formulas
from per_obspy.screening.code_formulas import RuleInputs
from per_obspy.screening.values import both, values

#: Heights closer than this count as equal, m.
SAME_HEIGHT = 0.01


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
        name. ``same_property``, ``position`` and ``importance_1``, ``importance_2`` are used
        where the table has them.
    displacement_1, displacement_2 : (n_pairs,) array_like
        Elastic displacement of each building at contact height in the event, m.
    codes : Codes
        Zone, intensity, seismicity and design ground motion of the region, as far as known.

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
    columns = _displacement_gaps(pair, codes) | _mexican_gaps(pair, pairs, codes)
    columns |= _height_gaps(pair, codes)
    return pd.DataFrame(columns, index=pairs.index)[code_rules()["column"].tolist()]


def _displacement_gaps(pair: RuleInputs, codes: Codes) -> dict[str, FloatArray]:
    """Return the gaps of rules that rest on both displacements."""
    # Without a ground acceleration the largest share of the height, that of 0.5 g
    ground = 0.5 if codes.italy_ground is None else codes.italy_ground
    return {
        "required_gap_asce7_event_based": formulas.by_property(pair),
        "required_gap_asce7_22_event_based_unverified": formulas.by_property(pair),
        "required_gap_tbdy2018_event_based": formulas.tbdy2018(pair),
        "required_gap_ec8_event_based_unverified": formulas.ec8(pair),
        "required_gap_ntc2018_italy_event_based": formulas.ntc2018_italy(pair, ground),
        "required_gap_is1893_event_based_unverified": formulas.total(pair),
        "required_gap_is1893_amended_event_based": formulas.is1893_amended(pair),
        "required_gap_e030_event_based": formulas.e030(pair),
        "required_gap_iran2800_event_based": formulas.iran2800(pair),
        "required_gap_rpa99_event_based_unverified": formulas.rpa99(pair),
        "required_gap_rpa2024_event_based": formulas.rpa2024(pair),
        "required_gap_nzs1170_event_based_unverified": formulas.total(pair),
        "required_gap_nch433_event_based_unverified": formulas.nch433(pair),
    }


def _mexican_gaps(pair: RuleInputs, pairs: pd.DataFrame, codes: Codes) -> dict[str, FloatArray]:
    """Return the gaps of Mexico City's NTC, by zone."""
    share = _by_zone(pairs, codes, formulas.NTC_SHARE)
    simplified = _by_zone(pairs, codes, formulas.NTC_SIMPLIFIED)
    return {
        "required_gap_ntc2004_event_based": formulas.ntc2004(pair, share),
        "required_gap_ntc2004_simplified": formulas.ntc2004_simplified(pair, simplified),
        "required_gap_ntc2023_event_based_unverified": formulas.ntc_mexico(pair, share),
    }


def _height_gaps(pair: RuleInputs, codes: Codes) -> dict[str, NDArray[Any]]:
    """Return gaps, factor and flags of rules that rest on heights and storeys alone."""
    step = np.nan if codes.gb_intensity is None else formulas.GB_STEP[codes.gb_intensity]
    seismicity = codes.fema_seismicity
    per_storey = np.nan if seismicity is None else formulas.FEMA_GAP[seismicity]
    return {
        "required_gap_gb50011_2010": formulas.gb50011(pair, step),
        "required_gap_gem": formulas.gem(pair),
        "required_gap_fema_p154_unverified": formulas.fema_gap(pair, per_storey),
        "fema_p154_flags_unverified": formulas.fema_flags(pair, per_storey),
        "nzsee_iep_factor_unverified": formulas.nzsee_factor(pair),
    }


def _rule_inputs(
    pairs: pd.DataFrame, displacement_1: ArrayLike, displacement_2: ArrayLike, codes: Codes
) -> RuleInputs:
    """Return the quantities that the rules use, from a completed pair table."""
    displacement = (
        checks.not_negative("displacement_1", displacement_1),
        checks.not_negative("displacement_2", displacement_2),
    )
    # NaN, an unknown offset, is not aligned
    floor_offset = values(pairs, "floor_offset")
    aligned = np.abs(floor_offset) <= codes.floor_tolerance
    height_1, height_2 = both(pairs, "height")
    return RuleInputs(
        displacement=displacement,
        storeys=both(pairs, "storeys"),
        importance=(numbers_in(pairs, "importance_1"), numbers_in(pairs, "importance_2")),
        gap=values(pairs, "gap"),
        lower_height=np.minimum(height_1, height_2),
        contact_height=values(pairs, "contact_height"),
        floor_offset=floor_offset,
        system_factor=_system_factor(pairs),
        aligned=aligned,
        alike=aligned & _same_structure(pairs),
        one_property=_is(pairs, "same_property", "yes"),
        end_of_row=_is(pairs, "position", "end"),
    )


def _is(pairs: pd.DataFrame, name: str, text: str) -> NDArray[np.bool_]:
    """Return a mask of pairs with a given text in a column; all false without the column."""
    if name not in pairs:
        return np.zeros(len(pairs), dtype=bool)
    return (pairs[name] == text).to_numpy(bool)


def _system_factor(pairs: pd.DataFrame) -> FloatArray:
    """Return the larger factor of GB 50011 of both systems, NaN if a system has none."""
    factors = (
        np.asarray(pairs[f"system_{i}"].map(formulas.GB_FACTOR), dtype=np.float64) for i in (1, 2)
    )
    return np.maximum(*factors)


def _same_structure(pairs: pd.DataFrame) -> NDArray[np.bool_]:
    """Return a mask of pairs whose buildings have equal given heights and systems."""
    height_1, height_2 = both(pairs, "height")
    derived = pairs["derived"].str.contains(r"\bsystem_[12]\b", regex=True).to_numpy(bool)
    same_system = pairs["system_1"].to_numpy(object) == pairs["system_2"].to_numpy(object)
    same: NDArray[np.bool_] = ~derived & same_system & (np.abs(height_1 - height_2) < SAME_HEIGHT)
    return same


def _by_zone(pairs: pd.DataFrame, codes: Codes, shares: dict[str, float]) -> FloatArray:
    """Return the fraction of the height for the pair's zone of Mexico City, NaN if unknown."""
    zone = pd.Series(codes.ntc_zone, index=pairs.index, dtype=object)
    # A valid zone of the pair itself goes before that of the region
    if "ntc_zone" in pairs:
        zone = pairs["ntc_zone"].where(pairs["ntc_zone"].isin(list(shares)), zone)
    return np.asarray(zone.map(shares), dtype=np.float64)
