r"""
Largest values between two samples, exact: within a step, by Taylor series and the roots of their derivatives.

The radius is stationary where ``z = 0`` or ``2 xi z + a = 0``, the displacement where ``z = 0``,
the velocity where ``z' = 0``, the absolute acceleration ``-(u + 2 xi z)`` where ``z + 2 xi z' =
0``. The second derivative of each condition solves the homogeneous equation of the oscillator, so
that it has at most one root in a span of half a radian. That root bounds the pieces on which the
first derivative is monotone, whose roots bound the pieces on which the condition is monotone: no
stationary point can be missed. Displacements are counted in ``a / omega²``, time as phase.
"""

import math

import numpy as np

from per_obspy.kernels._jit import kernel

#: Longest span of one series, in phase.
LONGEST_SPAN = 0.5
#: Terms of the series at most: 0.5**15 / 15! = 2e-17.
TERMS = 16
NEGLIGIBLE = 1e-17
#: Two ends, at most 1 root of the second derivative, 2 of the first and 3 of the condition; one to
#: spare.
POINTS = 9
#: At a stationary point an error of the root changes the value by its square only.
ROOT_TOLERANCE = 1e-8
ROOT_STEPS = 60
#: ``1 / ((n + 2) (n + 1))``: a division takes as long as three multiply-adds.
INVERSES = tuple(1.0 / ((n + 2) * (n + 1)) for n in range(TERMS))


@kernel
def series_terms(span):
    """Return after how many terms a series may end."""
    terms, size = 4, span * span * span / 6.0
    while size > NEGLIGIBLE and terms < TERMS:
        size *= span / terms
        terms += 1
    return terms


@kernel
def fill_series(u, z, acceleration, rate, stiffness, damping, terms, motion, speed):
    """
    Fill the Taylor coefficients of displacement and velocity from the state and the acceleration at the start.

    ``u'' + 2 xi u' + stiffness u = -(acceleration + rate phase)``; the stiffness of the linear
    oscillator is 1.
    """
    motion[0], motion[1] = u, z
    motion[2] = -0.5 * (2.0 * damping * z + stiffness * u + acceleration)
    motion[3] = -(4.0 * damping * motion[2] + stiffness * z + rate) / 6.0
    for n in range(2, terms - 1):
        motion[n + 2] = (
            -(2.0 * damping * (n + 1) * motion[n + 1] + stiffness * motion[n]) * INVERSES[n]
        )
    for n in range(terms):
        speed[n] = (n + 1) * motion[n + 1]


@kernel
def fill_condition(number, acceleration, rate, damping, terms, speed, condition):
    """Fill the coefficients of what vanishes where stationary: ``2 xi z + a``, ``z``, ``z'`` or ``z + 2 xi z'``."""
    level = 2.0 * damping if number == 0 else (0.0 if number == 2 else 1.0)
    slope = 0.0 if number < 2 else (1.0 if number == 2 else 2.0 * damping)
    for n in range(terms):
        condition[n] = level * speed[n] + slope * (n + 1) * speed[n + 1]
    if number == 0:
        condition[0] += acceleration
        condition[1] += rate


@kernel
def derivative(series, terms, order, phase):
    """Return the value (order 0), first or second derivative of a series."""
    total = 0.0
    for n in range(terms - 1, order - 1, -1):
        factor = 1.0 if order == 0 else (n if order == 1 else n * (n - 1))
        total = total * phase + factor * series[n]
    return total


@kernel
def is_monotone(series, terms, span):
    """Tell whether the linear term outweighs all higher ones over the whole span."""
    higher = 0.0
    for n in range(terms - 1, 1, -1):
        higher = higher * span + n * abs(series[n])
    return higher * span < abs(series[1])


@kernel
def root(series, terms, order, left, right, at_left, at_right):
    """Return the root between two phases with values of opposite sign (regula falsi, Illinois)."""
    tolerance = ROOT_TOLERANCE * (right - left)
    phase = left
    for _ in range(ROOT_STEPS):
        previous = phase
        phase = (left * at_right - right * at_left) / (at_right - at_left)
        here = derivative(series, terms, order, phase)
        if abs(phase - previous) <= tolerance or here == 0.0:
            break
        if here * at_right < 0.0:
            left, at_left = right, at_right
        else:
            at_left *= 0.5
        right, at_right = phase, here
    return phase


