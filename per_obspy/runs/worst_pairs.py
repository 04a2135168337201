"""
What explains the worst pairs of a run: their histories, sensitivities, and records of stations.

They are computed once, after the screening, and kept in ``worst_pairs.json``.
"""

import json
import math
from collections.abc import Callable, Iterable, Iterator, Sequence
from contextlib import contextmanager
from functools import partial
from itertools import chain, pairwise
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd
import xarray as xr

from per_obspy.checks import FloatArray
from per_obspy.config import Run
from per_obspy.constants import REFERENCE_DAMPING
from per_obspy.files import written_whole
from per_obspy.pounding.row_history import PoundingHistory, pounding_history
from per_obspy.pounding.structure import Structure
from per_obspy.report.results import Drawings
from per_obspy.runs.stations import file_stem
from per_obspy.runs.tasks.ground_files import GroundFiles, read_ground, read_station_once
from per_obspy.runs.tasks.parallel import Workers, begun, near
from per_obspy.runs.tasks.station import FinishedStation
from per_obspy.screening.sensitivity import input_sensitivity
from per_obspy.screening.site_motion import RegionalMotion
from per_obspy.screening.values import components, motion_along

#: Pairs whose history is drawn, the worst ones: 2 kB and 0.02 s each, 0.2 s in a long record.
HISTORIES = 100

#: Period and damping of the spectra in the table of stations.
SHOWN_PERIOD, SHOWN_DAMPING = 1.0, 0.05

#: Pairs whose sensitivity is computed, 0.06 s each: the worst ones, and those whose probability is
#: nearest to a half, of which a better input may turn the verdict.
WORST, DOUBTFUL = 100, 50

#: Stations whose record is drawn, those that serve most pairs: 5 kB each.
STATIONS = 40


def _radii(stations: Sequence[FinishedStation]) -> dict[str, list[float]]:
    """Return PER and SD of each station at one period, cm."""
    radii = {
        station.station: [_at_one_period(station.spectra, name) for name in ("per", "sd")]
        for station in stations
        if station.spectra is not None
    }
    return {name: pair for name, pair in radii.items() if np.isfinite(pair).all()}


def _at_one_period(spectra: Any, name: str) -> float:
    """Return the largest spectral value of a station over its horizontals, cm."""
    chosen = spectra[name].sel(damping=SHOWN_DAMPING, method="nearest")
    values = chosen.sel(period=SHOWN_PERIOD, method="nearest").to_numpy()
    horizontals = values[: int(spectra.attrs.get("horizontals", values.size))]
    return 100.0 * float(np.nanmax(horizontals)) if horizontals.size else math.nan


def write_drawings(drawings: Drawings, path: Path) -> None:
    """Write ``worst_pairs.json``, whole or not at all."""
    with written_whole(path) as part:
        part.write_text(json.dumps(drawings._asdict(), allow_nan=False), encoding="utf-8")


def read_drawings(path: Path) -> Drawings:
    """Read what :func:`write_drawings` wrote; nothing where there is no such file."""
    if not path.is_file():
        return Drawings()
    known = Drawings(**json.loads(path.read_text(encoding="utf-8")))
    # Ranks are texts in JSON
    return known._replace(
        histories={int(rank): history for rank, history in known.histories.items()},
        sensitivity={int(rank): rows for rank, rows in known.sensitivity.items()},
    )


@contextmanager
def page_drawings(
    settings: Run,
    worst: pd.DataFrame,
    stations: Sequence[FinishedStation],
    ground: GroundFiles,
    workers: Workers,
) -> Iterator[Callable[[], Drawings]]:
    """
    Begin records and spectra of stations, and histories and sensitivities of pairs.

    Parameters
    ----------
    settings : Run
        Of the run.
    worst : DataFrame
        Pairs of the page with the package's columns of the risk table.
    stations : sequence of FinishedStation
        With station files.
    ground : GroundFiles
        The ground motion of the run.
    workers : Workers
        Who computes them while the block does something else.

    Yields
    ------
    callable
        Returns the drawings as soon as all are done.
    """
    chosen, counts = _with_sensitivity(worst)
    workers = near(workers, len(chosen))
    # Sensitivities take longest
    calls = [
        *_varied(chosen, ground, settings, max(workers.count - 1, 1)),
        *_followed(worst, stations),
        *(_drawn(worst, stations) if any(counts) else ()),
    ]
    with begun(calls, workers) as waiting:
        yield lambda: _joined(waiting)._replace(
            worst=counts[0], doubtful=counts[1], radii=_radii(stations)
        )


