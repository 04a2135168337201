"""Decisions that depend on the earthquake: the same ones mean the same motion."""

import json

import numpy as np
import pytest
from obspy import Stream, Trace, UTCDateTime
from obspy.core import AttribDict

from per_obspy.config import Processing
from per_obspy.processing.chain import process_instrument
from per_obspy.processing.earthquake import Source, same_decisions

SETTINGS = Processing()
START = UTCDateTime(2020, 1, 1)

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
