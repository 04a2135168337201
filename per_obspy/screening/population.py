"""
Population of a pair: its outcomes at nodes of all uncertain values.

The nodes are quasi-random: periods and dampings of both buildings, other uncertainties
of the demand (motion at the site, error of an estimate), and the gap. Every node has a demand and
an impact velocity. The probability is the mean over the buildings of the nodes of the chance that a
lognormal demand exceeds a lognormal gap; expected values and the quantile are those of all nodes,
with 0 where there is no contact, the quantile being that of 84 in 100: one standard deviation above
the median of a normal variable. Without uncertainty all nodes are one.

A node is as uncertain as everything but the buildings is, or as the spread of the nodes over the
root of their number where that is more. The spread is the smaller one of the standard deviation and
that of a normal variable of the same quartiles: few nodes far off do not count.

Periods and dampings are lognormal. Those of both buildings are independent, but for periods with a
``period_correlation``: alike neighbours miss a period formula alike. One node serves all pairs
alike, so that a row does not depend on the other pairs.

Two oscillators whose relative displacement would reach D and whose relative velocity V hit at a gap
g with ``V sqrt(1 - (g/D)²)`` if their relative motion were harmonic. Earlier impacts keep nearly
equal oscillators from building up a relative motion at all: the velocity is less by the factor
``exp(-(LOSS sqrt(rho) + LOSS_BETWEEN rho (1 - rho)) (1 - g/D))`` with rho of eq. (16), over the
larger ratio of PER to the yield displacement where a building yields in a record. The change
of velocity dv of eq. (7) and (8), x being dv / (w r), amplifies a radius r by
``(1 + (RADIUS_SHARE x)⁴)^(1/4) + WEAK_SHARE sqrt(x)``. The constants are those of
``kernels/pairs/node_outcomes.py``, fitted to exact histories in 10 events of real records;
``workflows/population_accuracy.py`` has their accuracy.

Where the demand is an estimate, by radii of a spectrum, eq. (15) and (16), the motion is given by
its effect on the pairs (:class:`UncertainMotion`), whether it comes from a record, a ShakeMap or a
design spectrum. Periods and dampings are resampled for each building separately, with radii from
spectra scaled to the median radius. So two buildings of equal height are never certain to move as
one.
"""

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray
from scipy.special import ndtr, ndtri

from per_obspy.checks import FloatArray
from per_obspy.kernels.pairs.node_motion import MOTION_ROWS, estimate_motion
from per_obspy.kernels.pairs.node_outcomes import (
    DEMAND_STD,
    OUTCOME_ROWS,
    QUANTILE,
    fill_chances,
    fill_outcomes,
    fill_velocities,
)
from per_obspy.pounding.correlation import ddc_correlation
from per_obspy.pounding.probability import lognormal_dispersion
from per_obspy.screening.columns import DEMAND_SHARES
from per_obspy.screening.station_motion import (
    LogSpectra,
    log_period_and_damping,
    stored_log,
)
from per_obspy.screening.values import (
    BoolArray,
    Both,
    Columns,
    IndexArray,
    Table,
    both,
    values,
)

#: Direction numbers of Sobol points in nine dimensions, eight bits (Joe & Kuo 2008): SciPy has them
#: too, but its statistics take a fifth of the time in which a run loads its libraries.
_DIRECTIONS = (
    (1, 1, 1, 1, 1, 1, 1, 1),
    (1, 3, 5, 15, 17, 51, 85, 255),
    (1, 3, 3, 9, 29, 23, 71, 197),
    (1, 3, 1, 5, 31, 29, 81, 147),
    (1, 1, 1, 11, 31, 55, 61, 157),
    (1, 1, 3, 3, 25, 9, 43, 251),
    (1, 3, 5, 13, 11, 37, 31, 227),
    (1, 1, 5, 5, 17, 9, 9, 45),
    (1, 1, 5, 5, 5, 53, 53, 113),
)


