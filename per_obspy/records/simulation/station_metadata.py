"""Metadata of a simulated event: stations and event, each saying that it is simulated."""

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
NOTICE = "SIMULATED by per_obspy with the stochastic method (Boore 2003): not an observation"

#: Counts per m/s2; full scale of 24 bits is then 4.3 times gravity.
GAIN = 2.0e5

#: Channel -> azimuth and dip in degrees, as SEED defines them.
CHANNELS = {"HNN": (0.0, 0.0), "HNE": (90.0, 0.0), "HNZ": (0.0, -90.0)}


class Place(NamedTuple):
    """A station of the scenario: code, degrees north and east, Hz of its lakebed filter (None on rock)."""

    code: str
    latitude: float
    longitude: float
    lakebed: float | None


def scenario_inventory(scenario: config.Scenario, places: list[Place]) -> Inventory:
    """Return the stations with a flat response and, in ``geology`` and a comment, what they stand on."""
    network = Network(
        NETWORK,
        stations=[_station(scenario, place) for place in places],
        description=NOTICE,
        comments=[StationComment(NOTICE)],
    )
    return Inventory(
        [network], source=NOTICE, sender="per_obspy", created=UTCDateTime(scenario.origin_time)
    )


def _station(scenario: config.Scenario, place: Place) -> Station:
    soil = "rock" if place.lakebed is None else "lakebed"
    where = {"latitude": place.latitude, "longitude": place.longitude, "elevation": 0.0}
    channels = [
        Channel(
            code,
            "",
            **where,
            depth=0.0,
            azimuth=azimuth,
            dip=dip,
            sample_rate=1.0 / scenario.dt,
            response=_response(),
        )
        for code, (azimuth, dip) in CHANNELS.items()
    ]
    site = Site(f"simulated station {place.code} on {soil}")
    comments = [StationComment(NOTICE), StationComment(f"site_class={soil}")]
    return Station(
        place.code, **where, channels=channels, site=site, geology=soil, comments=comments
    )


def _response() -> Response:
    """Return a flat accelerometer: no poles, no zeros, one gain."""
    return Response.from_paz([], [], GAIN, input_units="M/S**2", output_units="COUNTS")


def scenario_event(scenario: config.Scenario) -> Event:
    """Return the event; its identifiers depend on the seed alone, where ObsPy's own would be random."""
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
