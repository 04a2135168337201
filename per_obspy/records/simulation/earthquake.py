"""
A simulated earthquake as a network would deliver it: counts, station metadata and the event.

Everything says that it is simulated: network ``XX``, comments in StationXML and QuakeML. The two
horizontals are correlated with the configured coefficient; the vertical is independent of them.
Samples are whole counts, as a digitiser of 24 bits gives them (the step, 5e-6 m/s2, lies below the
background noise), which MiniSEED stores without loss. Each station has random numbers of its own,
so that no other station changes a sample of it.
"""

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
from per_obspy.records.metadata import with_metadata
from per_obspy.records.simulation import stochastic
from per_obspy.records.simulation.station_metadata import (
    CHANNELS,
    GAIN,
    NETWORK,
    Place,
    scenario_event,
    scenario_inventory,
)

#: P wave: faster than S by this factor, weaker by that one.
P_VELOCITY, P_AMPLITUDE = np.sqrt(3.0), 0.2


class Simulation(NamedTuple):
    """
    A simulated event with its records.

    Attributes
    ----------
    stream : Stream
        Raw counts, three components a station.
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
        Raw counts (``GAIN`` a m/s2), inventory and event; the same bits for the same scenario.
    """
    places = [_place(scenario, number) for number in range(scenario.stations)]
    inventory = scenario_inventory(scenario, places)
    traces = [
        trace
        for number, place in enumerate(places)
        for trace in _traces(scenario, number, place, inventory)
    ]
    return Simulation(Stream(traces), inventory, scenario_event(scenario))


def write_simulation(simulation: Simulation, folder: str | Path) -> None:
    """
    Write one MiniSEED file a station, ``stations.xml`` (StationXML) and ``event.xml`` (QuakeML) into a folder.

    Parameters
    ----------
    simulation : Simulation
        From :func:`simulate`.
    folder : str or Path
        Made if it does not exist.
    """
    target = Path(folder)
    for code in sorted({trace.stats.station for trace in simulation.stream}):
        stream = simulation.stream.select(station=code).copy()
        for trace in stream:
            trace.data = trace.data.astype(np.int32)
        with written_whole(target / f"{NETWORK}.{code}.mseed") as part:
            stream.write(part, format="MSEED", encoding="STEIM2")
    with written_whole(target / "stations.xml") as part:
        simulation.inventory.write(part, format="STATIONXML")
    with written_whole(target / "event.xml") as part:
        Catalog([simulation.event], resource_id=_catalog_id(simulation.event)).write(
            part, format="QUAKEML"
        )


def _catalog_id(event: Event) -> ResourceIdentifier:
    """Return an identifier that depends on the event alone, where ObsPy's own would be random."""
    return ResourceIdentifier(f"{event.resource_id.id}/catalog")


def _random(scenario: config.Scenario, *key: int) -> np.random.Generator:
    return np.random.default_rng([scenario.seed, *key])


def _place(scenario: config.Scenario, number: int) -> Place:
    """Spread stations evenly over the city by the R2 low-discrepancy sequence, which needs no number of stations."""
    plastic = 1.3247179572447458
    radius = scenario.city_radius * np.sqrt((0.5 + number / plastic) % 1.0)
    angle = 2.0 * np.pi * ((0.5 + number / plastic**2) % 1.0)
    latitude = scenario.city_latitude + _degrees(radius * np.cos(angle))
    east = _degrees(radius * np.sin(angle)) / np.cos(np.deg2rad(latitude))
    longitude = (scenario.city_longitude + east + 180.0) % 360.0 - 180.0
    from_lake = gps2dist_azimuth(
        latitude, longitude, scenario.lakebed_latitude, scenario.lakebed_longitude
    )[0]
    scatter = np.exp(scenario.lakebed_scatter * _random(scenario, number, 0).standard_normal())
    lakebed = scenario.lakebed_frequency * scatter if from_lake < scenario.lakebed_radius else None
    return Place(f"S{number + 1:03d}", round(latitude, 5), round(longitude, 5), lakebed)


