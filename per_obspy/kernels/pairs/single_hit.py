"""
Single-hit estimate of many pairs: grazing state, first earlier contact, impact, and its bound.

The steps are those of Valles-Mattox & Reinhorn (1996), figure 5: (i) the grazing state, in which
both structures lie on their energy circles with the same velocity, (ii) the motion back to the
first contact over the actual gap, (iii) the impact, eq. (7) and (8). Structure 1 is on the left;
``u1 - u2`` reaches the critical gap at the grazing state.

Pairs are worked on in blocks: the iteration outside, the pairs of a block inside, so that the
compiler puts several pairs into one instruction.
"""

import math

import numpy as np

from per_obspy.kernels._aligned import aligned_copy
from per_obspy.kernels._jit import inlined, kernel
from per_obspy.kernels.vector_functions import TO_INTEGER

#: Pairs of a block: its arrays stay in the first-level cache.
PAIRS = 32
OK, NO_POUNDING, NO_GRAZING_STATE, INCONSISTENT_CRITICAL_GAP = 0, 1, 2, 3
#: Rounding that a tangent state may carry, relative to the radii.
ULPS = 2e-15
#: An advance in time that is rounding, relative to the time.
NEGLIGIBLE_ADVANCE = 1e-15
#: 2 pi in two parts.
TURN, TURN_REMAINDER = 6.283185307179586, 2.4492935982947064e-16
TURNS_PER_RADIAN = 1.0 / TURN
#: Taylor series of sine and cosine, up to an angle of pi/4.
SINE = tuple((-1.0) ** n / math.factorial(2 * n + 1) for n in range(1, 8))
COSINE = tuple((-1.0) ** n / math.factorial(2 * n) for n in range(1, 9))
#: Phases of the scan for the bound: even on the left; towards the right end, where a narrow peak
#: can occur, ever denser.
SCAN_PHASES = np.array(
    [-1.0, -0.8, -0.6, -0.45, -0.3, -0.15, 0.0, 0.1, 0.2, 0.3, 0.4, 0.55]
    + [1.0 - 2.0 ** (-n / 2) for n in range(3, 23)]
    + [1.0]
)
GOLDEN = 0.6180339887498949
#: Golden sections of a bracket: they leave 1e-6 of it, where a smooth peak is flat to 1e-11.
SECTIONS = 26


@kernel
def estimate(arguments, begin, end, status, branches, bounds):
    """
    Fill the single-hit estimate of the pairs from ``begin`` to before ``end``.

    Parameters
    ----------
    arguments : (9, n) ndarray
        Rows: radius of structure 1 and of 2 (m), circular frequency of 1 and of 2 (rad/s), ``(1 +
        e) m2 / M`` and ``(1 + e) m1 / M`` (the part of the velocity difference that 1 and 2
        receive), ``(1 + e) m1 m2 / M`` (kg), critical gap (m), gap (m), with ``M = m1 + m2``.
    begin, end : int
        First pair, and the one after the last.
    status : (n,) ndarray of int8
        Receives OK, NO_POUNDING, NO_GRAZING_STATE or INCONSISTENT_CRITICAL_GAP.
    branches : (2, 13, n) ndarray
        Receives both branches (towards 2, towards 1). Rows: time from the contact to the grazing
        state (s); then, of structure 1 and in the next six rows of 2: displacement (m), velocity
        and velocity after the impact (m/s), radius after it (m), amplification, and transfer energy
        (J).
    bounds : (2, n) ndarray
        Receives the largest radius after an impact over all phases, of structure 1 and of 2, m.
    """
    states = np.empty((4, PAIRS))
    # Lanes of an incomplete block have a motion that is over at once
    constants = np.zeros((11, PAIRS))
    for pair in range(PAIRS):
        constants[0, pair] = constants[1, pair] = constants[10, pair] = 1.0
    times = np.empty(PAIRS)
    for first in range(begin, end, PAIRS):
        # Step i: grazing states
        pairs = min(PAIRS, end - first)
        for pair in range(pairs):
            status[first + pair] = _grazing_state(arguments, first + pair, states, pair)
        # Steps ii and iii: contact and impact, for both signs of the velocity
        for branch in range(2):
            _load(arguments, first, pairs, states, 1.0 - 2.0 * branch, constants)
            _first_contact(constants, times)
            _impact(arguments, first, pairs, constants, times, branches[branch])
            for index in range(first, first + pairs):
                if status[index] != OK:
                    _no_impact(status[index], arguments, index, branches[branch])
        # Upper bound over all phases
        for body in range(2):
            _largest_radius(arguments, body, first, pairs, bounds)


