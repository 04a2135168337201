"""A simulated earthquake: reproducible, labelled, readable by others, and of plausible size."""

import hashlib
from pathlib import Path

import numpy as np
import obspy
import pytest
from numpy.testing import assert_allclose, assert_array_equal
from obspy import Trace, UTCDateTime, read_inventory
from obspy.core.inventory import Comment
from scipy import signal

from per_obspy.config import Scenario
from per_obspy.records.folder import find_stations, read_station
from per_obspy.records.metadata import with_metadata
from per_obspy.simulation import earthquake
from per_obspy.simulation.earthquake import (
    CHANNELS,
    GAIN,
    NOTICE,
    SimulatedStation,
    rock_acceleration,
    scenario_event,
    scenario_inventory,
    simulate,
    write_simulation,
)

GRAVITY = 9.80665
#: epicentre 33 km west of a city of 12 km radius, half of it on the lakebed
SCENARIO = Scenario(stations=8)


@pytest.fixture(scope="module")
def simulation():
    return simulate(SCENARIO)


def _peak(simulation, station, channel="HNE"):
    return np.abs(simulation.stream.select(station=station, channel=channel)[0].data).max() / GAIN


def _sa(
    acceleration: np.ndarray, dt: float, periods: np.ndarray, damping: float = 0.05
) -> np.ndarray:
    """Compute absolute acceleration of oscillators with SciPy, independent of the package."""
    peaks = []
    for omega in 2 * np.pi / periods:
        # (2 xi w s + w^2) / (s^2 + 2 xi w s + w^2), exact for motion linear between samples
        continuous = [2 * damping * omega, omega**2], [1, 2 * damping * omega, omega**2]
        numerator, denominator, _ = signal.cont2discrete(continuous, dt, method="foh")
        peaks.append(np.abs(signal.lfilter(numerator.ravel(), denominator, acceleration)).max())
    return np.array(peaks)


def _soils(simulation):
    return {station.code: station.geology for station in simulation.inventory[0]}


def test_the_same_scenario_gives_the_same_bits(simulation):
    for trace, repeated in zip(simulation.stream, simulate(SCENARIO).stream, strict=True):
        assert_array_equal(trace.data, repeated.data)
        assert trace.stats.starttime == repeated.stats.starttime


def test_no_station_depends_on_another(simulation):
    # would catch one generator passed from station to station
    fewer = simulate(SCENARIO.model_copy(update={"stations": 3}))
    for trace in fewer.stream:
        assert_array_equal(trace.data, simulation.stream.select(id=trace.id)[0].data)


def test_another_seed_gives_another_earthquake(simulation):
    other = simulate(SCENARIO.model_copy(update={"seed": 21, "stations": 1}))
    assert not np.array_equal(other.stream[0].data, simulation.stream[0].data)


def test_written_files_are_what_others_read(simulation, tmp_path):
    write_simulation(simulation, tmp_path)
    contents = find_stations(tmp_path)
    stream, rejected = read_station(contents.stations["XX.S002"], contents.inventory)
    assert (len(stream), rejected) == (3, ())
    # Samples without loss, place and unit
    for trace in stream:
        source = simulation.stream.select(id=trace.id)[0]
        assert_array_equal(trace.data, source.data)
        assert trace.stats.coordinates == source.stats.coordinates
        assert trace.stats.units == source.stats.units == "counts"


def test_files_are_the_same_in_every_run(simulation, tmp_path):
    # would catch ObsPy's random identifiers and its clock
    def hashes(folder: Path) -> dict[str, str]:
        write_simulation(simulation, folder)
        return {
            file.name: hashlib.sha256(file.read_bytes()).hexdigest() for file in folder.iterdir()
        }

    assert hashes(tmp_path / "one") == hashes(tmp_path / "two")


def test_response_and_gain_agree(simulation):
    trace = simulation.stream.select(station="S001", channel="HNN")[0]
    by_gain = trace.data / GAIN
    by_response = trace.copy().remove_response(
        inventory=simulation.inventory, output="ACC", water_level=None, zero_mean=False, taper=False
    )
    # the flat response divides by the same number at every frequency; ObsPy leaves out mean and
    # Nyquist frequency, which lie within the background noise
    assert_allclose(by_response.data, by_gain, atol=2 * SCENARIO.noise)


def test_rounding_to_counts_lies_below_the_noise(simulation):
    assert SCENARIO.noise > 0.5 / GAIN
    quiet = simulation.stream[0].data[: int(0.9 * earthquake.PRE_EVENT / SCENARIO.dt)] / GAIN
    # root mean square of 1800 samples: 2 % of scatter; some of the P wave leaks ahead of it through
    # the filters
    assert (
        0.8 * SCENARIO.noise
        < np.sqrt(np.mean(quiet**2))
        < 0.01 * np.abs(simulation.stream[0].data).max() / GAIN
    )


