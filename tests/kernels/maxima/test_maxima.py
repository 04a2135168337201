"""The kernels of largest responses without any wrapper, so short that they also run uncompiled."""

from itertools import pairwise

import numpy as np
import pytest
from numpy.testing import assert_allclose

from per_obspy.kernels._aligned import aligned
from per_obspy.kernels.maxima.maxima import largest_responses
from per_obspy.kernels.maxima.roots import raise_to_root
from per_obspy.kernels.maxima.samples import KEPT, LANES, ROWS, SQUARE, pack_oscillator, run_strides
from per_obspy.kernels.maxima.window import FORGOTTEN, find_windows
from per_obspy.kernels.oscillator.exact_step import step
from per_obspy.kernels.oscillator.within_step import (
    largest_in_step,
    rate_bounds,
    series_terms,
    workspace,
)
from per_obspy.kernels.spectra.blocks import TILE

NORTH, EAST = np.random.default_rng(5).standard_normal((2, 3 * TILE + 1))
PHASES = np.geomspace(1e-3, 8.0, LANES)
DAMPINGS = np.where(np.arange(LANES) % 4 == 0, 0.0, np.linspace(0.01, 0.9, LANES))
WEIGHTS = np.array([np.cos(np.arange(LANES)), np.sin(np.arange(LANES))])


def packed(stride):
    table = np.empty((ROWS, LANES))
    for lane in range(LANES):
        pack_oscillator(stride, PHASES[lane], DAMPINGS[lane], *WEIGHTS[:, lane], table, lane)
    return table


def plain(lane, acceleration, states=(0.0, 0.0)):
    """States at the samples by the plain step."""
    a11, a12, a21, a22, b11, b12, b21, b22 = step(1.0, DAMPINGS[lane], PHASES[lane])
    states = [states]
    for start, end in pairwise(acceleration):
        u, z = states[-1]
        states.append(
            (
                a11 * u + a12 * z + b11 * start + b12 * end,
                a21 * u + a22 * z + b21 * start + b22 * end,
            )
        )
    return np.array(states)


@pytest.mark.parametrize("stride", [1, 2, 4])
def test_strides_are_so_many_steps(stride):
    # mutations: a sample's weight belongs to its neighbour, the matrix of one step, values between
    # strides looked at
    table, kept = packed(stride), np.empty((3, KEPT, LANES))
    run_strides(stride, NORTH, EAST, 0, np.zeros(LANES), table, kept)
    for lane in range(0, LANES, 5):
        states = plain(lane, WEIGHTS[0, lane] * NORTH + WEIGHTS[1, lane] * EAST)
        radius = np.abs(states).max()
        assert_allclose(kept[:, :2, lane], states[: 3 * TILE : TILE], atol=1e-12 * radius)
        assert_allclose(table[:2, lane], states[-1], atol=1e-12 * radius)
        looked_at = states[TILE : 2 * TILE + 1 : stride]
        assert_allclose(kept[1, SQUARE, lane], (looked_at**2).sum(axis=1).max(), rtol=1e-10)
        assert_allclose(kept[1, SQUARE + 1, lane], np.abs(looked_at[:, 0]).max(), rtol=1e-10)


def test_nothing_is_known_of_what_comes_before_the_start():
    # mutation: all oscillators of a block start with the earliest
    table, kept, starts = packed(2), np.empty((3, KEPT, LANES)), np.full(LANES, 11.0)
    starts[7] = 10.0
    run_strides(2, NORTH, EAST, 10, starts, table, kept)
    for lane, first in ((6, TILE), (7, 0)):
        states = plain(lane, (WEIGHTS[0, lane] * NORTH + WEIGHTS[1, lane] * EAST)[first:])
        assert_allclose(table[:2, lane], states[-1], atol=1e-12 * np.abs(states).max())


