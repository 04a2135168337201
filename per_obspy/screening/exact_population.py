"""
Population of pairs at one station; where the record supports a pair, by its exact demand.

The record drives the buildings of every node. Their exact relative displacement is the demand of
the node, and their relative velocity that of ``population.py``, whether periods were given or
derived; both are carried to the site (``motion.py``). So equal buildings of uncertain period
or damping are not certain to move as one, and stiff buildings, which follow slow ground, do not hit
as if they vibrated freely. Elsewhere, and where the estimate shows that a pair of derived
periods does not touch, estimates take the place of the record.

Against 4096 nodes, for 320 pairs in 18 real records (periods 0.3 to 3 s, one in three pairs of
equal periods, log-standard deviations 0.2 or 0.3 of periods, dampings or both), the probability is
wrong by less than this at 95 of 100 pairs:

===== ===== ===== ===== =====
nodes    32    64   128   256
error  .069  .035  .021  .015
===== ===== ===== ===== =====

Where the first nodes leave no doubt about contact, with a margin, the others are left out:
``nodes_suffice``. ``workflows/population_accuracy.py`` compares populations with draws of exact
histories.
"""

from typing import NamedTuple

import numpy as np

from per_obspy.checks import FloatArray
from per_obspy.config import Screening
from per_obspy.screening.estimates import ROUND_OFF
from per_obspy.screening.exact import (
    can_yield,
    exact_approach,
    record_supports,
)
from per_obspy.screening.population import (
    NODES,
    SAMPLES,
    STRENGTH,
    RelativeMotion,
    Uncertain,
    UncertainMotion,
    building_is_uncertain,
    chance_of_contact,
    contact_quantile,
    damping_at_nodes,
    empty_population,
    estimated_motion,
    estimated_population,
    gap_dispersion,
    impact_velocity,
    median_gap,
    period_at_nodes,
    population,
)
from per_obspy.screening.station_motion import StationMotion
from per_obspy.screening.uncertain_motion import (
    SiteDemand,
    is_exact,
    ln_field_demand,
    median_at_site,
    record_motion,
    site_demand,
)
from per_obspy.screening.values import (
    BoolArray,
    Both,
    Columns,
    IndexArray,
    Table,
    both,
    chosen,
    only,
    values,
)

#: First nodes, which suffice for pairs that touch and where their probability is this near to 0 or
#: 1, with a margin. Of 16 nodes the deviation of periods is 7 % too small and that of dampings 13 %
#: too large, of 32 both are right to 3 %.
FIRST_NODES, CERTAIN = 32, 1e-3

#: Gap over the largest demand, and smallest demand over the gap, of nodes that leave no doubt. Of
#: 480 pairs in 8 real records (period deviations 0.1 to 0.3), by 4 096 nodes, those whose first 32
#: nodes all lie below the gap by that margin touch with a probability of 0.0002 at most (by a
#: margin of 1.3: 0.009); those whose nodes all lie above it by the other margin with 0.985 or more.
BELOW, ABOVE = 2.0, 3.0

#: Gap over the largest demand up to which nodes below the gap show no more than their number: of
#: the same pairs, those with 128 nodes farther below touch with a probability of 0.0003 at most.
NEAR = 1.3

#: Probability by the estimate up to which pairs of derived periods are not driven by the record;
#: those as near to 1 surely touch.
NEGLIGIBLE = 1e-4

#: Exact impact velocity at the medians / that of ``population.py``: limits of plausible ratios.
SMALLEST_FACTOR, LARGEST_FACTOR = 0.4, 2.5

#: Columns of a pair from which its demand at the site and its history follow.
PAIR = (
    *("gap", "restitution", "contact_log_std", "azimuth", "azimuth_used", "distance"),
    "station_index",
    *("ln_per_ratio_1", "ln_per_ratio_2", "ln_per_std_1", "ln_per_std_2"),
)

#: Columns of one building, besides those at nodes, from which the exact demand follows.
BUILDING = ("participation", "yield_displacement", "hardening", "per", "contact_mass")

