"""What a reader of a row must know: its flags."""

from collections.abc import Mapping

import numpy as np
import xarray as xr
from numpy.typing import NDArray

from per_obspy.config import Screening
from per_obspy.inventory.table_columns import joined_names
from per_obspy.screening.columns import FLAGS
from per_obspy.screening.values import Table, both, number, values

#: Below this gap / critical gap several impacts are likely and the single hit is no longer safe: it
#: under-predicts by more than 1 % in up to 43 % of the cases at small gaps, equal masses,
#: broad-band records.
UNRELIABLE_SINGLE_HIT = 0.6


def period_is_derived(pairs: Table) -> NDArray[np.bool_]:
    """Return which pairs have a period that was derived from height or storeys."""
    derived = np.asarray(pairs["derived"], dtype=object).tolist()
    told = {
        names: "period_1" in names or "period_2" in names for names in set(derived)
    }  # few, of many rows
    return np.fromiter(map(told.__getitem__, derived), bool, len(derived))


def joined_flags(raised: Mapping[str, NDArray[np.bool_]]) -> NDArray[np.object_]:
    """Return the names of the flags that rows raise, in the order of ``FLAGS``, separated by a blank."""
    return joined_names({name: raised[name] for name in FLAGS if name in raised})


def raised_by_pairs(table: Table) -> dict[str, NDArray[np.bool_]]:
    """Return for every flag that needs no record the rows that raise it."""
    return {
        "touching": values(table, "gap") == 0.0,
        "single_hit_unreliable": values(table, "demand_ratio") < UNRELIABLE_SINGLE_HIT,
        "derived_inputs": np.asarray(table["derived"] != ""),
        "derived_period": period_is_derived(table),
        "no_demand": values(table, "demand") == 0.0,
        "floor_to_column": np.asarray(table["floors_misaligned"], dtype=bool),
    }


def raised_by_record(
    table: Table, station: xr.Dataset, screening: Screening
) -> dict[str, NDArray[np.bool_]]:
    """Return for every flag of the record the rows that raise it."""
    periods, per, sd = (np.stack(both(table, name)) for name in ("period", "per", "sd"))
    shortest, longest = (
        number(station, "shortest_usable_period"),
        number(station, "longest_usable_period"),
    )
    every = np.ones(periods.shape[1], dtype=bool)
    crossed = "motion_from_other_site_class"
    return {
        "outside_usable_periods": ((periods < shortest) | (periods > longest)).any(axis=0),
        "per_far_above_sd": (per > screening.per_to_sd * sd).any(axis=0),
        "record_from_other_site_class": np.asarray(table["other_site_class"], dtype=bool),
        "far_station": values(table, "distance") > screening.flag_distance,
        "one_horizontal": every & (station.sizes["horizontal"] == 1),
        "linearized_not_converged": ~np.asarray(table["linearized_converged"], dtype=bool),
        "no_damping_suffices": np.isnan(values(table, "supplemental_damping")),
        "no_bumper_suffices": np.isnan(values(table, "bumper_restitution")),
        crossed: np.asarray(table[crossed], dtype=bool) if crossed in table else ~every,
        "simulated": every & (station.attrs["simulated"] == "true"),
    }
