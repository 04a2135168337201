"""
Amplitudes of stations without their records: ``stationlist.json`` of a ShakeMap.

The list gives peaks and pseudo-spectral acceleration at 5 % damping and few periods, channel by
channel, with flags of the agency. Intensities that people reported are in it too; they are counted
and left out.
"""

import json
import math
import re
from collections.abc import Mapping
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np

from per_obspy.checks import FloatArray
from per_obspy.constants import EARTH_RADIUS, STANDARD_GRAVITY
from per_obspy.errors import CatalogError, Rejection, reason_of, shortened
from per_obspy.files import reading
from per_obspy.names import SHOWN, code_problem

#: Most bytes of a list: ten times one of ten thousand stations.
LARGEST_FILE = 500_000_000

#: Words of a list near its beginning, by which it is known from other GeoJSON.
MARK = b'"commType"'

#: Name of a spectral acceleration with its period, s.
_SPECTRAL = re.compile(r"sa\((\d{1,2}(?:\.\d{1,4})?)\)", re.IGNORECASE)

#: Quantity -> units of lists, with their factor to SI, and the largest plausible value in SI.
_ACCELERATION = {"%g": STANDARD_GRAVITY / 100.0, "pctg": STANDARD_GRAVITY / 100.0}
_UNITS: dict[str, tuple[dict[str, float], float]] = {
    "sa": (_ACCELERATION, 20.0 * STANDARD_GRAVITY),
    "pga": (_ACCELERATION, 20.0 * STANDARD_GRAVITY),
    "pgv": ({"cm/s": 0.01}, 20.0),
}

#: Largest plausible spectral displacement, m: larger ones are in other units.
_LARGEST_DISPLACEMENT = 20.0

#: Flags of an amplitude without a doubt of the agency.
_NO_DOUBT = ("", "0", "None", "null")

#: Distances by which a hypocentre is found; how far they may be off, and its depth, m; the largest
#: hypocentral distance that counts, km: that of a chord is shorter far away.
FEWEST_DISTANCES, SAME_DISTANCE, DEEPEST, FURTHEST = 5, 1000.0, 700_000.0, 1000.0
#: Square of a direction less 1 that is rounding: 1 km beside a line of stations.
ON_SURFACE = 2e-8

#: Endings and names of vertical channels.
_VERTICAL = re.compile(r".*Z|V|U|D|UP|UD|DOWN|VER(T|TICAL)?", re.IGNORECASE)

#: Doubtful amplitudes that a station's warning names.
_NAMED = 4


class StationAmplitudes(NamedTuple):
    """
    Amplitudes of one station.

    Attributes
    ----------
    name : str
        ``NETWORK.STATION``.
    longitude, latitude : float
        Degrees east and north.
    vs30 : float
        m/s; NaN if unknown.
    periods : tuple of float
        s, rising, at least two.
    displacements : tuple of float
        Spectral displacement at 5 % damping, m, of the larger horizontal.
    pga, pgv : float
        Larger horizontal, m/s2 and m/s; NaN if unknown.
    channels : tuple of str
        Horizontals with an amplitude.
    warnings : str
        Amplitudes that are left out, with their flag, unit or value; horizontals that lack.
    """

    name: str
    longitude: float
    latitude: float
    vs30: float
    periods: tuple[float, ...]
    displacements: tuple[float, ...]
    pga: float
    pgv: float
    channels: tuple[str, ...]
    warnings: str


class StationList(NamedTuple):
    """
    Content of a list.

    Attributes
    ----------
    stations : tuple of StationAmplitudes
        In the order of the list.
    rejected : tuple of Rejection
        Stations that cannot be used, with their reasons.
    intensities : int
        Number of intensities that people reported, which are left out.
    hypocentre : tuple of float or None
        Longitude and latitude, degrees, and depth, m, from which the list counts the distances of
        its stations; None where these are missing or contradict each other.
    """

    stations: tuple[StationAmplitudes, ...]
    rejected: tuple[Rejection, ...]
    intensities: int
    hypocentre: tuple[float, float, float] | None = None


def read_station_list(path: Path) -> StationList:
    """
    Read the amplitudes of stations from a list.

    Parameters
    ----------
    path : Path
        ``stationlist.json`` of a ShakeMap.

    Raises
    ------
    CatalogError
        If the file cannot be read or is no list of stations.
    """
    stations, rejected, intensities = dict[str, StationAmplitudes](), list[Rejection](), 0
    features = _features(path)
    for number, feature in enumerate(features, start=1):
        # Anything may stand in the place of a station
        facts = feature.get("properties") if isinstance(feature, dict) else None
        facts = facts if isinstance(facts, dict) else {}
        if facts.get("station_type") == "macroseismic":
            intensities += 1
            continue
        # Names become rows of tables; another station of the same name is not mixed with the first
        codes = str(facts.get("network") or ""), str(facts.get("code") or "")
        name = shortened(".".join(codes), SHOWN) if any(codes) else f"feature {number}"
        try:
            stations[name] = _named_station(name, codes, feature, facts, name in stations)
        except ValueError as error:
            rejected.append(Rejection("record", name, str(path), None, (shortened(str(error)),)))
    return StationList(
        tuple(stations.values()), tuple(rejected), intensities, _hypocentre(features)
    )


