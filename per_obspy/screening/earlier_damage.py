"""
Pairs after an earlier earthquake: the gap that it left, and pairs of which nobody knows.

Where the exact history of a pair let buildings yield, it ends with the displacement at which each
of them comes to rest, and the pair starts the next earthquake from the gap between them. A pair
that may have hit, or whose buildings may have gone beyond their elastic range, without such a
history keeps its gap, is marked, and is never a ``no``. A building yields again from where it
rests: its elastic range is that of an undamaged one.
"""

import numpy as np
import pandas as pd

from per_obspy.checks import FloatArray
from per_obspy.inventory.schema import AFTER_DAMAGE
from per_obspy.inventory.strength import CodeLevel, least_yield_displacement
from per_obspy.inventory.table_columns import numbers_in
from per_obspy.screening.ranking import STATES
from per_obspy.screening.values import BoolArray

_OF_BUILDING = (
    *("longitude", "latitude", "storeys", "period", "sd", "ductility", "participation", "residual"),
    *("yield_displacement", "hazus_yield", "yield_log_std", "ln_per_std"),
)

#: Columns of the risk table of the earlier earthquake that are needed, and those it may have.
NEEDED = (
    *("pair_id", "state", "azimuth", "gap", "gap_std", "derived", "residual_gap"),
    *(f"{name}_{i}" for name in _OF_BUILDING for i in (1, 2)),
)
MAY_HAVE = ("gap_before", "after_damage")

#: Difference of gaps beyond which one was measured anew, m: far below a tape, far above rounding.
SAME_GAP = 1e-6

#: Distance beyond which a pair of the same name is another one, degrees: about 100 m.
SAME_PLACE = 1e-3

#: Largest gap and deviation of a pair table, m.
WIDEST, LARGEST_STD = 10.0, 3.0

RESIDUAL, UNKNOWN = AFTER_DAMAGE


def pairs_after(pairs: pd.DataFrame, earlier: pd.DataFrame, code_level: CodeLevel) -> pd.DataFrame:
    """
    Return pairs as an earlier earthquake has left them.

    Parameters
    ----------
    pairs : DataFrame
        From :func:`per_obspy.read_pairs`.
    earlier : DataFrame
        Rows of the risk table of the earlier earthquake, with the columns ``NEEDED`` and perhaps
        ``MAY_HAVE``.
    code_level : str
        For the yield displacement of buildings whose system is unknown: the least of any system.

    Returns
    -------
    DataFrame
        With ``gap`` and ``gap_std`` of residual gaps; ``gap_before``, m, the gap in their place in
        the pair table; ``after_damage``: ``residual``, ``unknown`` or empty.

    Notes
    -----
    * The deviation of a residual displacement is itself or, if larger, that of FEMA P-58 at the
      ductility that 16 of 100 exceed: 0 up to yield, 0.3 times the displacement beyond yield up to
      a ductility of 4, and the displacement less 3 yield displacements from there on. Buildings
      that lean on each other touch: their gap of 0 is as certain as the gap was.
    * A gap that differs from that of the earlier earthquake was measured since, and stays, unless
      the table says that it is assumed or learned from images.
    * Pairs that the earlier earthquake did not screen are ``unknown``.
    """
    rows = _matched(pairs, earlier)
    is_same = rows["state"].notna().to_numpy()
    # The gap in the pair table then, and now
    before, gap = _surveyed_gap(rows), numbers_in(pairs, "gap")
    residual = numbers_in(rows, "residual_gap")
    followed = is_same & _has_residual(rows) & np.isfinite(before)
    # Elastic pairs are as they were
    std, spread = numbers_in(pairs, "gap_std"), _residual_gap_std(rows)
    known = spread <= numbers_in(rows, "gap_std") + SAME_GAP
    moved = ~known | (np.abs(residual - before) > SAME_GAP)
    starts = followed & moved & ~_measured(pairs, gap, before)
    unknown = ~is_same | _may_be_damaged(rows, followed, code_level)
    return pairs.assign(
        gap=np.where(starts, np.minimum(residual, WIDEST), gap),
        gap_std=np.where(starts, spread, std),
        gap_before=np.where(starts, before, np.nan),
        after_damage=np.where(unknown, UNKNOWN, np.where(starts, RESIDUAL, "")),
    )


