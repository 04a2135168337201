"""
Buildings in CityGML 1.0 and 2.0, LOD 0 to 2: outlines, heights, storeys, use and address.

The file is read building by building. Entities are not resolved, no URL is fetched, a document
with a type definition is refused, and the limits of libxml2 on depth and text hold.

Source: OGC 12-019, City Geography Markup Language 2.0; OGC 08-038r7 on the order of axes.
"""

import re
from collections.abc import Iterator
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
import pandas as pd
import pyproj
import shapely
from lxml import etree

from per_obspy.errors import CatalogError
from per_obspy.inventory.importers.importer import RawLayer

#: Namespaces of buildings; version 3.0 is another model.
_BUILDINGS = tuple(f"{{http://www.opengis.net/citygml/building/{each}}}" for each in ("2.0", "1.0"))
_VERSION_3 = "{http://www.opengis.net/citygml/building/3.0}Building"

#: Elements of outlines in the order of preference: walls at the ground, then the edge of the roof.
OUTLINES = ("lod0FootPrint", "lod0RoofEdge", "GroundSurface", "lod1Solid", "lod1MultiSurface")

#: Name of an official reference system; one of the short form has the older order, east first.
_EPSG = re.compile(r"EPSG(?:/[0-9.]*/|:[0-9.]*:|:)(?P<code>[0-9]{4,6})")

#: Units of heights in m.
_UNITS = {"": 1.0, "m": 1.0, "metre": 1.0, "meter": 1.0, "ft": 0.3048}

#: Most numbers of one ring.
_MOST_NUMBERS = 300_000

#: Least area of a surface from above over the square of its circumference: walls have rounding
#: errors only, and a passage of 1 m by 1 km has 2.5e-4.
_FLAT = 1e-6


class _Building(NamedTuple):
    """Outline in the coordinates of the file, kind of the outline, attributes."""

    outline: Any
    cells: dict[str, object]
    fault: str


def read_citygml(file: Path, source: str) -> RawLayer:
    """
    Read the buildings of a city model.

    Parameters
    ----------
    file : Path
        CityGML 1.0 or 2.0.
    source : str
        Name of the file, for messages.

    Raises
    ------
    CatalogError
        If the file is no such document, has a type definition, no buildings, or no reference
        system.
    """
    systems = list[str]()
    try:
        buildings = [_building(element) for element in _elements(file, source, systems)]
    except (etree.XMLSyntaxError, UnicodeDecodeError) as error:
        raise CatalogError(source, f"not a CityGML file: {str(error)[:200]}") from error
    if not buildings:
        raise CatalogError(source, "not a CityGML file: no bldg:Building of 1.0 or 2.0")
    # Coordinates east first
    crs, is_north_first = _reference_system(systems, source)
    shapes = np.array([building.outline for building in buildings], dtype=object)
    if is_north_first:
        shapes = shapely.transform(shapes, np.fliplr)
    faults = {row: building.fault for row, building in enumerate(buildings) if building.fault}
    table = pd.DataFrame([building.cells for building in buildings], dtype=object)
    return RawLayer(shapes, table.infer_objects(), crs, faults)


def _elements(file: Path, source: str, systems: list[str]) -> Iterator[Any]:
    """Yield the buildings of a document, and add the names of its reference systems."""
    tags = [f"{space}Building" for space in _BUILDINGS]
    wanted = (*tags, _VERSION_3, "{*}Envelope")
    with file.open("rb") as opened:
        # No entity, no address, no unlimited text
        parser = etree.iterparse(
            opened,
            events=("start", "end"),
            tag=wanted,
            resolve_entities=False,
            load_dtd=False,
            no_network=True,
            huge_tree=False,
        )
        for event, element in parser:
            if element.getroottree().docinfo.internalDTD is not None:
                raise CatalogError(source, "a document type definition is not allowed")
            if element.tag == _VERSION_3:
                raise CatalogError(source, "CityGML 3.0 is not read, 1.0 and 2.0 are")
            if event == "start":
                systems.extend(filter(None, [element.get("srsName")]))
            elif element.tag in tags:
                yield element
                _forget(element)


def _forget(element: Any) -> None:
    """Free the memory of a building and of all elements before it."""
    element.clear()
    member = element.getparent()
    while member is not None and member.getprevious() is not None:
        del member.getparent()[0]


def _reference_system(names: list[str], source: str) -> tuple[pyproj.CRS, bool]:
    """Return the horizontal reference system of a document, and whether north comes first."""
    if not names:
        raise CatalogError(source, "no coordinate reference system: no gml:Envelope has srsName")
    name = names[0]
    if other := next((each for each in names if each != name), None):
        raise CatalogError(source, f"two reference systems, {name:.60} and {other:.60}")
    # Official names, and others that the library of projections knows
    found = _EPSG.search(name)
    try:
        crs = (
            pyproj.CRS.from_epsg(int(found["code"])) if found else pyproj.CRS.from_user_input(name)
        )
    except pyproj.exceptions.CRSError as error:
        problem = f"unknown coordinate reference system {name!r:.80}"
        raise CatalogError(source, problem) from error
    # Heights use a separate reference system
    horizontal = crs.sub_crs_list[0] if crs.is_compound else crs.to_2d()
    is_short = name.upper().startswith("EPSG:")
    directions = [axis.direction for axis in horizontal.axis_info]
    return horizontal, not is_short and directions[:1] == ["north"]


