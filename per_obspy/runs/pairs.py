"""Files with the pairs of a run: a given table, stored inventories, or simulated pairs."""

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
from per_obspy.inventory.files.writing import write_pairs
from per_obspy.runs.inputs.drawn_pairs import pair_table
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
