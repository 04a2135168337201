r"""
The bilinear oscillator with kinematic hardening, exact within its linear branches.

``u'' + 2 xi z + alpha u + (1 - alpha) y = -a`` with ``z = u'``, time as phase ``omega0 * t`` and
``a`` divided by ``omega0²``. While elastic ``y = u - p`` with a constant plastic displacement
``p``; while yielding ``y`` stays at plus or minus the yield displacement and ``p`` moves. Each
branch is an oscillator of stiffness 1 or ``alpha`` under a constant added to ``a``, whose Taylor
series is exact over a short span whatever ``alpha`` and damping are. A branch ends where ``|u -
p|`` passes the yield displacement, or where the velocity of a yielding oscillator vanishes; both
events are located.
"""

import math

import numpy as np

from per_obspy.kernels._jit import kernel
from per_obspy.kernels.oscillator.within_step import (
    bracketed_root,
    derivative,
    fill_series,
    series_terms,
    stationary_phases,
    workspace,
)

#: Longest span of one branch's series, in phase: short enough for the bounds of `_is_plain` at any
#: damping below 1.
BRANCH_SPAN = 0.25
#: Yielding begins when the yield displacement is exceeded by this part of it, so that rounding
#: cannot begin it.
YIELD_EXCESS = 1e-12
#: More events than this in one span mean a state on the edge within rounding; the rest is taken as
#: it is.
EVENTS = 50
#: Free vibration after the record ends when yielding is over, at the latest after so many periods.
YIELDING_PERIODS = 200

# state: displacement, velocity, plastic displacement, branch (0 elastic, +1 or -1 yielding)
# largest: |u|, u² + z², alpha u² + (1 - alpha) y² + z², path of the plastic displacement


@kernel
def span_coefficients(stiffness, damping, span, coefficients):
    """
    Fill the coefficients (2, 4) of displacement and velocity after a span.

    They multiply displacement and velocity before the span, the force and its rate.
    """
    work = workspace()
    terms = series_terms(span)
    for column in range(4):
        # Response to a unit of one of the four
        unit = np.zeros(4)
        unit[column] = 1.0
        fill_series(unit[0], unit[1], unit[2], unit[3], stiffness, damping, terms, work[0], work[1])
        coefficients[0, column] = derivative(work[0], terms, 0, span)
        coefficients[1, column] = derivative(work[1], terms, 0, span)


@kernel
def _raise_at(u, z, plastic, branch, yielding, hardening, largest):
    """Raise the largest values to those of one state."""
    y = u - plastic if branch == 0.0 else branch * yielding
    # Displacement, displacement radius and energy radius
    largest[0] = max(largest[0], abs(u))
    largest[1] = max(largest[1], u * u + z * z)
    largest[2] = max(largest[2], hardening * u * u + (1.0 - hardening) * y * y + z * z)


@kernel
def _is_plain(
    u,
    z,
    u_end,
    z_end,
    plastic,
    branch,
    force,
    rate,
    stiffness,
    damping,
    span,
    yielding,
    hardening,
    largest,
):
    """
    Return whether a span holds neither an event nor a new largest value between its ends.

    ``|u''|`` stays below m with ``m (1 - 2 xi s - stiffness s²) = 2 xi |z| + stiffness (|u| + s
    |z|) + |force|``; over a span s a function leaves the straight line between its ends by no more
    than ``s² / 8`` of its second derivative.
    """
    # Bounds of acceleration, velocity and change of acceleration
    push = max(abs(force), abs(force + rate * span))
    m = 2.0 * damping * abs(z) + stiffness * (abs(u) + span * abs(z)) + push
    m /= 1.0 - 2.0 * damping * span - stiffness * span * span
    fastest = abs(z) + span * m
    change = 2.0 * damping * m + stiffness * fastest + abs(rate)
    eighth = 0.125 * span * span
    # Events: yielding begins, or the velocity of a yielding oscillator vanishes
    if branch == 0.0:
        if max(abs(u - plastic), abs(u_end - plastic)) + eighth * m >= yielding:
            return False
    elif min(branch * z, branch * z_end) <= eighth * change:
        return False
    # Largest displacement
    farthest = max(abs(u), abs(u_end))
    if farthest + eighth * m > largest[0]:
        return False
    # Displacement radius, and energy radius with the elastoplastic part y
    y, y_end = (u - plastic, u_end - plastic) if branch == 0.0 else (yielding, yielding)
    reach = max(farthest, abs(y), abs(y_end)) + span * fastest
    slack = 2.0 * eighth * (fastest * fastest + reach * m + m * m + fastest * change)
    if max(u * u + z * z, u_end * u_end + z_end * z_end) + slack > largest[1]:
        return False
    before = hardening * u * u + (1.0 - hardening) * y * y + z * z
    after = hardening * u_end * u_end + (1.0 - hardening) * y_end * y_end + z_end * z_end
    return max(before, after) + slack <= largest[2]


