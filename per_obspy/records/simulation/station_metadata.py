"""Metadata of a simulated event: stations and event, each marked as simulated."""

from typing import NamedTuple

from obspy import UTCDateTime
from obspy.core.event import (
    Comment,
    CreationInfo,
    Event,
    EventDescription,
    Magnitude,
    Origin,
    ResourceIdentifier,
)
from obspy.core.inventory import Channel, Inventory, Network, Response, Site, Station
from obspy.core.inventory import Comment as StationComment

from per_obspy import config

NETWORK = "XX"

#: Beginning of the comment by which simulated stations and events are known when they are read.
MARK = "SIMULATED by per_obspy"
NOTICE = f"{MARK} with the stochastic method (Boore 2003): not an observation"

#: Counts per m/s2; full scale of 24 bits is then 4.3 times gravity.
GAIN = 2.0e5

#: Channel -> azimuth and dip in degrees, as SEED defines them.
CHANNELS = {"HNN": (0.0, 0.0), "HNE": (90.0, 0.0), "HNZ": (0.0, -90.0)}


class SimulatedStation(NamedTuple):
    """
    A station of the scenario.

    Attributes
    ----------
    code : str
        Station code.
    latitude, longitude : float
        Degrees.
    lakebed : float or None
        Frequency of the lakebed under it, Hz; None on rock.
    """

    code: str
    latitude: float
    longitude: float
    lakebed: float | None


def scenario_inventory(scenario: config.Scenario, stations: list[SimulatedStation]) -> Inventory:
    """Return the stations with a flat response; their ground is in ``geology`` and a comment."""
    network = Network(
        NETWORK,
        stations=[_station(scenario, station) for station in stations],
        description=NOTICE,
        comments=[StationComment(NOTICE)],
    )
    return Inventory(
        [network], source=NOTICE, sender="per_obspy", created=UTCDateTime(scenario.origin_time)
    )


def _station(scenario: config.Scenario, station: SimulatedStation) -> Station:
    """Return the metadata of a station."""
    soil = "rock" if station.lakebed is None else "lakebed"
    place = {"latitude": station.latitude, "longitude": station.longitude, "elevation": 0.0}
    # The records module reads the site class from a comment
    return Station(
        station.code,
        **place,
        channels=_channels(place, 1.0 / scenario.dt),
        site=Site(f"simulated station {station.code} on {soil}"),
        geology=soil,
        comments=[StationComment(NOTICE), StationComment(f"site_class={soil}")],
    )


def _channels(place: dict[str, float], sampling_rate: float) -> list[Channel]:
    """Return three components at one place."""
    channels = []
    for code, (azimuth, dip) in CHANNELS.items():
        channel = Channel(
            code,
            "",
            **place,
            depth=0.0,
            azimuth=azimuth,
            dip=dip,
            sample_rate=sampling_rate,
            response=_response(),
        )
        channels.append(channel)
    return channels


def _response() -> Response:
    """Return a flat accelerometer: no poles, no zeros, one gain."""
    return Response.from_paz([], [], GAIN, input_units="M/S**2", output_units="COUNTS")


def scenario_event(scenario: config.Scenario) -> Event:
    """Return the event; its identifiers depend on the seed, where ObsPy's would be random."""
    base = f"smi:local/per_obspy/simulated/{scenario.seed}"
    created = CreationInfo(
        agency_id="per_obspy", author="simulated", creation_time=UTCDateTime(scenario.origin_time)
    )
    origin = Origin(
        resource_id=ResourceIdentifier(f"{base}/origin"),
        time=UTCDateTime(scenario.origin_time),
        latitude=scenario.latitude,
        longitude=scenario.longitude,
        depth=scenario.depth,
        creation_info=created,
    )
    magnitude = Magnitude(
        resource_id=ResourceIdentifier(f"{base}/magnitude"),
        mag=scenario.magnitude,
        magnitude_type="Mw",
        origin_id=origin.resource_id,
        creation_info=created,
    )
    # The origin and the magnitude, each preferred
    return Event(
        resource_id=ResourceIdentifier(f"{base}/event"),
        event_descriptions=[EventDescription(f"{scenario.name} (simulated)", "earthquake name")],
        comments=[Comment(text=NOTICE, resource_id=ResourceIdentifier(f"{base}/comment"))],
        origins=[origin],
        magnitudes=[magnitude],
        preferred_origin_id=origin.resource_id,
        preferred_magnitude_id=magnitude.resource_id,
        creation_info=created,
    )
