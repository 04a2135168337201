"""Risk table of raw records and a pair table in one call."""

from pathlib import Path
from typing import TYPE_CHECKING

import pandas as pd

from per_obspy.config import Building, Screening
from per_obspy.inventory.files.reading import read_pairs
from per_obspy.processing.chain import process
from per_obspy.records.sources import read_records
from per_obspy.screening.risk import BUILDING, SCREENING, risk_table
from per_obspy.spectra.station import station_spectra

if TYPE_CHECKING:
    from obspy import Stream


def screen(
    records: "Stream | str | Path",
    pairs: pd.DataFrame | str | Path,
    building: Building = BUILDING,
    screening: Screening = SCREENING,
) -> pd.DataFrame:
    """
    Screen pairs by records: process, compute spectra, and return the risk table.

    Parameters
    ----------
    records : obspy Stream, str or Path
        Raw records of any number of stations, or a file or folder with them.
    pairs : DataFrame, str or Path
        From :func:`per_obspy.read_pairs`, or the file of a pair table.
    building : Building
        Assumptions for values that the inventory lacks.
    screening : Screening
        Distances, and thresholds of flags and classes.

    Returns
    -------
    DataFrame
        As of :func:`risk_table`.

    Raises
    ------
    CatalogError
        If a file or folder is missing, or the pairs lack a column that every pair needs.
    RecordRejected
        If no record is left, with every reason.
    """
    table = pairs if isinstance(pairs, pd.DataFrame) else read_pairs(pairs)
    raw = read_records(records) if isinstance(records, (str, Path)) else records
    # One Dataset per station
    stream = process(raw)
    codes = dict.fromkeys((trace.stats.network, trace.stats.station) for trace in stream)
    stations = [stream.select(network=network, station=name) for network, name in codes]
    return risk_table([station_spectra(one) for one in stations], table, building, screening)
