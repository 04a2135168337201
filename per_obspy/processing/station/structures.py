"""Sensors in structures: they record what a building or a bridge did, not the ground beside it."""

import re

from obspy import Stream, Trace

#: words of a sensor's place that mean a structure, in the singular, in capitals
STRUCTURE_WORDS = (
    "ABUTMENT", "ATTIC", "BASEMENT", "BENT", "BLDG", "BSMT", "BUILDING", "CABLE", "COLUMN", "CREST", "DAM", "DECK",
    "FLOOR", "FLR", "FOOTING", "FOUNDATION", "GALLERY", "GIRDER", "PENTHOUSE", "PIER", "PILE", "PYLON", "ROOF",
    "STORY", "TOWER", "WALL",
)  # fmt: skip
STRUCTURE = re.compile(rf"\b({'|'.join(STRUCTURE_WORDS)})S?\b")
FREE_FIELD = re.compile(r"\bFREE[ -]?FIELD\b")


def in_structure(trace: Trace) -> bool:
    """
    Tell whether the header puts the sensor into a structure.

    Parameters
    ----------
    trace : obspy Trace
        With ``sensor_location`` where the header says where the sensor is (CSMIP, COSMOS). The
        station's name does not count: a free-field sensor beside a bridge bears the bridge's name.

    Returns
    -------
    bool
        False where the header says free field or nothing.

    Examples
    --------
    >>> [in_structure(Trace(header={"sensor_location": place})) for place in ("Roof: Center", "Freefield", "Ground")]
    [True, False, False]
    """
    place = str(trace.stats.get("sensor_location", "")).upper()
    return bool(STRUCTURE.search(place)) and not FREE_FIELD.search(place)


def kept_apart(stream: Stream) -> tuple[Stream, Stream]:
    """
    Return the traces of a station that recorded the ground, and those that recorded a structure.

    Parameters
    ----------
    stream : obspy Stream

    Returns
    -------
    ground, structure : obspy Stream
    """
    inside = [in_structure(trace) for trace in stream]
    ground = Stream([trace for trace, built in zip(stream, inside, strict=True) if not built])
    return ground, Stream([trace for trace, built in zip(stream, inside, strict=True) if built])
