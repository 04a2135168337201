"""What a reader of a row must know: its flags."""

from collections.abc import Mapping

import numpy as np
import pandas as pd
import xarray as xr
from numpy.typing import NDArray

from per_obspy.config import Screening
from per_obspy.screening.columns import FLAGS

#: Below this gap / critical gap several impacts are likely and the single hit is no longer safe: it under-predicts
#: by more than 1 % in up to 43 % of the cases at small gaps, equal masses, broad-band records.
UNRELIABLE_SINGLE_HIT = 0.6


def period_is_derived(pairs: pd.DataFrame) -> NDArray[np.bool_]:
    """Return which pairs have a period that was derived from height or storeys."""
    return pairs["derived"].str.contains(r"\bperiod_[12]\b", regex=True).to_numpy(dtype=bool)


def joined_flags(raised: Mapping[str, NDArray[np.bool_]], count: int) -> NDArray[np.object_]:
    """Return the names of the flags that rows raise, in the order of ``FLAGS``, separated by a space."""
    text = np.full(count, "", dtype=object)
    for name in FLAGS:
        if name in raised:
            text = text + np.where(raised[name], f"{name} ", "").astype(object)
    return np.array([flags.strip() for flags in text], dtype=object)


def raised_by_pairs(table: pd.DataFrame) -> dict[str, NDArray[np.bool_]]:
    """Return for every flag that needs no record the rows that raise it."""
    return {
        "touching": table["gap"].to_numpy() == 0.0,
        "single_hit_unreliable": table["demand_ratio"].to_numpy(np.float64) < UNRELIABLE_SINGLE_HIT,
        "derived_inputs": (table["derived"] != "").to_numpy(),
        "derived_period": period_is_derived(table),
        "no_demand": table["demand"].to_numpy() == 0.0,
        "floor_to_column": table["floors_misaligned"].to_numpy(dtype=bool),
    }


def raised_by_record(table: pd.DataFrame, station: xr.Dataset, screening: Screening) -> dict[str, NDArray[np.bool_]]:
    """Return for every flag of the record the rows that raise it."""
    periods = table[["period_1", "period_2"]].to_numpy(np.float64)
    shortest, longest = float(station["shortest_usable_period"]), float(station["longest_usable_period"])
    per, sd = table[["per_1", "per_2"]].to_numpy(np.float64), table[["sd_1", "sd_2"]].to_numpy(np.float64)
    every = np.ones(len(table), dtype=bool)
    crossed = "motion_from_other_site_class"
    return {
        "outside_usable_periods": ((periods < shortest) | (periods > longest)).any(axis=1),
        "per_far_above_sd": (per > screening.per_to_sd * sd).any(axis=1),
        "record_from_other_site_class": table["other_site_class"].to_numpy(dtype=bool),
        "far_station": table["distance"].to_numpy() > screening.flag_distance,
        "one_horizontal": every & (station.sizes["horizontal"] == 1),
        "linearized_not_converged": ~table["linearized_converged"].to_numpy(dtype=bool),
        "no_damping_suffices": table["supplemental_damping"].isna().to_numpy(),
        "no_bumper_suffices": table["bumper_restitution"].isna().to_numpy(),
        crossed: table[crossed].to_numpy(dtype=bool) if crossed in table else ~every,
        "simulated": every & (station.attrs["simulated"] == "true"),
    }