#: Longitude and latitude, degrees, epicentral and hypocentral distance, km.
_Distances = tuple[float, float, float, float]


def _hypocentre(features: list[Any]) -> tuple[float, float, float] | None:
    """Return the point from which a list counts its distances; it does not name it otherwise."""
    rows = np.array([row for row in map(_distances, features) if row]).reshape(-1, 4)
    epicentral, hypocentral = 1000.0 * rows[:, 2:].T
    if len(rows) < FEWEST_DISTANCES or (place := _epicentre(rows[:, :2], epicentral)) is None:
        return None
    # That of most stations
    depth = float(np.median(np.sqrt(hypocentral**2 - epicentral**2)))
    return (*place, depth) if depth <= DEEPEST else None


def _epicentre(stations: FloatArray, distances: FloatArray) -> tuple[float, float] | None:
    """
    Return the place, degrees, at these distances, m, from stations (n, 2); None if there is none.

    The cosine of a distance in radii of the Earth is linear in the direction to the epicentre.
    """
    east, north = np.radians(stations.T)
    level = np.cos(north)
    places = np.stack([level * np.cos(east), level * np.sin(east), np.sin(north)], axis=1)
    direction = np.linalg.lstsq(places, np.cos(distances / EARTH_RADIUS))[0]
    # Stations in line leave a point inside of the Earth, those of two earthquakes other distances
    angles = np.arccos(np.clip(places @ direction, -1.0, 1.0))
    is_inside = abs(direction @ direction - 1.0) > ON_SURFACE
    if is_inside or np.abs(EARTH_RADIUS * angles - distances).max() > SAME_DISTANCE:
        return None
    # Degrees east and north
    x, y, z = direction.tolist()
    return math.degrees(math.atan2(y, x)), math.degrees(math.atan2(z, math.hypot(x, y)))


def _distances(feature: Any) -> _Distances | None:
    """Return place and distances of a feature that has all of them."""
    try:
        known = feature["properties"]["distances"]
        row = (*_place(feature), _number(known["repi"]), _number(known["rhypo"]))
    except (TypeError, KeyError, ValueError):
        return None
    # Half around the Earth and more, or none
    return row if 0.0 <= row[2] <= row[3] <= FURTHEST else None


def _named_station(
    name: str, codes: tuple[str, str], feature: Any, facts: Mapping[str, Any], is_known: bool
) -> StationAmplitudes:
    """Return a station whose codes can be used; ``ValueError`` says why it cannot be used."""
    if not any(codes):
        raise ValueError("is no station: it has no network and code")
    if problem := code_problem(*codes) or ("is in the list twice" if is_known else ""):
        raise ValueError(problem)
    return _station(name, feature, facts)


def _features(path: Path) -> list[Any]:
    """Return the features of a list."""
    with reading(path):
        if path.stat().st_size > LARGEST_FILE:
            raise CatalogError(str(path), f"has more than {LARGEST_FILE} bytes")
        read = path.read_bytes()
    # Deep nesting and numbers of endless digits are errors too
    try:
        content = json.loads(read)
    except (ValueError, RecursionError) as error:
        raise CatalogError(str(path), f"a damaged station list: {reason_of(error)}") from error
    features = content.get("features") if isinstance(content, dict) else None
    if not isinstance(features, list):
        raise CatalogError(str(path), "is no list of stations: it has no features")
    return features


def _station(name: str, feature: Mapping[str, Any], facts: Mapping[str, Any]) -> StationAmplitudes:
    """Return a station with at least two periods; ``ValueError`` says why it cannot be used."""
    longitude, latitude = _place(feature)
    known, doubts = _horizontals(facts.get("channels"))
    # The larger of the horizontals, at every period
    largest = {key: max(of_channels.values()) for key, of_channels in known.items()}
    periods = _periods(largest, doubts)
    # One horizontal alone may be the smaller one
    channels = sorted({channel for of_channels in known.values() for channel in of_channels})
    doubts += [
        f"one horizontal at {period:g} s"
        for period in periods
        if len(known[period]) < len(channels)
    ]
    # As they are used
    displacements = _displacements({period: largest[period] for period in periods})
    vs30 = _number(facts.get("vs30"))
    return StationAmplitudes(
        name,
        longitude,
        latitude,
        vs30 if 10.0 <= vs30 <= 10_000.0 else math.nan,
        tuple(periods),
        displacements,
        largest.get("pga", math.nan),
        largest.get("pgv", math.nan),
        tuple(channels),
        "; ".join(_shown(doubts)),
    )


