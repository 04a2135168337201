"""Checks of everything that later stages need, before the first record is read."""

from pathlib import Path

import numpy as np

from per_obspy.config import Run
from per_obspy.errors import CatalogError
from per_obspy.inventory.catalogue import stored_inventories
from per_obspy.inventory.files.formats import pair_file
from per_obspy.inventory.files.reading import checked_file
from per_obspy.records.shakemap import read_shakemap
from per_obspy.runs.inputs.drawn_pairs import pair_table
from per_obspy.runs.pairs import named_files, pair_simulation
from per_obspy.simulation.buildings import simulated_pairs


def check_inputs(settings: Run, folder: Path) -> None:
    """
    Check the head of the pair table, the named inventories, the area, and the whole ShakeMap.

    Parameters
    ----------
    settings : Run
        Settings of the run.
    folder : Path
        Of the results, where the pairs of footprints are.

    Raises
    ------
    CatalogError
        If one of them cannot be read or has changed, or the table lacks a column.
    """
    pairs = settings.pairs
    table = pair_table(settings, folder)
    if pairs and pairs.footprints and not pairs.footprints.file.is_file():
        raise CatalogError(str(pairs.footprints.file), "no such file")
    # Pairs of footprints may be yet to be found
    if pairs and table and not _is_pending(settings, table):
        checked_file(table, pairs.form)
    if pairs and pairs.catalog and pairs.names:
        named_files(pairs.names, pairs.catalog)
    if settings.records and settings.records.shakemap:
        read_shakemap(settings.records.shakemap, settings.records.shakemap_uncertainty)
    _check_area(settings, folder)


def _is_pending(settings: Run, table: Path) -> bool:
    """Return whether the pairs of footprints have not been found yet."""
    is_drawn = settings.pairs is not None and settings.pairs.footprints is not None
    return is_drawn and not table.is_file()


def _check_area(settings: Run, folder: Path) -> None:
    """Check that the pairs have the column of the areas of the totals."""
    area, table = settings.totals.area, pair_table(settings, folder)
    if table and _is_pending(settings, table):
        return
    if area is None or area in _pair_columns(settings, folder):
        return
    raise CatalogError("totals", f"area: the pair table has no column {area!r}")


def _pair_columns(settings: Run, folder: Path) -> set[str]:
    """Return the columns of the pairs; of several stored inventories those of any."""
    pairs = settings.pairs
    if pairs and (table := pair_table(settings, folder)):
        return set(pair_file(table, pairs.form).names)
    if pairs and pairs.catalog and pairs.names:
        files = named_files(pairs.names, pairs.catalog)
        return set.intersection(*(set(pair_file(file).names) for file in files))
    if pairs and pairs.catalog:
        # The region of the stations decides later which of them are taken
        stored = [entry.file for entry in stored_inventories(pairs.catalog)]
        columns = [set(pair_file(file).names) for file in stored if file.is_file()]
        return set[str]().union(*columns)
    # One simulated pair has the columns of all, and perhaps the site class of its station
    simulation = pair_simulation(settings).model_copy(update={"count": 1})
    simulated = simulated_pairs(np.zeros(1), np.zeros(1), **simulation.model_dump())
    return {*simulated.columns, "site_class"}
