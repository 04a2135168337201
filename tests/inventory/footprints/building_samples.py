"""
A town in the form of every source: files with the true structure, made after its description.

No line is copied from published data; the structures are those of:

* OpenStreetMap: GeoJSON of Overpass (wiki, "Overpass turbo/GeoJSON"), GeoParquet of QuackOSM
  (``feature_id``, map ``tags``), OSM XML (wiki, "OSM XML");
* Overture Maps: schema reference, theme buildings (``names``, ``sources``, ``bbox`` nested);
* Microsoft: README of microsoft/GlobalMLBuildingFootprints (lines of GeoJSON, also in .csv.gz);
* Google Open Buildings: "Data format" (CSV with WKT);
* PLATEAU: standard data product specification, CityGML 2.0 with EPSG:6697, latitude first;
* SimCenter: BRAILS inventories (GeoJSON with ``units``, CSV with ``Footprint``), R2D assets (AIM);
* GEM: OpenQuake exposure, GEM Building Taxonomy 2.0 and 3.x; NSI: API of the U.S. Army Corps.
"""

import gzip
import json
from collections.abc import Callable
from itertools import pairwise
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
import pandas as pd
import pyarrow as pa
import pyarrow.parquet
import pyogrio
import shapely

FOOT = 0.3048


class Town(NamedTuple):
    """Outlines in degrees, and of each building its name, height in m and storeys."""

    outlines: np.ndarray
    names: list[str]
    heights: list[float]
    storeys: list[int]


def small_town() -> Town:
    """Return four houses of 10 m by 12 m in a row, 0.05, 0.2 and 8 m apart, near 20 E, 10 N."""
    metre = 1.0 / 111_320.0
    starts = np.array([0.0, 10.05, 20.25, 38.25])
    west = 20.0 + starts * metre / np.cos(np.deg2rad(10.0))
    east = 20.0 + (starts + 10.0) * metre / np.cos(np.deg2rad(10.0))
    outlines = shapely.box(west, 10.0, east, 10.0 + 12.0 * metre)
    return Town(outlines, ["b1", "b2", "b3", "b4"], [12.0, 9.0, 6.0, 9.0], [4, 3, 2, 3])


def geometries(raw: Any) -> np.ndarray:
    """Return the geometries of a layer as its reader has it."""
    return shapely.from_wkb(raw.wkb.to_pylist())


def _geojson(geometry: Any) -> Any:
    return json.loads(shapely.to_geojson(geometry))


def _features(town: Town, properties: Callable[[int], dict]) -> list[dict]:
    return [
        {"type": "Feature", "properties": properties(i), "geometry": _geojson(outline)}
        for i, outline in enumerate(town.outlines)
    ]


def _collection(path: Path, features: list[dict], **members: Any) -> Path:
    content = {"type": "FeatureCollection", **members, "features": features}
    path.write_text(json.dumps(content))
    return path


def _parts(outline: Any) -> list[Any]:
    return list(shapely.get_parts(outline))


def osm_geojson(folder: Path, town: Town) -> Path:
    def properties(i: int) -> dict:
        levels = str(town.storeys[i])
        tags = {"building": "residential", "building:levels": levels}
        return {"@id": town.names[i], **tags, "height": f"{town.heights[i]} m"}

    return _collection(folder / "overpass.geojson", _features(town, properties))


def osm_xml(folder: Path, town: Town) -> Path:
    """Return a file of nodes and ways; holes are left out: they need relations."""
    nodes, ways = [], []
    for i, outline in enumerate(town.outlines):
        corners = shapely.get_coordinates(_parts(outline)[0].exterior)[:-1]
        first = len(nodes) + 1
        for x, y in corners:
            nodes.append(f'<node id="{len(nodes) + 1}" version="1" lat="{y:.7f}" lon="{x:.7f}"/>')
        references = [*range(first, first + len(corners)), first]
        tags = {"building": "yes", "height": f"{town.heights[i]}", "name": town.names[i]}
        tags["building:levels"] = f"{town.storeys[i]}"
        lines = [f'<nd ref="{node}"/>' for node in references]
        lines += [f'<tag k="{key}" v="{value}"/>' for key, value in tags.items()]
        ways.append(f'<way id="{1000 + i}" version="1">{"".join(lines)}</way>')
    path = folder / "town.osm"
    text = "\n".join([*nodes, *ways])
    path.write_text(
        f"<?xml version='1.0' encoding='UTF-8'?>\n<osm version=\"0.6\">\n{text}\n</osm>"
    )
    return path


