"""Figures of docs/calibration.md: a reliability diagram per place, simple and exact demands."""

from collections.abc import Mapping, Sequence
from pathlib import Path

import numpy as np
import pandas as pd
from calibration_cases import APART, KINDS
from calibration_scores import BINS, difference
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from per_obspy.checks import FloatArray
from per_obspy.pounding.reliability import summary
from per_obspy.report.style import save

COLOURS = ("black", "#D55E00", "#56B4E9", "#0072B2", "#CC79A7", "#009E73")
FEWEST = 30  # pairs of a bin that is drawn


def draw_reliability(places: Sequence[tuple[str, pd.DataFrame]], path: Path) -> None:
    """
    Draw share that pounded against probability, and below how often each probability occurs.

    Parameters
    ----------
    places : sequence of (str, DataFrame)
        Title and pairs of each panel, with ``probability``, ``pounded``, ``event`` and the kinds.
    path : Path
        PNG file.
    """
    figure = Figure(figsize=(5.0 * len(places), 7.0), layout="constrained")
    panels = figure.subplots(
        2, len(places), sharex=True, sharey="row", squeeze=False, height_ratios=(3, 1)
    )
    for (place, pairs), axes, below in zip(places, *panels, strict=True):
        axes.plot([0, 1], [0, 1], color="#888888", linewidth=0.8)
        for kind, colour in zip(
            KINDS, COLOURS, strict=False
        ):  # the last, pairs that touch, have probability 1
            _add_kind(axes, pairs[pairs[kind]], kind, colour)
        axes.set(title=f"{place}: {pairs[APART].sum()} pairs")
        axes.grid(alpha=0.25)
        below.hist(
            pairs.loc[pairs[APART], "probability"],
            bins=20,
            range=(0.0, 1.0),
            color="#888888",
            log=True,
        )
        below.set_xlabel("predicted probability of pounding")
    panels[0, 0].set_ylabel("share that pounded")
    panels[1, 0].set_ylabel("pairs")
    panels[0, 0].legend(fontsize=8)
    save(figure, path, simulated=True)


def _add_kind(axes: Axes, pairs: pd.DataFrame, kind: str, colour: str) -> None:
    """Add the shares of one kind per bin; all pairs with two deviations, dependent per event."""
    bins = np.minimum((pairs["probability"] * BINS).astype(int), BINS - 1)
    groups = [some for _, some in pairs.groupby(bins) if len(some) >= FEWEST]
    told, share = ([some[name].mean() for some in groups] for name in ("probability", "pounded"))
    doubt = [2.0 * difference(some)[1] for some in groups]
    bars = doubt if kind == APART else None
    axes.errorbar(
        told,
        share,
        yerr=bars,
        fmt="o-",
        color=colour,
        markersize=4,
        linewidth=1.2,
        capsize=2,
        label=kind,
    )


def draw_demands(demands: Mapping[str, tuple[FloatArray, FloatArray]], path: Path) -> None:
    """
    Draw simple against exact demands, one panel an estimate.

    Parameters
    ----------
    demands : mapping of str to pair of (n_pairs,) ndarray
        Title -> estimates and exact demands, m.
    path : Path
        PNG file.
    """
    figure = Figure(figsize=(10.0, 10.0), layout="constrained")
    ends = 1e-4, 10.0
    for axes, (title, (simple, exact)) in zip(
        figure.subplots(2, 2).flat, demands.items(), strict=True
    ):
        places = {
            "gridsize": 70,
            "xscale": "log",
            "yscale": "log",
            "extent": np.log10([*ends, *ends]),
            "mincnt": 1,
        }
        axes.hexbin(exact, simple, bins="log", cmap="viridis_r", linewidths=0.1, **places)
        axes.plot(ends, ends, color="black", linewidth=0.8)
        found = summary(simple / exact, (1.0,))
        text = f"estimate / exact: median {found.median:.2f}, σ of ln {found.log_std:.2f}, "
        text += f"{found.below[0]:.0%} below 1"
        axes.set_title(f"{title}\n{text}", fontsize=9)
        axes.set(
            xlim=ends,
            ylim=ends,
            box_aspect=1.0,
            xlabel="exact demand of 1 towards 2 (m)",
            ylabel="estimate (m)",
        )
    save(figure, path, simulated=True)
