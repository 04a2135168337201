"""
Largest approach of many pairs of bilinear structures at the samples of one record.

The yielding part of the spring is an input: with the plastic displacement p a structure of the
hardening alpha is the linear one under the acceleration ``a - (1 - alpha) omega² p``, whose step is
exact where both are linear between samples. In a step p grows by what its elastic displacement
``u - p`` at the end has beyond the yield displacement, over the part of a change of p that u does
not follow. So every structure, elastic or not, is the same arithmetic in every step. Where yielding
begins or ends between two samples p bends; the error is of second order in the step.

The end of a record is too weak to raise a maximum. From rest it moves a structure by at most ``a q
X / omega²``, a being the largest acceleration that is left and X the integral of the impulse
response, ``2 / (1 - rho)`` at most, where rho is the ratio of two peaks of free vibration in
succession. Beside the motion that is there this shows the step from which nothing can exceed the
maxima so far. What a pair shares a block with changes no bit of it.
"""

import numpy as np

from per_obspy.kernels._aligned import aligned_line
from per_obspy.kernels._jit import inlined, kernel, lean, vectorised
from per_obspy.kernels.oscillator.exact_step import step_coefficients
from per_obspy.kernels.spectra.tile_search import SMALLEST_STATE

#: Pairs next to each other: a constant trip count, which the compiler turns into vectors.
LANES = 32
#: Steps of a round, before which is checked whether a maximum can still be raised.
CHECKED_STEPS = 64

#: Displacement of an undamped structure by a small acceleration: 0 without any.
UNBOUNDED = 1e100

#: Rows of a structure in a block, one column per pair: displacement, velocity over omega, plastic
#: displacement; what a step makes of these and of the acceleration at its start and its end, of
#: displacement and of velocity; what a change of p adds to both; yield displacement; growth of p
#: over what is beyond it; omega; hardening; largest displacement by an acceleration of 1. After
#: both structures: the direction, and the largest relative displacement and velocity.
STRUCTURE, DIRECTION, ROWS = 20, 40, 44
U, Z, P = (row * LANES for row in range(3))
UU, UZ, UP, U0, U1, ZU, ZZ, ZP, Z0, Z1 = (row * LANES for row in range(3, 13))
UD, ZD, LIMIT, GROWTH, OMEGA, HARDENING, REACH = (row * LANES for row in range(13, 20))
SECOND = STRUCTURE * LANES
NORTH, EAST, DISTANCE, SPEED = (row * LANES for row in range(DIRECTION, ROWS))


@kernel
def yielding_approach(north, east, dt, strongest, pairs, largest):
    """
    Fill the largest relative displacements and velocities of pairs that may yield, at the samples.

    Parameters
    ----------
    north, east : (n_samples,) ndarray
        Components of the ground acceleration, m/s², and zeros after the record, in which free
        vibration is followed as far as it counts; ``n_rounds`` of ``CHECKED_STEPS``, and one.
    dt : float
        Time between samples, s.
    strongest : (n_rounds,) ndarray
        Largest acceleration in any direction from the start of each round on, m/s².
    pairs : (12, n) ndarray
        Rows: circular frequency (rad/s), damping (fraction of critical), participation
        (dimensionless), yield displacement at contact level (m) and hardening of structure 1, then
        of 2; cosine and sine of the azimuth from 1 to 2.
    largest : (2, n) ndarray
        Receives the maxima of ``q1 u1 - q2 u2``, m, and of ``q1 v1 - q2 v2``, m/s.
    """
    table = np.zeros((ROWS, LANES))
    for first in range(0, pairs.shape[1], LANES):
        # the last block has copies of its last pair
        for lane in range(LANES):
            _pack(pairs, min(first + lane, pairs.shape[1] - 1), dt, table, lane)
        local = aligned_line(table, ROWS, LANES)
        # until nothing can raise a maximum
        for number in range(strongest.size):
            if _is_settled(local, strongest[number]):
                break
            _flush(local)
            step = number * CHECKED_STEPS
            for i in range(step, step + CHECKED_STEPS, 4):
                n0, n1, n2, n3, n4 = (
                    north[i],
                    north[i + 1],
                    north[i + 2],
                    north[i + 3],
                    north[i + 4],
                )
                e0, e1, e2, e3, e4 = east[i], east[i + 1], east[i + 2], east[i + 3], east[i + 4]
                _step(local, n0, e0, n1, e1, n2, e2, n3, e3, n4, e4)
        # maxima of the block without the copies
        for lane in range(min(LANES, pairs.shape[1] - first)):
            largest[0, first + lane] = local[DISTANCE + lane]
            largest[1, first + lane] = local[SPEED + lane]


