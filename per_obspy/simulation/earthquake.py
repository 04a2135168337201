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
from obspy import Stream, Trace, UTCDateTime
from obspy.core import event as quakeml
from obspy.core import inventory as stationxml
from obspy.core.event import Event, ResourceIdentifier
from obspy.core.inventory import Inventory
from obspy.geodetics import gps2dist_azimuth
from scipy import fft

from per_obspy.checks import FloatArray
from per_obspy.config import Scenario
from per_obspy.constants import METRES_PER_DEGREE
from per_obspy.files import written_whole
from per_obspy.names import inside
from per_obspy.records.metadata import SIMULATION_MARK, with_metadata
from per_obspy.simulation import stochastic

NETWORK = "XX"
NOTICE = f"{SIMULATION_MARK} with the stochastic method (Boore 2003): not an observation"

#: Counts per m/s2; full scale of 24 bits is then 4.3 times gravity.
GAIN = 2.0e5

#: Channel -> azimuth and dip in degrees, as SEED defines them.
CHANNELS = {"HNN": (0.0, 0.0), "HNE": (90.0, 0.0), "HNZ": (0.0, -90.0)}

#: Key of the random numbers of the variation between places, which no station's number is.
FIELD = 1_000_000

#: P waves relative to S waves: velocity and amplitude.
P_VELOCITY, P_AMPLITUDE = np.sqrt(3.0), 0.2

#: Real root of x**3 = x + 1, with which the R2 sequence spreads points.
PLASTIC = 1.3247179572447458


class Simulation(NamedTuple):
    """A simulated event with its records."""

    #: Raw counts, three components per station.
    stream: Stream
    #: Station metadata with response.
    inventory: Inventory
    #: Origin and magnitude.
    event: Event


class SimulatedStation(NamedTuple):
    """A station of the scenario."""

    code: str
    #: Degrees.
    latitude: float
    longitude: float
    #: Frequency of the lakebed under it, Hz; None on rock.
    lakebed: float | None


def simulate(scenario: Scenario) -> Simulation:
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
        # ObsPy's writer of MiniSEED ignores errors of the disk: only memory is safe
        content = BytesIO()
        stream.write(content, format="MSEED", encoding="STEIM2")
        with written_whole(inside(target, f"{NETWORK}.{code}.mseed")) as part:
            part.write_bytes(content.getvalue())
    with written_whole(target / "stations.xml") as part:
        simulation.inventory.write(part, format="STATIONXML")
    # An identifier that depends on the event alone, where ObsPy's would be random
    identifier = ResourceIdentifier(f"{simulation.event.resource_id.id}/catalog")
    with written_whole(target / "event.xml") as part:
        catalog = quakeml.Catalog([simulation.event], resource_id=identifier)
        catalog.write(part, format="QUAKEML")


def rock_acceleration(scenario: Scenario, hypocentral: float) -> FloatArray:
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


def _random(scenario: Scenario, *key: int) -> np.random.Generator:
    """Return the random numbers of a key, which no other key shares."""
    return np.random.default_rng([scenario.seed, *key])


def _station(scenario: Scenario, number: int) -> SimulatedStation:
    """
    Return a station of the city; its number alone decides its place.

    The R2 low-discrepancy sequence spreads stations evenly over the city, however many they are.
    """
    radius = scenario.city_radius * np.sqrt((0.5 + number / PLASTIC) % 1.0)
    angle = 2.0 * np.pi * ((0.5 + number / PLASTIC**2) % 1.0)
    # North and east on the mean Earth
    latitude = scenario.city_latitude + radius * np.cos(angle) / METRES_PER_DEGREE
    east = radius * np.sin(angle) / METRES_PER_DEGREE / np.cos(np.deg2rad(latitude))
    longitude = (scenario.city_longitude + east + 180.0) % 360.0 - 180.0
    from_lake, _, _ = gps2dist_azimuth(
        latitude, longitude, scenario.lakebed_latitude, scenario.lakebed_longitude
    )
    # The frequency of the lakebed scatters from station to station
    scatter = np.exp(scenario.lakebed_scatter * _random(scenario, number, 0).standard_normal())
    lakebed = scenario.lakebed_frequency * scatter if from_lake < scenario.lakebed_radius else None
    return SimulatedStation(f"S{number + 1:03d}", round(latitude, 5), round(longitude, 5), lakebed)


def _records(
    scenario: Scenario, number: int, station: SimulatedStation, inventory: Inventory
) -> list[Trace]:
    """Return the records of a station, counts; they begin before the P waves."""
    places = scenario.latitude, scenario.longitude, station.latitude, station.longitude
    distance = float(np.hypot(gps2dist_azimuth(*places)[0], scenario.depth))
    p_wave = UTCDateTime(scenario.origin_time) + distance / (P_VELOCITY * scenario.shear_velocity)
    start = p_wave - scenario.pre_event
    header = {"network": NETWORK, "station": station.code, "delta": scenario.dt, "starttime": start}
    # One trace per component
    motion = _acceleration(scenario, number, station, distance)
    return [
        with_metadata(Trace(np.rint(GAIN * samples), header | {"channel": channel}), inventory)
        for channel, samples in zip(CHANNELS, motion, strict=True)
    ]


