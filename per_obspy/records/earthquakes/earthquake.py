"""
What is known of an earthquake, and the earthquake of which the headers of most records are.

Headers give the origin time, the hypocentre and the magnitude that an agency knew when it wrote the
record. Each station has one vote. Two agree if their times are within a minute, to which some
formats round them, their epicentres within 50 km and their magnitudes within 1. The earthquake is
that of more than half of the stations with a vote; where no half agrees, it stays unknown.
"""

import math
from collections import Counter
from collections.abc import Iterable, Mapping
from operator import itemgetter
from typing import Any, NamedTuple

from obspy import UTCDateTime
from obspy.core.event import Event, Origin
from obspy.geodetics import degrees2kilometers, locations2degrees

#: Largest differences of two descriptions of one earthquake: s, km, units of magnitude.
SAME_TIME, SAME_PLACE, SAME_SIZE = 60.0, 50.0, 1.0

#: Facts that headers describe.
HEADER_FACTS = ("time", "latitude", "longitude", "depth", "magnitude")

#: Number -> smallest and largest value that a header can mean: degrees, m, 1.
_HEADER_LIMITS = {
    "latitude": (-90.0, 90.0),
    "longitude": (-180.0, 180.0),
    "depth": (-10_000.0, 800_000.0),
    "magnitude": (-2.0, 10.0),
}

#: Number -> smallest and largest value that a list or file can mean, and its unit in messages.
_LIST_LIMITS = {
    "latitude": (-90.0, 90.0, ""),
    "longitude": (-180.0, 180.0, ""),
    "magnitude": (-5.0, 11.0, ""),
    "depth": (-10_000.0, 1_000_000.0, " m"),
}


class Earthquake(NamedTuple):
    """
    Facts of an earthquake as a list, a QuakeML file or the header of a record has them.

    Attributes
    ----------
    event_id : str
        As its service names it; ``records.fdsn.event_id`` takes it.
    time : str
        Origin time, ISO 8601, UTC; empty if unknown.
    latitude, longitude : float or None
        Of the epicentre, degrees; both or none.
    depth : float or None
        m.
    magnitude : float or None
    magnitude_type : str
    place : str
    """

    event_id: str = ""
    time: str = ""
    latitude: float | None = None
    longitude: float | None = None
    depth: float | None = None
    magnitude: float | None = None
    magnitude_type: str = ""
    place: str = ""

    @property
    def facts(self) -> dict[str, Any]:
        """Known facts by name."""
        return {name: fact for name, fact in self._asdict().items() if fact not in ("", None)}

    @property
    def known(self) -> int:
        """Number of facts."""
        return len(self.facts)

    @property
    def words(self) -> dict[str, Any]:
        """Facts in the words of ``stats.event``."""
        return {**self.facts, **({"time": UTCDateTime(self.time)} if self.time else {})}

    @property
    def fault(self) -> str:
        """
        Fault in the facts of a list or file; empty if they are plausible.

        Examples
        --------
        >>> row = Earthquake("x1", "2026-11-23T01:00:00", 14.6, -90.5)
        >>> row.fault, row._replace(latitude=float("nan")).fault
        ('', 'latitude nan: expected -90 to 90')
        """
        for name, (lowest, highest, unit) in _LIST_LIMITS.items():
            value = getattr(self, name)
            if value is not None and not lowest <= value <= highest:
                limits = f"{lowest:.7g} to {highest:.7g}"
                return f"{name} {value:g}{unit}: expected {limits}"
        return "" if self.event_id.strip() else "has no identifier"

    def __str__(self) -> str:
        place = "" if self.latitude is None else f" {self.latitude:g}, {self.longitude:g}"
        size = "" if self.magnitude is None else f" M {self.magnitude:g}"
        return f"{(self.time or 'no time')[:19]}{place}{size}"


class AgreedEvent(NamedTuple):
    """
    The earthquake of most stations.

    Attributes
    ----------
    event : Earthquake or None
        None where no more than half of the stations agree.
    stations : int
        Number of stations that agree.
    others : dict
        Station -> the other earthquake that its header describes.
    """

    event: Earthquake | None
    stations: int
    others: dict[str, Earthquake]

    @property
    def facts(self) -> dict[str, object]:
        """Facts for ``run.json``."""
        return {
            **({} if self.event is None else {**dict.fromkeys(HEADER_FACTS), **self.event.facts}),
            "stations": self.stations,
            "contradicting": {name: str(event) for name, event in self.others.items()},
        }


