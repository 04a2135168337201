r"""
The search inside a step: largest values between two samples, exact, and bounds that rule steps out.

The radius is stationary where ``2 xi z + a = 0`` or ``z = 0``, the displacement where ``z = 0``,
the velocity where ``z' = 0``, the absolute acceleration ``-(u + 2 xi z)`` where ``z + 2 xi z' =
0``. A condition whose slope at one end of a step exceeds its largest change over the step has one
root at most, which lies close to that of the cubic with the same values and slopes at both ends;
Newton's method on the Taylor series corrects it.

In other steps every root is found. The second derivative of each condition solves the homogeneous
equation of the oscillator, so that it has at most one root in a span of half a radian. That root
bounds the pieces on which the first derivative is monotone, whose roots bound the pieces on which
the condition is monotone: no stationary point can be missed. Displacements are counted in ``a /
omega²``, time as phase. Largest values are squared radius, ``|u|``, ``|z|`` and ``|u + 2 xi z|``;
infinite ones do not count.
"""

import math

import numpy as np

from per_obspy.kernels._jit import kernel, lean

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
#: Newton steps on the cubic, and on the series at most; shift of a root whose third power is
#: rounding, in phase and as a part of the step.
CUBIC_STEPS, SERIES_STEPS, SMALL_SHIFT, SMALL_PART = 2, 4, 1e-5, 3e-4
#: ``1 / ((n + 2) (n + 1))``: a division takes as long as three multiply-adds.
INVERSES = tuple(1.0 / ((n + 2) * (n + 1)) for n in range(TERMS))


@lean
def series_terms(span):
    """Return the number of terms after which a series may end."""
    terms = 4
    size = span * span * span / 6.0
    while size > NEGLIGIBLE and terms < TERMS:
        size *= span / terms
        terms += 1
    return terms


@lean
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


@lean
def _factors(number, damping):
    """Return the factors of z, z' and the acceleration in a condition, in the module's order."""
    viscosity = 2.0 * damping
    if number == 0:
        return viscosity, 0.0, 1.0
    if number == 1:
        return 1.0, 0.0, 0.0
    return (0.0, 1.0, 0.0) if number == 2 else (1.0, viscosity, 0.0)


@lean
def _condition(number, u, z, acceleration, rate, damping):
    """Return a condition and its derivative with respect to the phase, from the state."""
    level, slope, ground = _factors(number, damping)
    first = -(2.0 * damping * z + u + acceleration)
    second = -(2.0 * damping * first + z + rate)
    value = level * z + slope * first + ground * acceleration
    return value, level * first + slope * second + ground * rate


@lean
def derivative(series, terms, order, phase):
    """Return the value (order 0), first or second derivative of a series."""
    total = 0.0
    for n in range(terms - 1, order - 1, -1):
        factor = 1.0 if order == 0 else (n if order == 1 else n * (n - 1))
        total = total * phase + factor * series[n]
    return total


@lean
def is_monotone(series, terms, span):
    """Return whether the linear term outweighs all higher ones over the whole span."""
    higher = 0.0
    for n in range(terms - 1, 1, -1):
        higher = higher * span + n * abs(series[n])
    return higher * span < abs(series[1])


@lean
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


@lean
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


