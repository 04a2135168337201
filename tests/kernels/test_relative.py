"""The kernel of relative displacement without any wrapper, so short that it also runs uncompiled."""

import numpy as np

from per_obspy.kernels.relative import relative_maxima


def test_a_constant_push_overshoots_to_twice_the_static_displacement():
    # u1 alone (structure 2 hardly takes part): 1 - cos, whose peak lies between the samples
    omega, dt, push = 2 * np.pi, 0.09, -1.5
    north = np.full(9, push)
    north[-1] = 0.0
    pair = np.array([[omega], [0.0], [1.0], [9.0], [0.5], [1e-15], [1.0], [0.0]])
    largest = np.empty((2, 1))
    relative_maxima(north[:7], np.zeros(7), dt, pair, largest)
    assert abs(largest[0, 0] / (2 * 1.5 / omega**2) - 1) < 1e-9


def test_east_is_felt_by_the_sine_of_the_azimuth():
    # mutation: cosine and sine exchanged
    east = np.array([0.0, 1.0, -1.0, 0.0])
    pairs = np.array(
        [[6.0, 6.0], [0.05, 0.05], [1.0, 1.0], [3.0, 3.0], [0.05, 0.05], [1.0, 1.0], [1.0, 0.0], [0.0, 1.0]]
    )
    largest = np.empty((2, 2))
    relative_maxima(np.zeros(4), east, 0.1, pairs, largest)
    assert largest[0, 0] == largest[1, 0] == 0.0
    assert largest[0, 1] > 0.0