def origin_of(event: Event) -> Origin:
    """Return the preferred origin of an event, else its first."""
    return event.preferred_origin() or event.origins[0]


def header_event(words: Mapping[str, Any] | None) -> Earthquake | None:
    """
    Return the event of a header in the words of ``formats/text/vocabulary.py``, None if unknown.

    >>> header_event({"magnitude": 6.2, "latitude": 0.0, "longitude": 0.0}).facts
    {'magnitude': 6.2}
    """
    if not words:
        return None
    time = words.get("time")
    latitude, longitude, depth, magnitude = (
        _number(words.get(name), *limits) for name, limits in _HEADER_LIMITS.items()
    )
    # Headers write 0, 0 for an unknown place, and 0 for an unknown magnitude
    if None in (latitude, longitude) or not (latitude or longitude):
        latitude = longitude = depth = None
    text = str(time) if isinstance(time, UTCDateTime) else ""
    event = Earthquake("", text, latitude, longitude, depth, magnitude or None)
    return event if event.known else None


def _number(value: object, smallest: float, largest: float) -> float | None:
    """Return a number within a range; None for anything else."""
    if isinstance(value, bool) or not isinstance(value, int | float):
        return None
    return float(value) if math.isfinite(value) and smallest <= value <= largest else None


def agreed_event(votes: Iterable[tuple[str, Earthquake | None]]) -> AgreedEvent | None:
    """
    Return the earthquake of most stations.

    Parameters
    ----------
    votes : iterable of (str, Earthquake or None)
        Station and the event of a record's header; of several records of a station the one with
        most facts counts.

    Returns
    -------
    AgreedEvent or None
        None if no header describes an earthquake.
    """
    by_station: dict[str, Earthquake] = {}
    for station, event in sorted(votes, key=itemgetter(0)):
        if event and event.known > by_station.get(station, Earthquake()).known:
            by_station[station] = event
    if not by_station:
        return None
    # The description with which most agree; of several the one with most facts
    counts = Counter(by_station.values())
    agreeing = {
        event: sum(count for other, count in counts.items() if same_earthquake(event, other))
        for event in counts
    }
    centre = max(counts, key=lambda event: (agreeing[event], event.known, str(event)))
    others = {
        name: event for name, event in by_station.items() if not same_earthquake(centre, event)
    }
    members = [event for name, event in by_station.items() if name not in others]
    # Half of the stations are no majority
    if len(members) <= len(others):
        return AgreedEvent(None, 0, by_station)
    return AgreedEvent(_merged(members), len(members), others)


def same_earthquake(first: Earthquake, second: Earthquake) -> bool:
    """Return whether two descriptions may be of one earthquake; unknown facts do not contradict."""
    # Of times, places and magnitudes those that both have
    if first.time and second.time:
        seconds = abs(float(UTCDateTime(first.time) - UTCDateTime(second.time)))
        if seconds > SAME_TIME:
            return False
    places = (*first[2:4], *second[2:4])
    if None not in places and degrees2kilometers(locations2degrees(*places)) > SAME_PLACE:
        return False
    if first.magnitude is not None and second.magnitude is not None:
        return abs(first.magnitude - second.magnitude) <= SAME_SIZE
    return True


def _merged(members: list[Earthquake]) -> Earthquake:
    """Return the most frequent time, place with depth, and magnitude of some events."""
    times = Counter(event.time for event in members if event.time)
    sizes = Counter(event.magnitude for event in members if event.magnitude is not None)
    # A place with a depth goes before one without
    places = Counter(event[2:5] for event in members if event.latitude is not None)
    with_depth = {place: count for place, count in places.items() if place[2] is not None}
    latitude, longitude, depth = _most_frequent(with_depth or places) or (None, None, None)
    time, size = _most_frequent(times) or "", _most_frequent(sizes)
    return Earthquake("", time, latitude, longitude, depth, size)


def _most_frequent(counts: Mapping[Any, int]) -> Any:
    """Return the most frequent fact, of several the smallest; None of none."""
    return min(counts, key=lambda fact: (-counts[fact], fact), default=None)