@kernel
def _grazing_state(arguments, index, states, pair):
    """Store x, v, and the critical gap less the gap, of the grazing state; return the status."""
    radius_1, radius_2 = arguments[0, index], arguments[1, index]
    stiffness_1, stiffness_2 = arguments[2, index] ** 2, arguments[3, index] ** 2
    gap, reach = arguments[7, index], radius_1 + radius_2
    states[0, pair] = states[1, pair] = states[3, pair] = 0.0
    # Step 0: pairs that do not touch, and gaps that no phases can reach
    if arguments[8, index] >= gap:
        return NO_POUNDING
    if gap > reach * (1.0 + ULPS):
        return INCONSISTENT_CRITICAL_GAP
    gap = min(gap, reach)
    # Step i: A x² - 2 B x + C = 0, of whose roots x = C / (B + sqrt(B² - A C)) is admissible
    a = stiffness_2 - stiffness_1
    b = stiffness_2 * gap
    c = stiffness_1 * radius_1**2 + stiffness_2 * (gap - radius_2) * (gap + radius_2)
    discriminant = b * b - a * c
    if discriminant < -ULPS * b * b:
        return NO_GRAZING_STATE
    x = c / (b + math.sqrt(max(discriminant, 0.0)))
    # It exists if it is on both circles, to rounding
    low, high = max(-radius_1, gap - radius_2), min(radius_1, gap + radius_2)
    if x < low - ULPS * reach or x > high + ULPS * reach:
        return NO_GRAZING_STATE
    x = min(max(x, low), high)
    # Common velocity v² = w1² (r1² - x²) = w2² (r2² - (x - g)²)
    square_1 = stiffness_1 * (radius_1 - x) * (radius_1 + x)
    square_2 = stiffness_2 * (radius_2 - (x - gap)) * (radius_2 + (x - gap))
    states[0, pair] = x
    states[1, pair] = x - gap
    states[2, pair] = math.sqrt(max(min(square_1, square_2), 0.0))
    states[3, pair] = gap - arguments[8, index]
    return OK


@kernel
def _load(arguments, first, pairs, states, sign, constants):
    """
    Fill the constants of the backward motion of a block.

    Pairs without a state get a motion that is over at once.
    """
    for pair in range(pairs):
        omega_1, omega_2 = arguments[2, first + pair], arguments[3, first + pair]
        velocity = sign * states[2, pair]
        constants[0, pair], constants[1, pair] = omega_1, omega_2
        # Grazing state: displacements, velocity, velocity over the frequencies
        constants[2, pair], constants[3, pair] = states[0, pair], states[1, pair]
        constants[4, pair] = velocity
        constants[5, pair], constants[6, pair] = velocity / omega_1, velocity / omega_2
        # Displacements times the frequencies, and distance to contact
        constants[7, pair] = omega_1 * states[0, pair]
        constants[8, pair] = omega_2 * states[1, pair]
        constants[9, pair] = states[3, pair]
        # Bound K2 of the second derivative of the distance
        curvature = (
            omega_1**2 * arguments[0, first + pair] + omega_2**2 * arguments[1, first + pair]
        )
        constants[10, pair] = curvature if states[3, pair] > 0.0 else 1.0


