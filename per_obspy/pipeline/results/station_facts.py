"""Stations and displacement histories of the page, from the results of a run."""

import math
from collections.abc import Iterable, Sequence
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd

from per_obspy.jobs.ground_files import read_station_once
from per_obspy.jobs.station import FinishedStation
from per_obspy.pipeline.results.run_facts import read_stations
from per_obspy.pipeline.stations import file_stem
from per_obspy.report.page.drawn_histories import HISTORY_COLUMNS, drawn_history

#: Pairs whose history is drawn, the worst ones: 2 kB and 0.02 s each, 0.2 s in a long record.
HISTORIES = 100

#: Period and damping of the spectra in the table of stations.
SHOWN_PERIOD, SHOWN_DAMPING = 1.0, 0.05


def station_rows(path: Path, stations: Sequence[FinishedStation]) -> pd.DataFrame:
    """
    Return the table of the stations with PER and SD of each at one period, cm.

    Parameters
    ----------
    path : Path
        ``stations.csv``, which need not exist.
    stations : sequence of FinishedStation
        With spectra.
    """
    table = read_stations(path)
    if table.empty:
        return table
    # Largest of the horizontals
    for name in ("per", "sd"):
        values = {
            station.station: _at_one_period(station.spectra, name)
            for station in stations
            if station.spectra is not None
        }
        table[name] = table["station"].map(values)
    return table


def _at_one_period(spectra: Any, name: str) -> float:
    """Return the largest spectral value of a station over its horizontals, cm."""
    chosen = spectra[name].sel(damping=SHOWN_DAMPING, method="nearest")
    values = chosen.sel(period=SHOWN_PERIOD, method="nearest").to_numpy()
    horizontals = values[: int(spectra.attrs.get("horizontals", values.size))]
    return 100.0 * float(np.nanmax(horizontals)) if horizontals.size else math.nan


def pair_histories(
    worst: pd.DataFrame, stations: Iterable[FinishedStation]
) -> dict[int, dict[str, Any]]:
    """
    Return the histories of the worst pairs with a gap and a record, by their rank.

    Parameters
    ----------
    worst : DataFrame
        Rows of a risk table, worst first.
    stations : iterable of FinishedStation
        With station files.
    """
    if not set(HISTORY_COLUMNS) <= set(worst):
        return {}
    usable = worst[worst["gap"].notna() & (worst["station"] != "")].head(HISTORIES)
    shards = {station.shard.stem: station for station in stations if station.shard}
    histories = {}
    # Station by station, because motions are large
    for name, pairs in usable.groupby("station", sort=False):
        station = shards.get(file_stem(str(name)))
        if station is None or station.shard is None:
            continue
        motion = read_station_once(station.shard, station.hash)
        for _, pair in pairs.iterrows():
            history = drawn_history(motion, pair)
            if history is not None:
                histories[int(pair["rank"])] = history
    return histories