def _sobol_points() -> FloatArray:
    """Return the second 128 Sobol points, (128, 9), in the order of the Gray code."""
    number, bit = np.arange(128, 256), np.arange(8)
    gray = (number ^ number >> 1)[:, None] >> bit & 1
    points = np.bitwise_xor.reduce(gray[:, None, :] * (_DIRECTIONS << 7 - bit), axis=2)
    return np.asarray(points / 256.0)


#: Standard normal nodes of ln period and ln damping of building 1, of building 2, of ln demand for
#: given buildings, of ln gap, of ln impact velocity by the contact, and of ln yield displacement of
#: both buildings: the second 128 Sobol points, which lie in the middle of their strata. On a grid,
#: or at the first 128, equal buildings would be exactly equal, and in step, at some nodes.
NODES: FloatArray = ndtri(_sobol_points())

#: Columns of ``NODES``: both buildings, demand, gap, contact, strength of building 1 and 2.
BUILDINGS, DEMAND, GAP, CONTACT, STRENGTH = slice(0, 4), 4, 5, 6, (7, 8)

#: Shares of measured gaps below the quantiles that a lognormal gap has of them, for outlines that
#: touch, whose one wall counts besides, for those that nearly do, and from ``WIDE`` standard
#: deviations on; between the last two they are interpolated.
TOUCHING, CLOSE, APART, WIDE = (0.1, 0.9), (0.01, 0.9), (0.16, 0.84), 3.0

#: Chance that buildings whose drawn outlines touch have one wall. Surveyors saw both buildings
#: touch on both sides in 0.70 (San José) and 0.99 (Guatemala City) of such pairs, 0.84 and 0.99
#: inside rows (``workflows/outline_accuracy.py``): the mean of the first two. The same surveys saw
#: contact at half of the pairs drawn apart, near or far, so that those stay even.
ONE_WALL = 0.85

#: Largest damping of a node, and of a building that yields, fraction of critical: an oscillator has
#: less than the critical one.
LARGEST_DAMPING = 0.99


def period_at_nodes(median: FloatArray, table: Table, i: int, nodes: FloatArray) -> FloatArray:
    """Return the lognormal period of building i at the nodes, (n_pairs, n_nodes), s."""
    deviate = nodes[None, :, 0]
    # building 2 shares a part of the deviate of building 1
    if i == 2:
        shared = values(table, "period_correlation")[:, None]
        deviate = shared * deviate + np.sqrt(1.0 - shared**2) * nodes[:, 2]
    deviation = values(table, f"period_log_std_{i}")[:, None]
    period: FloatArray = median[:, None] * np.exp(deviation * deviate)
    return period


def damping_at_nodes(median: FloatArray, table: Table, i: int, nodes: FloatArray) -> FloatArray:
    """Return the damping of building i at the nodes, as :func:`period_at_nodes`; below critical."""
    deviation = values(table, f"damping_log_std_{i}")
    damping = median[:, None] * np.exp(np.outer(deviation, nodes[:, 2 * i - 1]))
    largest = np.maximum(median, LARGEST_DAMPING)[:, None]
    return np.asarray(np.minimum(damping, largest))


def building_is_uncertain(pairs: Table) -> BoolArray:
    """Return a mask of pairs in which period, damping or strength has a log-standard deviation."""
    deviations = ("period_log_std", "damping_log_std", "yield_log_std")
    uncertain = [np.maximum(*both(pairs, name)) > 0 for name in deviations]
    return np.asarray(np.any(uncertain, axis=0))


