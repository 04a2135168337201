"""
Probability that a lognormal critical gap exceeds a gap, exact for lognormal radii.

It is one integral over ``d``, the logarithm of the ratio of the two radii. Given d, the critical
gap is lognormal; its logarithm has a narrow dip where the radii agree and their correlation is near
1. Panels are even over the normal distribution of d and ever finer towards the dip, and where
little dispersion remains for a given ratio they end where the gap just closes; each is halved until
both halves agree with the whole. The nodes of many panels share one row: loops without branches
over them become vectors.
"""

import math

import numpy as np

from per_obspy.kernels._jit import kernel
from per_obspy.kernels.vector_functions import (
    FARTHEST_NORMAL,
    exponentials,
    exponentials_less_one,
    logarithms,
    normal_tails,
)

#: Nodes and weights of a half panel (Gauss-Legendre).
GAUSS_NODES, GAUSS_WEIGHTS = np.polynomial.legendre.leggauss(8)
#: Standard deviations of d on either side of its mean: beyond lies a probability of 1e-19.
INTEGRATION_LIMIT = 9.0
#: Difference between both halves of a panel and the whole, and standard deviations below which
#: panels are not halved.
PANEL_TOLERANCE, FINEST = 1e-13, 1e-11
#: Panels on each side of the dip at most, each a quarter of the next; the finest of them, of the
#: width of the dip.
DIP, SHARE_OF_DIP = 20, 0.1
#: Even panels, before both halves; so many times more where little dispersion remains for a given
#: ratio.
PANELS, STEEP = 18, 8
#: Ratios at most at which the gap just closes.
CROSSINGS = 8
#: Bisections of an interval of INTEGRATION_LIMIT / PANELS: to rounding.
BISECTIONS = 60
#: Standard deviations over which the slope of the margin is taken.
NEARBY = 1e-6
#: Standard deviations of the margin at which a chance is 0 or 1.
CERTAIN = 9.0
#: Panels halved at a time.
BATCH = 16
#: Edges at most, and panels at a time at most: all at the beginning, and those of a batch for every
#: halving from 2 INTEGRATION_LIMIT / PANELS to FINEST.
EDGES = PANELS * STEEP + 2 * DIP + 2 + 3 * CROSSINGS
MOST_PANELS = EDGES + 40 * BATCH
#: Rows of work: standardised d, density, the square of the critical gap over that of radius 1,
#: chance, and scratch.
ROWS = 5
#: Instead of zero, where a logarithm is taken.
SMALLEST = 1e-300


@kernel
def probabilities(parameters, out):
    """
    Fill the probability of each pair that its critical gap exceeds its gap.

    Parameters
    ----------
    parameters : (6, n) ndarray
        Rows, dimensionless: mean and standard deviation of ``ln(r2/r1)``; mean of ``ln(r1/gap)`` at
        that mean and its slope over ``ln(r2/r1)``; standard deviation that remains for a given
        ratio; correlation of the two responses.
    out : (n,) ndarray
        Receives the probabilities, from 0 to 1.
    """
    edges = np.empty(EDGES)
    panels = np.empty((MOST_PANELS, 3))
    width = 2 * GAUSS_NODES.size * BATCH
    rows = np.empty((ROWS, width))
    integers = np.empty(width, np.int64)
    for index in range(out.size):
        # Panels (low, high, integral) between the edges; infinity has not been computed
        pair = parameters[:, index].copy()
        count = _edges(pair, edges) - 1
        for panel in range(count):
            panels[panel, 0] = edges[panel]
            panels[panel, 1] = edges[panel + 1]
            panels[panel, 2] = math.inf
        total = _integral(pair, panels, count, rows, integers)
        out[index] = min(max(total, 0.0), 1.0)


@kernel
def _edges(p, edges):
    """Fill the sorted edges of the panels, in standard deviations of d; return their number."""
    # Even panels
    steep = p[4] <= 0.1 * p[1]
    panels = PANELS * STEEP if steep else PANELS
    count = panels + 1
    for edge in range(count):
        edges[edge] = INTEGRATION_LIMIT * (2.0 * edge / panels - 1.0)
    # Ever finer panels towards the dip at e^d = rho
    if p[5] > 0.0:
        dip = (math.log(p[5]) - p[0]) / p[1]
        distance = INTEGRATION_LIMIT
        finest = SHARE_OF_DIP * math.sqrt(2.0 * (1.0 - p[5])) / p[1]
        for _ in range(DIP):
            for deviate in (dip - distance, dip + distance):
                if -INTEGRATION_LIMIT < deviate < INTEGRATION_LIMIT:
                    edges[count] = deviate
                    count += 1
            distance *= 0.25
            if distance < finest:
                break
        if -INTEGRATION_LIMIT < dip < INTEGRATION_LIMIT:
            edges[count] = dip
            count += 1
    edges[:count].sort()
    # Edges where the gap just closes, if little dispersion remains for a given ratio
    if steep:
        count = _with_crossings(p, edges, count)
        edges[:count].sort()
    return count


