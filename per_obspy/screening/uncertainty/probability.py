"""
Probability of pounding of pairs, from the uncertainty of motion, buildings, gap and estimate.

The motion is given by what it does to the pairs (:class:`UncertainMotion`), whether it comes from a
record or from a ShakeMap. A period that was derived from a height is resampled, and so is its
damping: both buildings independently, at quasi-random nodes, with radii from spectra scaled to the
median radius. So two buildings of equal height are never certain to move as one. Where both periods
are given the exact integral is used. An uncertain gap and the error of the estimate widen the
comparison. Pairs whose exact demand decides are sampled in ``exact_demand.py``.

A design spectrum is certain: only periods are resampled, at the nodes of a Gauss-Hermite rule.
"""

from collections.abc import Callable
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray
from scipy.special import ndtri
from scipy.stats import qmc

from per_obspy.checks import FloatArray
from per_obspy.kernels.pairs.resampling import resampled_probabilities
from per_obspy.pounding.correlation.white_noise import ddc_correlation
from per_obspy.pounding.dispersion import (
    combined_dispersion,
    combined_dispersion_correlation,
    lognormal_dispersion,
)
from per_obspy.pounding.probability import demand_probability, pounding_probability
from per_obspy.screening.by_record.stored_spectra import LogSpectra, log_period_and_damping
from per_obspy.screening.uncertainty.pair_motion import period_correlation
from per_obspy.screening.values import Table, both, chosen, values

#: Median and log-standard deviation of the gap from SD and eq. (16) over the exact one: 91 pairs of
#: periods from 0.3 to 4 s at 5 % damping under 14 broad-band records.
SD_MEDIAN, SD_DISPERSION = 0.97, 0.14

#: Standard normal nodes for period and damping of both buildings: the second 128 Sobol points,
#: which lie in the middle of their strata. On a grid, or at the first 128, equal buildings would be
#: exactly equal, and in step, at some nodes.
NODES: FloatArray = ndtri(qmc.Sobol(4, scramble=False).fast_forward(128).random(128))

#: Nodes and weights for a standard normal variable; seven integrate polynomials of degree 13
#: exactly.
HERMITE_NODES, _WEIGHTS = np.polynomial.hermite_e.hermegauss(7)
HERMITE_WEIGHTS = _WEIGHTS / _WEIGHTS.sum()

#: Of building 1 and building 2.
Both = tuple[FloatArray, FloatArray]

#: Spectral displacement (m) at periods (s) and dampings (fractions of critical).
Displacement = Callable[[FloatArray, FloatArray], FloatArray]


class UncertainRadius(NamedTuple):
    """
    Radius of one building of every pair under an uncertain motion, each (n_pairs,).

    Attributes
    ----------
    radius : ndarray
        Median at contact height, of which the critical gap is right in the median, m.
    ln_ratio : ndarray
        Logarithm of the radius at the site over ``radius``.
    motion_log_std : ndarray
        Log-standard deviation of the radius by the motion.
    damping_log_std : ndarray
        Log-standard deviation of the radius by an uncertain damping; 0 where it is resampled.
    period, damping : ndarray
        Medians of the oscillator that has this radius, s and fraction of critical.
    """

    radius: FloatArray
    ln_ratio: FloatArray
    motion_log_std: FloatArray
    damping_log_std: FloatArray
    period: FloatArray
    damping: FloatArray


class UncertainMotion(NamedTuple):
    """
    Response of pairs to an uncertain motion, each (n_pairs,).

    Attributes
    ----------
    first, second : UncertainRadius
        Buildings 1 and buildings 2.
    correlation : ndarray
        Of both responses, dimensionless.
    pair_log_std : ndarray
        Log-standard deviation of the critical gap by the motion of both buildings; of an exact
        demand with that of its transfer from the record to the site.
    model_log_std : ndarray
        Log-standard deviation of the estimate over the exact demand.
    exact_demand : ndarray
        Exact demand at the site, m; NaN where the estimate decides.
    row : ndarray of int
        Of the spectra by which the radii of resampled oscillators change.
    """

    first: UncertainRadius
    second: UncertainRadius
    correlation: FloatArray
    pair_log_std: FloatArray
    model_log_std: FloatArray
    exact_demand: FloatArray
    row: NDArray[np.intp]


