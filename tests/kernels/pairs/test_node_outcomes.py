"""Outcome of nodes against its definition in NumPy: chance, impact velocity, amplification."""

import numpy as np
import pytest
from numpy.testing import assert_allclose
from scipy.special import ndtr

from per_obspy.kernels.pairs.node_outcomes import (
    LOSS,
    LOSS_BETWEEN,
    QUANTILE,
    RADIUS_SHARE,
    WEAK_SHARE,
    fill_chances,
    fill_outcomes,
)

RANDOM = np.random.default_rng(9)
PAIRS = 8


def _motion(nodes):
    """Return the motion of pairs; one of them does not move at some nodes, one at none."""
    motion = np.exp(RANDOM.normal(-2.0, 0.6, (5, PAIRS, nodes)))
    motion[4] = RANDOM.uniform(-0.2, 1.0, (PAIRS, nodes))
    motion[:4, 6, ::3], motion[:4, 7] = 0.0, 0.0
    return motion


def _facts():
    """Return gap, both deviations, factor and received velocities, of touching pairs too."""
    gap = np.array([0.0, 0.1, 0.1, 0.3, 0.05, 0.1, 0.1, 0.1])
    gap_std = np.array([0.0, 0.0, 0.2, 0.0, 0.1, 0.0, 0.0, 0.0])
    demand_std = np.array([0.3, 0.0, 0.0, 0.4, 0.1, 0.01, 0.0, 0.2])
    factor, received = RANDOM.uniform(0.5, 2.0, PAIRS), RANDOM.uniform(0.1, 1.6, (2, PAIRS))
    contact_std = np.array([0.0, 0.1, 0.0, 0.2, 0.0, 0.0, 0.1, 0.1])
    return np.stack([gap, gap_std, demand_std, factor, *received, contact_std])


def _chance(demands, gap, known):
    """Return the mean chance, the nodes smoothed by their spread over the root of their number."""
    largest = demands.max(axis=1, keepdims=True)
    tiny = np.finfo(np.float64).tiny
    logs = np.log(np.maximum(demands, np.maximum(1e-3 * largest, tiny)))
    lower, upper = np.quantile(logs, (0.25, 0.75), axis=1)
    spread = np.minimum(logs.std(axis=1), (upper - lower) / 1.349)
    dispersion = np.maximum(known, spread / np.sqrt(demands.shape[1]))[:, None]
    moving = (demands > 0.0) & (gap[:, None] > 0.0) & (dispersion > 0.0)
    with np.errstate(divide="ignore", invalid="ignore"):
        chance = ndtr(np.log(demands / gap[:, None]) / dispersion)
    return np.where(moving, chance, demands > gap[:, None]).mean(axis=1)


def _grown(change):
    """Return the amplification by a change of velocity over the speed of an oscillator."""
    return (1.0 + (RADIUS_SHARE * change) ** 4) ** 0.25 + WEAK_SHARE * np.sqrt(change)


def _definition(motion, facts, deviates):
    demand, velocity, speed_1, speed_2, correlation = motion
    median_gap, gap_std, demand_std, factor, received_1, received_2, contact = facts[:, :, None]
    gap, scale = median_gap * np.exp(gap_std * deviates[1]), np.exp(demand_std * deviates[0])
    moving = scale * demand > gap
    share = np.divide(gap, scale * demand, out=np.ones(moving.shape), where=moving)
    alike = np.maximum(correlation, 0.0)
    loss = LOSS * np.sqrt(alike) + LOSS_BETWEEN * alike * (1.0 - alike)
    loss = np.exp(-loss * (1.0 - share))
    impact = factor * scale * velocity * np.sqrt(1.0 - share**2) * loss
    # a lognormal factor of mean 1, which the means do not need
    by_contact = impact * np.exp(contact * deviates[2] - contact**2 / 2.0)
    changes = [
        np.divide(
            received * impact / scale,
            speed,
            out=0.0 * impact,
            where=speed > 0.0,
        )
        for received, speed in ((received_1, speed_1), (received_2, speed_2))
    ]
    return np.stack(
        [
            _chance(demand, facts[0], np.hypot(facts[1], facts[2])),
            impact.mean(axis=1),
            np.quantile(by_contact, QUANTILE, axis=1),
            _grown(np.maximum(*changes)).mean(axis=1),
        ]
    )


@pytest.mark.parametrize("nodes", [1, 2, 16, 128])
def test_against_the_definition(nodes):
    # mutations: nodes of gap and demand exchanged, the factor left out, the quantile of another
    # rank, the larger of both spreads, chance of nodes that do not move
    motion, facts, deviates = _motion(nodes), _facts(), RANDOM.normal(size=(3, nodes))
    found = np.empty((4, PAIRS))
    fill_outcomes(motion, facts, deviates, found)
    # the polynomial of the normal tail is exact to 1e-14
    assert_allclose(found, _definition(motion, facts, deviates), rtol=1e-12, atol=1e-14)
    # of several gaps of each pair at once
    chances, gaps = np.empty((2, PAIRS)), np.stack([facts[0], facts[0] + 1e3])
    fill_chances(motion[0], gaps, np.hypot(facts[1], facts[2]), chances)
    assert_allclose(chances[0], found[0], rtol=1e-15)
    assert (chances[1] <= chances[0]).all()


def _amplification(motion, received):
    """Return the amplification of one touching pair at one node."""
    facts = np.array([0.0, 0.0, 0.0, 1.0, *received, 0.0])[:, None]
    found = np.empty((4, 1))
    fill_outcomes(np.reshape(motion, (5, 1, 1)), facts, np.zeros((3, 1)), found)
    return found[3, 0]


def test_both_buildings_are_symmetric_and_the_lighter_one_is_amplified():
    motion, turned = (0.2, 0.4, 0.6, 0.5, 0.0), (0.2, 0.4, 0.5, 0.6, 0.0)
    assert _amplification(motion, (1.2, 0.4)) == _amplification(turned, (0.4, 1.2)) > 1.0
    # equal changes: the slower building
    expected = _grown(1.2 * 0.4 / 0.5)
    assert_allclose(_amplification(motion, (1.2, 1.2)), expected, rtol=1e-12)


def test_two_buildings_that_move_as_one_are_not_amplified():
    assert _amplification((0.0, 0.0, 0.6, 0.5, 1.0), (1.0, 1.0)) == 1.0
