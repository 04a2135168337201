"""
Largest approach of many pairs of bilinear structures at the samples of one record.

The yielding part of the spring is an input: with the plastic displacement p a structure of the
hardening alpha is the linear one under the acceleration ``a - (1 - alpha) omega² p``, whose step is
exact where both are linear between samples. In a step p grows by what its elastic displacement
``u - p`` at the end has beyond the yield displacement, over the part of a change of p that u does
not follow. Where yielding begins or ends between two samples p bends; the error is of second order
in the step.

Most of the time nothing yields and nothing counts. A round of steps is first taken in strides, in
which p stays, about the displacement at rest: of the acceleration a constant, a line and a parabola
move a structure over a stride of any number of steps. Only pairs that come near a yield
displacement or a maximum at the ends of the strides take the round again, step by step.

The begin and the end of a record are too weak to count. From rest an acceleration of at most a
moves a structure by ``a q X / omega²`` at most, X being the integral of the size of the impulse
response, ``2 / (1 - rho)`` at most, where rho is the ratio of two peaks of free vibration in
succession. A pair rests until it may yield, or exceed its floor, less the time in which it forgets:
round and floor are the caller's. Beside the motion that is there the bound shows the round from
which nothing can exceed the maxima so far.

Single precision doubles the lanes of a vector. What a pair shares a block with changes no bit.
"""

import math

import numpy as np

from per_obspy.kernels._aligned import aligned_single
from per_obspy.kernels._jit import inlined, kernel, lean, vectorised
from per_obspy.kernels.oscillator.exact_step import step_coefficients

#: Pairs next to each other: a constant trip count, which the compiler turns into vectors.
LANES = 32
#: Steps of a round, a multiple of two strides; rounds after which the end is looked for.
ROUND, CHECKED_ROUNDS = 48, 4

#: Part of a yield displacement or of a maximum that the ends of strides reach where the motion
#: between them reaches all of it. A vibration exceeds them by 1 / cos(theta / 2), theta being the
#: angle of a stride.
NEAR = np.float32(0.86)
#: Bounds of what may still come grow by this, beside which rounding does not matter.
ROUNDING = 1.00001
#: Numbers of single precision: zero, one, and one below all displacements.
NOTHING, ONE, LOWEST = np.float32(0.0), np.float32(1.0), np.float32(-1e30)
#: States below this are set to zero: denormal numbers are slow.
SMALLEST_STATE = np.float32(1e-30)

#: Rows of a structure in a block, one column per pair: displacement, velocity over omega, plastic
#: displacement; what a step adds to the first two by these and by the acceleration at its start and
#: its end; what a change of p adds to both; yield displacement; growth of p over what is beyond it;
#: omega; displacement at rest and largest one, by a plastic displacement and an acceleration of 1.
#: Of strides: p before the round; what a stride makes of displacement from rest and velocity over
#: omega, and of three shapes; both now; largest and least displacement from rest in the round.
#: After both structures: the direction; largest relative displacement and velocity before the
#: round, in steps and in strides; what they need not reach; whether the round counts step by step;
#: first round.
STRUCTURE, DIRECTION, ROWS = 35, 70, 82
U, Z, P = (row * LANES for row in range(3))
UU, UZ, UP, U0, U1, ZU, ZZ, ZP, Z0, Z1 = (row * LANES for row in range(3, 13))
UD, ZD, LIMIT, GROWTH, OMEGA, RESTING, REACH = (row * LANES for row in range(13, 20))
BEFORE, WW, WY, W0, W1, W2, YW, YY, Y0, Y1, Y2 = (row * LANES for row in range(20, 31))
W, Y, MOST, LEAST = (row * LANES for row in range(31, STRUCTURE))
SECOND = STRUCTURE * LANES
NORTH, EAST, DISTANCE, SPEED, DISTANCE_BY_STEP, SPEED_BY_STEP = (
    row * LANES for row in range(DIRECTION, DIRECTION + 6)
)
DISTANCE_BY_STRIDE, SPEED_BY_STRIDE, DISTANCE_FLOOR, SPEED_FLOOR, BY_STEP, START = (
    row * LANES for row in range(DIRECTION + 6, ROWS)
)


