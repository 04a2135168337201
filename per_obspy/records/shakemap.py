"""ShakeMap grids of the USGS: the ground motion of an earthquake on a map, as grid.xml tells it."""

import gzip
import re
import zlib
from collections.abc import Iterable
from io import StringIO
from pathlib import Path
from typing import Any, NamedTuple
from xml.etree import ElementTree

import numpy as np
import xarray as xr

from per_obspy.checks import FloatArray
from per_obspy.constants import STANDARD_GRAVITY
from per_obspy.errors import CatalogError, reason_of

#: Pseudo-spectral acceleration is asked for at these periods; a map may have others beside them
#: (PSA06: 0.6 s).
REQUIRED = ("PSA03", "PSA10", "PSA30")

#: Most bytes of a grid, unpacked: ten times the largest that the USGS offers.
LARGEST_FILE = 1_000_000_000

#: Largest acceleration (per cent of gravity), log-standard deviation and Vs30 (m/s) that are
#: believed.
LARGEST_ACCELERATION, LARGEST_DEVIATION, LARGEST_VELOCITY = 2000.0, 3.0, 10_000.0

#: Units as maps of several versions write them -> factor to SI.
UNITS = {
    "acceleration": {"pctg": STANDARD_GRAVITY / 100.0, "%g": STANDARD_GRAVITY / 100.0},
    "deviation": {"ln(pctg)": 1.0, "ln(%g)": 1.0, "ln(g)": 1.0},
    "velocity": {"ms": 1.0, "m/s": 1.0},
}


class _Grid(NamedTuple):
    """A grid file: attributes, axes in degrees (rising), and columns (latitude, longitude) with their units by name."""

    source: str
    attributes: dict[str, str]
    longitude: FloatArray
    latitude: FloatArray
    columns: dict[str, FloatArray]
    units: dict[str, str]


def read_shakemap(path: Path, uncertainty: Path | None = None) -> xr.Dataset:
    """
    Read a ShakeMap.

    Parameters
    ----------
    path : Path
        ``grid.xml``, as it is or packed by gzip.
    uncertainty : Path, optional
        ``uncertainty.xml`` of the same map; not needed where the grid has these fields itself.

    Returns
    -------
    Dataset
        Dimensions ``period`` (s), ``latitude``, ``longitude`` (degrees, rising; longitudes may go
        beyond 180 where the map crosses the date line). ``psa``: pseudo-spectral acceleration at 5
        % damping, m/s², the horizontal measure of the map (the larger component, or RotD50, by its
        version); ``psa_log_std``: its log-standard deviation, where the map tells; ``pga`` (m/s²)
        and ``vs30`` (m/s) where the map has them.

    Raises
    ------
    CatalogError
        If a file cannot be read, is no grid, lacks a field, has another unit, number of rows or
        shape than it says, or a value that is none or implausible.
    """
    grid = _read(path)
    names, dimensions = _spectral(grid), ("period", "latitude", "longitude")
    variables: dict[str, Any] = {}
    psa = np.stack([_values(grid, name, "acceleration", LARGEST_ACCELERATION) for name in names])
    variables["psa"] = (
        dimensions,
        psa,
        {"units": "m s-2", "long_name": "pseudo-spectral acceleration at 5 % damping"},
    )
    told = _read(uncertainty) if uncertainty else grid
    if uncertainty or all(f"STD{name}" in grid.columns for name in names):
        _require_same_axes(grid, told)
        deviations = np.stack(
            [_values(told, f"STD{name}", "deviation", LARGEST_DEVIATION) for name in names]
        )
        variables["psa_log_std"] = (
            dimensions,
            deviations,
            {"units": "1", "long_name": "log-standard deviation of psa"},
        )
    if "PGA" in grid.columns:
        peak = _values(grid, "PGA", "acceleration", LARGEST_ACCELERATION)
        variables["pga"] = (
            dimensions[1:],
            peak,
            {"units": "m s-2", "long_name": "peak ground acceleration"},
        )
    if "SVEL" in grid.columns:
        velocity = _values(grid, "SVEL", "velocity", LARGEST_VELOCITY)
        variables["vs30"] = (
            dimensions[1:],
            velocity,
            {"units": "m s-1", "long_name": "Vs30 of the map"},
        )
    axes = {
        "period": [_period(name) for name in names],
        "latitude": grid.latitude,
        "longitude": grid.longitude,
    }
    return xr.Dataset(variables, coords=axes, attrs=_attributes(grid))


