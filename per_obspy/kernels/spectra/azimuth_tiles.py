r"""
Bounds of the squared radius and displacement over all azimuths in each tile, from one pass.

The state under both components is looked at after every fourth step. Along the azimuth ``t`` it is
``cos t`` times that of the north component plus ``sin t`` times that of the east component, so that
``r² = (A + C) / 2 + (A - C) / 2 cos 2t + B sin 2t`` with ``A = un² + zn²``, ``B = un ue + zn ze``,
``C = ue² + ze²`` (for displacements without the z). The larger eigenvalue bounds it for every
azimuth. In between the radius grows by ``|a|`` per unit of phase at most, backwards by ``2 xi r``
more, and a function exceeds the larger of two values by an eighth of their squared distance times
its second derivative at most. Displacements are counted in ``a / omega²``, time as phase.
"""

import math

from per_obspy.kernels._aligned import aligned_line, store_line
from per_obspy.kernels._jit import kernel
from per_obspy.kernels.oscillator.exact_step import step_coefficients
from per_obspy.kernels.oscillator.strides import fill_stride_weights
from per_obspy.kernels.spectra.tile_search import LANES, SMALLEST_STATE, TILE

#: Steps after which the state is looked at. With 8, tiles that hold no maximum pass for it twice as
#: often at periods below 50 steps.
STRIDE = 4
#: ``sqrt(1 + x²) <= 1 + 0.4143 x`` for x from 0 to 1: a bound of the eigenvalue without a square
#: root.
CHORD = 0.41422
#: Rows of a block's table, one column per oscillator: state ``u, z`` under north and under east (0
#: to 3); largest bound of twice the squared radius and squared displacement (4, 5); matrix of a
#: stride, weights of its samples in displacement and in velocity; phase of a step, twice the
#: damping, and growth of a radius backwards over half a stride.
MATRIX, DISPLACED, MOVED, STEP, ROWS = 6, 10, 15, 20, 23
#: Where each row begins in one line of memory.
UN, ZN, UE, ZE, RADIUS, DISPLACEMENT = (row * LANES for row in range(MATRIX))
A11, A12, A21, A22, F0, F1, F2, F3, F4 = (row * LANES for row in range(MATRIX, MOVED))
G0, G1, G2, G3, G4, PHASE, VISCOSITY, GROWTH = (row * LANES for row in range(MOVED, ROWS))


@kernel
def pack(phases, dampings, table):
    """
    Fill the rows of oscillators at rest.

    Parameters
    ----------
    phases, dampings : (LANES,) ndarray
        Phase ``omega * dt`` of a step, rad; fraction of critical.
    table : (ROWS, LANES) ndarray
        Receives a state of zero, matrix and weights of a stride, and the numbers of the bounds.
    """
    table[:] = 0.0
    for lane in range(LANES):
        phase, damping = phases[lane], dampings[lane]
        stride_matrix = step_coefficients(1.0, damping, STRIDE * phase)
        for row in range(4):
            table[MATRIX + row, lane] = stride_matrix[row]
        step = step_coefficients(1.0, damping, phase)
        fill_stride_weights(step, STRIDE, table[DISPLACED:MOVED, lane], table[MOVED:STEP, lane])
        # Phase, twice the damping, growth
        table[STEP, lane], table[STEP + 1, lane] = phase, 2.0 * damping
        table[STEP + 2, lane] = math.exp(STRIDE * damping * phase)


