r"""
Largest radius or displacement along many azimuths, from one pass over both components, at the samples.

Along the azimuth ``t`` the state is ``cos t`` times that of the north component plus ``sin t``
times that of the east component, so that ``r² = (A + C) / 2 + (A - C) / 2 cos 2t + B sin 2t`` with
``A = un² + zn²``, ``B = un ue + zn ze``, ``C = ue² + ze²`` (for displacements without the z). The
larger eigenvalue bounds it for every azimuth: only where that exceeds the smallest of the maxima
found so far are azimuths looked at. Displacements are counted in ``a / omega²``.
"""

from typing import NamedTuple

import numpy as np

from per_obspy.kernels._jit import kernel
from per_obspy.kernels.oscillator.exact_step import step, unit_responses
from per_obspy.kernels.spectra.blocks import LANES, SMALLEST_STATE, TILE
from per_obspy.kernels.spectra.response import first_root

#: ``sqrt(1 + x²) <= 1 + 0.4143 x`` for x from 0 to 1: a bound of the eigenvalue without a square
#: root.
CHORD = 0.41422
#: Neighbouring azimuths that are ruled out together: as many as fit into the widest vectors.
GROUP = 8
#: Tiles with the largest bounds that are visited first, to raise the smallest maximum early.
LEADERS = 6
#: Other tiles after which the floor is renewed.
RENEWAL = 4


class Oscillator(NamedTuple):
    """Lane of a block, phase of one step, damping, and share: 1 for the radius, 0 for the displacement."""

    lane: int
    phase: float
    damping: float
    share: float


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
        kept[0, lane], kept[1, lane], kept[2, lane], kept[3, lane] = (
            un[lane],
            zn[lane],
            ue[lane],
            ze[lane],
        )
        displacement[lane] = un[lane] * un[lane] + ue[lane] * ue[lane]
        radius[lane] = displacement[lane] + zn[lane] * zn[lane] + ze[lane] * ze[lane]


@kernel
def run_azimuth_tiles(north, east, packed, state, kept):
    """
    Advance a block; keep, per tile, the states before it and what squared radius and displacement cannot exceed.

    ``state`` (4, lanes) and the rows of ``kept``: u and z of north, u and z of east; then the
    bounds at the samples.
    """
    a11, a12, a21, a22 = packed[0].copy(), packed[1].copy(), packed[2].copy(), packed[3].copy()
    b11, b12, b21, b22 = packed[4].copy(), packed[5].copy(), packed[6].copy(), packed[7].copy()
    un, zn, ue, ze = state[0].copy(), state[1].copy(), state[2].copy(), state[3].copy()
    radius, displacement = np.empty(LANES), np.empty(LANES)
    for first in range(0, north.size - 1, TILE):
        tile = first // TILE
        _open_tile(un, zn, ue, ze, radius, displacement, kept[tile])
        for i in range(first, first + TILE, 2):
            n0, n1, n2, e0, e1, e2 = (
                north[i],
                north[i + 1],
                north[i + 2],
                east[i],
                east[i + 1],
                east[i + 2],
            )
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
        state[0, lane], state[1, lane], state[2, lane], state[3, lane] = (
            un[lane],
            zn[lane],
            ue[lane],
            ze[lane],
        )


@kernel
def rerun_tile(north, east, kept, tile, lane, coefficients, states):
    """Fill the states at the samples of one tile of one oscillator, (4, samples), from those kept before it."""
    a11, a12, a21, a22, b11, b12, b21, b22 = coefficients
    un, zn, ue, ze = (
        kept[tile, 0, lane],
        kept[tile, 1, lane],
        kept[tile, 2, lane],
        kept[tile, 3, lane],
    )
    states[0, 0], states[1, 0], states[2, 0], states[3, 0] = un, zn, ue, ze
    first = tile * TILE
    for i in range(TILE):
        n0, n1, e0, e1 = (
            north[first + i],
            north[first + i + 1],
            east[first + i],
            east[first + i + 1],
        )
        u, v = un, ue
        un = a11 * u + (a12 * zn + (b11 * n0 + b12 * n1))
        zn = a21 * u + (a22 * zn + (b21 * n0 + b22 * n1))
        ue = a11 * v + (a12 * ze + (b11 * e0 + b12 * e1))
        ze = a21 * v + (a22 * ze + (b21 * e0 + b22 * e1))
        states[0, i + 1], states[1, i + 1], states[2, i + 1], states[3, i + 1] = un, zn, ue, ze


@kernel
def fill_forms(states, share, forms):
    """Fill half sum, half difference and product of the two components' squares at the samples of a tile."""
    for i in range(TILE + 1):
        un, zn, ue, ze = states[0, i], states[1, i], states[2, i], states[3, i]
        a, c = un * un + share * zn * zn, ue * ue + share * ze * ze
        forms[0, i], forms[1, i], forms[2, i] = (
            0.5 * (a + c),
            0.5 * (a - c),
            un * ue + share * zn * ze,
        )


