"""Checks of SAC headers before ObsPy reads them."""

import struct

from per_obspy.errors import RecordRejected

#: Places of the version and of the coordinates in a binary header, bytes.
_VERSION = 304
_COORDINATES = {"STLA": 124, "STLO": 128, "EVLA": 140, "EVLO": 144}

#: Versions of the header that exist.
_VERSIONS = (6, 7)

#: Value of a field that is not given.
_UNDEFINED = -12345.0

#: Largest coordinate, degrees: longitudes of 0 to 360 are as usual as those of -180 to 180.
_LARGEST = 360.0


def require_coordinates(content: bytes, name: str) -> None:
    """
    Refuse a SAC file with a coordinate that is none, of which ObsPy computes a distance.

    ObsPy turns a longitude by 360 degrees until it is one, which for 1e30 never ends.

    Examples
    --------
    >>> require_coordinates(bytes(632), "a.sac")
    """
    # The byte order is the one in which the version exists
    for order in "<>":
        if len(content) < _VERSION + 4 or _field(content, order + "i", _VERSION) not in _VERSIONS:
            continue
        for word, place in _COORDINATES.items():
            degrees = _field(content, order + "f", place)
            if degrees != _UNDEFINED and not abs(degrees) <= _LARGEST:
                reason = f"{word} is {degrees:g} degrees, expected at most {_LARGEST:g}"
                raise RecordRejected(name, reason)


def _field(content: bytes, kind: str, place: int) -> float:
    """Return a number of the header."""
    value: float = struct.unpack_from(kind, content, place)[0]
    return value
