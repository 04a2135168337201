"""ShakeMap grids of the USGS: the ground motion of an earthquake on a map, from grid.xml."""

import re
import zlib
from collections.abc import Iterable, Iterator, Mapping
from contextlib import contextmanager, suppress
from io import StringIO
from pathlib import Path
from typing import Any, NamedTuple, cast
from xml.etree import ElementTree

import numpy as np
import pandas as pd
import xarray as xr

from per_obspy.checks import FloatArray
from per_obspy.constants import STANDARD_GRAVITY
from per_obspy.errors import CatalogError, reason_of
from per_obspy.records.archive import unpacked

#: Fields of pseudo-spectral acceleration that a map must have; it may have others (PSA06: 0.6 s).
REQUIRED = ("PSA03", "PSA10", "PSA30")

#: Most bytes of a grid, unpacked: ten times the largest that the USGS offers.
LARGEST_FILE = 1_000_000_000


#: fact of an earthquake -> attribute of the head, smallest and largest value, factor to SI
_FACTS = {
    "magnitude": ("magnitude", -2.0, 10.0, 1.0),
    "longitude": ("lon", -180.0, 360.0, 1.0),
    "latitude": ("lat", -90.0, 90.0, 1.0),
    "depth": ("depth", -10.0, 1000.0, 1000.0),
}


class _Kind(NamedTuple):
    """A kind of fields."""

    units: dict[str, float]  # as maps of several versions write them -> factor to SI
    largest: float  # plausible value, in the unit of the file
    unit: str  # in SI


_ACCELERATION = _Kind(dict.fromkeys(("pctg", "%g"), STANDARD_GRAVITY / 100.0), 2000.0, "m s-2")
_DEVIATION = _Kind(dict.fromkeys(("ln(pctg)", "ln(%g)", "ln(g)"), 1.0), 3.0, "1")
_VELOCITY = _Kind({"ms": 1.0, "m/s": 1.0}, 10_000.0, "m s-1")

#: variable of a Dataset -> field of a map that may be absent, its kind and its meaning
_OPTIONAL = {
    "pga": ("PGA", _ACCELERATION, "peak ground acceleration"),
    "vs30": ("SVEL", _VELOCITY, "Vs30 of the map"),
}

#: Attributes of the root element that name event and version of the map.
_VERSION = ("event_id", "shakemap_version", "map_status", "shakemap_event_type")

#: Characters from the beginning of a grid that hold the attributes of its map.
_HEAD = 10_000

_AXES = ("latitude", "longitude")

#: Meanings of the two variables that have periods.
_MEANINGS = ("pseudo-spectral acceleration at 5 % damping", "log-standard deviation of psa")


class _Grid(NamedTuple):
    """A grid file."""

    path: Path
    attributes: dict[str, str]  # event and version of the map, and its path
    units: dict[str, str]  # of each field
    shape: tuple[int, int]  # latitudes and longitudes
    table: pd.DataFrame  # fields in the unit of the file, by latitude and longitude, degrees


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
    grid = _read(path, *REQUIRED)
    # By period: PSA03 is 0.3 s
    names = sorted(name for name in grid.units if re.fullmatch(r"PSA\d\d", name))
    variables = {"psa": _variable(grid, names, _ACCELERATION, _MEANINGS[0])}
    # The deviation, from a separate file or from the grid
    deviations = [f"STD{name}" for name in names]
    other = _read_at_nodes(uncertainty, grid) if uncertainty else grid
    if uncertainty or set(deviations) <= set(grid.units):
        variables["psa_log_std"] = _variable(other, deviations, _DEVIATION, _MEANINGS[1])
    for variable, (name, kind, meaning) in _OPTIONAL.items():
        if name in grid.units:
            variables[variable] = _variable(grid, name, kind, meaning)
    axes = {name: grid.table.index.unique(name) for name in _AXES}
    periods = [int(name[-2:]) / 10.0 for name in names]
    return xr.Dataset(variables, coords={"period": periods, **axes}, attrs=grid.attributes)


