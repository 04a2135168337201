"""
A simulated earthquake as a network would deliver it: counts, station metadata and the event.

All files are marked as simulated: network ``XX``, comments in StationXML and QuakeML. The two
horizontals are correlated with the configured coefficient; the vertical is independent of them.
Samples are whole counts, as a digitiser of 24 bits gives them (the step, 5e-6 m/s2, lies below the
background noise), which MiniSEED stores without loss. Each station has separate random numbers,
so that no other station changes a sample of it.
"""

from io import BytesIO
from pathlib import Path
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray
from obspy import Inventory, Stream, Trace, UTCDateTime
from obspy.core.event import Catalog, Event, ResourceIdentifier
from obspy.geodetics import gps2dist_azimuth
from scipy import fft

from per_obspy import config
from per_obspy.checks import FloatArray
from per_obspy.constants import METRES_PER_DEGREE
from per_obspy.files import written_whole
from per_obspy.names import inside
from per_obspy.records.metadata import with_metadata
from per_obspy.records.simulation import stochastic
from per_obspy.records.simulation.station_metadata import (
    CHANNELS,
    GAIN,
    NETWORK,
    SimulatedStation,
    scenario_event,
    scenario_inventory,
)
from per_obspy.records.simulation.variability import log_variation

#: Key of the random numbers of the variation between places, which no station's number is.
FIELD = 1_000_000

#: P waves relative to S waves: velocity and amplitude.
P_VELOCITY, P_AMPLITUDE = np.sqrt(3.0), 0.2


class Simulation(NamedTuple):
    """
    A simulated event with its records.

    Attributes
    ----------
    stream : Stream
        Raw counts, three components per station.
    inventory : Inventory
        Station metadata with response.
    event : Event
        Origin and magnitude.
    """

    stream: Stream
    inventory: Inventory
    event: Event


def simulate(scenario: config.Scenario) -> Simulation:
    """
    Simulate an earthquake and its records.

    Parameters
    ----------
    scenario : config.Scenario
        Source, path, sites and stations.

    Returns
    -------
    simulation : Simulation
        Raw counts (``GAIN`` per m/s2), inventory and event; the same bits for the same scenario.
    """
    stations = [_station(scenario, number) for number in range(scenario.stations)]
    inventory = scenario_inventory(scenario, stations)
    stream = Stream()
    for number, station in enumerate(stations):
        stream.extend(_records(scenario, number, station, inventory))
    return Simulation(stream, inventory, scenario_event(scenario))


def write_simulation(simulation: Simulation, folder: str | Path) -> None:
    """
    Write a simulation into a folder.

    It gets one MiniSEED file per station, ``stations.xml`` (StationXML) and ``event.xml``
    (QuakeML).

    Parameters
    ----------
    simulation : Simulation
        From :func:`simulate`.
    folder : str or Path
        Made if it does not exist.
    """
    target = Path(folder)
    # Whole counts, which Steim compression holds
    for code in sorted({trace.stats.station for trace in simulation.stream}):
        stream = simulation.stream.select(station=code).copy()
        for trace in stream:
            trace.data = trace.data.astype(np.int32)
        with written_whole(inside(target, f"{NETWORK}.{code}.mseed")) as part:
            # ObsPy's writer of MiniSEED ignores errors of the disk: only memory is safe
            content = BytesIO()
            stream.write(content, format="MSEED", encoding="STEIM2")
            part.write_bytes(content.getvalue())
    with written_whole(target / "stations.xml") as part:
        simulation.inventory.write(part, format="STATIONXML")
    with written_whole(target / "event.xml") as part:
        catalog = Catalog([simulation.event], resource_id=_catalog_id(simulation.event))
        catalog.write(part, format="QUAKEML")


def _catalog_id(event: Event) -> ResourceIdentifier:
    """Return an identifier that depends on the event alone, where ObsPy's would be random."""
    return ResourceIdentifier(f"{event.resource_id.id}/catalog")


