"""
Population of pairs at one station; where the record supports a pair, by its exact demand.

The record drives the buildings of every node, and their exact relative displacement is the demand
of the node, whether periods were given or derived; it is carried to the site (``site_demand.py``).
So equal buildings of uncertain period or damping are not certain to move as one. Elsewhere, and
where the estimate leaves no doubt whether a pair of derived periods touches, estimates take the
place of the record: at short periods, where displacements follow the ground, an exact demand takes
up to a hundred times as long as at 1 s.

Against 4096 nodes, for 320 pairs in 18 real records (periods 0.3 to 3 s, one in three pairs of
equal periods, log-standard deviations 0.2 or 0.3 of periods, dampings or both), the probability is
wrong by less than this at 95 of 100 pairs:

===== ===== ===== ===== =====
nodes    32    64   128   256
error  .069  .035  .021  .015
===== ===== ===== ===== =====

Where the first nodes leave no doubt about contact the others are spared.
``workflows/population_accuracy.py`` compares populations with draws of exact histories.
"""

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from per_obspy.checks import FloatArray
from per_obspy.config import Screening
from per_obspy.screening.by_record.exact import (
    can_yield,
    exact_demand,
    exact_impact_velocity,
    record_supports,
)
from per_obspy.screening.by_record.station_motion import StationMotion
from per_obspy.screening.uncertainty.estimated import (
    SAMPLES,
    UncertainMotion,
    estimated_motion,
    estimated_population,
)
from per_obspy.screening.uncertainty.nodes import (
    NODES,
    building_is_uncertain,
    damping_at_nodes,
    gap_dispersion,
    period_at_nodes,
)
from per_obspy.screening.uncertainty.population import (
    COLUMNS,
    Uncertain,
    chance_of_contact,
    population,
)
from per_obspy.screening.uncertainty.record_motion import is_exact, record_motion
from per_obspy.screening.uncertainty.severity import RelativeMotion, impact_velocity
from per_obspy.screening.uncertainty.site_demand import (
    SiteDemand,
    ln_field_demand,
    median_at_site,
    pair_at_site,
    site_demand,
)
from per_obspy.screening.values import Columns, Table, both, chosen, values

#: Nodes of pairs in which a building can yield, whose demand takes fifty times as long.
YIELDING_NODES = 32

#: Exact histories of a touching pair of derived periods, over a gap of this share of the demand:
#: the chatter of touching buildings takes longer and hits no harder. Stiff buildings follow slow
#: ground, so that the frequency of their relative motion is not their own.
HISTORIES, SMALL_GAP = 4, 0.03

#: Nodes of touching pairs: their mean impact velocity is within 4 % of that of 128 nodes in the
#: median, and within 15 % at nine pairs in ten (180 pairs of derived periods in 3 real records).
TOUCHING_NODES = 16

#: Nodes after which a pair is certain if its probability is this near to 0 or 1.
FIRST_NODES, CERTAIN = 32, 5e-4

#: Distance of the probability by the estimate from 0 and 1 up to which pairs of derived periods are
#: not driven by the record.
NEGLIGIBLE = 1e-4

#: Demand / sum of the radii below which two oscillators move as one.
ROUND_OFF = 1e-12

#: Exact impact velocity at the medians / that of ``severity.py``: limits of what is believed.
SMALLEST_FACTOR, LARGEST_FACTOR = 0.4, 2.5

#: Columns of a pair from which its demand at the site and its history follow.
PAIR = (
    *("gap", "restitution", "azimuth", "azimuth_used", "distance"),
    *("ln_per_ratio_1", "ln_per_ratio_2", "ln_per_std_1", "ln_per_std_2"),
)

#: Columns of one building, besides those at nodes, from which the exact demand follows.
BUILDING = ("participation", "yield_displacement", "hardening", "per", "contact_mass")


class _Block(NamedTuple):
    """Pairs of a block with all that their population follows from."""

    station: StationMotion
    table: Columns
    motion: UncertainMotion
    site: SiteDemand
    screening: Screening

    def rows(self, numbers: NDArray[np.intp]) -> "_Block":
        """Return some of the pairs."""
        return self._replace(
            table=chosen(self.table, numbers),
            motion=self.motion.rows(numbers),
            site=SiteDemand(*(column[numbers] for column in self.site)),
        )


