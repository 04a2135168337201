"""Messages to groups of people about the pairs of their area, from their threshold on."""

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

import duckdb
import numpy as np

from per_obspy.config import Run
from per_obspy.config.watch import Group
from per_obspy.errors import CatalogError, reason_of, require_extra, shortened
from per_obspy.report.texts import LANGUAGES, in_context
from per_obspy.results.ranked_table import table_files
from per_obspy.watch.notification import Message

if TYPE_CHECKING:
    from numpy.typing import NDArray
    from shapely import Geometry

    Geometries = NDArray[np.object_]

#: Texts of a message, translated in the catalogues of languages: what is new, and the sentences.
FIRST, CHANGED = "first result", "before: {before}"
BELOW = "no longer reaches your threshold; before: {before}"
PAIRS = "Pairs of neighbouring buildings of class {least} or worse in {group}: {classes}."
NOTE = (
    "Pairs without a verdict are in no class. Where no message comes, nothing says that buildings "
    "are safe."
)

#: Bytes of the largest file of an area.
LARGEST_AREA = 64 * 2**20


def check_areas(settings: Run) -> None:
    """Raise ``CatalogError`` with the key of the first group whose area cannot be read."""
    for number, group in enumerate(settings.notify.groups):
        if group.area:
            try:
                area_of(group.area)
            except CatalogError as error:
                raise CatalogError(f"notify.groups.{number}.area", str(error)) from error


def area_of(file: Path) -> "Geometry":
    """
    Return the polygons of a file, GeoJSON or WKT, as one geometry.

    Raises
    ------
    CatalogError
        If the file cannot be read, or holds no polygon in degrees.
    MissingExtra
        If shapely is not installed.
    """
    require_extra("gis", "shapely")
    import shapely

    # Anything but whole polygons would contain no pair, and nobody would hear of any
    polygons = _polygons(file)
    is_polygon = (shapely.get_dimensions(polygons) == 2) & ~shapely.is_empty(polygons)
    if not len(polygons) or not is_polygon.all():
        raise CatalogError(str(file), "holds something else than polygons")
    if not (is_valid := shapely.is_valid(polygons)).all():
        fault = shapely.is_valid_reason(polygons[~is_valid][0])
        raise CatalogError(str(file), f"has a polygon that is not valid: {fault}")
    # So would metres of a projection
    west, south, east, north = shapely.total_bounds(polygons)
    if west < -180.0 or east > 360.0 or south < -90.0 or north > 90.0:
        bounds = f"{west:g} to {east:g}, {south:g} to {north:g}"
        raise CatalogError(str(file), f"is not in degrees of longitude and latitude: {bounds}")
    return shapely.union_all(polygons)


def _polygons(file: Path) -> "Geometries":
    """Return the geometries of a GeoJSON or WKT file."""
    import shapely

    try:
        with file.open(encoding="utf-8-sig") as opened:
            text = opened.read(LARGEST_AREA)
        read = shapely.from_geojson if text.lstrip().startswith("{") else shapely.from_wkt
        # Features of a collection may have several parts
        parts: Geometries = shapely.get_parts(shapely.get_parts(read(text)))
        return parts
    except (OSError, ValueError, TypeError, shapely.errors.ShapelyError) as error:
        reason = shortened(reason_of(error), 200)
        raise CatalogError(str(file), f"cannot be read as GeoJSON or WKT: {reason}") from error


def counts_of(folder: Path, group: Group, classes: Mapping[str, float]) -> dict[str, int]:
    """
    Count the pairs of a group by risk class, those of its least class or worse, the worst first.

    Parameters
    ----------
    folder : Path
        Of results.
    group : Group
        Area and least class.
    classes : mapping
        Names of all classes, the worst first.

    Raises
    ------
    CatalogError
        If the table lacks a column, no pair of it is in the area or has the values, or the area
        cannot be read.
    """
    # Classes of a configuration are in the order of their thresholds
    names = [*classes][: [*classes].index(group.least_class) + 1]
    rows = _rows(folder, group, names)
    inside = _in_area(group, rows)
    # A wrong value or area would be silence for ever
    if not inside.any() and not _in_area(group, _rows(folder, group)).any():
        problem = "no pair of the risk table is in its area and has its values"
        raise CatalogError(f"notify.groups: {group.name}", problem)
    found = np.asarray(rows["risk_class"], dtype=str)[inside]
    counts = {name: int(np.count_nonzero(found == name)) for name in names}
    return {name: count for name, count in counts.items() if count}


