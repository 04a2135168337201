"""The kernel of relative displacements alone, so short that it also runs uncompiled."""

import numpy as np

from per_obspy.kernels.relative.relative_maxima import relative_maxima


def test_a_constant_push_overshoots_to_twice_the_static_displacement():
    # u1 alone (structure 2 hardly takes part): 1 - cos, whose peak lies between the samples
    omega, dt, push = 2 * np.pi, 0.09, -1.5
    north = np.full(9, push)
    north[-1] = 0.0
    pair = np.array([[omega], [0.0], [1.0], [9.0], [0.5], [1e-15], [1.0], [0.0]])
    largest = np.empty((3, 1))
    relative_maxima(north[:7], np.zeros(7), dt, pair, 1e-12, True, largest)
    assert abs(largest[0, 0] / (2 * 1.5 / omega**2) - 1) < 1e-9


def test_east_is_felt_by_the_sine_of_the_azimuth():
    # mutation: cosine and sine exchanged
    east = np.array([0.0, 1.0, -1.0, 0.0])
    structures = np.array([6.0, 0.05, 1.0, 3.0, 0.05, 1.0])
    pairs = np.empty((8, 2))
    pairs[:6] = structures[:, None]
    pairs[6:] = np.eye(2)
    largest = np.empty((3, 2))
    relative_maxima(np.zeros(4), east, 0.1, pairs, 1e-12, True, largest)
    assert largest[0, 0] == largest[1, 0] == 0.0
    assert largest[0, 1] > 0.0


def test_equal_structures_never_separate_and_unequal_ones_are_not_taken_for_them():
    # mutation: one of period, damping and participation not compared; results of the others out of
    # place
    north = np.array([0.0, 1.0, -1.0, 0.0])
    twins = np.array([6.0, 0.05, 1.0, 6.0, 0.05, 1.0, 1.0, 0.0])
    pairs = np.tile(twins[:, None], 5)
    for index, row in ((1, 3), (2, 4), (4, 5)):
        pairs[row, index] *= 1.01
    largest = np.full((3, 5), np.nan)
    relative_maxima(north, np.zeros(4), 0.1, pairs, 1e-12, True, largest)
    assert (largest > 0.0).tolist() == [[False, True, True, False, True]] * 3
    assert np.all(largest[:, [0, 3]] == 0.0)


def test_one_side_alone_is_the_same():
    # catches: a side that is searched only with the other
    rng = np.random.default_rng(4)
    ground = np.concatenate([rng.normal(size=(2, 1500)), np.zeros((2, 1))], axis=1)
    columns = [rng.uniform(4.0, 40.0, 40), rng.uniform(0.01, 0.1, 40), np.ones(40)] * 2
    pairs = np.stack([*columns[:3], columns[0][::-1], *columns[1:3], np.ones(40), np.zeros(40)])
    both, one = np.empty((2, 3, 40))
    relative_maxima(ground[0], ground[1], 0.02, pairs, 1e-12, True, both)
    relative_maxima(ground[0], ground[1], 0.02, pairs, 1e-12, False, one)
    # each is searched from its own window: what is forgotten is 1e-12 of the floor
    np.testing.assert_allclose(one[[0, 2]], both[[0, 2]], rtol=1e-10)
    assert np.all(np.isinf(one[1]))
