"""Drawings of single pairs and stations for the page, computed anew for some of them."""

from collections.abc import Sequence
from typing import Any

import pandas as pd

from per_obspy.config import Run
from per_obspy.jobs.ground_files import ground_files, read_ground, read_station_once
from per_obspy.jobs.station import FinishedStation
from per_obspy.pipeline.screening import shakemap_files
from per_obspy.report.page.content import PageDrawings
from per_obspy.report.page.drawn_stations import drawn_station
from per_obspy.screening.ground_motion.site_motion import RegionalMotion
from per_obspy.screening.sensitivity import input_sensitivity

#: Pairs whose sensitivity is computed, 0.06 s each: the worst ones, and those whose probability is
#: nearest to a half, of which a better input may turn the verdict.
WORST, DOUBTFUL = 100, 50

#: Stations whose record is drawn, those that serve most pairs: 5 kB each.
STATIONS = 40


def page_drawings(
    settings: Run, worst: pd.DataFrame, stations: Sequence[FinishedStation]
) -> PageDrawings:
    """
    Return records and spectra of stations, and sensitivities of pairs.

    Parameters
    ----------
    settings : Run
        Of the run.
    worst : DataFrame
        Pairs of the page with all columns of the risk table.
    stations : sequence of FinishedStation
        With station files.
    """
    if "probability" not in worst or "derived" not in worst:
        return PageDrawings({}, {}, 0, 0)
    known = worst[worst["probability"].notna()]
    # Pairs whose outcome is certain whatever their inputs are stay in the count
    doubt = (known["probability"] - 0.5).abs().iloc[WORST:].nsmallest(DOUBTFUL)
    chosen = pd.concat([known.head(WORST), known.loc[doubt.index]])
    ground, _ = ground_files(stations, shakemap_files(settings), settings.screening.interpolation)
    rows = _sensitivities(chosen, read_ground(ground), settings)
    counts = min(len(known), WORST), len(doubt)
    return PageDrawings(_station_drawings(worst, stations), rows, *counts)


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
