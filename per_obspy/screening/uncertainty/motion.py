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
from per_obspy.screening.by_record.exact import can_yield
from per_obspy.screening.by_record.station_motion import (
    StationMotion,
    log_oscillator,
    nearest_azimuth,
    stored_log,
)
from per_obspy.screening.uncertainty.estimated import UncertainMotion, UncertainRadius
from per_obspy.screening.values import (
    BoolArray,
    Both,
    IndexArray,
    Table,
    at_contact,
    both,
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
        and eq. (16) at the site over ``model_median``. Radii are RotD50 where the azimuth of the
        pair is known, because directions of shaking change from place to place, else those along
        the worst azimuth of the record.
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

    Parameters
    ----------
    station : StationMotion
        The record, with its stored spectra.
    table : Table
        Rows of the risk table with ``azimuth``, ``azimuth_used``, radii, and ``distance`` and the
        columns of :func:`~per_obspy.screening.ground_motion.site_motion.motion_at_pairs` where the
        motion at the site is known.
    screening : Screening
        ``model_median``, and the constants of ``interpolation``.
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
        ln_field=ln_field_demand(station, table, screening),
        field_log_std=field_log_std,
        transfer_log_std=transfer_log_std,
        log_std=np.hypot(field_log_std, transfer_log_std),
    )


def median_at_site(
    demand: FloatArray, weight: FloatArray, ln_ratio: FloatArray, ln_field: FloatArray
) -> FloatArray:
    """
    Return the median demand at the site, m, for demands of the record; 0 stays 0.

    Parameters
    ----------
    demand : ndarray
        Exact demand of the record, m.
    weight, ln_ratio, ln_field : ndarray
        Of :class:`SiteDemand`, of a shape that broadcasts.
    """
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

    Parameters
    ----------
    table : Table
        As of :func:`site_demand`.
    log_std : (n_pairs,) ndarray
        At the record. It grows to ``demand_log_std`` far away, where that is larger.
    settings : Interpolation
        Constants of the correlation.
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
    ln_ratio_1, log_std_1 = motion_at_site(table, 1)
    ln_ratio_2, log_std_2 = motion_at_site(table, 2)
    ratios, log_stds = (ln_ratio_1, ln_ratio_2), (log_std_1, log_std_2)
    return pair_motion(at_contact(table, "per"), ratios, log_stds, both(table, "period"))


def motion_at_site(table: Table, i: int) -> Both:
    """Return ln of radius i at the site over that of the record and its deviation; 0 if unknown."""
    if "ln_per_ratio_1" not in table:
        at_record = np.zeros_like(values(table, "gap"))
        return at_record, at_record
    ln_ratio, log_std = values(table, f"ln_per_ratio_{i}"), values(table, f"ln_per_std_{i}")
    return np.nan_to_num(ln_ratio), np.nan_to_num(log_std)


def ln_field_demand(station: StationMotion, table: Table, screening: Screening) -> FloatArray:
    """
    Return ln of the expected demand at the site, m, from the motion between stations.

    Minus infinity of pairs that move as one: equal buildings need no gap.
    """
    # radii of both buildings at the site, with the correlation of eq. (16)
    row = nearest_azimuth(station, table)
    given = np.isfinite(values(table, "azimuth"))
    radius_1 = _radius_at_site(station, table, 1, row, given)
    radius_2 = _radius_at_site(station, table, 2, row, given)
    gap = critical_gap(radius_1, radius_2, pair_correlation(table))
    # the estimate is larger than the exact demand in the median
    with np.errstate(divide="ignore"):
        ln_demand: FloatArray = np.log(gap / screening.model_median)
    return ln_demand


