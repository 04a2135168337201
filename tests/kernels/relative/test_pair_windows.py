"""Windows of pairs: bounds are never exceeded, and motion outside of windows does not count."""

import numpy as np
import pytest

from per_obspy.kernels.relative import relative_maxima as module
from per_obspy.kernels.relative.bounds import tile_inputs
from per_obspy.kernels.relative.pair_windows import (
    GROUP,
    bound_motion,
    expected_motion,
    find_pair_windows,
    grouped_inputs,
)
from per_obspy.kernels.relative.relative_maxima import relative_maxima
from per_obspy.kernels.relative.relative_samples import PAIR_LANES
from per_obspy.kernels.spectra.tile_search import TILE

DT, GROUPS = 0.02, 24
STEPS = GROUP * TILE
#: Strong motion in two of the groups, weak motion before and after.
RANDOM = np.random.default_rng(3)
STRENGTH = np.repeat(np.where(np.isin(np.arange(GROUPS), (9, 10)), 1.0, 1e-4), STEPS)
GROUND = np.zeros((2, GROUPS * STEPS + 1))
GROUND[:, :-1] = STRENGTH * RANDOM.standard_normal((2, STRENGTH.size))
GROUND[:, 0] = 0.0  # pads before it go on without a step
PAIRS = [
    (20.0, 0.05, 1.0, 9.0, 0.02, 1.3),
    (20.0, 0.05, 1.0, 20.1, 0.05, 1.0),
    (6.0, 0.3, 1.0, 40.0, 0.1, 1.0),
]


def _bounds(pair):
    """Return the block of a pair, and its bounds."""
    block = np.tile([*pair, 0.6, 0.8], (PAIR_LANES, 1))
    bounds = np.empty((4, GROUPS, PAIR_LANES))
    bound_motion(grouped_inputs(tile_inputs(GROUND, DT)), STEPS * DT, block, bounds)
    return block, bounds


@pytest.mark.parametrize("pair", PAIRS)
def test_no_radius_exceeds_its_bound(pair, plain_states):
    # mutation: the gain of one step for that of a group, a participation left out
    _, bounds = _bounds(pair)
    along = 0.6 * GROUND[0] + 0.8 * GROUND[1]
    for body, (omega, damping, share) in enumerate((pair[:3], pair[3:])):
        states = plain_states(along, omega * DT, damping) * share / omega**2
        radius = np.hypot(*states[:-1].T).reshape(GROUPS, STEPS)
        assert np.all(radius.max(axis=1) <= bounds[2 + body, :, 0])
        assert np.all(radius[:, 0] <= bounds[body, :, 0])


@pytest.mark.parametrize("pair", PAIRS)
def test_windows_hold_the_strong_motion_and_leave_out_the_rest(pair):
    block, bounds = _bounds(pair)
    floors, windows = np.empty((2, PAIR_LANES)), np.empty((2, PAIR_LANES), dtype=np.int64)
    expected_motion(block, bounds, 0.1, floors)
    find_pair_windows(STEPS * DT, block, bounds, floors, 1e-12, windows)
    start, last = windows[:, 0]
    # the motion before is forgotten after some groups only
    assert 0 <= start <= 9
    assert 10 <= last < 16


@pytest.mark.parametrize("expected", [1e-9, 1e-3, 0.5])
def test_maxima_do_not_depend_on_what_was_expected(expected, monkeypatch):
    # one round through everything, one that suffices, two rounds; compiled kernels hold the
    # constant, so that the Python source runs
    pairs = np.array([[*pair, 0.6, 0.8] for pair in PAIRS[:1]]).T.copy()
    largest, found = np.empty((3, 1)), np.empty((3, 1))
    short = GROUND[:, 8 * STEPS : 12 * STEPS + 1].copy()
    relative_maxima(short[0], short[1], DT, pairs, 1e-12, True, largest)
    monkeypatch.setattr(module, "EXPECTED", expected)
    getattr(relative_maxima, "py_func", relative_maxima)(
        short[0], short[1], DT, pairs, 1e-12, True, found
    )
    # what is forgotten is 1e-12 of the floor
    np.testing.assert_allclose(found, largest, rtol=1e-10)


def test_weak_motion_before_and_after_changes_nothing():
    # mutation: a window that begins with the strong motion, a lane at rest too late
    pairs = np.array([[*pair, 0.6, 0.8] for pair in PAIRS]).T.copy()
    whole, padded = np.empty((3, 3)), np.empty((3, 3))
    relative_maxima(GROUND[0], GROUND[1], DT, pairs, 1e-12, True, whole)
    pads = np.zeros((2, 40 * STEPS))
    longer = np.concatenate([pads, GROUND, pads], axis=1)
    relative_maxima(longer[0], longer[1], DT, pairs, 1e-12, True, padded)
    np.testing.assert_allclose(padded, whole, rtol=1e-11)
