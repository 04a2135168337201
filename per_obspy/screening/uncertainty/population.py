"""
Population of a pair: its outcome over everything that is uncertain about it.

The nodes are those of ``nodes.py``: periods and dampings of both buildings, what else is uncertain
of the demand (motion at the site, error of an estimate), and the gap. Every node has a demand and
an impact velocity. The probability is the mean over the buildings of the nodes of the chance that a
lognormal demand exceeds a lognormal gap; expected values and the quantile are those of all nodes,
with 0 where there is no contact. Where nothing is uncertain all nodes are one.
"""

from typing import NamedTuple

import numpy as np

from per_obspy.checks import FloatArray
from per_obspy.pounding.probability import demand_probability
from per_obspy.screening.uncertainty.nodes import DEMAND, GAP, gap_dispersion, median_gap
from per_obspy.screening.uncertainty.severity import (
    RelativeMotion,
    amplification,
    impact_velocity,
)
from per_obspy.screening.values import Columns, Table, both, values

#: Columns of a table that are a population.
COLUMNS = (
    "probability",
    "expected_impact_velocity",
    "impact_velocity_84",
    "expected_amplification",
)

#: Share of the population that ``impact_velocity_84`` is not below: one standard deviation above
#: the median of a normal variable.
QUANTILE = 0.84

#: Demand / largest demand of the pair's nodes below which its logarithm does not count in the
#: spread of the nodes.
NEGLIGIBLE = 1e-3

#: Interquartile range over standard deviation of a normal variable.
NORMAL_QUARTILES = 1.349


class Uncertain(NamedTuple):
    """
    Motion of pairs without contact at the nodes of their buildings, and what else is uncertain.

    Attributes
    ----------
    motion : RelativeMotion
        (n_pairs, n_nodes), at the site; one node where the buildings are certain.
    log_std : (n_pairs,) ndarray
        Log-standard deviation of the demand for given buildings.
    velocity_factor : (n_pairs,) ndarray
        By which impact velocities are known to differ from those of ``severity.py``.
    """

    motion: RelativeMotion
    log_std: FloatArray
    velocity_factor: FloatArray


def population(uncertain: Uncertain, pairs: Table, nodes: FloatArray) -> Columns:
    """
    Compute the population of pairs.

    Parameters
    ----------
    uncertain : Uncertain
        Motion of the pairs.
    pairs : Table
        Completed pairs with gap, its deviation, contact masses and restitution.
    nodes : (n_nodes, 6) ndarray
        Nodes of the motion.

    Returns
    -------
    dict of (n_pairs,) ndarray
        ``COLUMNS``: from 0 to 1; m/s; m/s; dimensionless, at least 1.
    """
    motion = uncertain.motion
    # demand and gap of every node
    gap = median_gap(pairs)[:, None] * np.exp(np.outer(gap_dispersion(pairs), nodes[:, GAP]))
    scale = np.exp(np.outer(uncertain.log_std, nodes[:, DEMAND]))
    velocity = impact_velocity(motion, scale, gap) * uncertain.velocity_factor[:, None]
    amplified = amplification(motion, velocity / scale, _received(pairs))
    return {
        "probability": chance_of_contact(motion.demand, uncertain.log_std, pairs),
        "expected_impact_velocity": velocity.mean(axis=1),
        "impact_velocity_84": np.quantile(velocity, QUANTILE, axis=1),
        "expected_amplification": amplified.mean(axis=1),
    }


def chance_of_contact(demands: FloatArray, log_std: FloatArray, table: Table) -> FloatArray:
    """
    Return the mean over the nodes of the chance that a demand exceeds an uncertain gap.

    Parameters
    ----------
    demands : (n_pairs, n_nodes) ndarray
        Medians, m.
    log_std : (n_pairs,) ndarray
        Log-standard deviation of every demand.
    table : Table
        With gap and its deviation.
    """
    gap = median_gap(table)
    known = np.hypot(gap_dispersion(table), log_std)
    # nodes are smoothed as far as nothing else is uncertain
    dispersion = np.maximum(known, _smoothing(demands))[:, None]
    mean: FloatArray = demand_probability(demands, gap[:, None], dispersion).mean(axis=1)
    return mean


def _smoothing(demands: FloatArray) -> FloatArray:
    """Return the log-standard deviation of a node: of all nodes over the root of their number."""
    largest = demands.max(axis=1, keepdims=True)
    floor = np.maximum(NEGLIGIBLE * largest, np.finfo(np.float64).tiny)
    logs = np.log(np.maximum(demands, floor))
    # the smaller of two measures of spread: few nodes far off do not count
    lower, upper = np.quantile(logs, (0.25, 0.75), axis=1)
    spread = np.minimum(logs.std(axis=1), (upper - lower) / NORMAL_QUARTILES)
    return np.asarray(spread / np.sqrt(demands.shape[1]))


def _received(pairs: Table) -> tuple[FloatArray, FloatArray]:
    """Return the change of velocity of both buildings over the impact velocity, (n_pairs, 1)."""
    mass_1, mass_2 = both(pairs, "contact_mass")
    share = (1.0 + values(pairs, "restitution")) / (mass_1 + mass_2)
    return (share * mass_2)[:, None], (share * mass_1)[:, None]
