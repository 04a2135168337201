"""
Pairs under a ShakeMap: motion at their places, and rows of pairs without a station in reach.

A map gives pseudo-spectral acceleration at 5 % damping and few periods. The radius is its spectral
displacement, with no factor for PER: PER is never below SD, but how far above it depends on the
record, which a map does not have, and the gap from SD and eq. (16) is nearer to the exact one than
that from PER (`per_obspy.pounding.reliability`).
Other dampings are reached by the factor of EN 1998-1. Flags of every row report these assumptions.
"""

from collections.abc import Mapping, Sequence
from typing import NamedTuple

import numpy as np
import pandas as pd
import xarray as xr
from scipy.interpolate import RegularGridInterpolator

from per_obspy import checks
from per_obspy.checks import FloatArray
from per_obspy.config import Screening
from per_obspy.errors import Rejection
from per_obspy.inventory.suspicions import ODD
from per_obspy.screening.columns import ORDER, RESULTS
from per_obspy.screening.flags import joined_flags, raised_by_pairs
from per_obspy.screening.motion_field import on_grid
from per_obspy.screening.spectral_demand import (
    Limits,
    SpectralMotion,
    pair_rejections,
    reasons_outside,
    spectral_rows,
)
from per_obspy.screening.station_motion import LogSpectra
from per_obspy.screening.values import BoolArray, Table, both, values

#: Dampings between which the factor of EN 1998-1 is interpolated when dampings are resampled;
#: beyond it is kept.
DAMPINGS = np.geomspace(0.002, 0.4, 24)


class MapMotion(NamedTuple):
    """A ShakeMap at places: SD at 5 % damping."""

    periods: FloatArray  # s, rising
    ln_sd: FloatArray  # of SD in m, (n_places, n_periods); minus infinity without motion
    log_std: FloatArray  # log-standard deviation of it


def seen_from(shakemap: xr.Dataset, longitude: FloatArray) -> FloatArray:
    """Return longitudes continuous with those of a map that crosses the date line, degrees."""
    middle = shakemap["longitude"].values[[0, -1]].sum() / 2.0
    seen: FloatArray = (longitude - middle + 180.0) % 360.0 - 180.0 + middle
    return seen


def motion_on_map(
    shakemap: xr.Dataset, longitude: FloatArray, latitude: FloatArray, assumed_log_std: float
) -> MapMotion:
    """
    Interpolate a ShakeMap bilinearly at places inside it, degrees.

    A map without deviations has the assumed log-standard deviation everywhere.
    """
    axes = shakemap["latitude"].values, shakemap["longitude"].values
    places = [latitude, seen_from(shakemap, longitude)]
    # places a little outside count as on the edge
    inside = [np.clip(place, axis[0], axis[-1]) for place, axis in zip(places, axes, strict=True)]

    def at_places(name: str) -> FloatArray:
        fields = np.moveaxis(shakemap[name].values, 0, -1)
        return np.asarray(RegularGridInterpolator(axes, fields)(np.stack(inside, axis=-1)))

    periods = shakemap["period"].values
    # SD = PSA (T / 2 pi)^2; no motion is minus infinity
    with np.errstate(divide="ignore"):
        ln_sd = np.log(at_places("psa") * (periods / (2.0 * np.pi)) ** 2)
    if "psa_log_std" in shakemap:
        return MapMotion(periods, ln_sd, at_places("psa_log_std"))
    return MapMotion(periods, ln_sd, np.full(ln_sd.shape, assumed_log_std))


def at_period(periods: FloatArray, ordinates: FloatArray, period: FloatArray) -> FloatArray:
    """
    Interpolate ordinates (n_places, n_periods) at one period per place, constant beyond the ends.

    They are linear in the logarithm of the period, s.
    """
    lower, share = on_grid(periods, period)
    place = np.arange(period.size)
    low, high = ordinates[place, lower], ordinates[place, lower + 1]
    result: FloatArray = (1.0 - share) * low + share * high
    return result


def damping_factor(damping: FloatArray) -> FloatArray:
    """
    Return SD at a damping over that at 5 %.

    Parameters
    ----------
    damping : ndarray
        Fraction of critical.

    References
    ----------
    EN 1998-1:2004, 3.2.2.2 (3), equation (3.6): ``sqrt(10 / (5 + ξ)) >= 0.55``, ξ in per cent.

    Examples
    --------
    >>> print(damping_factor(np.array([0.05, 0.02, 0.5])).round(3))
    [1.    1.195 0.55 ]
    """
    factor: FloatArray = np.maximum(
        np.sqrt(10.0 / (5.0 + 100.0 * checks.fraction_of_critical("damping", damping))), 0.55
    )
    return factor


