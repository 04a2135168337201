"""ShakeMap grids of the USGS: the ground motion of an earthquake on a map, from grid.xml."""

import gzip
import re
import zlib
from collections.abc import Iterable, Mapping
from io import StringIO
from pathlib import Path
from typing import Any, NamedTuple, cast
from xml.etree import ElementTree

import numpy as np
import xarray as xr

from per_obspy.checks import FloatArray
from per_obspy.constants import STANDARD_GRAVITY
from per_obspy.errors import CatalogError, reason_of

#: Fields of pseudo-spectral acceleration that a map must have; it may have others (PSA06: 0.6 s).
REQUIRED = ("PSA03", "PSA10", "PSA30")

#: Most bytes of a grid, unpacked: ten times the largest that the USGS offers.
LARGEST_FILE = 1_000_000_000

#: Largest plausible acceleration (per cent of gravity), log-standard deviation and Vs30 (m/s).
LARGEST_ACCELERATION, LARGEST_DEVIATION, LARGEST_VELOCITY = 2000.0, 3.0, 10_000.0

#: Units as maps of several versions write them -> factor to SI.
GRID_UNITS = {
    "acceleration": {"pctg": STANDARD_GRAVITY / 100.0, "%g": STANDARD_GRAVITY / 100.0},
    "deviation": {"ln(pctg)": 1.0, "ln(%g)": 1.0, "ln(g)": 1.0},
    "velocity": {"ms": 1.0, "m/s": 1.0},
}

#: Characters from the beginning of a grid that hold the attributes of its map.
_HEAD = 10_000

_SPECTRAL, _MAP = ("period", "latitude", "longitude"), ("latitude", "longitude")

#: Bytes that are read at once.
PIECE = 2**20


