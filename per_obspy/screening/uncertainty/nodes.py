"""
Quasi-random nodes of the uncertain values of a pair: buildings, motion, estimate and gap.

Periods and dampings are lognormal, independent in both buildings. One node serves all pairs
alike, so that a row does not depend on the other pairs.
"""

import numpy as np
from numpy.typing import NDArray
from scipy.special import ndtr, ndtri
from scipy.stats import qmc

from per_obspy.checks import FloatArray
from per_obspy.pounding.probability import lognormal_dispersion
from per_obspy.screening.values import Table, both, values

#: Standard normal nodes of ln period and ln damping of building 1, of building 2, of ln demand for
#: given buildings, and of ln gap: the second 128 Sobol points, which lie in the middle of their
#: strata. On a grid, or at the first 128, equal buildings would be exactly equal, and in step, at
#: some nodes.
NODES: FloatArray = ndtri(qmc.Sobol(6, scramble=False).fast_forward(128).random(128))

#: Columns of ``NODES``: both buildings, demand, gap.
BUILDINGS, DEMAND, GAP = slice(0, 4), 4, 5

#: Shares of measured gaps below the quantiles that a lognormal gap has of them, for outlines that
#: touch and from ``WIDE`` standard deviations on; in between they are interpolated.
TOUCHING, APART, WIDE = (0.01, 0.9), (0.16, 0.84), 3.0

#: Chance that buildings whose drawn outlines touch have one wall.
ONE_WALL = 0.5

#: Largest damping of a node, fraction of critical: an oscillator has less than the critical one.
LARGEST_DAMPING = 0.99


def period_at_nodes(median: FloatArray, table: Table, i: int, nodes: FloatArray) -> FloatArray:
    """
    Return the period of building i at the nodes, s.

    Parameters
    ----------
    median : (n_pairs,) ndarray
        s.
    table : Table
        Pairs with ``period_log_std_i``.
    i : int
        Building 1 or 2.
    nodes : (n_nodes, 6) ndarray
        As ``NODES``.

    Returns
    -------
    period : (n_pairs, n_nodes) ndarray
        s.
    """
    deviation = values(table, f"period_log_std_{i}")
    period: FloatArray = median[:, None] * np.exp(np.outer(deviation, nodes[:, 2 * i - 2]))
    return period


def damping_at_nodes(median: FloatArray, table: Table, i: int, nodes: FloatArray) -> FloatArray:
    """Return the damping of building i at the nodes, as :func:`period_at_nodes`; below critical."""
    deviation = values(table, f"damping_log_std_{i}")
    damping = median[:, None] * np.exp(np.outer(deviation, nodes[:, 2 * i - 1]))
    largest = np.maximum(median, LARGEST_DAMPING)[:, None]
    return np.asarray(np.minimum(damping, largest))


def building_is_uncertain(pairs: Table) -> NDArray[np.bool_]:
    """Return a mask of pairs in which a period or damping has a log-standard deviation."""
    period = np.maximum(*both(pairs, "period_log_std"))
    damping = np.maximum(*both(pairs, "damping_log_std"))
    return np.asarray((period > 0) | (damping > 0))


def gap_dispersion(pairs: Table) -> FloatArray:
    """
    Return the log-standard deviation of a lognormal gap; 0 where the gap is certain.

    A gap is a distance measured with a normal error, and not below 0: either the walls are one, or
    the gap has a normal distribution about ``gap`` with ``gap_std``, truncated at 0. Both are
    equally likely where outlines touch, as the error alone would give a stiff pair, whose demand is
    a hundredth of it, a ``no``. For outlines apart, Bayes' rule gives the chance that the walls are
    one. The lognormal gap has two quantiles of this distribution (``TOUCHING``, ``APART``).

    A gap that the configuration assumes (``assumed_gap``) is lognormal itself, with mean ``gap``.
    """
    return _lognormal_gap(pairs)[1]


def median_gap(pairs: Table) -> FloatArray:
    """Return the median of a lognormal gap, m, as :func:`gap_dispersion`."""
    return _lognormal_gap(pairs)[0]


def one_wall_chance(pairs: Table) -> FloatArray:
    """Return the probability that buildings with touching outlines share a wall; else 0."""
    touching = (values(pairs, "gap") == 0.0) & (values(pairs, "gap_std") > 0.0)
    return np.where(touching, ONE_WALL, 0.0)


def _lognormal_gap(pairs: Table) -> tuple[FloatArray, FloatArray]:
    """Return median, m, and log-standard deviation of lognormal gaps."""
    gap, deviation = values(pairs, "gap"), values(pairs, "gap_std")
    assumed = values(pairs, "assumed_gap") > 0 if "assumed_gap" in pairs else gap < 0
    measured, lognormal = (deviation > 0) & ~assumed, (gap > 0) & assumed
    # Certain gaps stay
    median, dispersion = gap.copy(), np.zeros(gap.shape)
    dispersion[lognormal] = lognormal_dispersion(gap[lognormal], deviation[lognormal])
    median[lognormal] *= np.exp(-(dispersion[lognormal] ** 2) / 2.0)
    fitted = _with_quantiles(gap[measured], deviation[measured])
    median[measured], dispersion[measured] = fitted
    return median, dispersion


def _with_quantiles(gap: FloatArray, deviation: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Return median, m, and log-standard deviation of lognormal gaps from measured ones."""
    # Quantiles of the normal distribution above 0
    apart = np.minimum(gap / (WIDE * deviation), 1.0)
    low, high = (near + apart * (far - near) for near, far in zip(TOUCHING, APART, strict=True))
    above = ndtr(gap / deviation)
    lower, upper = (gap - deviation * ndtri(above * (1.0 - share)) for share in (low, high))
    # The same lengths as quantiles of all gaps, of which some are 0
    odds = np.exp(-((gap / deviation) ** 2) / 2.0) / (2.0 * above)
    one_wall = odds / (1.0 + odds)
    low, high = (ndtri(one_wall + (1.0 - one_wall) * share) for share in (low, high))
    dispersion = np.log(upper / lower) / (high - low)
    return upper * np.exp(-high * dispersion), dispersion
