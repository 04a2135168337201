"""Figure of pairs under a hazard or rated scenarios: each gap, and that for the target rate."""

from pathlib import Path

import numpy as np
import pandas as pd
from matplotlib.figure import Figure

from per_obspy.report.style import BUILDING_COLOURS, FAINT_COLOUR, save

#: Gaps below this are drawn on the edge, m: a logarithmic axis has no 0.
NARROWEST = 0.001


def draw_gaps_for_target(table: pd.DataFrame, target_rate: float, path: Path) -> None:
    """
    Draw the gap of every pair against the gap for a target rate.

    Parameters
    ----------
    table : DataFrame
        ``gap`` and ``gap_for_target``, m, one row per pair.
    target_rate : float
        Annual rate of contact that is accepted, 1/year.
    path : Path
        PNG file.
    """
    known = table[["gap", "gap_for_target"]].dropna()
    gap, needed = np.maximum(known.to_numpy(np.float64), NARROWEST).T
    figure = Figure(figsize=(6.5, 5.5), layout="constrained")
    axes = figure.add_subplot()
    # Pairs above the line are too narrow
    narrow = needed > gap
    sides = {"too narrow": narrow, "wide enough": ~narrow}
    for (words, side), colour in zip(sides.items(), BUILDING_COLOURS[::-1], strict=True):
        axes.loglog(gap[side], needed[side], ".", color=colour, label=f"{words}: {side.sum()}")
    # The line of equal gaps
    ends = [NARROWEST, max(*gap, *needed, 1.0)]
    axes.plot(ends, ends, color=FAINT_COLOUR, linewidth=1.0)
    axes.set(xlabel="gap (m); 1 mm and less on the edge", ylabel="gap for the target (m)")
    axes.set_title(f"Gap that contact exceeds once in {1.0 / target_rate:.0f} years", fontsize=11)
    axes.legend(fontsize=8)
    save(figure, path, False)
