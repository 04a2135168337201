r"""
Largest radius or displacement along many azimuths, exact at each of them, from one pass over both components.

Along the azimuth ``t`` the state is ``cos t`` times that of the north component plus ``sin t`` times that of the east
component, so that ``r² = (A + C) / 2 + (A - C) / 2 cos 2t + B sin 2t`` with ``A = un² + zn²``, ``B = un ue + zn ze``,
``C = ue² + ze²`` (for displacements without the z). The larger eigenvalue bounds it for every azimuth: only where that
exceeds the smallest of the maxima found so far are azimuths looked at. Displacements are counted in ``a / omega²``.
"""

import math

import numpy as np

from ._jit import kernel
from .between import dips, find_wanted, largest_in_step, radius_bound, rate_bounds, workspace
from .blocks import LANES, SMALLEST_STATE, TILE
from .oscillator import step, unit_responses
from .response import first_root

#: ``sqrt(1 + x²) <= 1 + 0.4143 x`` for x from 0 to 1: a bound of the eigenvalue without a square root.
CHORD = 0.41422
#: Neighbouring azimuths that are ruled out together.
GROUP = 12
#: Tiles whose bound exceeds this part of the largest are visited first, to raise the smallest maximum early.
EARLY = 0.7
#: Phase between the samples at which maxima are raised on the way; a peak exceeds them by 1 - cos(0.05) at most.
STRIDE = 0.1


@kernel
def pack_steps(phases, dampings, packed):
    """Fill the eight coefficients of a step of each oscillator."""
    for lane in range(LANES):
        for row, coefficient in enumerate(step(1.0, dampings[lane], phases[lane])):
            packed[row, lane] = coefficient


@kernel
def _open_tile(un, zn, ue, ze, radius, displacement, kept):
    """Keep the states before a tile and start its bounds with theirs (for the radius, the trace)."""
    for lane in range(LANES):
        un[lane] = un[lane] if abs(un[lane]) > SMALLEST_STATE else 0.0
        zn[lane] = zn[lane] if abs(zn[lane]) > SMALLEST_STATE else 0.0
        ue[lane] = ue[lane] if abs(ue[lane]) > SMALLEST_STATE else 0.0
        ze[lane] = ze[lane] if abs(ze[lane]) > SMALLEST_STATE else 0.0
        kept[0, lane], kept[1, lane], kept[2, lane], kept[3, lane] = un[lane], zn[lane], ue[lane], ze[lane]
        displacement[lane] = un[lane] * un[lane] + ue[lane] * ue[lane]
        radius[lane] = displacement[lane] + zn[lane] * zn[lane] + ze[lane] * ze[lane]


