"""Figures of the real part of docs/calibration.md: reliability, and errors by distance."""

from pathlib import Path

import numpy as np
import pandas as pd
from calibration_left_out import ESTIMATE, EXACT, WORST
from calibration_real_scores import bins
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from scipy.special import ndtr

from per_obspy.report.style import save

COLOURS = {EXACT: "black", WORST: "#0072B2", ESTIMATE: "#009E73"}
ALONE = "#D55E00"
FEWEST = 200  # cases of a bin that is drawn


def draw_left_out(rows: pd.DataFrame, near: float, path: Path) -> None:
    """
    Draw the share of demands larger than the gap against the predicted probability.

    Parameters
    ----------
    rows : DataFrame
        From ``calibration_left_out.left_out``.
    near : float
        Distance of the record within which pairs are in the first panel, m.
    path : Path
        PNG file.
    """
    figure = Figure(figsize=(6.0, 3.5), layout="constrained")
    panels = figure.subplots(1, 2, sharex=True, sharey=True)
    parts = {
        f"record within {near / 1000:g} km": rows[rows["distance"] <= near],
        "record farther away": rows[rows["distance"] > near],
    }
    for axes, (title, some) in zip(panels, parts.items(), strict=True):
        axes.plot([0, 1], [0, 1], color="#888888", linewidth=0.8)
        for kind, colour in COLOURS.items():
            _add(axes, some[some["kind"] == kind], "probability", colour, kind)
        exact = some[some["kind"] == EXACT]
        margin = (exact["ln_record"] - np.log(exact["gap"])) / exact["record_log_std"]
        alone = exact.assign(alone=ndtr(margin))
        _add(axes, alone, "alone", ALONE, "scaled record alone")
        places = len(some.groupby(["event", "station"]))
        axes.set(title=f"{title}: {places} places", xlabel="predicted probability", box_aspect=1.0)
        axes.grid(alpha=0.25)
    panels[0].set_ylabel("share of demands larger than the gap")
    panels[0].legend(fontsize=7)
    save(figure, path, simulated=False)


def _add(axes: Axes, rows: pd.DataFrame, name: str, colour: str, label: str) -> None:
    """Add the bins of one kind; exact ones with one deviation, places dependent."""
    if not len(rows):
        return
    table = bins(rows, name)
    table = table[table["cases"] >= FEWEST]
    bars = table["doubt"] if label == EXACT else None
    axes.errorbar(
        table["predicted"],
        table["share"],
        yerr=bars,
        fmt="o-",
        color=colour,
        markersize=4,
        linewidth=1.2,
        capsize=2,
        label=label,
    )


def draw_errors(rows: pd.DataFrame, path: Path) -> None:
    """
    Draw rms error and predicted deviation of ln demand, each place a point, against the distance.

    Parameters
    ----------
    rows : DataFrame
        Pairs whose exact demand decides.
    path : Path
        PNG file.
    """
    figure = Figure(figsize=(8.0, 4.4), layout="constrained")
    axes = figure.subplots()
    error = np.log(rows["true"]) - rows["ln_median"]
    colours = ("#D55E00", "#0072B2", "#009E73", "#CC79A7", "#E69F00", "#56B4E9", "black")
    for number, (event, some) in enumerate(rows.assign(error=error).groupby("event")):
        colour = colours[number % len(colours)]
        places = some.groupby("station")
        distance = places["distance"].first() / 1000.0
        axes.plot(distance, places["error"].apply(_rms), "o", color=colour, label=event)
        axes.plot(distance, places["log_std"].mean(), "_", color=colour, markersize=14)
    axes.set(xscale="log", xlabel="distance of the nearest record (km)", ylabel="ln demand", ylim=0)
    axes.set_title("rms error at each place (points) and predicted deviation (bars)", fontsize=10)
    axes.grid(alpha=0.25)
    axes.legend(fontsize=8)
    save(figure, path, simulated=False)


def _rms(errors: pd.Series) -> float:
    return float(np.sqrt((errors**2).mean()))
