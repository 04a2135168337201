"""
Probability that a lognormal critical gap exceeds a gap: one integral over the logarithm of the ratio of two radii.

Given the ratio, the critical gap is lognormal; its logarithm has a narrow dip where the radii agree
and their correlation is near 1. Panels are even over the normal distribution of the ratio and ever
finer towards the dip, and where little is left to chance they end where the gap is just closed;
each is halved until both halves agree with the whole. The nodes of many panels lie side by side:
loops without branches over them become vectors.
"""

import math

import numpy as np

from per_obspy.kernels._jit import kernel
from per_obspy.kernels.elementary import (
    exponentials,
    exponentials_less_one,
    logarithms,
    normal_tails,
)

NODES, WEIGHTS = np.polynomial.legendre.leggauss(8)
REACH = 9.0  # standard deviations: what lies beyond has a probability of 1e-19
TOLERANCE = 1e-13  # of a panel
FINEST = 1e-11  # standard deviations: panels are not halved below
DIP = 20  # panels on each side of the dip at most, each a quarter of the next
SHARE_OF_DIP = 0.1  # the finest of them, of the width of the dip
PANELS = 18  # even panels, before both halves
STEEP = 8  # times as many where little dispersion is left for a given ratio
CROSSINGS = 8  # ratios at most at which the gap is just closed
BISECTIONS = 60  # of an interval of REACH / PANELS: to rounding
NEARBY = 1e-6  # standard deviations over which the slope of the margin is taken
CERTAIN = 9.0  # standard deviations of the margin at which a chance is 0 or 1
BATCH = 16  # panels halved at a time
#: Panels that may wait: all at the beginning, and those of a batch for every halving from 2 REACH /
#: PANELS to FINEST.
EDGES = PANELS * STEEP + 2 * DIP + 2 + 3 * CROSSINGS
WAITING = EDGES + 40 * BATCH
#: Rows of work: place, density, the square of the critical gap over that of radius 1, chance, and
#: room.
ROWS = 5
#: Instead of nothing, where a logarithm is taken.
SMALLEST = 1e-300
#: Standard deviations beyond which a normal variable is not found: a probability of 1e-299.
FARTHEST = 37.0


@kernel
def probabilities(parameters, out):
    """
    Fill ``out`` (n).

    ``parameters`` (6, n): mean and standard deviation of ln(r2/r1); mean of ln(r1/gap) at that mean
    and its slope over ln(r2/r1); standard deviation that remains for a given ratio; correlation.
    """
    edges, waiting = np.empty(EDGES), np.empty((WAITING, 3))
    rows, integers = (
        np.empty((ROWS, 2 * NODES.size * BATCH)),
        np.empty(2 * NODES.size * BATCH, np.int64),
    )
    for index in range(out.size):
        pair = parameters[:, index].copy()
        count = _edges(pair, edges) - 1
        for panel in range(count):
            waiting[panel, 0], waiting[panel, 1], waiting[panel, 2] = (
                edges[panel],
                edges[panel + 1],
                math.inf,
            )
        total = _integral(pair, waiting, count, rows, integers)
        out[index] = min(max(total, 0.0), 1.0)


@kernel
def _edges(p, edges):
    """Fill the sorted edges of the panels, in standard deviations of the ratio; return their number."""
    steep = p[4] <= 0.1 * p[1]
    panels = PANELS * STEEP if steep else PANELS
    count = panels + 1
    for place in range(count):
        edges[place] = REACH * (2.0 * place / panels - 1.0)
    if p[5] > 0.0:
        dip, distance = (math.log(p[5]) - p[0]) / p[1], REACH
        finest = SHARE_OF_DIP * math.sqrt(2.0 * (1.0 - p[5])) / p[1]
        for _ in range(DIP):
            for edge in (dip - distance, dip + distance):
                if -REACH < edge < REACH:
                    edges[count] = edge
                    count += 1
            distance *= 0.25
            if distance < finest:
                break
        if -REACH < dip < REACH:
            edges[count] = dip
            count += 1
    edges[:count].sort()
    if steep:
        count = _with_crossings(p, edges, count)
        edges[:count].sort()
    return count