@kernel
def run_azimuth_tiles(north, east, packed, state, kept):
    """
    Advance a block; keep, per tile, the states before it and what squared radius and displacement cannot exceed.

    ``state`` (4, lanes) and the rows of ``kept``: u and z of north, u and z of east; then the bounds at the samples.
    """
    a11, a12, a21, a22 = packed[0].copy(), packed[1].copy(), packed[2].copy(), packed[3].copy()
    b11, b12, b21, b22 = packed[4].copy(), packed[5].copy(), packed[6].copy(), packed[7].copy()
    un, zn, ue, ze = state[0].copy(), state[1].copy(), state[2].copy(), state[3].copy()
    radius, displacement = np.empty(LANES), np.empty(LANES)
    for first in range(0, north.size - 1, TILE):
        tile = first // TILE
        _open_tile(un, zn, ue, ze, radius, displacement, kept[tile])
        for i in range(first, first + TILE, 2):
            n0, n1, n2, e0, e1, e2 = north[i], north[i + 1], north[i + 2], east[i], east[i + 1], east[i + 2]
            for lane in range(LANES):
                u, z = un[lane], zn[lane]
                u1 = a11[lane] * u + (a12[lane] * z + (b11[lane] * n0 + b12[lane] * n1))
                z1 = a21[lane] * u + (a22[lane] * z + (b21[lane] * n0 + b22[lane] * n1))
                u2 = a11[lane] * u1 + (a12[lane] * z1 + (b11[lane] * n1 + b12[lane] * n2))
                z2 = a21[lane] * u1 + (a22[lane] * z1 + (b21[lane] * n1 + b22[lane] * n2))
                un[lane], zn[lane] = u2, z2
                u, z = ue[lane], ze[lane]
                v1 = a11[lane] * u + (a12[lane] * z + (b11[lane] * e0 + b12[lane] * e1))
                w1 = a21[lane] * u + (a22[lane] * z + (b21[lane] * e0 + b22[lane] * e1))
                v2 = a11[lane] * v1 + (a12[lane] * w1 + (b11[lane] * e1 + b12[lane] * e2))
                w2 = a21[lane] * v1 + (a22[lane] * w1 + (b21[lane] * e1 + b22[lane] * e2))
                ue[lane], ze[lane] = v2, w2
                displacement[lane] = max(displacement[lane], u1 * u1 + v1 * v1, u2 * u2 + v2 * v2)
                a, b, c = u1 * u1 + z1 * z1, 2.0 * abs(u1 * v1 + z1 * w1), v1 * v1 + w1 * w1
                d = abs(a - c)
                early = a + c + max(b, d) + CHORD * min(b, d)
                a, b, c = u2 * u2 + z2 * z2, 2.0 * abs(u2 * v2 + z2 * w2), v2 * v2 + w2 * w2
                d = abs(a - c)
                late = a + c + max(b, d) + CHORD * min(b, d)
                radius[lane] = max(radius[lane], 0.5 * max(early, late))
        for lane in range(LANES):
            kept[tile, 4, lane], kept[tile, 5, lane] = radius[lane], displacement[lane]
    for lane in range(LANES):
        state[0, lane], state[1, lane], state[2, lane], state[3, lane] = un[lane], zn[lane], ue[lane], ze[lane]


@kernel
def _form(un, zn, ue, ze, share):
    """Return half sum, half difference and product of the two components; share is 1 for radii, 0 for displacements."""
    a, c = un * un + share * zn * zn, ue * ue + share * ze * ze
    return 0.5 * (a + c), 0.5 * (a - c), un * ue + share * zn * ze


@kernel
def _eigenvalue_bound(form):
    """Return what a form cannot exceed along any azimuth."""
    mean, difference, product = form
    one, other = abs(difference), abs(product)
    return mean + max(one, other) + CHORD * min(one, other)


@kernel
def _slack(radius, peak, jump, damping, phase, share):
    """Return by how much the square of radius (share 1) or displacement (0) can exceed two samples between them."""
    speed, _, square = rate_bounds(radius, peak, jump, damping, phase)
    if share == 0.0:
        square = 2.0 * (phase * radius * radius + radius * speed)  # (u²)'' = 2 z² + 2 u z'
    return 0.125 * phase * square


@kernel
def _may_raise(before, after, slack, edges, floors):
    """
    Tell whether a step with these forms at its ends can hold more than the smallest maximum of any group of azimuths.

    Over a group ``cos 2(t - t0)`` exceeds its larger value at the ends by no more than ``1 - cos`` of half its width.
    """
    mean_0, difference_0, product_0 = before
    mean_1, difference_1, product_1 = after
    size_0, size_1 = math.hypot(difference_0, product_0), math.hypot(difference_1, product_1)
    count = 0
    for j in range(floors.size):
        first = difference_0 * edges[0, j] + product_0 * edges[1, j]
        last = difference_0 * edges[2, j] + product_0 * edges[3, j]
        start = mean_0 + max(first, last) + size_0 * edges[4, j]
        first = difference_1 * edges[0, j] + product_1 * edges[1, j]
        last = difference_1 * edges[2, j] + product_1 * edges[3, j]
        end = mean_1 + max(first, last) + size_1 * edges[4, j]
        count += max(start, end) + slack > floors[j]
    return count > 0


@kernel
def _lower(best, floors):
    """Fill the smallest of the largest squares of each group of azimuths."""
    for j in range(floors.size):
        floors[j] = best[j * GROUP]
        for k in range(j * GROUP + 1, min((j + 1) * GROUP, best.size)):
            floors[j] = min(floors[j], best[k])