@kernel
def stationary_phases(series, terms, span, points):
    """Leave in the points both ends and every root of the series in between, among others; return how many."""
    points[0], points[1] = 0.0, span
    count = 2
    order = 0 if is_monotone(series, terms, span) else 2
    while order >= 0:
        at_right = derivative(series, terms, order, points[count - 1])
        for i in range(count - 1, 0, -1):
            at_left = derivative(series, terms, order, points[i - 1])
            if at_left * at_right < 0.0:
                for k in range(count, i, -1):
                    points[k] = points[k - 1]
                points[i] = root(
                    series, terms, order, points[i - 1], points[i + 1], at_left, at_right
                )
                count += 1
            at_right = at_left
        order -= 1
    return count


@kernel
def largest_in_step(u, z, start, end, damping, phase, wanted, work, largest):
    """
    Raise the largest squared radius, ``|u|``, ``|z|`` and ``|u + 2 xi z|`` to those at the wanted stationary points.

    The step starts from the state ``u, z`` and the acceleration goes from start to end; long steps
    are cut into spans.
    """
    spans = math.ceil(phase / LONGEST_SPAN)
    span = phase / spans
    terms = series_terms(span)
    rate = (end - start) / phase
    motion, speed, condition, points = work[0], work[1], work[2], work[3]
    for i in range(spans):
        acceleration = start + rate * (i * span)
        fill_series(u, z, acceleration, rate, 1.0, damping, terms, motion, speed)
        for number in range(4):
            points[0], points[1] = 0.0, span
            count = 2
            if wanted[number]:
                fill_condition(number, acceleration, rate, damping, terms - 1, speed, condition)
                count = stationary_phases(condition, terms - 1, span, points)
            for k in range(1, count):
                u = derivative(motion, terms, 0, points[k])
                z = derivative(speed, terms, 0, points[k])
                largest[0] = max(largest[0], u * u + z * z)
                largest[1] = max(largest[1], abs(u))
                largest[2] = max(largest[2], abs(z))
                largest[3] = max(largest[3], abs(u + 2.0 * damping * z))


@kernel
def radius_bound(square, peak, damping, phase):
    """Return what the radius cannot exceed within half a step of samples: it grows by at most ``|a|`` a phase."""
    return (math.sqrt(square) + 0.5 * phase * peak) * math.exp(damping * phase)


@kernel
def rate_bounds(radius, peak, jump, damping, phase):
    """
    Return bounds, times the phase of a step, of ``|z'|``, ``|z''|`` and ``|(r²)''|``.

    From ``|u + 2 xi z| <= sqrt(1 + 4 xi²) r``, ``z' = -(u + 2 xi z) - a``, ``z'' = -2 xi z' - z -
    a'``, ``(r²)'' = -8 xi z z' - 2 a z' - 2 z a'`` and ``a' = jump / phase``.
    """
    speed = phase * (math.sqrt(1.0 + 4.0 * damping * damping) * radius + peak)
    return (
        speed,
        2.0 * damping * speed + phase * radius + jump,
        speed * (8.0 * damping * radius + 2.0 * peak) + 2.0 * radius * jump,
    )


@kernel
def slacks(rates, damping, phase):
    """
    Return by how much squared radius, ``|u|``, ``|z|`` and ``|u + 2 xi z|`` can exceed two samples between them.

    Each is ``phase² / 8`` times a bound of its second derivative.
    """
    speed, change, square = rates
    eighth = 0.125 * phase
    return (
        eighth * square,
        eighth * speed,
        eighth * change,
        eighth * (speed + 2.0 * damping * change),
    )


@kernel
def velocity_slack(highest, rates, jump, damping, phase):
    """
    Return by how much ``|z|`` can exceed the highest of its samples between them, from ``z'' = -2 xi z' - z - a'``.

    Tighter than `slacks` where the oscillator is stiff: ``|z|`` is far below the radius there.
    """
    speed, change, _ = rates
    eighth = 0.125 * phase
    return eighth * min(change, 2.0 * damping * speed + phase * (highest + eighth * change) + jump)


