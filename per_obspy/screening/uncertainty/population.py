"""
Population of a pair: its outcomes at nodes of all uncertain values.

The nodes are those of ``nodes.py``: periods and dampings of both buildings, other uncertainties
of the demand (motion at the site, error of an estimate), and the gap. Every node has a demand and
an impact velocity. The probability is the mean over the buildings of the nodes of the chance that a
lognormal demand exceeds a lognormal gap; expected values and the quantile are those of all nodes,
with 0 where there is no contact, the quantile being that of 84 in 100: one standard deviation above
the median of a normal variable. Without uncertainty all nodes are one.

A node is as uncertain as everything but the buildings is, or as the spread of the nodes over the
root of their number where that is more. The spread is the smaller one of the standard deviation and
that of a normal variable of the same quartiles: few nodes far off do not count.
"""

from typing import NamedTuple

import numpy as np

from per_obspy.checks import FloatArray
from per_obspy.kernels.pairs.node_outcomes import OUTCOME_ROWS, fill_chances, fill_outcomes
from per_obspy.screening.uncertainty.nodes import (
    DEMAND,
    GAP,
    gap_dispersion,
    median_gap,
    one_wall_chance,
)
from per_obspy.screening.uncertainty.severity import RelativeMotion
from per_obspy.screening.values import Columns, Table, both, values

#: Columns of a table that are a population.
COLUMNS = (
    "probability",
    "expected_impact_velocity",
    "impact_velocity_84",
    "expected_amplification",
)


class Uncertain(NamedTuple):
    """
    Motion of pairs without contact at the nodes of their buildings, and other uncertain values.

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
    shape = uncertain.log_std.size, len(nodes)
    facts = np.stack(
        [
            *(median_gap(pairs), gap_dispersion(pairs)),
            *(uncertain.log_std, uncertain.velocity_factor),
            *_received(pairs),
        ]
    )
    deviates = np.ascontiguousarray(nodes[:, [DEMAND, GAP]].T)
    # one node of certain buildings is all nodes
    every = np.broadcast_to(uncertain.motion.rows(), (len(RelativeMotion._fields), *shape))
    # always writable: a read-only array would compile the kernel a second time
    every = np.require(every, requirements=["C", "W"])
    outcome = np.empty((OUTCOME_ROWS, len(facts[0])))
    fill_outcomes(every, facts, deviates, outcome)
    # the lognormal gap has no share of exactly 0, at which any motion is contact
    moving = (uncertain.motion.demand > 0.0).mean(axis=1)
    outcome[0] = np.maximum(outcome[0], one_wall_chance(pairs) * moving)
    return dict(zip(COLUMNS, outcome, strict=True))


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
    chances = np.empty(log_std.size)
    deviation = np.hypot(gap_dispersion(table), log_std)
    fill_chances(np.ascontiguousarray(demands), median_gap(table), deviation, chances)
    return chances


def _received(pairs: Table) -> tuple[FloatArray, FloatArray]:
    """Return the change of velocity of both buildings over the impact velocity."""
    mass_1, mass_2 = both(pairs, "contact_mass")
    share = (1.0 + values(pairs, "restitution")) / (mass_1 + mass_2)
    return share * mass_2, share * mass_1
