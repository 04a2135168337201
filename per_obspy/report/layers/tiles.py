"""Layers of a GeoPackage as vector tiles: PMTiles, one file per layer, for maps on the web."""

from pathlib import Path

import pyarrow as pa
import pyogrio
import shapely

from per_obspy.files import written_whole
from per_obspy.inventory.footprints.gdal_paths import literal_path
from per_obspy.report.layers.geopackage import CRS, GEOMETRY

#: Layers that become tiles, with the columns that a map shows; pairs become points.
TILED = {
    "pairs": (
        *("pair_id", "rank", "risk_class", "state", "probability", "expected_impact_velocity"),
        *("configuration", "gap", "demand", "missing_gap", "flags"),
    ),
    "buildings": (
        *("building_id", "rank", "risk_class", "worst_pair", "pairs", "expected_impact_velocity"),
    ),
}

#: Zooms: a town on one tile, and single buildings.
ZOOMS = {"MINZOOM": "8", "MAXZOOM": "16"}


def tile_files(package: Path) -> dict[str, Path]:
    """Return the layers of a GeoPackage that become tiles, each with its file beside it."""
    with literal_path(package) as source:
        known = {str(name) for name, _ in pyogrio.list_layers(source)}
    return {
        layer: package.with_name(f"{package.stem}_{layer}.pmtiles")
        for layer in TILED
        if layer in known
    }


def write_tiles(package: Path, layer: str, path: Path) -> None:
    """
    Write a layer of a GeoPackage as vector tiles, whole or not at all.

    Parameters
    ----------
    package : Path
        GeoPackage of a screening.
    layer : str
        One of ``TILED``.
    path : Path
        ``.pmtiles``: EPSG:3857, shapes simplified by zoom.
    """
    # The columns that a map shows, as far as the layer has them
    with literal_path(package) as source:
        fields = pyogrio.read_info(source, layer)["fields"].tolist()
        names = [name for name in fields if name in TILED[layer]]
        facts, table = pyogrio.raw.read_arrow(source, layer=layer, columns=names)
    kind = facts["geometry_type"]
    # Lines of some metres vanish on a map of a town, points do not
    if layer == "pairs":
        places = shapely.centroid(shapely.from_wkb(table[GEOMETRY].to_numpy(zero_copy_only=False)))
        points = pa.array(shapely.to_wkb(places), pa.binary())
        table, kind = table.drop_columns(GEOMETRY).append_column(GEOMETRY, points), "Point"
    with written_whole(path) as part, literal_path(part) as place:
        pyogrio.raw.write_arrow(
            table,
            place,
            geometry_name=GEOMETRY,
            geometry_type=kind,
            crs=CRS,
            layer=layer,
            driver="PMTiles",
            dataset_options=ZOOMS,
        )