def map_motion(motion: MapMotion, pairs: Table) -> SpectralMotion:
    """
    Return the motion of completed pairs with medians inside the map's periods.

    Every pair has a separate spectrum; beyond its periods, which only resampled ones reach, SD at
    the end is kept.
    """
    periods = both(pairs, "period")
    sd_1, sd_2 = (
        np.exp(at_period(motion.periods, motion.ln_sd, period)) * damping_factor(damping)
        for period, damping in zip(periods, both(pairs, "damping"), strict=True)
    )
    # deviations at both periods, and spectra at all dampings
    std_1, std_2 = (at_period(motion.periods, motion.log_std, period) for period in periods)
    factors = np.log(damping_factor(DAMPINGS))[None, :, None]
    ln_sd = np.ascontiguousarray(motion.ln_sd[:, None, :] + factors)
    spectra = LogSpectra(np.log(motion.periods), np.log(DAMPINGS), ln_sd)
    return SpectralMotion((sd_1, sd_2), (std_1, std_2), spectra, np.arange(periods[0].size))


#: Longest way outside a map's edge that counts as on it: its coordinates have so many digits,
#: degrees.
EDGE = 1e-6


def shakemap_rows(
    shakemap: xr.Dataset,
    pairs: pd.DataFrame,
    screening: Screening,
    unreached: Sequence[Rejection] = (),
) -> tuple[pd.DataFrame, tuple[Rejection, ...]]:
    """
    Compute the rows of pairs that no station serves, and the rejections of those outside the map.

    Rows of completed pairs are not ranked, and have the columns of
    :func:`~per_obspy.screening.risk.risk_rows`; those that need a record (``per_1``, ``impacts``,
    ``station``, ...) are empty, ``demand_rule`` is ``shakemap``. Pairs outside the map, without
    motion there, or with a period outside the map's are rejected with the value, after the reasons
    why no station serves them (``unreached``).
    """
    reasons = _reasons_outside(shakemap, pairs)
    longitude, latitude = values(pairs, "longitude"), values(pairs, "latitude")
    motion = motion_on_map(shakemap, longitude, latitude, screening.shakemap_log_std)
    # nodes of a map outside its data have no motion
    for row in np.flatnonzero(~np.isfinite(motion.ln_sd).all(axis=1)):
        reasons[row] = reasons[row] or ["the ShakeMap has no motion there"]
    inside = np.array([not why for why in reasons], dtype=bool)
    moving = MapMotion(motion.periods, motion.ln_sd[inside], motion.log_std[inside])
    rows = _rows(shakemap, moving, pairs[inside].reset_index(drop=True), screening)
    # the reasons of the stations before those of the map
    earlier = {rejection.name: rejection.reasons for rejection in unreached}
    for name, why in zip(pairs["pair_id"], reasons, strict=True):
        why[:0] = earlier.get(name, ()) if why else ()
    return rows, pair_rejections(pairs, reasons, str(shakemap.attrs["source"]))


def _reasons_outside(shakemap: xr.Dataset, pairs: pd.DataFrame) -> list[list[str]]:
    """Return every coordinate and period outside the map, pair by pair."""
    longitude = seen_from(shakemap, values(pairs, "longitude"))
    east, north, periods = (
        shakemap[axis].values[[0, -1]] for axis in ("longitude", "latitude", "period")
    )
    # digits of the map's edge count
    limits: Limits = {
        "longitude": (longitude, *east, "", EDGE),
        "latitude": (values(pairs, "latitude"), *north, "", EDGE),
        "period_1": (values(pairs, "period_1"), *periods, " s", 0.0),
        "period_2": (values(pairs, "period_2"), *periods, " s", 0.0),
    }
    return reasons_outside(limits, "ShakeMap")


def _rows(
    shakemap: xr.Dataset, motion: MapMotion, pairs: pd.DataFrame, screening: Screening
) -> pd.DataFrame:
    """Return the rows of pairs that have a motion on the map."""
    every = np.ones(len(pairs), dtype=bool)
    scenario = shakemap.attrs.get("shakemap_event_type", "").upper() == "SCENARIO"
    raised = {
        "shakemap_demand": every,
        "shakemap_assumed_deviation": every & ("psa_log_std" not in shakemap),
        "simulated": every & scenario,
    }
    return mapped_rows(motion, pairs, screening, "shakemap", raised)


def mapped_rows(
    motion: MapMotion,
    pairs: pd.DataFrame,
    screening: Screening,
    rule: str,
    raised: Mapping[str, BoolArray],
) -> pd.DataFrame:
    """
    Return the rows of completed pairs by SD at their places, not ranked.

    They have the columns of :func:`~per_obspy.screening.risk.risk_rows`; ``rule`` becomes
    ``demand_rule``, ``raised`` are the flags of the motion.
    """
    table = spectral_rows(pairs, map_motion(motion, pairs), screening)
    table = table.assign(demand_rule=rule)
    # flags of the motion beside those of the pairs
    table = table.assign(flags=joined_flags(raised_by_pairs(table) | dict(raised)))
    # columns of a risk table that need a record are empty, and without those of SD alone
    lacking = [name for name in ORDER if name not in table and name != "rank"]
    empty = {name: "" if RESULTS[name].dtype == "str" else np.nan for name in lacking}
    # Joined at once: pandas warns of many columns added one by one
    table = pd.concat([table, pd.DataFrame(empty, table.index)], axis=1).copy()
    own = ["squares_decide", "srss_gap_sd", "absolute_gap_sd", ODD]
    return table.drop(columns=own, errors="ignore")
