"""
Probability that a lognormal critical gap exceeds a gap: one integral over the logarithm of the ratio of two radii.

Given the ratio, the critical gap is lognormal; its logarithm has a narrow dip where the radii agree and their
correlation is near 1. Panels are even over the normal distribution of the ratio and ever finer towards the dip; each is
halved until both halves agree with the whole.
"""

import math

import numpy as np

from per_obspy.kernels._jit import kernel

NODES, WEIGHTS = np.polynomial.legendre.leggauss(8)
REACH = 9.0  # standard deviations: what lies beyond has a probability of 1e-19
TOLERANCE = 1e-13  # of a panel
FINEST = 1e-11  # standard deviations: panels are not halved below
DIP = 20  # panels on each side of the dip, each a quarter of the next
PANELS = 36  # even panels
STEEP = 16  # times as many where little dispersion is left for a given ratio


@kernel
def probabilities(parameters, out):
    """
    Fill ``out`` (n).

    ``parameters`` (6, n): mean and standard deviation of ln(r2/r1); mean of ln(r1/gap) at that mean and its slope over
    ln(r2/r1); standard deviation that remains for a given ratio; correlation.
    """
    edges = np.empty(PANELS * STEEP + 2 * DIP + 2)
    stack = np.empty((80, 3))
    for index in range(out.size):
        count = _edges(parameters[:, index], edges)
        total = 0.0
        for place in range(count - 1):
            total += _panel(parameters[:, index], edges[place], edges[place + 1], stack)
        out[index] = min(max(total, 0.0), 1.0)


@kernel
def _edges(p, edges):
    """Fill the sorted edges of the panels, in standard deviations of the ratio; return their number."""
    panels = PANELS if p[4] > 0.1 * p[1] else PANELS * STEEP
    count = panels + 1
    for place in range(count):
        edges[place] = REACH * (2.0 * place / panels - 1.0)
    if p[5] > 0.0:
        dip = (math.log(p[5]) - p[0]) / p[1]
        distance = REACH
        for place in range(2 * DIP + 1):
            side = distance if place % 2 else -distance
            edge = dip if place == 2 * DIP else dip + side
            if place % 2:
                distance *= 0.25
            if -REACH < edge < REACH:
                edges[count] = edge
                count += 1
    edges[:count].sort()
    return count


@kernel
def _panel(p, low, high, stack):
    """Return the integral over a panel, halved where the halves disagree with the whole."""
    stack[0, 0], stack[0, 1], stack[0, 2] = low, high, _gauss(p, low, high)
    size, total = 1, 0.0
    while size:
        size -= 1
        low, high, whole = stack[size, 0], stack[size, 1], stack[size, 2]
        middle = 0.5 * (low + high)
        left, right = _gauss(p, low, middle), _gauss(p, middle, high)
        if abs(left + right - whole) <= TOLERANCE or high - low < FINEST:
            total += left + right
        else:
            stack[size, 0], stack[size, 1], stack[size, 2] = low, middle, left
            stack[size + 1, 0], stack[size + 1, 1], stack[size + 1, 2] = middle, high, right
            size += 2
    return total


@kernel
def _gauss(p, low, high):
    """Return the integral over a panel by eight points."""
    total = 0.0
    for place in range(NODES.size):
        total += WEIGHTS[place] * _integrand(p, 0.5 * (low + high) + 0.5 * (high - low) * NODES[place])
    return 0.5 * (high - low) * total


@kernel
def _integrand(p, x):
    """Return the normal density of the ratio times the probability that the gap closes at it."""
    ratio = p[0] + p[1] * x
    # ln sqrt(1 + e^2d - 2 rho e^d) as (1 - e^d)² + 2 (1 - rho) e^d, which does not cancel
    grown = math.exp(ratio)
    square = math.expm1(ratio) ** 2 + 2.0 * (1.0 - p[5]) * grown
    if square == 0.0:
        return 0.0
    margin = p[2] + p[3] * p[1] * x + 0.5 * math.log(square)
    density = math.exp(-0.5 * x * x) / math.sqrt(2.0 * math.pi)
    if p[4] == 0.0:
        return density if margin > 0.0 else 0.0
    return density * 0.5 * math.erfc(-margin / (p[4] * math.sqrt(2.0)))