@kernel
def yielding_approach(ground, shapes, weights, dt, after, pairs, floor, starts, largest):
    """
    Raise the largest relative displacements and velocities of pairs that may yield, at the samples.

    Parameters
    ----------
    ground : (2, n_rounds * ROUND + 1) ndarray of float32
        North and east of the ground acceleration, m/s², and zeros after the record, in which free
        vibration is followed as far as it counts.
    shapes, weights : (3, stride + 1) ndarray
        Accelerations at the samples of a stride, and how much each sample has of them. A round has
        an even number of strides.
    dt : float
        Time between samples, s.
    after : (n_rounds,) ndarray
        Largest acceleration in any direction from the start of each round on, m/s².
    pairs : (14, n) ndarray
        Rows: circular frequency (rad/s), damping (fraction of critical), participation
        (dimensionless), yield displacement at contact level (m), hardening, and the largest
        displacement by an acceleration of at most 1 m/s² (m) of structure 1, then of 2; cosine and
        sine of the azimuth from 1 to 2.
    floor : (2, n) ndarray
        Maxima below which the motion need not be followed.
    starts : (n,) ndarray
        Number of the round before which a pair rests.
    largest : (2, n) ndarray
        Maxima of ``q1 u1 - q2 u2``, m, and of ``q1 v1 - q2 v2``, m/s, that are raised.
    """
    trends, stride = _trends(ground, weights), shapes.shape[1] - 1
    t, count = aligned_single(ROWS * LANES), pairs.shape[1]
    for first in range(0, count, LANES):
        # the last block has copies of its last pair
        for lane in range(LANES):
            number = first + lane if first + lane < count else count - 1
            _pack(t, lane, pairs, number, dt, shapes)
            t[DISTANCE + lane], t[SPEED + lane] = largest[0, number], largest[1, number]
            t[DISTANCE_FLOOR + lane], t[SPEED_FLOOR + lane] = floor[0, number], floor[1, number]
            t[START + lane] = starts[number]
        _run(t, ground, trends, stride, after)
        # the copies have the maxima of their pair
        for lane in range(LANES):
            number = first + lane if first + lane < count else count - 1
            largest[0, number], largest[1, number] = t[DISTANCE + lane], t[SPEED + lane]


