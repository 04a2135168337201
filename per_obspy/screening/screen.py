"""Risk table of raw records and a pair table in one call."""

from collections import defaultdict
from pathlib import Path

import pandas as pd
from obspy import Stream

from per_obspy.config import Building, Screening
from per_obspy.inventory.files.reading import read_pairs
from per_obspy.processing.chain import process
from per_obspy.records.sources import read_records
from per_obspy.screening.risk import BUILDING, SCREENING, risk_table
from per_obspy.spectra.station import station_spectra


def screen(
    records: Stream | str | Path,
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
    stream = records if isinstance(records, Stream) else read_records(records)
    # One Dataset per station
    stations: dict[tuple[str, str], Stream] = defaultdict(Stream)
    for trace in process(stream):
        stations[trace.stats.network, trace.stats.station].append(trace)
    spectra = [station_spectra(traces) for traces in stations.values()]
    return risk_table(spectra, table, building, screening)