@kernel
def list_steps(north, east, peaks, jumps, kept, lane, phase, damping, share, directions, edges, best, steps):
    """
    Raise the largest squares along all azimuths to samples of one oscillator; list the steps that may hold more.

    ``directions`` (4, n): cosine and sine of the ascending azimuths and of twice them; ``edges`` (5, groups): cosine
    and sine of twice the first and the last azimuth of each group, and what may lie between. ``best`` starts with what
    is known and is raised at so few samples as show most of it. ``steps`` (count, 12) receives the states before (u
    and z of north, u and z of east), the states after, and both accelerations of both components. Returns how many.
    """
    coefficients = step(1.0, damping, phase)
    row = 4 if share == 1.0 else 5
    tiles = peaks.shape[1]
    slacks, waiting, floors = np.empty(tiles), np.ones(tiles), np.empty(edges.shape[1])
    highest = 0.0
    for tile in range(tiles):
        peak, jump = math.hypot(peaks[0, tile], peaks[1, tile]), math.hypot(jumps[0, tile], jumps[1, tile])
        radius = radius_bound(kept[tile, 4, lane], peak, damping, phase)
        slacks[tile] = _slack(radius, peak, jump, damping, phase, share)
        highest = max(highest, kept[tile, row, lane])
    count = 0
    _lower(best, floors)
    for visit in range(2 * tiles):
        tile = visit % tiles
        bound = kept[tile, row, lane]
        early = visit >= tiles or bound > EARLY * highest
        if early and waiting[tile] > 0.0 and bound + slacks[tile] > _least(floors):
            waiting[tile] = 0.0
            slack = slacks[tile]
            count = _run_tile(
                north,
                east,
                tile,
                kept,
                lane,
                coefficients,
                phase,
                share,
                slack,
                directions,
                edges,
                floors,
                best,
                steps,
                count,
            )
            _lower(best, floors)
    return count


@kernel
def _least(values):
    """Return the smallest value."""
    least = values[0]
    for k in range(1, values.size):
        least = min(least, values[k])
    return least


@kernel
def _run_tile(
    north, east, tile, kept, lane, coefficients, phase, share, slack, directions, edges, floors, best, steps, count
):
    """Repeat one tile: raise the largest squares at some samples, list the steps that may hold more."""
    a11, a12, a21, a22, b11, b12, b21, b22 = coefficients
    un, zn, ue, ze = kept[tile, 0, lane], kept[tile, 1, lane], kept[tile, 2, lane], kept[tile, 3, lane]
    floor, stride = _least(floors), max(1, int(STRIDE / phase))
    after = _form(un, zn, ue, ze, share)
    for i in range(tile * TILE, tile * TILE + TILE):
        u, z, v, w, before = un, zn, ue, ze, after
        n0, n1, e0, e1 = north[i], north[i + 1], east[i], east[i + 1]
        un = a11 * u + (a12 * z + (b11 * n0 + b12 * n1))
        zn = a21 * u + (a22 * z + (b21 * n0 + b22 * n1))
        ue = a11 * v + (a12 * w + (b11 * e0 + b12 * e1))
        ze = a21 * v + (a22 * w + (b21 * e0 + b22 * e1))
        after = _form(un, zn, ue, ze, share)
        if i % stride == 0 and _eigenvalue_bound(after) > floor:
            mean, difference, product = after
            for k in range(best.size):
                value = mean + (difference * directions[2, k] + product * directions[3, k])
                best[k] = max(best[k], value)
        highest = max(_eigenvalue_bound(before), _eigenvalue_bound(after))
        if highest + slack > floor and _may_raise(before, after, slack, edges, floors):
            steps[count, 0], steps[count, 1], steps[count, 2], steps[count, 3] = u, z, v, w
            steps[count, 4], steps[count, 5], steps[count, 6], steps[count, 7] = un, zn, ue, ze
            steps[count, 8], steps[count, 9], steps[count, 10], steps[count, 11] = n0, n1, e0, e1
            count += 1
    return count


