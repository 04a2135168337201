"""Risk table of an inventory that fits in memory: one row per pair, worst first."""

from collections.abc import Iterable, Sequence

import pandas as pd
import xarray as xr

from per_obspy.config import Building, Screening
from per_obspy.errors import CatalogError
from per_obspy.inventory.checking import check_columns
from per_obspy.screening.ground_motion.assignment import stations_of
from per_obspy.screening.ground_motion.site_motion import (
    RegionalMotion,
    hypocentre_of,
    prepared_field,
)
from per_obspy.screening.ranking import worst_first
from per_obspy.screening.rows import risk_rows

#: Defaults of the configuration.
BUILDING, SCREENING = Building(), Screening()


def risk_table(
    spectra: xr.Dataset | Sequence[xr.Dataset],
    pairs: pd.DataFrame,
    building: Building = BUILDING,
    screening: Screening = SCREENING,
) -> pd.DataFrame:
    """
    Compute ground motion, demand, state and severity of pairs: one row per pair, worst first.

    Parameters
    ----------
    spectra : Dataset or sequence of Dataset
        Stations, from :func:`per_obspy.station_spectra`.
    pairs : DataFrame
        From :func:`per_obspy.read_pairs`.
    building : Building
        Assumptions for values that the inventory lacks.
    screening : Screening
        Distances, and thresholds of flags and classes.

    Returns
    -------
    DataFrame
        Columns in the order of ``screening.columns.ORDER``, then the other columns of the pair
        table. ``attrs["rejected"]`` holds a :class:`~per_obspy.errors.Rejection` for every pair
        without a station in reach.

    Raises
    ------
    TypeError
        If an argument is of another type.
    CatalogError
        If the pairs lack a column that every pair needs, as an empty DataFrame does.
    """
    datasets = _datasets(spectra)
    _require("pairs", pairs, pd.DataFrame, "a DataFrame from read_pairs")
    check_columns([str(name) for name in pairs], "pairs")
    if "pair_id" not in pairs:
        raise CatalogError("pairs", "missing column pair_id: read_pairs names rows without one")
    _require("building", building, Building, "a Building")
    _require("screening", screening, Screening, "a Screening")
    stations, unlocated = stations_of(datasets)
    located = [stations.read(index) for index in range(stations.names.size)]
    # motion between the stations, for pairs at a distance from theirs
    source = hypocentre_of(station.attrs for station in located)
    field = prepared_field(located, screening.interpolation, source) if located else None
    rows, unreached = risk_rows(pairs, RegionalMotion(stations, field, None), building, screening)
    # ranked as the tables of a run are
    table = worst_first(rows)
    table = table[["rank", *(name for name in table if name != "rank")]]
    table.attrs["rejected"] = (*pairs.attrs.get("rejected", ()), *unlocated, *unreached)
    return table


def _datasets(spectra: object) -> list[xr.Dataset]:
    """Return the stations as a list."""
    expected = "a Dataset from station_spectra, or a sequence of such"
    if isinstance(spectra, xr.Dataset):
        return [spectra]
    # text and tables are iterable too, but hold no stations
    if not isinstance(spectra, Iterable) or isinstance(spectra, (str, pd.DataFrame, xr.DataArray)):
        raise TypeError(f"spectra must be {expected}, got {type(spectra).__name__}")
    stations = list(spectra)
    for index, station in enumerate(stations):
        _require(f"spectra[{index}]", station, xr.Dataset, "a Dataset from station_spectra")
    return stations


def _require(name: str, value: object, kind: type, expected: str) -> None:
    """Raise TypeError if an argument is of another type."""
    if not isinstance(value, kind):
        raise TypeError(f"{name} must be {expected}, got {type(value).__name__}")
