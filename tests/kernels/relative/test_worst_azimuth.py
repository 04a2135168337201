"""The longest separation of two oscillators, against the plain step."""

import numpy as np

from per_obspy.kernels.relative.worst_azimuth import largest_separation

DT = 0.05
GROUND = np.random.default_rng(11).standard_normal((2, 81))


def test_the_longest_vector_at_the_samples(plain_states):
    # mutations: components or structures exchanged, participation left out, one part of another
    # sample; 40 pairs are more than a block
    random = np.random.default_rng(12)
    pairs = np.stack(
        [
            random.uniform(2.0, 20.0, 40),
            random.uniform(0.0, 0.3, 40),
            random.uniform(0.8, 1.5, 40),
            random.uniform(2.0, 20.0, 40),
            random.uniform(0.0, 0.3, 40),
            random.uniform(0.8, 1.5, 40),
        ]
    )
    separation = np.empty((2, 40))
    largest_separation(*GROUND, DT, pairs, separation)
    for index in (0, 17, 31, 32, 39):
        omega_1, damping_1, q_1, omega_2, damping_2, q_2 = pairs[:, index]
        vector = np.stack(
            [
                q_1 * plain_states(component, omega_1 * DT, damping_1)[:, 0] / omega_1**2
                - q_2 * plain_states(component, omega_2 * DT, damping_2)[:, 0] / omega_2**2
                for component in GROUND
            ]
        )
        longest = np.argmax((vector**2).sum(axis=0))
        np.testing.assert_allclose(separation[:, index], vector[:, longest], rtol=1e-11)


def test_equal_structures_never_separate():
    pair = np.array([[9.0], [0.05], [1.2], [9.0], [0.05], [1.2]])
    separation = np.full((2, 1), np.nan)
    largest_separation(*GROUND, DT, pair, separation)
    # rounding of displacements of the order of 1 / omega²
    assert np.abs(separation).max() < 1e-16