#: Columns of one building from which a population follows.
NEEDED_OF_BUILDING = (
    *BUILDING,
    *("period", "damping", "period_log_std", "damping_log_std", "yield_log_std"),
    "amplification_exact",
    *("equivalent_period", "equivalent_damping", "equivalent_per"),
)

#: Columns from which a population follows.
NEEDED = (
    *PAIR,
    *("gap_std", "assumed_gap", "absolute_gap", "demand_rule", "demand_exact"),
    "period_correlation",
    *("correlation", "correlation_record", "correlation_linearized", "impact_velocity_exact"),
    *(f"{name}_{i}" for name in NEEDED_OF_BUILDING for i in (1, 2)),
)


class _Block(NamedTuple):
    """Pairs of a block with all that their population follows from."""

    station: StationMotion
    table: Columns
    motion: UncertainMotion
    site: SiteDemand
    screening: Screening

    def rows(self, numbers: IndexArray) -> "_Block":
        """Return some of the pairs."""
        return self._replace(
            table=chosen(self.table, numbers),
            motion=self.motion.rows(numbers),
            site=SiteDemand(*(column[numbers] for column in self.site)),
        )


def record_population(station: StationMotion, table: Table, screening: Screening) -> Columns:
    """
    Compute the population of every pair at one station: ``population.COLUMNS``, (n_pairs,).

    ``table`` holds rows of the risk table, see :func:`.record_motion`. Where the exact demand
    decides without uncertain inputs, the results are those of the exact history.
    """
    table = only(table, NEEDED)
    exact = is_exact(table)
    result = empty_population(exact.size)
    # estimates, which show too which pairs of derived periods may touch
    estimated = np.flatnonzero(~exact)
    if estimated.size:
        part = chosen(table, estimated)
        motion = record_motion(station, part, screening)
        _fill(result, estimated, estimated_population(motion, station.per, part))
    by_record = exact | _may_touch(station, table, result["probability"])
    uncertain = building_is_uncertain(table)
    # exact demands in blocks, which bound the memory; a pair does not depend on its block
    for mask, outcome in ((~uncertain, _of_certain_buildings), (uncertain, _sampled)):
        for rows in _blocks(by_record & mask):
            _fill(result, rows, outcome(_block(station, chosen(table, rows), screening)))
    return result


def _may_touch(station: StationMotion, table: Table, chance: FloatArray) -> BoolArray:
    """Return where the record supports a pair that touches by a chance that is not negligible."""
    known = np.isfinite(values(table, "demand_exact")) & record_supports(station, table)
    return np.asarray(known & (chance >= NEGLIGIBLE))


def _blocks(mask: BoolArray) -> list[IndexArray]:
    """Return the numbers of the rows of a mask in blocks of bounded memory."""
    rows, size = np.flatnonzero(mask), SAMPLES // len(NODES)
    return [rows[first : first + size] for first in range(0, rows.size, size)]


def _fill(result: Columns, rows: IndexArray, part: Columns) -> None:
    for name, column in part.items():
        result[name][rows] = column


def _block(station: StationMotion, pairs: Table, screening: Screening) -> _Block:
    """Return pairs with the exact demand as the one that decides."""
    rule = np.full(len(pairs["gap"]), "exact", dtype=object)
    table: Columns = {**pairs, "demand_rule": rule}
    motion = record_motion(station, table, screening)
    return _Block(station, table, motion, site_demand(station, table, screening), screening)


def _of_certain_buildings(block: _Block) -> Columns:
    """Return the population of pairs of which at most motion and gap are uncertain."""
    # the only demand, at the site
    table, site = block.table, block.site
    moving, factor = _at_the_medians(block)
    result = population(Uncertain(moving, site.log_std, factor), table, NODES)
    # no uncertainty but of the contact law: the exact history itself
    at_record = (site.log_std == 0.0) & (site.ln_ratio == 0.0) & (site.weight == 1.0)
    certain = at_record & (gap_dispersion(table) == 0.0)
    velocity = np.nan_to_num(values(table, "impact_velocity_exact"))
    amplified = np.fmax(*both(table, "amplification_exact"))
    history = {
        "expected_impact_velocity": velocity,
        "impact_velocity_84": contact_quantile(velocity, values(table, "contact_log_std")),
        "expected_amplification": np.where(velocity > 0.0, np.fmax(amplified, 1.0), 1.0),
    }
    return result | {name: np.where(certain, history[name], result[name]) for name in history}


