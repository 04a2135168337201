"""
Compare drawn gaps with what surveyors saw in the street, in two quarters (seconds).

    python workflows/outline_accuracy.py

Surveyors noted whether a building touches its neighbours to the left and to the right. Where both
buildings of a pair inside its row touch on both sides, they touch each other, so that the gap of
their outlines is the error of the drawing. They noted the structural system too: how often touching
neighbours have one is the chance of ``per_obspy/inventory/periods.py``. Writes both tables of
``docs/inventories.md``.
"""

import argparse
from collections.abc import Iterator
from pathlib import Path

import numpy as np
import pandas as pd
from paper_records import CHECKOUT, data_folder

from per_obspy import pairs_from_footprints

#: Quarters, and upper ends of the bins of gaps, m; the first is that of outlines that touch.
QUARTERS, BINS = ("san_jose", "guatemala"), (0.0, 0.1, 0.3, 0.5, 1.0, 3.0)

#: Lines between which the page is written by this workflow.
START, END = "<!-- below: workflows/outline_accuracy.py -->", "<!-- above -->"


def all_pairs(quarter: str) -> pd.DataFrame:
    """Return the pairs of a quarter."""
    folder = data_folder() / "inventories" / "footprints"
    return pairs_from_footprints(folder / f"{quarter}_pilot_region_all_fields.gpkg")


def surveyed_pairs(quarter: str) -> tuple[pd.DataFrame, pd.Series]:
    """Return pairs of surveyed buildings, and which touch on both sides of both buildings."""
    pairs = all_pairs(quarter)
    answers = pairs[[f"touches_{side}_{i}" for side in ("left", "right") for i in (1, 2)]]
    known = answers.astype(str).isin(("True", "False")).all(axis=1)
    return pairs[known], (answers[known].astype(str) == "True").all(axis=1)


def touching_neighbours(quarter: str) -> pd.Series:
    """Return the drawn gaps, m, of pairs inside their rows that touch by the survey."""
    pairs, touch = surveyed_pairs(quarter)
    inside = (pairs[["position_1", "position_2"]] == "inside").all(axis=1)
    return pairs.loc[touch & inside, "gap"]


def page() -> Iterator[str]:
    """Yield the table."""
    titles = [f"to {end:g} m" for end in BINS[1:]]
    titles += ["rms up to 1 m", "rms", "of outlines that touch, by the survey at least"]
    yield f"| quarter | pairs | outlines touch | {' | '.join(titles)} |"
    yield "|---" * (len(BINS) + 5) + "|"
    for quarter in QUARTERS:
        gap = touching_neighbours(quarter).to_numpy()
        counts = np.bincount(np.searchsorted(BINS, gap), minlength=len(BINS))
        rms = [np.sqrt(np.mean(some**2)) for some in (gap[gap <= 1.0], gap)]
        cells = [str(gap.size), *map(str, counts), *(f"{value:.2f} m" for value in rms)]
        pairs, touch = surveyed_pairs(quarter)
        cells += [f"{touch[pairs['gap'] == 0.0].mean():.0%}"]
        yield f"| {quarter} | {' | '.join(cells)} |"
    yield ""
    yield "| quarter | touching pairs of equal storeys, of one system | of others | any two |"
    yield "|---|---|---|---|"
    for quarter in QUARTERS:
        yield f"| {quarter} | {' | '.join(one_system(quarter))} |"


def one_system(quarter: str) -> Iterator[str]:
    """Yield shares of pairs whose buildings have one structural system by the survey."""
    pairs = all_pairs(quarter)
    systems = pairs[["structural_system_1", "structural_system_2"]].replace("", np.nan)
    known = systems.notna().all(axis=1) & (pairs["gap"] == 0.0)
    is_one = systems["structural_system_1"] == systems["structural_system_2"]
    is_equal = pairs["storeys_1"] == pairs["storeys_2"]
    for some in (known & is_equal, known & ~is_equal):
        yield f"{some.sum()}, {is_one[some].mean():.0%}"
    # independent of each other
    yield f"{(systems.stack().value_counts(normalize=True) ** 2).sum():.0%}"


def main() -> None:
    """Print the table and write it into the page."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("-o", "--output", type=Path, default=CHECKOUT / "docs" / "inventories.md")
    arguments = parser.parse_args()
    if not data_folder().is_dir():
        parser.exit(2, f"surveys are not at {data_folder()}: set PER_OBSPY_DATA\n")
    measured = "\n".join(page())
    print(measured)
    before, rest = arguments.output.read_text(encoding="utf-8").split(START, 1)
    text = f"{before}{START}\n\n{measured}\n\n{END}{rest.split(END, 1)[1]}"
    arguments.output.write_text(text, encoding="utf-8")


if __name__ == "__main__":
    main()