def record_population(station: StationMotion, table: Table, screening: Screening) -> Columns:
    """
    Compute the population of every pair at one station.

    Parameters
    ----------
    station : StationMotion
        The record, with its stored spectra.
    table : Table
        Rows of the risk table; see :func:`.record_motion`.
    screening : Screening
        Medians and log-standard deviations of the estimates.

    Returns
    -------
    dict of (n_pairs,) ndarray
        ``population.COLUMNS``. Where the exact demand decides and nothing is uncertain, what the
        exact history gives.
    """
    exact = is_exact(table)
    result: Columns = {name: np.empty(exact.size) for name in COLUMNS}
    # estimates, which show too of which pairs of derived periods the contact is in doubt
    estimated = np.flatnonzero(~exact)
    if estimated.size:
        part = chosen(table, estimated)
        motion = record_motion(station, part, screening)
        factor = _factor_of_touching(station, motion, part)
        _fill(result, estimated, estimated_population(motion, station.per, part, factor))
    # exact demands in blocks, which bound the memory; a pair does not depend on its block
    by_record = exact | _in_doubt(station, table, result["probability"])
    for mask, nodes in _kinds(table):
        for rows in _blocks(by_record & mask):
            pairs = _block(station, chosen(table, rows), screening)
            found = _of_certain_buildings if nodes is None else _sampled
            _fill(result, rows, found(pairs, NODES if nodes is None else nodes))
    return result


def _factor_of_touching(
    station: StationMotion, motion: UncertainMotion, table: Table
) -> FloatArray:
    """Return exact over estimated impact velocity at few nodes, of touching pairs; 1 of others."""
    supported = record_supports(station, table) & np.isfinite(values(table, "demand_exact"))
    touching = supported & (values(table, "gap") == 0.0) & ~can_yield(table)
    factor = np.ones(motion.row.size)
    # exact histories take the time
    for rows in _blocks(touching):
        factor[rows] = _ratio_of_histories(station, motion.rows(rows), chosen(table, rows))
    return factor


def _ratio_of_histories(
    station: StationMotion, motion: UncertainMotion, table: Columns
) -> FloatArray:
    """Return the sum of exact over that of estimated impact velocities at a small gap."""
    nodes = NODES[:HISTORIES]
    estimate = estimated_motion(motion, station.per, table, nodes)
    gap = SMALL_GAP * estimate.demand
    expected = impact_velocity(estimate, np.ones_like(gap), gap).sum(axis=1)
    # the gap at the site, seen from the record
    ln_ratio, _ = pair_at_site(table)
    sample = _sampled_buildings(table, nodes)
    sample["gap"] = (gap * np.exp(-ln_ratio)[:, None]).ravel()
    azimuth = np.repeat(values(table, "azimuth_used"), HISTORIES)
    found = exact_impact_velocity(station, sample, azimuth).reshape(-1, HISTORIES)
    exact = found.sum(axis=1) * np.exp(ln_ratio)
    # 1 where neither is known
    known = (expected > 0.0) & (exact > 0.0)
    ratio: FloatArray = np.divide(exact, expected, out=np.ones_like(exact), where=known)
    return ratio


def _kinds(table: Table) -> list[tuple[NDArray[np.bool_], FloatArray | None]]:
    """Return masks of pairs, each with its nodes of both buildings; None of certain buildings."""
    uncertain, yields = building_is_uncertain(table), can_yield(table)
    touching = values(table, "gap") == 0.0
    # fewer nodes of yielding pairs, and of touching ones, which surely touch
    return [
        (~uncertain, None),
        (uncertain & touching, NODES[:TOUCHING_NODES]),
        (uncertain & ~touching & yields, NODES[:YIELDING_NODES]),
        (uncertain & ~touching & ~yields, NODES),
    ]


def _blocks(mask: NDArray[np.bool_]) -> list[NDArray[np.intp]]:
    """Return the numbers of the rows of a mask in blocks of bounded memory."""
    rows, size = np.flatnonzero(mask), SAMPLES // len(NODES)
    return [rows[first : first + size] for first in range(0, rows.size, size)]


def _fill(result: Columns, rows: NDArray[np.intp], part: Columns) -> None:
    """Put the columns of some rows in place."""
    for name, column in part.items():
        result[name][rows] = column


def _in_doubt(station: StationMotion, table: Table, estimated: FloatArray) -> NDArray[np.bool_]:
    """Return where the record supports a pair of whose contact an estimate leaves a doubt."""
    known = ~is_exact(table) & np.isfinite(values(table, "demand_exact"))
    # rows of exact demands have no estimate yet
    chance = np.where(known, estimated, 0.0)
    doubtful = (chance >= NEGLIGIBLE) & (chance <= 1.0 - NEGLIGIBLE)
    return known & doubtful & record_supports(station, table)


def _block(station: StationMotion, pairs: Table, screening: Screening) -> _Block:
    """Return pairs with the exact demand as the one that decides."""
    rule = np.full(len(pairs["gap"]), "exact", dtype=object)
    table: Columns = {**pairs, "demand_rule": rule}
    motion = record_motion(station, table, screening)
    return _Block(station, table, motion, site_demand(station, table, screening), screening)


