"""Pickers of the first wave, and the noise before it."""

import json

import numpy as np
import pytest
from numpy.testing import assert_array_equal
from obspy import Stream, Trace, UTCDateTime
from obspy.core import AttribDict
from obspy.core.event import Event, Magnitude, Origin

from per_obspy.config import Processing
from per_obspy.processing.chain import process_instrument
from per_obspy.processing.earthquake import Source, p_arrival, same_decisions, source_of
from per_obspy.processing.noise_window import (
    aic_onset,
    baer_onset,
    energy_ratio_onset,
    noise_windows,
    picked_onset,
)

RATE = 100.0


def noisy(samples, noise=0.003, seed=8):
    return Trace(
        samples + noise * np.random.default_rng(seed).normal(size=samples.size),
        {"sampling_rate": RATE},
    )


@pytest.mark.parametrize("seed", range(5))
def test_the_first_wave_is_found(earthquake, seed):
    onset, spread = picked_onset(noisy(earthquake(seed)))
    # the envelope rises as a square root: it clears the noise (1/1000 of the peak) within a few
    # tenths of a second
    assert onset == pytest.approx(20.0, abs=0.3)
    assert spread >= 0


def test_a_weak_first_wave_is_not_mistaken_for_the_strong_second(earthquake):
    # mutation: picking the largest jump in amplitude finds S
    waves = 0.05 * earthquake(1, onset=20.0) + earthquake(2, onset=32.0)
    assert picked_onset(noisy(waves, 1e-4))[0] == pytest.approx(20.0, abs=0.5)


def test_offset_and_size_do_not_matter(earthquake):
    trace = noisy(earthquake())
    expected = picked_onset(trace)
    trace.data = -1e6 * trace.data + 1e5
    assert picked_onset(trace)[0] == pytest.approx(expected[0], abs=0.02)


@pytest.mark.parametrize("seed", range(3))
def test_noise_has_no_onset(seed):
    assert picked_onset(noisy(np.zeros(6000), 1.0, seed)) is None


@pytest.mark.parametrize("count", [20, 600])
def test_a_silent_record_has_no_onset(count):
    assert picked_onset(Trace(np.zeros(count), {"sampling_rate": RATE})) is None


def test_an_onset_shortly_before_the_peak_is_found():
    samples = np.random.default_rng(6).normal(size=4000) * np.repeat([0.01, 1.0], [3900, 100])
    assert aic_onset(samples) == pytest.approx(3900, abs=5)


def test_each_picker_finds_a_step_of_noise():
    samples = np.random.default_rng(5).normal(size=4000) * np.repeat([0.01, 1.0], 2000)
    assert aic_onset(samples) == pytest.approx(2000, abs=5)
    assert energy_ratio_onset(samples, 100) == pytest.approx(2000, abs=5)
    assert baer_onset(samples, 0.01) == pytest.approx(
        2000, abs=30
    )  # it waits for 0.2 s of certainty
    assert energy_ratio_onset(samples[:150], 100) is None


START = UTCDateTime(2020, 1, 1)


DEGREE = 111.19  # km on the sphere of 6371 km


def component(samples, channel="HNZ", dip=-90.0, **stats):
    header = {"sampling_rate": 100.0, "channel": channel, "sensor_dip": dip, "starttime": START}
    noise = 0.003 * np.random.default_rng(9).normal(size=samples.size)
    return Trace(samples + noise, header | {"per_obspy": AttribDict()} | stats)


def with_window(*traces, source=None, **settings):
    """Return components with noise windows: 0.5 s before the wave, at least 2 s, picks to 10 s."""
    return noise_windows(traces, Processing(**settings), source)


def at(latitude):
    return AttribDict(latitude=latitude, longitude=0.0, elevation=0.0)


def test_near_the_source_p_comes_at_the_speed_of_the_upper_crust():
    source = Source(START, 0.0, 0.0, 0.0, None)
    arrival = p_arrival(component(np.zeros(10), coordinates=at(0.5)), source)
    # 5.8 km/s in iasp91's upper crust; the chord is shorter than the arc by a millionth
    assert arrival - START == pytest.approx(0.5 * DEGREE / 5.8, rel=1e-3)


def test_a_trace_without_coordinates_has_no_computed_arrival():
    assert p_arrival(component(np.zeros(10)), Source(START, 0.0, 0.0, 0.0, None)) is None


