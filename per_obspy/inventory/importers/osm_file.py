"""Extracts of OpenStreetMap, ``.osm`` and ``.osm.pbf``: the areas that are buildings, by GDAL."""

import warnings
from pathlib import Path
from typing import Any

import pandas as pd
import shapely

from per_obspy.errors import CatalogError
from per_obspy.files import unreadable_reason
from per_obspy.inventory.footprints.gdal_paths import literal_path
from per_obspy.inventory.importers.importer import RawLayer

#: Columns of GDAL's layer; further tags are in ``other_tags``.
_COLUMNS = ["osm_id", "osm_way_id", "name", "building", "other_tags"]

#: Beginning of GDAL's message for a file whose nodes are not in the order of their numbers.
_UNSORTED = "Non increasing node id"


def read_osm_file(file: Path, source: str) -> RawLayer:
    """
    Read the buildings of an extract.

    Parameters
    ----------
    file : Path
        ``.osm`` or ``.osm.pbf``. GDAL keeps nodes in a temporary file beyond 100 MB.
    source : str
        Name of the file, for messages.

    Raises
    ------
    CatalogError
        If the file cannot be read.
    """
    try:
        meta, geometries, fields = _areas(file)
    except (RuntimeError, ValueError, UnicodeDecodeError) as error:
        problem = unreadable_reason(file, "OpenStreetMap file", error)
        raise CatalogError(source, problem) from error
    attributes = pd.DataFrame(dict(zip(meta["fields"], fields, strict=True)))
    return RawLayer(shapely.from_wkb(geometries, on_invalid="ignore"), attributes, meta["crs"])


def _areas(file: Path) -> tuple[dict[str, Any], Any, Any]:
    """Return description, geometries and columns of the buildings of a file."""
    import pyogrio  # loads GDAL

    try:
        return _read(file)
    except pyogrio.errors.FeatureError as error:
        # The slower index takes nodes in any order
        if not str(error).startswith(_UNSORTED):
            raise
        return _read(file, USE_CUSTOM_INDEXING="NO")


def _read(file: Path, **options: str) -> tuple[dict[str, Any], Any, Any]:
    """Read the layer of areas with open options of GDAL."""
    import pyogrio

    with (
        warnings.catch_warnings(action="ignore", category=RuntimeWarning),
        literal_path(file) as path,
    ):
        meta, _, geometries, fields = pyogrio.raw.read(
            path,
            layer="multipolygons",
            columns=_COLUMNS,
            where="building IS NOT NULL",
            TAGS_FORMAT="JSON",
            **options,
        )
    return meta, geometries, fields
