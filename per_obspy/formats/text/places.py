"""Places of stations and epicentres in headers: degrees without a sign and their letters."""

from collections.abc import Mapping
from re import Match
from typing import Any, NamedTuple

from per_obspy.formats.text.vocabulary import coordinates

#: largest distance of a station from the epicentre at which the epicentre decides a sign, degrees
_REACH = 10.0

#: letters of an angle -> name, positive and negative letter
_AXES = (("latitude", "N", "S"), ("longitude", "E", "W"))


class Angle(NamedTuple):
    """
    An angle of a header.

    Attributes
    ----------
    degrees : float
        Usually without a sign.
    letter : str
        Hemisphere: N, S, E or W where the header is right; anything where it is damaged.
    """

    degrees: float
    letter: str


def decimal_angles(found: Match[str], first: int = 1) -> tuple[Angle, Angle]:
    """
    Return latitude and longitude of a match.

    Parameters
    ----------
    found : Match
        Has four groups in turn: degrees and letter of latitude, then of longitude.
    first : int
        Number of the first of these groups.

    >>> import re
    >>> decimal_angles(re.match(r"(.*) (S) (.*) (E)", "42.5 S 172.8 E"))[0]
    Angle(degrees=42.5, letter='S')
    """
    latitude = Angle(float(found[first]), found[first + 1])
    longitude = Angle(float(found[first + 2]), found[first + 3])
    return latitude, longitude


def epicentre_place(latitude: Angle, longitude: Angle) -> dict[str, Any]:
    """
    Return the coordinates of an epicentre, degrees; empty where they are unknown.

    >>> epicentre_place(Angle(34.0, "N"), Angle(118.0, "N"))
    {}
    """
    signed = [_signed(axis, angle) for axis, angle in _paired(latitude, longitude)]
    place = coordinates(*signed)
    return {} if "problem" in place else place


def station_place(
    latitude: Angle,
    longitude: Angle,
    epicentre: Mapping[str, Any],
    elevation: float | None = None,
) -> dict[str, Any]:
    """
    Return the coordinates of a station.

    A letter that does not belong to its angle is replaced by that of the hemisphere in which the
    station is near the epicentre; where this does not decide, the place is unknown. Either is
    written into ``problem``, which :func:`~per_obspy.formats.text.vocabulary.trace` turns into a
    note of the record. Letters that are merely exchanged mean that the longitude comes first.

    Parameters
    ----------
    latitude, longitude : Angle
        As the header has them.
    epicentre : mapping
        ``latitude`` and ``longitude``, degrees, as far as they are known.
    elevation : float, optional
        m.

    >>> station_place(Angle(34.1, "N"), Angle(118.4, "N"), {"longitude": -118.5})["longitude"]
    -118.4
    """
    signed: list[float | None] = []
    problems = []
    for axis, angle in _paired(latitude, longitude):
        degrees = _signed(axis, angle)
        if degrees is None:
            degrees = _near(angle.degrees, epicentre.get(axis[0]))
            problems.append(_problem(axis, angle, degrees))
        signed.append(degrees)
    # A place out of range is a separate problem
    place = coordinates(signed[0], signed[1], elevation)
    return place | {"problem": "; ".join(problems)} if problems else place


def _paired(latitude: Angle, longitude: Angle) -> list[tuple[tuple[str, str, str], Angle]]:
    """Return every axis with its angle; the letters decide where both are exchanged."""
    if latitude.letter in ("E", "W") and longitude.letter in ("N", "S"):
        latitude, longitude = longitude, latitude
    return list(zip(_AXES, (latitude, longitude), strict=True))


def _signed(axis: tuple[str, str, str], angle: Angle) -> float | None:
    """Return signed degrees; None where the letter does not belong to the axis."""
    _, positive, negative = axis
    if angle.letter == negative:
        return -abs(angle.degrees)
    # A minus contradicts the letter of the positive side
    return angle.degrees if angle.letter == positive and angle.degrees >= 0 else None


def _near(degrees: float, centre: float | None) -> float | None:
    """Return the only one of both signs that is near the epicentre; None where none or both are."""
    if centre is None:
        return None
    # Differences of two angles, from 0 to 180 degrees
    candidates = (degrees, -degrees)
    near = [sign for sign in candidates if abs((sign - centre + 180) % 360 - 180) <= _REACH]
    return near[0] if len(near) == 1 else None


def _problem(axis: tuple[str, str, str], angle: Angle, degrees: float | None) -> str:
    """Return the note of a wrong letter."""
    name, positive, negative = axis
    problem = f"{name} {angle.degrees:g} {angle.letter}: {positive} or {negative} expected"
    if degrees is None:
        return f"{problem}, the epicentre does not decide, so the place is unknown"
    return f"{problem}, {positive if degrees > 0 else negative} taken, the epicentre's side"