def test_the_preferred_origin_and_magnitude_are_used():
    origins = [
        Origin(time=START, latitude=1, longitude=2, depth=3e3),
        Origin(time=START, latitude=4, longitude=5),
    ]
    # the first origin and magnitude, then the preferred ones
    event = Event(origins=origins, magnitudes=[Magnitude(mag=6.0), Magnitude(mag=7.0)])
    assert source_of(event) == Source(START, 1.0, 2.0, 3e3, 6.0)
    event.preferred_origin_id = origins[1].resource_id
    event.preferred_magnitude_id = event.magnitudes[1].resource_id
    assert source_of(event) == Source(START, 4.0, 5.0, 1e4, 7.0)


def test_a_wave_after_the_end_of_the_record_does_not_discard_its_picks(earthquake):
    # a station in a wrong place, thousands of kilometres away, whose record has a clear onset
    vertical = component(earthquake(), coordinates=at(80.0))
    source = Source(START, 0.0, 0.0, 1e4, 6.0)
    picked = with_window(vertical)[0].stats.per_obspy
    assert p_arrival(vertical, source) > vertical.stats.endtime
    far = with_window(vertical, source=source)[0].stats.per_obspy
    assert (far.noise, far.onset) == (picked.noise, picked.onset)
    # a P wave within the record does discard it
    near = component(earthquake(), coordinates=at(0.1))
    assert with_window(near, source=source)[0].stats.per_obspy.onset != picked.onset


def test_a_record_that_ends_before_its_wave_is_not_cut_to_nothing():
    # would catch: no sample left where the hours of continuous records are cut
    quiet = component(np.zeros(3000), coordinates=at(80.0))
    windows = with_window(quiet, source=Source(START, 0.0, 0.0, 1e4, 6.0), **SHORT)
    assert len(windows[0]) == 3000


def test_noise_ends_before_the_pick_of_the_vertical(earthquake):
    # the horizontal alone would give 24.5 s
    vertical, horizontal = (
        component(earthquake(1)),
        component(earthquake(2, onset=25.0), "HNE", 0.0),
    )
    out = with_window(vertical, horizontal)
    assert [trace.stats.per_obspy.noise for trace in out] == pytest.approx([19.5, 19.5], abs=0.3)
    assert "vertical" in out[0].stats.per_obspy.onset_source
    assert UTCDateTime(out[0].stats.per_obspy.onset) - START == pytest.approx(20.0, abs=0.3)
    assert "noise" not in vertical.stats.per_obspy


def test_without_a_vertical_the_horizontals_decide(earthquake):
    east, north = component(earthquake(1), "HNE", 0.0), component(earthquake(2), "HNN", 0.0)
    out = with_window(east, north)
    assert out[0].stats.per_obspy.noise == pytest.approx(19.5, abs=0.3)
    assert "median of 2 picked horizontal" in out[0].stats.per_obspy.onset_source


def test_each_component_counts_from_its_own_start(earthquake):
    late = component(earthquake(onset=18.0), "HNE", 0.0, starttime=START + 2)
    out = with_window(component(earthquake()), late)
    assert out[1].stats.per_obspy.noise == pytest.approx(out[0].stats.per_obspy.noise - 2)


@pytest.mark.parametrize(
    ("delay", "noise", "method"), [(1.0, 19.5, "picked vertical"), (40.0, 59.5, "travel time")]
)
def test_a_pick_far_from_the_computed_arrival_is_replaced_by_it(earthquake, delay, noise, method):
    trace = component(earthquake(), coordinates=at(0.5))
    travel = 0.5 * DEGREE / 5.8
    source = Source(START + 20 + delay - travel, 0.0, 0.0, 0.0, None)
    out = with_window(trace, source=source)[0].stats.per_obspy
    assert out.noise == pytest.approx(noise, abs=0.3)
    assert method in out.onset_source


def test_no_onset_is_no_noise():
    out = with_window(component(np.zeros(6000)))[0].stats.per_obspy
    assert (out.noise, out.onset_source) == (0.0, "no clear onset")


def test_noise_shorter_than_the_limit_counts_as_none(earthquake):
    # 1.5 s are left before the margin of 0.5 s
    out = with_window(component(earthquake(onset=2.0)))[0].stats.per_obspy
    assert out.noise == 0.0


def test_a_given_length_of_noise_is_used(earthquake):
    out = with_window(component(earthquake()), pre_event=7.0)[0].stats.per_obspy
    assert (out.noise, out.onset_source) == (7.0, "configuration")


#: Time kept before and after the first wave, s.
SHORT = {"longest_noise": 15.0, "longest_signal": 60.0}


