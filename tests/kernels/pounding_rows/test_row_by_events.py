"""Long rows event by event: the same maxima as in lanes."""

import numpy as np
from numpy.testing import assert_allclose, assert_array_equal

from per_obspy.kernels.pounding_events import motion as columns
from per_obspy.kernels.pounding_events.contact import LOG_COLUMNS, drop_uncounted, has_room
from per_obspy.kernels.pounding_rows.row_by_events import run_row_by_events
from per_obspy.pounding.kernel_tables import KeptLogs, records_in_steps
from per_obspy.pounding.row_maxima import run_logged_block


def start_of(count):
    """Return lines of buildings at rest with gaps of 5 mm."""
    lines = np.zeros((count, columns.ROW_COLUMNS))
    frequency = 2 * np.pi / np.linspace(0.4, 0.9, count)
    lines[:, columns.DAMPING_RATE], lines[:, columns.STIFFNESS] = 0.05 * frequency, frequency**2
    lines[:, columns.YIELD], lines[:, columns.PARTICIPATION] = np.inf, 1.0
    lines[:, columns.MASS], lines[:, columns.GAP], lines[:, columns.RESTITUTION] = 1.0, 0.005, 0.5
    lines[:, columns.STICKING_SPEED], lines[:, columns.BOUNCE_LIMIT] = 1e-11, 100.0
    lines[:, columns.STICKING_DELAY] = 1e-5
    return lines


def test_events_and_lanes_agree():
    # catches: a direction, a ramp or a free vibration that one of them leaves out
    pulse = -4.0 * np.sin(2 * np.pi * np.arange(40) * 0.02 / 0.8)
    ground = np.stack([pulse, 0.5 * pulse])
    row, log = start_of(3), np.empty((1000, LOG_COLUMNS))
    assert run_row_by_events(*ground, 0.6, 0.8, 0.02, 1, row, log, 64)
    angle, free = np.array([np.arctan2(0.8, 0.6)]), np.array([64])
    record, kept = records_in_steps(ground, [1], 0.02)[1], KeptLogs(1, 4096)
    lines, logs = run_logged_block(record, start_of(3), np.array([0, 3]), angle, free, kept)
    used = int(row[:, columns.IMPACTS].sum())
    assert used > 3
    # both are exact but for the end of bounces
    index = [columns.LARGEST_DISPLACEMENT, columns.LARGEST_RADIUS_SQUARED, columns.APPROACH]
    assert_allclose(lines[:, index], row[:, index], rtol=1e-9)
    drop_uncounted(row, log)
    drop_uncounted(lines, logs[0])
    assert_array_equal(row[:, columns.IMPACTS], lines[:, columns.IMPACTS])


def test_only_impacts_that_count_keep_their_lines():
    # catches: 1 mm/s of the table in place of the speed at the interface, a line that is lost or
    # twice there, room that is made only when the log is already too short
    row, log = np.zeros((3, columns.ROW_COLUMNS)), np.zeros((4, LOG_COLUMNS))
    log[:, 1], log[:, 2] = [0, 0, 1, 1], [0.0015, 0.0009, 0.0015, 0.5]
    row[:, columns.COUNTED_SPEED] = 1e-3
    row[0, columns.APPROACH], row[1, columns.APPROACH] = 0.0015, 0.5
    row[0, columns.IMPACTS], row[1, columns.IMPACTS] = 2, 2
    # 1.5 and 0.9 mm/s; 1.5 mm/s is below 1 % of 0.5 m/s
    assert has_room(row, log)
    assert_array_equal(row[:, columns.IMPACTS], [1, 1, 0])
    assert_array_equal(log[:2, 1:3], [[0, 0.0015], [1, 0.5]])
    # no search again before half of the room left is used: the line of 0.1 mm/s stays
    log[2, 1:3] = 0, 0.0001
    row[0, columns.IMPACTS] += 1
    assert has_room(row, log)
    assert_array_equal(row[:, columns.IMPACTS], [2, 1, 0])
    # the same speeds where the unit of the table is half as large
    row[0, columns.COUNTED_SPEED] = 2e-3
    drop_uncounted(row, log)
    assert_array_equal(row[:, columns.IMPACTS], [0, 1, 0])
    assert_array_equal(log[0, 1:3], [1, 0.5])
