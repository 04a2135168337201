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
from per_obspy.kernels.extremes import place_of_largest, smallest
from per_obspy.kernels.oscillator.exact_step import step_coefficients, unit_responses
from per_obspy.kernels.spectra.response import first_root
from per_obspy.kernels.spectra.tile_search import TILE

#: Neighbouring azimuths that are ruled out together: as many as fit into the widest vectors.
GROUP = 8
#: Tiles with the largest bounds that are visited first, to raise the smallest maximum early.
LEADERS = 16
#: Other tiles after which the floor is renewed.
RENEWAL = 4


class Oscillator(NamedTuple):
    """Lane in a block, phase of a step, damping, and share: 1 for radius, 0 for displacement."""

    lane: int
    phase: float
    damping: float
    share: float


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
def floor_form(best, cosines, sines, above):
    """
    Return a form that the largest squares exceed along every azimuth, and their smallest.

    A sample that does not exceed it cannot raise any of them. The form is their smallest, or their
    first two Fourier coefficients lowered as far as needed, whichever has the larger mean. Memory
    of the same size, ``above``, is overwritten.
    """
    # Second Fourier coefficients of the largest squares, from every azimuth that begins a group
    even = odd = 0.0
    for k in range(0, best.size, GROUP):
        even += best[k] * cosines[k]
        odd += best[k] * sines[k]
    difference, product = 2.0 * GROUP * even / best.size, 2.0 * GROUP * odd / best.size
    for k in range(best.size):
        above[k] = max(best[k] - (difference * cosines[k] + product * sines[k]), 0.0)
    least, mean = smallest(best), smallest(above)
    return ((mean, difference, product) if mean > least else (least, 0.0, 0.0)), least


@kernel
def excess_over_floor(mean, difference, product, floor):
    """Return a positive number if a form exceeds the floor along any azimuth."""
    # Their difference has a positive root
    mean, difference, product = mean - floor[0], difference - floor[1], product - floor[2]
    return difference * difference + product * product + mean * abs(mean)


@kernel
def mark_samples(forms, floor, marks, marked):
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
            (mean_a + difference_a * cosine) + product_a * sine,
            (mean_b + difference_b * cosine) + product_b * sine,
        )
        late = max(
            (mean_c + difference_c * cosine) + product_c * sine,
            (mean_d + difference_d * cosine) + product_d * sine,
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
        From `azimuth_tiles.run_azimuth_tiles`.
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
    # Memory of the leading tiles, and the bound of every tile that is still to be visited
    tiles = (north.size - 1) // TILE
    states, forms = np.empty((4, TILE + 1)), np.empty((LEADERS, 3, TILE + 1))
    squares = np.empty((4, TILE))
    marks, marked = np.empty(TILE + 1), np.zeros(TILE + 5, np.int64)
    bounds, leaders, above = np.empty(tiles), np.zeros(LEADERS), np.empty(best.size)
    for tile in range(tiles):
        bounds[tile] = checkpoints[tile, 4, lane] if share == 1.0 else checkpoints[tile, 5, lane]
    floor, least = floor_form(best, cosines, sines, above)
    # Outermost samples of the tiles with the largest bounds, until none can raise anything
    for leader in range(LEADERS):
        tile = place_of_largest(bounds)
        if bounds[tile] <= least:
            break
        rerun_tile(north, east, checkpoints, tile, lane, coefficients, states)
        fill_forms(states, share, forms[leader])
        outermost = _outermost(forms[leader], squares)
        _raise_to_four(forms[leader], outermost, cosines, sines, best)
        leaders[leader] = bounds[tile]
        bounds[tile] = 0.0
        least = smallest(best)
    floor, least = floor_form(best, cosines, sines, above)
    visited = 0
    for visit in range(LEADERS + tiles):
        # First the tiles with the largest bounds, then all others in order
        tile, number = max(visit - LEADERS, 0), min(visit, LEADERS - 1)
        if (leaders[number] if visit < LEADERS else bounds[tile]) > least:
            # Samples of the tile that exceed the floor, four at a time
            if visit >= LEADERS:
                rerun_tile(north, east, checkpoints, tile, lane, coefficients, states)
                fill_forms(states, share, forms[number])
            for four in range(0, 4 * mark_samples(forms[number], floor, marks, marked), 4):
                chosen = marked[four], marked[four + 1], marked[four + 2], marked[four + 3]
                _raise_to_four(forms[number], chosen, cosines, sines, best)
            # Raise the floor now and then
            visited += 1
            if visited % RENEWAL == 0:
                floor, least = floor_form(best, cosines, sines, above)


@kernel
def _outermost(forms, squares):
    """Return the samples of a tile, but its last, with the largest squares along four azimuths."""
    # Half sum, half difference and product make the squares along 0, 90, 45 and 135 degrees
    for i in range(TILE):
        squares[0, i], squares[1, i] = forms[0, i] + forms[1, i], forms[0, i] - forms[1, i]
        squares[2, i], squares[3, i] = forms[0, i] + forms[2, i], forms[0, i] - forms[2, i]
    return (
        place_of_largest(squares[0]),
        place_of_largest(squares[1]),
        place_of_largest(squares[2]),
        place_of_largest(squares[3]),
    )


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
