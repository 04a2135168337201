"""The rest of a record is left out only where it changes no result."""

import numpy as np
import pytest
from numpy.testing import assert_array_equal

from per_obspy.kernels.pounding_events import motion as columns
from per_obspy.kernels.pounding_lanes.remaining_motion import remains_still
from per_obspy.pounding import kernel_tables
from per_obspy.pounding.pair_histories import pounding_histories

DT = 0.02


def _record(rng):
    """Return strong noise that fades, and a stronger aftershock that fades, m/s²."""
    fading = 10.0 ** -np.linspace(0.0, 5.0, 1000)
    envelope = np.concatenate([np.ones(300), fading, np.full(200, 1.2), fading])
    return 3.0 * envelope * rng.normal(size=(2, envelope.size))


def _pairs(count, rng):
    """Return pairs with and without gap, linear and bilinear."""
    draws = {
        "period_1": rng.uniform(0.2, 0.8, count),
        "damping_1": rng.uniform(0.05, 0.15, count),
        "mass_1": rng.uniform(0.2, 5.0, count),
        "period_2": rng.uniform(0.2, 0.8, count),
        "damping_2": rng.uniform(0.05, 0.15, count),
        "mass_2": rng.uniform(0.2, 5.0, count),
        "restitution": rng.uniform(0.2, 0.9, count),
        "participation_1": rng.uniform(0.6, 1.6, count),
        "azimuth": rng.uniform(0.0, 360.0, count),
    }
    draws["gap"] = np.where(np.arange(count) % 2, 0.0, rng.uniform(0.002, 0.05, count))
    weak = np.arange(count) % 4 < 2
    draws["yield_displacement_1"] = np.where(weak, rng.uniform(0.02, 0.1, count), np.inf)
    return draws


def _short_and_whole(monkeypatch, record, pairs):
    """Return the maxima of histories, and those of histories that are never left early."""
    short = pounding_histories(record, DT, **pairs)

    def never_still(*arguments):
        """Return records of which no rest is known to be quiet."""
        found = pair_blocks_records(*arguments)
        return {n: one._replace(sizes=np.full_like(one.sizes, 1e30)) for n, one in found.items()}

    pair_blocks_records = kernel_tables.records_in_steps
    monkeypatch.setattr(kernel_tables, "records_in_steps", never_still)
    return short, pounding_histories(record, DT, **pairs)


@pytest.mark.compiled
@pytest.mark.parametrize("wall", [False, True])
def test_histories_are_the_same_bits_as_through_the_whole_record(monkeypatch, wall):
    # mutation: a ground that is taken for quiet
    rng = np.random.default_rng(20 + wall)
    record, pairs = _record(rng), _pairs(24, rng)
    if wall:
        pairs["mass_2"] = np.inf
    short, whole = _short_and_whole(monkeypatch, record, pairs)
    for name in whole._fields:
        assert_array_equal(getattr(short, name), getattr(whole, name), err_msg=name)
    assert (whole.impacts > 0).sum() > 8


def _row(displacement, largest=0.1, fastest=1.0, gap=0.0):
    """Return two linear structures of 1 s and 0.6 s, displaced together."""
    row = np.zeros((2, columns.ROW_COLUMNS))
    omega = 2.0 * np.pi / np.array([1.0, 0.6])
    row[:, columns.DAMPING_RATE] = 0.05 * omega
    row[:, columns.STIFFNESS] = omega**2
    row[:, columns.YIELD] = np.inf
    row[:, columns.PARTICIPATION] = row[:, columns.MASS] = 1.0
    row[:, columns.U], row[:, columns.LARGEST_DISPLACEMENT] = displacement, largest
    row[0, columns.APPROACH], row[0, columns.GAP] = fastest, gap
    row[0, columns.COUNTED_SPEED] = 1e-3
    return row


def _equal_pair(displacement):
    """Return two equal structures that touch, displaced together, before any impact."""
    row = _row(displacement, fastest=0.0)
    row[1] = row[0]
    return row