def pair_probability(motion: UncertainMotion, spectra: LogSpectra, pairs: Table) -> FloatArray:
    """
    Compute the probability of pounding of every pair under an uncertain motion.

    Parameters
    ----------
    motion : UncertainMotion
        Of the pairs.
    spectra : LogSpectra
        By which the radii of resampled oscillators change; at the edge beyond the grid.
    pairs : Table
        Completed pairs with their log-standard deviations.

    Returns
    -------
    probability : (n_pairs,) ndarray
        From 0 to 1. Where the exact demand decides it is that of the demand; only motion and gap
        are uncertain then, and :mod:`.exact_demand` has the pairs of uncertain buildings.
    """
    exact = ~np.isnan(motion.exact_demand)
    resampled = ~exact & period_is_uncertain(pairs)
    integrated = ~exact & ~resampled
    probability = np.empty(exact.size)
    # every pair by one of three ways
    if exact.any():
        probability[exact] = _of_demand(_rows(motion, exact), chosen(pairs, exact))
    if integrated.any():
        probability[integrated] = _of_radii(_rows(motion, integrated), chosen(pairs, integrated))
    if resampled.any():
        motion_rows, pair_rows = _rows(motion, resampled), chosen(pairs, resampled)
        probability[resampled] = _over_nodes(motion_rows, spectra, pair_rows)
    return probability


def design_probability(displacement: Displacement, pairs: Table) -> FloatArray:
    """
    Compute the probability of pounding of every pair under a spectrum that is certain.

    Parameters
    ----------
    displacement : callable
        Spectral displacement of the spectrum, m, of periods (s) and dampings (fractions of
        critical); beyond the ends of the spectrum, which only resampled periods and dampings reach,
        the value at the end.
    pairs : Table
        Completed pairs with their log-standard deviations, medians inside the spectrum.

    Returns
    -------
    probability : (n_pairs,) ndarray
        From 0 to 1.
    """
    gap, gap_log_std = values(pairs, "gap"), gap_dispersion(pairs)
    damping_1, damping_2 = both(pairs, "damping")
    spread_1 = _design_damping_dispersion(displacement, pairs, 1)
    spread_2 = _design_damping_dispersion(displacement, pairs, 2)
    nodes_1 = _design_nodes(displacement, pairs, 1)
    nodes_2 = _design_nodes(displacement, pairs, 2)
    total = np.zeros(len(gap))
    # product rule: both periods vary independently, with weights that sum to 1
    for (period_1, radius_1), weight_1 in zip(nodes_1, HERMITE_WEIGHTS, strict=True):
        for (period_2, radius_2), weight_2 in zip(nodes_2, HERMITE_WEIGHTS, strict=True):
            correlation = ddc_correlation(period_1, damping_1, period_2, damping_2)
            # dampings of different buildings are independent: no correlation of the radii
            total += (weight_1 * weight_2) * pounding_probability(
                radius_1 / SD_MEDIAN,
                radius_2 / SD_MEDIAN,
                correlation,
                gap,
                spread_1,
                spread_2,
                dispersion_correlation=0.0,
                model_dispersion=SD_DISPERSION,
                gap_dispersion=gap_log_std,
            )
    return np.clip(total, 0.0, 1.0)


def period_is_uncertain(pairs: Table) -> NDArray[np.bool_]:
    """Return which pairs have a building whose period has a log-standard deviation."""
    return np.asarray(np.maximum(*both(pairs, "period_log_std")) > 0)


def building_is_uncertain(pairs: Table) -> NDArray[np.bool_]:
    """Return which pairs have a building whose period or damping has a log-standard deviation."""
    damping_is_uncertain = np.maximum(*both(pairs, "damping_log_std")) > 0
    return np.asarray(period_is_uncertain(pairs) | damping_is_uncertain)


def gap_dispersion(pairs: Table) -> FloatArray:
    """Return the log-standard deviation of a lognormal gap; 0 of pairs that touch."""
    gap, deviation = values(pairs, "gap"), values(pairs, "gap_std")
    separated = gap > 0
    dispersion = np.zeros_like(gap)
    dispersion[separated] = lognormal_dispersion(gap[separated], deviation[separated])
    return dispersion


def median_gap(pairs: Table) -> FloatArray:
    """Return the median of a lognormal gap of given mean, m."""
    median: FloatArray = values(pairs, "gap") * np.exp(-(gap_dispersion(pairs) ** 2) / 2.0)
    return median