def gap_dispersion(pairs: Table) -> FloatArray:
    """
    Return the log-standard deviation of a lognormal gap; 0 where the gap is certain.

    A gap is a distance measured with a normal error, and not below 0: either the walls are one, or
    the gap has a normal distribution about ``gap`` with ``gap_std``, truncated at 0. Where outlines
    touch the walls are one by ``ONE_WALL``, as the error alone would give a stiff pair, whose
    demand is a hundredth of it, a ``no``. For outlines apart, Bayes' rule gives the chance that the
    walls are one, from even odds. The lognormal gap has two quantiles of this distribution
    (``TOUCHING``, ``CLOSE``, ``APART``).

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


def _lognormal_gap(pairs: Table) -> Both:
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


def _with_quantiles(gap: FloatArray, deviation: FloatArray) -> Both:
    """Return median, m, and log-standard deviation of lognormal gaps from measured ones."""
    # Quantiles of the normal distribution above 0
    touch, apart = gap == 0.0, np.minimum(gap / (WIDE * deviation), 1.0)
    low, high = (
        np.where(touch, at_0, near + apart * (far - near))
        for at_0, near, far in zip(TOUCHING, CLOSE, APART, strict=True)
    )
    above = ndtr(gap / deviation)
    lower, upper = (gap - deviation * ndtri(above * (1.0 - share)) for share in (low, high))
    # The same lengths as quantiles of all gaps, of which some are 0
    odds = np.exp(-((gap / deviation) ** 2) / 2.0) / (2.0 * above)
    one_wall = np.where(touch, ONE_WALL, odds / (1.0 + odds))
    low, high = (ndtri(one_wall + (1.0 - one_wall) * share) for share in (low, high))
    dispersion = np.log(upper / lower) / (high - low)
    return upper * np.exp(-high * dispersion), dispersion


class RelativeMotion(NamedTuple):
    """
    Motion without contact of pairs at nodes, (n_pairs, n_nodes); proportional to the ground motion.

    Attributes
    ----------
    demand : ndarray
        Largest relative displacement of 1 towards 2 at contact height, m.
    velocity : ndarray
        Largest relative velocity, m/s.
    speed_1, speed_2 : ndarray
        Circular frequency times radius of both oscillators at contact height, m/s.
    correlation : ndarray
        Of both responses by eq. (16), dimensionless.
    """

    demand: FloatArray
    velocity: FloatArray
    speed_1: FloatArray
    speed_2: FloatArray
    correlation: FloatArray

    def rows(self) -> FloatArray:
        """Return the motion as one array, (5, n_pairs, n_nodes), in the order of the kernels."""
        return np.stack(self)


def impact_velocity(motion: RelativeMotion, scale: FloatArray, gap: FloatArray) -> FloatArray:
    """
    Return the largest approach velocity of the impacts, (n_pairs, n_nodes), m/s.

    It is 0 where the gap, m, is wide enough for the motion times ``scale``; both broadcast to its
    shape.
    """
    shape = motion.demand.shape
    velocity = np.empty(shape)
    scales, gaps = (np.ascontiguousarray(np.broadcast_to(one, shape)) for one in (scale, gap))
    fill_velocities(motion.rows(), scales, gaps, velocity)
    return velocity


#: Columns of a table that are a population.
COLUMNS = (
    "probability",
    "expected_impact_velocity",
    "impact_velocity_84",
    "expected_amplification",
    *DEMAND_SHARES,
)


def contact_quantile(velocity: FloatArray, log_std: FloatArray) -> FloatArray:
    """
    Return the impact velocity, m/s, that 84 in 100 contact laws do not exceed.

    The contact is lognormal with mean 1 about that of the history, and ``log_std`` the deviation.
    """
    return velocity * np.exp(log_std * (ndtri(QUANTILE) - log_std / 2.0))


def empty_population(count: int) -> Columns:
    """Return ``COLUMNS`` to be filled; single precision is enough for the quantiles of a demand."""
    return {
        name: np.zeros(count, np.float32 if name in DEMAND_SHARES else np.float64)
        for name in COLUMNS
    }


#: Smallest quantile of a demand, m: that of buildings that move as one.
SMALLEST_QUANTILE = 1e-6


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
        By which impact velocities are known to differ from those of `impact_velocity`.
    """

    motion: RelativeMotion
    log_std: FloatArray
    velocity_factor: FloatArray