def _with_sensitivity(worst: pd.DataFrame) -> tuple[pd.DataFrame, tuple[int, int]]:
    """Return the pairs that have a sensitivity, the worst and the doubtful, and their numbers."""
    if "probability" not in worst or "derived" not in worst:
        return worst[:0], (0, 0)
    known = worst[worst["probability"].notna()]
    # Pairs whose outcome is certain whatever their inputs are stay in the count
    doubt = (known["probability"] - 0.5).abs().iloc[WORST:].nsmallest(DOUBTFUL)
    chosen = pd.concat([known.head(WORST), known.loc[doubt.index]])
    return chosen, (min(len(known), WORST), len(doubt))


def _joined(calls: Sequence[Callable[[], Drawings]]) -> Drawings:
    """Return what some calls draw; pairs in the order of their ranks, whoever drew them."""
    # The last ones have not begun: this process does them meanwhile
    parts = [call() for call in reversed(calls)][::-1]
    return Drawings(
        dict(chain.from_iterable(part.stations.items() for part in parts)),
        dict(sorted(chain.from_iterable(part.histories.items() for part in parts))),
        dict(sorted(chain.from_iterable(part.sensitivity.items() for part in parts))),
    )


def _varied(
    pairs: pd.DataFrame, ground: GroundFiles, settings: Run, shares: int
) -> list[partial[Drawings]]:
    """Return the calls that compute the sensitivities of pairs, in shares by station."""
    if pairs.empty:
        return []
    by_station = pairs.sort_values("station", kind="stable")
    edges = np.linspace(0, len(pairs), shares + 1).astype(int)
    return [
        partial(_sensitivities, by_station.iloc[first:end], ground, settings)
        for first, end in pairwise(edges)
    ]


def _sensitivities(pairs: pd.DataFrame, files: GroundFiles, settings: Run) -> Drawings:
    """Return the sensitivities of pairs by their rank, the largest change first."""
    ranks = dict(zip(pairs["pair_id"], pairs["rank"], strict=True))
    # One list per pair
    found: dict[int, list[list[Any]]] = {}
    for one in _each(pairs, read_ground(files), settings):
        ends = [float(f"{value:.4g}") for value in (one.low, one.high)]
        chances = [round(value, 4) for value in (one.probability_low, one.probability_high)]
        row = [one.name, *ends, *chances, one.state_low, one.state_high]
        found.setdefault(int(ranks[one.pair_id]), []).append(row)
    # Input, two values, two probabilities, two states
    for rows in found.values():
        rows.sort(key=lambda row: -abs(row[4] - row[3]))
    return Drawings(sensitivity=found)


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


#: Intervals of time in a drawing, each with the smallest and the largest value in it.
INTERVALS = 300

#: Impacts that are drawn, the fastest ones.
MOST_IMPACTS = 300

#: Columns of the risk table that a history needs.
HISTORY_COLUMNS = (
    "rank", "station", "gap", "restitution", "azimuth_used", "period_1", "period_2", "damping_1",
    "damping_2", "participation_1", "participation_2", "contact_mass_1", "contact_mass_2",
    "yield_displacement_1", "yield_displacement_2", "hardening_1", "hardening_2",
)  # fmt: skip

#: Longest record of which a history is drawn, samples: longer ones take too long.
MOST_SAMPLES = 200_000


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
    return {**_joined(_followed(worst, stations)).histories}


