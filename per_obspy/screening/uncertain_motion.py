"""
Uncertain motion at pairs: at one site, at their sites, and of a record.

A record makes an exact demand of a pair; it differs from the demand that its PER lets expect by the
part that is particular to that record: phases, correlation of both responses, direction of shaking.
Part of this belongs to the pair and is found at every place, the rest fades with the distance from
the record. So the demand at the site lies between that of the record, scaled with the motion, and
the estimate from the motion between the stations. Constants are those of leave-one-out on real
records (docs/calibration.md).

Where the table holds the motion at the site relative to the record (``ln_per_ratio_i``,
``ln_per_std_i``), the radii are those at the site and as uncertain as their motion; an exact demand
is carried to the site as above.
"""

from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike

from per_obspy import checks
from per_obspy.checks import FloatArray
from per_obspy.config import Interpolation, Screening
from per_obspy.pounding.critical_gap import critical_gap
from per_obspy.pounding.reliability import per_error
from per_obspy.screening.exact import can_yield
from per_obspy.screening.population import UncertainMotion, UncertainRadius
from per_obspy.screening.station_motion import (
    StationMotion,
    log_oscillator,
    nearest_azimuth,
    record_number,
    stored_log,
)
from per_obspy.screening.values import (
    BoolArray,
    Both,
    IndexArray,
    Table,
    at_contact,
    both,
    oscillators,
    pair_correlation,
    values,
)


class SiteDemand(NamedTuple):
    """
    Exact demand of pairs at their sites, with its uncertainty; each (n_pairs,).

    At the distance h of site and record the correlation of the particular part of their demands is
    ``c(h) = p + (1 - p) exp(-h / L)``. The logarithm of the demand is normal, with the median

        ``weight * (ln(demand of the record) + ln_ratio) + (1 - weight) * ln_field``

    (:func:`median_at_site`) and the log-standard deviation ``log_std``. At the record (h = 0), and
    where the motion at the site is unknown, the demand is that of the record, without deviation.

    Attributes
    ----------
    weight : ndarray
        Of the demand of the record: c(h), 1 at the record and p far away; 1 everywhere of buildings
        that can yield, because ``ln_field`` is the demand of linear ones.
    ln_ratio : ndarray
        Shift of the demand of the record: ln of the root of the sum of squares of both radii at the
        site over that at the record, from the median motion between the stations.
    ln_field : ndarray
        ln of the demand in m that the motion between the stations lets expect: critical gap by PER
        and eq. (16) at the site over its error (`per_error`). Radii are RotD50 where the azimuth of
        the pair is known, because directions of shaking change from place to place, else those
        along the worst azimuth of the record.
    field_log_std : ndarray
        Part of the deviation: of the pair's ln PER at the site, with Student's factor.
    transfer_log_std : ndarray
        Part of the deviation: of the transfer from one place to another, with the weight w
        ``demand_log_std * sqrt(1 - 2 w c + w^2)``, which saturates with the distance.
    log_std : ndarray
        Root of the sum of squares of both parts.
    """

    weight: FloatArray
    ln_ratio: FloatArray
    ln_field: FloatArray
    field_log_std: FloatArray
    transfer_log_std: FloatArray
    log_std: FloatArray


def site_demand(station: StationMotion, table: Table, screening: Screening) -> SiteDemand:
    """
    Return the relation of the exact demand at the sites to that of the records.

    Rows have ``azimuth``, ``azimuth_used``, radii, and ``distance`` and the columns of
    :func:`~per_obspy.screening.site_motion.motion_at_pairs` where the motion at the
    site is known.
    """
    settings = screening.interpolation
    correlation = demand_correlation(table, settings)
    weight = np.where(can_yield(table), 1.0, correlation)
    # error of the weighted demand: 1 - 2 w c + w^2, which is 1 - c^2 where w is c
    unexplained = 1.0 - 2.0 * weight * correlation + weight**2
    transfer_log_std = settings.demand_log_std * np.sqrt(np.maximum(unexplained, 0.0))
    ln_ratio, field_log_std = pair_at_site(table)
    return SiteDemand(
        weight=weight,
        ln_ratio=ln_ratio,
        ln_field=ln_field_demand(station, table),
        field_log_std=field_log_std,
        transfer_log_std=transfer_log_std,
        log_std=np.hypot(field_log_std, transfer_log_std),
    )


def median_at_site(
    demand: FloatArray, weight: FloatArray, ln_ratio: FloatArray, ln_field: FloatArray
) -> FloatArray:
    """Return the median demand at the site, m, see :class:`SiteDemand`; 0 stays 0."""
    moves = demand > 0
    record = np.log(np.where(moves, demand, 1.0)) + ln_ratio
    # at the record the field has no effect, even for equal buildings, whose gap is 0
    field = np.where(np.isfinite(ln_field), ln_field, record)
    median: FloatArray = np.where(moves, np.exp(weight * record + (1.0 - weight) * field), 0.0)
    return median