def population(uncertain: Uncertain, pairs: Table, nodes: FloatArray) -> Columns:
    """
    Compute the population of completed pairs: ``COLUMNS``, each (n_pairs,).

    Probabilities from 0 to 1, velocities in m/s, amplifications of at least 1. ``nodes`` are those
    of the motion, (n_nodes, 6), as ``NODES``.
    """
    facts = _facts(pairs, uncertain.log_std, uncertain.velocity_factor)
    return _columns(_of_nodes(uncertain.motion.rows(), facts, nodes), pairs)


def _facts(pairs: Table, log_std: FloatArray, velocity_factor: FloatArray) -> FloatArray:
    """Return what is known of pairs besides their motion, in the rows of the kernel."""
    contact = values(pairs, "contact_log_std")
    return np.stack([*_lognormal_gap(pairs), log_std, velocity_factor, *_received(pairs), contact])


class _OfNodes(NamedTuple):
    """What the nodes show of pairs, with pairs on the last axis."""

    #: In the rows of the kernel, (OUTCOME_ROWS, n_pairs).
    outcome: FloatArray
    #: Share of the nodes that move, (1, n_pairs).
    moving: FloatArray
    #: Quantiles of the demands at the nodes, m, and the chances that a demand exceeds them,
    #: (n_shares, n_pairs).
    gaps: FloatArray
    chances: FloatArray


def _of_nodes(motion: FloatArray, facts: FloatArray, nodes: FloatArray) -> _OfNodes:
    """Compute what the nodes show of a motion (5, n_pairs, n_nodes), in the rows of kernels."""
    demand, log_std = motion[0], facts[DEMAND_STD]
    deviates = np.ascontiguousarray(nodes[:, [DEMAND, GAP, CONTACT]].T)
    # one node of certain buildings is all nodes
    every = np.broadcast_to(motion, (*motion.shape[:2], len(nodes)))
    # always writable: a read-only array would compile the kernel a second time
    every = np.require(every, requirements=["C", "W"])
    outcome = np.empty((OUTCOME_ROWS, log_std.size))
    fill_outcomes(every, facts, deviates, outcome)
    moving = (demand > 0.0).mean(axis=1)[None]
    return _OfNodes(outcome, moving, *_gaps_and_chances(demand, log_std, nodes))


def _columns(found: _OfNodes, pairs: Table) -> Columns:
    """Return ``COLUMNS``."""
    # the lognormal gap has no share of exactly 0, at which any motion is contact
    chance = np.maximum(found.outcome[0], one_wall_chance(pairs) * found.moving[0])
    quantiles = _moved_to_shares(found.gaps, found.chances)
    return dict(zip(COLUMNS, [chance, *found.outcome[1:], *quantiles], strict=True))


def demand_quantiles(demands: FloatArray, log_std: FloatArray, nodes: FloatArray) -> FloatArray:
    """
    Return the gaps, m, that the shares of ``DEMAND_SHARES`` of a population do not exceed.

    Arguments are those of :func:`chance_of_contact`, and the nodes of the demands; the result is
    (n_shares, n_pairs).
    """
    return _moved_to_shares(*_gaps_and_chances(demands, log_std, nodes))


#: Shares of the quantiles of a demand.
_SHARES = np.array([*DEMAND_SHARES.values()])


def _gaps_and_chances(demands: FloatArray, log_std: FloatArray, nodes: FloatArray) -> Both:
    """Return quantiles of the demands at nodes, m, and the chances that a demand exceeds them."""
    outcomes = demands * np.exp(np.outer(log_std, nodes[:, DEMAND]))
    gaps = np.maximum(_sorted_quantiles(outcomes, _SHARES), SMALLEST_QUANTILE)
    chances = np.empty(gaps.shape)
    fill_chances(np.ascontiguousarray(demands), gaps, log_std, chances)
    return gaps, chances


