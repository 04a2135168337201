r"""
Largest radius or displacement along many azimuths between the samples, exact at each azimuth.

Over a step the square ``f`` along an azimuth leaves the cubic with the same values and slopes at
both ends by at most ``h⁴ |f''''| / 384``, like ``s² (1 - s)²``. Cubic and deviation together are a
Bernstein polynomial, which never exceeds the largest of its coefficients ``f0, f0 + h f0' / 4, (f0
+ f1) / 2 + h (f0' - f1') / 6 + h⁴ |f''''| / 144, f1 - h f1' / 4, f1``. Each is a form like ``f``
itself, so that steps are ruled out for all azimuths, for groups of azimuths, and for single ones,
before peaks are looked for.
"""

import math

import numpy as np

from per_obspy.kernels._jit import inlined, kernel, lean
from per_obspy.kernels.oscillator.exact_step import step_coefficients
from per_obspy.kernels.oscillator.within_step import rate_bounds
from per_obspy.kernels.spectra.azimuth_samples import (
    GROUP,
    Oscillator,
    excess_over_floor,
    fill_forms,
    floor_form,
    mark_samples,
    raise_azimuths_to_samples,
    rerun_tile,
)
from per_obspy.kernels.spectra.peaks_within_steps import raise_to_step_peaks
from per_obspy.kernels.spectra.tile_search import LANES, TILE

#: Values stored of a listed step: three forms, states before it, accelerations at its ends.
COLUMNS = 17


@kernel
def _slack(radius, peak, jump, oscillator):
    """
    Return by how much a square can exceed two samples of a tile between them.

    ``(r²)' = -2 z b`` with ``b = 2 xi z + a``, ``(u²)' = 2 u z``.
    """
    _, phase, damping, share = oscillator
    # Bound of the first derivative of z, times the phase of a step
    z1, _, square = rate_bounds(radius, peak, jump, damping, phase)
    if share == 0.0:
        square = 2.0 * (phase * radius * radius + radius * z1)  # (u²)'' = 2 z² + 2 u z'
    return 0.125 * phase * square


@inlined
def _squared_rate(u, z, acceleration, rate, viscosity):
    """Return ``z'² + z''²`` at a state, the squared radius of their free vibration."""
    first = -(viscosity * z + u + acceleration)
    second = -(viscosity * first + z + rate)
    return first * first + second * second


@inlined
def _longer(north, east, next_north, next_east):
    """Return the length of the longer one of two vectors."""
    squared = max(north * north + east * east, next_north * next_north + next_east * next_east)
    return math.sqrt(squared)


@kernel
def _fill_bulges(states, north, east, oscillator, bulges):
    """
    Fill ``h⁴ |f''''| / 144`` of each step of a tile, a bound over the step and all azimuths.

    ``q = z'`` and its derivative are a free vibration, whose radius ``Q`` never grows: it bounds
    ``z'`` and ``z''``, and ``sqrt(1 + 4 xi²) Q`` bounds ``z'''``. It is small where a stiff
    oscillator follows the ground. Then, with ``b = 2 xi z + a`` and the rate ``p`` of ``a``,
    ``(u²)'''' = 2 (u z''' + 4 z z'' + 3 z'²)`` and ``(r²)'''' = -2 (z''' b + 3 z'' (2 xi z' + p) +
    6 xi z' z'' + 2 xi z z''')``. Lengths over both components bound every azimuth.
    """
    _, phase, damping, share = oscillator
    viscosity, third = 2.0 * damping, math.sqrt(1.0 + 4.0 * damping * damping)
    sag, size = 0.125 * phase * phase, phase * phase * phase * phase / 72.0
    for i in range(TILE):
        # States at both ends
        un, zn, ue, ze = states[0, i], states[1, i], states[2, i], states[3, i]
        un1, zn1, ue1, ze1 = states[0, i + 1], states[1, i + 1], states[2, i + 1], states[3, i + 1]
        # Accelerations at both ends, their rates, and Q
        n0, n1, e0, e1 = north[i], north[i + 1], east[i], east[i + 1]
        pn, pe = (n1 - n0) / phase, (e1 - e0) / phase
        rate = math.sqrt(
            _squared_rate(un, zn, n0, pn, viscosity) + _squared_rate(ue, ze, e0, pe, viscosity)
        )
        # Largest u, z and a over the step: ends, and how far a curve leaves its chord
        z = _longer(zn, ze, zn1, ze1) + sag * rate
        # Fourth derivative over 2 Q
        if share == 0.0:
            u = _longer(un, ue, un1, ue1) + sag * rate
            fourth = third * u + 4.0 * z + 3.0 * rate
        else:
            fourth = third * (_longer(n0, e0, n1, e1) + 2.0 * viscosity * z)
            fourth += 3.0 * (math.sqrt(pn * pn + pe * pe) + 2.0 * viscosity * rate)
        # Times Q and the fourth power of the phase of a step
        bulges[i] = size * rate * fourth


