"""
Buildings in CityGML 1.0 and 2.0, LOD 0 to 2: outlines, heights, storeys, use and address.

The file is read building by building. Entities are not resolved, no URL is fetched, a document
with a type definition is refused, and the limits of libxml2 on depth and text hold.

Source: OGC 12-019, City Geography Markup Language 2.0; OGC 08-038r7 on the order of axes.
"""

import re
from collections.abc import Iterator
from contextlib import suppress
from pathlib import Path
from typing import Any

import numpy as np
import pyproj
import shapely
from lxml import etree

from per_obspy.errors import CatalogError
from per_obspy.inventory.footprints.raw_layer import RawLayer, cell_table, features

#: Namespaces of buildings; version 3.0 is another model.
_MODEL = "{{http://www.opengis.net/citygml/building/{}}}Building"
_BUILDINGS, _VERSION_3 = (_MODEL.format("2.0"), _MODEL.format("1.0")), _MODEL.format("3.0")

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


def read_citygml(file: Path, source: str) -> RawLayer:
    """
    Read the buildings of a city model; messages name its source.

    Raises
    ------
    CatalogError
        If the file is no such document, has a type definition, no buildings, or no reference
        system.
    """
    systems, rows = list[str](), list[dict[str, object]]()
    outlines, faults = list[Any](), dict[int, str]()
    try:
        for element in _buildings(file, source, systems):
            cells, fault = _attributes(element)
            outline, cells["outline"], wrong = _outline(element)
            # A building with a fault loses its outline only
            if fault or wrong:
                faults[len(rows)] = fault or wrong
            outlines.append(outline)
            rows.append(cells)
    except (etree.XMLSyntaxError, UnicodeDecodeError) as error:
        raise CatalogError(source, f"not a CityGML file: {str(error)[:200]}") from error
    if not rows:
        raise CatalogError(source, "not a CityGML file: no bldg:Building of 1.0 or 2.0")
    # Coordinates east first
    crs, is_north_first = _reference_system(systems, source)
    shapes = np.array(outlines, dtype=object)
    if is_north_first:
        shapes = shapely.transform(shapes, np.fliplr)
    return features(shapes, cell_table(rows), crs, faults)


def _buildings(file: Path, source: str, systems: list[str]) -> Iterator[Any]:
    """Yield the buildings of a document, and add the names of its reference systems."""
    # No entity, no address, no unlimited text
    safe = {"resolve_entities": False, "load_dtd": False, "no_network": True, "huge_tree": False}
    tags, events = (*_BUILDINGS, _VERSION_3, "{*}Envelope"), ("start", "end")
    with file.open("rb") as opened:
        for event, element in etree.iterparse(opened, events=events, tag=tags, **safe):
            if element.getroottree().docinfo.internalDTD is not None:
                raise CatalogError(source, "a document type definition is not allowed")
            if element.tag == _VERSION_3:
                raise CatalogError(source, "CityGML 3.0 is not read, 1.0 and 2.0 are")
            if event == "start":
                systems.extend(filter(None, [element.get("srsName")]))
            elif element.tag in _BUILDINGS:
                yield element
                # Free the memory of the building and of all elements before it
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
    official = _EPSG.search(name)
    try:
        crs = pyproj.CRS.from_user_input(int(official["code"]) if official else name)
    except pyproj.exceptions.CRSError as error:
        problem = f"unknown coordinate reference system {name!r:.80}"
        raise CatalogError(source, problem) from error
    # Heights use a separate reference system
    horizontal = crs.sub_crs_list[0] if crs.is_compound else crs.to_2d()
    directions = [axis.direction for axis in horizontal.axis_info]
    return horizontal, not name.upper().startswith("EPSG:") and directions[:1] == ["north"]


def _attributes(element: Any) -> tuple[dict[str, object], str]:
    """Return the attributes of a building, and the fault of its unit of height if there is one."""
    children = _children(element)
    cells: dict[str, Any] = {"id": next(iter(element.xpath("@*[local-name()='id']")), None)}
    for name, child in children.items():
        cells[name] = None if child is None else (child.text or "").strip()[:200] or None
    # Units may be names in a dictionary, such as urn:ogc:def:uom:UCUM::m or #m
    height = children["measuredHeight"]
    unit = "" if height is None else height.get("uom") or ""
    factor = _UNITS.get(unit.lower().rpartition("#")[2].rpartition(":")[2])
    for name, scale in (("measuredHeight", factor or 1.0), ("storeysAboveGround", 1.0)):
        # A text that is no number stays as it is
        with suppress(ValueError, TypeError):
            cells[name] = float(cells[name]) * scale
    return cells, "" if factor else f"measuredHeight has the unit {unit!r:.40}, expected m"


def _children(element: Any) -> dict[str, Any]:
    """Return the elements of a building's attributes, None where it has none."""
    space, children = f"{{{etree.QName(element).namespace}}}", dict[str, Any]()
    # Of the building, or of parts where it has none; then those of any place
    for name in ("measuredHeight", "storeysAboveGround", "usage"):
        children[name] = element.find(f"{space}{name}")
        if children[name] is None:
            children[name] = element.find(f"{space}consistsOfBuildingPart//{space}{name}")
    for name, tag in (("structure_type", "buildingStructureType"), ("address", "LocalityName")):
        children[name] = next(element.iter(f"{{*}}{tag}"), None)
    return children


def _outline(element: Any) -> tuple[Any, str | None, str]:
    """Return the outline of a building or its parts, the element that gives it, and its fault."""
    try:
        for name in OUTLINES:
            tops = element.iter(f"{{*}}{name}")
            shapes = [_polygon(each) for top in tops for each in top.iter("{*}Polygon")]
            # Walls of a block are lines from above
            flat = [shape for shape in shapes if shape.area > _FLAT * shape.length**2]
            if flat:
                return flat[0] if len(flat) == 1 else shapely.union_all(flat), name, ""
    except (ValueError, shapely.errors.GEOSException) as error:
        return None, None, f"outline: {str(error)[:80]}"
    return None, None, ""


def _polygon(element: Any) -> shapely.Polygon:
    """Return a polygon as seen from above, empty if it has no exterior ring."""
    shell, *_ = [*map(_ring, element.findall("{*}exterior")), ()]
    holes = [ring for ring in map(_ring, element.findall("{*}interior")) if len(ring) >= 4]
    return shapely.Polygon(shell, holes) if len(shell) >= 4 else shapely.Polygon()


def _ring(element: Any) -> Any:
    """Return the first two coordinates of the corners of a ring."""
    # Numbers as text
    lists = [*element.iter("{*}posList"), *element.iter("{*}pos")]
    texts = " ".join(each.text or "" for each in lists).split()
    numbers = np.array(texts[: _MOST_NUMBERS + 1], dtype=np.float64)
    if numbers.size > _MOST_NUMBERS:
        raise ValueError(f"a ring has more than {_MOST_NUMBERS} numbers")
    if not np.isfinite(numbers).all():
        raise ValueError("a coordinate is not finite")
    # Corners of two numbers where the nearest declaration says so, else of three
    own = element.iterfind(".//{*}posList[@srsDimension]")
    above = (each for each in element.iterancestors() if each.get("srsDimension"))
    declared = next(own, next(above, None))
    dimension = 2 if declared is not None and declared.get("srsDimension") == "2" else 3
    if numbers.size % dimension:
        raise ValueError(f"{numbers.size} numbers are not a multiple of {dimension}")
    return numbers.reshape(-1, dimension)[:, :2]
