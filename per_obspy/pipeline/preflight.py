"""Checks of everything that later stages need, before the first record is read."""

from per_obspy.config import Run
from per_obspy.errors import require_extra
from per_obspy.inventory.checking import check_columns
from per_obspy.inventory.files.formats import pair_file
from per_obspy.pipeline.pairs import named_files
from per_obspy.records.shakemap import read_shakemap


def require_extras(settings: Run) -> None:
    """
    Check that the optional libraries of a run are installed, before anything is computed.

    Raises
    ------
    MissingExtra
        If one is not.
    """
    if settings.geopackage:
        require_extra("gis", "pyogrio", "shapely")
    if settings.totals.h3 is not None:
        require_extra("gis", "h3")


def check_inputs(settings: Run) -> None:
    """
    Check the head of the pair table, the inventories that are named, and the whole ShakeMap.

    Raises
    ------
    CatalogError
        If one of them cannot be read or has changed, or the table lacks a column.
    """
    pairs = settings.pairs
    if pairs and pairs.file:
        check_columns(pair_file(pairs.file).names, str(pairs.file))
    if pairs and pairs.catalog and pairs.names:
        named_files(pairs.names, pairs.catalog)
    if settings.records and settings.records.shakemap:
        read_shakemap(settings.records.shakemap, settings.records.shakemap_uncertainty)
