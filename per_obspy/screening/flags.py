"""Flags of the rows of the risk table: warnings and assumptions."""

from collections.abc import Iterable, Mapping

import numpy as np
import xarray as xr

from per_obspy.checks import FloatArray
from per_obspy.config import Screening
from per_obspy.inventory.schema import ROW_SUSPICIONS
from per_obspy.inventory.suspicions import ODD
from per_obspy.inventory.table_columns import joined_names
from per_obspy.screening.meanings import FLAGS, RECORD_FLAGS
from per_obspy.screening.values import (
    BoolArray,
    Table,
    TextArray,
    both,
    number,
    oscillators,
    strength_is_assumed,
    values,
)
from per_obspy.spectra.station import lacks_azimuths

#: Below this gap / critical gap several impacts are likely and the single hit is no longer safe: it
#: under-predicts by more than 1 % in up to 43 % of the cases at small gaps, equal masses,
#: broad-band records.
UNRELIABLE_SINGLE_HIT = 0.6


def period_is_derived(pairs: Table) -> BoolArray:
    """Return a mask of pairs with a period derived from height or storeys."""
    derived = np.asarray(pairs["derived"], dtype=object).tolist()
    # Many rows share few different texts: each text is searched once
    has_period = {text: "period_1" in text or "period_2" in text for text in set(derived)}
    return np.fromiter(map(has_period.__getitem__, derived), bool, len(derived))


def outlines_are_learned(pairs: Table) -> BoolArray:
    """Return a mask of pairs with an outline that was learned from images."""
    if "gap_std_source" not in pairs:
        return np.zeros(len(pairs["gap"]), dtype=bool)
    return np.asarray(np.asarray(pairs["gap_std_source"], dtype=object) == "learned")


def heights_are_from_raster(pairs: Table) -> BoolArray:
    """Return a mask of pairs with a height from a raster."""
    mask = np.zeros(len(pairs["gap"]), dtype=bool)
    for name in ("height_source_1", "height_source_2"):
        if name in pairs:
            mask |= np.asarray(pairs[name], dtype=object) == "raster"
    return mask


def damage_is_unknown(pairs: Table) -> BoolArray:
    """Return a mask of pairs that an earlier earthquake may have damaged, nobody knows how."""
    return _left_by_earlier(pairs, "unknown")


def _left_by_earlier(pairs: Table, word: str) -> BoolArray:
    if "after_damage" not in pairs:
        return np.zeros(len(pairs["gap"]), dtype=bool)
    return np.asarray(np.asarray(pairs["after_damage"], dtype=object) == word)


def elastic_ratios(table: Table) -> dict[str, FloatArray]:
    """
    Return the elastic displacement of both buildings over their yield displacement by HAZUS.

    NaN where the pair table gives a yield value, or the system is unknown.
    """
    ratios = {}
    for i, is_assumed in enumerate(strength_is_assumed(table), start=1):
        # NaN where the system is unknown
        ratio = values(table, f"sd_{i}") / values(table, f"hazus_yield_{i}")
        not_given = is_assumed | np.isinf(values(table, f"yield_displacement_{i}"))
        ratios[f"elastic_ratio_{i}"] = np.where(not_given, ratio, np.nan)
    return ratios


def _beyond_elastic(table: Table) -> dict[str, BoolArray]:
    """Return masks of pairs with a building beyond HAZUS' yield, modelled or not, or unknown."""
    # NaN where a yield value is given, or where nothing is known
    ratios = np.stack(both(table, "elastic_ratio"))
    is_linear = np.isinf(np.stack(both(table, "yield_displacement")))
    return {
        "beyond_elastic": np.asarray(((ratios > 1.0) & is_linear).any(axis=0)),
        "assumed_strength": np.asarray(((ratios > 1.0) & ~is_linear).any(axis=0)),
        "unknown_strength": np.asarray((np.isnan(ratios) & is_linear).any(axis=0)),
    }


def joined_flags(raised: Mapping[str, BoolArray]) -> TextArray:
    """Join the names of the flags of each row, in the order of ``FLAGS``, with blanks."""
    return joined_names({name: raised[name] for name in FLAGS if name in raised})