@kernel
def run_azimuth_tiles(north, east, peaks, jumps, table, checkpoints):
    """
    Advance a block over whole tiles; store a checkpoint per tile.

    Parameters
    ----------
    north, east : (tiles * TILE + 1,) ndarray
        Components of the ground acceleration, scaled to a peak of order one.
    peaks, jumps : (2, tiles) ndarray
        Largest absolute acceleration and change over a step, from `tile_search.tile_extremes`, of
        either component.
    table : (ROWS, LANES) ndarray
        Rows from `pack`; the state is advanced to the last sample.
    checkpoints : (TILES, 6, LANES) ndarray
        Receives, per tile, the state before it (rows: u and z under north, u and z under east), in
        the unit of the acceleration (over ``omega²``), then bounds of squared radius and squared
        displacement over all azimuths, at its samples and between them.
    """
    # One line of memory with places that the compiler knows: it needs one pointer, not one per row
    t = aligned_line(table, ROWS, LANES)
    for tile in range(peaks.shape[1]):
        _open_tile(t, checkpoints[tile])
        push = 0.0
        for i in range(tile * TILE, (tile + 1) * TILE, STRIDE):
            # Samples of a stride, of both components
            n0, n1, n2, n3, n4 = north[i], north[i + 1], north[i + 2], north[i + 3], north[i + 4]
            e0, e1, e2, e3, e4 = east[i], east[i + 1], east[i + 2], east[i + 3], east[i + 4]
            for lane in range(LANES):
                # Weighted first samples of north in displacement (f) and velocity (g)
                u, z = t[UN + lane], t[ZN + lane]
                f = t[F0 + lane] * n0 + t[F1 + lane] * n1 + t[F2 + lane] * n2
                g = t[G0 + lane] * n0 + t[G1 + lane] * n1 + t[G2 + lane] * n2
                # State under north after the stride
                un = t[A11 + lane] * u + t[A12 + lane] * z + t[F3 + lane] * n3 + t[F4 + lane] * n4
                zn = t[A21 + lane] * u + t[A22 + lane] * z + t[G3 + lane] * n3 + t[G4 + lane] * n4
                un, zn = un + f, zn + g
                t[UN + lane], t[ZN + lane] = un, zn
                # Weighted first samples of east
                u, z = t[UE + lane], t[ZE + lane]
                f = t[F0 + lane] * e0 + t[F1 + lane] * e1 + t[F2 + lane] * e2
                g = t[G0 + lane] * e0 + t[G1 + lane] * e1 + t[G2 + lane] * e2
                # State under east after the stride
                ue = t[A11 + lane] * u + t[A12 + lane] * z + t[F3 + lane] * e3 + t[F4 + lane] * e4
                ze = t[A21 + lane] * u + t[A22 + lane] * z + t[G3 + lane] * e3 + t[G4 + lane] * e4
                ue, ze = ue + f, ze + g
                t[UE + lane], t[ZE + lane] = ue, ze
                # Squared displacement over all azimuths
                square, east_square = un * un, ue * ue
                displacement = square + east_square
                # Bound of twice the larger eigenvalue: A, 2 B, C
                a, b, c = square + zn * zn, 2.0 * abs(un * ue + zn * ze), east_square + ze * ze
                d = abs(a - c)
                radius = a + c + max(b, d) + CHORD * min(b, d)
                # Raise the bounds of the tile
                t[DISPLACEMENT + lane] = max(t[DISPLACEMENT + lane], displacement)
                t[RADIUS + lane] = max(t[RADIUS + lane], radius)
            # Sums of |a| over both halves of the stride, by the trapezoidal rule
            push = max(push, _push(n0, n1, n2, e0, e1, e2), _push(n2, n3, n4, e2, e3, e4))
        peak = math.hypot(peaks[0, tile], peaks[1, tile])
        _close_tile(t, push, peak, math.hypot(jumps[0, tile], jumps[1, tile]), checkpoints[tile])
    # State for the next stretch of the record
    store_line(t, table, MATRIX)


@kernel
def _push(n0, n1, n2, e0, e1, e2):
    """Return the sum of ``|a|`` over two steps; it is convex over each."""
    start, end = math.sqrt(n0 * n0 + e0 * e0), math.sqrt(n2 * n2 + e2 * e2)
    return 0.5 * (start + end) + math.sqrt(n1 * n1 + e1 * e1)


@kernel
def _open_tile(t, checkpoint):
    """Store the states before a tile and start its bounds with theirs (the trace for radii)."""
    for lane in range(LANES):
        un, zn, ue, ze = t[UN + lane], t[ZN + lane], t[UE + lane], t[ZE + lane]
        # Denormal states become zero
        un, zn = un if abs(un) > SMALLEST_STATE else 0.0, zn if abs(zn) > SMALLEST_STATE else 0.0
        ue, ze = ue if abs(ue) > SMALLEST_STATE else 0.0, ze if abs(ze) > SMALLEST_STATE else 0.0
        t[UN + lane], t[ZN + lane], t[UE + lane], t[ZE + lane] = un, zn, ue, ze
        # Checkpoint and bounds
        checkpoint[0, lane], checkpoint[1, lane] = un, zn
        checkpoint[2, lane], checkpoint[3, lane] = ue, ze
        square = un * un + ue * ue
        t[RADIUS + lane], t[DISPLACEMENT + lane] = 2.0 * (square + zn * zn + ze * ze), square


@kernel
def _close_tile(t, push, peak, jump, checkpoint):
    """
    Store the bounds of a tile, between the states looked at too.

    ``|z'| <= sqrt(1 + 4 xi²) r + |a|`` and ``|(r²)''| <= |z'| (8 xi r + 2 |a|) + 2 r |a'|`` as in
    `within_step.rate_bounds`; ``1 + 2 xi²`` exceeds the root.
    """
    for lane in range(LANES):
        phase, viscosity, square = t[PHASE + lane], t[VISCOSITY + lane], 0.5 * t[RADIUS + lane]
        # Every moment is half a stride at most after or before a state looked at
        radius = (math.sqrt(square) + phase * push) * t[GROWTH + lane]
        # First derivative of z, and second of the squared radius, times the phase of a step
        first = phase * ((1.0 + 0.5 * viscosity * viscosity) * radius + peak)
        bend = first * (4.0 * viscosity * radius + 2.0 * peak) + 2.0 * radius * jump
        # An eighth of the squared length of a stride, over the phase of a step
        eighth = (0.125 * STRIDE * STRIDE) * phase
        length = math.sqrt(t[DISPLACEMENT + lane]) + eighth * first
        largest = min(radius * radius, square + eighth * bend)
        checkpoint[4, lane], checkpoint[5, lane] = largest, min(largest, length * length)
