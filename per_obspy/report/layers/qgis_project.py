"""Project of QGIS that opens the layers of a GeoPackage in the same folder, coloured."""

import zipfile
from collections.abc import Sequence
from pathlib import Path
from typing import NamedTuple
from xml.etree import ElementTree

from per_obspy.errors import printable
from per_obspy.files import written_whole
from per_obspy.report.layers.qgis_style import DOCTYPE, VERSION

#: Geometry of a layer as a project names it.
_GEOMETRIES = {
    "Point": "Point",
    "LineString": "Line",
    "Polygon": "Polygon",
    "MultiPolygon": "Polygon",
}

#: WGS 84 as projects describe it; the authority's name implies longitude and latitude.
_REFERENCE = {
    "proj4": "+proj=longlat +datum=WGS84 +no_defs",
    "srsid": "3452",
    "srid": "4326",
    "authid": "EPSG:4326",
    "description": "WGS 84",
    "projectionacronym": "longlat",
    "ellipsoidacronym": "EPSG:7030",
    "geographicflag": "true",
}


class ProjectLayer(NamedTuple):
    """
    A layer of the GeoPackage.

    Attributes
    ----------
    name : str
        Of the layer.
    geometry : str
        ``Point``, ``LineString``, ``Polygon`` or ``MultiPolygon``.
    style : str
        QML document.
    """

    name: str
    geometry: str
    style: str


def write_project(
    title: str,
    data: str,
    layers: Sequence[ProjectLayer],
    extent: tuple[float, float, float, float],
    path: Path,
) -> None:
    """
    Write a project, whole or not at all.

    Parameters
    ----------
    title : str
        Name of the run.
    data : str
        Name of the GeoPackage in the folder of the project: both can be moved together.
    layers : sequence of ProjectLayer
        The first is drawn on top.
    extent : tuple of float
        West, south, east, north of the first view, degrees.
    path : Path
        ``.qgz``.
    """
    root = ElementTree.Element("qgis", version=VERSION, projectname=printable(title))
    ElementTree.SubElement(root, "homePath", path="")
    ElementTree.SubElement(root, "title").text = printable(title)
    _add_reference(ElementTree.SubElement(root, "projectCrs"))
    tree = ElementTree.SubElement(root, "layer-tree-group")
    _add_view(root, extent)
    # Each layer is in the tree, among the described layers and in their order
    described = ElementTree.SubElement(root, "projectlayers")
    order = ElementTree.SubElement(root, "layerorder")
    for layer in layers:
        _add_layer(tree, described, order, layer, f"./{data}|layername={layer.name}")
    _add_properties(root)
    document = DOCTYPE + ElementTree.tostring(root, encoding="unicode")
    # The same project has the same bytes: entries of an archive have a fixed date
    entry = zipfile.ZipInfo(f"{path.stem}.qgs", (1980, 1, 1, 0, 0, 0))
    with written_whole(path) as part, zipfile.ZipFile(part, "w") as archive:
        archive.writestr(entry, document.encode(), zipfile.ZIP_DEFLATED)


def _add_properties(root: ElementTree.Element) -> None:
    """Set relative paths and the use of a coordinate reference system."""
    properties = ElementTree.SubElement(root, "properties")
    paths = ElementTree.SubElement(properties, "Paths")
    ElementTree.SubElement(paths, "Absolute", type="bool").text = "false"
    # Without this QGIS ignores the reference system of the project
    system = ElementTree.SubElement(properties, "SpatialRefSys")
    ElementTree.SubElement(system, "ProjectionsEnabled", type="int").text = "1"


def _add_view(root: ElementTree.Element, extent: tuple[float, float, float, float]) -> None:
    """Add the initial extent of the map."""
    view = ElementTree.SubElement(root, "mapcanvas", name="theMapCanvas", annotationsVisible="1")
    ElementTree.SubElement(view, "units").text = "degrees"
    corners = ElementTree.SubElement(view, "extent")
    # West, south, east, north
    for name, value in zip(("xmin", "ymin", "xmax", "ymax"), extent, strict=True):
        ElementTree.SubElement(corners, name).text = repr(float(value))
    _add_reference(ElementTree.SubElement(view, "destinationsrs"))


def _add_reference(parent: ElementTree.Element) -> None:
    """Add the coordinate reference system."""
    system = ElementTree.SubElement(parent, "spatialrefsys", nativeFormat="Wkt")
    for name, text in _REFERENCE.items():
        ElementTree.SubElement(system, name).text = text


def _add_layer(
    tree: ElementTree.Element,
    described: ElementTree.Element,
    order: ElementTree.Element,
    layer: ProjectLayer,
    source: str,
) -> None:
    """Add a layer to the tree, to the described layers with its style, and to their order."""
    identifier = f"per_obspy_{layer.name}"
    facts = {"id": identifier, "name": layer.name, "providerKey": "ogr", "source": source}
    ElementTree.SubElement(
        tree, "layer-tree-layer", facts | {"checked": "Qt::Checked", "expanded": "1"}
    )
    ElementTree.SubElement(order, "layer", id=identifier)
    facts = {"type": "vector", "geometry": _GEOMETRIES[layer.geometry]}
    element = ElementTree.SubElement(described, "maplayer", facts)
    ElementTree.SubElement(element, "id").text = identifier
    ElementTree.SubElement(element, "datasource").text = source
    ElementTree.SubElement(element, "layername").text = layer.name
    _add_reference(ElementTree.SubElement(element, "srs"))
    ElementTree.SubElement(element, "provider", encoding="UTF-8").text = "ogr"
    # Symbols and aliases as in the style
    style = ElementTree.fromstring(layer.style.removeprefix(DOCTYPE))
    element.extend(style)