def _of_certain_buildings(block: _Block, nodes: FloatArray) -> Columns:
    """Return the population of pairs of which at most motion and gap are uncertain."""
    # the only demand, at the site
    table, site = block.table, block.site
    moving, factor = _at_the_medians(block)
    result = population(Uncertain(moving, site.log_std, factor), table, nodes)
    # nothing uncertain: the exact history itself
    at_record = (site.log_std == 0.0) & (site.ln_ratio == 0.0) & (site.weight == 1.0)
    certain = at_record & (gap_dispersion(table) == 0.0)
    velocity = np.nan_to_num(values(table, "impact_velocity_exact"))
    amplified = np.fmax(*both(table, "amplification_exact"))
    history = {
        "expected_impact_velocity": velocity,
        "impact_velocity_84": velocity,
        "expected_amplification": np.where(velocity > 0.0, np.fmax(amplified, 1.0), 1.0),
    }
    return result | {name: np.where(certain, history[name], result[name]) for name in history}


def _sampled(block: _Block, nodes: FloatArray) -> Columns:
    """Return the population of uncertain buildings, at all nodes where the first leave a doubt."""
    # first nodes
    demands = _demands(block, nodes[:FIRST_NODES])
    chance = chance_of_contact(demands, block.site.log_std, block.table)
    doubtful = (chance > CERTAIN) & (chance < 1.0 - CERTAIN)
    result: Columns = {name: np.empty(chance.size) for name in COLUMNS}
    for mask, taken in ((~doubtful, nodes[:FIRST_NODES]), (doubtful, nodes)):
        rows = np.flatnonzero(mask)
        if not rows.size:
            continue
        # the first nodes are known already
        pairs, known = block.rows(rows), demands[rows]
        every = np.concatenate([known, _demands(pairs, taken[FIRST_NODES:])], axis=1)
        moving = _scaled(pairs, taken, every)
        uncertain = Uncertain(moving, pairs.site.log_std, _factor_of_yielding(pairs))
        _fill(result, rows, population(uncertain, pairs.table, taken))
    return result


def node_demands(
    station: StationMotion, table: Table, nodes: FloatArray, screening: Screening
) -> FloatArray:
    """
    Return median demands at the site at nodes of both buildings, (n_pairs, n_nodes), m.

    Parameters
    ----------
    station : StationMotion
        The record.
    table : Table
        Rows of the risk table.
    nodes : (n_nodes, 6) ndarray
        As ``nodes.NODES``.
    screening : Screening
        For the demand at the site.
    """
    return _demands(_block(station, table, screening), nodes)


def _demands(block: _Block, nodes: FloatArray) -> FloatArray:
    """Return median demands at the site at nodes of both buildings, (n_pairs, n_nodes), m."""
    if not len(nodes):
        return np.empty((len(block.table["gap"]), 0))
    sample = _sampled_buildings(block.table, nodes)
    demand = exact_demand(block.station, sample, values(sample, "azimuth_used"))
    demand = demand.reshape(-1, len(nodes))
    # equal motions leave the round-off of their difference
    moves_apart = demand > ROUND_OFF * values(block.table, "absolute_gap")[:, None]
    demand = np.where(moves_apart, demand, 0.0)
    # what the motion between the stations lets expect of the same buildings
    ln_field = ln_field_demand(block.station, sample, block.screening).reshape(demand.shape)
    weight, ln_ratio = block.site.weight[:, None], block.site.ln_ratio[:, None]
    return median_at_site(demand, weight, ln_ratio, ln_field)


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
    return sample


def _scaled(block: _Block, nodes: FloatArray, demand: FloatArray) -> RelativeMotion:
    """Return the motion at nodes with exact demands: velocities follow by their frequency."""
    estimate = estimated_motion(block.motion, block.station.per, block.table, nodes)
    period_1, period_2 = both(block.table, "period")
    between = np.broadcast_to((2.0 * np.pi / np.sqrt(period_1 * period_2))[:, None], demand.shape)
    # circular frequency of the relative motion; between both where an estimate has none
    moves = estimate.demand > 0.0
    frequency = np.divide(estimate.velocity, estimate.demand, out=between.copy(), where=moves)
    return estimate._replace(demand=demand, velocity=frequency * demand)


def _at_the_medians(block: _Block) -> tuple[RelativeMotion, FloatArray]:
    """Return the motion at the medians, (n_pairs, 1), and the factor of impact velocities there."""
    site, exact = block.site, values(block.table, "demand_exact")
    demand = median_at_site(exact, site.weight, site.ln_ratio, site.ln_field)
    moving = _scaled(block, np.zeros((1, NODES.shape[1])), demand[:, None])
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
    """Return the factor at the medians where a building can yield, to which no fit applies."""
    factor, yields = np.ones(block.motion.row.size), np.flatnonzero(can_yield(block.table))
    if yields.size:
        _, factor[yields] = _at_the_medians(block.rows(yields))
    return factor
