"""The direction in which two oscillators, driven by two components at once, move furthest apart."""

import numpy as np

from per_obspy.kernels._jit import kernel
from per_obspy.kernels.oscillator.exact_step import step

#: Pairs side by side.
LANES = 32


@kernel
def furthest_apart(north, east, dt, pairs, apart):
    """
    Fill ``apart`` (2, n): north and east part of the largest vector ``q1 u1 - q2 u2`` at the samples.

    ``pairs`` (6, n): circular frequency, damping and participation of 1, then of 2.
    """
    for first in range(0, pairs.shape[1], LANES):
        count = min(LANES, pairs.shape[1] - first)
        coefficients, best = np.zeros((18, LANES)), np.zeros((2, LANES))
        for lane in range(count):
            for body in range(2):
                omega, damping = pairs[3 * body, first + lane], pairs[3 * body + 1, first + lane]
                values = step(omega, damping, dt)
                for row in range(8):
                    coefficients[8 * body + row, lane] = values[row]
                coefficients[16 + body, lane] = pairs[3 * body + 2, first + lane]
        _run(north, east, coefficients, best)
        for lane in range(count):
            apart[0, first + lane], apart[1, first + lane] = best[0, lane], best[1, lane]


@kernel
def _run(north, east, coefficients, best):
    """Advance a block over the record; keep the two parts of the largest distance."""
    c, s, squared, along_north, along_east = (
        coefficients.copy(),
        np.zeros((8, LANES)),
        np.zeros(LANES),
        np.zeros(LANES),
        np.zeros(LANES),
    )
    for i in range(north.size - 1):
        n0, n1, e0, e1 = north[i], north[i + 1], east[i], east[i + 1]
        for lane in range(LANES):
            u, z = s[0, lane], s[1, lane]
            s[0, lane] = c[0, lane] * u + c[1, lane] * z + (c[4, lane] * n0 + c[5, lane] * n1)
            s[1, lane] = c[2, lane] * u + c[3, lane] * z + (c[6, lane] * n0 + c[7, lane] * n1)
            u, z = s[2, lane], s[3, lane]
            s[2, lane] = c[0, lane] * u + c[1, lane] * z + (c[4, lane] * e0 + c[5, lane] * e1)
            s[3, lane] = c[2, lane] * u + c[3, lane] * z + (c[6, lane] * e0 + c[7, lane] * e1)
            u, z = s[4, lane], s[5, lane]
            s[4, lane] = c[8, lane] * u + c[9, lane] * z + (c[12, lane] * n0 + c[13, lane] * n1)
            s[5, lane] = c[10, lane] * u + c[11, lane] * z + (c[14, lane] * n0 + c[15, lane] * n1)
            u, z = s[6, lane], s[7, lane]
            s[6, lane] = c[8, lane] * u + c[9, lane] * z + (c[12, lane] * e0 + c[13, lane] * e1)
            s[7, lane] = c[10, lane] * u + c[11, lane] * z + (c[14, lane] * e0 + c[15, lane] * e1)
            x = c[16, lane] * s[0, lane] - c[17, lane] * s[4, lane]
            y = c[16, lane] * s[2, lane] - c[17, lane] * s[6, lane]
            distance = x * x + y * y
            further = distance > squared[lane]
            squared[lane] = distance if further else squared[lane]
            along_north[lane] = x if further else along_north[lane]
            along_east[lane] = y if further else along_east[lane]
    for lane in range(LANES):
        best[0, lane], best[1, lane] = along_north[lane], along_east[lane]