def demand_correlation(table: Table, settings: Interpolation) -> FloatArray:
    """Return the correlation c(h) of the residual demands at record and site."""
    if "ln_per_ratio_1" not in table:
        return np.ones_like(values(table, "gap"))
    persistence, length = settings.demand_persistence, settings.demand_length
    # from 1 at the record to the part that persists; without other knowledge the record counts
    correlation = persistence + (1.0 - persistence) * np.exp(-values(table, "distance") / length)
    known = np.isfinite(np.stack(both(table, "ln_per_ratio"))).all(axis=0)
    return np.where(known, correlation, 1.0)


def estimate_log_std(table: Table, log_std: FloatArray, settings: Interpolation) -> FloatArray:
    """
    Return the deviation of an estimate over the exact demand at the site.

    It grows from ``log_std`` at the record to ``demand_log_std`` far away, where that is larger.
    """
    correlation = demand_correlation(table, settings)
    persistence = settings.demand_persistence
    # 0 at the record, 1 far away
    faded = (1.0 - correlation) / max(1.0 - persistence, np.finfo(np.float64).tiny)
    growth = np.maximum(settings.demand_log_std**2 - log_std**2, 0.0)
    deviation: FloatArray = np.sqrt(log_std**2 + faded * growth)
    return deviation


def pair_at_site(table: Table) -> Both:
    """Return ln of the gap by PER at the site over that at the record, and its deviation."""
    return pair_motion(at_contact(table, "per"), *motion_at_site(table), both(table, "period"))


def motion_at_site(table: Table) -> tuple[Both, Both]:
    """Return ln of both radii at the site over the record's, and deviations; 0 if unknown."""
    if "ln_per_ratio_1" not in table:
        at_record = np.zeros_like(values(table, "gap"))
        return (at_record, at_record), (at_record, at_record)
    # unknown ones are NaN
    (ratio_1, ratio_2), (std_1, std_2) = both(table, "ln_per_ratio"), both(table, "ln_per_std")
    ratios = np.nan_to_num(ratio_1), np.nan_to_num(ratio_2)
    return ratios, (np.nan_to_num(std_1), np.nan_to_num(std_2))


def ln_field_demand(station: StationMotion, table: Table) -> FloatArray:
    """
    Return ln of the expected demand at the site, m, from the motion between stations.

    Minus infinity of pairs that move as one: equal buildings need no gap.
    """
    row, ratios = nearest_azimuth(station, table), motion_at_site(table)[0]
    share_1, share_2 = both(table, "participation")
    radius_1 = share_1 * np.exp(_stored_radius(station, table, 1, row) + ratios[0])
    radius_2 = share_2 * np.exp(_stored_radius(station, table, 2, row) + ratios[1])
    # the estimate is larger than the exact demand in the median
    gap = critical_gap(radius_1, radius_2, pair_correlation(table))
    with np.errstate(divide="ignore"):
        ln_demand: FloatArray = np.log(gap / per_error(*oscillators(table)).median)
    return ln_demand


def likely_oscillators(table: Table) -> tuple[FloatArray, ...]:
    """
    Return period, s, and damping of both buildings, their periods as far apart as is likely.

    Between uncertain periods the root mean square of ln(T2 / T1) of the population is taken: equal
    medians do not make equal periods, and alike neighbours miss a formula alike.
    """
    period_1, damping_1, period_2, damping_2 = oscillators(table)
    std_1, std_2 = both(table, "period_log_std")
    shared = 2.0 * values(table, "period_correlation") * std_1 * std_2
    # not below 0 by round-off
    variance = np.maximum(std_1**2 + std_2**2 - shared, 0.0)
    apart = np.sqrt(np.log(period_2 / period_1) ** 2 + variance)
    return period_1, damping_1, period_1 * np.exp(apart), damping_2


def _stored_radius(station: StationMotion, table: Table, i: int, row: IndexArray) -> FloatArray:
    """
    Return ln of the stored radius of building i, m.

    Known azimuths take the median over all, the others the record's worst; few tables have both.
    """
    oscillator, given = log_oscillator(table, i), np.isfinite(values(table, "azimuth"))
    stored = np.empty(row.size)
    # whole tables first, which need no choice
    for mask, spectra, rows in (
        (given, station.per_rotd50, record_number(station, table)),
        (~given, station.per, row),
    ):
        if mask.all():
            return stored_log(spectra, rows, *oscillator)
        if mask.any():
            some = (column[mask] for column in oscillator)
            stored[mask] = stored_log(spectra, rows[mask], *some)
    return stored


#: Below this period (s) the published correlation has another form.
SHORT = 0.109


