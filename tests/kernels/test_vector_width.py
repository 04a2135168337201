"""The loop of the measurement computes."""

import numpy as np

from per_obspy.kernels.vector_width import LANES, run_oscillators


def test_the_largest_square_belongs_to_the_states():
    # free decay: the largest square is that of the first step
    table = np.zeros((8, LANES))
    table[0], table[3], table[4], table[5] = 0.5, 0.25, 2.0, 4.0
    run_oscillators(3, table)
    pushes = [1.0, -0.5, -0.5]
    u, largest = 2.0, 0.0
    for k, push in enumerate(pushes):
        u, z = 0.5 * u + push, 4.0 * 0.25 ** (k + 1)
        largest = max(largest, u * u + z * z)
    np.testing.assert_allclose(table[4:7, 5], [u, z, largest], rtol=1e-15)