def raised_by_pairs(table: Table) -> dict[str, BoolArray]:
    """Return a mask of rows per flag that needs no record."""
    gap = values(table, "gap")
    # Tables that are computed for a screening have a gap in every row, and a mark
    unknown = table["unknown_gap"] if "unknown_gap" in table else np.isnan(gap)
    # Suspicions of the pair table
    odd = _named_in(table[ODD]) if ODD in table else {}
    is_derived = period_is_derived(table)
    return {
        **odd,
        "unknown_gap": np.asarray(unknown, dtype=bool),
        "doubtful_cell": _are_doubtful(table),
        "touching": gap == 0.0,
        "learned_outlines": outlines_are_learned(table),
        "raster_height": heights_are_from_raster(table),
        "residual_gap": _left_by_earlier(table, "residual"),
        "after_damage_unknown": damage_is_unknown(table),
        **_beyond_elastic(table),
        "single_hit_unreliable": values(table, "demand_ratio") < UNRELIABLE_SINGLE_HIT,
        "derived_inputs": np.asarray(table["derived"] != ""),
        "derived_period": is_derived,
        "equal_by_formula": is_derived & _are_equal(table),
        "no_demand": values(table, "demand") == 0.0,
        "soft_ground": np.asarray(table["soft_ground"], dtype=bool),
        "floor_to_column": np.asarray(table["floors_misaligned"], dtype=bool),
    }


def _are_doubtful(table: Table) -> BoolArray:
    # A table without a doubtful cell has no notes, or none in some of its parts
    notes = table["cell_notes" if "cell_notes" in table else "gap"]
    return np.array(
        [isinstance(note, str) and note != "" for note in np.asarray(notes).tolist()], bool
    )


def _are_equal(table: Table) -> BoolArray:
    period_1, damping_1, period_2, damping_2 = oscillators(table)
    return np.asarray((period_1 == period_2) & (damping_1 == damping_2))


def _named_in(odd: Iterable[str]) -> dict[str, BoolArray]:
    """Return a mask of rows per suspicion of the pair table."""
    # Most rows have none
    texts = np.asarray(odd, dtype=object)
    masks = {name: np.zeros(texts.size, dtype=bool) for name in ROW_SUSPICIONS}
    for text in set(texts.tolist()) - {""}:
        for name in text.split():
            masks[name] |= texts == text
    return masks


def raised_by_record(
    table: Table, station: xr.Dataset, screening: Screening
) -> dict[str, BoolArray]:
    """Return a mask of rows per flag of the record."""
    every = np.ones(len(table["distance"]), dtype=bool)
    # Only tables with motion between stations have this column
    name = "motion_from_other_site_class"
    other_class = np.asarray(table[name], dtype=bool) if name in table else ~every
    noted = record_flags(station)
    of_record = {flag: every & (flag in noted) for flag in RECORD_FLAGS}
    return {
        **of_record,
        "outside_usable_periods": _outside_usable_periods(table, station),
        "per_far_above_sd": _per_far_above_sd(table, screening.per_to_sd),
        "record_from_other_site_class": np.asarray(table["other_site_class"], dtype=bool),
        "far_station": values(table, "distance") > screening.flag_distance,
        "one_horizontal": every & (station.sizes["horizontal"] == 1),
        "unknown_azimuths": every & lacks_azimuths(station),
        "linearized_not_converged": ~np.asarray(table["linearized_converged"], dtype=bool),
        # A measure is missing where none within its range suffices
        "no_damping_suffices": np.isnan(values(table, "supplemental_damping")),
        "no_bumper_suffices": np.isnan(values(table, "bumper_restitution")),
        name: other_class,
        "simulated": every & (station.attrs["simulated"] == "true"),
    }


def record_flags(station: xr.Dataset) -> list[str]:
    """Return the flags that the processing raised for the horizontals of a station's Dataset."""
    noted = str(station["record_flags"].item()).split() if "record_flags" in station else []
    return [flag for flag in RECORD_FLAGS if flag in noted]


def _outside_usable_periods(table: Table, station: xr.Dataset) -> BoolArray:
    periods = np.stack(both(table, "period"))
    shortest, longest = (number(station, f"{end}_usable_period") for end in ("shortest", "longest"))
    return np.asarray(((periods < shortest) | (periods > longest)).any(axis=0))


def _per_far_above_sd(table: Table, limit: float) -> BoolArray:
    per, sd = np.stack(both(table, "per")), np.stack(both(table, "sd"))
    return np.asarray((per > limit * sd).any(axis=0))