def _rows(motion: UncertainMotion, mask: NDArray[np.bool_]) -> UncertainMotion:
    """Return the motion of the pairs of a mask."""
    first = UncertainRadius(*(column[mask] for column in motion.first))
    second = UncertainRadius(*(column[mask] for column in motion.second))
    return UncertainMotion(
        first,
        second,
        correlation=motion.correlation[mask],
        pair_log_std=motion.pair_log_std[mask],
        model_log_std=motion.model_log_std[mask],
        exact_demand=motion.exact_demand[mask],
        row=motion.row[mask],
    )


def _of_demand(motion: UncertainMotion, pairs: Table) -> FloatArray:
    """Return the probability that an uncertain exact demand exceeds an uncertain gap."""
    dispersion = np.hypot(gap_dispersion(pairs), motion.pair_log_std)
    return demand_probability(motion.exact_demand, median_gap(pairs), dispersion)


def _of_radii(motion: UncertainMotion, pairs: Table) -> FloatArray:
    """Return the exact integral over both radii."""
    first, second = motion.first, motion.second
    # sources of the dispersion of a radius: the motion and the building's own damping
    source_1 = np.stack([first.motion_log_std, first.damping_log_std], axis=-1)
    source_2 = np.stack([second.motion_log_std, second.damping_log_std], axis=-1)
    # one motion moves both radii, each has a damping of its own
    shared_motion = period_correlation(*both(pairs, "period"))
    shared = np.stack([shared_motion, np.zeros_like(shared_motion)], axis=-1)
    return pounding_probability(
        first.radius * np.exp(first.ln_ratio),
        second.radius * np.exp(second.ln_ratio),
        motion.correlation,
        median_gap(pairs),
        combined_dispersion(source_1),
        combined_dispersion(source_2),
        dispersion_correlation=combined_dispersion_correlation(source_1, source_2, shared),
        model_dispersion=motion.model_log_std,
        gap_dispersion=gap_dispersion(pairs),
    )


def _over_nodes(motion: UncertainMotion, spectra: LogSpectra, pairs: Table) -> FloatArray:
    """Return the mean over quasi-random periods and dampings of both buildings."""
    comparison = np.hypot(motion.model_log_std, gap_dispersion(pairs))
    # one row per pair, in the order of the kernel
    columns = [
        motion.row.astype(np.float64),
        *_resampled_oscillator(motion.first, pairs, 1),
        *_resampled_oscillator(motion.second, pairs, 2),
        median_gap(pairs),
        np.hypot(comparison, motion.pair_log_std),
    ]
    rows = np.stack(columns, axis=1)
    probability = np.empty(len(rows))
    resampled_probabilities(tuple(spectra), rows, NODES, probability)
    return probability


def _resampled_oscillator(building: UncertainRadius, pairs: Table, i: int) -> list[FloatArray]:
    """Return ln period and ln damping of building i, their deviations, and its ln radius."""
    radius = np.maximum(building.radius, np.finfo(np.float64).tiny)
    return [
        *log_period_and_damping(building.period, building.damping),
        values(pairs, f"period_log_std_{i}"),
        values(pairs, f"damping_log_std_{i}"),
        np.log(radius) + building.ln_ratio,
    ]


def _design_nodes(
    displacement: Displacement, pairs: Table, i: int
) -> list[tuple[FloatArray, FloatArray]]:
    """Return periods (s) and radii at contact height (m) of building i, node by node."""
    median, deviation = values(pairs, f"period_{i}"), values(pairs, f"period_log_std_{i}")
    damping, share = values(pairs, f"damping_{i}"), values(pairs, f"participation_{i}")
    # a node counts in standard deviations of ln period
    periods = [median * np.exp(node * deviation) for node in HERMITE_NODES.tolist()]
    return [(period, share * displacement(period, damping)) for period in periods]


def _design_damping_dispersion(displacement: Displacement, pairs: Table, i: int) -> FloatArray:
    """Return the log-standard deviation of the radius of building i by an uncertain damping."""
    period, damping = values(pairs, f"period_{i}"), values(pairs, f"damping_{i}")
    deviation = values(pairs, f"damping_log_std_{i}")
    # half the difference between one deviation below and above
    low = displacement(period, damping * np.exp(-deviation))
    high = displacement(period, damping * np.exp(deviation))
    dispersion: FloatArray = np.abs(np.log(high / low)) / 2.0
    return dispersion
