"""What later stages need is looked at before the first record is read, which may take hours."""

from per_obspy.config import Run
from per_obspy.inventory.checking import check_columns
from per_obspy.inventory.files.formats import pair_file
from per_obspy.pipeline.pairs import named_files
from per_obspy.records.shakemap import read_shakemap


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