def _matched(pairs: pd.DataFrame, earlier: pd.DataFrame) -> pd.DataFrame:
    """Return the earlier row of each pair, empty where there is none or it stands elsewhere."""
    rows = earlier.set_index("pair_id").reindex(pairs["pair_id"]).reset_index()
    rows = rows.reindex(columns=[*NEEDED, *MAY_HAVE])
    return rows[_same_places(pairs, rows)].reindex(rows.index)


def _residual_gap_std(rows: pd.DataFrame) -> FloatArray:
    """Return the deviation of residual gaps, m: that of the gap, and of both residuals."""
    added = np.hypot(_residual_std(rows, 1), _residual_std(rows, 2))
    # What leans on each other touches, whatever the residuals
    is_open = numbers_in(rows, "residual_gap") > 0.0
    spread = np.hypot(numbers_in(rows, "gap_std"), np.where(is_open, added, 0.0))
    return np.asarray(np.minimum(spread, LARGEST_STD))


def _has_residual(rows: pd.DataFrame) -> BoolArray:
    """Return which rows have a residual gap along their axis, not along the worst of all."""
    return np.isfinite(numbers_in(rows, "residual_gap")) & np.isfinite(numbers_in(rows, "azimuth"))


def _surveyed_gap(rows: pd.DataFrame) -> FloatArray:
    """Return the gap in the pair table of the earlier run, m; NaN where it had none."""
    assumed = rows["derived"].fillna("").str.split().map(lambda names: "gap" in names)
    given = np.where(assumed, np.nan, numbers_in(rows, "gap"))
    # That before a still earlier one
    before = numbers_in(rows, "gap_before")
    return np.where(np.isnan(before), given, before)


def _same_places(pairs: pd.DataFrame, rows: pd.DataFrame) -> BoolArray:
    """Return whether both buildings of each pair stand where the earlier table has them."""
    apart = [
        np.abs(numbers_in(pairs, name) - numbers_in(rows, name))
        for name in ("longitude_1", "latitude_1", "longitude_2", "latitude_2")
    ]
    return np.asarray((np.stack(apart) <= SAME_PLACE).all(axis=0))


def _measured(pairs: pd.DataFrame, gap: FloatArray, before: FloatArray) -> BoolArray:
    """Return whether the gap of a pair was measured after the earlier earthquake."""
    differs = np.isfinite(gap) & ~(np.abs(gap - before) <= SAME_GAP)
    source = pairs.get("gap_std_source", pd.Series("", index=pairs.index))
    return np.asarray(differs & ~source.isin(("assumed", "learned")).to_numpy(bool))


def _may_be_damaged(rows: pd.DataFrame, followed: BoolArray, code_level: CodeLevel) -> BoolArray:
    """Return the pairs that may be damaged in a way that no bilinear history followed."""
    # Not known before either, or contact was possible
    was_unknown = (rows["after_damage"] == UNKNOWN).to_numpy(bool)
    unknown = was_unknown | (~followed & (rows["state"] != STATES[-1]).to_numpy(bool))
    for i in (1, 2):
        period, storeys = numbers_in(rows, f"period_{i}"), numbers_in(rows, f"storeys_{i}")
        yields = numbers_in(rows, f"yield_displacement_{i}")
        is_linear = ~np.isfinite(yields)
        limit = np.where(is_linear, numbers_in(rows, f"hazus_yield_{i}"), yields)
        least = least_yield_displacement(period, storeys, code_level)
        limit = np.where(np.isnan(limit), least, limit)
        # An unknown displacement is within no limit
        beyond = ~(numbers_in(rows, f"sd_{i}") <= limit)
        unknown |= beyond & (is_linear | ~followed)
    return unknown


def _residual_std(rows: pd.DataFrame, i: int) -> FloatArray:
    """Return the deviation of the residual displacement of building i at contact height, m."""
    yields = numbers_in(rows, f"yield_displacement_{i}") * numbers_in(rows, f"participation_{i}")
    spread = np.hypot(
        numbers_in(rows, f"yield_log_std_{i}"), np.nan_to_num(numbers_in(rows, f"ln_per_std_{i}"))
    )
    ductility = numbers_in(rows, f"ductility_{i}") * np.exp(spread)
    # A linear building leaves none
    beyond = np.maximum(np.maximum(0.3 * (np.minimum(ductility, 4.0) - 1.0), 0.0), ductility - 3.0)
    assumed = np.where(np.isfinite(yields), yields, 0.0) * beyond
    deviation: FloatArray = np.fmax(np.abs(numbers_in(rows, f"residual_{i}")), assumed)
    return deviation
