"""Metadata of a simulated event."""

from pathlib import Path

import numpy as np
import pytest
from obspy import Trace, UTCDateTime, read_inventory
from obspy.core.inventory import Comment

from per_obspy.config import Scenario
from per_obspy.records.metadata import with_metadata
from per_obspy.records.simulation.station_metadata import (
    CHANNELS,
    GAIN,
    NOTICE,
    SimulatedStation,
    scenario_event,
    scenario_inventory,
)

SCENARIO = Scenario(magnitude=6.5, origin_time="2001-02-03T04:05:06")
STATIONS = [SimulatedStation("S001", 1.0, 2.0, None), SimulatedStation("S002", 1.5, 2.5, 0.5)]


@pytest.mark.parametrize(("number", "soil"), [(0, "rock"), (1, "lakebed")])
def test_ground_and_notice_are_in_the_comments(number: int, soil: str):
    station = scenario_inventory(SCENARIO, STATIONS)[0][number]
    comments = [comment.value for comment in station.comments]
    assert comments == [NOTICE, f"site_class={soil}"]
    assert station.geology == soil


def test_channels_have_the_orientation_and_the_gain():
    station = scenario_inventory(SCENARIO, STATIONS)[0][1]
    directions = {channel.code: (channel.azimuth, channel.dip) for channel in station}
    assert directions == CHANNELS
    for channel in station:
        assert (channel.latitude, channel.longitude) == (1.5, 2.5)
        assert channel.sample_rate == 1.0 / SCENARIO.dt
        assert channel.response.instrument_sensitivity.value == GAIN


def test_the_event_is_that_of_the_scenario():
    event = scenario_event(SCENARIO)
    assert event.preferred_origin().time == UTCDateTime(2001, 2, 3, 4, 5, 6)
    assert event.preferred_magnitude().mag == 6.5
    assert event.comments[0].text == NOTICE


def test_identifiers_depend_on_the_seed_alone():
    # would catch ObsPy's random identifiers
    assert scenario_event(SCENARIO).resource_id == scenario_event(SCENARIO).resource_id
    other = scenario_event(SCENARIO.model_copy(update={"seed": SCENARIO.seed + 1}))
    assert other.resource_id != scenario_event(SCENARIO).resource_id


def test_the_mark_of_simulated_stations_survives_stationxml(tmp_path: Path):
    path = str(tmp_path / "stations.xml")
    scenario_inventory(SCENARIO, STATIONS).write(path, format="STATIONXML")
    for station in STATIONS:
        trace = Trace(np.zeros(3), header(station.code))
        assert with_metadata(trace, read_inventory(path)).stats.simulated is True


def test_a_real_record_is_never_marked():
    # Same network and channel codes, and a station whose comment only mentions simulations
    inventory = scenario_inventory(SCENARIO, STATIONS)
    inventory[0][0].comments = [Comment("next to a station SIMULATED by per_obspy")]
    trace = Trace(np.zeros(3), header("S001"))
    assert "simulated" not in with_metadata(trace, inventory).stats


def header(code: str) -> dict[str, str]:
    """Return the codes of a record of a simulated station."""
    return {"network": "XX", "station": code, "channel": "HNN"}
