"""
Compare buildings in their rows with the same buildings in each of their pairs alone.

Run: ``python workflows/rows_by_position.py NAME=FOLDER ...`` with output folders of runs; prints
the tables of docs/rows.md and draws docs/figures/rows_by_position.png.
"""

import argparse
from pathlib import Path

import matplotlib.pyplot as plt
import numpy as np
import pandas as pd
from matplotlib.axes import Axes
from paper_records import CHECKOUT

#: Places in a row, in the order of the tables.
POSITIONS = ("single", "end", "inside", "corner")

#: Quantiles of the tables.
QUANTILES = (0.05, 0.5, 0.95)

#: Difference of an amplification from 1 that is rounding.
ROUNDING = 1e-6

#: Share of the buildings that count as the worst ones.
WORST = 0.1


def compared_buildings(folder: Path) -> pd.DataFrame:
    """
    Return the buildings of a run that any neighbour hits, in their row or in a pair alone.

    Others have the same radius in their row and in their pairs.
    """
    columns = ["building_id", "position", "impacts", "amplification_row", "amplification_pair"]
    table = pd.read_parquet(folder / "buildings.parquet", columns=columns)
    # Radii with and without contact come from two programs, which differ by rounding
    hit = (table["impacts"] > 0) | ((table["amplification_pair"] - 1.0).abs() > ROUNDING)
    ratio = table["amplification_row"] / table["amplification_pair"]
    return table.assign(ratio=ratio)[hit]


def by_position(table: pd.DataFrame) -> pd.DataFrame:
    """Return number, quantiles of the ratio and share above 1.1 of each position."""
    # Only positions that occur
    rows = {}
    for position in POSITIONS:
        ratio = table.loc[table["position"] == position, "ratio"]
        if len(ratio):
            amplification = table.loc[table["position"] == position, "amplification_row"]
            numbers = [*ratio.quantile(QUANTILES), (ratio > 1.1).mean(), (ratio < 0.9).mean()]
            rows[position] = [len(ratio), *numbers, amplification.median()]
    names = ["buildings", "5 %", "median", "95 %", "above 1.1", "below 0.9", "amplification"]
    return pd.DataFrame(rows, index=names).T


def newly_worst(table: pd.DataFrame) -> float:
    """Return the share of the worst tenth by rows that is not in the worst tenth by pairs."""
    count = max(round(WORST * len(table)), 1)
    by_row = set(table.nlargest(count, "amplification_row")["building_id"])
    by_pair = set(table.nlargest(count, "amplification_pair")["building_id"])
    return len(by_row - by_pair) / count


def draw(tables: dict[str, pd.DataFrame], path: Path) -> None:
    """Draw the distribution of the ratio by position, one panel per run."""
    # One panel per run, all with the same axis of ratios
    size = (3.2 * len(tables) + 0.6, 3.4)
    figure, axes = plt.subplots(1, len(tables), figsize=size, sharey=True, squeeze=False)
    for ax, (name, table) in zip(axes[0], tables.items(), strict=True):
        _draw_panel(ax, table)
        ax.set_title(name, fontsize=9)
    axes[0, 0].set_ylabel("radius in the row / in the worst pair alone")
    figure.tight_layout()
    figure.savefig(path, dpi=150)


def _draw_panel(ax: Axes, table: pd.DataFrame) -> None:
    """Draw the share of buildings above each ratio, one line per position."""
    # A single pair is its row
    for position in POSITIONS[1:]:
        ratio = np.sort(table.loc[table["position"] == position, "ratio"])
        if ratio.size:
            share = (np.arange(ratio.size) + 0.5) / ratio.size
            ax.plot(100 * share, ratio, label=f"{position} ({ratio.size})", linewidth=1.2)
    ax.axhline(1.0, color="0.6", linewidth=0.6)
    ax.set(yscale="log", ylim=(0.5, 12.0), xlim=(0, 100), xlabel="% of the buildings below")
    ax.set_yticks(
        [0.5, 0.7, 1.0, 1.5, 2.0, 4.0, 8.0], labels=["0.5", "0.7", "1", "1.5", "2", "4", "8"]
    )
    ax.minorticks_off()
    ax.legend(frameon=False, fontsize=8)


def main() -> None:
    """Compare the runs that are named."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("runs", nargs="+", help="title=folder of a run")
    parser.add_argument(
        "--figure", type=Path, default=CHECKOUT / "docs/figures/rows_by_position.png"
    )
    given = parser.parse_args()
    # Tables are printed run by run, the figure has all of them
    tables = {}
    for run in given.runs:
        name, _, folder = run.partition("=")
        tables[name] = compared_buildings(Path(folder))
        print(name, by_position(tables[name]).round(2).to_string(), sep="\n")
        print(f"of the worst tenth by rows not so by pairs: {newly_worst(tables[name]):.0%}\n")
    draw(tables, given.figure)


if __name__ == "__main__":
    main()