@kernel
def _event(plastic, branch, yielding, count, terms, work):
    """Return the phase at which the branch ends (negative if it does not) and the next branch."""
    displacement, velocity, condition, points = work[0], work[1], work[2], work[3]
    for k in range(1, count):
        if branch == 0.0:
            # Elastic: y passes the yield displacement on one side
            y = derivative(displacement, terms, 0, points[k]) - plastic
            if abs(y) > yielding * (1.0 + YIELD_EXCESS):
                side = math.copysign(1.0, y)
                for n in range(terms + 1):
                    condition[n] = displacement[n]
                condition[0] -= plastic + side * yielding
                at_left = derivative(condition, terms, 0, points[k - 1])
                if side * at_left >= 0.0:
                    return points[k - 1], side
                at_right = y - side * yielding
                phase = bracketed_root(
                    condition, terms, 0, points[k - 1], points[k], at_left, at_right
                )
                return phase, side
        else:
            # Yielding: the velocity changes its sign
            at_right = derivative(velocity, terms - 1, 0, points[k])
            if branch * at_right <= 0.0:
                at_left = derivative(velocity, terms - 1, 0, points[k - 1])
                if branch * at_left <= 0.0:
                    return points[k - 1], 0.0
                phase = bracketed_root(
                    velocity, terms - 1, 0, points[k - 1], points[k], at_left, at_right
                )
                return phase, 0.0
    # No event on this branch
    return -1.0, branch


@kernel
def _raise_between(plastic, branch, stiffness, yielding, hardening, span, terms, work, largest):
    """Raise the largest values to those at the stationary points of a piece of one branch."""
    displacement, velocity, condition, points = work[0], work[1], work[2], work[3]
    for number in range(3):
        # z = 0; u + z' = 0 for the displacement radius; stiffness u + constant + z' = 0 for the
        # energy radius
        for n in range(terms - 1):
            own = 0.0
            if number > 0:
                own = displacement[n] if number == 1 else stiffness * displacement[n]
            condition[n] = velocity[n] if number == 0 else own + (n + 1) * velocity[n + 1]
        if number == 2 and branch == 0.0:
            condition[0] -= (1.0 - hardening) * plastic
        # Values at the roots of this condition
        count = stationary_phases(condition, terms - 1, span, points)
        for k in range(1, count):
            u = derivative(displacement, terms, 0, points[k])
            z = derivative(velocity, terms - 1, 0, points[k])
            _raise_at(u, z, plastic, branch, yielding, hardening, largest)


@kernel
def cross_span(state, acceleration, rate, damping, span, yielding, hardening, work, largest):
    """Advance the state over a span with all its events, and raise the largest values."""
    remaining = span
    for _ in range(EVENTS):
        u, z, plastic, branch = state
        # Constant force of this branch, and its series over what remains of the span
        stiffness = 1.0 if branch == 0.0 else hardening
        offset = -(1.0 - hardening) * plastic
        if branch != 0.0:
            offset = (1.0 - hardening) * branch * yielding
        terms = series_terms(remaining)
        fill_series(u, z, acceleration + offset, rate, stiffness, damping, terms, work[0], work[1])
        # First event: the displacement is monotone between its stationary points
        count = stationary_phases(work[1], terms - 1, remaining, work[3])
        phase, following = _event(plastic, branch, yielding, count, terms, work)
        piece = remaining if phase < 0.0 else phase
        _raise_between(plastic, branch, stiffness, yielding, hardening, piece, terms, work, largest)
        # State at the end of the piece; a yielding oscillator moves its plastic displacement
        state[0] = derivative(work[0], terms, 0, piece)
        state[1] = derivative(work[1], terms - 1, 0, piece)
        if branch != 0.0:
            state[2] = state[0] - branch * yielding
            largest[3] += abs(state[2] - plastic)
        if phase < 0.0:
            break
        # Begin the next branch exactly at its edge
        if following == 0.0:
            state[1] = 0.0
        else:
            state[0] = plastic + following * yielding
        state[3] = following
        acceleration += rate * piece
        remaining -= piece