def _random(scenario: config.Scenario, *key: int) -> np.random.Generator:
    """Return the random numbers of a key, which no other key shares."""
    return np.random.default_rng([scenario.seed, *key])


def _station(scenario: config.Scenario, number: int) -> SimulatedStation:
    """Return a station of the city; its number alone decides its place."""
    latitude, longitude = _place(scenario, number)
    from_lake, _, _ = gps2dist_azimuth(
        latitude, longitude, scenario.lakebed_latitude, scenario.lakebed_longitude
    )
    # The frequency of the lakebed scatters from station to station
    scatter = np.exp(scenario.lakebed_scatter * _random(scenario, number, 0).standard_normal())
    lakebed = scenario.lakebed_frequency * scatter if from_lake < scenario.lakebed_radius else None
    return SimulatedStation(f"S{number + 1:03d}", round(latitude, 5), round(longitude, 5), lakebed)


def _place(scenario: config.Scenario, number: int) -> tuple[float, float]:
    """
    Return latitude and longitude of a station, degrees.

    The R2 low-discrepancy sequence spreads stations evenly over the city, however many they are.
    """
    plastic = 1.3247179572447458
    radius = scenario.city_radius * np.sqrt((0.5 + number / plastic) % 1.0)
    angle = 2.0 * np.pi * ((0.5 + number / plastic**2) % 1.0)
    # North and east on the mean Earth
    latitude = scenario.city_latitude + _degrees(radius * np.cos(angle))
    east = _degrees(radius * np.sin(angle)) / np.cos(np.deg2rad(latitude))
    longitude = (scenario.city_longitude + east + 180.0) % 360.0 - 180.0
    return latitude, longitude


def _degrees(metres: float) -> float:
    return metres / METRES_PER_DEGREE


def _hypocentral(scenario: config.Scenario, station: SimulatedStation) -> float:
    """Return the hypocentral distance of a station, m."""
    epicentral, _, _ = gps2dist_azimuth(
        scenario.latitude, scenario.longitude, station.latitude, station.longitude
    )
    return float(np.hypot(epicentral, scenario.depth))


def _records(
    scenario: config.Scenario, number: int, station: SimulatedStation, inventory: Inventory
) -> list[Trace]:
    """Return the records of a station, counts; they begin before the P waves."""
    distance = _hypocentral(scenario, station)
    p_wave = UTCDateTime(scenario.origin_time) + distance / (P_VELOCITY * scenario.shear_velocity)
    header = {
        "network": NETWORK,
        "station": station.code,
        "delta": scenario.dt,
        "starttime": p_wave - scenario.pre_event,
    }
    # One trace per component
    motion = _acceleration(scenario, number, station, distance)
    traces = []
    for channel, samples in zip(CHANNELS, motion, strict=True):
        counts = Trace(np.rint(GAIN * samples), header | {"channel": channel})
        traces.append(with_metadata(counts, inventory))
    return traces


def _acceleration(
    scenario: config.Scenario, number: int, station: SimulatedStation, hypocentral: float
) -> FloatArray:
    """Return north, east and up in m/s2, (3, n_samples): background, P waves, S waves."""
    distance = stochastic.effective_distance(hypocentral, scenario.magnitude)
    shaking = stochastic.duration(scenario.magnitude, distance)
    s_wave = scenario.pre_event + hypocentral / scenario.shear_velocity * (1.0 - 1.0 / P_VELOCITY)
    n_samples = _n_samples(scenario, station, s_wave, shaking)
    # As many zeros again, so that the end of a filtered motion does not wrap round to its front
    n_padded = fft.next_fast_len(2 * n_samples, real=True)
    spectra = _spectra(scenario, station, distance, n_padded)
    window = stochastic.saragoni_hart_window(n_padded, scenario.dt, shaking)
    # Background noise, then the two waves, each from separate noise
    generator = _random(scenario, number, 1)
    motion = scenario.noise * generator.standard_normal((3, n_samples))
    for arrival, amplitude in ((scenario.pre_event, P_AMPLITUDE), (s_wave, 1.0)):
        shape = _delayed(window, round(arrival / scenario.dt))
        noise = _correlated(generator.standard_normal((3, n_padded)), scenario.correlation)
        wave = stochastic.shaped_noise(noise, shape, spectra, scenario.dt)
        motion += amplitude * wave[:, :n_samples]
    return motion


