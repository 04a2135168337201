"""
Coordinates of a station from several sources: which one counts, and where they contradict.

A table of stations that a user writes counts first, then the header of the record, then StationXML.
"""

from collections.abc import Sequence
from typing import NamedTuple

from obspy import Trace
from obspy.core import AttribDict
from obspy.core.inventory import Station
from obspy.geodetics import degrees2kilometers, locations2degrees

from per_obspy.formats.text.station_table import SOURCE

#: Sources that are no table.
HEADER, STATIONXML = "header", "StationXML"

#: Places of two sources farther apart than this contradict each other, m.
CONTRADICTION = 1000.0


class Place(NamedTuple):
    """
    Place of a station by one source.

    Attributes
    ----------
    source : str
        Name of the table, ``"header"`` or ``"StationXML"``.
    coordinates : AttribDict
        ``latitude``, ``longitude``, degrees, and perhaps ``elevation``, m.
    """

    source: str
    coordinates: AttribDict


def table_of(station: Station) -> str:
    """Return the name of the table that describes a station, or an empty text."""
    names = (str(comment.value or "").partition(SOURCE) for comment in station.comments)
    return next((name for before, mark, name in names if mark and not before), "")


def place_noted(trace: Trace, places: Sequence[Place]) -> None:
    """
    Set the coordinates of a trace from the first source that has them.

    Parameters
    ----------
    trace : Trace
        Gets ``stats.coordinates`` and ``stats.coordinates_source``, and
        ``stats.coordinates_conflict`` where another source has a place more than 1 km away; none
        of them if no source knows a place. Coordinates that it has are those of its header.
    places : sequence of Place
        From tables of stations and StationXML, in the order of their preference.
    """
    stats = trace.stats
    header = stats.pop("coordinates", None)
    # A record that this package processed contains the source of its coordinates
    source = stats.pop("coordinates_source", HEADER)
    earlier = stats.pop("coordinates_conflict", "")
    known = [place for place in places if place.source != STATIONXML]
    known += [Place(source, AttribDict(header))] if header else []
    known += [place for place in places if place.source == STATIONXML]
    if not known:
        return
    first = known[0]
    stats.coordinates, stats.coordinates_source = _with_elevation(known), first.source
    conflicts = [_conflict(first, other) for other in known[1:]]
    texts = [text for text in (*conflicts, earlier) if text]
    if texts:
        stats.coordinates_conflict = "; ".join(dict.fromkeys(texts))


def _with_elevation(known: Sequence[Place]) -> AttribDict:
    """Return the first coordinates, with the elevation of another at this place if they lack it."""
    first = AttribDict(known[0].coordinates)
    for other in known[1:]:
        height = other.coordinates.get("elevation")
        if "elevation" not in first and height is not None and not _conflict(known[0], other):
            first["elevation"] = height
    return first


def _conflict(used: Place, other: Place) -> str:
    """Return the text of a contradiction, with both places; empty if there is none."""
    metres = distance(used.coordinates, other.coordinates)
    if metres <= CONTRADICTION:
        return ""
    return f"{_words(used)} used, {_words(other)} is {metres / 1000:.1f} km away"


def _words(place: Place) -> str:
    """Return source and coordinates of a place."""
    here = place.coordinates
    return f"{place.source} {here.latitude:.4f}, {here.longitude:.4f}"


def distance(first: AttribDict, second: AttribDict) -> float:
    """Return the distance along the great circle between two places, m."""
    degrees = locations2degrees(first.latitude, first.longitude, second.latitude, second.longitude)
    return 1000.0 * float(degrees2kilometers(degrees))