def _acceleration(
    scenario: Scenario, number: int, station: SimulatedStation, hypocentral: float
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
        delay = round(arrival / scenario.dt)
        shape = np.concatenate([np.zeros(delay), window[: n_padded - delay]])
        noise = _noise(generator, n_padded, scenario.correlation)
        wave = stochastic.shaped_noise(noise, shape, spectra, scenario.dt)
        motion += amplitude * wave[:, :n_samples]
    return motion


def _n_samples(scenario: Scenario, station: SimulatedStation, s_wave: float, shaking: float) -> int:
    """Return the length of a record: S waves until their window ends, then the lakebed rings."""
    lasts = s_wave + 2.5 * stochastic.WINDOW_STRETCH * shaking
    if station.lakebed is not None:
        lasts += 10.0 / (2.0 * np.pi * station.lakebed * scenario.lakebed_damping)
    return int(np.ceil(lasts / scenario.dt))


def _noise(generator: np.random.Generator, n_samples: int, correlation: float) -> FloatArray:
    """Return three rows of noise of which the first two are correlated."""
    north, east, up = generator.standard_normal((3, n_samples))
    return np.stack([north, correlation * north + np.sqrt(1.0 - correlation**2) * east, up])


def _spectra(
    scenario: Scenario, station: SimulatedStation, distance: float, n_samples: int
) -> NDArray[np.complex128]:
    """Return the Fourier spectra of north, east and up, m/s, (3, n_frequencies)."""
    frequency = fft.rfftfreq(n_samples, scenario.dt)
    source = stochastic.source_spectrum(
        frequency, scenario.magnitude, scenario.shear_velocity, scenario.density
    )
    path = stochastic.path_spectrum(
        frequency, distance, scenario.shear_velocity, scenario.quality, scenario.quality_exponent
    )
    # Metres north and east of the city; the shorter way round, across the date line too
    north = METRES_PER_DEGREE * (station.latitude - scenario.city_latitude)
    degrees = (station.longitude - scenario.city_longitude + 180.0) % 360.0 - 180.0
    east = METRES_PER_DEGREE * degrees * np.cos(np.deg2rad(scenario.city_latitude))
    variation = stochastic.log_variation(
        _random(scenario, FIELD), (east, north), scenario.site_reach, frequency
    )
    # Rock, and for a station on it the lakebed
    site = stochastic.rock_response(frequency, scenario.kappa)
    rock = source * path * site * np.exp(scenario.site_log_std * variation)
    motion = rock.astype(np.complex128)
    if station.lakebed is not None:
        motion *= stochastic.kanai_tajimi(frequency, station.lakebed, scenario.lakebed_damping)
    return np.stack([motion, motion, scenario.vertical * motion])


def scenario_inventory(scenario: Scenario, stations: list[SimulatedStation]) -> Inventory:
    """Return the stations with a flat response; their ground is in ``geology`` and a comment."""
    network = stationxml.Network(
        NETWORK,
        stations=[_station_metadata(scenario, station) for station in stations],
        description=NOTICE,
        comments=[stationxml.Comment(NOTICE)],
    )
    created = UTCDateTime(scenario.origin_time)
    return Inventory([network], source=NOTICE, sender="per_obspy", created=created)


def _station_metadata(scenario: Scenario, station: SimulatedStation) -> stationxml.Station:
    """Return a station with three channels: no poles, no zeros, one gain."""
    place = {"latitude": station.latitude, "longitude": station.longitude, "elevation": 0.0}
    channels = []
    for code, (azimuth, dip) in CHANNELS.items():
        channel = stationxml.Channel(code, "", **place, depth=0.0, azimuth=azimuth, dip=dip)
        channel.sample_rate = 1.0 / scenario.dt
        channel.response = stationxml.Response.from_paz(
            [], [], GAIN, input_units="M/S**2", output_units="COUNTS"
        )
        channels.append(channel)
    # The records module reads the site class from a comment
    soil = "rock" if station.lakebed is None else "lakebed"
    return stationxml.Station(
        station.code,
        **place,
        channels=channels,
        site=stationxml.Site(f"simulated station {station.code} on {soil}"),
        geology=soil,
        comments=[stationxml.Comment(NOTICE), stationxml.Comment(f"site_class={soil}")],
    )


def scenario_event(scenario: Scenario) -> Event:
    """Return the event; its identifiers depend on the seed, where ObsPy's would be random."""
    event, origin, magnitude, comment = (
        ResourceIdentifier(f"smi:local/per_obspy/simulated/{scenario.seed}/{part}")
        for part in ("event", "origin", "magnitude", "comment")
    )
    time = UTCDateTime(scenario.origin_time)
    created = quakeml.CreationInfo(agency_id="per_obspy", author="simulated", creation_time=time)
    # The origin and the magnitude, each preferred
    name = quakeml.EventDescription(f"{scenario.name} (simulated)", "earthquake name")
    preferred_origin = quakeml.Origin(
        resource_id=origin,
        time=time,
        latitude=scenario.latitude,
        longitude=scenario.longitude,
        depth=scenario.depth,
        creation_info=created,
    )
    preferred_magnitude = quakeml.Magnitude(
        resource_id=magnitude,
        mag=scenario.magnitude,
        magnitude_type="Mw",
        origin_id=origin,
        creation_info=created,
    )
    return Event(
        resource_id=event,
        event_descriptions=[name],
        comments=[quakeml.Comment(text=NOTICE, resource_id=comment)],
        origins=[preferred_origin],
        magnitudes=[preferred_magnitude],
        preferred_origin_id=origin,
        preferred_magnitude_id=magnitude,
        creation_info=created,
    )
