"""
A simulated earthquake as a network would deliver it: counts, station metadata and the event.

All files are marked as simulated: network ``XX``, comments in StationXML and QuakeML. The two
horizontals are correlated with the configured coefficient; the vertical is independent of them.
Samples are whole counts, as a digitiser of 24 bits gives them (the step, 5e-6 m/s2, lies below the
background noise), which MiniSEED stores without loss. Each station has separate random numbers,
so that no other station changes a sample of it.

Ground acceleration is shaped noise with the spectrum of an omega-squared point source (Boore 2003,
Pure Appl. Geophys. 160, 635-676). The logarithm of the Fourier spectrum at a place is that of the
source, path and site model plus a Gaussian random field. Its correlation decays exponentially with
the distance between places and with the logarithm of the ratio of two frequencies. The field is a
sum of waves whose numbers have the spectral density of that correlation, so that its value at a
place depends on no other place. Numbers are SI.
"""

import math
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

NETWORK = "XX"
NOTICE = f"{SIMULATION_MARK} with the stochastic method (Boore 2003): not an observation"

#: Counts per m/s2; full scale of 24 bits is then 4.3 times gravity.
GAIN = 2.0e5

#: Channel -> azimuth and dip in degrees, as SEED defines them.
CHANNELS = {"HNN": (0.0, 0.0), "HNE": (90.0, 0.0), "HNZ": (0.0, -90.0)}

#: Key of the random numbers of the variation between places, which no station's number is.
FIELD = 1_000_000

#: Density, kg/m3, and velocity of S waves, m/s, at the source (Boore 2003).
DENSITY, SHEAR_VELOCITY = 2800.0, 3500.0

#: Correlation of the north and east components, and spectrum of the vertical relative to theirs: a
#: choice of this package, weak as records show, and the usual two thirds.
CORRELATION, VERTICAL = 0.3, 2.0 / 3.0

#: Background before the P wave, s.
PRE_EVENT = 20.0

#: Log-standard deviation of the frequency of the lakebed between stations.
LAKEBED_SCATTER = 0.1

#: Distance at which the correlation of spectra between places has fallen to 0.05, m (SA at 1 s:
#: Jayaram & Baker 2009).
SITE_REACH = 25_000.0

#: P waves relative to S waves: velocity and amplitude.
P_VELOCITY, P_AMPLITUDE = np.sqrt(3.0), 0.2

#: Real root of x**3 = x + 1, with which the R2 sequence spreads points.
PLASTIC = 1.3247179572447458


#: Mean radiation pattern of S waves, free surface, partition onto two horizontals (Boore 2003,
#: after eq. 6).
RADIATION, FREE_SURFACE, PARTITION = 0.55, 2.0, 1.0 / np.sqrt(2.0)

#: Distance at which spreading turns from 1/R (body waves) to 1/sqrt(R) (guided waves), m
#: (Raoof and others 1999).
CROSSOVER = 40_000.0

#: Path duration per distance, s/m (Boore 2003, western North America: 0.05 s/km).
PATH_DURATION = 5e-5

#: Frequency in Hz and amplification of generic rock (Boore & Joyner 1997, table 3).
ROCK_FREQUENCY = (0.01, 0.09, 0.16, 0.51, 0.84, 1.25, 2.26, 3.17, 6.05, 16.6, 61.2)
ROCK_AMPLIFICATION = (1.00, 1.10, 1.18, 1.42, 1.58, 1.74, 2.06, 2.25, 2.58, 3.13, 4.00)

#: Decay length of the correlation in ln frequency. Response spectra at 1 and 2 s then have a
#: correlation near 0.75, at 0.2 and 2 s near 0.4, as residuals of recorded ones have (Baker &
#: Jayaram 2008, Earthquake Spectra 24, 299-317).
FREQUENCY_LENGTH = 1.2

#: Waves of the random field: its marginal distribution is then normal within 0.2 % of the kurtosis.
WAVES = 1000

#: Lowest and highest frequency of the field, Hz, beyond which it is constant; frequencies per
#: e-fold at which the sum is evaluated, between which it is interpolated.
FREQUENCIES, PER_FOLD = (0.01, 100.0), 8