def _degrees(metres: float) -> float:
    return metres / METRES_PER_DEGREE


def _hypocentral(scenario: config.Scenario, place: Place) -> float:
    epicentral = gps2dist_azimuth(
        scenario.latitude, scenario.longitude, place.latitude, place.longitude
    )[0]
    return float(np.hypot(epicentral, scenario.depth))


def _traces(
    scenario: config.Scenario, number: int, place: Place, inventory: Inventory
) -> list[Trace]:
    distance = _hypocentral(scenario, place)
    p_wave = UTCDateTime(scenario.origin_time) + distance / (P_VELOCITY * scenario.shear_velocity)
    header = {
        "network": NETWORK,
        "station": place.code,
        "delta": scenario.dt,
        "starttime": p_wave - scenario.pre_event,
    }
    return [
        with_metadata(Trace(np.rint(GAIN * samples), header | {"channel": channel}), inventory)
        for channel, samples in zip(
            CHANNELS, _acceleration(scenario, number, place, distance), strict=True
        )
    ]


def _acceleration(
    scenario: config.Scenario, number: int, place: Place, hypocentral: float
) -> FloatArray:
    """Return north, east and up in m/s2, (3, n_samples): background, P waves, S waves."""
    distance = stochastic.effective_distance(hypocentral, scenario.magnitude)
    shaking = stochastic.duration(
        scenario.magnitude, distance, scenario.stress_drop, scenario.shear_velocity
    )
    s_wave = scenario.pre_event + hypocentral / scenario.shear_velocity * (1.0 - 1.0 / P_VELOCITY)
    ringing = (
        0.0
        if place.lakebed is None
        else 10.0 / (2.0 * np.pi * place.lakebed * scenario.lakebed_damping)
    )
    n_samples = int(
        np.ceil((s_wave + 2.5 * stochastic.WINDOW_STRETCH * shaking + ringing) / scenario.dt)
    )
    # as much again in zeros, so that what a filter leaves behind does not come round to the front
    n_padded = fft.next_fast_len(2 * n_samples, real=True)
    spectra = _spectra(scenario, place, distance, n_padded)
    generator = _random(scenario, number, 1)
    motion = scenario.noise * generator.standard_normal((3, n_samples))
    for arrival, amplitude in ((scenario.pre_event, P_AMPLITUDE), (s_wave, 1.0)):
        shape = _delayed(
            stochastic.window(n_padded, scenario.dt, shaking), round(arrival / scenario.dt)
        )
        noise = _correlated(generator.standard_normal((3, n_padded)), scenario.correlation)
        motion += (
            amplitude * stochastic.shaped_noise(noise, shape, spectra, scenario.dt)[:, :n_samples]
        )
    return motion


def _delayed(shape: FloatArray, samples: int) -> FloatArray:
    return np.concatenate([np.zeros(samples), shape[: shape.size - samples]])


def _correlated(noise: FloatArray, correlation: float) -> FloatArray:
    """Return three rows of noise of which the first two are correlated."""
    north, east, up = noise
    return np.stack([north, correlation * north + np.sqrt(1.0 - correlation**2) * east, up])


def _spectra(
    scenario: config.Scenario, place: Place, distance: float, n_samples: int
) -> NDArray[np.complex128]:
    """Return the Fourier spectra of north, east and up, m/s, (3, n_frequencies)."""
    frequency = fft.rfftfreq(n_samples, scenario.dt)
    source = stochastic.source_spectrum(
        frequency,
        scenario.magnitude,
        scenario.stress_drop,
        scenario.shear_velocity,
        scenario.density,
    )
    path = stochastic.path_spectrum(
        frequency, distance, scenario.shear_velocity, scenario.quality, scenario.quality_exponent
    )
    rock = source * path * stochastic.rock_response(frequency, scenario.kappa)
    horizontal = rock.astype(np.complex128)
    if place.lakebed is not None:
        horizontal *= stochastic.kanai_tajimi(frequency, place.lakebed, scenario.lakebed_damping)
    return np.stack([horizontal, horizontal, scenario.vertical * rock])
