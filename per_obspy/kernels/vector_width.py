"""
Measure how fast a loop of the PER kernel runs with the vectors that this process was started for.

Run: ``python -m per_obspy.kernels.vector_width``; prints billion multiply-adds per second.
"""

import time

import numpy as np

from per_obspy.kernels._jit import kernel

#: Oscillators next to each other, steps of a measurement, and measurements, the fastest of which
#: counts.
LANES, STEPS, REPEATS = 64, 20_000, 15
#: Multiply-adds and comparisons per step.
OPERATIONS = 9


@kernel
def run_oscillators(steps, table):
    """Advance oscillators over so many steps; ``table`` (8, lanes) holds steps and states."""
    local = np.empty((8, LANES))
    local[:] = table
    # one push after the other
    for step in range(steps):
        push = 1.0 if step % 8 == 0 else -0.5
        for lane in range(LANES):
            # step matrix, state, and its largest square
            u, z = local[4, lane], local[5, lane]
            after = local[0, lane] * u + (local[1, lane] * z + push)
            z = local[2, lane] * u + (local[3, lane] * z + local[7, lane] * push)
            y = after + local[7, lane] * push
            local[4, lane], local[5, lane] = after, z
            local[6, lane] = max(local[6, lane], y * y + z * z)
    table[:] = local


def measured_speed() -> float:
    """Return billion multiply-adds per second of processor time."""
    # a damped oscillator
    table = np.zeros((8, LANES))
    table[0], table[1], table[2], table[3], table[7] = 0.9, 0.1, -0.1, 0.9, 0.5
    run_oscillators(8, table)
    fastest = np.inf
    for _ in range(REPEATS):
        start = time.process_time()
        run_oscillators(STEPS, table)
        fastest = min(fastest, time.process_time() - start)
    return LANES * STEPS * OPERATIONS / fastest / 1e9


if __name__ == "__main__":
    print(measured_speed())