#: Saragoni-Hart window: place of its peak and height of its end, as fractions of its length and
#: peak, and its length as a multiple of the duration (Boore 2003, eq. 24-26).
WINDOW_PEAK, WINDOW_END, WINDOW_STRETCH = 0.2, 0.05, 2.0


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
    scatter = np.exp(LAKEBED_SCATTER * _random(scenario, number, 0).standard_normal())
    lakebed = scenario.lakebed_frequency * scatter if from_lake < scenario.lakebed_radius else None
    return SimulatedStation(f"S{number + 1:03d}", round(latitude, 5), round(longitude, 5), lakebed)


def _records(
    scenario: Scenario, number: int, station: SimulatedStation, inventory: Inventory
) -> list[Trace]:
    """Return the records of a station, counts; they begin before the P waves."""
    places = scenario.latitude, scenario.longitude, station.latitude, station.longitude
    distance = float(np.hypot(gps2dist_azimuth(*places)[0], scenario.depth))
    p_wave = UTCDateTime(scenario.origin_time) + distance / (P_VELOCITY * SHEAR_VELOCITY)
    start = p_wave - PRE_EVENT
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
    distance = effective_distance(hypocentral, scenario.magnitude)
    shaking = duration(scenario.magnitude, distance)
    s_wave = PRE_EVENT + hypocentral / SHEAR_VELOCITY * (1.0 - 1.0 / P_VELOCITY)
    n_samples = _n_samples(scenario, station, s_wave, shaking)
    # As many zeros again, so that the end of a filtered motion does not wrap round to its front
    n_padded = fft.next_fast_len(2 * n_samples, real=True)
    spectra = _spectra(scenario, station, distance, n_padded)
    window = saragoni_hart_window(n_padded, scenario.dt, shaking)
    # Background noise, then the two waves, each from separate noise
    generator = _random(scenario, number, 1)
    motion = scenario.noise * generator.standard_normal((3, n_samples))
    for arrival, amplitude in ((PRE_EVENT, P_AMPLITUDE), (s_wave, 1.0)):
        delay = round(arrival / scenario.dt)
        shape = np.concatenate([np.zeros(delay), window[: n_padded - delay]])
        noise = _noise(generator, n_padded)
        wave = shaped_noise(noise, shape, spectra, scenario.dt)
        motion += amplitude * wave[:, :n_samples]
    return motion


def _n_samples(scenario: Scenario, station: SimulatedStation, s_wave: float, shaking: float) -> int:
    """Return the length of a record: S waves until their window ends, then the lakebed rings."""
    lasts = s_wave + 2.5 * WINDOW_STRETCH * shaking
    if station.lakebed is not None:
        lasts += 10.0 / (2.0 * np.pi * station.lakebed * scenario.lakebed_damping)
    return int(np.ceil(lasts / scenario.dt))


def _noise(generator: np.random.Generator, n_samples: int) -> FloatArray:
    """Return three rows of noise of which the first two are correlated."""
    north, east, up = generator.standard_normal((3, n_samples))
    return np.stack([north, CORRELATION * north + np.sqrt(1.0 - CORRELATION**2) * east, up])


def _spectra(
    scenario: Scenario, station: SimulatedStation, distance: float, n_samples: int
) -> NDArray[np.complex128]:
    """Return the Fourier spectra of north, east and up, m/s, (3, n_frequencies)."""
    frequency = fft.rfftfreq(n_samples, scenario.dt)
    source = source_spectrum(frequency, scenario.magnitude, SHEAR_VELOCITY, DENSITY)
    path = path_spectrum(
        frequency, distance, SHEAR_VELOCITY, scenario.quality, scenario.quality_exponent
    )
    # Metres north and east of the city; the shorter way round, across the date line too
    north = METRES_PER_DEGREE * (station.latitude - scenario.city_latitude)
    degrees = (station.longitude - scenario.city_longitude + 180.0) % 360.0 - 180.0
    east = METRES_PER_DEGREE * degrees * np.cos(np.deg2rad(scenario.city_latitude))
    variation = log_variation(_random(scenario, FIELD), (east, north), SITE_REACH, frequency)
    # Rock, and for a station on it the lakebed
    site = rock_response(frequency, scenario.kappa)
    rock = source * path * site * np.exp(scenario.site_log_std * variation)
    motion = rock.astype(np.complex128)
    if station.lakebed is not None:
        motion *= kanai_tajimi(frequency, station.lakebed, scenario.lakebed_damping)
    return np.stack([motion, motion, VERTICAL * motion])


