r"""
Largest values between two samples, exact, by Taylor series and the roots of their derivatives.

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
    """Return the number of terms after which a series may end."""
    terms = 4
    size = span * span * span / 6.0
    while size > NEGLIGIBLE and terms < TERMS:
        size *= span / terms
        terms += 1
    return terms


@kernel
def fill_series(u, z, acceleration, rate, stiffness, damping, terms, displacement, velocity):
    """
    Fill the Taylor coefficients of displacement and velocity from the state at the start.

    ``u'' + 2 xi u' + stiffness u = -(acceleration + rate phase)``; the stiffness of the linear
    oscillator is 1.
    """
    # The first terms hold state and acceleration; later ones follow from the two before
    displacement[0] = u
    displacement[1] = z
    displacement[2] = -0.5 * (2.0 * damping * z + stiffness * u + acceleration)
    displacement[3] = -(4.0 * damping * displacement[2] + stiffness * z + rate) / 6.0
    for n in range(2, terms - 1):
        force = 2.0 * damping * (n + 1) * displacement[n + 1] + stiffness * displacement[n]
        displacement[n + 2] = -force * INVERSES[n]
    # The velocity is the derivative, term by term
    for n in range(terms):
        velocity[n] = (n + 1) * displacement[n + 1]


@kernel
def fill_condition(number, acceleration, rate, damping, terms, velocity, condition):
    """
    Fill the coefficients of a condition that vanishes at stationary points.

    Conditions by number: ``2 xi z + a``, ``z``, ``z'``, ``z + 2 xi z'``.
    """
    # Factors of z and of z'
    level = 2.0 * damping if number == 0 else (0.0 if number == 2 else 1.0)
    slope = 0.0 if number < 2 else (1.0 if number == 2 else 2.0 * damping)
    for n in range(terms):
        condition[n] = level * velocity[n] + slope * (n + 1) * velocity[n + 1]
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
    """Return whether the linear term outweighs all higher ones over the whole span."""
    higher = 0.0
    for n in range(terms - 1, 1, -1):
        higher = higher * span + n * abs(series[n])
    return higher * span < abs(series[1])


@kernel
def bracketed_root(series, terms, order, left, right, at_left, at_right):
    """Return the root between two phases with values of opposite sign (regula falsi, Illinois)."""
    tolerance = ROOT_TOLERANCE * (right - left)
    phase = left
    for _ in range(ROOT_STEPS):
        # Root of the chord between the ends of the bracket
        previous = phase
        phase = (left * at_right - right * at_left) / (at_right - at_left)
        value = derivative(series, terms, order, phase)
        if abs(phase - previous) <= tolerance or value == 0.0:
            break
        # Replace one end; halve the value at an end that stays twice
        if value * at_right < 0.0:
            left = right
            at_left = at_right
        else:
            at_left *= 0.5
        right = phase
        at_right = value
    return phase


@kernel
def stationary_phases(series, terms, span, points):
    """
    Fill the points with both ends and every root of the series in between; return their number.

    Roots of the derivatives are among the points too.
    """
    points[0] = 0.0
    points[1] = span
    count = 2
    # From the second derivative down to the series itself: the points so far bound pieces on
    # which the next lower derivative is monotone
    order = 0 if is_monotone(series, terms, span) else 2
    while order >= 0:
        at_right = derivative(series, terms, order, points[count - 1])
        for i in range(count - 1, 0, -1):
            at_left = derivative(series, terms, order, points[i - 1])
            if at_left * at_right < 0.0:
                # Insert the root of this piece
                for k in range(count, i, -1):
                    points[k] = points[k - 1]
                left = points[i - 1]
                right = points[i + 1]
                points[i] = bracketed_root(series, terms, order, left, right, at_left, at_right)
                count += 1
            at_right = at_left
        order -= 1
    return count


@kernel
def largest_in_step(u, z, start, end, damping, phase, selected, work, largest):
    """
    Raise the largest values to those at the selected stationary points of a step.

    The values are squared radius, ``|u|``, ``|z|`` and ``|u + 2 xi z|``. The step starts from the
    state ``u, z`` and the acceleration goes from start to end; long steps are cut into spans.
    """
    spans = math.ceil(phase / LONGEST_SPAN)
    span = phase / spans
    terms = series_terms(span)
    rate = (end - start) / phase
    displacement, velocity, condition, points = work[0], work[1], work[2], work[3]
    for i in range(spans):
        # Series of the motion over this span
        acceleration = start + rate * (i * span)
        fill_series(u, z, acceleration, rate, 1.0, damping, terms, displacement, velocity)
        for number in range(4):
            if selected[number]:
                # Raise all four values to those at the stationary points inside
                fill_condition(number, acceleration, rate, damping, terms - 1, velocity, condition)
                count = stationary_phases(condition, terms - 1, span, points)
                for k in range(1, count - 1):
                    raise_values(displacement, velocity, terms, points[k], damping, largest)
        # The end of the span starts the next one
        u, z = raise_values(displacement, velocity, terms, span, damping, largest)


@kernel
def raise_values(displacement, velocity, terms, phase, damping, largest):
    """Raise the largest values to those at a phase; return displacement and velocity there."""
    u = derivative(displacement, terms, 0, phase)
    z = derivative(velocity, terms, 0, phase)
    # Squared radius, displacement, velocity, absolute acceleration
    largest[0] = max(largest[0], u * u + z * z)
    largest[1] = max(largest[1], abs(u))
    largest[2] = max(largest[2], abs(z))
    largest[3] = max(largest[3], abs(u + 2.0 * damping * z))
    return u, z


@kernel
def radius_bound(square, peak, damping, phase):
    """
    Return a bound of the radius within half a step of samples with this squared radius.

    It grows by at most ``|a|`` per unit of phase.
    """
    return (math.sqrt(square) + 0.5 * phase * peak) * math.exp(damping * phase)


@kernel
def rate_bounds(radius, peak, jump, damping, phase):
    """
    Return bounds, times the phase of a step, of ``|z'|``, ``|z''|`` and ``|(r²)''|``.

    From ``|u + 2 xi z| <= sqrt(1 + 4 xi²) r``, ``z' = -(u + 2 xi z) - a``, ``z'' = -2 xi z' - z -
    a'``, ``(r²)'' = -8 xi z z' - 2 a z' - 2 z a'`` and ``a' = jump / phase``.
    """
    first = phase * (math.sqrt(1.0 + 4.0 * damping * damping) * radius + peak)
    second = 2.0 * damping * first + phase * radius + jump
    square = first * (8.0 * damping * radius + 2.0 * peak) + 2.0 * radius * jump
    return first, second, square


@kernel
def slacks(rates, damping, phase):
    """
    Return bounds of how far values between two samples can exceed those at the samples.

    The values are squared radius, ``|u|``, ``|z|`` and ``|u + 2 xi z|``; each bound is ``phase² /
    8`` times one of the second derivative.
    """
    first, second, square = rates
    eighth = 0.125 * phase
    return (
        eighth * square,
        eighth * first,
        eighth * second,
        eighth * (first + 2.0 * damping * second),
    )


@kernel
def velocity_slack(highest, rates, jump, damping, phase):
    """
    Return a bound of how far ``|z|`` between two samples can exceed the highest sample.

    From ``z'' = -2 xi z' - z - a'``. Tighter than `slacks` where the oscillator is stiff: ``|z|``
    is far below the radius there.
    """
    first, second, _ = rates
    eighth = 0.125 * phase
    stiff = 2.0 * damping * first + phase * (highest + eighth * second) + jump
    return eighth * min(second, stiff)


@kernel
def step_velocity_bound(u, z, start, u_end, z_end, end, rates, damping, phase):
    """
    Return a bound of ``|z|`` in a step.

    It leaves the cubic with the same values and slopes at both ends by at most ``phase⁴ |z''''| /
    384``, like ``s² (1 - s)²``; both together are a Bernstein polynomial, which never exceeds the
    largest of its coefficients. Each derivative of z, times a power of the phase, is bounded from
    its values at the ends and from the next one.
    """
    viscosity = 2.0 * damping * phase
    jump = phase * (end - start)
    square = phase * phase
    # First and second derivative of z at the ends, from the equation of motion
    first = -viscosity * z - phase * (u + start)
    first_end = -viscosity * z_end - phase * (u_end + end)
    second = -viscosity * first - square * z - jump
    second_end = -viscosity * first_end - square * z_end - jump
    # Third derivative: largest value at the ends, and half a step of the fourth from there
    third = max(
        abs(viscosity * second + square * first),
        abs(viscosity * second_end + square * first_end),
    )
    widest = phase * rates[1]
    third += 0.5 * (viscosity * (viscosity * widest + square * rates[0]) + square * widest)
    # Fourth derivative, from third and second
    fourth = viscosity * third + square * (max(abs(second), abs(second_end)) + 0.5 * third)
    # Largest Bernstein coefficient: both ends, two inner ones, and the middle with the deviation
    middle = abs(0.5 * (z + z_end) + (first - first_end) / 6.0) + fourth / 144.0
    return max(abs(z), abs(z_end), abs(z + 0.25 * first), abs(z_end - 0.25 * first_end), middle)


@kernel
def may_exceed(u, z, start, end, damping, phase, largest):
    """
    Return whether a step may hold a new largest value.

    The particular solution moves on a line, and around it the radius of the free vibration never
    grows.
    """
    rate = (end - start) / phase
    lean = 2.0 * damping * rate
    # Radius of the free vibration around the particular solution
    swing = math.hypot(u + start - lean, z + rate)
    # Largest displacement and absolute acceleration of the particular solution
    static = max(abs(lean - start), abs(lean - end))
    absolute = max(abs(start), abs(end)) + math.sqrt(1.0 + 4.0 * damping * damping) * swing
    return (
        math.hypot(static, rate) + swing > math.sqrt(largest[0])
        or static + swing > largest[1]
        or abs(rate) + swing > largest[2]
        or absolute > largest[3]
    )


@kernel
def sags(rates, damping, phase):
    """
    Return bounds of how far the conditions can leave the straight line between two samples.

    The conditions are ``2 xi z + a``, ``z``, ``z'`` and ``z + 2 xi z'``. Each bound is ``phase² /
    8`` times one of the second derivative, which for ``z'`` is ``-2 xi z'' - z'``.
    """
    first, second, _ = rates
    z = 0.125 * phase * second
    z_rate = 0.125 * phase * (2.0 * damping * second + first)
    return 2.0 * damping * z, z, z_rate, z + 2.0 * damping * z_rate


@kernel
def may_vanish(at_start, at_end, sag):
    """Return whether a function that leaves its chord by at most the sag can have a root."""
    return at_start * at_end <= 0.0 or min(abs(at_start), abs(at_end)) <= sag


@kernel
def select_conditions(
    u, z, start, u_end, z_end, end, damping, phase, radius, quantities, largest, selected
):
    """
    Select the stationary points of a step that may raise the largest values; return if any.

    They are numbered as in `fill_condition`. A point is selected if the bound of its quantity
    exceeds the largest value and its condition may vanish in the step; those of the displacement
    are also the radius's.
    """
    # Long steps: rule the whole step out first
    if phase > LONGEST_SPAN and not may_exceed(u, z, start, end, damping, phase, largest):
        return False
    viscosity = 2.0 * damping
    rates = rate_bounds(radius, max(abs(start), abs(end)), abs(end - start), damping, phase)
    slack = slacks(rates, damping, phase)
    sag = sags(rates, damping, phase)
    # Radius: stationary where 2 xi z + a = 0
    higher = max(u * u + z * z, u_end * u_end + z_end * z_end) + slack[0] > largest[0]
    selected[0] = higher and may_vanish(viscosity * z + start, viscosity * z_end + end, sag[0])
    selected[1] = selected[2] = selected[3] = False
    if quantities > 1:
        absolute = u + viscosity * z
        absolute_end = u_end + viscosity * z_end
        # Derivative z' at the ends, from the equation of motion
        z_rate = -absolute - start
        z_rate_end = -absolute_end - end
        higher |= max(abs(u), abs(u_end)) + slack[1] > largest[1]
        # Velocity: stationary where z' = 0
        if step_velocity_bound(u, z, start, u_end, z_end, end, rates, damping, phase) > largest[2]:
            selected[2] = may_vanish(z_rate, z_rate_end, sag[2])
        # Absolute acceleration: stationary where z + 2 xi z' = 0
        if max(abs(absolute), abs(absolute_end)) + slack[3] > largest[3]:
            selected[3] = may_vanish(z + viscosity * z_rate, z_end + viscosity * z_rate_end, sag[3])
    # Radius and displacement: stationary where z = 0
    selected[1] = higher and may_vanish(z, z_end, sag[1])
    return selected[0] or selected[1] or selected[2] or selected[3]


@kernel
def workspace():
    """Return scratch rows: series of displacement, velocity and condition, and points."""
    return np.empty((4, TERMS + 1))