def is_scenario(path: Path) -> bool:
    """Return whether a ShakeMap is of a simulated earthquake, from the head of its grid."""
    kinds = (tag.get("shakemap_event_type", "").upper() for tag in _head_tags(path).values())
    return "SCENARIO" in kinds


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
    facts: dict[str, object] = {"time": time and time[0]}
    # Those that are no number or implausible are left out
    for name, (attribute, low, high, factor) in _FACTS.items():
        with suppress(ValueError):
            value = float(event.get(attribute, ""))
            facts[name] = factor * value if low <= value <= high else None
    facts["map"] = root.get("event_id") or root.get("shakemap_id")
    facts["version"] = root.get("shakemap_version")
    return {name: value for name, value in facts.items() if value is not None}


def _head_tags(path: Path) -> dict[str, Mapping[str, str]]:
    """Return the attributes of the elements that begin in the head of a grid."""
    parser: ElementTree.XMLPullParser[Any] = ElementTree.XMLPullParser(("start",))
    with _faults_of(path):
        text = _text(path)[:_HEAD]
    try:
        parser.feed(text)
        # The head ends within the grid, so that the document stays open
        events = cast("Iterable[tuple[str, ElementTree.Element]]", parser.read_events())
        return {_name(element): element.attrib for _, element in events}
    except ElementTree.ParseError:
        return {}


@contextmanager
def _faults_of(path: Path) -> Iterator[None]:
    """Name the file of a fault."""
    try:
        yield
    except ValueError as error:
        raise CatalogError(str(path), str(error)) from error


def _variable(grid: _Grid, names: str | list[str], kind: _Kind, meaning: str) -> Any:
    """Return a field in SI as a variable of a Dataset, or the fields of all periods."""
    attributes = {"units": kind.unit, "long_name": meaning}
    with _faults_of(grid.path):
        if isinstance(names, str):
            return _AXES, _values(grid, names, kind), attributes
        values = [_values(grid, name, kind) for name in names]
    return ("period", *_AXES), np.stack(values), attributes


def _require_fields(units: Mapping[str, str], *names: str) -> None:
    """Refuse a map without some fields."""
    if missing := ", ".join(name for name in names if name not in units):
        raise ValueError(f"has no field {missing}, only {', '.join(units)}")


def _values(grid: _Grid, name: str, kind: _Kind) -> FloatArray:
    """Return a field in SI; its unit must be one of its kind, all its values plausible."""
    _require_fields(grid.units, name)
    unit, values = grid.units[name], grid.table[name]
    # Versions of maps differ in the spelling of units
    if unit not in kind.units:
        raise ValueError(f"{name} is in {unit!r}, not in one of {', '.join(kind.units)}")
    # No number, negative or implausibly large: the first of them with its place
    bad = ~values.between(0.0, kind.largest)
    if bad.any():
        first = int(np.argmax(bad))
        latitude, longitude = grid.table.index[first]
        place = f"longitude {longitude:g}, latitude {latitude:g}"
        raise ValueError(f"{name} = {values.iloc[first]:g} {unit} at {place}")
    return values.to_numpy().reshape(grid.shape) * kind.units[unit]


def _read(path: Path, *required: str) -> _Grid:
    """Read a grid file."""
    with _faults_of(path):
        root = _root(path)
        units, size = _units(root), _size(root)
        table = pd.DataFrame(_rows(root, len(units), size), columns=[*units])
        # Every row has its node's coordinates
        _require_fields(units, "LON", "LAT")
        _require_fields(units, *required)
        nodes = _nodes(table, size)
    version = {name: root.attrib[name] for name in _VERSION if name in root.attrib}
    # Rows from south to north, in each from west to east
    return _Grid(
        path, {"source": str(path), **version}, units, size, table.set_index(nodes).sort_index()
    )


def _read_at_nodes(path: Path, grid: _Grid) -> _Grid:
    """Read another grid file, which must have the nodes of the first."""
    other = _read(path)
    for name in reversed(_AXES):
        if not other.table.index.unique(name).equals(grid.table.index.unique(name)):
            raise CatalogError(str(path), f"its {name}s are not those of {grid.path}")
    return other


def _nodes(table: pd.DataFrame, size: tuple[int, int]) -> pd.MultiIndex:
    """Return latitude and longitude of every row, which form a grid, degrees."""
    table["LON"] = _unbroken(table["LON"].to_numpy())
    for name, limit in (("LON", 540.0), ("LAT", 90.0)):
        wrong = table[name][~table[name].between(-limit, limit)]
        if not wrong.empty:
            limits = f"between {-limit:g} and {limit:g}"
            raise ValueError(f"{name} = {wrong.iloc[0]:g} is not {limits}")
    nodes = pd.MultiIndex.from_frame(table[["LAT", "LON"]], names=_AXES)
    east = nodes.levels[1]
    # A whole turn would repeat a meridian
    if nodes.has_duplicates or nodes.levshape != size or east[-1] - east[0] >= 360.0:
        raise ValueError("its nodes do not form a grid of longitudes and latitudes")
    return nodes


