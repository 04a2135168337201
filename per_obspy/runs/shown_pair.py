"""One pair of finished results: its row, and its figure."""

from pathlib import Path
from typing import NamedTuple

import duckdb
import pandas as pd

from per_obspy.errors import CatalogError, shortened
from per_obspy.report.pair_figure import draw_pair_alone, draw_record_to_pair
from per_obspy.results.parts import bounded_database, parquet_rows
from per_obspy.results.ranked_table import table_files
from per_obspy.resume import StatusError, read_status
from per_obspy.spectra.storage import read_spectra

#: Tables of results that have one row per pair.
TABLES = ("risk", "design", "ensemble")


class ShownPair(NamedTuple):
    """
    A pair of results.

    Attributes
    ----------
    row : Series
        Its row.
    folder : Path
        Of the results.
    simulated : bool
        Whether the ground motion is simulated.
    """

    row: pd.Series
    folder: Path
    simulated: bool


def find_pair(name: str, folder: Path) -> ShownPair:
    """
    Find a pair by its identifier.

    Parameters
    ----------
    name : str
        ``pair_id``, or a rank as ``#1``.
    folder : Path
        Results of a run, of a design spectrum or of an ensemble.

    Raises
    ------
    CatalogError
        If the folder holds no results, or they have no such pair.
    """
    table = next(filter(None, (table_files(folder, name) for name in TABLES)), None)
    if table is None:
        files = ", ".join(f"{name}.parquet" for name in TABLES)
        raise CatalogError(str(folder), f"no results here: none of {files}")
    # By name or by rank
    column, value = ("rank", name[1:]) if name.startswith("#") else ("pair_id", name)
    with bounded_database(folder) as database:
        database.register("found", parquet_rows(table))
        # A value is a parameter: no name is part of the query
        query = f"SELECT * FROM found WHERE CAST({column} AS VARCHAR) = $value LIMIT 1"
        try:
            rows = database.execute(query, {"value": value}).df()
        except duckdb.Error as error:
            raise CatalogError(str(table[0]), f"cannot be read: {error}") from error
    if rows.empty:
        reason = f"no pair {shortened(name, 80)!r}: name a pair_id of the table, or a rank as #1"
        raise CatalogError(str(table[0]), reason)
    return ShownPair(rows.iloc[0], folder, is_simulated(folder))


def is_simulated(folder: Path) -> bool:
    """Return whether the motion of the results is simulated, by the file that describes them."""
    for name in ("run.json", "ensemble.json"):
        try:
            return bool(read_status(folder / name).get("simulated", False))
        except StatusError:
            continue
    return False


def draw_pair(pair: ShownPair, path: Path) -> None:
    """
    Draw a pair with its record, or its circles alone if no record serves it.

    Raises
    ------
    CatalogError
        If the table has no radii, as that of an ensemble, or the station's file is missing.
    """
    row = pair.row
    if "participation_1" not in row:
        reason = "an ensemble has no radii: draw the pair from the results of one of its runs"
        raise CatalogError(str(pair.folder), reason)
    station = row.get("station")
    # Pairs of a spectrum or a map have no record
    if not isinstance(station, str) or not station:
        draw_pair_alone(row, pair.simulated, path)
        return
    shard = pair.folder / "stations" / f"{station.strip('.')}.nc"
    if not shard.is_file():
        raise CatalogError(str(shard), "the record of the pair is missing: run again")
    draw_record_to_pair(read_spectra(shard), row, path)
