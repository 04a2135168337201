"""Peaks of the relative displacement between the samples of a tile, on the exact solution."""

import math

from per_obspy.kernels._jit import lean
from per_obspy.kernels.oscillator.exact_step import state_after, step_coefficients
from per_obspy.kernels.relative.bounds import between_sample_margins, present_radii
from per_obspy.kernels.spectra.tile_search import TILE

#: Phase of a step in which a peak is sought by one cubic.
LONGEST_PHASE = 0.7
#: Part of such a step: a peak of the cubic this far outside may be one just inside.
OUTSIDE = 0.2
#: Exact steps from the cubic's peak at most.
NEWTON_STEPS = 4
#: Part of a step: the remainder of such a shift is rounding, because the peak is flat.
SETTLED_SHIFT = 1e-9


@lean
def search_pair_tile(pair, dt, north, east, state, margin, largest):
    """
    Raise the largest values (2,) of a pair by the peaks between the samples of a tile.

    ``state`` (4,): ``u`` and ``z = v / omega`` of both structures before the tile. A cubic errs by
    ``margin`` at most.
    """
    first = step_coefficients(pair[0], pair[1], dt)
    second = step_coefficients(pair[3], pair[4], dt)
    # Relative displacement and its slope per step at the first sample
    u1, z1, u2, z2 = state[0], state[1], state[2], state[3]
    distance = pair[2] * u1 - pair[5] * u2
    slope = (pair[2] * pair[0] * z1 - pair[5] * pair[3] * z2) * dt
    end = pair[6] * north[0] + pair[7] * east[0]
    for sample in range(1, TILE + 1):
        before = (u1, z1, u2, z2)
        distance_0 = distance
        slope_0 = slope
        start = end
        # One exact step of both structures
        end = pair[6] * north[sample] + pair[7] * east[sample]
        u1, z1 = _stepped(first, u1, z1, start, end)
        u2, z2 = _stepped(second, u2, z2, start, end)
        # Relative displacement and slope at the end
        distance = pair[2] * u1 - pair[5] * u2
        slope = (pair[2] * pair[0] * z1 - pair[5] * pair[3] * z2) * dt
        largest[0] = max(largest[0], distance)
        largest[1] = max(largest[1], -distance)
        # Inner Bernstein coefficients of the cubic bound it together with the samples
        leaving = distance_0 + slope_0 / 3.0
        arriving = distance - slope / 3.0
        high, low = max(leaving, arriving), min(leaving, arriving)
        if high + margin > largest[0] or margin - low > largest[1]:
            # The bound of this step alone, mostly far smaller
            own = min(margin, _step_margin(pair, dt, before, start, end))
            if high + own > largest[0] or own - low > largest[1]:
                ends = (distance_0, slope_0, distance, slope)
                _search_step(pair, dt, before, start, end, ends, own, largest)


@lean
def _step_margin(pair, dt, state, start, end):
    """Return how far the relative displacement exceeds the cubic of a step at most."""
    integral = 0.5 * (abs(start) + abs(end)) * dt
    ground = (max(abs(start), abs(end)), abs(end - start) / dt, integral)
    _, margin = between_sample_margins(pair, dt, dt, present_radii(pair, state), ground)
    return margin


@lean
def _stepped(c, u, z, start, end):
    """Return the state of a structure after a step."""
    u_end = c[0] * u + c[1] * z + (c[4] * start + c[5] * end)
    z_end = c[2] * u + c[3] * z + (c[6] * start + c[7] * end)
    return u_end, z_end


@lean
def _search_step(pair, dt, state, start, end, ends, margin, largest):
    """Raise the largest values to the peaks in one step, cut so that cubics resolve them."""
    parts = math.ceil(max(pair[0], pair[3]) * dt / LONGEST_PHASE)
    width = dt / parts
    margin /= parts**4  # grows with the fourth power of the width
    rate = (end - start) / dt
    distance_0, slope_0 = ends[0], ends[1] / parts
    for part in range(parts):
        # Relative displacement and slope at the end of the part
        distance_1, slope_1 = ends[2], ends[3] / parts
        if part < parts - 1:
            distance_1, slope_1, _ = _relative_motion(pair, state, (part + 1) * width, start, rate)
            slope_1 *= width
        # Derivative of the cubic over the part: slope_0 + 2 m x + k x²
        change = distance_1 - distance_0
        m = 3.0 * change - 2.0 * slope_0 - slope_1
        k = 3.0 * (slope_0 + slope_1 - 2.0 * change)
        # Its roots, without cancellation
        root = math.sqrt(max(m * m - k * slope_0, 0.0))
        q = -(m + math.copysign(root, m))
        for x in (q / k if k != 0.0 else -1.0, slope_0 / q if q != 0.0 else -1.0):
            if -OUTSIDE <= x <= 1.0 + OUTSIDE:
                # Search the exact solution where the cubic comes close enough
                inside = min(max(x, 0.0), 1.0)
                cubic = distance_0 + inside * (slope_0 + inside * (m + inside * k / 3.0))
                if cubic + margin > largest[0] or margin - cubic > largest[1]:
                    _climb(pair, state, (part + inside) * width, dt, start, rate, largest)
        distance_0 = distance_1
        slope_0 = slope_1


@lean
def _climb(pair, state, time, dt, acceleration, rate, largest):
    """Raise the largest values to the stationary value near a time of the step."""
    # Newton's method for the root of the relative velocity
    for _ in range(NEWTON_STEPS):
        _, slope, bend = _relative_motion(pair, state, time, acceleration, rate)
        earlier = time
        time = min(max(time - slope / bend, 0.0), dt) if bend != 0.0 else time
        if abs(time - earlier) <= SETTLED_SHIFT * dt:
            break
    distance, _, _ = _relative_motion(pair, state, time, acceleration, rate)
    largest[0] = max(largest[0], distance)
    largest[1] = max(largest[1], -distance)


@lean
def _relative_motion(pair, state, time, acceleration, rate):
    """Return relative displacement, velocity and acceleration at a time after the step's start."""
    distance = slope = bend = 0.0
    for body in range(2):
        omega, damping = pair[3 * body], pair[3 * body + 1]
        weight = pair[3 * body + 2] * (1.0 - 2.0 * body)
        # Exact state of the structure
        displacement, velocity = state[2 * body], state[2 * body + 1] * omega
        u, v = state_after(time, displacement, velocity, omega, damping, acceleration, rate)
        distance += weight * u
        slope += weight * v
        bend -= weight * (
            acceleration + rate * time + 2.0 * damping * omega * v + omega * omega * u
        )
    return distance, slope, bend