def _geoparquet(path: Path, table: pa.Table, town: Town) -> Path:
    geometry = pa.array(shapely.to_wkb(town.outlines).tolist(), pa.binary())
    described = {"encoding": "WKB", "geometry_types": ["Polygon", "MultiPolygon"]}
    geo = {"version": "1.1.0", "primary_column": "geometry", "columns": {"geometry": described}}
    full = table.append_column("geometry", geometry)
    pa.parquet.write_table(full.replace_schema_metadata({"geo": json.dumps(geo)}), path)
    return path


def osm_geoparquet(folder: Path, town: Town) -> Path:
    tags = [
        [("building", "yes"), ("height", str(height)), ("building:levels", str(storeys))]
        for height, storeys in zip(town.heights, town.storeys, strict=True)
    ]
    columns = {"feature_id": town.names, "tags": pa.array(tags, pa.map_(pa.string(), pa.string()))}
    return _geoparquet(folder / "quackosm.parquet", pa.table(columns), town)


def overture(folder: Path, town: Town) -> Path:
    boxes = [
        dict(zip(("xmin", "ymin", "xmax", "ymax"), bounds, strict=True))
        for bounds in shapely.bounds(town.outlines).tolist()
    ]
    source = {"property": "", "dataset": "OpenStreetMap", "record_id": "w1@1", "confidence": None}
    names = {"primary": "House", "common": None, "rules": None}
    count = len(town.names)
    columns = {
        "id": town.names,
        "bbox": pa.array(boxes),
        "version": [1] * count,
        "sources": pa.array([[source]] * count),
        "subtype": ["residential"] * count,
        "class": ["apartments"] * count,
        "height": town.heights,
        "names": pa.array([names, *([None] * (count - 1))]),
        "is_underground": [False] * count,
        "num_floors": pa.array(town.storeys, pa.int32()),
    }
    return _geoparquet(folder / "overture.parquet", pa.table(columns), town)


def _microsoft_lines(town: Town) -> str:
    features = _features(town, lambda i: {"height": town.heights[i], "confidence": -1.0})
    return "".join(f"{json.dumps(feature)}\n" for feature in features)


def microsoft(folder: Path, town: Town) -> Path:
    path = folder / "microsoft.geojsonl"
    path.write_text(_microsoft_lines(town))
    return path


def microsoft_packed(folder: Path, town: Town) -> Path:
    path = folder / "microsoft.csv.gz"
    path.write_bytes(gzip.compress(_microsoft_lines(town).encode()))
    return path


def google(folder: Path, town: Town) -> Path:
    centres = shapely.get_coordinates(shapely.centroid(town.outlines))
    table = pd.DataFrame(
        {
            "latitude": centres[:, 1],
            "longitude": centres[:, 0],
            "area_in_meters": 120.0,
            "confidence": 0.8312,
            "geometry": shapely.to_wkt(town.outlines, rounding_precision=15),
            "full_plus_code": town.names,
            "building_height": town.heights,
        }
    )
    path = folder / "google.csv"
    table.to_csv(path, index=False)
    return path


_NAMESPACES = (
    'xmlns:core="http://www.opengis.net/citygml/2.0" '
    'xmlns:bldg="http://www.opengis.net/citygml/building/2.0" '
    'xmlns:gml="http://www.opengis.net/gml" '
    'xmlns:uro="https://www.geospatial.jp/iur/uro/3.1" '
    'xmlns:xAL="urn:oasis:names:tc:ciq:xsdschema:xAL:2.0"'
)


def _gml_ring(ring: Any, elevation: float) -> str:
    # latitude first, as EPSG:6697 has it
    corners = (f"{y!r} {x!r} {elevation}" for x, y in shapely.get_coordinates(ring).tolist())
    return f"<gml:LinearRing><gml:posList>{' '.join(corners)}</gml:posList></gml:LinearRing>"


def gml_polygon(polygon: Any, elevation: float) -> str:
    holes = "".join(
        f"<gml:interior>{_gml_ring(ring, elevation)}</gml:interior>" for ring in polygon.interiors
    )
    shell = f"<gml:exterior>{_gml_ring(polygon.exterior, elevation)}</gml:exterior>"
    return f"<gml:surfaceMember><gml:Polygon>{shell}{holes}</gml:Polygon></gml:surfaceMember>"