def _root(path: Path) -> ElementTree.Element:
    """Return the root element of a grid."""
    try:
        root = ElementTree.fromstring(_text(path))
    except ElementTree.ParseError as error:
        raise ValueError(f"cannot be read as XML: {error}") from error
    if (name := _name(root)) != "shakemap_grid":
        raise ValueError(f"is no ShakeMap grid: its root is {name}, not shakemap_grid")
    return root


def _text(path: Path) -> str:
    """Return the content of a file, unpacked; a document type, with its entities, is refused."""

    def check(total: int) -> None:
        if total > LARGEST_FILE:
            raise ValueError(f"has more than {LARGEST_FILE} bytes")

    try:
        with path.open("rb") as file:
            head = file.read(2)  # of gzip alone
            file.seek(0)
            text = b"".join(unpacked(file, head, check)).decode("utf-8")
    except (OSError, EOFError, zlib.error, UnicodeDecodeError) as error:
        raise ValueError(f"cannot be read: {reason_of(error)}") from error
    # Entities of a document type could fill the memory
    if "<!DOCTYPE" in text or "<!ENTITY" in text:
        raise ValueError("contains a document type (DOCTYPE), which no ShakeMap has: refused")
    return text


def _name(element: ElementTree.Element) -> str:
    """Return the name of an element without its name space."""
    return element.tag.rpartition("}")[2]


def _units(root: ElementTree.Element) -> dict[str, str]:
    """Return the units of the fields, by name, in the order of their columns."""
    fields = [element.attrib for element in root.iterfind("{*}grid_field")]
    try:
        numbered = sorted((int(one["index"]), one["name"], one.get("units", "")) for one in fields)
    except (KeyError, ValueError) as error:
        raise ValueError(f"has a grid_field without index or name: {error}") from error
    # Columns are known by index only: none may be missing or repeated
    units = {name: unit for _, name, unit in numbered}
    if [index for index, _, _ in numbered] != list(range(1, len(units) + 1)):
        raise ValueError(f"its grid_fields are not numbered 1, 2, 3, ...: {', '.join(units)}")
    return units


def _size(root: ElementTree.Element) -> tuple[int, int]:
    """Return the numbers of latitudes and longitudes; interpolation needs two of each."""
    specification = root.find("{*}grid_specification")
    numbers = {"nlat": "0", "nlon": "0"} if specification is None else specification.attrib
    # Both must be there
    try:
        size = (int(numbers["nlat"]), int(numbers["nlon"]))
    except (KeyError, ValueError) as error:
        raise ValueError(f"its grid_specification has no nlat and nlon: {error}") from error
    if min(size) < 2:
        raise ValueError(f"needs two latitudes and two longitudes, has {size[0]} and {size[1]}")
    return size


def _rows(root: ElementTree.Element, columns: int, size: tuple[int, int]) -> FloatArray:
    """Return the table of numbers, one row per node."""
    text = "".join(element.text or "" for element in root.iterfind("{*}grid_data"))
    if not text.strip():
        raise ValueError("has no grid_data")
    try:
        rows = np.loadtxt(StringIO(text), dtype=np.float64, ndmin=2, comments=None)
    except ValueError as error:
        raise ValueError(f"grid_data: {error}") from error
    # The header has the numbers of nodes and fields
    if rows.shape != (size[0] * size[1], columns):
        header = f"{size[0]} x {size[1]} nodes of {columns} fields"
        raise ValueError(
            f"grid_data has {rows.shape[0]} rows of {rows.shape[1]}, its head has {header}"
        )
    return rows


def _unbroken(longitude: FloatArray) -> FloatArray:
    """Return longitudes in which those west of the widest hole go on beyond 180 or 360 degrees."""
    east = np.unique(longitude)
    steps = np.diff(east)
    hole = int(steps.argmax()) if steps.size else 0
    # The hole of other maps lies between their last longitude and the first one
    if not steps.size or steps[hole] <= east[0] + 360.0 - east[-1]:
        return longitude
    return np.where(longitude <= east[hole], longitude + 360.0, longitude)
