"""
Pairs of a run: a given table, stored inventories, or simulated pairs.

What later stages need of them is checked before the first record is read.
"""

from collections.abc import Sequence
from pathlib import Path

import numpy as np
import pandas as pd

from per_obspy.config import Pairs, Run, Simulation, load
from per_obspy.config.pairs import SimulatedPairs
from per_obspy.errors import CatalogError, did_you_mean
from per_obspy.inventory.catalogue import (
    find_inventories,
    region_around,
    stored_inventories,
    verified_file,
)
from per_obspy.inventory.files.formats import pair_file
from per_obspy.inventory.files.reading import checked_file
from per_obspy.inventory.files.writing import write_pairs
from per_obspy.records.shakemap import read_shakemap
from per_obspy.records.station_list import read_station_list
from per_obspy.report.page.background import require_background
from per_obspy.runs.inputs.drawn_pairs import pair_table
from per_obspy.runs.tasks.earlier_result import check_earlier
from per_obspy.runs.tasks.ground_files import StationFile
from per_obspy.screening.assignment import nearest_station
from per_obspy.simulation.buildings import simulated_pairs


def pair_files(settings: Run, folder: Path, stations: Sequence[StationFile]) -> list[Path]:
    """
    Return the files of the inventory.

    Parameters
    ----------
    settings : Run
        Settings of the run.
    folder : Path
        Of the results; simulated pairs are written there first.
    stations : sequence of StationFile
        Around them pairs are simulated, and stored inventories are found.

    Raises
    ------
    CatalogError
        If no stored inventory fits, one has changed, or there is no station around which to
        simulate.
    """
    pairs = settings.pairs
    if table := pair_table(settings, folder):
        return [table]
    # Everything else is found around the stations
    if not stations:
        raise CatalogError(
            "pairs", "no station has coordinates: pairs are neither found nor simulated around them"
        )
    if pairs and pairs.catalog:
        return _stored(pairs, pairs.catalog, stations, settings.screening.largest_distance)
    write_pairs(_simulated(pair_simulation(settings), stations), folder / "pairs.csv")
    return [folder / "pairs.csv"]


def check_inputs(settings: Run, folder: Path) -> None:
    """
    Check heads of pair table and background, inventories, area, earlier results, motions.

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
    require_background(settings.report.background)
    check_earlier(settings, folder)
    table = pair_table(settings, folder)
    if pairs and pairs.footprints and not pairs.footprints.file.is_file():
        raise CatalogError(str(pairs.footprints.file), "no such file")
    # Pairs of footprints may be yet to be found
    is_pending = bool(pairs and pairs.footprints and table and not table.is_file())
    if pairs and table and not is_pending:
        checked_file(table, pairs.form)
    if pairs and pairs.catalog and pairs.names:
        named_files(pairs.names, pairs.catalog)
    if settings.records and settings.records.shakemap:
        read_shakemap(settings.records.shakemap, settings.records.shakemap_uncertainty)
    if settings.records and settings.records.stationlist:
        read_station_list(settings.records.stationlist)
    # The column of the areas of the totals
    area = None if is_pending else settings.totals.area
    if area is not None and area not in _pair_columns(settings, folder):
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


def pair_simulation(settings: Run) -> SimulatedPairs:
    """Return the settings of simulated pairs, from the run or from its simulation."""
    if settings.pairs and settings.pairs.simulated:
        return settings.pairs.simulated
    assert settings.simulation is not None  # Run demands pairs or a simulation
    return load(settings.simulation, Simulation).pairs


def _stored(
    pairs: Pairs, catalog: Path, stations: Sequence[StationFile], reach: float
) -> list[Path]:
    """Return the files of stored inventories, by name or by region, each compared with its hash."""
    if pairs.names:
        return named_files(pairs.names, catalog)
    longitude = [station.longitude for station in stations]
    latitude = [station.latitude for station in stations]
    found = find_inventories(catalog, region_around(longitude, latitude, reach))
    if not found:
        raise CatalogError(str(catalog), "no stored inventory touches the region of the stations")
    return [verified_file(entry) for entry in found]


def named_files(names: Sequence[str], catalog: Path) -> list[Path]:
    """
    Return the files of stored inventories, each compared with its hash.

    Raises
    ------
    CatalogError
        If a name is not stored or a file has changed.
    """
    entries = {entry.name: entry for entry in stored_inventories(catalog)}
    unknown = [name for name in names if name not in entries]
    if unknown:
        reason = f"{unknown[0]!r} is not stored here{did_you_mean(unknown[0], entries)}"
        raise CatalogError(str(catalog), f"names: {reason}")
    return [verified_file(entries[name]) for name in names]


def _simulated(simulation: SimulatedPairs, stations: Sequence[StationFile]) -> pd.DataFrame:
    """Return simulated pairs, on the ground of the nearest station if its site class is known."""
    longitude = np.array([station.longitude for station in stations])
    latitude = np.array([station.latitude for station in stations])
    table = simulated_pairs(longitude, latitude, **simulation.model_dump())
    classes = np.array([station.site_class for station in stations], dtype=object)
    if not classes.any():
        return table
    # Buildings have the site class of the nearest station
    east, north = table["longitude_1"].to_numpy(), table["latitude_1"].to_numpy()
    nearest, _ = nearest_station(east, north, longitude, latitude)
    return table.assign(site_class=classes[nearest])