@lean
def largest_in_step(u, z, start, end, damping, phase, selected, work, largest):
    """
    Raise the largest values to those at the stationary points of a step.

    Conditions are selected by the bits of a number. The step starts from the state ``u, z`` and the
    acceleration goes from start to end; long steps are cut into spans.
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
            if selected >> number & 1:
                # Series of the condition
                level, slope, ground = _factors(number, damping)
                for n in range(terms - 1):
                    condition[n] = level * velocity[n] + slope * (n + 1) * velocity[n + 1]
                condition[0] += ground * acceleration
                condition[1] += ground * rate
                # Raise all four values to those at the stationary points inside
                count = stationary_phases(condition, terms - 1, span, points)
                for k in range(1, count - 1):
                    _raise_at(displacement, velocity, terms, points[k], damping, largest)
        # The end of the span starts the next one
        u, z = _raise_at(displacement, velocity, terms, span, damping, largest)


@lean
def _raise_at(displacement, velocity, terms, phase, damping, largest):
    """Raise the largest values to those at a phase; return displacement and velocity there."""
    # Displacement, velocity, and the four quantities
    u = derivative(displacement, terms, 0, phase)
    z = derivative(velocity, terms, 0, phase)
    largest[0] = max(largest[0], u * u + z * z)
    largest[1] = max(largest[1], abs(u))
    largest[2] = max(largest[2], abs(z))
    largest[3] = max(largest[3], abs(u + 2.0 * damping * z))
    return u, z


@lean
def radius_bound(square, peak, damping, phase):
    """
    Return a bound of the radius within half a step of samples with this squared radius.

    It grows by at most ``|a|`` per unit of phase.
    """
    return (math.sqrt(square) + 0.5 * phase * peak) * math.exp(damping * phase)


@lean
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


@lean
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


@lean
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


@lean
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


@lean
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


@lean
def raise_in_step(ends, radius, damping, phase, terms, work, best):
    """
    Raise the largest values to those at the stationary points of a step.

    Parameters
    ----------
    ends : tuple of float
        u, z and the acceleration before and after the step.
    radius : float
        Bound of the radius in the step.
    damping, phase : float
        Fraction of critical; phase ``omega * dt`` of the step, rad.
    terms : int
        Of the series of a step, from `series_terms`.
    work, best : ndarray from `workspace`, (4,) ndarray
        Room; largest values so far, infinite where a quantity does not count, raised in place.
    """
    u, z, start, _, _, end = ends
    # Long steps: rule the whole step out first
    if phase > LONGEST_SPAN and not may_exceed(u, z, start, end, damping, phase, best):
        return
    rates = rate_bounds(radius, max(abs(start), abs(end)), abs(end - start), damping, phase)
    selected = _select(ends, rates, damping, phase, best)
    # Short steps: the one root of a condition
    if phase <= LONGEST_SPAN:
        for number in range(4):
            if selected >> number & 1 and raise_to_root(
                number, ends, rates, damping, phase, terms, work, best
            ):
                selected -= 1 << number
    # Long steps, and conditions that may have several roots: every stationary point
    if selected:
        largest_in_step(u, z, start, end, damping, phase, selected, work, best)


@lean
def _select(ends, rates, damping, phase, best):
    """Return the conditions that may vanish in a step where a value may exceed the largest one."""
    u, z, start, u_end, z_end, end = ends
    viscosity = 2.0 * damping
    slack = slacks(rates, damping, phase)
    # Bit 0: the radius; bit 1: radius or displacement, which share z = 0
    selected = 0
    if max(u * u + z * z, u_end * u_end + z_end * z_end) + slack[0] > best[0]:
        selected = 3
    if max(abs(u), abs(u_end)) + slack[1] > best[1]:
        selected |= 2
    # Velocity by its own bound, absolute acceleration
    if best[2] < np.inf and (
        step_velocity_bound(u, z, start, u_end, z_end, end, rates, damping, phase) > best[2]
    ):
        selected |= 4
    if max(abs(u + viscosity * z), abs(u_end + viscosity * z_end)) + slack[3] > best[3]:
        selected |= 8
    # A condition that keeps further from zero than from its chord has no root
    for number in range(4):
        if selected >> number & 1:
            before, _ = _condition(number, u, z, start, 0.0, damping)
            after, _ = _condition(number, u_end, z_end, end, 0.0, damping)
            sag = 0.125 * phase * _change_of_slope(number, rates, damping)
            if before * after > 0.0 and min(abs(before), abs(after)) > sag:
                selected -= 1 << number
    return selected


@lean
def _change_of_slope(number, rates, damping):
    """Return a bound of a condition's second derivative, times the phase of a step."""
    level, slope, _ = _factors(number, damping)
    # The third derivative of z is -2 xi z'' - z'
    return level * rates[1] + slope * (2.0 * damping * rates[1] + rates[0])


@lean
def raise_to_root(number, ends, rates, damping, phase, terms, work, best):
    """
    Raise the largest values to the one at the root of a condition in a short step.

    ``ends``: u, z and the acceleration before and after the step. Returns whether the root is
    found, and it is certain that there is no other.
    """
    # Value and slope of the condition at both ends
    rate = (ends[5] - ends[2]) / phase
    start = _condition(number, ends[0], ends[1], ends[2], rate, damping)
    end = _condition(number, ends[3], ends[4], ends[5], rate, damping)
    # Monotone if a slope exceeds the largest change of slope over the step
    if max(abs(start[1]), abs(end[1])) <= _change_of_slope(number, rates, damping):
        return False
    if start[0] * end[0] >= 0.0:
        return True
    displacement, velocity = work[0], work[1]
    fill_series(ends[0], ends[1], ends[2], rate, 1.0, damping, terms, displacement, velocity)
    # Newton's method on the series, from the root of the cubic
    root = phase * _cubic_root(start, end, phase)
    for _ in range(SERIES_STEPS):
        u = derivative(displacement, terms, 0, root)
        z = derivative(velocity, terms, 0, root)
        value, slope = _condition(number, u, z, ends[2] + rate * root, rate, damping)
        shift = -value / slope
        if abs(shift) <= min(SMALL_SHIFT, SMALL_PART * phase):
            break
        root = min(max(root + shift, 0.0), phase)
    else:
        return False
    # Value at the root, to second order in the last shift; (r²)' = -2 z (2 xi z + a)
    half = 0.5 * shift * value
    if number == 0:
        best[0] = max(best[0], u * u + z * z - 2.0 * z * half)
    elif number == 1:
        best[1] = max(best[1], abs(u + half))
        best[0] = max(best[0], (u + half) * (u + half))
    elif number == 2:
        best[2] = max(best[2], abs(z + half))
    else:
        best[3] = max(best[3], abs(u + 2.0 * damping * z + half))
    return True


@lean
def _cubic_root(start, end, phase):
    """Return the part of a step at which the cubic with these values and slopes nearly vanishes."""
    # Coefficients of the cubic in the part of the step
    value, slope, slope_end = start[0], phase * start[1], phase * end[1]
    change = end[0] - value
    square = 3.0 * change - 2.0 * slope - slope_end
    cube = slope + slope_end - 2.0 * change
    # Newton's method from the root of the chord
    part = -value / change
    for _ in range(CUBIC_STEPS):
        height = value + part * (slope + part * (square + part * cube))
        steepness = slope + part * (2.0 * square + 3.0 * part * cube)
        part = min(max(part - height / steepness, 0.0), 1.0) if steepness != 0.0 else part
    return part


@kernel
def workspace():
    """Return scratch rows: series of displacement, velocity and condition, and points."""
    return np.empty((4, TERMS + 1))