def _followed(worst: pd.DataFrame, stations: Iterable[FinishedStation]) -> list[partial[Drawings]]:
    """Return the calls that compute the histories of pairs, station by station."""
    if not set(HISTORY_COLUMNS) <= set(worst):
        return []
    usable = worst[worst["gap"].notna() & (worst["station"] != "")].head(HISTORIES)
    shards = {station.shard.stem: station for station in stations if station.shard}
    # Motions are large
    calls = []
    for name, pairs in usable.groupby("station", sort=False):
        station = shards.get(file_stem(str(name)))
        if station is not None and station.shard is not None:
            columns = pairs[[*HISTORY_COLUMNS]]
            calls.append(partial(_histories_at, columns, station.shard, station.hash))
    return calls


def _histories_at(pairs: pd.DataFrame, shard: Path, digest: str) -> Drawings:
    """Return the histories of pairs under the record of one station."""
    motion = read_station_once(shard, digest)
    drawn = {int(pair["rank"]): drawn_history(motion, pair) for _, pair in pairs.iterrows()}
    known = {rank: history for rank, history in drawn.items() if history is not None}
    return Drawings(histories=known)


def drawn_history(station: xr.Dataset, pair: pd.Series) -> dict[str, Any] | None:
    """
    Return the exact history of a pair at contact level for a drawing, None if there is none.

    Parameters
    ----------
    station : Dataset
        With the acceleration of the record that the pair used.
    pair : Series
        Row of the risk table.

    Returns
    -------
    dict or None
        ``time`` (s, of the drawn intervals), ``one`` and ``two`` (displacements as smallest and
        largest per interval, mm), ``impacts`` (time in s and approach velocity in m/s).
    """
    azimuth, gap = float(pair["azimuth_used"]), float(pair["gap"])
    if not math.isfinite(gap) or station.sizes["time"] > MOST_SAMPLES:
        return None
    motion = motion_along(station, azimuth)
    try:
        structures = [_structure(pair, 1), _structure(pair, 2)]
        history = pounding_history(
            motion,
            float(station["sampling_interval"]),
            structures,
            gap,
            float(pair["restitution"]),
            free_vibration=False,
        )
    except ValueError:
        # A structure outside the range of the exact history has none
        return None
    return _thinned(history)


def _structure(pair: pd.Series, number: int) -> Structure:
    """Return a building of the pair as an oscillator at contact level."""
    # Yielding is known of the oscillator, the history is at contact level
    share = float(pair[f"participation_{number}"])
    limit = float(pair[f"yield_displacement_{number}"])
    return Structure(
        period=float(pair[f"period_{number}"]),
        damping=float(pair[f"damping_{number}"]),
        mass=float(pair[f"contact_mass_{number}"]),
        yield_displacement=share * limit if math.isfinite(limit) else math.inf,
        hardening=float(pair[f"hardening_{number}"]) if math.isfinite(limit) else 0.0,
        participation=share,
    )


def _thinned(history: PoundingHistory) -> dict[str, Any]:
    """Return the strong motion of a history, thinned."""
    strength = np.cumsum((history.displacement**2).sum(axis=0))
    # All of it without any motion
    shares = np.array([0.002, 0.995]) if strength[-1] > 0 else np.array([0.0, 1.0])
    first, last = np.searchsorted(strength, shares * strength[-1])
    edges = np.unique(np.linspace(first, max(last, first + 1), INTERVALS + 1).astype(int))
    return {
        "time": [round(float(time), 3) for time in history.time[edges]],
        "one": _displacements(history.displacement[0], edges),
        "two": _displacements(history.displacement[1], edges),
        "impacts": _fastest(history.impacts),
    }


def _fastest(impacts: pd.DataFrame) -> list[list[float]]:
    """Return time, s, and approach velocity, m/s, of the fastest impacts that count."""
    time, counted, one, two = (
        impacts[name].to_numpy()
        for name in ("time", "counted", "velocity_before_1", "velocity_before_2")
    )
    # Equal ones in the order of time
    speed = one - two
    # Equal ones stay in their order
    order = np.argsort(-speed, kind="stable")
    fastest = order[counted[order]][:MOST_IMPACTS]
    rows: list[list[float]] = np.stack([time[fastest], speed[fastest]], axis=1).round(3).tolist()
    return rows