def _attributes(grid: _Grid) -> dict[str, str]:
    known = ("event_id", "shakemap_version", "map_status", "shakemap_event_type")
    return {
        "source": grid.source,
        **{name: grid.attributes[name] for name in known if name in grid.attributes},
    }


def _spectral(grid: _Grid) -> list[str]:
    """Return the names of the fields of spectral acceleration, by rising period."""
    if missing := [name for name in REQUIRED if name not in grid.columns]:
        raise CatalogError(
            grid.source, f"has no field {', '.join(missing)}, only {', '.join(grid.columns)}"
        )
    return sorted((name for name in grid.columns if re.fullmatch(r"PSA\d\d", name)), key=_period)


def _period(name: str) -> float:
    """Return the period of a field in s: PSA03 is 0.3 s."""
    return int(name[-2:]) / 10.0


def _values(grid: _Grid, name: str, kind: str, largest: float) -> FloatArray:
    """Return a field in SI; it must be in a unit of its kind and between 0 and the largest plausible value."""
    if name not in grid.columns:
        raise CatalogError(grid.source, f"has no field {name}, only {', '.join(grid.columns)}")
    if grid.units[name] not in UNITS[kind]:
        raise CatalogError(
            grid.source,
            f"{name} is in {grid.units[name]!r}, not in one of {', '.join(UNITS[kind])}",
        )
    values = grid.columns[name]
    bad = ~((values >= 0.0) & (values <= largest))
    if bad.any():
        row, column = np.unravel_index(int(np.argmax(bad)), bad.shape)
        place = f"longitude {grid.longitude[column]:g}, latitude {grid.latitude[row]:g}"
        raise CatalogError(
            grid.source, f"{name} = {values[row, column]:g} {grid.units[name]} at {place}"
        )
    factor: float = UNITS[kind][grid.units[name]]
    return values * factor


def _require_same_axes(grid: _Grid, other: _Grid) -> None:
    for name in ("longitude", "latitude"):
        if not np.array_equal(getattr(grid, name), getattr(other, name)):
            raise CatalogError(other.source, f"its {name}s are not those of {grid.source}")


def _read(path: Path) -> _Grid:
    source = str(path)
    root = _root(source, _text(path))
    fields = _fields(source, root)
    size = _size(source, root)
    rows = _rows(source, root, len(fields), size)
    columns = dict(zip(fields, rows.T, strict=True))
    if missing := [name for name in ("LON", "LAT") if name not in columns]:
        raise CatalogError(source, f"has no field {', '.join(missing)}, only {', '.join(columns)}")
    order = np.lexsort((columns["LON"], columns["LAT"]))
    shaped = {name: values[order].reshape(size) for name, values in columns.items()}
    longitude, latitude = _axes(source, shaped["LON"], shaped["LAT"])
    return _Grid(source, dict(root.attrib), longitude, latitude, shaped, fields)


def _text(path: Path) -> str:
    """Return the content of a file, unpacked; a document with entities of its own is refused."""
    try:
        with path.open("rb") as file:
            packed = file.read(2) == b"\x1f\x8b"
        with gzip.open(path) if packed else path.open("rb") as file:
            content = file.read(LARGEST_FILE + 1)
        text = content.decode("utf-8")
    except (OSError, EOFError, zlib.error, UnicodeDecodeError) as error:
        raise CatalogError(str(path), f"cannot be read: {reason_of(error)}") from error
    if len(content) > LARGEST_FILE:
        raise CatalogError(str(path), f"has more than {LARGEST_FILE} bytes")
    if "<!DOCTYPE" in text or "<!ENTITY" in text:
        raise CatalogError(
            str(path), "has a document type of its own (DOCTYPE), which no ShakeMap has: refused"
        )
    return text