@kernel
def step_velocity_bound(u, z, start, u_end, z_end, end, rates, damping, phase):
    """
    Return what ``|z|`` cannot exceed in a step.

    It leaves the cubic with the same values and slopes at both ends by at most ``phase⁴ |z''''| /
    384``, like ``s² (1 - s)²``; both together are a Bernstein polynomial, which never exceeds the
    largest of its coefficients. Each derivative of z, times a power of the phase, is bounded from
    its values at the ends and from the next one.
    """
    lag, jump = 2.0 * damping * phase, phase * (end - start)
    first, first_end = -lag * z - phase * (u + start), -lag * z_end - phase * (u_end + end)
    square = phase * phase
    second, second_end = -lag * first - square * z - jump, -lag * first_end - square * z_end - jump
    third = max(abs(lag * second + square * first), abs(lag * second_end + square * first_end))
    widest = phase * rates[1]
    third += 0.5 * (lag * (lag * widest + square * rates[0]) + square * widest)
    fourth = lag * third + square * (max(abs(second), abs(second_end)) + 0.5 * third)
    middle = abs(0.5 * (z + z_end) + (first - first_end) / 6.0) + fourth / 144.0
    return max(abs(z), abs(z_end), abs(z + 0.25 * first), abs(z_end - 0.25 * first_end), middle)


@kernel
def may_exceed(u, z, start, end, damping, phase, largest):
    """
    Tell whether a step may hold a new largest value.

    The particular solution moves on a line, and around it the radius of the free vibration never
    grows.
    """
    rate = (end - start) / phase
    lean = 2.0 * damping * rate
    swing = math.hypot(u + start - lean, z + rate)
    still = max(abs(lean - start), abs(lean - end))
    felt = max(abs(start), abs(end)) + math.sqrt(1.0 + 4.0 * damping * damping) * swing
    return (
        math.hypot(still, rate) + swing > math.sqrt(largest[0])
        or still + swing > largest[1]
        or abs(rate) + swing > largest[2]
        or felt > largest[3]
    )


@kernel
def dips(rates, damping, phase):
    """
    Return how far ``2 xi z + a``, ``z``, ``z'`` and ``z + 2 xi z'`` can leave the straight line between two samples.

    Each is ``phase² / 8`` times a bound of its second derivative, which for ``z'`` is ``-2 xi z'' -
    z'``.
    """
    speed, change, _ = rates
    z = 0.125 * phase * change
    change_dip = 0.125 * phase * (2.0 * damping * change + speed)
    return 2.0 * damping * z, z, change_dip, z + 2.0 * damping * change_dip


@kernel
def may_vanish(at_start, at_end, dip):
    """Tell whether a function can have a root within a step over which it leaves the straight line by no more."""
    return at_start * at_end <= 0.0 or min(abs(at_start), abs(at_end)) <= dip


@kernel
def find_wanted(
    u, z, start, u_end, z_end, end, damping, phase, radius, quantities, largest, wanted
):
    """
    Tell which stationary points of a step may raise the largest values, in the order of `fill_condition`.

    A point is wanted if the bound of its quantity exceeds the largest value and its condition may
    vanish in the step; those of the displacement are also the radius's.
    """
    if phase > LONGEST_SPAN and not may_exceed(u, z, start, end, damping, phase, largest):
        return False
    twice = 2.0 * damping
    rates = rate_bounds(radius, max(abs(start), abs(end)), abs(end - start), damping, phase)
    slack, dip = slacks(rates, damping, phase), dips(rates, damping, phase)
    higher = max(u * u + z * z, u_end * u_end + z_end * z_end) + slack[0] > largest[0]
    wanted[0] = higher and may_vanish(twice * z + start, twice * z_end + end, dip[0])
    wanted[1] = wanted[2] = wanted[3] = False
    if quantities > 1:
        felt, felt_end = u + twice * z, u_end + twice * z_end
        change, change_end = -felt - start, -felt_end - end
        higher |= max(abs(u), abs(u_end)) + slack[1] > largest[1]
        if step_velocity_bound(u, z, start, u_end, z_end, end, rates, damping, phase) > largest[2]:
            wanted[2] = may_vanish(change, change_end, dip[2])
        if max(abs(felt), abs(felt_end)) + slack[3] > largest[3]:
            wanted[3] = may_vanish(z + twice * change, z_end + twice * change_end, dip[3])
    wanted[1] = higher and may_vanish(z, z_end, dip[1])
    return wanted[0] or wanted[1] or wanted[2] or wanted[3]


@kernel
def workspace():
    """Return scratch rows: series of displacement, velocity and condition, and points."""
    return np.empty((4, TERMS + 1))