@kernel
def _sine_products(phase):
    """Return sin² and sin·cos of half the phase, by Taylor series to rounding, without branches."""
    # Reduce by whole turns; a quarter of the rest is below pi/4
    turns = (phase * TURNS_PER_RADIAN + TO_INTEGER) - TO_INTEGER
    y = 0.25 * (phase - turns * TURN - turns * TURN_REMAINDER)
    z = y * y
    # Sine and cosine of the quarter
    s0, s1, s2, s3, s4, s5, s6 = SINE
    c0, c1, c2, c3, c4, c5, c6, c7 = COSINE
    sine = y * (1.0 + z * (s0 + z * (s1 + z * (s2 + z * (s3 + z * (s4 + z * (s5 + z * s6)))))))
    cosine = 1.0 + z * (
        c0 + z * (c1 + z * (c2 + z * (c3 + z * (c4 + z * (c5 + z * (c6 + z * c7))))))
    )
    # Those of the half
    twice_sine, twice_cosine = 2.0 * sine * cosine, 1.0 - 2.0 * sine * sine
    return twice_sine * twice_sine, twice_sine * twice_cosine


@kernel
def _first_contact(constants, first_contact):
    """
    Fill the smallest time before the grazing state at which the actual gap closes.

    The distance to contact d has |d''| <= K2, so the step 2 d/(d' + sqrt(d'² + 2 K2 d)) never
    passes the first root. A pair that has arrived stays, however long the others of its block go
    on.
    """
    c, times, advances = aligned_copy(constants, 11, PAIRS), np.zeros(PAIRS), np.ones(PAIRS)
    moving = True
    while moving:
        for pair in range(PAIRS):
            # Step ii: both structures along their circles
            time = times[pair]
            square_1, product_1 = _sine_products(c[0, pair] * time)
            square_2, product_2 = _sine_products(c[1, pair] * time)
            velocity, x_1, x_2 = c[4, pair], c[2, pair], c[3, pair]
            # Distance to contact and closing speed
            swing = product_1 * c[5, pair] - product_2 * c[6, pair]
            distance = max(c[9, pair] - 2.0 * (x_1 * square_1 - x_2 * square_2 + swing), 0.0)
            turn = c[7, pair] * product_1 - c[8, pair] * product_2
            closing = 2.0 * (turn - velocity * (square_1 - square_2))
            # Guaranteed step; its other form does not cancel where the distance opens
            root = math.sqrt(closing * closing + 2.0 * c[10, pair] * distance)
            above = 2.0 * distance if closing > 0.0 else root - closing
            below = closing + root if closing > 0.0 else c[10, pair]
            # A pair that has arrived stays
            advance = above / below if distance > 0.0 and advances[pair] > 0.0 else 0.0
            times[pair] = time + advance
            advances[pair] = advance - NEGLIGIBLE_ADVANCE * time
        moving = False
        for pair in range(PAIRS):
            moving = moving or advances[pair] > 0.0
    for pair in range(PAIRS):
        first_contact[pair] = times[pair]


@kernel
def _impact(arguments, first, pairs, constants, times, branch):
    """Fill the states of a block at contact and after it, radii, amplifications and energies."""
    c, given, fields = (
        aligned_copy(constants, 11, PAIRS),
        np.ones((7, PAIRS)),
        np.empty((13, PAIRS)),
    )
    # Local copies, filled up with ones
    for pair in range(PAIRS):
        fields[0, pair] = times[pair]
    for row in range(7):
        for pair in range(pairs):
            given[row, pair] = arguments[row, first + pair]
    for pair in range(PAIRS):
        # Velocities at contact
        square_1, product_1 = _sine_products(c[0, pair] * fields[0, pair])
        square_2, product_2 = _sine_products(c[1, pair] * fields[0, pair])
        velocity_1 = c[4, pair] * (1.0 - 2.0 * square_1) + 2.0 * c[7, pair] * product_1
        velocity_2 = c[4, pair] * (1.0 - 2.0 * square_2) + 2.0 * c[8, pair] * product_2
        # Structure 1: displacement, velocity, velocity after the impact by eq. (7)
        fields[1, pair] = c[2, pair] * (1.0 - 2.0 * square_1) - 2.0 * c[5, pair] * product_1
        fields[2, pair] = velocity_1
        fields[3, pair] = velocity_1 - given[4, pair] * (velocity_1 - velocity_2)
        # Structure 2: the same by eq. (8)
        fields[7, pair] = c[3, pair] * (1.0 - 2.0 * square_2) - 2.0 * c[6, pair] * product_2
        fields[8, pair] = velocity_2
        fields[9, pair] = velocity_2 + given[5, pair] * (velocity_1 - velocity_2)
    _radii(given, fields)
    for row in range(13):
        for pair in range(pairs):
            branch[row, first + pair] = fields[row, pair]