@kernel
def _trends(ground, weights):
    """Return how much of each shape the strides of north, then of east have, (n, 6)."""
    stride = weights.shape[1] - 1
    trends = np.empty(((ground.shape[1] - 1) // stride, 6), np.float32)
    for number in range(trends.shape[0]):
        for component in range(2):
            # sums over both ends and all samples between them
            constant = line = parabola = 0.0
            for k in range(stride + 1):
                sample = ground[component, number * stride + k]
                constant += weights[0, k] * sample
                line += weights[1, k] * sample
                parabola += weights[2, k] * sample
            # north, then east
            trends[number, 3 * component] = constant
            trends[number, 3 * component + 1] = line
            trends[number, 3 * component + 2] = parabola
    return trends


@lean
def _pack(t, lane, pairs, number, dt, shapes):
    """Fill the column of a pair at rest."""
    # at rest
    for row in range(ROWS):
        t[row * LANES + lane] = NOTHING
    # direction
    t[NORTH + lane], t[EAST + lane] = pairs[12, number], pairs[13, number]
    for body in range(2):
        # facts of the structure
        k, row = body * SECOND + lane, 6 * body
        omega, damping, share = pairs[row, number], pairs[row + 1, number], pairs[row + 2, number]
        limit, hardening = pairs[row + 3, number], pairs[row + 4, number]
        coefficients = step_coefficients(omega, damping, dt)
        a11, a12, a21, a22, b11, b12, b21, b22 = coefficients
        # acceleration of a plastic displacement of 1
        drive = -(1.0 - hardening) * omega * omega
        # the spring
        t[OMEGA + k], t[LIMIT + k], t[REACH + k] = omega, limit, pairs[row + 5, number]
        t[RESTING + k], t[GROWTH + k] = 1.0 - hardening, 1.0 / (1.0 - drive * b12)
        # steps from what is there
        t[UU + k], t[UZ + k], t[UP + k] = a11 - 1.0, a12, drive * (b11 + b12)
        t[ZU + k], t[ZZ + k], t[ZP + k] = a21, a22 - 1.0, drive * (b21 + b22)
        # by the ground, and by what yielding changes
        t[U0 + k], t[U1 + k], t[UD + k] = share * b11, share * b12, drive * b12
        t[Z0 + k], t[Z1 + k], t[ZD + k] = share * b21, share * b22, drive * b22
        # strides: what a displacement and a velocity make of a structure
        t[WW + k], t[YW + k] = _after_stride(coefficients, 1.0, 0.0, shapes, 0, 0.0)
        t[WY + k], t[YY + k] = _after_stride(coefficients, 0.0, 1.0, shapes, 0, 0.0)
        # from rest by each shape
        t[W0 + k], t[Y0 + k] = _after_stride(coefficients, 0.0, 0.0, shapes, 0, share)
        t[W1 + k], t[Y1 + k] = _after_stride(coefficients, 0.0, 0.0, shapes, 1, share)
        t[W2 + k], t[Y2 + k] = _after_stride(coefficients, 0.0, 0.0, shapes, 2, share)


@lean
def _after_stride(coefficients, u, z, shapes, number, share):
    """Return the state of a structure after a stride under a share of one of the shapes."""
    a11, a12, a21, a22, b11, b12, b21, b22 = coefficients
    # step by step
    for k in range(shapes.shape[1] - 1):
        start, end = share * shapes[number, k], share * shapes[number, k + 1]
        u, z = (
            a11 * u + a12 * z + (b11 * start + b12 * end),
            a21 * u + a22 * z + (b21 * start + b22 * end),
        )
    return u, z


@kernel
def _run(t, ground, trends, stride, after):
    """Advance a block through the rounds that count, until nothing can raise a maximum."""
    # the first round of any pair
    begin = t[START]
    for lane in range(LANES):
        begin = min(begin, t[START + lane])
    strides = ROUND // stride
    for number in range(int(begin), after.size):
        # until nothing counts any more
        if number % CHECKED_ROUNDS == 0 and _is_settled(t, number, after[number]):
            break
        # in strides, until a pair counts
        _begin_round(t)
        for i in range(number * strides, (number + 1) * strides, 2):
            m, o = trends[i], trends[i + 1]
            _stride(t, m[0], m[1], m[2], m[3], m[4], m[5], o[0], o[1], o[2], o[3], o[4], o[5])
        this = np.float32(number)
        _mark(t, this)
        # step by step
        if _any_marked(t):
            _take_steps(t, ground[0], ground[1], number * ROUND)
        _end_round(t, this)


@lean
def _take_steps(t, north, east, first):
    """Advance a block through a round step by step."""
    # four steps between five samples
    for i in range(first, first + ROUND, 4):
        n0, n1, n2, n3, n4 = north[i], north[i + 1], north[i + 2], north[i + 3], north[i + 4]
        e0, e1, e2, e3, e4 = east[i], east[i + 1], east[i + 2], east[i + 3], east[i + 4]
        _step(t, n0, e0, n1, e1, n2, e2, n3, e3, n4, e4)


@vectorised
def _begin_round(t):
    """Begin a round both ways."""
    for lane in range(LANES):
        # structures 1 and 2
        for k in (lane, SECOND + lane):
            t[BEFORE + k] = t[P + k]
            t[W + k] = t[U + k] - t[RESTING + k] * t[P + k]
            t[Y + k] = t[Z + k]
            t[MOST + k] = t[LEAST + k] = NOTHING
        # the pair
        t[DISTANCE_BY_STRIDE + lane] = LOWEST
        t[SPEED_BY_STRIDE + lane] = NOTHING
        t[DISTANCE_BY_STEP + lane] = t[DISTANCE + lane]
        t[SPEED_BY_STEP + lane] = t[SPEED + lane]


@vectorised
def _stride(t, n0, n1, n2, e0, e1, e2, n3, n4, n5, e3, e4, e5):
    """Advance a block by two strides about rest, under three shapes each of north and east."""
    for lane in range(LANES):
        other = SECOND + lane
        # direction
        cosine, sine = t[NORTH + lane], t[EAST + lane]
        # largest values so far
        omega, omega_2 = t[OMEGA + lane], t[OMEGA + other]
        distance, speed = t[DISTANCE_BY_STRIDE + lane], t[SPEED_BY_STRIDE + lane]
        most, least, most_2, least_2 = (
            t[MOST + lane],
            t[LEAST + lane],
            t[MOST + other],
            t[LEAST + other],
        )
        # first stride
        m0, m1, m2 = cosine * n0 + sine * e0, cosine * n1 + sine * e1, cosine * n2 + sine * e2
        u, z = _strode(t, lane, t[W + lane], t[Y + lane], m0, m1, m2)
        w, y = _strode(t, other, t[W + other], t[Y + other], m0, m1, m2)
        # largest values after it
        distance, speed = max(distance, u - w), max(speed, omega * z - omega_2 * y)
        most, least, most_2, least_2 = max(most, u), min(least, u), max(most_2, w), min(least_2, w)
        # second stride
        m0, m1, m2 = cosine * n3 + sine * e3, cosine * n4 + sine * e4, cosine * n5 + sine * e5
        u, z = _strode(t, lane, u, z, m0, m1, m2)
        w, y = _strode(t, other, w, y, m0, m1, m2)
        # states and largest values after it
        t[W + lane], t[Y + lane], t[W + other], t[Y + other] = u, z, w, y
        t[DISTANCE_BY_STRIDE + lane] = max(distance, u - w)
        t[SPEED_BY_STRIDE + lane] = max(speed, omega * z - omega_2 * y)
        t[MOST + lane], t[LEAST + lane] = max(most, u), min(least, u)
        t[MOST + other], t[LEAST + other] = max(most_2, w), min(least_2, w)


@inlined
def _strode(t, k, w, y, m0, m1, m2):
    """Return the state of a structure about rest after a stride."""
    # what the ground adds
    force = t[W0 + k] * m0 + (t[W1 + k] * m1 + t[W2 + k] * m2)
    drive = t[Y0 + k] * m0 + (t[Y1 + k] * m1 + t[Y2 + k] * m2)
    return t[WW + k] * w + (t[WY + k] * y + force), t[YW + k] * w + (t[YY + k] * y + drive)


@vectorised
def _mark(t, number):
    """Mark the pairs of which the round counts step by step."""
    for lane in range(LANES):
        other = SECOND + lane
        # displacement at rest, and elastic one there
        rest, rest_2 = t[RESTING + lane] * t[P + lane], t[RESTING + other] * t[P + other]
        bent, bent_2 = rest - t[P + lane], rest_2 - t[P + other]
        # largest elastic displacements to either side
        bent, bent_2 = (
            max(t[MOST + lane] + bent, -(t[LEAST + lane] + bent)),
            max(t[MOST + other] + bent_2, -(t[LEAST + other] + bent_2)),
        )
        # near a maximum or a yield displacement
        far = t[DISTANCE_BY_STRIDE + lane] + (rest - rest_2)
        near = far > NEAR * max(t[DISTANCE + lane], t[DISTANCE_FLOOR + lane])
        near |= t[SPEED_BY_STRIDE + lane] > NEAR * max(t[SPEED + lane], t[SPEED_FLOOR + lane])
        near |= (bent > NEAR * t[LIMIT + lane]) | (bent_2 > NEAR * t[LIMIT + other])
        t[BY_STEP + lane] = ONE if near & (number >= t[START + lane]) else NOTHING


@lean
def _any_marked(t):
    """Return whether a pair is marked."""
    marked = 0.0
    for lane in range(0, LANES, 4):
        first, second = t[BY_STEP + lane] + t[BY_STEP + lane + 1], t[BY_STEP + lane + 2]
        marked += first + (second + t[BY_STEP + lane + 3])
    return marked > 0.0


@vectorised
def _end_round(t, number):
    """End a round: marked pairs by steps, others by strides; before its start a pair rests."""
    for lane in range(LANES):
        rests, by_step = number < t[START + lane], t[BY_STEP + lane] > NOTHING
        # both structures
        for k in (lane, SECOND + lane):
            u = t[W + k] + t[RESTING + k] * t[BEFORE + k]
            u, z = t[U + k] if by_step else u, t[Z + k] if by_step else t[Y + k]
            t[U + k] = NOTHING if rests else _flushed(u)
            t[Z + k] = NOTHING if rests else _flushed(z)
            t[P + k] = t[P + k] if by_step else t[BEFORE + k]
        # maxima of the pair
        t[DISTANCE + lane] = t[DISTANCE_BY_STEP + lane] if by_step else t[DISTANCE + lane]
        t[SPEED + lane] = t[SPEED_BY_STEP + lane] if by_step else t[SPEED + lane]


@inlined
def _flushed(value):
    """Return a value, but zero for denormal ones, which are slow."""
    return value if abs(value) > SMALLEST_STATE else NOTHING


@vectorised
def _step(t, n0, e0, n1, e1, n2, e2, n3, e3, n4, e4):
    """Advance a block by four steps between five samples, north and east."""
    for lane in range(LANES):
        other = SECOND + lane
        # accelerations along the azimuth
        cosine, sine = t[NORTH + lane], t[EAST + lane]
        a0, a1, a2 = cosine * n0 + sine * e0, cosine * n1 + sine * e1, cosine * n2 + sine * e2
        a3, a4 = cosine * n3 + sine * e3, cosine * n4 + sine * e4
        # states of structures 1 and 2, and the largest values so far
        u, z, p, w, y, r = (
            t[U + lane],
            t[Z + lane],
            t[P + lane],
            t[U + other],
            t[Z + other],
            t[P + other],
        )
        omega, omega_2 = t[OMEGA + lane], t[OMEGA + other]
        distance, speed = t[DISTANCE_BY_STEP + lane], t[SPEED_BY_STEP + lane]
        # first step
        u, z, p = _moved(t, lane, u, z, p, a0, a1)
        w, y, r = _moved(t, other, w, y, r, a0, a1)
        distance, speed = max(distance, u - w), max(speed, omega * z - omega_2 * y)
        # second step
        u, z, p = _moved(t, lane, u, z, p, a1, a2)
        w, y, r = _moved(t, other, w, y, r, a1, a2)
        distance, speed = max(distance, u - w), max(speed, omega * z - omega_2 * y)
        # third step
        u, z, p = _moved(t, lane, u, z, p, a2, a3)
        w, y, r = _moved(t, other, w, y, r, a2, a3)
        distance, speed = max(distance, u - w), max(speed, omega * z - omega_2 * y)
        # fourth step
        u, z, p = _moved(t, lane, u, z, p, a3, a4)
        w, y, r = _moved(t, other, w, y, r, a3, a4)
        # states and largest values after them
        t[U + lane], t[Z + lane], t[P + lane] = u, z, p
        t[U + other], t[Z + other], t[P + other] = w, y, r
        t[DISTANCE_BY_STEP + lane] = max(distance, u - w)
        t[SPEED_BY_STEP + lane] = max(speed, omega * z - omega_2 * y)


@inlined
def _moved(t, k, u, z, p, start, end):
    """Return the state of a structure after one step."""
    # as if it did not yield: exact where acceleration is linear between samples
    force = t[UP + k] * p + (t[U0 + k] * start + t[U1 + k] * end)
    after = u + (t[UU + k] * u + (t[UZ + k] * z + force))
    force = t[ZP + k] * p + (t[Z0 + k] * start + t[Z1 + k] * end)
    speed = z + (t[ZU + k] * u + (t[ZZ + k] * z + force))
    # the elastic displacement is at most the yield displacement
    elastic, limit = after - p, t[LIMIT + k]
    grown = t[GROWTH + k] * (elastic - min(max(elastic, -limit), limit))
    return after + t[UD + k] * grown, speed + t[ZD + k] * grown, p + grown


@lean
def _is_settled(t, number, acceleration):
    """Return whether an acceleration makes no structure yield, and raises no maximum."""
    for lane in range(LANES):
        if number < t[START + lane]:
            return False
        reach = speed = 0.0
        for body in range(2):
            k = body * SECOND + lane
            # about the displacement at rest, which a plastic one leaves
            plastic = t[RESTING + k] * t[P + k]
            from_rest = t[U + k] - plastic
            radius = math.sqrt(from_rest * from_rest + t[Z + k] * t[Z + k])
            # what is there fades, and the ground adds this
            radius = ROUNDING * (radius + acceleration * t[REACH + k])
            if abs(plastic - t[P + k]) + radius > t[LIMIT + k]:
                return False
            reach += radius + (plastic if body == 0 else -plastic)
            speed += t[OMEGA + k] * radius
        if reach > t[DISTANCE + lane] or speed > t[SPEED + lane]:
            return False
    return True
