"""
How likely a pair pounds under a design spectrum, given what is not known of its buildings and of the estimate.

The motion is given. Derived periods are resampled, both buildings independently, at the nodes of a
Gauss-Hermite rule; uncertain dampings widen the radii, an uncertain gap and the error of the
estimate widen the comparison.
"""

import numpy as np
import pandas as pd

from per_obspy.checks import FloatArray
from per_obspy.pounding.correlation.white_noise import ddc_correlation
from per_obspy.pounding.dispersion import lognormal_dispersion
from per_obspy.pounding.probability import pounding_probability
from per_obspy.screening.by_spectrum.design_spectrum import DesignSpectrum, displacement_at

#: Median and log-standard deviation of the gap from SD and eq. (16) over the exact one: 91 pairs of
#: periods from 0.3 to 4 s at 5 % damping under 14 broad-band records.
MODEL_MEDIAN, MODEL_DISPERSION = 0.97, 0.14

#: Nodes and weights for a standard normal variable; seven integrate polynomials of degree 13
#: exactly.
NODES, _WEIGHTS = np.polynomial.hermite_e.hermegauss(7)
WEIGHTS = _WEIGHTS / _WEIGHTS.sum()


def design_probability(spectrum: DesignSpectrum, pairs: pd.DataFrame) -> FloatArray:
    """
    Return the probability of pounding of every pair.

    Parameters
    ----------
    spectrum : DesignSpectrum
        The motion. Beyond its ends, which only resampled periods and dampings reach, the value at
        the end is kept.
    pairs : DataFrame
        Completed pairs with their log-standard deviations, medians inside the spectrum.

    Returns
    -------
    probability : (n_pairs,) ndarray
        From 0 to 1.
    """
    gap = pairs["gap"].to_numpy(np.float64)
    spread_1, spread_2 = (_damping_dispersion(spectrum, pairs, i) for i in (1, 2))
    uncertain_gap = _gap_dispersion(gap, pairs["gap_std"].to_numpy(np.float64))
    damping = [pairs[f"damping_{i}"].to_numpy(np.float64) for i in (1, 2)]
    nodes = [[_at_node(spectrum, pairs, i, node) for node in NODES.tolist()] for i in (1, 2)]
    total = np.zeros(len(pairs))
    for (period_1, radius_1), weight_1 in zip(nodes[0], WEIGHTS, strict=True):
        for (period_2, radius_2), weight_2 in zip(nodes[1], WEIGHTS, strict=True):
            correlation = ddc_correlation(period_1, damping[0], period_2, damping[1])
            total += (weight_1 * weight_2) * pounding_probability(
                radius_1 / MODEL_MEDIAN, radius_2 / MODEL_MEDIAN, correlation, gap,
                spread_1, spread_2, 0.0, MODEL_DISPERSION, uncertain_gap,
            )  # fmt: skip
    return np.clip(total, 0.0, 1.0)


def _at_node(
    spectrum: DesignSpectrum, pairs: pd.DataFrame, i: int, node: float
) -> tuple[FloatArray, FloatArray]:
    """Return the period of building i at a node (s), and its radius there at contact height (m)."""
    median, spread, damping, participation = (
        pairs[f"{name}_{i}"].to_numpy(np.float64)
        for name in ("period", "period_log_std", "damping", "participation")
    )
    period = median * np.exp(node * spread)
    return period, participation * _kept_inside(spectrum, period, damping)


def _kept_inside(spectrum: DesignSpectrum, period: FloatArray, damping: FloatArray) -> FloatArray:
    return displacement_at(
        spectrum,
        np.clip(period, spectrum.periods[0], spectrum.periods[-1]),
        np.clip(damping, spectrum.dampings[0], spectrum.dampings[-1]),
    )


def _damping_dispersion(spectrum: DesignSpectrum, pairs: pd.DataFrame, i: int) -> FloatArray:
    """Return the log-standard deviation of the radius that an uncertain damping causes."""
    period, damping, spread = (
        pairs[f"{name}_{i}"].to_numpy(np.float64)
        for name in ("period", "damping", "damping_log_std")
    )
    low, high = (
        _kept_inside(spectrum, period, damping * np.exp(way * spread)) for way in (-1.0, 1.0)
    )
    dispersion: FloatArray = np.abs(np.log(high / low)) / 2.0
    return dispersion


def _gap_dispersion(gap: FloatArray, standard_deviation: FloatArray) -> FloatArray:
    """Return the log-standard deviation of a gap given by mean and standard deviation; 0 for touching pairs."""
    dispersion = np.zeros_like(gap)
    apart = gap > 0
    dispersion[apart] = lognormal_dispersion(gap[apart], standard_deviation[apart])
    return dispersion
