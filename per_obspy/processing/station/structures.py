"""Sensors in structures, which record the motion of a building or a bridge, not of the ground."""

import re
from collections.abc import Iterable

from obspy import Stream, Trace

#: Words of a sensor's place that mean a structure, in the singular, in capitals.
STRUCTURE_WORDS = (
    "ABUTMENT", "ATTIC", "BASEMENT", "BENT", "BLDG", "BSMT", "BUILDING", "CABLE", "COLUMN", "CREST",
    "DAM", "DECK", "FLOOR", "FLR", "FOOTING", "FOUNDATION", "GALLERY", "GIRDER", "PENTHOUSE",
    "PIER", "PILE", "PYLON", "ROOF", "STORY", "TOWER", "WALL",
)  # fmt: skip
STRUCTURE = re.compile(rf"\b({'|'.join(STRUCTURE_WORDS)})S?\b")
FREE_FIELD = re.compile(r"\bFREE[ -]?FIELD\b")


def in_structure(trace: Trace) -> bool:
    """
    Return whether the header puts the sensor into a structure.

    Parameters
    ----------
    trace : obspy Trace
        With ``sensor_location`` if the header has the place of the sensor (CSMIP, COSMOS). The
        station's name does not count: a free-field sensor near a bridge has the bridge's name.

    Returns
    -------
    bool
        False if the header has no place or one in the free field.

    Examples
    --------
    >>> places = ("Roof: Center", "Freefield", "Ground")
    >>> [in_structure(Trace(header={"sensor_location": place})) for place in places]
    [True, False, False]
    """
    place = str(trace.stats.get("sensor_location", "")).upper()
    return bool(STRUCTURE.search(place)) and not FREE_FIELD.search(place)


def kept_apart(stream: Iterable[Trace]) -> tuple[Stream, Stream]:
    """
    Separate the traces of a station that recorded the ground from those in a structure.

    Parameters
    ----------
    stream : iterable of obspy Trace

    Returns
    -------
    ground, structure : obspy Stream
    """
    ground, structure = Stream(), Stream()
    for trace in stream:
        if in_structure(trace):
            structure += trace
        else:
            ground += trace
    return ground, structure
