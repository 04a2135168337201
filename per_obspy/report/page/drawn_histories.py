"""Pounding histories of single pairs, thinned for a drawing."""

import math
from typing import Any

import numpy as np
import pandas as pd
import xarray as xr

from per_obspy.checks import FloatArray
from per_obspy.pounding.row_history import PoundingHistory, pounding_history
from per_obspy.pounding.structure import Structure
from per_obspy.report.pair_figure import motion_along

#: Intervals of time in a drawing, each with the smallest and the largest displacement in it.
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
        "one": _envelope(history.displacement[0], edges),
        "two": _envelope(history.displacement[1], edges),
        "impacts": _fastest(history.impacts),
    }


def _fastest(impacts: pd.DataFrame) -> list[list[float]]:
    """Return time, s, and approach velocity, m/s, of the fastest impacts that count."""
    counted = impacts[impacts["counted"].to_numpy(dtype=bool)]
    speed = counted["velocity_before_1"] - counted["velocity_before_2"]
    fastest = pd.DataFrame({"time": counted["time"], "speed": speed}).nlargest(
        MOST_IMPACTS, "speed"
    )
    return fastest.round(3).to_numpy().tolist()


def _envelope(displacement: FloatArray, edges: Any) -> list[float]:
    """Return the smallest and the largest displacement between edges, mm."""
    values = 1000.0 * displacement[: edges[-1] + 1]
    smallest = np.minimum.reduceat(values, edges[:-1])
    largest = np.maximum.reduceat(values, edges[:-1])
    return [
        round(float(value), 1) for pair in zip(smallest, largest, strict=True) for value in pair
    ]
