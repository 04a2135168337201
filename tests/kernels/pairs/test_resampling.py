"""Probability over resampled buildings, the kernel alone; it also runs uncompiled."""

import numpy as np
import pytest
from scipy.interpolate import RegularGridInterpolator
from scipy.stats import norm

from per_obspy.kernels.pairs.resampling import resampled_probabilities, white_noise_correlation

RANDOM = np.random.default_rng(12)
PERIODS, DAMPINGS = np.log([0.1, 0.25, 0.3, 1.0, 3.0]), np.log([0.02, 0.05, 0.2])
STORED = RANDOM.normal(size=(2, 3, 5))
NODES = RANDOM.normal(size=(7, 4))
#: Azimuth; period, damping, their dispersions, radius of 1 and of 2; gap, dispersion. Nodes reach
#: beyond the grid.
BUILDING_1 = (np.log(0.4), np.log(0.05), 0.9, 0.5, -1.0)
BUILDING_2 = (np.log(1.5), np.log(0.04), 0.8, 0.6, -1.3)
PAIR = np.array([1, *BUILDING_1, *BUILDING_2, 0.2, 0.3])


def chance(*rows, grid=(PERIODS, DAMPINGS, STORED), nodes=NODES):
    probability = np.empty(len(rows))
    resampled_probabilities(grid, np.array(rows), nodes, probability)
    return probability


def changed(**values):
    pair = PAIR.copy()
    for column, value in values.items():
        pair[int(column[1:])] = value
    return pair


def expected(pair, periods=PERIODS, dampings=DAMPINGS, stored=STORED):
    """The mean by SciPy's interpolation and normal distribution and equation (16) as printed."""
    table = RegularGridInterpolator((dampings, periods), stored[int(pair[0])])

    def stored_at(period, damping):
        inside = np.clip(damping, *dampings[[0, -1]]), np.clip(period, *periods[[0, -1]])
        return table(np.stack(inside, -1))

    radii, oscillators = [], []
    for body, (by_period, by_damping) in enumerate((NODES.T[:2], NODES.T[2:])):
        own = pair[1 + 5 * body : 6 + 5 * body]
        period, damping = own[0] + by_period * own[2], own[1] + by_damping * own[3]
        radii.append(np.exp(own[4] + stored_at(period, damping) - stored_at(own[0], own[1])))
        oscillators.append((np.exp(period), np.exp(damping)))
    (t1, x1), (t2, x2) = oscillators
    ratio = t2 / t1
    above = 8 * np.sqrt(x1 * x2) * (x2 + x1 * ratio) * ratio**1.5
    rho = above / (
        (1 - ratio**2) ** 2 + 4 * x1 * x2 * ratio * (1 + ratio**2) + 4 * (x1**2 + x2**2) * ratio**2
    )
    demand = np.sqrt(radii[0] ** 2 + radii[1] ** 2 - 2 * rho * radii[0] * radii[1])
    return norm.cdf(np.log(demand / pair[11]) / pair[12]).mean()


def test_against_scipy():
    # mutation: buildings or dimensions of the nodes exchanged, radii not taken from the median, the
    # grid's edges passed
    for pair in (
        PAIR,
        changed(p0=0),
        changed(p6=np.log(0.4)),
        changed(p5=3.0),
        changed(p1=np.log(0.25), p3=0.0),
    ):
        assert chance(pair)[0] == pytest.approx(expected(pair), rel=1e-12)


@pytest.mark.parametrize("axis", [0, 1])
def test_a_grid_of_one_point_is_the_same_everywhere(axis):
    # mutation: a neighbour that does not exist
    grid = [PERIODS, DAMPINGS, STORED]
    twice = [PERIODS, DAMPINGS, STORED]
    grid[axis], twice[axis] = grid[axis][:1], np.array([-5.0, 5.0])
    point = STORED[..., :1] if axis == 0 else STORED[:, :1]
    grid[2] = np.ascontiguousarray(point)
    twice[2] = np.ascontiguousarray(np.repeat(point, 2, axis=2 - axis))
    assert chance(PAIR, grid=tuple(grid))[0] == pytest.approx(expected(PAIR, *twice), rel=1e-12)


def test_certain_pairs():
    # mutation: a logarithm of zero, a division by no dispersion
    twins = changed(
        p6=PAIR[1], p7=PAIR[2], p10=PAIR[5], **dict.fromkeys(("p3", "p4", "p8", "p9"), 0.0)
    )
    assert np.all(chance(twins, changed(p5=-2000.0, p10=-2000.0)) < 1e-298)
    assert chance(changed(p11=0.0), changed(p11=0.0, p12=0.0)).tolist() == [1.0, 1.0]
    sharp = chance(changed(p12=0.0))[0] * len(NODES)
    assert sharp == pytest.approx(round(sharp), abs=1e-12)
    assert chance(changed(p12=1e-9))[0] * len(NODES) == pytest.approx(sharp, abs=1e-12)


def test_pairs_do_not_depend_on_each_other():
    pairs = [PAIR, changed(p0=0), changed(p11=0.1), changed(p1=-1.0)]
    assert chance(*pairs).tolist() == [chance(pair)[0] for pair in pairs]


def test_correlation_of_white_noise():
    # mutation: damping attached to the other building. Undamped and in step: 0 / 0 counts as one
    assert white_noise_correlation(0.0, 0.05, 0.05) == pytest.approx(1.0, abs=1e-15)
    assert white_noise_correlation(0.0, 0.0, 0.0) == 1.0
    assert white_noise_correlation(0.3, 0.02, 0.1) == pytest.approx(
        white_noise_correlation(-0.3, 0.1, 0.02), rel=1e-14
    )
    assert white_noise_correlation(0.3, 0.02, 0.1) != pytest.approx(
        white_noise_correlation(0.3, 0.1, 0.02), rel=1e-3
    )