def period_correlation(period_1: ArrayLike, period_2: ArrayLike) -> FloatArray:
    """
    Return the correlation of the residuals of ln SA at two periods of one record; used for PER.

    Parameters
    ----------
    period_1, period_2 : array_like
        s; published for 0.01 to 10 s.

    Returns
    -------
    correlation : ndarray
        Broadcast shape, dimensionless, 1 for equal periods.

    Raises
    ------
    ValueError
        If a period is not positive.

    References
    ----------
    Baker & Jayaram (2008), Earthquake Spectra 24, 299-317, equations (2) to (6).

    Examples
    --------
    >>> print(period_correlation(1.0, [1.0, 2.0]).round(3))
    [1.    0.749]
    """
    first, second = np.broadcast_arrays(
        checks.positive("period_1", period_1), checks.positive("period_2", period_2)
    )
    low, high = np.minimum(first, second), np.maximum(first, second)
    # equations (2) to (5)
    c1 = 1.0 - np.cos(np.pi / 2.0 - 0.366 * np.log(high / np.maximum(low, SHORT)))
    c2 = _c2(low, high)
    c3 = np.where(high < SHORT, c2, c1)
    c4 = c1 + 0.5 * (np.sqrt(np.maximum(c3, 0.0)) - c3) * (1.0 + np.cos(np.pi * low / SHORT))
    # equation (6): the branch of both periods
    mixed = np.where(high < 0.2, np.minimum(c2, c4), c4)
    correlation: FloatArray = np.where(high <= SHORT, c2, np.where(low > SHORT, c1, mixed))
    return correlation


def _c2(low: FloatArray, high: FloatArray) -> FloatArray:
    """Return C2, equation (3), for short periods."""
    # the exponent of long periods, whose c2 does not count, would overflow
    fading = 1.0 / (1.0 + np.exp(100.0 * np.minimum(high, 1.0) - 5.0))
    longer = high > low
    distance = np.where(longer, (high - low) / np.where(longer, high - 0.0099, 1.0), 0.0)
    coefficient: FloatArray = 1.0 - 0.105 * (1.0 - fading) * distance
    return coefficient


def pair_motion(
    radii: Both,
    ln_ratios: Both,
    log_stds: Both,
    periods: Both,
) -> Both:
    """
    Return ln of the needed gap at the site over that at the record, and its deviation.

    ``radii`` of both buildings are at contact height, m; ``ln_ratios`` and ``log_stds`` are those
    of the radii at the site over these. The ratio is that of the roots of the sums of squares at
    the site and here: both radii alike change the gap alike, a radius of 0 has no weight, and no
    correlation of the two responses, in which the gap of radii that nearly cancel would be
    infinitely sensitive, is needed. The deviation is that of the same gap to first order, with the
    correlation of :func:`period_correlation` between the two.
    """
    here = np.square(np.stack(radii))
    site = here * np.exp(2.0 * np.stack(ln_ratios))
    # squared gap of uncorrelated responses, here and at the site; pairs without motion have none
    before, after = here[0] + here[1], site[0] + site[1]
    moving = before > 0.0
    ln_ratio = 0.5 * np.log(np.divide(after, before, out=np.ones_like(after), where=moving))
    # first-order propagation of both correlated deviations
    share = np.divide(site, after, out=np.full_like(site, 0.5), where=moving)
    first, second = share * np.stack(log_stds)
    variance = first**2 + second**2 + 2.0 * period_correlation(*periods) * first * second
    return ln_ratio, np.sqrt(np.maximum(variance, 0.0))


def record_motion(station: StationMotion, table: Table, screening: Screening) -> UncertainMotion:
    """
    Return the uncertain motion of every pair of a block of the risk table.

    Its rows are those of the stored PER of the station. Where the exact demand decides the radii
    are those of PER, without the error of an estimate; elsewhere the estimate's median and
    deviation over the exact one are those of `per_error`, and of yielding buildings the settings'.
    """
    exact, linearized = is_exact(table), np.asarray(table["demand_rule"] == "linearized")
    # the median of the estimate over the exact demand is taken off the radius
    elastic = per_error(*likely_oscillators(table))
    bias = np.where(linearized, screening.linearized_median, elastic.median)
    bias = np.where(exact, 1.0, bias)
    ratios, _ = motion_at_site(table)
    first, second = (
        UncertainRadius(
            values(table, f"participation_{i}") * _deciding(table, f"per_{i}", linearized) / bias,
            ratios[i - 1],
            _deciding(table, f"period_{i}", linearized),
            _deciding(table, f"damping_{i}", linearized),
        )
        for i in (1, 2)
    )
    # by the motion of both buildings, and by the error of an estimate
    _, pair_log_std = pair_at_site(table)
    at_record = np.where(linearized, screening.linearized_dispersion, elastic.log_std)
    model_log_std = estimate_log_std(table, at_record, screening.interpolation)
    return UncertainMotion(
        first,
        second,
        correlation=_governing_correlation(table),
        log_std=np.hypot(pair_log_std, np.where(exact, 0.0, model_log_std)),
        row=nearest_azimuth(station, table),
    )


def is_exact(table: Table) -> BoolArray:
    """Return a mask of the pairs whose demand is the exact one."""
    return np.asarray(table["demand_rule"] == "exact")


def _governing_correlation(table: Table) -> FloatArray:
    rule = np.asarray(table["demand_rule"])
    of_record, linearized = rule == "per_record", rule == "linearized"
    elastic = np.where(of_record, table["correlation_record"], table["correlation"])
    return np.where(linearized, values(table, "correlation_linearized"), elastic)


def _deciding(table: Table, name: str, linearized: BoolArray) -> FloatArray:
    """Return a column, with the values of the equivalent buildings where these decide."""
    return np.where(linearized, values(table, f"equivalent_{name}"), values(table, name))
