r"""
Largest radius or displacement along many azimuths at the samples, from one pass over a record.

Along the azimuth ``t`` the state is ``cos t`` times that of the north component plus ``sin t``
times that of the east component, so that ``r² = (A + C) / 2 + (A - C) / 2 cos 2t + B sin 2t`` with
``A = un² + zn²``, ``B = un ue + zn ze``, ``C = ue² + ze²`` (for displacements without the z). The
larger eigenvalue bounds it for every azimuth: only where that exceeds the smallest of the maxima
found so far are azimuths looked at. Displacements are counted in ``a / omega²``.
"""

from typing import NamedTuple

import numpy as np

from per_obspy.kernels._jit import kernel
from per_obspy.kernels.oscillator.exact_step import step_coefficients, unit_responses
from per_obspy.kernels.spectra.response import first_root
from per_obspy.kernels.spectra.tile_search import LANES, SMALLEST_STATE, TILE

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
    """Lane in a block, phase of a step, damping, and share: 1 for radius, 0 for displacement."""

    lane: int
    phase: float
    damping: float
    share: float


@kernel
def pack_steps(phases, dampings, packed):
    """
    Fill the coefficients of a step of each oscillator.

    Parameters
    ----------
    phases, dampings : (LANES,) ndarray
        Phase ``omega * dt`` of a step, rad; fraction of critical.
    packed : (8, LANES) ndarray
        Receives a11, a12, a21, a22, b11, b12, b21, b22 of `exact_step.step_coefficients`.
    """
    for lane in range(LANES):
        for row, coefficient in enumerate(step_coefficients(1.0, dampings[lane], phases[lane])):
            packed[row, lane] = coefficient


@kernel
def _open_tile(un, zn, ue, ze, radius, displacement, checkpoint):
    """Store the states before a tile and start its bounds with theirs (the trace for radii)."""
    for lane in range(LANES):
        # Denormal states become zero
        un[lane] = un[lane] if abs(un[lane]) > SMALLEST_STATE else 0.0
        zn[lane] = zn[lane] if abs(zn[lane]) > SMALLEST_STATE else 0.0
        ue[lane] = ue[lane] if abs(ue[lane]) > SMALLEST_STATE else 0.0
        ze[lane] = ze[lane] if abs(ze[lane]) > SMALLEST_STATE else 0.0
        # Checkpoint and bounds
        checkpoint[0, lane], checkpoint[1, lane] = un[lane], zn[lane]
        checkpoint[2, lane], checkpoint[3, lane] = ue[lane], ze[lane]
        displacement[lane] = un[lane] * un[lane] + ue[lane] * ue[lane]
        radius[lane] = displacement[lane] + zn[lane] * zn[lane] + ze[lane] * ze[lane]


@kernel
def run_azimuth_tiles(north, east, packed, state, checkpoints):
    """
    Advance a block over the samples; store a checkpoint per tile.

    Parameters
    ----------
    north, east : (tiles * TILE + 1,) ndarray
        Components of the ground acceleration, scaled to a peak of order one.
    packed : (8, LANES) ndarray
        Rows from `pack_steps`.
    state : (4, LANES) ndarray
        Rows: u and z under north, u and z under east, in the unit of the acceleration (over
        ``omega²``); advanced to the last sample.
    checkpoints : (TILES, 6, LANES) ndarray
        Receives, per tile, the same four rows before it, then bounds of squared radius and squared
        displacement over all azimuths at its samples.
    """
    # Local copies of a size that the compiler knows: it makes vectors
    a11, a12, a21, a22 = packed[0].copy(), packed[1].copy(), packed[2].copy(), packed[3].copy()
    b11, b12, b21, b22 = packed[4].copy(), packed[5].copy(), packed[6].copy(), packed[7].copy()
    un, zn, ue, ze = state[0].copy(), state[1].copy(), state[2].copy(), state[3].copy()
    radius, displacement = np.empty(LANES), np.empty(LANES)
    for first in range(0, north.size - 1, TILE):
        tile = first // TILE
        _open_tile(un, zn, ue, ze, radius, displacement, checkpoints[tile])
        for i in range(first, first + TILE, 2):
            # Samples of two steps, of both components
            n0, n1, n2 = north[i], north[i + 1], north[i + 2]
            e0, e1, e2 = east[i], east[i + 1], east[i + 2]
            for lane in range(LANES):
                # Two steps under north (Nigam & Jennings)
                u, z = un[lane], zn[lane]
                u1 = a11[lane] * u + (a12[lane] * z + (b11[lane] * n0 + b12[lane] * n1))
                z1 = a21[lane] * u + (a22[lane] * z + (b21[lane] * n0 + b22[lane] * n1))
                u2 = a11[lane] * u1 + (a12[lane] * z1 + (b11[lane] * n1 + b12[lane] * n2))
                z2 = a21[lane] * u1 + (a22[lane] * z1 + (b21[lane] * n1 + b22[lane] * n2))
                un[lane], zn[lane] = u2, z2
                # Two steps under east
                u, z = ue[lane], ze[lane]
                v1 = a11[lane] * u + (a12[lane] * z + (b11[lane] * e0 + b12[lane] * e1))
                w1 = a21[lane] * u + (a22[lane] * z + (b21[lane] * e0 + b22[lane] * e1))
                v2 = a11[lane] * v1 + (a12[lane] * w1 + (b11[lane] * e1 + b12[lane] * e2))
                w2 = a21[lane] * v1 + (a22[lane] * w1 + (b21[lane] * e1 + b22[lane] * e2))
                ue[lane], ze[lane] = v2, w2
                # Squared displacement over all azimuths
                displacement[lane] = max(displacement[lane], u1 * u1 + v1 * v1, u2 * u2 + v2 * v2)
                # Bound of twice the larger eigenvalue after the first step: A, 2 B, C
                a, b, c = u1 * u1 + z1 * z1, 2.0 * abs(u1 * v1 + z1 * w1), v1 * v1 + w1 * w1
                d = abs(a - c)
                early = a + c + max(b, d) + CHORD * min(b, d)
                # The same after the second step
                a, b, c = u2 * u2 + z2 * z2, 2.0 * abs(u2 * v2 + z2 * w2), v2 * v2 + w2 * w2
                d = abs(a - c)
                late = a + c + max(b, d) + CHORD * min(b, d)
                # Squared radius over all azimuths
                radius[lane] = max(radius[lane], 0.5 * max(early, late))
        # Bounds of the tile
        for lane in range(LANES):
            checkpoints[tile, 4, lane], checkpoints[tile, 5, lane] = (
                radius[lane],
                displacement[lane],
            )
    # State for the next stretch of the record
    for lane in range(LANES):
        state[0, lane], state[1, lane] = un[lane], zn[lane]
        state[2, lane], state[3, lane] = ue[lane], ze[lane]