def gml_walls(polygon: Any, low: float, high: float) -> str:
    corners = shapely.get_coordinates(polygon.exterior).tolist()
    text = ""
    for (x0, y0), (x1, y1) in pairwise(corners):
        places = [(y0, x0, low), (y1, x1, low), (y1, x1, high), (y0, x0, high), (y0, x0, low)]
        numbers = " ".join(f"{value!r}" for place in places for value in place)
        ring = f"<gml:LinearRing><gml:posList>{numbers}</gml:posList></gml:LinearRing>"
        exterior = f"<gml:exterior>{ring}</gml:exterior>"
        text += f"<gml:surfaceMember><gml:Polygon>{exterior}</gml:Polygon></gml:surfaceMember>"
    return text


def gml_document(buildings: str, crs: str = "http://www.opengis.net/def/crs/EPSG/0/6697") -> str:
    envelope = f'<gml:boundedBy><gml:Envelope srsName="{crs}" srsDimension="3"/></gml:boundedBy>'
    head = '<?xml version="1.0" encoding="UTF-8"?>\n'
    return f"{head}<core:CityModel {_NAMESPACES}>{envelope}{buildings}</core:CityModel>"


def gml_building(name: str, height: float, storeys: int, surfaces: str) -> str:
    return (
        f'<core:cityObjectMember><bldg:Building gml:id="{name}"><bldg:usage>411</bldg:usage>'
        f'<bldg:measuredHeight uom="m">{height}</bldg:measuredHeight>'
        f"<bldg:storeysAboveGround>{storeys}</bldg:storeysAboveGround>{surfaces}"
        "<bldg:address><core:Address><core:xalAddress><xAL:AddressDetails><xAL:Locality>"
        "<xAL:LocalityName>丁目</xAL:LocalityName></xAL:Locality></xAL:AddressDetails>"
        "</core:xalAddress></core:Address></bldg:address>"
        "<uro:buildingDetailAttribute><uro:BuildingDetailAttribute>"
        "<uro:buildingStructureType>603</uro:buildingStructureType>"
        "</uro:BuildingDetailAttribute></uro:buildingDetailAttribute>"
        "</bldg:Building></core:cityObjectMember>"
    )


def _gml_lod0(outline: Any, height: float) -> str:
    surface = "".join(gml_polygon(part, height) for part in _parts(outline))
    multi = f"<gml:MultiSurface>{surface}</gml:MultiSurface>"
    return f"<bldg:lod0RoofEdge>{multi}</bldg:lod0RoofEdge>"


def _gml_lod1(outline: Any, height: float) -> str:
    high = 3.0 + height
    surfaces = "".join(
        gml_polygon(part, 3.0) + gml_polygon(part, high) + gml_walls(part, 3.0, high)
        for part in _parts(outline)
    )
    shell = f"<gml:CompositeSurface>{surfaces}</gml:CompositeSurface>"
    solid = f"<gml:Solid><gml:exterior>{shell}</gml:exterior></gml:Solid>"
    return f"<bldg:lod1Solid>{solid}</bldg:lod1Solid>"


def _plateau(path: Path, town: Town, surfaces: Callable[[Any, float], str]) -> Path:
    rows = zip(town.names, town.heights, town.storeys, town.outlines, strict=True)
    buildings = (
        gml_building(name, height, storeys, surfaces(outline, height))
        for name, height, storeys, outline in rows
    )
    path.write_text(gml_document("".join(buildings)), encoding="utf-8")
    return path


def plateau_lod0(folder: Path, town: Town) -> Path:
    return _plateau(folder / "50303500_bldg_6697_op.gml", town, _gml_lod0)


def plateau_lod1(folder: Path, town: Town) -> Path:
    return _plateau(folder / "50303501_bldg_6697_op.gml", town, _gml_lod1)


def _general(town: Town, i: int) -> dict:
    return {
        "NumberOfStories": town.storeys[i],
        "YearBuilt": 1960,
        "PlanArea": 1290.0,
        "StructureType": "C1",
        "OccupancyClass": "RES3",
        "Height": town.heights[i] / FOOT,
    }


def brails_geojson(folder: Path, town: Town) -> Path:
    def properties(i: int) -> dict:
        return {"type": "Building", "id": town.names[i], **_general(town, i)}

    crs = {"type": "name", "properties": {"name": "urn:ogc:def:crs:OGC:1.3:CRS84"}}
    members = {"brails_version": "4.0", "crs": crs, "units": {"length": "ft"}}
    return _collection(folder / "brails.geojson", _features(town, properties), **members)