@kernel
def _advance(
    state, start, end, damping, phase, spans, yielding, hardening, coefficients, work, largest
):
    """Advance the state over a step during which the acceleration goes from start to end."""
    span = phase / spans
    rate = (end - start) / phase
    for i in range(spans):
        acceleration = start + rate * (i * span)
        u, z, plastic, branch = state
        # Force and coefficients of the branch
        stiffness = 1.0 if branch == 0.0 else hardening
        offset = -(1.0 - hardening) * plastic
        if branch != 0.0:
            offset = (1.0 - hardening) * branch * yielding
        force = acceleration + offset
        own = coefficients[0] if branch == 0.0 else coefficients[1]
        # State at the end of the span if it has no event
        u_end = own[0, 0] * u + own[0, 1] * z + (own[0, 2] * force + own[0, 3] * rate)
        z_end = own[1, 0] * u + own[1, 1] * z + (own[1, 2] * force + own[1, 3] * rate)
        if _is_plain(
            u,
            z,
            u_end,
            z_end,
            plastic,
            branch,
            force,
            rate,
            stiffness,
            damping,
            span,
            yielding,
            hardening,
            largest,
        ):
            state[0] = u_end
            state[1] = z_end
            if branch != 0.0:
                state[2] = u_end - branch * yielding
                largest[3] += abs(state[2] - plastic)
        else:
            # Locate the events and the largest values
            cross_span(state, acceleration, rate, damping, span, yielding, hardening, work, largest)


@kernel
def bilinear_history(acceleration, phase, damping, yielding, hardening, history, state, largest):
    """
    Fill the history of a bilinear oscillator at the samples, and let it come to rest.

    Parameters
    ----------
    acceleration : (n + 1,) ndarray
        Ground acceleration divided by ``omega0²``, m, closed by a zero that is not part of the
        history.
    phase : float
        ``omega0 * dt`` of one step, rad.
    damping : float
        Fraction of critical, dimensionless.
    yielding : float
        Yield displacement, m.
    hardening : float
        Post-yield stiffness over elastic stiffness, dimensionless.
    history : (3, n) ndarray
        Receives displacement, velocity over ``omega0`` and plastic displacement, m.
    state : (4,) ndarray
        Displacement, velocity over ``omega0``, plastic displacement (m) and branch (0 elastic, +1
        or -1 yielding): zero before, and afterwards the state when no more yielding is possible.
    largest : (4,) ndarray
        ``|u|`` (m), ``u² + z²`` (m²), ``alpha u² + (1 - alpha) y² + z²`` (m²) and path of the
        plastic displacement (m): zero before, and afterwards the largest values.
    """
    # Coefficients of one span of either branch
    work = workspace()
    coefficients = np.empty((2, 2, 4))
    spans = max(1, math.ceil(phase / BRANCH_SPAN))
    span_coefficients(1.0, damping, phase / spans, coefficients[0])
    span_coefficients(hardening, damping, phase / spans, coefficients[1])
    # Motion during the record
    history[0, 0] = history[1, 0] = history[2, 0] = 0.0
    for i in range(1, acceleration.size):
        _advance(
            state,
            acceleration[i - 1],
            acceleration[i],
            damping,
            phase,
            spans,
            yielding,
            hardening,
            coefficients,
            work,
            largest,
        )
        if i < history.shape[1]:
            history[0, i] = state[0]
            history[1, i] = state[1]
            history[2, i] = state[2]
    # Free vibration, period by period, until yielding is over
    steps = math.ceil(2.0 * math.pi / BRANCH_SPAN)
    span_coefficients(1.0, damping, BRANCH_SPAN, coefficients[0])
    span_coefficients(hardening, damping, BRANCH_SPAN, coefficients[1])
    for _ in range(YIELDING_PERIODS):
        is_elastic = _is_over(state, yielding, hardening)
        for _ in range(steps):
            _advance(
                state,
                0.0,
                0.0,
                damping,
                BRANCH_SPAN,
                1,
                yielding,
                hardening,
                coefficients,
                work,
                largest,
            )
        if is_elastic:
            break


@kernel
def _is_over(state, yielding, hardening):
    """Return whether the free vibration from this state cannot reach the yield displacement."""
    offset = state[0] - (1.0 - hardening) * state[2]
    reach = math.hypot(offset, state[1]) + hardening * abs(state[2])
    return state[3] == 0.0 and reach <= yielding * (1.0 + YIELD_EXCESS)