@kernel
def _radii(given, fields):
    """
    Fill radius, amplification and transfer energy.

    A structure at rest that stays at rest has amplification 1.
    """
    for body in range(2):
        field = 6 * body
        for pair in range(PAIRS):
            radius_before = given[body, pair]
            before, after = fields[2 + field, pair], fields[3 + field, pair]
            # Radius after the impact
            shifted = after / given[2 + body, pair]
            radius = math.sqrt(fields[1 + field, pair] ** 2 + shifted * shifted)
            resting = radius == 0.0 and radius_before == 0.0
            # Impulse J: the transfer energy, eq. (9) and (10), is J (v + v_after) / 2
            impulse = given[6, pair] * (fields[2, pair] - fields[8, pair]) * (1.0 - 2.0 * body)
            fields[4 + field, pair] = radius
            fields[5 + field, pair] = 1.0 if resting else radius / radius_before
            fields[6 + field, pair] = impulse * 0.5 * (before + after)


@kernel
def _no_impact(status, arguments, index, branch):
    """Fill radius before, amplification 1 and energy 0 of a pair without impact; NaN if unknown."""
    # Only a pair that does not touch keeps its radii for certain
    known = status == NO_POUNDING
    branch[:, index] = math.nan
    for body in range(2):
        branch[4 + 6 * body, index] = arguments[body, index] if known else math.nan
        branch[5 + 6 * body, index] = 1.0 if known else math.nan
        branch[6 + 6 * body, index] = 0.0 if known else math.nan


@kernel
def _largest_radius(arguments, body, first, pairs, bounds):
    """
    Fill the largest radius that contact at the actual gap can leave to a structure at any phase.

    For every contact displacement x one of the two velocity signs of equal direction closes the
    gap, and so does that of opposite direction: the largest |v'| is the sum of both contributions.
    The rest is a maximum over x, with at most two peaks in all cases tried: the two highest of
    a scan are refined.
    """
    constants, peaks = np.zeros((7, PAIRS)), np.zeros((4, PAIRS))
    _load_bound(arguments, body, first, pairs, constants)
    _scan(constants, peaks)
    _refine(constants, peaks)
    # The radius before contact bounds it from below
    for pair in range(pairs):
        square = max(peaks[2, pair], peaks[3, pair])
        bounds[body, first + pair] = max(math.sqrt(square), arguments[body, first + pair])


@kernel
def _scan(constants, peaks):
    """Fill nodes (two rows) and heights (two rows) of the two highest peaks of the scan."""
    # Two more rows: heights at two phases
    c, p = aligned_copy(constants, 7, PAIRS), np.zeros((6, PAIRS))
    for pair in range(PAIRS):
        p[5, pair] = _radius_squared(c, pair, SCAN_PHASES[0])
    for node in range(SCAN_PHASES.size):
        following = SCAN_PHASES[min(node + 1, SCAN_PHASES.size - 1)]
        for pair in range(PAIRS):
            # A peak is at least as high as its neighbours
            left, middle = p[4, pair], p[5, pair]
            right = _radius_squared(c, pair, following)
            height = middle if middle >= left and middle >= right else 0.0
            # Insert it among the two highest; all are read first: reads that depend on a condition
            # make no vectors
            node_1, node_2, height_1, height_2 = p[0, pair], p[1, pair], p[2, pair], p[3, pair]
            highest, second = height > height_1, height > height_2
            p[3, pair] = height_1 if highest else (height if second else height_2)
            p[1, pair] = node_1 if highest else (node if second else node_2)
            p[2, pair] = height if highest else height_1
            p[0, pair] = node if highest else node_1
            p[4, pair], p[5, pair] = middle, right
    for row in range(4):
        for pair in range(PAIRS):
            peaks[row, pair] = p[row, pair]


