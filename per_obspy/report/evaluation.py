"""Prediction against observation of a region: a JSON file and the reliability diagram."""

import json
import math
from pathlib import Path
from typing import Any

import pandas as pd
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from per_obspy.files import written_whole
from per_obspy.report.style import BUILDING_COLOURS, FAINT_COLOUR, MOTION_COLOUR, save
from per_obspy.screening.evaluation import Evaluation, evaluation


def write_evaluation(risk: pd.DataFrame, folder: Path, simulated: bool) -> list[Path]:
    """
    Compare the observed pairs with the prediction and write the comparison.

    Files of an earlier run are removed, also where no pair has an observation.

    Parameters
    ----------
    risk : DataFrame
        Risk table, or its observed pairs; only with a column ``observed`` there are values to
        compare.
    folder : Path
        Folder of ``evaluation.json`` and, where there are probabilities,
        ``figures/reliability.png``.
    simulated : bool
        Whether the ground motion is simulated, which is then written on the figure.

    Returns
    -------
    files : list of Path
        Files that were written.
    """
    table, figure = folder / "evaluation.json", folder / "figures" / "reliability.png"
    for earlier in (table, figure):
        earlier.unlink(missing_ok=True)
    if "observed" not in risk or risk["observed"].isna().all():
        return []

    # The diagram needs probabilities, the numbers do not
    found = evaluation(risk)
    with written_whole(table) as part:
        part.write_text(json.dumps(_plain(found), indent=1, allow_nan=False), encoding="utf-8")
    if found.reliability.empty:
        return [table]
    draw_reliability(found, figure, simulated)
    return [table, figure]


def _plain(found: Evaluation) -> dict[str, Any]:
    """Return the numbers for JSON, which has null instead of NaN."""
    values = found._asdict()
    bins = values.pop("reliability").to_dict("records")
    plain = {name: None if math.isnan(value) else value for name, value in values.items()}
    return plain | {"reliability": bins}


def draw_reliability(found: Evaluation, path: Path, simulated: bool) -> None:
    """
    Draw the observed share over the predicted probability, and the number of pairs per point.

    Parameters
    ----------
    found : Evaluation
        Evaluation of pairs with probabilities.
    path : Path
        PNG file.
    simulated : bool
        Whether the ground motion is simulated.
    """
    figure = Figure(figsize=(5.5, 6.5), layout="constrained")
    shares, counts = figure.subplots(2, 1, sharex=True, height_ratios=(3.0, 1.0))
    _draw_shares(shares, found)
    _draw_counts(counts, found.reliability)
    figure.legend(fontsize=8, loc="outside lower center", ncols=2)
    save(figure, path, simulated)


def _draw_shares(axes: Axes, found: Evaluation) -> None:
    """Draw the observed share of each bin with its 95 % range."""
    # Few runs have observations, and it takes .2 s to load
    from scipy.stats import binom

    bins = found.reliability
    mean, events = bins["mean_probability"].to_numpy(), bins["events"].to_numpy()
    axes.plot([0.0, 1.0], [0.0, 1.0], color=MOTION_COLOUR, linewidth=0.8, label="as predicted")

    # Binomial range of the share, if the prediction is true and pairs are independent
    low, high = binom.interval(0.95, events, mean) / events
    label = "19 of 20, if true and independent"
    axes.vlines(mean, low, high, color=FAINT_COLOUR, linewidth=6.0, label=label)

    # A useful prediction departs from the share of all pairs
    share = found.pounded / found.pairs
    label = f"observed share, {share:.2f}"
    axes.axhline(share, color=MOTION_COLOUR, linewidth=0.8, linestyle=":", label=label)
    axes.plot(mean, bins["observed_share"], "o", color=BUILDING_COLOURS[0], label="observed")
    axes.set(xlim=(-0.02, 1.02), ylim=(-0.02, 1.02), ylabel="observed share of pounding")
    axes.set_title(_title(found), fontsize=11)


def _title(found: Evaluation) -> str:
    """Return number of pairs and Brier score in two lines."""
    score, of_the_share = found.brier_score, found.brier_score_of_the_share
    scores = f"Brier score {score:.3f} (share alone {of_the_share:.3f})"
    return f"{found.pairs} pairs looked at, {found.pounded} pounded\n{scores}"


def _draw_counts(axes: Axes, bins: pd.DataFrame) -> None:
    """Draw the number of pairs of each bin as bars."""
    axes.bar(
        bins["low"],
        bins["events"],
        width=bins["high"] - bins["low"],
        align="edge",
        color=FAINT_COLOUR,
        edgecolor="white",
    )
    axes.set(xlabel="predicted probability of pounding", ylabel="pairs", yscale="log")
    axes.set_ylim(0.5, None)
