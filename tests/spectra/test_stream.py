"""Spectra of a Stream of several stations."""

import numpy as np
import obspy
import pytest
from numpy.testing import assert_array_equal

from per_obspy import station_spectra, stream_spectra

PERIODS = [0.3, 1.0]


def component(station: str, channel: str, seed: int) -> obspy.Trace:
    """Return a component in m/s2."""
    data = np.random.default_rng(seed).normal(size=400)
    header = {"delta": 0.01, "network": "XX", "station": station, "channel": channel}
    return obspy.Trace(data, header | {"units": "m/s2"})


def test_every_station_has_the_spectra_that_it_has_alone():
    stream = obspy.Stream(
        [component(name, f"HN{end}", seed) for seed, (name, end) in enumerate(["BN", "AN", "BE"])]
    )
    joined = stream_spectra(stream, PERIODS)
    assert joined["station"].to_numpy().tolist() == ["XX.A", "XX.B"]
    for name in ("A", "B"):
        alone = station_spectra(stream.select(station=name), PERIODS)
        found = joined["per"].sel(station=f"XX.{name}").dropna("component")
        assert_array_equal(found, alone["per"])


def test_a_trace_is_a_stream_of_one():
    assert stream_spectra(component("A", "HNE", 1), PERIODS).sizes["station"] == 1


def test_an_empty_stream_is_refused():
    with pytest.raises(ValueError, match="no traces"):
        stream_spectra(obspy.Stream())