def _moved_to_shares(gaps: FloatArray, chances: FloatArray) -> FloatArray:
    """Return gaps, moved to where the chance of contact is the wanted one: nodes are few."""
    score = -ndtri(np.clip(chances, 1e-9, 1.0 - 1e-9))
    wanted = np.broadcast_to(ndtri(_SHARES)[:, None], gaps.shape)
    moved = np.array([at_rows(score, np.log(gaps), one) for one in wanted])
    return np.maximum(np.exp(np.maximum.accumulate(moved)), SMALLEST_QUANTILE)


def _sorted_quantiles(outcomes: FloatArray, shares: FloatArray) -> FloatArray:
    """Return quantiles of the outcomes of each pair by Hazen's rule, (n_shares, n_pairs)."""
    # One sort, which is vectorized, serves all shares
    ordered = np.sort(outcomes, axis=1).T
    position = np.clip(shares * len(ordered) - 0.5, 0.0, len(ordered) - 1.0)
    lower = position.astype(np.int64)
    upper = np.minimum(lower + 1, len(ordered) - 1)
    share = (position - lower)[:, None]
    return ordered[lower] + share * (ordered[upper] - ordered[lower])


def at_rows(x: FloatArray, y: FloatArray, at: FloatArray) -> FloatArray:
    """Interpolate ``y``, (n_points, n_pairs), at one ``at`` a pair, linear also beyond the ends."""
    # Equal values of x, which rises, are a step
    x = x + 1e-9 * np.arange(len(x))[:, None]
    lower = np.clip((x <= at).sum(axis=0) - 1, 0, len(x) - 2)
    pair = np.arange(at.size)
    first, last = x[lower, pair], x[lower + 1, pair]
    share = (at - first) / np.maximum(last - first, 1e-9)
    value: FloatArray = y[lower, pair] + share * (y[lower + 1, pair] - y[lower, pair])
    return value


def chance_of_contact(demands: FloatArray, log_std: FloatArray, table: Table) -> FloatArray:
    """
    Return the mean over the nodes of the chance that a demand exceeds an uncertain gap.

    ``demands`` are medians, (n_pairs, n_nodes), m; ``log_std`` is the log-standard deviation of all
    demands of a pair.
    """
    chances = np.empty(log_std.size)
    median, dispersion = _lognormal_gap(table)
    deviation = np.hypot(dispersion, log_std)
    fill_chances(np.ascontiguousarray(demands), median[None], deviation, chances[None])
    return chances


def _received(pairs: Table) -> Both:
    """Return the change of velocity of both buildings over the impact velocity."""
    mass_1, mass_2 = both(pairs, "contact_mass")
    share = (1.0 + values(pairs, "restitution")) / (mass_1 + mass_2)
    return share * mass_2, share * mass_1


#: Pairs times nodes that are computed together: every array stays below 256 kB.
SAMPLES = 32_768