def rock_acceleration(scenario: config.Scenario, hypocentral: float) -> FloatArray:
    """
    Simulate the motion of a place on rock, without digitiser.

    Parameters
    ----------
    scenario : config.Scenario
        Source and path.
    hypocentral : float
        Distance, m.

    Returns
    -------
    acceleration : (3, n_samples) ndarray
        North, east and up, m/s2.
    """
    place = SimulatedStation("", scenario.city_latitude, scenario.city_longitude, None)
    return _acceleration(scenario, 0, place, hypocentral)


def _n_samples(
    scenario: config.Scenario, station: SimulatedStation, s_wave: float, shaking: float
) -> int:
    """Return the length of a record: S waves until their window ends, then the lakebed rings."""
    lasts = s_wave + 2.5 * stochastic.WINDOW_STRETCH * shaking + _ringing(scenario, station)
    return int(np.ceil(lasts / scenario.dt))


def _ringing(scenario: config.Scenario, station: SimulatedStation) -> float:
    """Return the time in which the lakebed under a station comes to rest, s; 0 on rock."""
    if station.lakebed is None:
        return 0.0
    return 10.0 / (2.0 * np.pi * station.lakebed * scenario.lakebed_damping)


def _delayed(shape: FloatArray, samples: int) -> FloatArray:
    """Return a window that begins later, of the same length."""
    return np.concatenate([np.zeros(samples), shape[: shape.size - samples]])


def _correlated(noise: FloatArray, correlation: float) -> FloatArray:
    """Return three rows of noise of which the first two are correlated."""
    north, east, up = noise
    return np.stack([north, correlation * north + np.sqrt(1.0 - correlation**2) * east, up])


def _spectra(
    scenario: config.Scenario, station: SimulatedStation, distance: float, n_samples: int
) -> NDArray[np.complex128]:
    """Return the Fourier spectra of north, east and up, m/s, (3, n_frequencies)."""
    frequency = fft.rfftfreq(n_samples, scenario.dt)
    source = stochastic.source_spectrum(
        frequency,
        scenario.magnitude,
        scenario.shear_velocity,
        scenario.density,
    )
    path = stochastic.path_spectrum(
        frequency, distance, scenario.shear_velocity, scenario.quality, scenario.quality_exponent
    )
    # Rock, and for a station on it the lakebed
    variation = np.exp(scenario.site_log_std * _variation(scenario, station, frequency))
    rock = source * path * stochastic.rock_response(frequency, scenario.kappa) * variation
    motion = rock.astype(np.complex128)
    if station.lakebed is not None:
        motion *= stochastic.kanai_tajimi(frequency, station.lakebed, scenario.lakebed_damping)
    return np.stack([motion, motion, scenario.vertical * motion])


def _variation(
    scenario: config.Scenario, station: SimulatedStation, frequency: FloatArray
) -> FloatArray:
    """Return the variation between places at a station, standard normal."""
    north = METRES_PER_DEGREE * (station.latitude - scenario.city_latitude)
    # The shorter way round, across the date line too
    degrees = (station.longitude - scenario.city_longitude + 180.0) % 360.0 - 180.0
    east = METRES_PER_DEGREE * degrees * np.cos(np.deg2rad(scenario.city_latitude))
    field = _random(scenario, FIELD)
    return log_variation(field, (east, north), scenario.site_reach, frequency)
