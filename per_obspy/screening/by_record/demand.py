"""
Demand on the gap of pairs: estimates of the critical gap, and the governing one.

All quantities are at contact level: a building's radius times its participation.
"""

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from per_obspy.checks import FloatArray
from per_obspy.pounding.correlation import ddc_correlation
from per_obspy.pounding.critical_gap import absolute_gap, critical_gap, srss_gap


class GapEstimates(NamedTuple):
    """
    Critical gaps of the same pairs by every estimate, m.

    Attributes
    ----------
    correlation : ndarray
        By eq. (16), dimensionless.
    per, record, sd, srss, absolute : ndarray
        PER with eq. (16), PER with the record's correlation, SD with eq. (16), root of the sum of
        squares of the PER, sum of the PER.
    """

    correlation: FloatArray
    per: FloatArray
    record: FloatArray
    sd: FloatArray
    srss: FloatArray
    absolute: FloatArray


class Demand(NamedTuple):
    """
    Governing demand, m, and the name of its rule.

    Attributes
    ----------
    demand : ndarray
        Gap needed, m.
    rule : ndarray of str
        ``per_white_noise`` (eq. 16), ``per_record`` or ``srss``.
    """

    demand: FloatArray
    rule: NDArray[np.object_]


RULES = np.array(["per_white_noise", "per_record", "srss"], dtype=object)


def gap_estimates(
    per: tuple[FloatArray, FloatArray],
    sd: tuple[FloatArray, FloatArray],
    period: tuple[FloatArray, FloatArray],
    damping: tuple[FloatArray, FloatArray],
    correlation_record: FloatArray,
) -> GapEstimates:
    """
    Compute every estimate of the critical gap.

    Parameters
    ----------
    per, sd : pairs of ndarray
        Radii of the two buildings at contact level, m.
    period, damping : pairs of ndarray
        s; fraction of critical.
    correlation_record : ndarray
        Correlation of the two responses to the record, dimensionless.
    """
    correlation = ddc_correlation(period[0], damping[0], period[1], damping[1])
    return GapEstimates(
        correlation=np.broadcast_to(correlation, np.shape(correlation_record)),
        per=critical_gap(*per, correlation),
        record=critical_gap(*per, correlation_record),
        sd=critical_gap(*sd, correlation),
        srss=srss_gap(*per),
        absolute=absolute_gap(*per),
    )


def governing_demand(estimates: GapEstimates, period_derived: NDArray[np.bool_]) -> Demand:
    """
    Return the larger PER demand of eq. (16) and of the record; with derived periods at least SRSS.

    Derived periods make equal buildings seem to move as one, with a correlation of 1 and no demand,
    for which there is no evidence.

    Parameters
    ----------
    estimates : GapEstimates
        Of the same pairs.
    period_derived : ndarray of bool
        Whether a period of the pair was derived from its height or storeys.
    """
    candidates = np.stack(
        [estimates.per, estimates.record, np.where(period_derived, estimates.srss, -np.inf)], axis=0
    )
    best = np.argmax(candidates, axis=0)
    return Demand(np.take_along_axis(candidates, best[None], axis=0)[0], RULES[best])


def demand_ratio(gap: FloatArray, demand: FloatArray) -> FloatArray:
    """Return gap / demand: 0 for touching pairs, NaN (an empty cell) where the demand is 0."""
    ratio: FloatArray = np.divide(
        gap, demand, out=np.full(np.shape(demand), np.nan), where=demand > 0
    )
    return ratio