def _displacements(displacement: FloatArray, edges: Any) -> list[float]:
    """Return the smallest and the largest displacement between edges, mm."""
    envelope = _envelope(1000.0 * displacement[: edges[-1] + 1], edges)
    return [round(float(value), 1) for value in envelope]


def _envelope(values: FloatArray, edges: Any) -> FloatArray:
    """Return the smallest and the largest value between edges by turns."""
    smallest = np.minimum.reduceat(values, edges[:-1])
    largest = np.maximum.reduceat(values, edges[:-1])
    return np.stack([smallest, largest], axis=1).ravel()


#: Digits of the numbers.
DIGITS = 3

#: Share of the energy of a record before and after its drawn part.
QUIET = 0.001


def _drawn(worst: pd.DataFrame, stations: Sequence[FinishedStation]) -> list[partial[Drawings]]:
    """Return the calls that draw the stations which serve most pairs of the page."""
    served = worst["station"].value_counts() if "station" in worst else pd.Series(dtype=int)
    able = [one for one in stations if one.shard and one.spectra is not None]
    names = {one.station: int(served.get(one.station, 0)) for one in able}
    # Ties by name, so that a page does not depend on the order of the jobs
    able.sort(key=lambda one: (-names[one.station], one.station))
    return [
        partial(_station_drawing, one.station, one.shard, one.hash)
        for one in able[:STATIONS]
        if one.shard is not None
    ]


def _station_drawing(name: str, shard: Path, digest: str) -> Drawings:
    """Return record and spectra of a station file."""
    return Drawings({name: drawn_station(read_station_once(shard, digest))})


def drawn_station(station: xr.Dataset) -> dict[str, Any]:
    """
    Return record and spectra of a station for a drawing.

    Parameters
    ----------
    station : Dataset
        With its processed acceleration.

    Returns
    -------
    dict
        ``start, step`` (s), ``north, east`` (smallest and largest acceleration per interval, m/s²;
        ``east`` is empty where there is one horizontal), ``period`` (s), ``per, sd`` (cm, of the
        larger horizontal), ``damping`` and ``usable`` (shortest and longest period, s).
    """
    north, east, interval = components(station)
    edges = _edges(north**2 + east**2)
    # Spectra of the horizontals, at the damping of all records
    count = int(station.attrs["horizontals"])
    near = station.sel(damping=REFERENCE_DAMPING, method="nearest")
    # Pads at both ends are left out
    return {
        "start": _rounded(interval * edges[0]),
        "step": _rounded(interval * (edges[-1] - edges[0]) / (len(edges) - 1)),
        "north": _samples(north, edges),
        "east": _samples(east, edges) if count > 1 else [],
        "period": _all_rounded(station["period"].to_numpy()),
        "per": _all_rounded(100.0 * near["per"].to_numpy()[:count].max(axis=0)),
        "sd": _all_rounded(100.0 * near["sd"].to_numpy()[:count].max(axis=0)),
        "damping": float(near["damping"]),
        "usable": [
            _rounded(float(station[f"{end}_usable_period"])) for end in ("shortest", "longest")
        ],
    }


def _edges(squared: FloatArray) -> Any:
    """Return the first samples of the intervals, and the end of the last one."""
    energy = np.cumsum(squared)
    # All of a record at rest
    shares = np.array([QUIET, 1.0 - QUIET]) if energy[-1] > 0.0 else np.array([0.0, 1.0])
    first, last = np.searchsorted(energy, shares * energy[-1])
    end = min(max(int(last), int(first) + 1) + 1, squared.size)
    return np.unique(np.linspace(first, end, INTERVALS + 1).astype(int))


def _samples(samples: FloatArray, edges: Any) -> list[float | None]:
    """Return the smallest and the largest sample between edges."""
    return _all_rounded(_envelope(samples[: edges[-1]], edges))


def _all_rounded(values: FloatArray) -> list[float | None]:
    """Return numbers with few digits, None where they are not finite."""
    return [_rounded(float(value)) for value in values]


def _rounded(value: float) -> float | None:
    """Return a number with few digits, None where it is not finite."""
    return float(f"{value:.{DIGITS}g}") if math.isfinite(value) else None