def _radius_at_site(
    station: StationMotion,
    table: Table,
    i: int,
    row: IndexArray,
    given: BoolArray,
) -> FloatArray:
    """Return the radius of building i at contact height at the site, from stored spectra, m."""
    oscillator = log_oscillator(table, i)
    # known azimuths take the median over all, the others the record's worst; few tables have both
    stored = np.empty(row.size)
    for mask, spectra, rows in (
        (given, station.per_rotd50, np.zeros_like(row)),
        (~given, station.per, row),
    ):
        if mask.all():
            stored = stored_log(spectra, rows, *oscillator)
        elif mask.any():
            some = (column[mask] for column in oscillator)
            stored[mask] = stored_log(spectra, rows[mask], *some)
    ln_ratio, _ = motion_at_site(table, i)
    radius: FloatArray = values(table, f"participation_{i}") * np.exp(stored + ln_ratio)
    return radius


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

    Parameters
    ----------
    radii : pair of (n_pairs,) ndarray
        Both radii at contact height, m.
    ln_ratios : pair of (n_pairs,) ndarray
        Logarithm of the radius at the site over this one, dimensionless.
    log_stds : pair of (n_pairs,) ndarray
        Log-standard deviations of the radii at the site, dimensionless.
    periods : pair of (n_pairs,) ndarray
        s.

    Returns
    -------
    ln_ratio, log_std : (n_pairs,) ndarray
        Dimensionless. The ratio is that of the roots of the sums of squares at the site and here:
        both radii alike change the gap alike, a radius of 0 has no weight, and no correlation of
        the two responses, in which the gap of radii that nearly cancel would be infinitely
        sensitive, is needed. The deviation is that of the same gap to first order, with the
        correlation of :func:`period_correlation` between the two.
    """
    (radius_1, radius_2), (ratio_1, ratio_2) = radii, ln_ratios
    square_1, square_2 = np.square(radius_1), np.square(radius_2)
    site_1, site_2 = square_1 * np.exp(2.0 * ratio_1), square_2 * np.exp(2.0 * ratio_2)
    # squared gap of uncorrelated responses, here and at the site
    before, after = square_1 + square_2, site_1 + site_2
    moving = before > 0.0
    growth = np.divide(after, before, out=np.ones_like(after), where=moving)
    ln_ratio = 0.5 * np.log(growth)
    # first-order propagation of both correlated deviations
    weight_1, weight_2 = _share(site_1, after, moving), _share(site_2, after, moving)
    first, second = weight_1 * log_stds[0], weight_2 * log_stds[1]
    variance = first**2 + second**2 + 2.0 * period_correlation(*periods) * first * second
    return ln_ratio, np.sqrt(np.maximum(variance, 0.0))


def _share(part: FloatArray, whole: FloatArray, moving: BoolArray) -> FloatArray:
    """Return part / whole of the squared gap, 0.5 for pairs without motion."""
    return np.divide(part, whole, out=np.full_like(whole, 0.5), where=moving)


def record_motion(station: StationMotion, table: Table, screening: Screening) -> UncertainMotion:
    """
    Return the uncertain motion of every pair of a block.

    Parameters
    ----------
    station : StationMotion
        The record, with its stored spectra.
    table : Table
        Rows of the risk table with periods, dampings, their log-standard deviations, radii,
        correlations and demand; ``distance`` and the motion at the site, where the table has it,
        of :func:`~per_obspy.screening.ground_motion.site_motion.motion_at_pairs`.
    screening : Screening
        Medians and log-standard deviations of the critical gap from PER, and of the linearized one,
        over the exact one.

    Returns
    -------
    UncertainMotion
        Its rows are those of the stored PER of the station. Where the exact demand decides the
        radii are those of PER, without the error of an estimate.
    """
    first, second = (_radius(table, i, screening) for i in (1, 2))
    # by the motion of both buildings, and by the error of an estimate
    _, pair_log_std = pair_at_site(table)
    deviations = screening.linearized_dispersion, screening.model_dispersion
    at_record = np.where(_linearized(table), *deviations)
    model_log_std = estimate_log_std(table, at_record, screening.interpolation)
    return UncertainMotion(
        first,
        second,
        correlation=_governing_correlation(table),
        log_std=np.hypot(pair_log_std, np.where(is_exact(table), 0.0, model_log_std)),
        row=nearest_azimuth(station, table),
    )


def is_exact(table: Table) -> BoolArray:
    """Return a mask of the pairs whose demand is the exact one."""
    return np.asarray(table["demand_rule"] == "exact")


def _radius(table: Table, i: int, screening: Screening) -> UncertainRadius:
    """Return the radius of building i at contact height, with its oscillator and uncertainties."""
    # the median of the estimate over the exact demand is taken off the radius
    estimate = np.where(_linearized(table), screening.linearized_median, screening.model_median)
    bias = np.where(is_exact(table), 1.0, estimate)
    ln_ratio, _ = motion_at_site(table, i)
    return UncertainRadius(
        radius=values(table, f"participation_{i}") * _deciding(table, f"per_{i}") / bias,
        ln_ratio=ln_ratio,
        period=_deciding(table, f"period_{i}"),
        damping=_deciding(table, f"damping_{i}"),
    )


def _linearized(table: Table) -> BoolArray:
    """Return a mask of the pairs whose demand is that of equivalent linear buildings."""
    return np.asarray(table["demand_rule"] == "linearized")


def _deciding(table: Table, name: str) -> FloatArray:
    """Return a column, with the values of the equivalent buildings where these decide."""
    return np.where(_linearized(table), values(table, f"equivalent_{name}"), values(table, name))


def _governing_correlation(table: Table) -> FloatArray:
    """Return the correlation that governs the demand."""
    by_record = np.asarray(table["demand_rule"] == "per_record")
    elastic = np.where(by_record, table["correlation_record"], table["correlation"])
    linearized = values(table, "correlation_linearized")
    return np.where(_linearized(table), linearized, elastic)
