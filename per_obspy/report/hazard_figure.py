"""Figure of pairs under a hazard or rated scenarios: each gap, and that for the target rate."""

from collections.abc import Mapping
from pathlib import Path

import numpy as np
import pandas as pd
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from per_obspy.checks import FloatArray
from per_obspy.report.style import BUILDING_COLOURS, FAINT_COLOUR, save
from per_obspy.screening.values import BoolArray

#: Gaps below this are drawn on the edge, m: a logarithmic axis has no 0.
NARROWEST = 0.001

#: Rate of contact over the target from which a gap is too uncertain, beyond errors of both.
UNSURE = 1.1
COLOURS = (*BUILDING_COLOURS[::-1], "black")


def draw_gaps_for_target(table: pd.DataFrame, target_rate: float, path: Path) -> None:
    """
    Draw the gap of every pair against the gap for a target rate.

    Parameters
    ----------
    table : DataFrame
        ``gap`` and ``gap_for_target``, m, and ``annual_probability``, one row per pair.
    target_rate : float
        Annual rate of contact that is accepted, 1/year.
    path : Path
        PNG file.
    """
    known = table[["gap", "gap_for_target", "annual_probability"]].dropna().to_numpy(np.float64)
    gap, needed, chance = np.maximum(known, [NARROWEST, NARROWEST, 0.0]).T
    figure = Figure(figsize=(10.0, 5.0), layout="constrained")
    axes, filled = figure.subplots(1, 2)
    # Pairs above the line are too narrow; a wide gap that is uncertain may not be there
    narrow = needed > gap
    unsure = ~narrow & (-np.log1p(-chance) > UNSURE * target_rate)
    sides = {"too narrow": narrow, "wide enough": ~narrow & ~unsure, "if the gap is right": unsure}
    _draw_sides(axes, gap, needed, sides)
    axes.set_title(f"Gap that contact exceeds once in {1.0 / target_rate:.0f} years", fontsize=11)
    # What one gap for all of them would do
    wide = np.sort(needed[narrow])
    filled.semilogx(wide, np.arange(wide.size) + 1, drawstyle="steps-post", marker=".")
    filled.set(xlabel="gap of all that are too narrow (m)", ylabel="pairs it makes wide enough")
    save(figure, path, False)


def _draw_sides(
    axes: Axes, gap: FloatArray, needed: FloatArray, sides: Mapping[str, BoolArray]
) -> None:
    """Draw gaps against those for the target in three colours, and the line of equal gaps."""
    for (words, side), colour in zip(sides.items(), COLOURS, strict=True):
        axes.loglog(gap[side], needed[side], ".", color=colour, label=f"{words}: {side.sum()}")
    # Equal gaps
    ends = [NARROWEST, max(*gap, *needed, 1.0)]
    axes.plot(ends, ends, color=FAINT_COLOUR, linewidth=1.0)
    axes.set(xlabel="gap (m); 1 mm and less on the edge", ylabel="gap for the target (m)")
    axes.legend(fontsize=8)