def test_motion_ends_where_it_began(simulation):
    for trace in simulation.stream:
        velocity = np.cumsum(trace.data / GAIN) * SCENARIO.dt
        assert (
            abs(velocity[-1]) < 0.05 * np.abs(velocity).max()
        )  # the omega-squared spectrum has no mean; waves at the low corner outlast the record


def test_larger_earthquakes_shake_more():
    peaks = [
        _peak(simulate(Scenario(stations=1, magnitude=m, lakebed_radius=0.0)), "S001")
        for m in (5.0, 6.0, 7.0)
    ]
    ratios = np.divide(peaks[1:], peaks[:-1])
    # published medians of PGA at 40 km grow by 2.7 from magnitude 5 to 6 and 2.0 from 6 to 7 (Boore
    # & Atkinson 2008, eq. 1-5); a single record scatters by 1.3
    assert ((ratios > 1.4) & (ratios < 7.0)).all()


def test_places_vary_as_recorded_ones_do(monkeypatch):
    # ln SA of one earthquake at places so far apart that they know nothing of each other: published
    # deviations within and between events are 0.55 to 0.7 (Boore and others 2014); of 40 places the
    # deviation itself has one of 11 %: three of them
    periods = np.array([0.2, 0.5, 1.0, 2.0])
    monkeypatch.setattr(earthquake, "SITE_REACH", 500.0)
    far = SCENARIO.model_copy(update={"stations": 40, "lakebed_radius": 0.0})
    stream = simulate(far).stream.select(channel="HNN")
    logs = np.log([_sa(trace.data / GAIN, far.dt, periods) for trace in stream])
    deviations, correlations = logs.std(axis=0, ddof=1), np.corrcoef(logs.T)
    assert ((deviations > 0.55 * 0.67) & (deviations < 0.7 * 1.33)).all()
    # neighbouring periods 0.75 (Baker & Jayaram 2008), 0.2 and 2 s 0.25; standard error 0.07, 0.15
    assert 0.5 < np.mean(np.diag(correlations, 1)) < 0.95
    assert -0.2 < correlations[0, 3] < 0.7


def test_shaking_decays_with_distance():
    near, far = (
        simulate(Scenario(stations=1, city_longitude=x, lakebed_radius=0.0)) for x in (0.3, 1.2)
    )
    ratio = _peak(near, "S001") / _peak(far, "S001")
    # between 1/sqrt(R) without attenuation (2) and 1/R**2 (16) for four times the distance
    assert 2.0 < ratio < 16.0


def test_rock_of_magnitude_seven_has_the_published_size():
    # Boore & Atkinson (2008), M 7, Rjb 35 km, Vs30 620 m/s: PGA 0.12 g, log-std 0.56: the mean of
    # eight sites lies within a factor of two
    rock = simulate(Scenario(stations=8, lakebed_radius=0.0, site_log_std=0.0))
    stations = [f"S{number:03d}" for number in range(1, 9)]
    peaks = [_peak(rock, station) / GRAVITY for station in stations]
    assert 0.055 < np.exp(np.mean(np.log(peaks))) < 0.22
    traces = [rock.stream.select(station=station, channel="HNE")[0] for station in stations]
    one_second = [
        _sa(trace.data / GAIN, SCENARIO.dt, np.array([1.0])) / GRAVITY for trace in traces
    ]
    # rock spectra of design codes have SA(1 s) / PGA near 1 (ASCE 7 with S1/Ss = 0.4); a factor of
    # two
    assert 0.5 < np.exp(np.mean(np.log(one_second))) / np.exp(np.mean(np.log(peaks))) < 2.0


def test_lakebed_resonates_near_two_seconds(simulation):
    periods = np.geomspace(0.3, 6.0, 25)
    soils = _soils(simulation)
    assert set(soils.values()) == {"rock", "lakebed"}
    for station, soil in soils.items():
        trace = simulation.stream.select(station=station, channel="HNN")[0]
        spectrum = _sa(trace.data / GAIN, SCENARIO.dt, periods)
        peak = periods[spectrum.argmax()]
        if soil == "lakebed":
            assert 1.4 < peak < 2.9  # 0.5 Hz with a log-standard deviation of 0.1, and a broad peak
        else:
            assert peak < 1.4


def test_horizontals_are_correlated_by_the_coefficient(monkeypatch):
    def correlation(coefficient: float) -> float:
        monkeypatch.setattr(earthquake, "CORRELATION", coefficient)
        stream = simulate(Scenario(stations=12, lakebed_radius=0.0)).stream
        pairs = zip(stream.select(channel="HNN"), stream.select(channel="HNE"), strict=True)
        return float(np.mean([np.corrcoef(north.data, east.data)[0, 1] for north, east in pairs]))

    # about 100 independent samples a record (10 s of 5 Hz noise) and 12 records: 0.03 of scatter;
    # four times that
    assert abs(correlation(0.3) - 0.3) < 0.12
    assert abs(correlation(-0.5) + 0.5) < 0.12