def scenario_inventory(scenario: Scenario, stations: list[SimulatedStation]) -> Inventory:
    """Return the stations with a flat response; their ground is in ``geology`` and a comment."""
    units = {"input_units": "M/S**2", "output_units": "COUNTS"}
    # No poles, no zeros and one gain; ``from_paz`` would load half a second of libraries
    response = stationxml.Response(
        instrument_sensitivity=stationxml.InstrumentSensitivity(GAIN, 1.0, **units),
        response_stages=[
            stationxml.PolesZerosResponseStage(
                1, GAIN, 1.0, **units, pz_transfer_function_type="LAPLACE (RADIANS/SECOND)",
                normalization_frequency=1.0, zeros=[], poles=[],
            )
        ],
    )  # fmt: skip
    network = stationxml.Network(
        NETWORK,
        stations=[_station_metadata(scenario, station, response) for station in stations],
        description=NOTICE,
        comments=[stationxml.Comment(NOTICE)],
    )
    created = UTCDateTime(scenario.origin_time)
    return Inventory([network], source=NOTICE, sender="per_obspy", created=created)


def _station_metadata(
    scenario: Scenario, station: SimulatedStation, response: stationxml.Response
) -> stationxml.Station:
    """Return a station with three channels of the same response."""
    place = {"latitude": station.latitude, "longitude": station.longitude, "elevation": 0.0}
    channels = []
    for code, (azimuth, dip) in CHANNELS.items():
        channel = stationxml.Channel(code, "", **place, depth=0.0, azimuth=azimuth, dip=dip)
        channel.sample_rate = 1.0 / scenario.dt
        channel.response = response
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


def seismic_moment(magnitude: float) -> float:
    """Compute the seismic moment in N m (Hanks & Kanamori 1979)."""
    return float(10.0 ** (1.5 * magnitude + 9.05))


class Source(NamedTuple):
    """Shape of a source spectrum with two corners."""

    low_corner: float  # Hz
    high_corner: float  # Hz
    high_share: float  # of the moment, with the high corner, dimensionless


def source_of(magnitude: float) -> Source:
    """Compute the two corners of a source (Atkinson & Silva 2000, eq. 3 to 6; California)."""
    return Source(
        low_corner=10.0 ** (2.181 - 0.496 * magnitude),
        high_corner=10.0 ** (2.410 - 0.408 * magnitude),
        high_share=10.0 ** (0.605 - 0.255 * magnitude),
    )


def effective_distance(hypocentral: float, magnitude: float) -> float:
    """
    Compute the distance in m with near-source saturation of an extended fault.

    Reference: Atkinson & Silva (2000), with which the source was fitted.
    """
    return float(np.hypot(hypocentral, 1000.0 * 10.0 ** (-0.05 + 0.15 * magnitude)))


def source_spectrum(
    frequency: FloatArray, magnitude: float, shear_velocity: float, density: float
) -> FloatArray:
    """
    Compute the acceleration spectrum of the source times distance, m2/s.

    Reference: Boore (2003), eq. 3, 5 and 6; shape of Atkinson & Silva (2000).
    """
    constant = RADIATION * FREE_SURFACE * PARTITION / (4.0 * np.pi * density * shear_velocity**3)
    # each part of the moment has a separate corner
    source = source_of(magnitude)
    low = (1.0 - source.high_share) / (1.0 + (frequency / source.low_corner) ** 2)
    high = source.high_share / (1.0 + (frequency / source.high_corner) ** 2)
    displacement = constant * seismic_moment(magnitude) * (low + high)
    return np.asarray((2.0 * np.pi * frequency) ** 2 * displacement)


def path_spectrum(
    frequency: FloatArray,
    distance: float,
    shear_velocity: float,
    quality: float,
    quality_exponent: float,
) -> FloatArray:
    """
    Compute spreading and anelastic attenuation ``exp(-pi f R / (Q beta))``, 1/m.

    Reference: Boore (2003), eq. 8.
    """
    factor = np.maximum(frequency, 1e-6) ** (1.0 - quality_exponent)
    spreading = 1.0 / distance if distance < CROSSOVER else 1.0 / np.sqrt(distance * CROSSOVER)
    return np.asarray(spreading * np.exp(-np.pi * factor * distance / (quality * shear_velocity)))