class _Grid(NamedTuple):
    """
    A grid file.

    Attributes
    ----------
    source : str
        Path, for messages.
    attributes : dict
        Of the root element.
    longitude, latitude : (n,) ndarray
        Degrees, rising.
    columns : dict
        Name of a field -> its values, (n_latitudes, n_longitudes), in the unit of the file.
    units : dict
        Name of a field -> its unit.
    """

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
        version); ``psa_log_std``: its log-standard deviation, where the map has it; ``pga`` (m/s²)
        and ``vs30`` (m/s) where the map has them.

    Raises
    ------
    CatalogError
        If a file cannot be read, is no grid, lacks a field, has another unit, number of rows or
        shape than its header has, or a value that is missing or implausible.
    """
    grid = _read(path)
    names = _spectral(grid)
    # Spectral acceleration, (n_periods, n_latitudes, n_longitudes)
    psa = [_values(grid, name, "acceleration", LARGEST_ACCELERATION) for name in names]
    meaning = "pseudo-spectral acceleration at 5 % damping"
    variables = {"psa": _variable(_SPECTRAL, np.stack(psa), "m s-2", meaning)}
    # The deviation, from a separate file or from the grid
    deviations = _read(uncertainty) if uncertainty else grid
    if uncertainty or all(f"STD{name}" in grid.columns for name in names):
        _require_same_axes(grid, deviations)
        variables["psa_log_std"] = _log_std(deviations, names)
    variables |= _peak_and_soil(grid)
    axes = {
        "period": [_period(name) for name in names],
        "latitude": grid.latitude,
        "longitude": grid.longitude,
    }
    return xr.Dataset(variables, coords=axes, attrs=_attributes(grid))


def is_scenario(path: Path) -> bool:
    """Return whether a ShakeMap is of a simulated earthquake, from the head of its grid."""
    head = _text(path)[:_HEAD].upper()
    return re.search(r"SHAKEMAP_EVENT_TYPE\s*=\s*[\"']SCENARIO[\"']", head) is not None


def map_event(path: Path) -> dict[str, object]:
    """
    Return the facts of the earthquake that the head of a grid states.

    Parameters
    ----------
    path : Path
        ``grid.xml``.

    Returns
    -------
    dict
        ``time`` (ISO 8601), ``magnitude``, ``longitude, latitude`` (degrees), ``depth`` (m), and
        ``map, version``; without those that are missing or implausible.
    """
    tags = _head_tags(path)
    event, root = tags.get("event", {}), tags.get("shakemap_grid", {})
    time = re.match(r"\d{4}-\d\d-\d\dT\d\d:\d\d:\d\d", event.get("event_timestamp", ""))
    # Kilometres become metres
    facts = {
        "time": time[0] if time else None,
        "magnitude": _within(event.get("magnitude"), -2.0, 10.0),
        "longitude": _within(event.get("lon"), -180.0, 360.0),
        "latitude": _within(event.get("lat"), -90.0, 90.0),
        "depth": _within(event.get("depth"), -10.0, 1000.0, 1000.0),
        "map": root.get("event_id") or root.get("shakemap_id"),
        "version": root.get("shakemap_version"),
    }
    return {name: value for name, value in facts.items() if value is not None}


def _head_tags(path: Path) -> dict[str, Mapping[str, str]]:
    """Return the attributes of the elements that begin in the head of a grid."""
    parser: ElementTree.XMLPullParser[Any] = ElementTree.XMLPullParser(("start",))
    try:
        parser.feed(_text(path)[:_HEAD])
        # The head ends within the grid, so that the document stays open
        events = cast("Iterable[tuple[str, ElementTree.Element]]", parser.read_events())
        return {_name(element): element.attrib for _, element in events}
    except ElementTree.ParseError:
        return {}


def _within(text: str | None, low: float, high: float, factor: float = 1.0) -> float | None:
    """Return a number times a factor, None where it is none or outside its limits."""
    try:
        return factor * value if low <= (value := float(text or "")) <= high else None
    except ValueError:
        return None


def _variable(dimensions: tuple[str, ...], values: FloatArray, unit: str, meaning: str) -> Any:
    """Return a variable of a Dataset."""
    return dimensions, values, {"units": unit, "long_name": meaning}


def _log_std(grid: _Grid, names: list[str]) -> Any:
    """Return the log-standard deviation of spectral acceleration."""
    values = [_values(grid, f"STD{name}", "deviation", LARGEST_DEVIATION) for name in names]
    return _variable(_SPECTRAL, np.stack(values), "1", "log-standard deviation of psa")


def _peak_and_soil(grid: _Grid) -> dict[str, Any]:
    """Return peak acceleration and Vs30, where the map has them."""
    variables = {}
    if "PGA" in grid.columns:
        peak = _values(grid, "PGA", "acceleration", LARGEST_ACCELERATION)
        variables["pga"] = _variable(_MAP, peak, "m s-2", "peak ground acceleration")
    if "SVEL" in grid.columns:
        velocity = _values(grid, "SVEL", "velocity", LARGEST_VELOCITY)
        variables["vs30"] = _variable(_MAP, velocity, "m s-1", "Vs30 of the map")
    return variables


def _attributes(grid: _Grid) -> dict[str, str]:
    """Return the path of a grid, and event and version of its map."""
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
    """
    Return a field in SI.

    It must be in a unit of its kind and between 0 and the largest plausible value.
    """
    if name not in grid.columns:
        raise CatalogError(grid.source, f"has no field {name}, only {', '.join(grid.columns)}")
    # Versions of maps differ in the spelling of units
    unit, units = grid.units[name], GRID_UNITS[kind]
    if unit not in units:
        raise CatalogError(grid.source, f"{name} is in {unit!r}, not in one of {', '.join(units)}")
    _require_plausible(grid, name, largest)
    return grid.columns[name] * units[unit]


def _require_plausible(grid: _Grid, name: str, largest: float) -> None:
    """Refuse a field with a value that is no number, negative or implausibly large."""
    values = grid.columns[name]
    bad = ~((values >= 0.0) & (values <= largest))
    if bad.any():
        # Name the first of them with its place
        row, column = np.unravel_index(int(np.argmax(bad)), bad.shape)
        place = f"longitude {grid.longitude[column]:g}, latitude {grid.latitude[row]:g}"
        value = f"{values[row, column]:g} {grid.units[name]}"
        raise CatalogError(grid.source, f"{name} = {value} at {place}")


def _require_same_axes(grid: _Grid, other: _Grid) -> None:
    """Refuse an uncertainty on another grid than that of the map."""
    for name in ("longitude", "latitude"):
        if not np.array_equal(getattr(grid, name), getattr(other, name)):
            raise CatalogError(other.source, f"its {name}s are not those of {grid.source}")


def _read(path: Path) -> _Grid:
    """Read a grid file."""
    source = str(path)
    root = _root(source, _text(path))
    units = _field_units(source, root)
    size = _size(source, root)
    rows = _rows(source, root, len(units), size)
    columns = dict(zip(units, rows.T, strict=True))
    # Every row has its node's coordinates
    if missing := [name for name in ("LON", "LAT") if name not in columns]:
        raise CatalogError(source, f"has no field {', '.join(missing)}, only {', '.join(columns)}")
    columns["LON"] = _unbroken(columns["LON"])
    # Rows from south to north, in each from west to east
    order = np.lexsort((columns["LON"], columns["LAT"]))
    shaped = {name: values[order].reshape(size) for name, values in columns.items()}
    longitude, latitude = _axes(source, shaped["LON"], shaped["LAT"])
    return _Grid(source, dict(root.attrib), longitude, latitude, shaped, units)


def _text(path: Path) -> str:
    """Return the content of a file, unpacked; a document type, with its entities, is refused."""
    try:
        content = _unpacked(path)
        text = content.decode("utf-8")
    except (OSError, EOFError, zlib.error, UnicodeDecodeError) as error:
        raise CatalogError(str(path), f"cannot be read: {reason_of(error)}") from error
    # Entities of a document type could fill the memory
    if len(content) > LARGEST_FILE:
        raise CatalogError(str(path), f"has more than {LARGEST_FILE} bytes")
    if "<!DOCTYPE" in text or "<!ENTITY" in text:
        problem = "contains a document type (DOCTYPE), which no ShakeMap has: refused"
        raise CatalogError(str(path), problem)
    return text


def _unpacked(path: Path) -> bytes:
    """Return the bytes of a file, unpacked if gzip packed it; few above the limit."""
    with path.open("rb") as file:
        packed = file.read(2) == b"\x1f\x8b"
    pieces, size = [], 0
    with gzip.open(path) if packed else path.open("rb") as file:
        # Memory grows with the file, not with the limit
        while size <= LARGEST_FILE and (piece := file.read(PIECE)):
            pieces.append(piece)
            size += len(piece)
    return b"".join(pieces)


def _root(source: str, text: str) -> ElementTree.Element:
    """Return the root element of a grid."""
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


def _field_units(source: str, root: ElementTree.Element) -> dict[str, str]:
    """Return the units of the fields, by name, in the order of their columns."""
    fields = [element.attrib for element in _children(root, "grid_field")]
    try:
        numbered = sorted(
            (int(field["index"]), field["name"], field.get("units", "")) for field in fields
        )
    except (KeyError, ValueError) as error:
        raise CatalogError(source, f"has a grid_field without index or name: {error}") from error
    # Columns are known by index only: none may be missing or repeated
    units = {name: unit for _, name, unit in numbered}
    if [index for index, _, _ in numbered] != list(range(1, len(units) + 1)):
        raise CatalogError(
            source, f"its grid_fields are not numbered 1, 2, 3, ...: {', '.join(units)}"
        )
    return units


def _size(source: str, root: ElementTree.Element) -> tuple[int, int]:
    """Return the numbers of latitudes and longitudes."""
    specification = next(iter(_children(root, "grid_specification")), None)
    numbers = {"nlat": "0", "nlon": "0"} if specification is None else specification.attrib
    try:
        size = (int(numbers["nlat"]), int(numbers["nlon"]))
    except (KeyError, ValueError) as error:
        raise CatalogError(
            source, f"its grid_specification has no nlat and nlon: {error}"
        ) from error
    # Interpolation needs two nodes in each direction
    if min(size) < 2:
        raise CatalogError(
            source, f"needs two latitudes and two longitudes, has {size[0]} and {size[1]}"
        )
    return size


def _rows(
    source: str, root: ElementTree.Element, columns: int, size: tuple[int, int]
) -> FloatArray:
    """Return the table of numbers, one row per node."""
    text = "".join(element.text or "" for element in _children(root, "grid_data"))
    if not text.strip():
        raise CatalogError(source, "has no grid_data")
    try:
        rows = np.loadtxt(StringIO(text), dtype=np.float64, ndmin=2, comments=None)
    except ValueError as error:
        raise CatalogError(source, f"grid_data: {error}") from error
    # The header has the numbers of nodes and fields
    if rows.shape != (size[0] * size[1], columns):
        header = f"{size[0]} x {size[1]} nodes of {columns} fields"
        table = f"grid_data has {rows.shape[0]} rows of {rows.shape[1]}"
        raise CatalogError(source, f"{table}, its head has {header}")
    return rows


def _axes(
    source: str, longitude: FloatArray, latitude: FloatArray
) -> tuple[FloatArray, FloatArray]:
    """Return the two axes of a table sorted by latitude, then longitude."""
    _require_within(source, "LON", longitude, 540.0)
    _require_within(source, "LAT", latitude, 90.0)
    east, north = longitude[0], latitude[:, 0]
    # All rows have the same longitudes, all columns the same latitudes
    regular = (longitude == east).all() and (latitude == north[:, None]).all()
    rising = (np.diff(east) > 0).all() and (np.diff(north) > 0).all()
    # A whole turn would repeat a meridian
    if not regular or not rising or east[-1] - east[0] >= 360.0:
        raise CatalogError(source, "its nodes do not form a grid of longitudes and latitudes")
    return east, north


def _unbroken(longitude: FloatArray) -> FloatArray:
    """Return longitudes in which those west of the widest hole go on beyond 180 or 360 degrees."""
    east = np.unique(longitude)
    steps = np.diff(east)
    hole = int(steps.argmax()) if steps.size else 0
    # The hole of other maps lies between their last longitude and the first one
    if not steps.size or steps[hole] <= east[0] + 360.0 - east[-1]:
        return longitude
    return np.where(longitude <= east[hole], longitude + 360.0, longitude)


def _require_within(source: str, name: str, degrees: FloatArray, limit: float) -> None:
    """Refuse a coordinate beyond its limit, degrees."""
    wrong = ~(np.abs(degrees) <= limit)
    if wrong.any():
        raise CatalogError(
            source, f"{name} = {degrees[wrong][0]:g} is not between {-limit:g} and {limit:g}"
        )