@kernel
def _with_crossings(p, edges, count):
    """
    Add edges at the ratios at which the gap just closes, and at which it is certain again.

    Returns the new number of edges.
    """
    total = count
    is_right = _margin(p, edges[0]) > 0.0
    for edge in range(1, count):
        is_left = is_right
        is_right = _margin(p, edges[edge]) > 0.0
        if is_left != is_right and total < count + 3 * CROSSINGS:
            # The crossing between two edges, and the slope of the margin there
            crossing = _crossing(p, edges[edge - 1], edges[edge], is_left)
            rise = _margin(p, crossing + NEARBY) - _margin(p, crossing - NEARBY)
            slope = abs(rise) / (2.0 * NEARBY)
            # Distance at which the chance is 0 or 1
            width = CERTAIN * p[4] / max(slope, p[4], SMALLEST)
            for deviate in (crossing - width, crossing, crossing + width):
                edges[total] = min(max(deviate, -INTEGRATION_LIMIT), INTEGRATION_LIMIT)
                total += 1
    return total


@kernel
def _crossing(p, low, high, positive):
    """Return the standardised d between two at which the margin changes its sign, by halving."""
    for _ in range(BISECTIONS):
        middle = 0.5 * (low + high)
        if (_margin(p, middle) > 0.0) == positive:
            low = middle
        else:
            high = middle
    return high


@kernel
def _margin(p, deviate):
    """Return the logarithm of the median critical gap over the gap, at a standardised d."""
    ratio = p[0] + p[1] * deviate
    square = math.expm1(ratio) ** 2 + 2.0 * (1.0 - p[5]) * math.exp(ratio)
    return p[2] + p[3] * p[1] * deviate + 0.5 * math.log(square) if square > 0.0 else -math.inf


@kernel
def _integral(p, panels, count, rows, integers):
    """Return the integral over the panels, each halved until its halves agree with the whole."""
    total = 0.0
    while count > 0:
        # Take a batch from the end
        taken = min(count, BATCH)
        count -= taken
        batch = panels[count : count + taken].copy()
        # Nodes of both halves of each panel
        for panel in range(taken):
            low, high = batch[panel, 0], batch[panel, 1]
            for half in range(2):
                for node in range(GAUSS_NODES.size):
                    index = (2 * panel + half) * GAUSS_NODES.size + node
                    rows[0, index] = low + 0.25 * (high - low) * (2 * half + 1 + GAUSS_NODES[node])
        _integrands(p, rows, 2 * GAUSS_NODES.size * taken, integers)
        for panel in range(taken):
            low, high, whole = batch[panel]
            left = _gauss(rows[1], 2 * panel, high - low)
            right = _gauss(rows[1], 2 * panel + 1, high - low)
            if abs(left + right - whole) <= PANEL_TOLERANCE or high - low < FINEST:
                total += left + right
            else:
                # Both halves become panels
                middle = 0.5 * (low + high)
                panels[count, 0] = low
                panels[count, 1] = middle
                panels[count, 2] = left
                panels[count + 1, 0] = middle
                panels[count + 1, 1] = high
                panels[count + 1, 2] = right
                count += 2
    return total


@kernel
def _gauss(integrands, half, width):
    """Return the integral over one half of a panel from the integrand at its eight nodes."""
    total = 0.0
    for node in range(GAUSS_NODES.size):
        total += GAUSS_WEIGHTS[node] * integrands[half * GAUSS_NODES.size + node]
    return 0.25 * width * total


@kernel
def _integrands(p, rows, count, integers):
    """Fill the second row with the integrand at the standardised d in the first."""
    # Contiguous parts of the rows
    deviates, density, square = rows[0][:count], rows[1][:count], rows[2][:count]
    chance, scratch = rows[3][:count], rows[4][:count]
    # Normal density (but for its factor) and e^d - 1
    for i in range(deviates.size):
        density[i], square[i] = -0.5 * deviates[i] * deviates[i], p[0] + p[1] * deviates[i]
    exponentials(density, integers)
    exponentials_less_one(square, integers)
    for i in range(deviates.size):
        # 1 + e^2d - 2 rho e^d as (e^d - 1)² + 2 (1 - rho) e^d, which does not cancel
        square[i] = square[i] * square[i] + 2.0 * (1.0 - p[5]) * (1.0 + square[i])
        chance[i] = max(square[i], SMALLEST)
    logarithms(chance, integers)
    # Logarithm of the gap over the median critical gap
    for i in range(deviates.size):
        margin = p[2] + p[3] * p[1] * deviates[i] + 0.5 * chance[i]
        chance[i] = -margin
    _chances(p[4], chance, scratch, integers)
    for i in range(deviates.size):
        density[i] *= chance[i] / math.sqrt(2.0 * math.pi) if square[i] > 0.0 else 0.0


@kernel
def _chances(dispersion, log_ratios, scratch, integers):
    """Replace the logarithms of gap over critical gap by the chance that the gap closes."""
    if dispersion == 0.0:
        for i in range(log_ratios.size):
            log_ratios[i] = 1.0 if log_ratios[i] < 0.0 else 0.0
        return
    for i in range(log_ratios.size):
        log_ratios[i] = min(max(log_ratios[i] / dispersion, -FARTHEST_NORMAL), FARTHEST_NORMAL)
    normal_tails(log_ratios, scratch, integers)