def test_a_city_across_the_date_line():
    # would catch longitudes beyond 180, which StationXML does not know
    far = simulate(
        Scenario(stations=8, longitude=-179.8, city_longitude=179.99, lakebed_longitude=179.99)
    )
    longitudes = np.array([station.longitude for station in far.inventory[0]])
    assert (np.abs(longitudes) <= 180).all()
    assert (longitudes > 0).any()
    assert (longitudes < 0).any()


def test_a_scenario_at_no_time():
    with pytest.raises(ValueError, match="origin_time"):
        Scenario(origin_time="yesterday")


def test_the_motion_on_rock_needs_no_station():
    # the same source and path: the station's number only chooses the noise
    north, east, up = rock_acceleration(SCENARIO, 40_000.0)
    assert north.shape == east.shape == up.shape
    twice = rock_acceleration(SCENARIO, 80_000.0)
    assert np.abs(twice[0]).max() < np.abs(north).max()


SMALL = Scenario(magnitude=6.5, origin_time="2001-02-03T04:05:06")
STATIONS = [SimulatedStation("S001", 1.0, 2.0, None), SimulatedStation("S002", 1.5, 2.5, 0.5)]


@pytest.mark.parametrize(("number", "soil"), [(0, "rock"), (1, "lakebed")])
def test_ground_and_notice_are_in_the_comments(number: int, soil: str):
    station = scenario_inventory(SMALL, STATIONS)[0][number]
    comments = [comment.value for comment in station.comments]
    assert comments == [NOTICE, f"site_class={soil}"]
    assert station.geology == soil


def test_channels_have_the_orientation_and_the_gain():
    station = scenario_inventory(SMALL, STATIONS)[0][1]
    directions = {channel.code: (channel.azimuth, channel.dip) for channel in station}
    assert directions == CHANNELS
    for channel in station:
        assert (channel.latitude, channel.longitude) == (1.5, 2.5)
        assert channel.sample_rate == 1.0 / SMALL.dt
        assert channel.response.instrument_sensitivity.value == GAIN


def test_the_mark_of_simulated_stations_survives_stationxml(tmp_path: Path):
    path = str(tmp_path / "stations.xml")
    scenario_inventory(SMALL, STATIONS).write(path, format="STATIONXML")
    for station in STATIONS:
        trace = Trace(np.zeros(3), header(station.code))
        assert with_metadata(trace, read_inventory(path)).stats.simulated is True


def test_a_real_record_is_never_marked():
    # Same network and channel codes, and a station whose comment only mentions simulations
    inventory = scenario_inventory(SMALL, STATIONS)
    inventory[0][0].comments = [Comment("next to a station SIMULATED by per_obspy")]
    trace = Trace(np.zeros(3), header("S001"))
    assert "simulated" not in with_metadata(trace, inventory).stats


def header(code: str) -> dict[str, str]:
    """Return the codes of a record of a simulated station."""
    return {"network": "XX", "station": code, "channel": "HNN"}


def test_everything_says_that_it_is_simulated(simulation):
    assert {trace.stats.network for trace in simulation.stream} == {"XX"}
    assert "SIMULATED" in simulation.inventory.source
    assert all("SIMULATED" in station.comments[0].value for station in simulation.inventory[0])
    assert "SIMULATED" in simulation.event.comments[0].text
    assert "simulated" in simulation.event.event_descriptions[0].text


def test_written_files_are_found(simulation, tmp_path):
    write_simulation(simulation, tmp_path)
    contents = find_stations(tmp_path)
    assert contents.rejected == ()
    assert sorted(contents.stations) == [f"XX.S{number:03d}" for number in range(1, 9)]
    (event,) = obspy.read_events(tmp_path / "event.xml")
    assert event.preferred_magnitude().mag == 7.0


def test_the_event_is_that_of_the_scenario():
    event = scenario_event(SMALL)
    assert event.preferred_origin().time == UTCDateTime(2001, 2, 3, 4, 5, 6)
    assert event.preferred_magnitude().mag == 6.5
    assert event.comments[0].text == NOTICE


def test_identifiers_depend_on_the_seed_alone():
    # would catch ObsPy's random identifiers
    assert scenario_event(SMALL).resource_id == scenario_event(SMALL).resource_id
    other = scenario_event(SMALL.model_copy(update={"seed": SMALL.seed + 1}))
    assert other.resource_id != scenario_event(SMALL).resource_id
