"""Corners of the filter, chosen with the baseline."""

from functools import partial

import numpy as np
import pytest
from numpy.polynomial import Polynomial
from obspy import Trace
from obspy.core import AttribDict
from scipy.integrate import cumulative_trapezoid

from per_obspy.config import Check, Checks, Processing
from per_obspy.errors import RecordRejected
from per_obspy.processing.earthquake import fallback_highpass
from per_obspy.processing.filter.butterworth import bandpass, pad, taper
from per_obspy.processing.filter.corners import (
    choose_corners,
    clean_corner,
    clean_highpass,
    displacement_drift,
    highest_corner,
    lowest_highpass,
    share_corners,
    with_usable_periods,
)

SETTINGS = Processing()


TABLE = SETTINGS.fallback_highpass


def trace(highpass=0.1, lowpass=30.0):
    numbers = AttribDict(
        highpass=highpass, lowpass=lowpass, highpass_source="noise", lowpass_source="noise"
    )
    return Trace(np.zeros(1000), {"delta": 0.01, "sensor_dip": 0.0, "per_obspy": numbers})


@pytest.mark.parametrize(
    ("magnitude", "corner"), [(2.0, 0.5), (3.5, 0.3), (5.4, 0.3), (7.1, 0.1), (None, 0.08)]
)
def test_the_table_is_used_from_each_magnitude_on(magnitude, corner):
    found = fallback_highpass(magnitude, TABLE, 0.08)
    assert found.frequency == corner
    assert ("constant" if magnitude is None else "table") in found.reason


def test_a_magnitude_below_the_table_gets_the_constant():
    assert fallback_highpass(1.0, {3.0: 0.3}, 0.08).frequency == 0.08


def test_both_horizontals_get_the_narrower_band():
    out = share_corners([trace(0.1, 20.0), trace(0.3, 30.0)])
    first, second = (trace.stats.per_obspy for trace in out)
    assert (first.highpass, first.lowpass) == (second.highpass, second.lowpass) == (0.3, 20.0)
    assert first.own_highpass == 0.1
    assert (first.highpass_source, second.highpass_source) == ("shared", "noise")


def test_limits_from_length_and_sampling():
    assert lowest_highpass(trace()).frequency == pytest.approx(0.1)
    assert highest_corner(trace(), 40.0).frequency == pytest.approx(37.5)
    assert highest_corner(trace(), 20.0).frequency == 20.0


def test_the_reason_names_the_limit():
    clean = clean_corner(trace(), lowest_highpass(trace()), 0.5, SETTINGS)
    assert clean.reason == "one cycle in the record"


@pytest.mark.parametrize(("lowpass", "dt", "shortest"), [(25.0, 0.001, 0.05), (25.0, 0.02, 0.1)])
def test_usable_periods_stay_inside_corners_and_sampling(lowpass, dt, shortest):
    trace = Trace(header={"delta": dt, "per_obspy": AttribDict(highpass=0.1, lowpass=lowpass)})
    out = with_usable_periods(trace, usable=0.8).stats.per_obspy
    assert out.longest_period == pytest.approx(8.0)
    assert out.shortest_period == pytest.approx(shortest)
    assert "longest_period" not in trace.stats.per_obspy


RATE = 100.0


def record(samples, noise=20.0):
    header = {"sampling_rate": RATE, "units": "m/s2", "per_obspy": AttribDict(noise=noise)}
    return Trace(samples, header)


def with_corners(trace, settings, magnitude):
    table, unknown = settings.fallback_highpass, settings.unknown_highpass
    return choose_corners(trace, settings, partial(fallback_highpass, magnitude, table, unknown))


def noisy(samples, level, seed=21):
    return samples + level * np.random.default_rng(seed).normal(size=samples.size)


def test_a_quiet_record_gets_the_widest_band(earthquake):
    chosen = with_corners(record(noisy(earthquake(), 1e-5)), SETTINGS, None).stats.per_obspy
    assert chosen.highpass < 0.05
    assert chosen.lowpass == 37.5
    assert chosen.lowpass_source == "0.75 Nyquist"
    assert chosen.baseline == "mean and line"
    assert chosen.signal_to_noise > 100


def test_more_noise_means_a_narrower_band(earthquake):
    quiet, loud = (
        with_corners(record(noisy(earthquake(), level)), SETTINGS, None).stats.per_obspy
        for level in (0.01, 0.1)
    )
    # both ends of the band move inwards, because of the noise
    assert quiet.highpass < loud.highpass
    assert loud.lowpass < quiet.lowpass
    assert (loud.highpass_source, loud.lowpass_source) == ("noise", "noise")
    assert "signal-to-noise ratio in 0.2-10 Hz" in loud.warnings


def test_noise_without_a_signal_is_rejected():
    with pytest.raises(RecordRejected, match="signal-to-noise ratio of the best octave"):
        with_corners(record(noisy(np.zeros(12000), 1.0)), SETTINGS, None)


@pytest.mark.parametrize(("magnitude", "source"), [(4.0, "table"), (None, "constant")])
def test_without_noise_the_table_or_the_constant_is_the_lowest_corner(
    earthquake, magnitude, source
):
    chosen = with_corners(record(earthquake()[2000:], 0.0), SETTINGS, magnitude).stats.per_obspy
    assert chosen.highpass >= chosen.lowest_highpass == (0.3 if magnitude else 0.08)
    assert source in chosen.lowest_highpass_source