def r2d_assets(folder: Path, town: Town) -> Path:
    assets = []
    for i, outline in enumerate(town.outlines):
        x, y = shapely.get_coordinates(shapely.centroid(outline))[0].tolist()
        footprint = {"type": "Feature", "geometry": _geojson(outline), "properties": {}}
        general = {
            "AIM_id": town.names[i],
            "location": {"latitude": y, "longitude": x},
            "Latitude": y,
            "Longitude": x,
            **_general(town, i),
            "Footprint": json.dumps(footprint),
            "units": {"force": "kips", "length": "ft", "time": "sec"},
        }
        assets.append({"RandomVariables": [], "GeneralInformation": general})
    path = folder / "r2d.json"
    path.write_text(json.dumps(assets))
    return path


def simcenter_csv(folder: Path, town: Town) -> Path:
    rows = []
    for i, outline in enumerate(town.outlines):
        x, y = shapely.get_coordinates(shapely.centroid(outline))[0].tolist()
        general = _general(town, i)
        del general["Height"]  # the file names no unit
        place = {"Longitude": x, "Latitude": y}
        footprint = json.dumps(_geojson(outline))
        rows.append({"id": town.names[i], **place, **general, "Footprint": footprint})
    path = folder / "simcenter.csv"
    pd.DataFrame(rows).to_csv(path, index=False)
    return path


def gem(folder: Path, town: Town) -> Path:
    path = folder / "gem.gpkg"
    texts = [f"CR+CIP/LFM+DUC/H:{storeys}/BP2" for storeys in town.storeys]
    kinds = ["MultiPolygon", "Polygon"]
    multi = np.isin("MultiPolygon", shapely.get_type_id(town.outlines)) or any(
        outline.geom_type == kinds[0] for outline in town.outlines
    )
    pyogrio.raw.write(
        path,
        geometry=shapely.to_wkb(town.outlines),
        field_data=[np.array(town.names, dtype=object), np.array(texts, dtype=object)],
        fields=["id", "taxonomy"],
        geometry_type=kinds[0] if multi else kinds[1],
        crs="EPSG:4326",
        promote_to_multi=bool(multi),
    )
    return path


def gem_points(folder: Path, town: Town) -> Path:
    centres = shapely.get_coordinates(shapely.centroid(town.outlines))
    table = pd.DataFrame({"id": town.names, "lon": centres[:, 0], "lat": centres[:, 1]})
    table["taxonomy"] = "MUR+CLBRS/LWAL/HBET:3-1"
    table["number"], table["night"] = 1, 4
    path = folder / "exposure.csv"
    table.to_csv(path, index=False)
    return path


def nsi(folder: Path, town: Town) -> Path:
    features = []
    for i, outline in enumerate(town.outlines):
        place = _geojson(shapely.centroid(outline))
        facts = {"fd_id": 500 + i, "occtype": "RES1-2SNB", "bldgtype": "W", "found_ht": 0.5}
        facts |= {"sqft": 1290.0, "num_story": town.storeys[i], "pop2amu65": 2, "pop2amo65": 1}
        features.append({"type": "Feature", "properties": facts, "geometry": place})
    return _collection(folder / "nsi.json", features)


#: Sources with outlines: name -> source as it is recognised, and writer.
OUTLINES: dict[str, tuple[str, Callable[[Path, Town], Path]]] = {
    "osm_geojson": ("OpenStreetMap", osm_geojson),
    "osm_xml": ("OpenStreetMap", osm_xml),
    "osm_geoparquet": ("OpenStreetMap", osm_geoparquet),
    "overture": ("Overture Maps", overture),
    "microsoft": ("Microsoft building footprints", microsoft),
    "microsoft_packed": ("Microsoft building footprints", microsoft_packed),
    "google": ("Google Open Buildings", google),
    "plateau_lod0": ("CityGML", plateau_lod0),
    "plateau_lod1": ("CityGML", plateau_lod1),
    "brails_geojson": ("SimCenter", brails_geojson),
    "r2d_assets": ("SimCenter", r2d_assets),
    "simcenter_csv": ("SimCenter", simcenter_csv),
    "gem": ("GEM exposure", gem),
}

#: Sources of points.
POINTS: dict[str, tuple[str, Callable[[Path, Town], Path]]] = {
    "gem_points": ("GEM exposure", gem_points),
    "nsi": ("National Structure Inventory", nsi),
}