@kernel
def least_above(best, difference, product, cosines, sines):
    """Return the smallest of a whole number of groups of values minus a form without a mean, side by side."""
    side = np.full(GROUP, np.inf)
    for j in range(0, best.size, GROUP):
        for k in range(GROUP):
            side[k] = min(
                side[k], best[j + k] - (difference * cosines[j + k] + product * sines[j + k])
            )
    smallest = side[0]
    for k in range(1, GROUP):
        smallest = min(smallest, side[k])
    return smallest


@kernel
def floor_form(best, cosines, sines):
    """
    Return a form that the largest squares exceed along every azimuth: what does not exceed it cannot raise any.

    It is their smallest, or their first two Fourier coefficients lowered as far as needed,
    whichever has the larger mean. Returns it and the smallest.
    """
    even, odd = np.zeros(GROUP), np.zeros(GROUP)
    for j in range(0, best.size, GROUP):
        for k in range(GROUP):
            even[k] += best[j + k] * cosines[j + k]
            odd[k] += best[j + k] * sines[j + k]
    difference, product = 2.0 * even.sum() / best.size, 2.0 * odd.sum() / best.size
    least, mean = (
        least_above(best, 0.0, 0.0, cosines, sines),
        least_above(best, difference, product, cosines, sines),
    )
    return ((mean, difference, product) if mean > least else (least, 0.0, 0.0)), least


@kernel
def excess(mean, difference, product, floor):
    """Return a positive number if a form exceeds the floor along any azimuth: if the difference has a positive root."""
    mean, difference, product = mean - floor[0], difference - floor[1], product - floor[2]
    return difference * difference + product * product + mean * abs(mean)


@kernel
def _mark_samples(forms, floor, marks, marked):
    """List the samples of a tile that exceed the floor, filled up to fours with the last; return how many fours."""
    for i in range(TILE + 1):
        marks[i] = excess(forms[0, i], forms[1, i], forms[2, i], floor)
    count = 0
    for i in range(TILE + 1):
        marked[count] = i
        count += marks[i] > 0.0
    marked[count : count + 4] = marked[max(count - 1, 0)]
    return (count + 3) // 4


@kernel
def _raise_to_four(forms, four, cosines, sines, best):
    """Raise the largest squares along all azimuths to those of four samples of a tile."""
    a, b, c, d = four
    mean_a, difference_a, product_a = forms[0, a], forms[1, a], forms[2, a]
    mean_b, difference_b, product_b = forms[0, b], forms[1, b], forms[2, b]
    mean_c, difference_c, product_c = forms[0, c], forms[1, c], forms[2, c]
    mean_d, difference_d, product_d = forms[0, d], forms[1, d], forms[2, d]
    for k in range(best.size):
        cosine, sine = cosines[k], sines[k]
        early = max(
            mean_a + (difference_a * cosine + product_a * sine),
            mean_b + (difference_b * cosine + product_b * sine),
        )
        late = max(
            mean_c + (difference_c * cosine + product_c * sine),
            mean_d + (difference_d * cosine + product_d * sine),
        )
        best[k] = max(best[k], early, late)


@kernel
def raise_azimuths_to_samples(north, east, kept, oscillator, directions, best):
    """
    Raise the largest squares of one oscillator along all azimuths to those at the samples.

    ``directions`` (4, azimuths): cosine and sine of the azimuths and of twice them, a whole number
    of groups.
    """
    lane, phase, damping, share = oscillator
    coefficients, cosines, sines = step(1.0, damping, phase), directions[2], directions[3]
    tiles = (north.size - 1) // TILE
    states, forms, waiting = np.empty((4, TILE + 1)), np.empty((3, TILE + 1)), np.empty(tiles)
    marks, marked = np.empty(TILE + 1), np.zeros(TILE + 5, np.int64)
    for tile in range(tiles):
        waiting[tile] = kept[tile, 4, lane] if share == 1.0 else kept[tile, 5, lane]
    floor, least = floor_form(best, cosines, sines)
    visited = 0
    for visit in range(LEADERS + tiles):
        tile = np.argmax(waiting) if visit < LEADERS else visit - LEADERS
        if waiting[tile] > least:
            waiting[tile] = 0.0
            rerun_tile(north, east, kept, tile, lane, coefficients, states)
            fill_forms(states, share, forms)
            for four in range(0, 4 * _mark_samples(forms, floor, marks, marked), 4):
                chosen = marked[four], marked[four + 1], marked[four + 2], marked[four + 3]
                _raise_to_four(forms, chosen, cosines, sines, best)
            visited += 1
            if visit < LEADERS or visited % RENEWAL == 0:
                floor, least = floor_form(best, cosines, sines)


@kernel
def free_displacements(state, dampings, lanes, directions, best):
    """Raise the largest squared displacements along all azimuths to those of the free vibration after the record."""
    for lane in range(lanes):
        damping = dampings[lane]
        for k in range(best.shape[1]):
            u = directions[0, k] * state[0, lane] + directions[1, k] * state[2, lane]
            z = directions[0, k] * state[1, lane] + directions[1, k] * state[3, lane]
            if u * u + z * z > best[lane, k]:
                impulse, _, once, _ = unit_responses(
                    first_root(z, -2.0 * damping * z - u, damping), damping
                )
                later = u * (1.0 - once) + z * impulse
                best[lane, k] = max(best[lane, k], later * later)