class UncertainRadius(NamedTuple):
    """
    Radius of one building of every pair under an uncertain motion, each (n_pairs,).

    Attributes
    ----------
    radius : ndarray
        Median at contact height, of which the critical gap is right in the median, m.
    ln_ratio : ndarray
        Logarithm of the radius at the site over ``radius``.
    period, damping : ndarray
        Medians of the oscillator that has this radius, s and fraction of critical.
    """

    radius: FloatArray
    ln_ratio: FloatArray
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
        Of both responses at the medians, dimensionless; where it is not that of eq. (16), that of
        the nodes differs from theirs by as much.
    log_std : ndarray
        Log-standard deviation of the critical gap for given buildings: by the motion, and of the
        estimate over the exact demand.
    row : ndarray of int
        Of the spectra by which the radii change.
    """

    first: UncertainRadius
    second: UncertainRadius
    correlation: FloatArray
    log_std: FloatArray
    row: IndexArray

    def rows(self, chosen_rows: NDArray[np.generic]) -> "UncertainMotion":
        """Return the motion of some pairs, by their numbers or a mask."""
        return UncertainMotion(
            UncertainRadius(*(column[chosen_rows] for column in self.first)),
            UncertainRadius(*(column[chosen_rows] for column in self.second)),
            self.correlation[chosen_rows],
            self.log_std[chosen_rows],
            self.row[chosen_rows],
        )


def estimated_population(motion: UncertainMotion, spectra: LogSpectra, pairs: Table) -> Columns:
    """
    Compute the population of completed pairs under an uncertain motion: ``COLUMNS``.

    ``spectra`` are those by which the radii of resampled oscillators change; at the edge beyond the
    grid.
    """
    result = empty_population(motion.row.size)
    if not motion.row.size:
        return result
    # all that a few calls make of all pairs
    facts = _facts(pairs, motion.log_std, np.ones(motion.row.size))
    columns = (*_estimates(motion, spectra, pairs), facts)
    size, blocks = SAMPLES // len(NODES), list[_OfNodes]()
    # blocks bound the memory; a pair does not depend on its block
    for first in range(0, motion.row.size, size):
        some = slice(first, first + size)
        buildings, alike, known = (np.ascontiguousarray(rows[:, some]) for rows in columns)
        moved = _at_nodes(spectra, motion.row[some], buildings, alike, NODES)
        blocks.append(_of_nodes(moved, known, NODES))
    found = _OfNodes(*(np.concatenate(rows, axis=1) for rows in zip(*blocks, strict=True)))
    for name, column in _columns(found, pairs).items():
        result[name][:] = column
    return result


def estimated_motion(
    motion: UncertainMotion, spectra: LogSpectra, pairs: Table, nodes: FloatArray
) -> RelativeMotion:
    """Estimate the motion of pairs without contact at nodes (n_nodes, 6) of their buildings."""
    moved = _at_nodes(spectra, motion.row, *_estimates(motion, spectra, pairs), nodes)
    return RelativeMotion(*moved)


def _estimates(motion: UncertainMotion, spectra: LogSpectra, pairs: Table) -> Both:
    """Return both buildings and the correlations of pairs in the rows of the kernel."""
    first = _oscillators(motion.first, motion.row, spectra, pairs, 1)
    second = _oscillators(motion.second, motion.row, spectra, pairs, 2)
    # eq. (16), shifted as that which governs at the medians
    shift = motion.correlation - ddc_correlation(
        *(motion.first.period, motion.first.damping),
        *(motion.second.period, motion.second.damping),
    )
    correlations = np.stack([np.atleast_1d(shift), values(pairs, "period_correlation")])
    return np.stack([*first, *second]), correlations


def _at_nodes(
    spectra: LogSpectra,
    row: IndexArray,
    buildings: FloatArray,
    correlations: FloatArray,
    nodes: FloatArray,
) -> FloatArray:
    """Return the motion of pairs at nodes, (MOTION_ROWS, n_pairs, n_nodes)."""
    relative = np.empty((MOTION_ROWS, row.size, len(nodes)))
    deviates = np.ascontiguousarray(nodes[:, BUILDINGS].T)
    estimate_motion(*spectra, row, buildings, correlations, deviates, relative)
    return relative


def _oscillators(
    building: UncertainRadius, row: IndexArray, spectra: LogSpectra, pairs: Table, i: int
) -> tuple[FloatArray, ...]:
    """Return the oscillators of building i in the rows of the kernel."""
    # the radius changes as the stored spectrum does from the medians to the node
    at_medians = log_period_and_damping(building.period, building.damping)
    where_stored_is_one = building.radius * np.exp(
        building.ln_ratio - stored_log(spectra, row, *at_medians)
    )
    return (
        *(building.period, values(pairs, f"period_log_std_{i}")),
        *(building.damping, values(pairs, f"damping_log_std_{i}")),
        *(np.maximum(building.damping, LARGEST_DAMPING), where_stored_is_one),
    )