def _sampled(block: _Block) -> Columns:
    """Return the population of uncertain buildings, at all nodes if the first are inconclusive."""
    # first nodes
    few = _node_motion(block, NODES[:FIRST_NODES])
    chance = chance_of_contact(few.demand, block.site.log_std, block.table)
    gap, certain = median_gap(block.table), (chance <= CERTAIN) | (chance >= 1.0 - CERTAIN)
    # outlines that are drawn without a gap may still have one
    certain = (certain & nodes_suffice(few.demand, gap)) | (gap == 0.0)
    # the others where they may change the probability
    result = empty_population(chance.size)
    for number, mask in ((FIRST_NODES, certain), (len(NODES), ~certain)):
        rows = np.flatnonzero(mask)
        if not rows.size:
            continue
        pairs, motion = block.rows(rows), RelativeMotion(*(column[rows] for column in few))
        if number > FIRST_NODES:
            others = _node_motion(pairs, NODES[FIRST_NODES:number])
            motion = RelativeMotion(*map(np.hstack, zip(motion, others, strict=True)))
        _fill(result, rows, _of_nodes(pairs, motion, NODES[:number]))
    return result


def _of_nodes(block: _Block, motion: RelativeMotion, nodes: FloatArray) -> Columns:
    """Return the population of uncertain buildings, with a probability that the nodes can show."""
    uncertain = Uncertain(motion, block.site.log_std, _factor_of_yielding(block))
    outcome = population(uncertain, block.table, nodes)
    lowest, highest = resolved_probability(motion.demand, median_gap(block.table))
    return outcome | {"probability": np.clip(outcome["probability"], lowest, highest)}


def nodes_suffice(demands: FloatArray, gap: FloatArray) -> BoolArray:
    """
    Return where all nodes lie on one side of the gap, with a margin (``BELOW``, ``ABOVE``).

    Medians in m: demands (n_pairs, n_nodes), gap (n_pairs,).
    """
    is_below = demands.max(axis=1) * BELOW < gap
    return np.asarray(is_below | (demands.min(axis=1) > ABOVE * gap))


def resolved_probability(demands: FloatArray, gap: FloatArray) -> Both:
    """
    Return the smallest and the largest probability of contact that the nodes can show, (n_pairs,).

    Of N nodes that all lie below the gap, some of them ``NEAR`` it, contact is not less likely than
    1 / (2 (N + 1)). Of N that all lie above the gap g, the absence of contact is not less likely
    than g / (d (N + 1)), d being the smallest demand: in the mean 1 / (N + 1) of a population lies
    below the smallest of N values, and from there the demand of nearly equal buildings falls evenly
    to 0. Both are 0 and 1 where nodes lie on both sides of the gap, or far below it.
    """
    smallest, largest, one_node = (
        demands.min(axis=1),
        demands.max(axis=1),
        1.0 / (len(demands.T) + 1),
    )
    # all below, but near; all above
    is_near = (largest <= gap) & (largest > 0.0) & (largest * NEAR >= gap)
    share = np.divide(gap, smallest, out=np.zeros_like(gap), where=smallest > gap)
    return np.where(is_near, one_node / 2.0, 0.0), 1.0 - share * one_node


def _node_motion(block: _Block, nodes: FloatArray) -> RelativeMotion:
    sample = _sampled_buildings(block.table, nodes)
    shape = -1, len(nodes)
    demand, velocity = exact_approach(block.station, sample, sample["azimuth_used"])
    demand, velocity = demand.reshape(shape), velocity.reshape(shape)
    # equal motions leave the round-off of their difference
    moves_apart = demand > ROUND_OFF * values(block.table, "absolute_gap")[:, None]
    demand = np.where(moves_apart, demand, 0.0)
    # expected motion between the stations of the same buildings
    ln_field = ln_field_demand(block.station, sample).reshape(demand.shape)
    return _at_site(block, nodes, demand, velocity, ln_field)