def test_equal_structures_with_one_state_move_as_one():
    # catches: an impact that is possible, because equation or state of one differs a little
    quiet = np.zeros((2, 40))
    assert not remains_still(_equal_pair(0.2), 1.0, 0.0, quiet, 1.28, 0)
    for column in (
        columns.STIFFNESS, columns.DAMPING_RATE, columns.PARTICIPATION, columns.U, columns.V
    ):  # fmt: skip
        other = _equal_pair(5e-3)
        assert remains_still(other, 1.0, 0.0, quiet, 1.28, 0)
        other[1, column] += 1e-9
        assert not remains_still(other, 1.0, 0.0, quiet, 1.28, 0)
    # a gap between both stays as it is, unless only one of both moves so
    other = _equal_pair(5e-3)
    other[0, columns.GAP] = 1e-4
    assert remains_still(other, 1.0, 0.0, quiet, 1.28, 0)
    other[1, columns.V] += 1e-9
    assert not remains_still(other, 1.0, 0.0, quiet, 1.28, 0)
    # one that yields is no linear structure
    other = _equal_pair(5e-3)
    other[0, columns.YIELD] = 0.01
    assert not remains_still(other, 1.0, 0.0, quiet, 1.28, 0)


def test_equal_structures_that_touch_are_the_same_bits_as_through_the_whole_record(monkeypatch):
    # catches: rounding that sets equal structures apart
    rng = np.random.default_rng(3)
    pairs = _pairs(24, rng) | {"gap": 0.0}
    for name in ("period", "damping", "participation"):
        pairs[f"{name}_2"] = pairs[f"{name}_1"]
    pairs["yield_displacement_1"] = np.inf
    short, whole = _short_and_whole(monkeypatch, _record(rng), pairs)
    for name in whole._fields:
        assert_array_equal(getattr(short, name), getattr(whole, name), err_msg=name)
    assert not whole.impact_velocity.any()


def test_a_pair_that_may_yield_or_touch_goes_on():
    quiet = np.zeros((2, 40))
    assert not remains_still(_row(0.03, gap=0.05), 1.0, 0.0, quiet, 1.28, 0)
    row = _row(0.01, gap=0.05)
    assert remains_still(row, 1.0, 0.0, quiet, 1.28, 0)
    row[0, columns.YIELD] = 0.009
    assert not remains_still(row, 1.0, 0.0, quiet, 1.28, 0)
    row[0, columns.YIELD], row[0, columns.PHASE] = 0.05, 1.0
    assert not remains_still(row, 1.0, 0.0, quiet, 1.28, 0)


def test_a_quiet_pair_is_still_and_an_excited_one_is_not():
    quiet, late = np.zeros((2, 40)), np.zeros((2, 40))
    late[0, 30] = 0.1
    for gap in (0.0, 0.05):
        row = _row(1e-5, gap=gap)
        assert remains_still(row, 1.0, 0.0, quiet, 1.28, 0)
        # a late pulse counts only along its direction, and not once it is over
        strong = 60.0 * late
        assert not remains_still(row, 1.0, 0.0, strong, 1.28, 0)
        assert remains_still(row, 0.0, 1.0, strong, 1.28, 0)
        assert remains_still(row, 1.0, 0.0, strong, 1.28, 31)
        assert not remains_still(_row(0.2, gap=gap), 1.0, 0.0, quiet, 1.28, 0)


def test_impacts_that_count_keep_a_touching_pair_going():
    quiet = np.zeros((2, 40))
    # released from 5 mm both are at most 5e-3 omega fast; 1 % of 1 m/s counts
    assert not remains_still(_row(5e-3), 1.0, 0.0, quiet, 1.28, 0)
    assert remains_still(_row(5e-3, fastest=50.0), 1.0, 0.0, quiet, 1.28, 0)
    # before the first impact every impact is the fastest
    assert not remains_still(_row(1e-9, fastest=0.0), 1.0, 0.0, quiet, 1.28, 0)
