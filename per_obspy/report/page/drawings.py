"""Histories of pairs, and records and spectra of stations, thinned for a drawing of the page."""

import math
from typing import Any

import numpy as np
import pandas as pd
import xarray as xr

from per_obspy.checks import FloatArray
from per_obspy.constants import REFERENCE_DAMPING
from per_obspy.pounding.row_history import PoundingHistory, pounding_history
from per_obspy.pounding.structure import Structure
from per_obspy.report.pair_figure import motion_along
from per_obspy.screening.values import components

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
    speed = one - two
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