@kernel
def _refine(constants, peaks):
    """Raise both peaks to the maximum between the neighbouring phases by golden sections."""
    c, left, right = aligned_copy(constants, 7, PAIRS), np.empty(PAIRS), np.empty(PAIRS)
    inner, outer = np.empty((2, PAIRS)), np.empty((2, PAIRS))  # phases and heights
    for peak in range(2):
        # Bracket between the neighbouring phases, and its two inner points
        for pair in range(PAIRS):
            node = int(peaks[peak, pair])
            left[pair] = SCAN_PHASES[max(node - 1, 0)]
            right[pair] = SCAN_PHASES[min(node + 1, SCAN_PHASES.size - 1)]
            inner[0, pair] = right[pair] - GOLDEN * (right[pair] - left[pair])
            outer[0, pair] = left[pair] + GOLDEN * (right[pair] - left[pair])
            inner[1, pair] = _radius_squared(c, pair, inner[0, pair])
            outer[1, pair] = _radius_squared(c, pair, outer[0, pair])
        for _ in range(SECTIONS):
            for pair in range(PAIRS):
                # The part of the bracket with the higher point, which stays (all are read first)
                low, high = left[pair], right[pair]
                inner_phase, inner_height = inner[0, pair], inner[1, pair]
                outer_phase, outer_height = outer[0, pair], outer[1, pair]
                keep_left = inner_height > outer_height
                low = low if keep_left else inner_phase
                high = outer_phase if keep_left else high
                staying_phase = inner_phase if keep_left else outer_phase
                staying_height = inner_height if keep_left else outer_height
                # The new point
                phase = high - GOLDEN * (high - low) if keep_left else low + GOLDEN * (high - low)
                height = _radius_squared(c, pair, phase)
                left[pair], right[pair] = low, high
                # Both points in order
                inner[0, pair] = phase if keep_left else staying_phase
                inner[1, pair] = height if keep_left else staying_height
                outer[0, pair] = staying_phase if keep_left else phase
                outer[1, pair] = staying_height if keep_left else height
        for pair in range(PAIRS):
            peaks[2 + peak, pair] = max(peaks[2 + peak, pair], inner[1, pair], outer[1, pair])


@kernel
def _load_bound(arguments, body, first, pairs, constants):
    """
    Fill the constants of the bound of one structure.

    A pair that cannot touch gets an interval and shares of zero.
    """
    for pair in range(pairs):
        radius, other = arguments[body, first + pair], arguments[1 - body, first + pair]
        gap, received = arguments[8, first + pair], arguments[4 + body, first + pair]
        # Interval of the contact displacement: its middle and a quarter of its width
        low, high = max(-radius, gap - other), min(radius, gap + other)
        touching = low <= high
        constants[0, pair] = 0.5 * (low + high) if touching else 0.0
        constants[1, pair] = 0.25 * (high - low) if touching else 0.0
        constants[2, pair] = radius
        constants[3, pair] = other
        constants[4, pair] = gap
        # Shares of both velocities in the velocity after the impact
        constants[5, pair] = abs(1.0 - received) if touching else 0.0
        share = received * arguments[3 - body, first + pair] / arguments[2 + body, first + pair]
        constants[6, pair] = share if touching else 0.0


@inlined
def _radius_squared(constants, pair, y):
    """Return the squared radius after contact at the phase y in [-1, 1]."""
    # Contact displacement; the polynomial is flat at both ends, as a cosine would be
    radius, other = constants[2, pair], constants[3, pair]
    x = constants[0, pair] + constants[1, pair] * y * (3.0 - y * y)
    behind = x - constants[4, pair]
    own = max((radius - x) * (radius + x), 0.0)
    given = max((other - behind) * (other + behind), 0.0)
    own_share, given_share = constants[5, pair], constants[6, pair]
    both = 2.0 * own_share * given_share * math.sqrt(own * given)
    return x * x + own_share * own_share * own + given_share * given_share * given + both