def _periods(amplitudes: Mapping[float | str, float], doubts: list[str]) -> list[float]:
    """Return the periods of spectral accelerations, rising, s: two at least."""
    periods = sorted(key for key in amplitudes if isinstance(key, float))
    if len(periods) < 2:
        listed = ", ".join(f"{period:g} s" for period in periods) or "no period"
        problem = f"has spectral acceleration at {listed}, two are needed"
        raise ValueError("; ".join([problem, *_shown(doubts)]))
    return periods


def _place(feature: Mapping[str, Any]) -> tuple[float, float]:
    """Return longitude and latitude of a station, degrees."""
    geometry = feature.get("geometry")
    place = geometry.get("coordinates") if isinstance(geometry, dict) else None
    place = place[:2] if isinstance(place, list) else []
    longitude, latitude = map(_number, place) if len(place) == 2 else (math.nan, math.nan)
    # NaN is not within any limit
    if not (abs(longitude) <= 180.0 and abs(latitude) <= 90.0):
        shown = shortened(str(place), SHOWN)
        raise ValueError(f"coordinates = {shown} are not longitude and latitude in degrees")
    if longitude == latitude == 0.0:
        raise ValueError("coordinates = 0, 0 are a placeholder")
    return longitude, latitude


def _displacements(acceleration: Mapping[float, float]) -> tuple[float, ...]:
    """Return SD = PSA (T / 2 pi)^2 of every period, m."""
    found = tuple(psa * (period / (2.0 * math.pi)) ** 2 for period, psa in acceleration.items())
    if max(found) > _LARGEST_DISPLACEMENT:
        raise ValueError(f"spectral displacement = {max(found):.3g} m: in other units?")
    return found


#: Amplitudes in SI by channel, of every period (s) and peak.
_Amplitudes = dict[float | str, dict[str, float]]


def _horizontals(channels: object) -> tuple[_Amplitudes, list[str]]:
    """Return the amplitudes of all horizontals, and sentences on those that are left out."""
    known, doubts = _Amplitudes(), list[str]()
    for channel in channels if isinstance(channels, list) else ():
        if not isinstance(channel, dict):
            continue
        code = shortened(str(channel.get("name") or "UNK"), SHOWN)
        amplitudes = channel.get("amplitudes")
        if _VERTICAL.fullmatch(code) or not isinstance(amplitudes, list):
            continue
        for amplitude in amplitudes:
            if not isinstance(amplitude, dict) or amplitude.get("value") in (None, "null"):
                continue
            try:
                key, value = _amplitude(amplitude)
                known.setdefault(key, {})[code] = value
            except ValueError as error:
                doubts.append(f"{code} {error}")
            except LookupError:
                continue  # of another kind: intensities, durations
    return known, doubts


def _amplitude(amplitude: Mapping[str, Any]) -> tuple[float | str, float]:
    """
    Return period or name of an amplitude, and its value in SI.

    ``ValueError`` says why it cannot be used, ``KeyError`` that it is of another kind.
    """
    name, unit = str(amplitude.get("name")).lower(), str(amplitude.get("units"))
    spectral = _SPECTRAL.fullmatch(name)
    units, limit = _UNITS["sa" if spectral else name]
    # Flag, unit and value, in this order
    if (flag := str(amplitude.get("flag", ""))) not in _NO_DOUBT:
        raise ValueError(f"{name}: flag {shortened(flag, SHOWN)}")
    if unit not in units:
        raise ValueError(f"{name}: unit {shortened(unit, SHOWN)!r}, expected {', '.join(units)}")
    value = _number(amplitude["value"]) * units[unit]
    if not 0.0 < value <= limit:
        raise ValueError(f"{name} = {shortened(repr(amplitude['value']), SHOWN)} {unit}")
    period = float(spectral[1]) if spectral else math.inf
    # A period of 0 is the peak under another name
    if not period > 0.0:
        raise ValueError(f"{name}: the period must be positive")
    return (period, value) if spectral else (name, value)


def _number(value: object) -> float:
    """Return a number of JSON, NaN for anything else."""
    if isinstance(value, bool) or not isinstance(value, int | float):
        return math.nan
    # Digits without end are an integer in JSON
    return float(value) if abs(value) < 1e300 else math.nan


def _shown(doubts: list[str]) -> list[str]:
    """Return the first sentences of many."""
    rest = len(doubts) - _NAMED
    return [*doubts[:_NAMED], *([f"{rest} more amplitudes left out"] if rest > 0 else [])]
