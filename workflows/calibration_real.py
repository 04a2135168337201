"""
Measure on real records how well the demand between stations is known, leaving stations out.

Run: ``python workflows/calibration_real.py``; prints the real part of docs/calibration.md, writes
it into the page and draws its figures. ``--records`` names a folder with one folder of records per
earthquake.
"""

import argparse
import tempfile
from collections.abc import Iterator
from pathlib import Path

import numpy as np
import pandas as pd
from calibration_events import real_events
from calibration_left_out import ESTIMATE, EXACT, GAPS, WORST, left_out
from calibration_real_figures import draw_errors, draw_left_out
from calibration_real_scores import (
    bins,
    brier,
    by_distance,
    rms,
    weights,
)
from paper_records import CHECKOUT, data_folder

#: Headings between which the page is written by this workflow.
START, END = "## Measured on real records", "## Simulated earthquakes"

#: Distances of the record within which the screening serves pairs by default, m.
NEAR = 20_000.0

KINDS = (EXACT, WORST, ESTIMATE)


def main() -> None:
    """Leave stations out, print the tables, write them into the page, draw the figures."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("-o", "--output", type=Path, default=CHECKOUT / "docs" / "calibration.md")
    parser.add_argument("-r", "--records", type=Path, default=data_folder() / "records")
    cache = Path(tempfile.gettempdir()) / "per_obspy_calibration"
    parser.add_argument("-c", "--cache", type=Path, default=cache, help="keeps the spectra")
    arguments = parser.parse_args()
    if not arguments.records.is_dir():
        parser.exit(2, f"real records are not at {arguments.records}: name them with --records\n")
    tables = []
    folders = sorted(path for path in arguments.records.iterdir() if path.is_dir())
    for event in real_events(folders, arguments.cache):
        print(f"{event.name}: {len(event.stations)} stations", flush=True)
        tables.append(left_out(event))
    rows = pd.concat(tables, ignore_index=True)
    rows.to_pickle(arguments.cache / "left_out.pkl")
    # the part of the page between both headings
    measured = "\n".join(page(rows))
    print(measured)
    before, rest = arguments.output.read_text(encoding="utf-8").split(START)
    after = rest.split(END, 1)[1]
    text = f"{before}{START}\n\n{measured}\n\n{END}{after}"
    arguments.output.write_text(text, encoding="utf-8")
    figures = arguments.output.parent / "figures"
    draw_left_out(rows, NEAR, figures / "calibration_real_reliability.png")
    draw_errors(rows[rows["kind"] == EXACT], figures / "calibration_real_errors.png")


def page(rows: pd.DataFrame) -> Iterator[str]:
    """Yield the measured part of the page."""
    places = rows.groupby("event")["station"].nunique()
    listed = ", ".join(f"{name} ({count})" for name, count in places.items())
    yield f"{len(rows)} cases at {places.sum()} places: {listed}."
    exact = rows[rows["kind"] == EXACT]
    yield from ("", "### Error of ln demand by distance of the nearest record", "")
    yield from error_table(dict(by_distance(exact)))
    yield from ("", "### Error of ln demand by earthquake, record within 20 km", "")
    near = exact[exact["distance"] <= NEAR]
    yield from error_table(dict(iter(near.groupby("event"))))
    yield from ("", "### Probability by kind of pair", "")
    yield from kind_table(rows)
    yield from ("", "### Reliability, record within 20 km", "")
    yield "Mean probability: share of larger demands ± deviation, places dependent (cases)."
    yield ""
    yield from bin_table(rows[rows["distance"] <= NEAR])


def error_table(groups: dict[str, pd.DataFrame]) -> Iterator[str]:
    """Yield a row per group: errors of the median demand over the predicted deviations."""
    yield (
        "| cases | number | places | mean error | rms error | predicted sigma | rms z "
        "| rms z, record alone | Brier score | record alone |"
    )
    yield "|---|---|---|---|---|---|---|---|---|---|"
    groups = groups | {"all, earthquakes alike": pd.concat(groups.values())}
    for label, some in groups.items():
        weight = weights(some) if label.startswith("all") else np.ones(len(some))
        error = np.log(some["true"]) - some["ln_median"]
        record = np.log(some["true"]) - some["ln_record"]
        places = len(some.groupby(["event", "station"]))
        cells = [f"{len(some) // len(GAPS)}", f"{places}"]
        cells += [f"{np.average(error, weights=weight):+.2f}", f"{rms(error, weight):.2f}"]
        cells += [f"{np.average(some['log_std'], weights=weight):.2f}"]
        cells += [f"{rms(error / some['log_std'], weight):.2f}"]
        cells += [f"{rms(record / some['record_log_std'], weight):.2f}"]
        cells += [f"{score:.4f}" for score in brier(some, weight)]
        yield f"| {label} | {' | '.join(cells)} |"


def kind_table(rows: pd.DataFrame) -> Iterator[str]:
    """Yield a row per kind of pair and distance: probability against outcome."""
    yield "| pairs | number | predicted | larger demands | Brier score |"
    yield "|---|---|---|---|---|"
    for title, some in (("within 20 km", rows[rows["distance"] <= NEAR]), ("all", rows)):
        for kind in KINDS:
            these = some[some["kind"] == kind]
            if these.empty:
                continue
            weight = weights(these)
            mean = np.average(these["probability"], weights=weight)
            share = np.average(these["true"] > these["gap"], weights=weight)
            score = brier(these, weight)[0]
            cells = f"{len(these)} | {mean:.3f} | {share:.3f} | {score:.4f}"
            yield f"| {kind}, {title} | {cells} |"


def bin_table(rows: pd.DataFrame) -> Iterator[str]:
    """Yield a row per bin of probability, with the kinds of pairs side by side."""
    yield "| probability | " + " | ".join(KINDS) + " |"
    yield "|---|" + "---|" * len(KINDS)
    tables = [bins(rows[rows["kind"] == kind]) for kind in KINDS]
    for low in sorted(set().union(*(table.index for table in tables))):
        cells = []
        for table in tables:
            known = low in table.index
            cells.append(_cell(table.loc[low]) if known else "")
        yield f"| {low:.1f} to {low + 0.1:.1f} | {' | '.join(cells)} |"


def _cell(row: pd.Series) -> str:
    """Return mean probability, observed share, its deviation and the number of cases of a bin."""
    return f"{row['predicted']:.2f}: {row['share']:.2f} ± {row['doubt']:.2f} ({row['cases']:.0f})"


if __name__ == "__main__":
    main()
