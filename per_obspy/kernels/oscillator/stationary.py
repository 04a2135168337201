r"""
Stationary radius and displacement within one step, where possible from the root of a cubic.

The displacement is stationary where ``z = 0``, the squared radius also where ``2 xi z + a = 0``. A
condition whose slope at one end exceeds its largest change over the step has one root at most,
which lies close to that of the cubic with the same values and slopes at both ends; Newton's method
on the series corrects it. At a stationary point a small shift changes the value by its square.
Other steps are searched for every root.
"""

from per_obspy.kernels._jit import kernel
from per_obspy.kernels.oscillator.within_step import (
    LONGEST_SPAN,
    derivative,
    fill_series,
    largest_in_step,
    may_vanish,
    select_conditions,
)

#: Newton steps on the cubic, and on the series at most.
CUBIC_STEPS, SERIES_STEPS = 2, 4
#: Shift of a root, in phase, whose third power is rounding.
SMALL_SHIFT = 1e-5


@kernel
def raise_within_step(ends, bounds, damping, phase, terms, quantities, selected, work, best):
    """
    Raise the largest values to those at the stationary points of radius and displacement in a step.

    Parameters
    ----------
    ends : tuple of float
        u, z and the acceleration before and after the step.
    bounds : tuple
        Of the step's tile, from `within_step`: radius, rates, slacks and sags.
    damping, phase : float
        Fraction of critical; phase ``omega * dt`` of the step, rad.
    terms : int
        Of the series of a step, from `within_step.series_terms`.
    quantities : int
        1 if only the squared radius counts, else 4.
    selected, work, best : (4,) ndarray of bool, ndarray from `within_step.workspace`, (4,) ndarray
        Room; largest values so far, infinite where a quantity does not count, raised in place.
    """
    u, z, start, u_end, z_end, end = ends
    radius, rates, slack, sag = bounds
    viscosity = 2.0 * damping
    is_short = phase <= LONGEST_SPAN
    is_doubtful = False
    # Short steps: the one root of 2 xi z + a, then that of z
    is_larger = max(u * u + z * z, u_end * u_end + z_end * z_end) + slack[0] > best[0]
    if is_larger and may_vanish(viscosity * z + start, viscosity * z_end + end, sag[0]):
        is_doubtful = not (
            is_short and raise_to_root(0, ends, rates, damping, phase, terms, work, best)
        )
    if may_vanish(z, z_end, sag[1]):
        is_doubtful |= not (
            is_short and raise_to_root(1, ends, rates, damping, phase, terms, work, best)
        )
    # Long steps, and those that may have several roots: every stationary point
    if is_doubtful and select_conditions(
        u, z, start, u_end, z_end, end, damping, phase, radius, quantities, best, selected
    ):
        largest_in_step(u, z, start, end, damping, phase, selected, work, best)


@kernel
def raise_to_root(number, ends, rates, damping, phase, terms, work, best):
    """
    Raise the largest values to the one at the root of a condition in a short step.

    The condition is ``2 xi z + a`` (number 0) or ``z`` (1). ``ends``: u, z and the acceleration
    before and after the step. Returns whether it is certain that there is no other root.
    """
    # Value and slope of the condition at both ends
    rate = (ends[5] - ends[2]) / phase
    start = _condition(number, ends[0], ends[1], ends[2], rate, damping)
    end = _condition(number, ends[3], ends[4], ends[5], rate, damping)
    # Monotone if a slope exceeds the largest change of slope over the step
    level = 2.0 * damping if number == 0 else 1.0
    if max(abs(start[1]), abs(end[1])) <= level * rates[1]:
        return False
    if start[0] * end[0] < 0.0:
        displacement = work[0]
        velocity = work[1]
        fill_series(ends[0], ends[1], ends[2], rate, 1.0, damping, terms, displacement, velocity)
        root = phase * _cubic_root(start, end, phase)
        _raise(number, root, phase, ends[2], rate, damping, terms, displacement, velocity, best)
    return True


@kernel
def _condition(number, u, z, acceleration, rate, damping):
    """Return a condition and its derivative with respect to the phase."""
    z_rate = -2.0 * damping * z - u - acceleration
    if number == 1:
        return z, z_rate
    return 2.0 * damping * z + acceleration, 2.0 * damping * z_rate + rate


@kernel
def _cubic_root(start, end, phase):
    """Return the part of a step at which the cubic with these values and slopes nearly vanishes."""
    # Coefficients of the cubic in the part of the step
    value = start[0]
    slope = phase * start[1]
    slope_end = phase * end[1]
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
def _raise(number, root, phase, acceleration, rate, damping, terms, displacement, velocity, best):
    """Raise the largest values to the one near a root of a condition."""
    # Newton's method on the series
    for _ in range(SERIES_STEPS):
        u = derivative(displacement, terms, 0, root)
        z = derivative(velocity, terms, 0, root)
        value, slope = _condition(number, u, z, acceleration + rate * root, rate, damping)
        shift = -value / slope
        if abs(shift) <= SMALL_SHIFT:
            break
        root = min(max(root + shift, 0.0), phase)
    # Value at the root, to second order in the last shift
    if number == 1:
        u += 0.5 * shift * z
        best[1] = max(best[1], abs(u))
        best[0] = max(best[0], u * u)
    else:
        best[0] = max(best[0], u * u + z * z - shift * z * value)
