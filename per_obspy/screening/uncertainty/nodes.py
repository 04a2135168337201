"""
Quasi-random nodes of what is uncertain about a pair: buildings, motion, estimate and gap.

Periods and dampings are lognormal, each of both buildings on its own. One node serves all pairs
alike, so that a row does not depend on the other pairs.
"""

import numpy as np
from numpy.typing import NDArray
from scipy.special import ndtri
from scipy.stats import qmc

from per_obspy.checks import FloatArray
from per_obspy.pounding.dispersion import lognormal_dispersion
from per_obspy.screening.values import Table, both, values

#: Standard normal nodes of ln period and ln damping of building 1, of building 2, of ln demand for
#: given buildings, and of ln gap: the second 128 Sobol points, which lie in the middle of their
#: strata. On a grid, or at the first 128, equal buildings would be exactly equal, and in step, at
#: some nodes.
NODES: FloatArray = ndtri(qmc.Sobol(6, scramble=False).fast_forward(128).random(128))

#: Columns of ``NODES``: both buildings, demand, gap.
BUILDINGS, DEMAND, GAP = slice(0, 4), 4, 5

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
    """Return which pairs have a building whose period or damping has a log-standard deviation."""
    period = np.maximum(*both(pairs, "period_log_std"))
    damping = np.maximum(*both(pairs, "damping_log_std"))
    return np.asarray((period > 0) | (damping > 0))


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
