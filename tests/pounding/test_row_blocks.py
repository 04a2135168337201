"""Blocks of rows: packing, and the laws of impact at every single hit."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from numpy.testing import assert_allclose, assert_array_equal

from per_obspy.kernels.pounding_events import contact as log_columns
from per_obspy.kernels.pounding_events import motion as columns
from per_obspy.pounding.kernel_tables import KeptLogs, records_in_steps
from per_obspy.pounding.row_maxima import (
    _run_alone,
    _run_in_lanes,
    packed_rows,
    run_logged_block,
    run_row_blocks,
)
from per_obspy.spectra.elastic import azimuth_maxima


@given(st.lists(st.tuples(st.integers(1, 40), st.sampled_from([1, 2])), min_size=1, max_size=60))
def test_every_row_is_in_one_block_that_has_room(rows):
    # catches: a lost last block, a long row that is cut, rows of different steps together
    sizes, parts = (np.array(numbers) for numbers in zip(*rows, strict=True))
    some = np.flatnonzero(sizes != 2)
    blocks = packed_rows(np.append(0, np.cumsum(sizes)), parts, some)
    assert_array_equal(np.sort(np.concatenate([[], *blocks])), some)
    for block in blocks:
        assert sizes[block].sum() <= 32 or block.size == 1
        assert np.unique(parts[block]).size == 1


def rows_at_rest(sizes, gap, seed):
    """Return lines of random buildings at rest, and the first of each row."""
    random, count = np.random.default_rng(seed), sum(sizes)
    lines = np.zeros((count, columns.ROW_COLUMNS))
    frequency = 2 * np.pi / random.uniform(0.3, 1.5, count)
    lines[:, columns.DAMPING_RATE], lines[:, columns.STIFFNESS] = 0.05 * frequency, frequency**2
    lines[:, columns.YIELD], lines[:, columns.PARTICIPATION] = np.inf, 1.0
    lines[:, columns.MASS] = random.uniform(1.0, 5.0, count)
    lines[:, columns.GAP], lines[:, columns.IN_CONTACT] = gap, gap == 0.0
    lines[:, columns.RESTITUTION] = random.uniform(0.3, 0.9, count)
    lines[:, columns.STICKING_SPEED], lines[:, columns.BOUNCE_LIMIT] = 1e-11, 300.0
    lines[:, columns.STICKING_DELAY] = 1e-5
    return lines, np.append(0, np.cumsum(sizes))


@pytest.mark.parametrize("gap", [0.0, 0.01])
def test_momentum_and_energy_close_at_every_impact(gap):
    # catches: a mass of the neighbour, an impact that is applied and not logged
    start, firsts = rows_at_rest([5, 4], gap, seed=2)
    noise = np.convolve(np.random.default_rng(3).normal(size=400), np.ones(5) / 5, mode="same")
    record = records_in_steps(np.stack([6.0 * noise, np.zeros(400)]), [1], 0.02)[1]
    none = np.zeros(2, dtype=np.int64)
    lines, logs = run_logged_block(record, start, firsts, np.zeros(2), none, KeptLogs(2, 4096))
    for first, end, log in zip(firsts[:-1], firsts[1:], logs, strict=True):
        row = lines[first:end]
        impacts = log[: int(row[:, columns.IMPACTS].sum())]
        assert len(impacts) > 50
        left = impacts[:, log_columns.LOG_LEFT].astype(int)
        mass, other = row[left, columns.MASS], row[left + 1, columns.MASS]
        before = impacts[:, [log_columns.LOG_BEFORE_1, log_columns.LOG_BEFORE_2]].T
        after = impacts[:, [log_columns.LOG_AFTER_1, log_columns.LOG_AFTER_2]].T
        impulse, scale = impacts[:, log_columns.LOG_IMPULSE], abs(before).max()
        # momentum of both, restitution, and the energy lost; rounding of the velocities
        assert (impulse > 0.0).all()
        assert_allclose(mass * (after[0] - before[0]), -impulse, atol=1e-13 * scale)
        assert_allclose(other * (after[1] - before[1]), impulse, atol=1e-13 * scale)
        approach, separation = before[0] - before[1], after[1] - after[0]
        restitution = row[left, columns.RESTITUTION]
        assert_allclose(separation, restitution * approach, atol=1e-13 * scale)
        energy = 0.5 * (mass * (before[0] ** 2 - after[0] ** 2))
        energy += 0.5 * (other * (before[1] ** 2 - after[1] ** 2))
        reduced = mass * other / (mass + other)
        lost = 0.5 * reduced * (1.0 - restitution**2) * approach**2
        assert_allclose(energy, lost, atol=1e-13 * scale**2)
        # they meet where the gap is closed
        displacements = impacts[:, [log_columns.LOG_DISPLACEMENT_1, log_columns.LOG_DISPLACEMENT_2]]
        overlap = displacements[:, 0] - displacements[:, 1] - gap
        assert_allclose(overlap, 0.0, atol=1e-10 * abs(displacements).max())  # required of contacts


@pytest.mark.parametrize("size", [5, 33])
def test_a_row_without_end_is_an_error(size):
    # catches: maxima of a history that stopped
    start, firsts = rows_at_rest([size], 0.001, seed=4)
    start[:, columns.BOUNCE_LIMIT] = -1e6  # no event is allowed
    record = records_in_steps(np.stack([np.sin(np.arange(60.0)), np.zeros(60)]), [1], 0.02)[1]
    none = np.zeros(1, dtype=np.int64)
    with pytest.raises(RuntimeError, match="no end of events"):
        run_logged_block(record, start, firsts, np.zeros(1), none, KeptLogs(1, 4096))
    # nor does a row with too many impacts go on for minutes
    start[:, columns.BOUNCE_LIMIT] = 300.0
    start[0, columns.ALL_IMPACTS] = log_columns.MOST_IMPACTS - 2
    with pytest.raises(RuntimeError, match="more than 4194304 impacts"):
        run_logged_block(record, start, firsts, np.zeros(1), none, KeptLogs(1, 4096))


@pytest.mark.parametrize(("size", "run"), [(4, _run_in_lanes), (33, _run_alone)])
def test_a_log_that_is_too_short_ends_the_run_and_grows(size, run):
    # catches: impacts beyond the room that are counted from memory that holds none, minutes of
    # impacts before a row is refused for their number
    start, firsts = rows_at_rest([size], 0.01, seed=5)
    record = records_in_steps(
        np.stack([5 * np.sin(np.arange(200.0) / 8), np.zeros(200)]), [1], 0.02
    )[1]
    arguments = record, start, firsts, np.zeros(1), np.zeros(1, dtype=np.int64)
    lines, logs = run_logged_block(*arguments, KeptLogs(1, 4096))
    used = int(lines[:, columns.IMPACTS].sum())
    # a shorter log has dropped more of what does not count at the end
    again, grown = run_logged_block(*arguments, KeptLogs(1, 3))
    for one, log in ((lines, logs[0]), (again, grown[0])):
        log_columns.drop_uncounted(one, log)
    assert_array_equal(again, lines)
    counted = int(lines[:, columns.IMPACTS].sum())
    assert counted > 3
    assert_array_equal(grown[0, :counted], logs[0, :counted])
    short, north = np.empty((1, 3, log_columns.LOG_COLUMNS)), (np.ones(1), np.zeros(1))
    assert not run(record, start, short, firsts, north, np.zeros(1, dtype=np.int64))
    # one step too far at most, of many
    assert 3 < start[:, columns.IMPACTS].sum() < used / 2


def test_lanes_without_contact_give_the_spectrum():
    # catches: contact with a building of another row, free vibration that ends too early
    start, firsts = rows_at_rest([1, 4, 2], 9.0, seed=5)
    noise = np.convolve(np.random.default_rng(6).normal(size=400), np.ones(5) / 5, mode="same")
    ground = np.stack([np.append(noise, 0.0), np.zeros(401)])
    record, many = records_in_steps(ground, [1], 0.02)[1], np.full(3, 4096)
    lines, _ = run_logged_block(record, start, firsts, np.zeros(3), many, KeptLogs(3, 4096))
    period = 2 * np.pi / np.sqrt(start[:, columns.STIFFNESS])
    expected = azimuth_maxima(*ground, 0.02, period, 0.05, 0.0)
    assert not lines[:, columns.IMPACTS].any()
    # both are exact
    assert_allclose(lines[:, columns.LARGEST_DISPLACEMENT], expected.sd, rtol=1e-9)
    assert_allclose(np.sqrt(lines[:, columns.LARGEST_RADIUS_SQUARED]), expected.per, rtol=1e-9)


def test_rows_of_two_in_lanes_of_rows_and_of_pairs():
    # catches: rows of two that only one of both blocks follows exactly
    start, firsts = rows_at_rest([2] * 12, 0.004, seed=8)
    start[:12, columns.GAP], start[:12, columns.IN_CONTACT] = 0.0, 1.0
    noise = np.convolve(np.random.default_rng(9).normal(size=400), np.ones(5) / 5, mode="same")
    ground = np.stack([np.append(4.0 * noise, 0.0), np.zeros(401)])
    ones, free = np.ones(12, dtype=np.int64), np.full(12, 320)
    record = records_in_steps(ground, [1], 0.02)[1]
    lines, _ = run_logged_block(record, start, firsts, np.zeros(12), free, KeptLogs(12, 4096))
    motion = ground, 0.02, firsts, start, ones, free, np.zeros(12)
    assert run_row_blocks(*motion).sum() > 300
    index = [columns.LARGEST_DISPLACEMENT, columns.LARGEST_RADIUS_SQUARED, columns.APPROACH]
    assert_allclose(start[:, index], lines[:, index], rtol=1e-9)


def test_logs_are_used_again_by_the_next_block():
    # catches: new memory for every block, one memory for two blocks at a time, logs cut too short
    kept = KeptLogs(3, 8)
    first, second = kept.room(3, 8), kept.room(2, 8)
    assert not np.shares_memory(first, second)
    kept.keep(first)
    # one log has the lines of three: rows of many buildings, of which a block has few, ran twice
    again = kept.fill(1, lambda logs: logs.shape[1])
    assert again.shape == (1, 24, log_columns.LOG_COLUMNS)
    assert np.shares_memory(again, first)
    kept.keep(again)
    # more than it keeps is new and not kept
    for rows, impacts in ((4, 8), (1, 9)):
        larger = kept.room(rows, impacts)
        assert larger.shape[:2] == (rows, impacts)
        assert not np.shares_memory(larger, first)
        kept.keep(larger)
    assert np.shares_memory(kept.room(3, 8), first)