def _in_area(group: Group, rows: Mapping[str, Any]) -> "NDArray[np.bool_]":
    """Return the pairs in the area of a group; one without a place is in no area."""
    east, north = (np.ma.filled(rows[name], np.nan) for name in ("longitude", "latitude"))
    if not group.area:
        return np.ones(len(east), dtype=bool)
    import shapely

    area = area_of(group.area)
    shapely.prepare(area)
    # Longitudes of an area across 180 degrees go on beyond it
    inside: NDArray[np.bool_] = np.isfinite(east)
    inside &= shapely.intersects_xy(area, east, north) | shapely.intersects_xy(
        area, east + 360.0, north
    )
    return inside


def _rows(folder: Path, group: Group, names: Sequence[str] = ()) -> dict[str, Any]:
    """Return places of the pairs that have the values of a group, and classes if some are asked."""
    files = [str(file) for file in table_files(folder)]
    query, values = "SELECT longitude, latitude FROM read_parquet(?) WHERE true", list[Any]([files])
    if names:
        query = query.replace(" FROM", ", risk_class FROM") + " AND list_contains(?, risk_class)"
        values.append(names)
    for name, value in group.where.items():
        # Any name is a column between quotation marks; a number is equal however it is written
        column = '"' + name.replace('"', '""') + '"'
        query += f" AND (CAST({column} AS VARCHAR) = ? OR (typeof({column}) <> 'VARCHAR'"
        query += f" AND TRY_CAST(CAST({column} AS VARCHAR) AS DOUBLE) = TRY_CAST(? AS DOUBLE)))"
        values += [value, value]
    try:
        with duckdb.connect() as database:
            return database.execute(query, values).fetchnumpy()
    except duckdb.BinderException as error:
        problem = f"the risk table has not all columns of {', '.join(group.where)}"
        raise CatalogError(f"notify.groups: {group.name}: where", problem) from error


def group_message(
    group: Group,
    name: str,
    counts: Mapping[str, int],
    earlier: Mapping[str, int],
    simulated: bool,
) -> Message | None:
    """
    Return the message to a group about its pairs, None if it has nothing new or nothing bad.

    Parameters
    ----------
    group : Group
        Name, threshold and language.
    name : str
        Of the run.
    counts : mapping
        Pairs by class, of :func:`counts_of`.
    earlier : mapping
        Counts of the latest message to the group, empty if there was none. A group that falls below
        its threshold is told so, once.
    simulated : bool
        Whether the ground motion is simulated.
    """
    is_told = sum(earlier.values()) >= group.least_count
    is_reached = sum(counts.values()) >= group.least_count
    if counts == earlier or not (is_reached or is_told):
        return None
    # What is new is in the title: it is all that a small screen shows
    texts = LANGUAGES[group.language]
    least = texts.get(f"class_{group.least_class}", group.least_class)
    facts = {"group": group.name, "least": least, "classes": _words(counts, texts)}
    facts["before"] = _words(earlier, texts)
    change = FIRST if not is_told else CHANGED if is_reached else BELOW
    # In the language of the group
    change, pairs, note = (
        in_context("message", text, group.language).format(**facts)
        for text in (change, PAIRS, NOTE)
    )
    title = f"{name}: {group.name}: {facts['classes']} ({change})"
    lines = [*([texts["simulated"]] if simulated else []), pairs, change, note]
    return Message("changed" if is_told else "first", title, "\n".join(lines), group=group)


def _words(counts: Mapping[str, int], texts: Mapping[str, str]) -> str:
    """Return pairs by class in words."""
    named = (f"{count} {texts.get(f'class_{name}', name)}" for name, count in counts.items())
    return ", ".join(named) or texts["alert_none"]
