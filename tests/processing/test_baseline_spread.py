"""Spread of PER over baselines: shifts that bring the velocity to rest, uncertain periods."""

import numpy as np
import pytest
from obspy import Trace
from scipy.integrate import cumulative_trapezoid

from per_obspy.config import Processing
from per_obspy.processing.filter import baseline_spread
from per_obspy.processing.filter.baseline import final_line
from per_obspy.processing.filter.baseline_spread import (
    Shaking,
    longest_certain_period,
    without_drift,
)
from per_obspy.processing.filter.butterworth import bandpass, pad, taper
from per_obspy.spectra.elastic import per_spectrum

DT, COUNT = 0.01, 12000
TIME = np.arange(COUNT) * DT
SHAKING = Shaking(20.0, 40.0)
CORNER = 0.05  # Hz
SETTINGS = Processing()


def box(shift, start, end):
    return np.where((start < TIME) & (end > TIME), shift, 0.0)


def prepared(samples):
    """Return samples as the chain uses them: a straight line removed, tapered."""
    line = np.polynomial.Polynomial.fit(TIME, samples, 1)
    return taper(Trace(samples - line(TIME), {"delta": DT}), SETTINGS.taper).data


def certain(samples, corner=CORNER, settings=SETTINGS):
    return longest_certain_period(samples, prepared(samples), DT, SHAKING, corner, settings)


def test_every_correction_brings_the_velocity_to_rest(earthquake):
    recorded = earthquake() + box(0.02, 24, 200) + box(0.1, 25, 28)
    line = final_line(recorded, TIME, SHAKING.end)
    times = baseline_spread._times_of_shifts(recorded, TIME, SHAKING)
    shifts = baseline_spread._possible_shifts(times, line, np.inf)
    assert len(shifts) == 55  # all pairs of 11 times
    steps = (times[:, np.newaxis] <= TIME).astype(float)
    for shift in shifts:
        corrected = recorded - shift @ steps
        velocity = cumulative_trapezoid(corrected, dx=DT, initial=0)
        # the line is fitted by least squares to the velocity after the shaking: what is left has
        # neither mean nor slope there; a step starts up to one sample from its time
        sample = DT * (abs(shift[shift != 0][0]) + abs(shift.sum()))
        assert abs(velocity[SHAKING.end <= TIME].mean()) < sample + 1e-9


@pytest.mark.parametrize(("interval", "tolerance"), [(DT, 0.01), (0.04, 0.15)])
def test_the_spread_is_that_of_records_that_are_corrected_one_by_one(
    earthquake, monkeypatch, interval, tolerance
):
    recorded = earthquake() + box(0.05, 23, 26)
    periods = np.array([1.0, 2.0, 4.0, 8.0])
    seen = []
    monkeypatch.setattr(baseline_spread, "PERIODS", periods)
    monkeypatch.setattr(baseline_spread, "INTERVAL", interval)
    monkeypatch.setattr(baseline_spread, "_last_within", lambda spread, _: seen.append(spread))
    certain(recorded)

    def radii(samples):
        trace = pad(Trace(samples, {"delta": DT}), CORNER, SETTINGS.order)
        return per_spectrum(bandpass(trace, CORNER, 40.0, SETTINGS.order).data, DT, periods)

    # Every record with its own baseline through the filter at full rate
    times = baseline_spread._times_of_shifts(recorded, TIME, SHAKING)
    line = final_line(recorded, TIME, SHAKING.end)
    ratios, misfits, peak = [], [], 0.5 * np.abs(recorded).max()
    for row in baseline_spread._possible_shifts(times, line, peak):
        (first, second), after = np.flatnonzero(row), row.sum()
        baseline = np.where(
            times[second] <= TIME, after, box(row[first], times[first], times[second])
        )
        velocity = cumulative_trapezoid(recorded - baseline, dx=DT, initial=0)
        displacement = cumulative_trapezoid(velocity, dx=DT, initial=0)
        during = displacement[(SHAKING.onset <= TIME) & (SHAKING.end >= TIME)]
        misfits.append(np.sqrt(np.mean(during**2)))
        corrected = taper(Trace(recorded - baseline, {"delta": DT}), SETTINGS.taper)
        ratios.append(np.log(radii(corrected.data) / radii(prepared(recorded))))
    expected = np.sqrt(np.average(np.square(ratios), axis=0, weights=1 / np.array(misfits)))
    # at full rate up to rounding and the shorter pads; straight lines between samples 0.04 s apart
    # take 13 % of motion at 5 Hz
    np.testing.assert_allclose(seen[0], expected, rtol=tolerance)


@pytest.mark.parametrize("drift", [0.0, 0.05, 0.05 + 2e-4 * TIME])
def test_a_straight_baseline_leaves_no_doubt(earthquake, drift):
    recorded = earthquake() + drift
    assert certain(recorded - recorded[:1900].mean()) == np.inf


def test_a_larger_shift_leaves_fewer_periods(earthquake):
    limits = [certain(earthquake() + box(shift, 23, 26)) for shift in (0.0, 0.02, 0.05, 0.2)]
    assert limits[0] == np.inf
    assert limits[1] > limits[2] > limits[3]
    # and more of them if a larger spread is allowed
    patient = SETTINGS.model_copy(update={"baseline_spread": 0.2})
    assert certain(earthquake() + box(0.05, 23, 26), settings=patient) > limits[2]


def test_a_shift_that_no_baseline_has_leaves_no_period():
    # 20 m/s stay after a record whose peak is 0.6 m/s2
    ground = 0.1 * np.sin(3 * TIME) * np.exp(-(((TIME - 30) / 4) ** 2))
    assert certain(ground + box(0.5, 21, 61)) == baseline_spread.PERIODS[0]


def test_a_higher_corner_removes_doubt(earthquake):
    recorded = earthquake() + box(0.05, 23, 26)
    # without a filter nothing of the shift is removed
    assert certain(recorded, 0.0) <= certain(recorded, 0.05) < certain(recorded, 0.5)


def test_the_fast_part_of_a_shifted_record_has_no_shift():
    step = box(1.0, 60, 200)
    fast = without_drift(step, DT)
    # half of the 10 s of the running mean
    assert np.abs(fast[(TIME < 54.9) | (TIME > 65.1)]).max() < 1e-12
    assert np.abs(fast).max() <= 0.51


def test_a_spread_that_is_too_large_everywhere_ends_at_the_first_period():
    spread = np.full(baseline_spread.PERIODS.size, 0.2)
    assert baseline_spread._last_within(spread, 0.05) == baseline_spread.PERIODS[0]
    # in the middle of two periods, logarithmically
    spread = np.where(baseline_spread.PERIODS < 2.0, 0.0, 0.1)
    first = int(np.argmax(spread > 0))
    middle = np.sqrt(np.prod(baseline_spread.PERIODS[first - 1 : first + 1]))
    assert baseline_spread._last_within(spread, 0.05) == pytest.approx(middle)