@kernel
def rerun_tile(north, east, checkpoints, tile, lane, coefficients, states):
    """Fill the states at the samples of one tile of one oscillator, (4, samples)."""
    a11, a12, a21, a22, b11, b12, b21, b22 = coefficients
    # Start from the checkpoint
    un, zn = checkpoints[tile, 0, lane], checkpoints[tile, 1, lane]
    ue, ze = checkpoints[tile, 2, lane], checkpoints[tile, 3, lane]
    states[0, 0], states[1, 0], states[2, 0], states[3, 0] = un, zn, ue, ze
    first = tile * TILE
    for i in range(TILE):
        n0, n1 = north[first + i], north[first + i + 1]
        e0, e1 = east[first + i], east[first + i + 1]
        # One step under north, and one under east (Nigam & Jennings)
        u, v = un, ue
        un = a11 * u + (a12 * zn + (b11 * n0 + b12 * n1))
        zn = a21 * u + (a22 * zn + (b21 * n0 + b22 * n1))
        ue = a11 * v + (a12 * ze + (b11 * e0 + b12 * e1))
        ze = a21 * v + (a22 * ze + (b21 * e0 + b22 * e1))
        # State at the end of the step
        states[0, i + 1], states[1, i + 1], states[2, i + 1], states[3, i + 1] = un, zn, ue, ze


@kernel
def fill_forms(states, share, forms):
    """Fill half sum, half difference and product of the components' squares at a tile's samples."""
    for i in range(TILE + 1):
        un, zn, ue, ze = states[0, i], states[1, i], states[2, i], states[3, i]
        # A and C of the module's equation
        a, c = un * un + share * zn * zn, ue * ue + share * ze * ze
        forms[0, i], forms[1, i] = 0.5 * (a + c), 0.5 * (a - c)
        forms[2, i] = un * ue + share * zn * ze


@kernel
def least_above(best, difference, product, cosines, sines):
    """Return the smallest of whole groups of values minus a form without a mean, in parallel."""
    # One accumulator for each place in a group
    side = np.full(GROUP, np.inf)
    for j in range(0, best.size, GROUP):
        for k in range(GROUP):
            above = best[j + k] - (difference * cosines[j + k] + product * sines[j + k])
            side[k] = min(side[k], above)
    smallest = side[0]
    for k in range(1, GROUP):
        smallest = min(smallest, side[k])
    return smallest


@kernel
def floor_form(best, cosines, sines):
    """
    Return a form that the largest squares exceed along every azimuth, and their smallest.

    A sample that does not exceed it cannot raise any of them. The form is their smallest, or their
    first two Fourier coefficients lowered as far as needed, whichever has the larger mean.
    """
    # Second Fourier coefficients of the largest squares
    even, odd = np.zeros(GROUP), np.zeros(GROUP)
    for j in range(0, best.size, GROUP):
        for k in range(GROUP):
            even[k] += best[j + k] * cosines[j + k]
            odd[k] += best[j + k] * sines[j + k]
    difference = 2.0 * even.sum() / best.size
    product = 2.0 * odd.sum() / best.size
    least = least_above(best, 0.0, 0.0, cosines, sines)
    mean = least_above(best, difference, product, cosines, sines)
    return ((mean, difference, product) if mean > least else (least, 0.0, 0.0)), least