@kernel
def _fill_slopes(states, north, east, oscillator, slopes):
    """Fill the forms of the derivatives at the samples of a tile, times the phase of a step."""
    _, phase, damping, share = oscillator
    own = phase * (1.0 - share)
    viscosity = 2.0 * damping
    for i in range(TILE + 1):
        un, zn, ue, ze = states[0, i], states[1, i], states[2, i], states[3, i]
        # Factor of z in half the derivative: -b for the radius, u for the displacement
        xn = own * un - share * phase * (viscosity * zn + north[i])
        xe = own * ue - share * phase * (viscosity * ze + east[i])
        # Half sum, half difference and product, as the forms of the squares
        slopes[0, i], slopes[1, i] = zn * xn + ze * xe, zn * xn - ze * xe
        slopes[2, i] = zn * xe + ze * xn


@kernel
def _fill_coefficients(forms, slopes, bulges, coefficients):
    """
    Fill the three inner Bernstein coefficients of each step, (coefficient, form, step).

    The outer ones are the samples.
    """
    for row in range(3):
        # The deviation from the cubic is the same along every azimuth: it raises the mean only
        extra = 1.0 if row == 0 else 0.0
        for i in range(TILE):
            f0, f1, s0, s1 = forms[row, i], forms[row, i + 1], slopes[row, i], slopes[row, i + 1]
            coefficients[0, row, i] = f0 + 0.25 * s0
            coefficients[1, row, i] = 0.5 * (f0 + f1) + (s0 - s1) / 6.0 + extra * bulges[i]
            coefficients[2, row, i] = f1 - 0.25 * s1


@kernel
def _mark_steps(coefficients, floor, marks):
    """Mark with a positive number the steps that exceed the floor along any azimuth."""
    marks[:] = 0.0
    for number in range(3):
        for i in range(TILE):
            mark = excess_over_floor(
                coefficients[number, 0, i],
                coefficients[number, 1, i],
                coefficients[number, 2, i],
                floor,
            )
            marks[i] = max(marks[i], mark)