def rock_response(frequency: FloatArray, kappa: float) -> FloatArray:
    """Compute the amplification of generic rock and its diminution ``exp(-pi kappa f)``."""
    amplification = np.interp(
        np.log(np.maximum(frequency, 1e-6)), np.log(ROCK_FREQUENCY), ROCK_AMPLIFICATION
    )
    return np.asarray(amplification * np.exp(-np.pi * kappa * frequency))


def kanai_tajimi(frequency: FloatArray, natural: float, damping: float) -> NDArray[np.complex128]:
    """
    Compute the complex, causal transfer function of a soft layer.

    It is that of the absolute acceleration of a damped oscillator.
    """
    ratio = frequency / natural
    return np.asarray((1.0 + 2j * damping * ratio) / (1.0 - ratio**2 + 2j * damping * ratio))


def duration(magnitude: float, distance: float) -> float:
    """
    Compute the duration of shaking in s: half over the low corner, and that of the path.

    Reference: Atkinson & Silva (2000).
    """
    return 0.5 / source_of(magnitude).low_corner + PATH_DURATION * distance


def saragoni_hart_window(n_samples: int, dt: float, shaking: float) -> FloatArray:
    """Compute the Saragoni-Hart window of a duration in s; its maximum is 1."""
    power = -WINDOW_PEAK * np.log(WINDOW_END) / (1.0 + WINDOW_PEAK * (np.log(WINDOW_PEAK) - 1.0))
    time = np.arange(n_samples) * dt / (WINDOW_STRETCH * shaking)
    return np.asarray((math.e / WINDOW_PEAK * time) ** power * np.exp(-power / WINDOW_PEAK * time))


def shaped_noise(
    noise: FloatArray, shape: FloatArray, spectrum: NDArray[np.complex128], dt: float
) -> FloatArray:
    """
    Compute acceleration in m/s2 with the shape of a window and, on average, a spectrum.

    Noise is (n_components, n_samples), Gaussian, with the phase of the result; the spectrum, m/s,
    (n_components, n_samples // 2 + 1), that at the frequencies of ``rfft`` for a step dt in s.
    """
    transform = fft.rfft(noise * shape)
    transform /= np.sqrt(np.mean(np.abs(transform) ** 2, axis=-1, keepdims=True))
    return np.asarray(fft.irfft(transform * spectrum, n=noise.shape[-1]) / dt)


def log_variation(
    generator: np.random.Generator, place: tuple[float, float], reach: float, frequency: FloatArray
) -> FloatArray:
    """
    Compute the standard normal random field at a place (east and north of a fixed point, m).

    The generator is in the same state for every place of an earthquake. At the distance ``reach``,
    m, the correlation has fallen to 0.05 (``exp(-3 h / reach)``, as Jayaram & Baker 2009 define
    it). The result, (n,), is dimensionless, one number for each frequency, Hz.
    """
    share, direction, slope, phase = generator.random((4, WAVES))
    at_place = _numbers_in_the_plane(share, direction, reach) @ np.array(place)
    # Wave numbers in ln frequency: a Cauchy distribution
    along = np.tan(np.pi * (slope - 0.5)) / FREQUENCY_LENGTH
    lowest, highest = np.log(FREQUENCIES)
    nodes = np.linspace(lowest, highest, round(PER_FOLD * (highest - lowest)) + 1)
    waves = np.cos(at_place[:, None] + along[:, None] * nodes + 2.0 * np.pi * phase[:, None])
    # The sum at the nodes, then between them
    field = np.sqrt(2.0 / WAVES) * waves.sum(axis=0)
    return np.asarray(np.interp(np.log(np.clip(frequency, *FREQUENCIES)), nodes, field))


def _numbers_in_the_plane(share: FloatArray, direction: FloatArray, reach: float) -> FloatArray:
    """Return wave numbers to east and north, 1/m, (n, 2): those of ``exp(-3 h / reach)``."""
    radial = np.sqrt((1.0 - share) ** -2 - 1.0) * 3.0 / reach
    angle = 2.0 * np.pi * direction
    return np.stack([radial * np.cos(angle), radial * np.sin(angle)], axis=1)