@lean
def _pack(pairs, number, dt, table, lane):
    """Fill the column of a pair at rest."""
    # at rest
    for row in range(ROWS):
        table[row, lane] = 0.0
    for body in range(2):
        row, column = STRUCTURE * body, 5 * body
        omega, share = pairs[column, number], pairs[column + 2, number]
        a11, a12, a21, a22, b11, b12, b21, b22 = step_coefficients(
            omega, pairs[column + 1, number], dt
        )
        # acceleration of a plastic displacement of 1
        drive = -(1.0 - pairs[column + 4, number]) * omega * omega
        # displacement after a step
        table[row + 3, lane], table[row + 4, lane] = a11, a12
        table[row + 5, lane] = drive * (b11 + b12)
        table[row + 6, lane], table[row + 7, lane] = share * b11, share * b12
        # velocity over omega after it
        table[row + 8, lane], table[row + 9, lane] = a21, a22
        table[row + 10, lane] = drive * (b21 + b22)
        table[row + 11, lane], table[row + 12, lane] = share * b21, share * b22
        # what yielding changes
        table[row + 13, lane], table[row + 14, lane] = drive * b12, drive * b22
        table[row + 15, lane] = pairs[column + 3, number]
        table[row + 16, lane] = 1.0 / (1.0 - drive * b12)
        table[row + 17, lane], table[row + 18, lane] = omega, pairs[column + 4, number]
        # what an acceleration moves it at most
        damping = min(pairs[column + 1, number], 0.999)
        ratio = np.exp(-np.pi * damping / np.sqrt(1.0 - damping * damping))
        ever = 2.0 / (1.0 - ratio) if damping > 0.0 else UNBOUNDED
        table[row + 19, lane] = share * ever / (omega * omega)
    # direction
    table[DIRECTION, lane], table[DIRECTION + 1, lane] = pairs[10, number], pairs[11, number]


@vectorised
def _flush(t):
    """Replace denormal numbers, which are slow, by zero."""
    for lane in range(LANES):
        for body in range(0, 2 * SECOND, SECOND):
            for row in (U, Z):
                value = t[body + row + lane]
                t[body + row + lane] = value if abs(value) > SMALLEST_STATE else 0.0


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
        distance, speed = t[DISTANCE + lane], t[SPEED + lane]
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
        t[DISTANCE + lane] = max(distance, u - w)
        t[SPEED + lane] = max(speed, omega * z - omega_2 * y)


@inlined
def _moved(t, k, u, z, p, start, end):
    """Return the state of a structure after one step."""
    # as if it did not yield: exact where acceleration is linear between samples
    force = t[UP + k] * p + (t[U0 + k] * start + t[U1 + k] * end)
    after = t[UU + k] * u + (t[UZ + k] * z + force)
    force = t[ZP + k] * p + (t[Z0 + k] * start + t[Z1 + k] * end)
    speed = t[ZU + k] * u + (t[ZZ + k] * z + force)
    # the elastic displacement is at most the yield displacement
    elastic, limit = after - p, t[LIMIT + k]
    grown = t[GROWTH + k] * (elastic - min(max(elastic, -limit), limit))
    return after + t[UD + k] * grown, speed + t[ZD + k] * grown, p + grown


@lean
def _is_settled(t, acceleration):
    """Return whether an acceleration makes no structure yield, and raises no maximum."""
    for lane in range(LANES):
        reach = speed = 0.0
        for body in range(2):
            k = body * SECOND + lane
            # about the displacement at rest, which a plastic one leaves
            plastic = (1.0 - t[HARDENING + k]) * t[P + k]
            from_rest = t[U + k] - plastic
            radius = np.sqrt(from_rest * from_rest + t[Z + k] * t[Z + k])
            # what is there fades, and the ground adds this
            radius += acceleration * t[REACH + k]
            if abs(plastic - t[P + k]) + radius > t[LIMIT + k]:
                return False
            reach += radius + (plastic if body == 0 else -plastic)
            speed += t[OMEGA + k] * radius
        if reach > t[DISTANCE + lane] or speed > t[SPEED + lane]:
            return False
    return True