def test_a_baseline_that_shifts_during_the_shaking_costs_the_long_periods(earthquake):
    # mutation: with the corner at which the repaired record merely looks clean, PER at 5 s is wrong
    # by a third
    time = np.arange(12000) / RATE
    shift = np.where(time > 50, 0.02, np.where(time > 21, -0.2, 0.0))
    settings = Processing(highpass_range=(0.001, 0.15))
    shifted = record(noisy(earthquake(shaking=6.0) + shift, 1e-5))
    chosen = with_corners(shifted, settings, None).stats.per_obspy
    assert chosen.baseline in ("displacement polynomial", "two segments", "velocity residual")
    assert chosen.highpass == 0.15
    assert "baseline shifts" in chosen.highpass_source


def test_a_displacement_that_no_corner_cleans_is_rejected(earthquake):
    settings = Processing(highpass_range=(0.001, 0.012), drift=1e-6)
    with pytest.raises(RecordRejected, match="displacement drifts with every baseline"):
        with_corners(record(noisy(earthquake(), 1e-4)), settings, None)


def test_levels_of_the_configuration_decide():
    lenient = Processing(checks=Checks(signal_to_noise=Check(threshold=2.0, level="warn")))
    samples = noisy(np.zeros(12000), 1.0) + np.sin(np.arange(12000) / 30)
    chosen = with_corners(record(samples), lenient, None).stats.per_obspy
    assert chosen.highpass > 0


DT = 0.01


HIGHEST, TARGET = 0.5, 0.02  # Hz; drift of a clean displacement


@pytest.mark.parametrize("highpass", [0.03, 0.1])
def test_against_integration_in_time(earthquake, highpass):
    # mutations: pads counted as record; the displacement not starting from rest; thinning before
    # the filter
    record = taper(Trace(earthquake() + 0.002, {"delta": DT}), 0.05)
    steps = bandpass(pad(record, 0.02, 5), highpass, np.inf, 5)
    first = round(steps.stats.per_obspy.pad_before / DT)
    velocity = cumulative_trapezoid(steps.data, dx=DT, initial=0)
    displacement = cumulative_trapezoid(velocity, dx=DT, initial=0)[first : first + 12000]
    place = np.linspace(-1, 1, displacement.size)
    polynomial = Polynomial.fit(place, displacement, 5)(place)
    expected = np.abs(polynomial).max() / np.abs(displacement).max()
    drift = displacement_drift(record.data, DT, 0.02, 5)
    # content above 10 Hz and peaks between the thinned samples are left out: far below the
    # tolerance of 1e-3 on 2e-2
    assert drift(highpass) == pytest.approx(expected, rel=0.02, abs=1e-4)


def test_the_size_of_the_motion_does_not_matter(earthquake):
    record = earthquake() + 0.002
    once, twice = (displacement_drift(factor * record, DT, 0.02, 5)(0.05) for factor in (1, -7))
    assert once == pytest.approx(twice, rel=1e-9)


def test_a_silent_record_has_no_drift():
    assert displacement_drift(np.zeros(1000), DT, 0.1, 5)(0.2) == 0.0


def test_the_root_is_found_on_a_known_curve():
    corner = clean_highpass(lambda f: 0.02 * (0.1 / f) ** 3, 0.001, HIGHEST, TARGET)
    assert corner == pytest.approx(0.1, rel=2e-3)


def test_the_corner_is_clean_from_there_on():
    # mutation: scanning upwards stops in the accidental dip at 0.01 Hz
    def bumpy(frequency):
        return 0.0 if 0.009 < frequency < 0.011 else 0.02 * 0.1 / frequency

    assert clean_highpass(bumpy, 0.009, HIGHEST, TARGET) == pytest.approx(0.1, rel=2e-3)


def test_a_narrow_band_of_drift_is_not_stepped_over():
    def narrow(frequency):
        return 0.03 if 0.1 < frequency < 0.125 else 0.01

    assert clean_highpass(narrow, 0.001, HIGHEST, TARGET) == pytest.approx(0.125, rel=2e-3)


def test_limits_of_the_corner():
    assert clean_highpass(lambda _: 0.0, 0.03, HIGHEST, TARGET) == 0.03
    assert clean_highpass(lambda _: 1.0, 0.03, HIGHEST, TARGET) is None


def test_a_recorded_drift_is_cleaned_to_the_target(earthquake):
    # a slow wave of 60 s
    wave = 1e-3 * np.sin(2 * np.pi * np.arange(12000) * DT / 60)
    record = taper(Trace(earthquake() + wave, {"delta": DT}), 0.05).data
    drift = displacement_drift(record, DT, 1 / 120, 5)
    corner = clean_highpass(drift, 1 / 120, HIGHEST, TARGET)
    assert drift(corner) == pytest.approx(TARGET, abs=1e-3)
    assert drift(0.9 * corner) > TARGET


def test_corners_of_the_configuration_are_not_searched(earthquake):
    settings = Processing(highpass=0.4, lowpass=20.0)
    chosen = with_corners(record(earthquake()), settings, None).stats.per_obspy
    assert (chosen.highpass, chosen.lowpass, chosen.highpass_source) == (0.4, 20.0, "configuration")
