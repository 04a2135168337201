"""How the prediction of a region did where somebody looked: a file for machines, and the reliability diagram."""

import json
import math
from pathlib import Path
from typing import Any

import pandas as pd
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from scipy.stats import binom

from per_obspy.files import written_whole
from per_obspy.report.style import BUILDING_COLOURS, MOTION_COLOUR, save
from per_obspy.screening.region.evaluation import Evaluation, evaluation


def write_evaluation(risk: pd.DataFrame, folder: Path, simulated: bool) -> list[Path]:
    """
    Compare the pairs that somebody looked at with the prediction; without any, files of an earlier run are removed.

    Parameters
    ----------
    risk : DataFrame
        Risk table, or its observed pairs; only with a column ``observed`` there is something to
        compare.
    folder : Path
        For ``evaluation.json`` and, where there are probabilities, ``figures/reliability.png``.
    simulated : bool
        Whether the ground motion was, which the figure says.

    Returns
    -------
    files : list of Path
        What was written.
    """
    table, figure = folder / "evaluation.json", folder / "figures" / "reliability.png"
    for old in (table, figure):
        old.unlink(missing_ok=True)
    if "observed" not in risk or risk["observed"].isna().all():
        return []
    found = evaluation(risk)
    with written_whole(table) as part:
        part.write_text(json.dumps(_plain(found), indent=1, allow_nan=False), encoding="utf-8")
    if found.reliability.empty:
        return [table]
    draw_reliability(found, figure, simulated)
    return [table, figure]


def _plain(found: Evaluation) -> dict[str, Any]:
    """Return the numbers as JSON knows them: null for a share of nothing."""
    values = found._asdict()
    bins = values.pop("reliability").to_dict("records")
    return {name: None if math.isnan(value) else value for name, value in values.items()} | {
        "reliability": bins
    }


def draw_reliability(found: Evaluation, path: Path, simulated: bool) -> None:
    """
    Draw the observed share over the predicted probability, and how many pairs each point stands for.

    Parameters
    ----------
    found : Evaluation
        With probabilities.
    path : Path
        PNG file.
    simulated : bool
        Whether the ground motion was.
    """
    figure = Figure(figsize=(5.5, 6.5), layout="constrained")
    shares, counts = figure.subplots(2, 1, sharex=True, height_ratios=(3.0, 1.0))
    _draw_shares(shares, found)
    _draw_counts(counts, found.reliability)
    figure.legend(fontsize=8, loc="outside lower center", ncols=2)
    save(figure, path, simulated)


def _draw_shares(axes: Axes, found: Evaluation) -> None:
    """Draw each bin, and the range of 19 shares of 20 if the prediction is true and pairs are independent."""
    bins = found.reliability
    mean, events = bins["mean_probability"].to_numpy(), bins["events"].to_numpy()
    low, high = binom.interval(0.95, events, mean) / events
    axes.plot([0.0, 1.0], [0.0, 1.0], color=MOTION_COLOUR, linewidth=0.8, label="as predicted")
    axes.vlines(
        mean, low, high, color="#BBBBBB", linewidth=6.0, label="19 of 20, if true and independent"
    )
    share = found.pounded / found.pairs
    axes.axhline(
        share,
        color=MOTION_COLOUR,
        linewidth=0.8,
        linestyle=":",
        label=f"observed share, {share:.2f}",
    )
    axes.plot(mean, bins["observed_share"], "o", color=BUILDING_COLOURS[0], label="observed")
    axes.set(xlim=(-0.02, 1.02), ylim=(-0.02, 1.02), ylabel="observed share of pounding")
    scores = (
        f"Brier score {found.brier_score:.3f} (share alone {found.brier_score_of_the_share:.3f})"
    )
    axes.set_title(f"{found.pairs} pairs looked at, {found.pounded} pounded\n{scores}", fontsize=11)


def _draw_counts(axes: Axes, bins: pd.DataFrame) -> None:
    axes.bar(
        bins["low"],
        bins["events"],
        width=bins["high"] - bins["low"],
        align="edge",
        color="#BBBBBB",
        edgecolor="white",
    )
    axes.set(
        xlabel="predicted probability of pounding", ylabel="pairs", yscale="log", ylim=(0.5, None)
    )
