"""Record and spectra of single stations, thinned for a drawing."""

import math
from typing import Any

import numpy as np
import xarray as xr

from per_obspy.checks import FloatArray
from per_obspy.constants import REFERENCE_DAMPING
from per_obspy.screening.values import components

#: Intervals of time in a drawing, each with the smallest and the largest sample in it.
INTERVALS = 300

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
        "north": _envelope(north, edges),
        "east": _envelope(east, edges) if count > 1 else [],
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


def _envelope(samples: FloatArray, edges: Any) -> list[float | None]:
    """Return the smallest and the largest sample between edges."""
    values = samples[: edges[-1]]
    smallest = np.minimum.reduceat(values, edges[:-1])
    largest = np.maximum.reduceat(values, edges[:-1])
    return _all_rounded(np.stack([smallest, largest], axis=1).ravel())


def _all_rounded(values: FloatArray) -> list[float | None]:
    """Return numbers with few digits, None where they are not finite."""
    return [_rounded(float(value)) for value in values]


def _rounded(value: float) -> float | None:
    """Return a number with few digits, None where it is not finite."""
    return float(f"{value:.{DIGITS}g}") if math.isfinite(value) else None