def test_radii_keep_below_their_bounds_and_windows():
    # mutations: bounds that decay too fast, the norm taken for the radius, a window one group too
    # short; what comes before the start may leave no more than the promised part of the floor
    rng = np.random.default_rng(6)
    quiet = np.concatenate([np.full(40, 1e-7), [1.0], np.full(60, 1e-6)])
    north, east = (np.repeat(quiet, 4) * rng.choice([-1.0, 1.0], 404) for _ in range(2))
    groups = np.stack([np.abs(component).reshape(-1, 4).max(axis=1) for component in (north, east)])
    groups = np.maximum(
        groups, np.append(groups[:, 1:], np.zeros((2, 1)), axis=1)
    )  # steps end in the next group
    table, bounds, windows = packed(1), np.empty((groups.shape[1], LANES)), np.empty((3, LANES))
    floors = np.full(LANES, 0.05)
    find_windows(groups, 4, table, floors, bounds, windows)
    left_out = 0
    for lane in range(LANES):
        felt = np.append(WEIGHTS[0, lane] * north + WEIGHTS[1, lane] * east, 0.0)
        states = plain(lane, felt)[:-1]
        norms = np.sqrt(
            states[:, 0] ** 2 + 2 * DAMPINGS[lane] * states.prod(axis=1) + states[:, 1] ** 2
        )
        radii = np.hypot(*states.T)
        start, first, last = windows[:, lane].astype(int)
        assert np.all(norms[::4] <= bounds[:, lane] * (1 + 1e-12))
        outside = (np.arange(404) < 4 * first) | (np.arange(404) >= 4 * (last + 1))
        assert np.all(radii[outside] < 0.05)
        if last >= 0:
            forgotten = plain(lane, np.zeros(4 * (first - start) + 1), tuple(states[4 * start]))[-1]
            assert np.hypot(*forgotten) <= FORGOTTEN * 0.05
        left_out += outside.sum()
    assert left_out > 4000  # the windows are of use


def lengths(north, phase, damping, stride):
    """Largest radius and displacement of one oscillator that feels the north of one tile."""
    limits = np.array([[np.abs(north).max()], [0.0], [np.abs(np.diff(north)).max()], [0.0]])
    largest, oscillator = np.zeros((2, 1)), np.array([[phase], [damping], [1.0], [0.0]])
    east, order = np.zeros(TILE + 1), np.array([0])
    largest_responses(stride, north, east, limits, limits[:2], 1, oscillator, order, largest)
    return np.sqrt(largest[0, 0]), largest[1, 0]


@pytest.mark.parametrize("stride", [1, 2, 4])
def test_a_constant_push_overshoots_to_twice_the_static_displacement(stride):
    # closed form: 1 - cos, whose peak lies between the samples; mutation: samples alone, which miss
    # 0.4 % and more
    north = np.full(TILE + 1, -1.5)
    north[-1] = 0.0
    assert_allclose(lengths(north, 0.61, 0.0, stride), 3.0, rtol=1e-12)


@pytest.mark.parametrize("stride", [1, 2, 4])
def test_a_late_pulse_is_felt_afterwards(stride):
    # closed form: a triangle's spectrum; mutation: no free vibration, or what does not reach the
    # floor is not run again
    north = np.zeros(TILE + 1)
    north[-2] = 1.0
    phase = 0.1
    amplitude = phase * (np.sin(phase / 2) / (phase / 2)) ** 2
    assert_allclose(lengths(north, phase, 0.0, stride), amplitude, rtol=1e-12)


@pytest.mark.parametrize("damping", [0.0, 0.05, 0.7])
def test_a_root_gives_the_value_of_a_search(damping):
    # mutations: a sign of the correction, the slope of the other condition, a step with two roots
    # called certain
    rng, found = np.random.default_rng(8), 0
    for phase in (0.01, 0.1, 0.45):
        a11, a12, a21, a22, b11, b12, b21, b22 = step(1.0, damping, phase)
        for u, z, start, end in rng.normal(size=(60, 4)) * [1.0, phase, 1.0, 1.0]:
            u_end, z_end = (
                a11 * u + a12 * z + b11 * start + b12 * end,
                a21 * u + a22 * z + b21 * start + b22 * end,
            )
            rates = rate_bounds(
                np.hypot(u, z) + phase * 4.0,
                np.abs([start, end]).max(),
                abs(end - start),
                damping,
                phase,
            )
            for number in (0, 1):
                best, expected = np.zeros(4), np.zeros(4)
                wanted = np.arange(4) == number
                largest_in_step(u, z, start, end, damping, phase, wanted, workspace(), expected)
                ends, terms = (u, z, start, u_end, z_end, end), series_terms(phase)
                if raise_to_root(number, ends, rates, damping, phase, terms, workspace(), best):
                    found += best.any()
                    quantities = [(u * u + z * z, abs(u)), (u_end**2 + z_end**2, abs(u_end))]
                    ours = np.maximum(best[:2], np.max(quantities, axis=0))
                    # the ends are among what the search looks at; 1e-15 of a shift's third power,
                    # and rounding
                    assert_allclose(
                        ours[number], np.maximum(expected[:2], quantities[0])[number], rtol=1e-13
                    )
    assert found > 50  # roots


def test_scratch_space_starts_at_a_cache_line():
    # mutation: the remainder the wrong way round
    for rows in (1, 3, 8):
        space = aligned(rows, 5)
        assert space.shape == (rows, 5)
        assert space.ctypes.data % 64 == 0
