"""
Outcome of pairs over their nodes: chance of contact, impact velocity and amplification.

The formulas and their constants are explained in ``screening/population.py``. The nodes of a pair
share one row, so that loops without branches over them become vectors.
"""

import math

import numpy as np

from per_obspy.kernels._jit import kernel
from per_obspy.kernels.pairs.node_motion import CORRELATION, DEMAND, SPEED_1, SPEED_2, VELOCITY
from per_obspy.kernels.vector_functions import (
    FARTHEST_NORMAL,
    exponentials,
    logarithms,
    normal_tails,
)

#: Loss of impact velocity by earlier impacts, per root of the correlation, and where the
#: correlation is neither 0 nor 1, per their product.
LOSS, LOSS_BETWEEN = 1.02, 0.53
#: Share of the change of velocity that a strong impact adds to the radius, and growth of the radius
#: per root of a weak change.
RADIUS_SHARE, WEAK_SHARE = 0.76, 0.145
#: Share of the population that the quantile of the impact velocity is not below.
QUANTILE = 0.84
#: Demand / largest demand of the pair's nodes below which its logarithm does not count in the
#: spread of the nodes, and the smallest demand that does.
NEGLIGIBLE, TINY = 1e-3, float(np.finfo(np.float64).tiny)
#: Interquartile range over standard deviation of a normal variable.
NORMAL_QUARTILES = 1.349
#: Rows of what is known of a pair besides its motion: median gap (m), log-standard deviation of the
#: gap and of the demand, factor of impact velocities, change of velocity of building 1 and of
#: building 2 over the impact velocity, log-standard deviation of impact velocities by the contact.
GAP, GAP_STD, DEMAND_STD, FACTOR, RECEIVED_1, RECEIVED_2, CONTACT_STD, FACT_ROWS = range(8)
#: Rows of the outcome: probability, expected impact velocity (m/s) and its quantile, expected
#: amplification.
OUTCOME_ROWS = 4


@kernel
def fill_outcomes(motion, facts, deviates, out):
    """
    Fill the outcome of pairs.

    Parameters
    ----------
    motion : (MOTION_ROWS, n_pairs, n_nodes) ndarray
        See ``node_motion.py``.
    facts : (FACT_ROWS, n_pairs) ndarray
        See ``GAP`` and the following constants.
    deviates : (3, n_nodes) ndarray
        Standard normal: ln demand, ln gap, ln velocity by the contact.
    out : (OUTCOME_ROWS, n_pairs) ndarray
        Receives the outcome.
    """
    count = deviates.shape[1]
    # scale of the demand, gap, velocity, scratch
    work = np.empty((4, count))
    integers = np.empty(count, np.int64)
    for pair in range(facts.shape[1]):
        pair_motion, fact = motion[:, pair], facts[:, pair]
        deviation = math.hypot(fact[GAP_STD], fact[DEMAND_STD])
        dispersion = _dispersion(pair_motion[DEMAND], deviation, work, integers)
        out[0, pair] = _chance(pair_motion[DEMAND], fact[GAP], dispersion, work, integers)
        # Scales of the demand, and gaps
        for node in range(count):
            work[0, node] = fact[DEMAND_STD] * deviates[0, node]
            work[1, node] = fact[GAP_STD] * deviates[1, node]
        exponentials(work[0], integers)
        exponentials(work[1], integers)
        for node in range(count):
            work[1, node] *= fact[GAP]
        _velocities(pair_motion, work, integers)
        # Means over the nodes, which the contact does not change
        velocity, amplified = 0.0, 0.0
        for node in range(count):
            work[2, node] *= fact[FACTOR]
            velocity += work[2, node]
            amplified += _amplification(pair_motion, work, node, fact)
            work[3, node] = fact[CONTACT_STD] * (deviates[2, node] - 0.5 * fact[CONTACT_STD])
        out[1, pair] = velocity / count
        # Quantile, with a factor of the contact whose mean is 1
        exponentials(work[3], integers)
        for node in range(count):
            work[2, node] *= work[3, node]
        out[2, pair] = _quantile(work[2], QUANTILE)
        out[3, pair] = amplified / count


@kernel
def fill_velocities(motion, scales, gaps, out):
    """
    Fill the largest approach velocities of impacts, m/s; 0 where the gap is wide enough.

    ``motion`` (MOTION_ROWS, n_pairs, n_nodes); ``scales``, ``gaps`` and ``out`` (n_pairs, n_nodes).
    """
    work = np.empty((4, gaps.shape[1]))
    integers = np.empty(gaps.shape[1], np.int64)
    for pair in range(gaps.shape[0]):
        # Pair by pair, as the velocities of outcomes
        for node in range(gaps.shape[1]):
            work[0, node], work[1, node] = scales[pair, node], gaps[pair, node]
        _velocities(motion[:, pair], work, integers)
        for node in range(gaps.shape[1]):
            out[pair, node] = work[2, node]


@kernel
def _velocities(motion, work, integers):
    """Fill the impact velocities of a pair, ``work[2]``, from scales and gaps before them."""
    for node in range(work.shape[1]):
        # share of the way that the gap leaves free; 1 without contact
        demand = work[0, node] * motion[DEMAND, node]
        gap = work[1, node]
        share = gap / demand if demand > gap else 1.0
        work[2, node] = work[0, node] * motion[VELOCITY, node] * math.sqrt(1.0 - share * share)
        # earlier impacts of nearly equal oscillators
        alike = max(motion[CORRELATION, node], 0.0)
        loss = LOSS * math.sqrt(alike) + LOSS_BETWEEN * alike * (1.0 - alike)
        work[3, node] = -loss * (1.0 - share)
    exponentials(work[3], integers)
    for node in range(work.shape[1]):
        work[2, node] *= work[3, node]