def _building(element: Any) -> _Building:
    """Return a building of the document."""
    cells, fault = _attributes(element)
    # Outline of the building or of its parts
    try:
        outline, cells["outline"] = _outline(element)
    except (ValueError, shapely.errors.GEOSException) as error:
        return _Building(None, cells | {"outline": None}, fault or f"outline: {str(error)[:80]}")
    return _Building(outline, cells, fault)


def _attributes(element: Any) -> tuple[dict[str, object], str]:
    """Return the attributes of a building, and the fault of its unit of height if there is one."""
    space = etree.QName(element).namespace
    height, unit = _text(element, space, "measuredHeight")
    # Units may be names in a dictionary, such as urn:ogc:def:uom:UCUM::m or #m
    factor = _UNITS.get(unit.lower().rpartition("#")[2].rpartition(":")[2])
    cells: dict[str, object] = {
        "id": next(iter(element.xpath("@*[local-name()='id']")), None),
        "measuredHeight": _number(height, factor or 1.0),
        "storeysAboveGround": _number(_text(element, space, "storeysAboveGround")[0], 1.0),
        "usage": _text(element, space, "usage")[0],
        "structure_type": _anywhere(element, "buildingStructureType"),
        "address": _anywhere(element, "LocalityName"),
    }
    return cells, "" if factor else f"measuredHeight has the unit {unit!r:.40}, expected m"


def _text(element: Any, space: str, name: str) -> tuple[str | None, str]:
    """Return the text of a child, of parts where the building itself has none, and its unit."""
    found = element.find(f"{{{space}}}{name}")
    if found is None:
        found = element.find(f"{{{space}}}consistsOfBuildingPart//{{{space}}}{name}")
    if found is None:
        return None, ""
    return (found.text or "").strip()[:200] or None, found.get("uom") or ""


def _number(text: str | None, factor: float) -> object:
    """Return a number in m, or the text if it is none."""
    try:
        return None if text is None else float(text) * factor
    except ValueError:
        return text


def _anywhere(element: Any, name: str) -> str | None:
    """Return the text of the first element of a name below the building."""
    found = next(element.iter(f"{{*}}{name}"), None)
    return None if found is None else (found.text or "").strip()[:200] or None


def _outline(element: Any) -> tuple[Any, str | None]:
    """
    Return the outline of a building and the element from which it comes, None if it has none.

    Raises
    ------
    ValueError
        If its coordinates are no numbers.
    """
    for name in OUTLINES:
        tops = element.iter(f"{{*}}{name}")
        rings = [_polygon(each) for top in tops for each in top.iter("{*}Polygon")]
        # Walls of a block are lines from above
        flat = [ring for ring in rings if ring is not None and ring.area > _FLAT * ring.length**2]
        if flat:
            return (flat[0] if len(flat) == 1 else shapely.union_all(flat)), name
    return None, None


def _polygon(element: Any) -> Any:
    """Return a polygon as seen from above, None if it has no exterior ring."""
    shells = [_ring(each) for each in element.findall("{*}exterior")]
    if not shells or len(shells[0]) < 4:
        return None
    holes = [ring for each in element.findall("{*}interior") if len(ring := _ring(each)) >= 4]
    return shapely.Polygon(shells[0], holes)


def _ring(element: Any) -> Any:
    """Return the first two coordinates of the corners of a ring."""
    lists = [each.text or "" for each in element.iter("{*}posList")]
    lists += [each.text or "" for each in element.iter("{*}pos")]
    numbers = np.array(" ".join(lists).split()[: _MOST_NUMBERS + 1], dtype=np.float64)
    if numbers.size > _MOST_NUMBERS:
        raise ValueError(f"a ring has more than {_MOST_NUMBERS} numbers")
    # Corners of two or three numbers
    if not np.isfinite(numbers).all():
        raise ValueError("a coordinate is not finite")
    dimension = _dimension(element)
    if numbers.size % dimension:
        raise ValueError(f"{numbers.size} numbers are not a multiple of {dimension}")
    return numbers.reshape(-1, dimension)[:, :2]


def _dimension(element: Any) -> int:
    """Return the numbers per corner: 2 if the nearest declaration gives 2 dimensions, else 3."""
    declared = next(element.iterfind(".//{*}posList[@srsDimension]"), None)
    if declared is not None:
        return 2 if declared.get("srsDimension") == "2" else 3
    for above in element.iterancestors():
        if above.get("srsDimension"):
            return 2 if above.get("srsDimension") == "2" else 3
    return 3
