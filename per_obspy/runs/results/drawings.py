"""Drawings of the page of a run: stations, histories and sensitivities of some of its pairs."""

import math
from collections.abc import Iterable, Sequence
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd

from per_obspy.config import Run
from per_obspy.report.page.drawings import HISTORY_COLUMNS, drawn_history, drawn_station
from per_obspy.report.results import Drawings
from per_obspy.runs.results.run_facts import read_stations
from per_obspy.runs.screening import ground_of_run
from per_obspy.runs.stations import file_stem
from per_obspy.runs.tasks.ground_files import read_ground, read_station_once
from per_obspy.runs.tasks.station import FinishedStation
from per_obspy.screening.sensitivity import input_sensitivity
from per_obspy.screening.site_motion import RegionalMotion

#: Pairs whose history is drawn, the worst ones: 2 kB and 0.02 s each, 0.2 s in a long record.
HISTORIES = 100

#: Period and damping of the spectra in the table of stations.
SHOWN_PERIOD, SHOWN_DAMPING = 1.0, 0.05

#: Pairs whose sensitivity is computed, 0.06 s each: the worst ones, and those whose probability is
#: nearest to a half, of which a better input may turn the verdict.
WORST, DOUBTFUL = 100, 50

#: Stations whose record is drawn, those that serve most pairs: 5 kB each.
STATIONS = 40


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


def page_drawings(
    settings: Run, worst: pd.DataFrame, stations: Sequence[FinishedStation]
) -> Drawings:
    """
    Return records and spectra of stations, and histories and sensitivities of pairs.

    Parameters
    ----------
    settings : Run
        Of the run.
    worst : DataFrame
        Pairs of the page with all columns of the risk table.
    stations : sequence of FinishedStation
        With station files.
    """
    histories = pair_histories(worst, stations)
    if "probability" not in worst or "derived" not in worst:
        return Drawings({}, histories)
    known = worst[worst["probability"].notna()]
    # Pairs whose outcome is certain whatever their inputs are stay in the count
    doubt = (known["probability"] - 0.5).abs().iloc[WORST:].nsmallest(DOUBTFUL)
    chosen = pd.concat([known.head(WORST), known.loc[doubt.index]])
    ground, _ = ground_of_run(settings, stations)
    rows = _sensitivities(chosen, read_ground(ground), settings)
    counts = min(len(known), WORST), len(doubt)
    return Drawings(_station_drawings(worst, stations), histories, rows, *counts)


def _sensitivities(
    pairs: pd.DataFrame, ground: RegionalMotion, settings: Run
) -> dict[int, list[list[Any]]]:
    """Return the sensitivities of pairs by their rank, the largest change first."""
    ranks = dict(zip(pairs["pair_id"], pairs["rank"], strict=True))
    found: dict[int, list[list[Any]]] = {}
    for one in _each(pairs, ground, settings):
        ends = [float(f"{value:.4g}") for value in (one.low, one.high)]
        chances = [round(value, 4) for value in (one.probability_low, one.probability_high)]
        row = [one.name, *ends, *chances, one.state_low, one.state_high]
        found.setdefault(int(ranks[one.pair_id]), []).append(row)
    # Input, two values, two probabilities, two states
    for rows in found.values():
        rows.sort(key=lambda row: -abs(row[4] - row[3]))
    return found


def _each(pairs: pd.DataFrame, ground: RegionalMotion, settings: Run) -> list[Any]:
    """Return the sensitivities of all pairs for which they can be computed."""
    try:
        return input_sensitivity(pairs, ground, settings.building, settings.screening)
    except (ValueError, ArithmeticError):
        if len(pairs) < 2:
            return []
    # Find the pair at fault by halving
    middle = len(pairs) // 2
    halves = pairs.iloc[:middle], pairs.iloc[middle:]
    return [one for half in halves for one in _each(half, ground, settings)]


def _station_drawings(
    worst: pd.DataFrame, stations: Sequence[FinishedStation]
) -> dict[str, dict[str, Any]]:
    """Return record and spectra of the stations that serve most pairs of the page."""
    served = worst["station"].value_counts() if "station" in worst else pd.Series(dtype=int)
    able = [one for one in stations if one.shard and one.spectra is not None]
    names = {one.station: int(served.get(one.station, 0)) for one in able}
    # Ties by name, so that a page does not depend on the order of the jobs
    able.sort(key=lambda one: (-names[one.station], one.station))
    return {
        one.station: drawn_station(read_station_once(one.shard, one.hash))
        for one in able[:STATIONS]
        if one.shard is not None
    }
