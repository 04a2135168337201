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

from per_obspy.kernels._jit import kernel
from per_obspy.kernels.oscillator.exact_step import step
from per_obspy.kernels.oscillator.within_step import radius_bound, rate_bounds
from per_obspy.kernels.spectra.azimuths import GROUP, excess, fill_forms, floor_form, rerun_tile
from per_obspy.kernels.spectra.blocks import LANES, TILE
from per_obspy.kernels.spectra.peaks_within_steps import raise_to_peaks

#: Values kept of a listed step: three forms, states before it, accelerations at its ends.
COLUMNS = 17


@kernel
def _bounds(radius, peak, jump, oscillator):
    """
    Return by how much a square can exceed two samples between them, and ``h⁴ |f''''| / 144``.

    ``(r²)' = -2 z b`` with ``b = 2 xi z + a``, ``(u²)' = 2 u z``, and ``z''' = -2 xi z'' - z'``.
    """
    _, phase, damping, share = oscillator
    twice = 2.0 * damping
    z1, change, square = rate_bounds(radius, peak, jump, damping, phase)
    z2 = phase * change
    z3 = phase * (twice * z2 + phase * z1)
    if share == 0.0:
        square = 2.0 * (phase * radius * radius + radius * z1)  # (u²)'' = 2 z² + 2 u z'
        fourth = 4.0 * phase * z2 * radius + 3.0 * phase * z1 * z1 + radius * z3
    else:
        fourth = (
            z3 * (twice * radius + peak) + 3.0 * z2 * (twice * z1 + jump) + 3.0 * z1 * twice * z2
        )
        fourth += radius * twice * z3
    return 0.125 * phase * square, 2.0 * phase * fourth / 144.0


@kernel
def _fill_slopes(states, north, east, oscillator, slopes):
    """Fill the forms of the derivatives at the samples of a tile, times the phase of a step."""
    _, phase, damping, share = oscillator
    own, twice = phase * (1.0 - share), 2.0 * damping
    for i in range(TILE + 1):
        un, zn, ue, ze = states[0, i], states[1, i], states[2, i], states[3, i]
        xn = own * un - share * phase * (twice * zn + north[i])
        xe = own * ue - share * phase * (twice * ze + east[i])
        slopes[0, i], slopes[1, i], slopes[2, i] = (
            zn * xn + ze * xe,
            zn * xn - ze * xe,
            zn * xe + ze * xn,
        )


@kernel
def _fill_coefficients(forms, slopes, bulge, coefficients):
    """Fill the three inner coefficients of each step, (coefficient, form, step); the outer ones are the samples."""
    for row in range(3):
        extra = bulge if row == 0 else 0.0
        for i in range(TILE):
            f0, f1, s0, s1 = forms[row, i], forms[row, i + 1], slopes[row, i], slopes[row, i + 1]
            coefficients[0, row, i] = f0 + 0.25 * s0
            coefficients[1, row, i] = 0.5 * (f0 + f1) + (s0 - s1) / 6.0 + extra
            coefficients[2, row, i] = f1 - 0.25 * s1


@kernel
def _mark_steps(coefficients, floor, marks):
    """Mark with a positive number the steps whose inner coefficients exceed the floor along any azimuth."""
    marks[:] = 0.0
    for number in range(3):
        for i in range(TILE):
            mark = excess(
                coefficients[number, 0, i],
                coefficients[number, 1, i],
                coefficients[number, 2, i],
                floor,
            )
            marks[i] = max(marks[i], mark)


