"""
Demand and population of pairs by the spectral displacement of both buildings, without a record.

These are rungs 2 and 3 of the ladder of demands. There is no PER in a spectrum: the radius is the
spectral displacement, because the gap from it and eq. (16) is the one that is known to be closest
to the exact one.
"""

from collections.abc import Mapping, Sequence
from typing import NamedTuple

import numpy as np
import pandas as pd

from per_obspy.checks import FloatArray
from per_obspy.config import Screening
from per_obspy.errors import Rejection
from per_obspy.pounding.critical_gap import absolute_gap, critical_gap, srss_gap
from per_obspy.pounding.reliability import sd_error
from per_obspy.screening.codes import code_columns
from per_obspy.screening.estimates import single_hit_columns
from per_obspy.screening.flags import period_is_derived
from per_obspy.screening.population import (
    UncertainMotion,
    UncertainRadius,
    estimated_population,
)
from per_obspy.screening.ranking import state_columns
from per_obspy.screening.station_motion import LogSpectra
from per_obspy.screening.uncertain_motion import likely_oscillators, pair_motion
from per_obspy.screening.values import (
    Both,
    Columns,
    IndexArray,
    both,
    pair_correlation,
    stay_linear,
    values,
)


class SpectralMotion(NamedTuple):
    """Motion of pairs by a design spectrum or a ShakeMap, (n_pairs,)."""

    sd: Both  # of both oscillators, m
    log_std: Both  # log-standard deviation of each
    spectra: LogSpectra  # of SD, by which the radii of resampled oscillators change
    row: IndexArray  # of the spectra


def spectral_rows(
    pairs: pd.DataFrame, motion: SpectralMotion, screening: Screening
) -> pd.DataFrame:
    """
    Return completed pairs with demand, population, state, class and code rules, not ranked yet.

    Radii are at contact height, m. A pair with derived periods has at least the root of the sum of
    squares as its demand; ``squares_decide`` is true where that is larger.
    """
    # a spectrum says nothing of buildings that yield
    pairs = pairs.assign(**stay_linear(pairs))
    radii, periods = spectral_radii(pairs, motion), both(pairs, "period")
    # eq. (15) with the correlation of eq. (16), and without correlation
    correlation = pair_correlation(pairs)
    by_correlation, by_squares = critical_gap(*radii, correlation), srss_gap(*radii)
    squares_decide = period_is_derived(pairs) & (by_squares > by_correlation)
    estimates: Columns = {
        "sd_1": motion.sd[0],
        "sd_2": motion.sd[1],
        "correlation": correlation,
        "critical_gap_sd": by_correlation,
        "srss_gap_sd": by_squares,
        "absolute_gap_sd": absolute_gap(*radii),
        "demand": np.where(squares_decide, by_squares, by_correlation),
        "squares_decide": squares_decide,
    }
    table = pairs.assign(**estimates)
    # population, single hit, and what follows from them
    uncertain = spectral_uncertainty(table, motion)
    table = table.assign(
        **estimated_population(uncertain, motion.spectra, pairs),
        **single_hit_columns(table, radii, periods),
        missing_gap=np.maximum(estimates["demand"] - values(pairs, "gap"), 0.0),
    )
    table = table.assign(**state_columns(table, screening))
    return table.join(code_columns(pairs, *radii, screening.codes))


def spectral_radii(pairs: pd.DataFrame, motion: SpectralMotion) -> Both:
    """Return the displacements of both buildings at contact height, m."""
    share_1, share_2 = both(pairs, "participation")
    return share_1 * motion.sd[0], share_2 * motion.sd[1]


def spectral_uncertainty(table: pd.DataFrame, motion: SpectralMotion) -> UncertainMotion:
    """
    Return the uncertain motion of pairs with their ``correlation``.

    It is uncertain once for both buildings, with the correlation of the residuals at both periods,
    and the estimate differs from the exact demand by its error (`sd_error`).
    """
    radii, periods = spectral_radii(table, motion), both(table, "period")
    nothing = np.zeros_like(periods[0])
    _, log_std = pair_motion(radii, (nothing, nothing), motion.log_std, periods)
    # medians of which the critical gap is right
    error = sd_error(*likely_oscillators(table))
    first, second = (
        UncertainRadius(radius / error.median, nothing, period, damping)
        for radius, period, damping in zip(radii, periods, both(table, "damping"), strict=True)
    )
    deviation = np.hypot(log_std, error.log_std)
    return UncertainMotion(first, second, values(table, "correlation"), deviation, motion.row)


#: Column of pairs -> its values, first and last value of the motion, unit, and the distance from
#: an end that counts as on it.
Limits = Mapping[str, tuple[FloatArray, float, float, str, float]]


def reasons_outside(limits: Limits, motion: str) -> list[list[str]]:
    """Return one sentence per value outside the range of a motion, pair by pair."""
    reasons: list[list[str]] = [[] for _ in next(iter(limits.values()))[0]]
    for name, (column, first, last, unit, edge) in limits.items():
        # both ends belong to the range
        for row in np.flatnonzero(~((column >= first - edge) & (column <= last + edge))):
            value, span = f"{name} = {column[row]:g}{unit}", f"{first:g} to {last:g}{unit}"
            reasons[row].append(f"{value} is outside the {motion}'s {span}")
    return reasons


def pair_rejections(
    pairs: pd.DataFrame, reasons: Sequence[Sequence[str]], source: str
) -> tuple[Rejection, ...]:
    """Return a rejection of every pair that has a reason."""
    named = zip(pairs["pair_id"], reasons, strict=True)
    return tuple(Rejection("pair", name, source, None, tuple(why)) for name, why in named if why)