@kernel
def list_steps(north, east, peaks, jumps, checkpoints, oscillator, directions, best, steps):
    """
    List the steps of one oscillator that may hold more than the largest squares at the samples.

    Parameters
    ----------
    north, east : (tiles * TILE + 1,) ndarray
        Components of the ground acceleration, scaled to a peak of order one.
    peaks, jumps : (2, tiles) ndarray
        Largest absolute acceleration and change over a step, from `tile_search.tile_extremes`, of
        either component.
    checkpoints : (TILES, 6, LANES) ndarray
        From `azimuth_tiles.run_azimuth_tiles`.
    oscillator : Oscillator
        Lane, phase of a step (rad), damping (fraction of critical), and share: 1 for the radius, 0
        for the displacement.
    directions : (5, n_azimuths) ndarray
        Cosine and sine of the azimuths, of twice them, and their places between the first and the
        last azimuth of their group, from 0 to 1; a whole number of groups.
    best : (n_azimuths,) ndarray
        Largest squares along each azimuth at the samples.
    steps : (tiles * TILE, COLUMNS) ndarray
        Receives, one row per step: the three inner Bernstein coefficients as forms (mean,
        difference, product; 9 columns), u and z of north and of east before the step (4), north
        acceleration before and after it, east acceleration before and after it.

    Returns
    -------
    count : int
        Number of rows of ``steps`` that are filled.
    """
    lane, phase, damping, share = oscillator
    exact = step_coefficients(1.0, damping, phase)
    # Memory of one tile
    states, forms = np.empty((4, TILE + 1)), np.empty((3, TILE + 1))
    slopes = np.empty((3, TILE + 1))
    coefficients, bulges, marks = np.empty((3, 3, TILE)), np.empty(TILE), np.empty(TILE)
    sample_marks, marked = np.empty(TILE + 1), np.zeros(TILE + 5, np.int64)
    floor, least = floor_form(best, directions[2], directions[3], np.empty(best.size))
    count = 0
    for tile in range((north.size - 1) // TILE):
        # Leave out a tile whose bound does not reach the smallest of the largest squares
        if (checkpoints[tile, 4, lane] if share == 1.0 else checkpoints[tile, 5, lane]) <= least:
            continue
        # Squares and slopes at the samples, and the Bernstein coefficients between them
        first = tile * TILE
        rerun_tile(north, east, checkpoints, tile, lane, exact, states)
        fill_forms(states, share, forms)
        # Leave out a tile without a sample that comes close enough to the floor
        peak = math.hypot(peaks[0, tile], peaks[1, tile])
        jump = math.hypot(jumps[0, tile], jumps[1, tile])
        slack = _slack(math.sqrt(checkpoints[tile, 4, lane]), peak, jump, oscillator)
        lowered = floor[0] - slack, floor[1], floor[2]
        if mark_samples(forms, lowered, sample_marks, marked) == 0:
            continue
        tile_north, tile_east = north[first : first + TILE + 1], east[first : first + TILE + 1]
        _fill_slopes(states, tile_north, tile_east, oscillator, slopes)
        _fill_bulges(states, tile_north, tile_east, oscillator, bulges)
        _fill_coefficients(forms, slopes, bulges, coefficients)
        # List the steps that exceed the floor along any azimuth
        _mark_steps(coefficients, floor, marks)
        for i in range(TILE):
            if marks[i] > 0.0:
                for number in range(9):
                    steps[count, number] = coefficients[number // 3, number % 3, i]
                for row in range(4):
                    steps[count, 9 + row] = states[row, i]
                # Accelerations at both ends of the step
                steps[count, 13] = north[first + i]
                steps[count, 14] = north[first + i + 1]
                steps[count, 15] = east[first + i]
                steps[count, 16] = east[first + i + 1]
                count += 1
    return count


@kernel
def _mark_groups(step, edges, floors, marks):
    """
    Mark the groups of azimuths along which a step may hold more than a maximum of theirs.

    The mark is a positive number; returns how many there are. Over a group ``cos 2(t - t0)``
    exceeds its chord by no more than ``1 - cos`` of half its width, and the maxima are no smaller
    than the chord between the floors.
    """
    # Three inner Bernstein coefficients: mean m, difference d, product p
    m0, d0, p0 = step[0], step[1], step[2]
    m1, d1, p1 = step[3], step[4], step[5]
    m2, d2, p2 = step[6], step[7], step[8]
    # Amplitudes over the azimuths
    size_0 = math.sqrt(d0 * d0 + p0 * p0)
    size_1 = math.sqrt(d1 * d1 + p1 * p1)
    size_2 = math.sqrt(d2 * d2 + p2 * p2)
    # Groups next to each other
    count = 0
    for j in range(edges.shape[1]):
        c0, s0, c1, s1, rise = edges[0, j], edges[1, j], edges[2, j], edges[3, j], edges[4, j]
        first, last = floors[0, j], floors[1, j]
        # Larger excess at the ends of the group, and its rise in between
        early = m0 + max(d0 * c0 + p0 * s0 - first, d0 * c1 + p0 * s1 - last) + size_0 * rise
        middle = m1 + max(d1 * c0 + p1 * s0 - first, d1 * c1 + p1 * s1 - last) + size_1 * rise
        late = m2 + max(d2 * c0 + p2 * s0 - first, d2 * c1 + p2 * s1 - last) + size_2 * rise
        marks[j] = max(early, middle, late)
        count += marks[j] > 0.0
    return count


@kernel
def _fill_group_floors(best, shares, floors):
    """
    Fill values at the ends of each group whose chord no largest square of the group is below.

    ``shares`` are the places of the azimuths between the first and the last of their group.
    """
    for j in range(best.size // GROUP):
        first, last = best[j * GROUP], best[(j + 1) * GROUP - 1]
        # How far the chord between the outer squares has to be lowered
        excess = 0.0
        for k in range(j * GROUP, (j + 1) * GROUP):
            excess = max(excess, first + shares[k] * (last - first) - best[k])
        floors[0, j] = first - excess
        floors[1, j] = last - excess


@kernel
def search_steps(steps, oscillator, directions, edges, best):
    """
    Raise the largest squares along all azimuths to those in the listed steps, between samples too.

    Parameters
    ----------
    steps : (count, COLUMNS) ndarray
        From `list_steps`.
    oscillator : Oscillator
        Lane, phase of a step (rad), damping (fraction of critical), and share: 1 for the radius, 0
        for the displacement.
    directions : (5, n_azimuths) ndarray
        Cosine and sine of the azimuths, of twice them, and their places between the first and the
        last azimuth of their group, from 0 to 1; a whole number of groups.
    edges : (5, n_groups) ndarray
        Cosine and sine of twice the first and of twice the last azimuth of each group, and the rise
        of a cosine in between; filled up with zeros to a multiple of the widest vector.
    best : (n_azimuths,) ndarray
        Largest squared radius or displacement along each azimuth, raised in place, in the squared
        unit of the acceleration (over ``omega⁴``).
    """
    floors, marks = np.full((2, edges.shape[1]), np.inf), np.empty(edges.shape[1])
    # Problems, one per step and azimuth, that are solved next to each other
    problems, azimuths = np.empty((4, LANES)), np.zeros(LANES, np.int64)
    largest = np.empty(GROUP)
    _fill_group_floors(best, directions[4], floors)
    count = 0
    for number in range(steps.shape[0]):
        step = steps[number]
        if _mark_groups(step, edges, floors, marks) == 0:
            continue
        for j in range(marks.size):
            if marks[j] > 0.0:
                # Solve the problems when another group might not fit
                if count + GROUP > LANES:
                    raise_to_step_peaks(problems, azimuths, count, oscillator, best)
                    _fill_group_floors(best, directions[4], floors)
                    count = 0
                count = _add_problems(
                    step, j * GROUP, directions, best, largest, problems, azimuths, count
                )
    raise_to_step_peaks(problems, azimuths, count, oscillator, best)


@lean
def _add_problems(step, first, directions, best, largest, problems, azimuths, count):
    """
    Add those azimuths of a group along which a step may hold more than their own maximum.

    Returns the new number of problems.
    """
    # Largest Bernstein coefficient along each azimuth
    for k in range(GROUP):
        c2, s2 = directions[2, first + k], directions[3, first + k]
        early = step[0] + (step[1] * c2 + step[2] * s2)
        middle = step[3] + (step[4] * c2 + step[5] * s2)
        late = step[6] + (step[7] * c2 + step[8] * s2)
        largest[k] = max(early, middle, late)
    for k in range(GROUP):
        azimuth = first + k
        if largest[k] > best[azimuth]:
            # State and accelerations along the azimuth
            c, s = directions[0, azimuth], directions[1, azimuth]
            problems[0, count] = c * step[9] + s * step[11]
            problems[1, count] = c * step[10] + s * step[12]
            # Acceleration before and after the step
            problems[2, count] = c * step[13] + s * step[15]
            problems[3, count] = c * step[14] + s * step[16]
            azimuths[count] = azimuth
            count += 1
    return count


@kernel
def raise_azimuths(
    north, east, peaks, jumps, checkpoints, phases, dampings, share, exact, directions, edges, best
):
    """
    Raise the largest squares of all oscillators along all azimuths to those of a stretch.

    Parameters
    ----------
    north, east : (tiles * TILE + 1,) ndarray
        Components of the ground acceleration, scaled to a peak of order one.
    peaks, jumps : (2, tiles) ndarray
        Largest absolute acceleration and change over a step, from `tile_search.tile_extremes`, of
        either component.
    checkpoints : (TILES, 6, LANES) ndarray
        From `azimuth_tiles.run_azimuth_tiles`.
    phases, dampings : (LANES,) ndarray
        Phase ``omega * dt`` of a step, rad; fraction of critical.
    share : float
        1 for the radius, 0 for the displacement.
    exact : bool
        Whether the motion between the samples counts.
    directions, edges : (5, n_azimuths), (5, n_groups) ndarray
        As of `search_steps`.
    best : (oscillators, n_azimuths) ndarray
        Largest squares of the first oscillators of the block, raised in place, in the squared unit
        of the acceleration (over ``omega⁴``).
    """
    steps = np.empty((north.size - 1, COLUMNS))
    for lane in range(best.shape[0]):
        oscillator = Oscillator(lane, phases[lane], dampings[lane], share)
        largest = best[lane]
        raise_azimuths_to_samples(north, east, checkpoints, oscillator, directions, largest)
        # Between the samples only where the bounds of a step allow more
        if exact:
            count = list_steps(
                north, east, peaks, jumps, checkpoints, oscillator, directions, largest, steps
            )
            search_steps(steps[:count], oscillator, directions, edges, largest)
