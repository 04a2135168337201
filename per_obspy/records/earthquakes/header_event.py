"""
Read the earthquake from the headers of its records: the values of most stations.

Headers give the origin time, the hypocentre and the magnitude that an agency knew when it wrote the
record. Each station has one vote. Two agree if their times are within a minute, to which some
formats round them, their epicentres within 50 km and their magnitudes within 1. The earthquake is
that of more than half of the stations with a vote; where no half agrees, it stays unknown.
"""

import math
from collections import Counter
from collections.abc import Iterable, Mapping
from typing import Any, NamedTuple

from obspy import UTCDateTime
from obspy.geodetics import degrees2kilometers, locations2degrees

#: Largest differences of two descriptions of one earthquake: s, km, units of magnitude.
SAME_TIME, SAME_PLACE, SAME_SIZE = 60.0, 50.0, 1.0

#: number of an event -> smallest and largest value that a header can mean: degrees, m, 1
_RANGES = {
    "latitude": (-90.0, 90.0),
    "longitude": (-180.0, 180.0),
    "depth": (-10_000.0, 800_000.0),
    "magnitude": (-2.0, 10.0),
}


class HeaderEvent(NamedTuple):
    """
    An earthquake as a header describes it; unknown values are None.

    Attributes
    ----------
    time : str or None
        Of the origin, ISO 8601, UTC.
    latitude, longitude : float or None
        Degrees, both or none.
    depth : float or None
        m.
    magnitude : float or None
    """

    time: str | None = None
    latitude: float | None = None
    longitude: float | None = None
    depth: float | None = None
    magnitude: float | None = None

    @property
    def known(self) -> int:
        """Number of facts."""
        return sum(fact is not None for fact in self)

    @property
    def words(self) -> dict[str, Any]:
        """Facts in the words of ``stats.event``."""
        facts = {name: fact for name, fact in self._asdict().items() if fact is not None}
        return {**facts, **({"time": UTCDateTime(self.time)} if self.time else {})}

    def __str__(self) -> str:
        place = "" if self.latitude is None else f" {self.latitude:g}, {self.longitude:g}"
        size = "" if self.magnitude is None else f" M {self.magnitude:g}"
        return f"{(self.time or 'no time')[:19]}{place}{size}"


class AgreedEvent(NamedTuple):
    """
    The earthquake of most stations.

    Attributes
    ----------
    event : HeaderEvent or None
        None where no more than half of the stations agree.
    stations : int
        Number of stations that agree.
    others : dict
        Station -> the other earthquake that its header describes.
    """

    event: HeaderEvent | None
    stations: int
    others: dict[str, HeaderEvent]

    @property
    def facts(self) -> dict[str, object]:
        """Facts for ``run.json``."""
        return {
            **({} if self.event is None else self.event._asdict()),
            "stations": self.stations,
            "contradicting": {name: str(event) for name, event in self.others.items()},
        }


def header_event(words: Mapping[str, Any] | None) -> HeaderEvent | None:
    """
    Return the event of a header in the words of ``formats/text/vocabulary.py``, None if unknown.

    >>> header_event({"magnitude": 6.2, "latitude": 0.0, "longitude": 0.0})
    HeaderEvent(time=None, latitude=None, longitude=None, depth=None, magnitude=6.2)
    """
    if not words:
        return None
    time = words.get("time")
    numbers = {name: _number(words.get(name), *limits) for name, limits in _RANGES.items()}
    # Headers write 0, 0 for an unknown place, and 0 for an unknown magnitude
    place = (numbers["latitude"], numbers["longitude"])
    if None in place or not any(place):
        numbers |= {"latitude": None, "longitude": None, "depth": None}
    event = HeaderEvent(str(time) if isinstance(time, UTCDateTime) else None, **numbers)
    event = event._replace(magnitude=event.magnitude or None)
    return event if event.known else None


def _number(value: object, smallest: float, largest: float) -> float | None:
    """Return a number within a range; None for anything else."""
    if isinstance(value, bool) or not isinstance(value, int | float):
        return None
    return float(value) if math.isfinite(value) and smallest <= value <= largest else None


def agreed_event(votes: Iterable[tuple[str, HeaderEvent | None]]) -> AgreedEvent | None:
    """
    Return the earthquake of most stations.

    Parameters
    ----------
    votes : iterable of (str, HeaderEvent or None)
        Station and the event of a record's header; of several records of a station the one with
        most facts counts.

    Returns
    -------
    AgreedEvent or None
        None if no header describes an earthquake.
    """
    by_station = _one_each(votes)
    if not by_station:
        return None
    centre = _centre(Counter(by_station.values()))
    members = [event for event in by_station.values() if same_earthquake(centre, event)]
    # Half of the stations are no majority
    if 2 * len(members) <= len(by_station):
        return AgreedEvent(None, 0, by_station)
    others = {
        name: event for name, event in by_station.items() if not same_earthquake(centre, event)
    }
    return AgreedEvent(_merged(members), len(members), others)


def _one_each(votes: Iterable[tuple[str, HeaderEvent | None]]) -> dict[str, HeaderEvent]:
    """Return the event with most facts of every station that has one, by name."""
    by_station: dict[str, HeaderEvent] = {}
    for station, event in sorted(votes, key=lambda vote: vote[0]):
        best = by_station.get(station)
        if event is not None and (best is None or event.known > best.known):
            by_station[station] = event
    return by_station


def _centre(counts: Mapping[HeaderEvent, int]) -> HeaderEvent:
    """Return the description with which most agree; of several the one with most facts."""
    agreeing = {
        event: sum(count for other, count in counts.items() if same_earthquake(event, other))
        for event in counts
    }
    return max(agreeing, key=lambda event: (agreeing[event], event.known, str(event)))


def same_earthquake(first: HeaderEvent, second: HeaderEvent) -> bool:
    """Return whether two descriptions may be of one earthquake; unknown facts do not contradict."""
    if _seconds(first, second) > SAME_TIME or _kilometres(first, second) > SAME_PLACE:
        return False
    if first.magnitude is not None and second.magnitude is not None:
        return abs(first.magnitude - second.magnitude) <= SAME_SIZE
    return True


def _seconds(first: HeaderEvent, second: HeaderEvent) -> float:
    """Return the difference between two origin times, s; 0 where one is unknown."""
    if not (first.time and second.time):
        return 0.0
    return abs(float(UTCDateTime(first.time) - UTCDateTime(second.time)))


def _kilometres(first: HeaderEvent, second: HeaderEvent) -> float:
    """Return the distance between two epicentres, km; 0 where one is unknown."""
    places = (first.latitude, first.longitude, second.latitude, second.longitude)
    return 0.0 if None in places else float(degrees2kilometers(locations2degrees(*places)))


def _merged(members: list[HeaderEvent]) -> HeaderEvent:
    """Return the most frequent time, place with depth, and magnitude of some events."""
    times = Counter(event.time for event in members if event.time)
    sizes = Counter(event.magnitude for event in members if event.magnitude is not None)
    # A place with a depth goes before one without
    places = Counter(event[1:4] for event in members if event.latitude is not None)
    with_depth = {place: count for place, count in places.items() if place[2] is not None}
    latitude, longitude, depth = _most_frequent(with_depth or places) or (None, None, None)
    size = _most_frequent(sizes)
    return HeaderEvent(_most_frequent(times), latitude, longitude, depth, size)


def _most_frequent(counts: Mapping[Any, int]) -> Any:
    """Return the most frequent fact, of several the smallest; None of none."""
    return min(counts, key=lambda fact: (-counts[fact], fact), default=None)