@kernel
def list_steps(north, east, peaks, jumps, kept, oscillator, directions, best, steps):
    """
    List the steps of one oscillator that may hold more than the largest squares at the samples.

    ``steps`` (count, columns) receives three forms, the states before (u and z of north, u and z of
    east), and both accelerations of both components. Returns how many there are.
    """
    lane, phase, damping, share = oscillator
    exact = step(1.0, damping, phase)
    states, forms, slopes = (
        np.empty((4, TILE + 1)),
        np.empty((3, TILE + 1)),
        np.empty((3, TILE + 1)),
    )
    coefficients, marks = np.empty((3, 3, TILE)), np.empty(TILE)
    floor, least = floor_form(best, directions[2], directions[3])
    count = 0
    for tile in range(peaks.shape[1]):
        peak, jump = (
            math.hypot(peaks[0, tile], peaks[1, tile]),
            math.hypot(jumps[0, tile], jumps[1, tile]),
        )
        radius = radius_bound(kept[tile, 4, lane], peak, damping, phase)
        slack, bulge = _bounds(radius, peak, jump, oscillator)
        if (kept[tile, 4, lane] if share == 1.0 else kept[tile, 5, lane]) + slack <= least:
            continue
        first = tile * TILE
        rerun_tile(north, east, kept, tile, lane, exact, states)
        fill_forms(states, share, forms)
        _fill_slopes(
            states,
            north[first : first + TILE + 1],
            east[first : first + TILE + 1],
            oscillator,
            slopes,
        )
        _fill_coefficients(forms, slopes, bulge, coefficients)
        _mark_steps(coefficients, floor, marks)
        for i in range(TILE):
            if marks[i] > 0.0:
                for number in range(9):
                    steps[count, number] = coefficients[number // 3, number % 3, i]
                for row in range(4):
                    steps[count, 9 + row] = states[row, i]
                steps[count, 13], steps[count, 14] = north[first + i], north[first + i + 1]
                steps[count, 15], steps[count, 16] = east[first + i], east[first + i + 1]
                count += 1
    return count


@kernel
def _mark_groups(one, edges, floors, marks):
    """
    Mark with a positive number the groups of azimuths along which a step may hold more than their smallest maximum.

    Returns how many. Over a group ``cos 2(t - t0)`` exceeds its larger value at the ends by no more
    than ``1 - cos`` of half its width.
    """
    m0, d0, p0, m1, d1, p1 = one[0], one[1], one[2], one[3], one[4], one[5]
    m2, d2, p2 = one[6], one[7], one[8]
    size_0, size_1, size_2 = (
        math.sqrt(d0 * d0 + p0 * p0),
        math.sqrt(d1 * d1 + p1 * p1),
        math.sqrt(d2 * d2 + p2 * p2),
    )
    count = 0
    for j in range(floors.size):
        c0, s0, c1, s1, rise = edges[0, j], edges[1, j], edges[2, j], edges[3, j], edges[4, j]
        early = m0 + max(d0 * c0 + p0 * s0, d0 * c1 + p0 * s1) + size_0 * rise
        middle = m1 + max(d1 * c0 + p1 * s0, d1 * c1 + p1 * s1) + size_1 * rise
        late = m2 + max(d2 * c0 + p2 * s0, d2 * c1 + p2 * s1) + size_2 * rise
        marks[j] = max(early, middle, late) - floors[j]
        count += marks[j] > 0.0
    return count


@kernel
def _lower(best, floors):
    """Fill the smallest of the largest squares of each group of azimuths."""
    for j in range(best.size // GROUP):
        floors[j] = best[j * GROUP]
        for k in range(j * GROUP + 1, (j + 1) * GROUP):
            floors[j] = min(floors[j], best[k])


@kernel
def search_steps(steps, oscillator, directions, edges, best):
    """
    Raise the largest squares along all azimuths to those in the listed steps, between their samples too.

    ``edges`` (5, groups): cosine and sine of twice the first and the last azimuth of each group,
    and what may lie between; filled up with zeros to a multiple of the widest vector.
    """
    floors, marks = np.full(edges.shape[1], np.inf), np.empty(edges.shape[1])
    problems, places, largest = np.empty((4, LANES)), np.zeros(LANES, np.int64), np.empty(GROUP)
    _lower(best, floors)
    count = 0
    for number in range(steps.shape[0]):
        one = steps[number]
        if _mark_groups(one, edges, floors, marks) == 0:
            continue
        for j in range(marks.size):
            if marks[j] > 0.0:
                if count + GROUP > LANES:
                    raise_to_peaks(problems, places, count, oscillator, best)
                    _lower(best, floors)
                    count = 0
                count = _add_problems(
                    one, j * GROUP, directions, best, largest, problems, places, count
                )
    raise_to_peaks(problems, places, count, oscillator, best)


@kernel
def _add_problems(one, first, directions, best, largest, problems, places, count):
    """Add those azimuths of a group along which a step may hold more than their own maximum; return the new count."""
    for k in range(GROUP):
        c2, s2 = directions[2, first + k], directions[3, first + k]
        early = one[0] + (one[1] * c2 + one[2] * s2)
        middle = one[3] + (one[4] * c2 + one[5] * s2)
        late = one[6] + (one[7] * c2 + one[8] * s2)
        largest[k] = max(early, middle, late)
    for k in range(GROUP):
        place = first + k
        if largest[k] > best[place]:
            c, s = directions[0, place], directions[1, place]
            problems[0, count], problems[1, count] = (
                c * one[9] + s * one[11],
                c * one[10] + s * one[12],
            )
            problems[2, count], problems[3, count] = (
                c * one[13] + s * one[15],
                c * one[14] + s * one[16],
            )
            places[count] = place
            count += 1
    return count