@kernel
def _amplification(motion, work, node, fact):
    """Return the larger ratio of both radii with and without impact, at least 1."""
    velocity = work[2, node] / work[0, node]
    speed_1, speed_2 = motion[SPEED_1, node], motion[SPEED_2, node]
    # Changes of velocity over the speeds of the oscillators
    change_1 = fact[RECEIVED_1] * velocity / speed_1 if speed_1 > 0.0 else 0.0
    change_2 = fact[RECEIVED_2] * velocity / speed_2 if speed_2 > 0.0 else 0.0
    largest = max(change_1, change_2)
    strong = (RADIUS_SHARE * largest) ** 2
    return math.sqrt(math.sqrt(1.0 + strong * strong)) + WEAK_SHARE * math.sqrt(largest)


@kernel
def fill_chances(demands, gaps, deviations, out):
    """
    Fill the mean over the nodes of the chance that a lognormal demand exceeds lognormal gaps.

    Parameters
    ----------
    demands : (n_pairs, n_nodes) ndarray
        Medians, m.
    gaps : (n_gaps, n_pairs) ndarray
        Medians of one or several gaps of each pair, m.
    deviations : (n_pairs,) ndarray
        Log-standard deviations of demand over gap.
    out : (n_gaps, n_pairs) ndarray
        Receives the chances, from 0 to 1.
    """
    work = np.empty((3, demands.shape[1]))
    integers = np.empty(demands.shape[1], np.int64)
    for pair in range(gaps.shape[1]):
        # Logarithms and spread of the nodes serve all gaps
        dispersion = _dispersion(demands[pair], deviations[pair], work, integers)
        for gap in range(gaps.shape[0]):
            out[gap, pair] = _chance(demands[pair], gaps[gap, pair], dispersion, work, integers)


@kernel
def _dispersion(demands, deviation, work, integers):
    """Return the log-standard deviation of a node over a gap, and fill the nodes' logarithms."""
    largest = 0.0
    for node in range(demands.size):
        largest = max(largest, demands[node])
    # nodes are smoothed as far as no other value is uncertain
    smoothing = _smoothing(demands, largest, deviation, work[0], work[1], integers)
    for node in range(demands.size):
        work[0, node] = demands[node] if demands[node] > 0.0 else TINY
    logarithms(work[0], integers)
    return 0.0 if largest <= 0.0 else max(deviation, smoothing)


@kernel
def _chance(demands, gap, dispersion, work, integers):
    """Return the chance of contact of a pair, after :func:`_dispersion`."""
    if gap <= 0.0 or dispersion <= 0.0:
        above = 0
        for node in range(demands.size):
            above += demands[node] > gap
        return above / demands.size
    # Tails of the normal distribution at the logarithms of gap over demand
    middle = math.log(gap)
    for node in range(demands.size):
        margin = (middle - work[0, node]) / dispersion
        work[1, node] = min(max(margin, -FARTHEST_NORMAL), FARTHEST_NORMAL)
    normal_tails(work[1], work[2], integers)
    total = 0.0
    for node in range(demands.size):
        total += work[1, node] if demands[node] > 0.0 else 0.0
    return total / demands.size


@kernel
def _smoothing(demands, largest, deviation, logs, sorted_logs, integers):
    """
    Return the log-standard deviation of a node: of all nodes over the root of their number.

    It may be larger than that if it is below ``deviation`` anyway.
    """
    count = demands.size
    floor = max(NEGLIGIBLE * largest, TINY)
    for node in range(count):
        logs[node] = max(demands[node], floor)
    logarithms(logs, integers)
    # Standard deviation of the logarithms
    total = square = 0.0
    for node in range(count):
        total += logs[node]
    mean = total / count
    for node in range(count):
        square += (logs[node] - mean) ** 2
    spread = math.sqrt(square / count)
    if spread > deviation * math.sqrt(count):
        # the smaller of two measures of spread: few nodes far off do not count
        for node in range(count):
            sorted_logs[node] = logs[node]
        lower = _quantile(sorted_logs, 0.25)
        upper = _quantile(sorted_logs, 0.75)
        spread = min(spread, (upper - lower) / NORMAL_QUARTILES)
    return spread / math.sqrt(count)


@kernel
def _quantile(values, share):
    """Return a quantile, linear between the two nearest values; their order is changed."""
    position = share * (values.size - 1)
    below = int(position)
    _select(values, below)
    low = values[below]
    if position == below:
        return low
    # the next larger one
    high = math.inf
    for index in range(below + 1, values.size):
        high = min(high, values[index])
    return low + (position - below) * (high - low)


@kernel
def _select(values, rank):
    """Arrange values so that that of a rank is in its place, smaller ones before it."""
    first, last = 0, values.size - 1
    while first < last:
        # Smaller ones to the left of the pivot, larger ones to its right
        pivot = values[(first + last) // 2]
        left, right = first, last
        while left <= right:
            while values[left] < pivot:
                left += 1
            while values[right] > pivot:
                right -= 1
            if left <= right:
                values[left], values[right] = values[right], values[left]
                left += 1
                right -= 1
        if rank <= right:
            last = right
        elif rank >= left:
            first = left
        else:
            return
