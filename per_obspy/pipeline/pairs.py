"""Which files hold the pairs of a run: a given table, stored inventories, or simulated pairs written first."""

from collections.abc import Sequence
from pathlib import Path

import numpy as np
import pandas as pd

from per_obspy.config import Pairs, Run, Simulation, load
from per_obspy.config.simulation import SimulatedPairs
from per_obspy.errors import CatalogError, did_you_mean
from per_obspy.files import written_whole
from per_obspy.inventory.catalogue import (
    find_inventories,
    region_around,
    stored_inventories,
    verified_file,
)
from per_obspy.inventory.simulated import simulated_pairs
from per_obspy.jobs.chunk import StationFile
from per_obspy.screening.ground_motion.assignment import nearest_station


def pair_files(settings: Run, folder: Path, stations: Sequence[StationFile]) -> list[Path]:
    """
    Return the files of the inventory.

    Parameters
    ----------
    settings : Run
        What to do.
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
    if pairs and pairs.file:
        return [pairs.file]
    if not stations:
        raise CatalogError(
            "pairs", "no station has coordinates: pairs are neither found nor simulated around them"
        )
    if pairs and pairs.catalog:
        return _stored(pairs, pairs.catalog, stations, settings.screening.largest_distance)
    with written_whole(folder / "pairs.csv") as part:
        _simulated(_wanted(settings), stations).to_csv(part, index=False)
    return [folder / "pairs.csv"]


def _wanted(settings: Run) -> SimulatedPairs:
    """Return how the pairs are to be simulated, in the run or in the simulation that it names."""
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
    region = region_around(
        [one.longitude for one in stations], [one.latitude for one in stations], reach
    )
    found = find_inventories(catalog, region)
    if not found:
        raise CatalogError(str(catalog), "no stored inventory touches the region of the stations")
    return [verified_file(one) for one in found]


def named_files(names: Sequence[str], catalog: Path) -> list[Path]:
    """
    Return the files of stored inventories, each compared with its hash.

    Raises
    ------
    CatalogError
        If a name is not stored or a file has changed.
    """
    entries = {one.name: one for one in stored_inventories(catalog)}
    if unknown := [name for name in names if name not in entries]:
        raise CatalogError(
            str(catalog),
            f"names: {unknown[0]!r} is not stored here{did_you_mean(unknown[0], entries)}",
        )
    return [verified_file(entries[name]) for name in names]


def _simulated(wanted: SimulatedPairs, stations: Sequence[StationFile]) -> pd.DataFrame:
    """Return simulated pairs; they stand on the ground of the nearest station, where stations know theirs."""
    east, north = (
        np.array([getattr(one, name) for one in stations]) for name in ("longitude", "latitude")
    )
    table = simulated_pairs(east, north, **wanted.model_dump())
    ground = np.array([one.site_class for one in stations], dtype=object)
    if not ground.any():
        return table
    nearest, _ = nearest_station(
        table["longitude_1"].to_numpy(), table["latitude_1"].to_numpy(), east, north
    )
    return table.assign(site_class=ground[nearest])