def test_hours_around_the_shaking_are_cut(earthquake):
    given = component(earthquake())
    out = with_window(given, **SHORT)[0]
    onset = UTCDateTime(out.stats.per_obspy.onset)
    assert out.stats.starttime - (onset - 15.0) == pytest.approx(0.0, abs=0.006)  # half a sample
    assert out.stats.endtime - (onset + 60.0) == pytest.approx(0.0, abs=0.006)
    assert out.stats.per_obspy.noise == pytest.approx(14.5, abs=0.01)
    assert given.stats.npts == 12000


def test_short_records_and_records_without_an_onset_stay_whole(earthquake):
    for samples in (earthquake(), np.zeros(12000)):
        given = component(samples)
        assert_array_equal(with_window(given)[0].data, given.data)


SETTINGS = Processing()


#: An earthquake 55 km from the record, whose P comes near to the pick at 20 s.
HERE = Source(START + 10.5, 0.0, 0.0, 5e3, 6.0)


def processed(samples, source):
    """Return the motion with a source, and its decisions as they are in a file."""
    place = AttribDict(latitude=0.5, longitude=0.0, elevation=0.0)
    header = {"channel": "HNE", "sampling_rate": 100.0, "starttime": START, "units": "m/s2"}
    header |= {"quantity": "acceleration", "coordinates": place, "sensor_azimuth": 90.0}
    decisions = []
    trace = Trace(samples.copy(), header | {"sensor_dip": 0.0})
    out, _ = process_instrument(Stream([trace]), SETTINGS, source._replace(decisions=decisions))
    assert len(out) == 1
    return out[0], json.loads(json.dumps(decisions))


@pytest.fixture(scope="module")
def picked():
    rng = np.random.default_rng(1)
    time = np.arange(12000) / 100.0 - 20.0
    shape = np.where(time > 0, np.clip(time, 0, 2) * np.exp(-np.clip(time, 0, None) / 8), 0.0)
    samples = shape * rng.normal(size=time.size) + 1e-4 * rng.normal(size=time.size)
    return samples, *processed(samples, HERE)


UPDATES = {
    "a magnitude": HERE._replace(magnitude=7.4),
    "no magnitude": HERE._replace(magnitude=None),
    "a place 5 km away": HERE._replace(latitude=0.04, longitude=0.02),
    "a depth": HERE._replace(depth=12e3),
    "a time": HERE._replace(time=HERE.time - 2.0),
}


@pytest.mark.parametrize("update", UPDATES)
def test_an_update_that_keeps_the_pick_changes_no_sample(picked, update):
    # would catch: a decision on which the motion depends and that is not collected
    samples, before, decisions = picked
    assert same_decisions(decisions, UPDATES[update], SETTINGS)
    after, again = processed(samples, UPDATES[update])
    assert after.data.tobytes() == before.data.tobytes()
    assert after.stats.per_obspy == before.stats.per_obspy
    assert again == decisions


def test_an_origin_far_from_the_pick_is_another_decision(picked):
    samples, before, decisions = picked
    early = HERE._replace(time=HERE.time - 15.0)
    assert not same_decisions(decisions, early, SETTINGS)
    after, _ = processed(samples, early)
    assert after.stats.per_obspy.noise != before.stats.per_obspy.noise


@pytest.mark.parametrize(
    ("magnitude", "is_same"), [(5.5, True), (7.9, True), (5.4, False), (None, False)]
)
def test_without_noise_only_the_row_of_the_table_counts(picked, magnitude, is_same):
    samples = picked[0][1950:]
    source = HERE._replace(time=HERE.time - 19.5)
    before, decisions = processed(samples, source)
    assert any("highpass" in decision for decision in decisions)
    update = source._replace(magnitude=magnitude)
    assert same_decisions(decisions, update, SETTINGS) is is_same
    after, _ = processed(samples, update)
    assert (after.data.tobytes() == before.data.tobytes()) is is_same


def test_an_onset_without_a_pick_moves_with_the_earthquake(picked):
    # nothing to pick: the computed P decides, to a tenth of a second
    early = HERE._replace(time=HERE.time - 15.0)
    _, decisions = processed(picked[0], early)
    assert "travel time" in decisions[0]["method"]
    assert same_decisions(decisions, early._replace(magnitude=6.4), SETTINGS)
    assert not same_decisions(decisions, early._replace(time=early.time + 1.0), SETTINGS)


@pytest.mark.parametrize(
    "damage",
    [
        {"onset": 5},
        {"onset": 5, "place": [0, 0], "picks": {}, "method": ""},
        {},
        {"highpass": 3},
        {"onset": 5, "picks": []},
    ],
)
def test_damaged_decisions_are_no_decisions(damage):
    assert not same_decisions([damage], HERE, SETTINGS)