def _at_site(
    block: _Block, nodes: FloatArray, demand: FloatArray, velocity: FloatArray, ln_field: FloatArray
) -> RelativeMotion:
    """Return the motion at the site from demand and velocity in the record, (n_pairs, n_nodes)."""
    estimate = estimated_motion(block.motion, block.station.per, block.table, nodes)
    weight, ln_ratio = block.site.weight[:, None], block.site.ln_ratio[:, None]
    at_site = median_at_site(demand, weight, ln_ratio, ln_field)
    # the relative motion has the same frequency at both
    frequency = np.divide(velocity, demand, out=np.zeros_like(demand), where=demand > 0.0)
    # the more a building yields, the less do alike ones move together
    weakness = [
        values(block.table, f"per_{i}") / values(block.table, f"yield_displacement_{i}")
        for i in (1, 2)
    ]
    alike = estimate.correlation / np.maximum(np.fmax(*weakness), 1.0)[:, None]
    return estimate._replace(demand=at_site, velocity=frequency * at_site, correlation=alike)


def _sampled_buildings(table: Table, nodes: FloatArray) -> Columns:
    """Return the buildings of all pairs at all nodes, node by node within a pair."""
    # whatever does not differ between the nodes
    names = [name for name in PAIR if name in table]
    names += [f"{name}_{i}" for name in BUILDING for i in (1, 2)]
    sample: Columns = {name: np.repeat(values(table, name), len(nodes)) for name in names}
    for i in (1, 2):
        # lognormal period and damping
        period = period_at_nodes(values(table, f"period_{i}"), table, i, nodes)
        damping = damping_at_nodes(values(table, f"damping_{i}"), table, i, nodes)
        sample[f"period_{i}"], sample[f"damping_{i}"] = period.ravel(), damping.ravel()
        # an infinite yield displacement stays so
        deviation = np.outer(values(table, f"yield_log_std_{i}"), nodes[:, STRENGTH[i - 1]])
        sample[f"yield_displacement_{i}"] *= np.exp(deviation).ravel()
    return sample


def _at_the_medians(block: _Block) -> tuple[RelativeMotion, FloatArray]:
    """Return the motion at the medians, (n_pairs, 1), and the factor of impact velocities there."""
    site, exact = block.site, values(block.table, "demand_exact")
    _, velocity = exact_approach(block.station, block.table, block.table["azimuth_used"])
    columns = exact[:, None], velocity[:, None], site.ln_field[:, None]
    moving = _at_site(block, np.zeros((1, NODES.shape[1])), *columns)
    demand = moving.demand[:, 0]
    # back to the record, whose history is known
    at_record = np.divide(exact, demand, out=np.ones_like(exact), where=demand > 0.0)
    gap = values(block.table, "gap")[:, None]
    estimate = impact_velocity(moving, at_record[:, None], gap)[:, 0]
    # both must hit at the medians
    velocity = values(block.table, "impact_velocity_exact")
    known = (velocity > 0.0) & (estimate > 0.0)
    factor = np.divide(velocity, estimate, out=np.ones_like(velocity), where=known)
    return moving, np.clip(factor, SMALLEST_FACTOR, LARGEST_FACTOR)


def _factor_of_yielding(block: _Block) -> FloatArray:
    """Return the factor at the medians where a building yields and only dampings are uncertain."""
    table, factor = block.table, np.ones(block.motion.row.size)
    # far from the medians the history there says little
    spread = np.maximum(both(table, "period_log_std"), both(table, "yield_log_std")).max(axis=0)
    rows = np.flatnonzero(can_yield(table) & (spread == 0.0))
    if rows.size:
        _, factor[rows] = _at_the_medians(block.rows(rows))
    return factor