def _root(source: str, text: str) -> ElementTree.Element:
    try:
        root = ElementTree.fromstring(text)
    except ElementTree.ParseError as error:
        raise CatalogError(source, f"cannot be read as XML: {error}") from error
    if _name(root) != "shakemap_grid":
        raise CatalogError(
            source, f"is no ShakeMap grid: its root is {_name(root)}, not shakemap_grid"
        )
    return root


def _name(element: ElementTree.Element) -> str:
    """Return the name of an element without its name space."""
    return element.tag.rpartition("}")[2]


def _children(root: ElementTree.Element, name: str) -> Iterable[ElementTree.Element]:
    return (element for element in root if _name(element) == name)


def _fields(source: str, root: ElementTree.Element) -> dict[str, str]:
    """Return the fields in the order of their columns, each with its unit."""
    told = [one.attrib for one in _children(root, "grid_field")]
    try:
        named = sorted((int(one["index"]), one["name"], one.get("units", "")) for one in told)
    except (KeyError, ValueError) as error:
        raise CatalogError(source, f"has a grid_field without index or name: {error}") from error
    fields = {name: unit for _, name, unit in named}
    if [index for index, _, _ in named] != list(range(1, len(fields) + 1)):
        raise CatalogError(
            source, f"its grid_fields are not numbered 1, 2, 3, ...: {', '.join(fields)}"
        )
    return fields


def _size(source: str, root: ElementTree.Element) -> tuple[int, int]:
    """Return the numbers of latitudes and longitudes."""
    given = next(iter(_children(root, "grid_specification")), None)
    try:
        size = (0, 0) if given is None else (int(given.attrib["nlat"]), int(given.attrib["nlon"]))
    except (KeyError, ValueError) as error:
        raise CatalogError(
            source, f"its grid_specification tells no nlat and nlon: {error}"
        ) from error
    if min(size) < 2:
        raise CatalogError(
            source, f"needs two latitudes and two longitudes, has {size[0]} and {size[1]}"
        )
    return size


def _rows(
    source: str, root: ElementTree.Element, columns: int, size: tuple[int, int]
) -> FloatArray:
    """Return the table of numbers, one row a node."""
    text = "".join(one.text or "" for one in _children(root, "grid_data"))
    if not text.strip():
        raise CatalogError(source, "has no grid_data")
    try:
        rows = np.loadtxt(StringIO(text), dtype=np.float64, ndmin=2, comments=None)
    except ValueError as error:
        raise CatalogError(source, f"grid_data: {error}") from error
    if rows.shape != (size[0] * size[1], columns):
        told = f"{size[0]} x {size[1]} nodes of {columns} fields"
        raise CatalogError(
            source, f"grid_data has {rows.shape[0]} rows of {rows.shape[1]}, the head tells {told}"
        )
    return rows


def _axes(
    source: str, longitude: FloatArray, latitude: FloatArray
) -> tuple[FloatArray, FloatArray]:
    """Return the two axes of a table sorted by latitude, then longitude."""
    for name, values, limit in (("LON", longitude, 360.0), ("LAT", latitude, 90.0)):
        wrong = ~(np.abs(values) <= limit)
        if wrong.any():
            raise CatalogError(
                source, f"{name} = {values[wrong][0]:g} is not between {-limit:g} and {limit:g}"
            )
    east, north = longitude[0], latitude[:, 0]
    regular = (longitude == east).all() and (latitude == north[:, None]).all()
    if (
        not regular
        or (np.diff(east) <= 0).any()
        or (np.diff(north) <= 0).any()
        or east[-1] - east[0] >= 360.0
    ):
        raise CatalogError(source, "its nodes are not those of a grid of longitudes and latitudes")
    return east, north