@kernel
def _with_crossings(p, edges, count):
    """Add to the sorted edges the ratios at which the gap is just closed, and those at which it is certain again."""
    total, right = count, _margin(p, edges[0]) > 0.0
    for place in range(1, count):
        left, right = right, _margin(p, edges[place]) > 0.0
        if left != right and total < count + 3 * CROSSINGS:
            crossing = _crossing(p, edges[place - 1], edges[place], left)
            slope = abs(_margin(p, crossing + NEARBY) - _margin(p, crossing - NEARBY)) / (
                2.0 * NEARBY
            )
            width = CERTAIN * p[4] / max(slope, p[4], SMALLEST)
            for edge in (crossing - width, crossing, crossing + width):
                edges[total] = min(max(edge, -REACH), REACH)
                total += 1
    return total


@kernel
def _crossing(p, low, high, positive):
    """Return the ratio between two at which the margin changes its sign, found by halving."""
    for _ in range(BISECTIONS):
        middle = 0.5 * (low + high)
        if (_margin(p, middle) > 0.0) == positive:
            low = middle
        else:
            high = middle
    return high


@kernel
def _margin(p, place):
    """Return the logarithm of the critical gap at its median over the gap, for a ratio."""
    ratio = p[0] + p[1] * place
    square = math.expm1(ratio) ** 2 + 2.0 * (1.0 - p[5]) * math.exp(ratio)
    return p[2] + p[3] * p[1] * place + 0.5 * math.log(square) if square > 0.0 else -math.inf


@kernel
def _integral(p, waiting, count, rows, integers):
    """Return the integral over the waiting panels (low, high, integral), halved where the halves disagree with it."""
    total = 0.0
    while count > 0:
        taken = min(count, BATCH)
        count -= taken
        batch = waiting[count : count + taken].copy()
        for panel in range(taken):
            low, high = batch[panel, 0], batch[panel, 1]
            for half in range(2):
                for node in range(NODES.size):
                    place = (2 * panel + half) * NODES.size + node
                    rows[0, place] = low + 0.25 * (high - low) * (2 * half + 1 + NODES[node])
        _integrands(p, rows, 2 * NODES.size * taken, integers)
        for panel in range(taken):
            low, high, whole = batch[panel]
            left, right = (
                _gauss(rows[1], 2 * panel, high - low),
                _gauss(rows[1], 2 * panel + 1, high - low),
            )
            if abs(left + right - whole) <= TOLERANCE or high - low < FINEST:
                total += left + right
            else:
                middle = 0.5 * (low + high)
                waiting[count, 0], waiting[count, 1], waiting[count, 2] = low, middle, left
                waiting[count + 1, 0], waiting[count + 1, 1], waiting[count + 1, 2] = (
                    middle,
                    high,
                    right,
                )
                count += 2
    return total


@kernel
def _gauss(integrands, half, width):
    """Return the integral over one half of a panel from the integrand at its eight points."""
    total = 0.0
    for node in range(NODES.size):
        total += WEIGHTS[node] * integrands[half * NODES.size + node]
    return 0.25 * width * total


@kernel
def _integrands(p, rows, count, integers):
    """Fill the second row with the density of the ratios in the first times the chance that the gap closes at them."""
    places, density, square = rows[0][:count], rows[1][:count], rows[2][:count]  # contiguous
    chance, room = rows[3][:count], rows[4][:count]
    for i in range(places.size):
        density[i], square[i] = -0.5 * places[i] * places[i], p[0] + p[1] * places[i]
    exponentials(density, integers)
    exponentials_less_one(square, integers)
    for i in range(places.size):
        # 1 + e^2d - 2 rho e^d as (e^d - 1)² + 2 (1 - rho) e^d, which does not cancel
        square[i] = square[i] * square[i] + 2.0 * (1.0 - p[5]) * (1.0 + square[i])
        chance[i] = max(square[i], SMALLEST)
    logarithms(chance, integers)
    for i in range(places.size):
        margin = p[2] + p[3] * p[1] * places[i] + 0.5 * chance[i]
        chance[i] = -margin
    _chances(p[4], chance, room, integers)
    for i in range(places.size):
        density[i] *= chance[i] / math.sqrt(2.0 * math.pi) if square[i] > 0.0 else 0.0


@kernel
def _chances(dispersion, lacking, room, integers):
    """Replace the logarithms of gap over critical gap by the chance that it closes."""
    if dispersion == 0.0:
        for i in range(lacking.size):
            lacking[i] = 1.0 if lacking[i] < 0.0 else 0.0
        return
    for i in range(lacking.size):
        lacking[i] = min(max(lacking[i] / dispersion, -FARTHEST), FARTHEST)
    normal_tails(lacking, room, integers)