@kernel
def search_steps(steps, phase, damping, share, directions, edges, best):
    """Raise the largest squares along all azimuths to those in the listed steps, between their samples too."""
    work, wanted, here, beyond = workspace(), np.zeros(4, np.bool_), np.full(4, np.inf), np.empty(best.size)
    quantities, row = (1, 0) if share == 1.0 else (4, 1)
    floors = np.empty(edges.shape[1])
    _lower(best, floors)
    for number in range(steps.shape[0]):
        one = steps[number]
        peak = math.hypot(max(abs(one[8]), abs(one[9])), max(abs(one[10]), abs(one[11])))
        jump = math.hypot(one[9] - one[8], one[11] - one[10])
        radius = radius_bound(_largest_trace(one), peak, damping, phase)
        slack = _slack(radius, peak, jump, damping, phase, share)
        before, after = _form(one[0], one[1], one[2], one[3], share), _form(one[4], one[5], one[6], one[7], share)
        if not _may_raise(before, after, slack, edges, floors):
            continue
        dip = dips(rate_bounds(radius, peak, jump, damping, phase), damping, phase)
        if _mark_azimuths(one, before, after, slack, dip, damping, share, directions, best, beyond) == 0:
            continue
        for k in range(best.size):
            if beyond[k] > 0.0:
                c, s = directions[0, k], directions[1, k]
                u, z, start = c * one[0] + s * one[2], c * one[1] + s * one[3], c * one[8] + s * one[10]
                u_end, z_end, end = c * one[4] + s * one[6], c * one[5] + s * one[7], c * one[9] + s * one[11]
                here[row] = best[k] if row == 0 else math.sqrt(best[k])
                if find_wanted(u, z, start, u_end, z_end, end, damping, phase, radius, quantities, here, wanted):
                    largest_in_step(u, z, start, end, damping, phase, wanted, work, here)
                    best[k] = max(best[k], here[0] if row == 0 else here[1] * here[1])
        _lower(best, floors)


@kernel
def _mark_azimuths(one, before, after, slack, dip, damping, share, directions, best, beyond):
    """Mark with a positive number the azimuths along which a step may raise the largest square; return how many."""
    twice = 2.0 * damping
    mean_0, difference_0, product_0 = before
    mean_1, difference_1, product_1 = after
    zn0, ze0, zn1, ze1 = one[1], one[3], one[5], one[7]
    bn0, be0, bn1, be1 = twice * zn0 + one[8], twice * ze0 + one[10], twice * zn1 + one[9], twice * ze1 + one[11]
    far, count = (0.0 if share == 1.0 else np.inf), 0
    for k in range(best.size):
        c, s = directions[0, k], directions[1, k]
        start = mean_0 + (difference_0 * directions[2, k] + product_0 * directions[3, k])
        end = mean_1 + (difference_1 * directions[2, k] + product_1 * directions[3, k])
        z0, z1, b0, b1 = c * zn0 + s * ze0, c * zn1 + s * ze1, c * bn0 + s * be0, c * bn1 + s * be1
        still = min(z0 * z1, min(abs(z0), abs(z1)) - dip[1])
        still = min(still, far + min(b0 * b1, min(abs(b0), abs(b1)) - dip[0]))
        beyond[k] = max(start, end) + slack - best[k] if still <= 0.0 else -1.0
        count += beyond[k] > 0.0
    return count


@kernel
def _largest_trace(one):
    """Return the larger sum of the squares of both components' states at the ends of a step."""
    before = one[0] * one[0] + one[1] * one[1] + one[2] * one[2] + one[3] * one[3]
    after = one[4] * one[4] + one[5] * one[5] + one[6] * one[6] + one[7] * one[7]
    return max(before, after)


@kernel
def free_displacements(state, dampings, lanes, directions, best):
    """Raise the largest squared displacements along all azimuths to those of the free vibration after the record."""
    for lane in range(lanes):
        damping = dampings[lane]
        for k in range(best.shape[1]):
            u = directions[0, k] * state[0, lane] + directions[1, k] * state[2, lane]
            z = directions[0, k] * state[1, lane] + directions[1, k] * state[3, lane]
            if u * u + z * z > best[lane, k]:
                impulse, _, once, _ = unit_responses(first_root(z, -2.0 * damping * z - u, damping), damping)
                later = u * (1.0 - once) + z * impulse
                best[lane, k] = max(best[lane, k], later * later)