@kernel
def excess_over_floor(mean, difference, product, floor):
    """Return a positive number if a form exceeds the floor along any azimuth."""
    # Their difference has a positive root
    mean, difference, product = mean - floor[0], difference - floor[1], product - floor[2]
    return difference * difference + product * product + mean * abs(mean)


@kernel
def _mark_samples(forms, floor, marks, marked):
    """List the samples of a tile above the floor, filled up to fours; return how many fours."""
    for i in range(TILE + 1):
        marks[i] = excess_over_floor(forms[0, i], forms[1, i], forms[2, i], floor)
    count = 0
    # Without branches: a sample below the floor is overwritten by the next one
    for i in range(TILE + 1):
        marked[count] = i
        count += marks[i] > 0.0
    marked[count : count + 4] = marked[max(count - 1, 0)]
    return (count + 3) // 4


@kernel
def _raise_to_four(forms, four, cosines, sines, best):
    """Raise the largest squares along all azimuths to those of four samples of a tile."""
    # Forms of the four samples
    a, b, c, d = four
    mean_a, difference_a, product_a = forms[0, a], forms[1, a], forms[2, a]
    mean_b, difference_b, product_b = forms[0, b], forms[1, b], forms[2, b]
    mean_c, difference_c, product_c = forms[0, c], forms[1, c], forms[2, c]
    mean_d, difference_d, product_d = forms[0, d], forms[1, d], forms[2, d]
    # Squares along each azimuth
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
def raise_azimuths_to_samples(north, east, checkpoints, oscillator, directions, best):
    """
    Raise the largest squares of one oscillator along all azimuths to those at the samples.

    Parameters
    ----------
    north, east : (tiles * TILE + 1,) ndarray
        Components of the ground acceleration, scaled to a peak of order one.
    checkpoints : (TILES, 6, LANES) ndarray
        From `run_azimuth_tiles`.
    oscillator : Oscillator
        Lane, phase of a step (rad), damping (fraction of critical), and share.
    directions : (5, n_azimuths) ndarray
        Cosine and sine of the azimuths, of twice them, and their places between the first and the
        last azimuth of their group, from 0 to 1; a whole number of groups.
    best : (n_azimuths,) ndarray
        Largest squared radius (share 1) or displacement (share 0) along each azimuth, raised in
        place, in the squared unit of the acceleration (over ``omega⁴``).
    """
    lane, phase, damping, share = oscillator
    coefficients = step_coefficients(1.0, damping, phase)
    cosines, sines = directions[2], directions[3]
    # Memory of one tile, and the bound of every tile that is still to be visited
    tiles = (north.size - 1) // TILE
    states, forms, bounds = np.empty((4, TILE + 1)), np.empty((3, TILE + 1)), np.empty(tiles)
    marks, marked = np.empty(TILE + 1), np.zeros(TILE + 5, np.int64)
    for tile in range(tiles):
        bounds[tile] = checkpoints[tile, 4, lane] if share == 1.0 else checkpoints[tile, 5, lane]
    floor, least = floor_form(best, cosines, sines)
    visited = 0
    for visit in range(LEADERS + tiles):
        # First the tiles with the largest bounds, then all others in order
        tile = np.argmax(bounds) if visit < LEADERS else visit - LEADERS
        if bounds[tile] > least:
            bounds[tile] = 0.0
            # Samples of the tile that exceed the floor, four at a time
            rerun_tile(north, east, checkpoints, tile, lane, coefficients, states)
            fill_forms(states, share, forms)
            for four in range(0, 4 * _mark_samples(forms, floor, marks, marked), 4):
                chosen = marked[four], marked[four + 1], marked[four + 2], marked[four + 3]
                _raise_to_four(forms, chosen, cosines, sines, best)
            # Raise the floor now and then
            visited += 1
            if visit < LEADERS or visited % RENEWAL == 0:
                floor, least = floor_form(best, cosines, sines)


@kernel
def free_displacements(state, dampings, lanes, directions, best):
    """
    Raise the largest squared displacements along all azimuths to those of the free vibration.

    Parameters
    ----------
    state : (4, LANES) ndarray
        Rows: u and z under north, u and z under east, at the end of the record.
    dampings : (LANES,) ndarray
        Fraction of critical.
    lanes : int
        Number of oscillators that count; the others fill the block up.
    directions : (5, n_azimuths) ndarray
        Cosine and sine of the azimuths, of twice them, and places in their group.
    best : (LANES, n_azimuths) ndarray
        Largest squared displacement of each oscillator along each azimuth, raised in place, in the
        squared unit of the acceleration (over ``omega⁴``).
    """
    for lane in range(lanes):
        damping = dampings[lane]
        for k in range(best.shape[1]):
            u = directions[0, k] * state[0, lane] + directions[1, k] * state[2, lane]
            z = directions[0, k] * state[1, lane] + directions[1, k] * state[3, lane]
            # The radius never grows: only it can rule the free vibration out
            if u * u + z * z > best[lane, k]:
                # Displacement at the first root of its velocity
                phase = first_root(z, -2.0 * damping * z - u, damping)
                impulse, _, integral_1, _ = unit_responses(phase, damping)
                later = u * (1.0 - integral_1) + z * impulse
                best[lane, k] = max(best[lane, k], later * later)
