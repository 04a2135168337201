"""Results for people of screenings without stations of their own: design spectrum, ensemble."""

from collections.abc import Iterator, Mapping, Sequence
from pathlib import Path
from typing import NamedTuple

import numpy as np
import pandas as pd

from per_obspy.config import Design, Ensemble
from per_obspy.config import Screening as ScreeningSettings
from per_obspy.pipeline.results.faults import Report
from per_obspy.pipeline.results.layer_sources import layer_paths, outlines_beside, write_map_layers
from per_obspy.pipeline.results.page import write_table_page
from per_obspy.pipeline.results.result_files import Screening, write_results
from per_obspy.pipeline.results.table_notes import Notes
from per_obspy.report.overview import Region, draw_overview
from per_obspy.report.page.content import PAIR_KINDS
from per_obspy.report.page.tally import PAGE_PAIRS
from per_obspy.report.words import name_text
from per_obspy.screening.ranking import pounding_state, risk_class
from per_obspy.tables.risk import ranked_table

#: Pairs that a figure shows, evenly from all of them.
SHOWN = 20_000

#: Columns of the pairs that a figure shows, as far as the table has them.
_SHOWN_COLUMNS = ("rank", "pair_id", "risk_class", "longitude", "latitude", "demand", "gap")


class _Asked(NamedTuple):
    """Which results are wanted, and where."""

    folder: Path
    stem: str
    geopackage: bool
    spreadsheet: bool
    outlines: Path | None = None


def report_design(settings: Design, table: pd.DataFrame, folder: Path) -> Report:
    """
    Write summary, overview, KML, layers and workbook of a screening by a design spectrum.

    Parameters
    ----------
    settings : Design
        What was asked.
    table : DataFrame
        From :func:`per_obspy.screening.by_spectrum.design_table.design_table`.
    folder : Path
        Of the results.
    """
    report = Report([], [])
    if table.empty:
        return report
    # The spectrum stands for the earthquake
    spectrum = name_text(settings.spectrum.name)
    title = f"Design spectrum {spectrum}"
    source = [f"Screened by the spectrum {spectrum}, not by an earthquake."]
    outlines = outlines_beside(settings.pairs)
    asked = _Asked(folder, "design", settings.geopackage, settings.spreadsheet, outlines)
    region = _region(title, list(settings.screening.classes), simulated=False)
    _write(asked, region, source, iter([table]), len(table), report)
    return report


def report_ensemble(settings: Ensemble, folder: Path, simulated: bool, pairs: int) -> Report:
    """
    Write summary, overview, KML, layers and workbook of an ensemble.

    An ensemble has no limits of states and classes of its own: those of a run's defaults are used.

    Parameters
    ----------
    settings : Ensemble
        What was asked.
    folder : Path
        With ``ensemble.parquet``.
    simulated : bool
        Whether the motion of a scenario is simulated.
    pairs : int
        Number of pairs.
    """
    report = Report([], [])
    if not pairs:
        return report
    # The scenarios stand for the earthquake
    limits, weights = ScreeningSettings(), settings.weights
    unit = "a year" if settings.yearly else "in weight"
    source = [f"{len(weights)} scenarios together.", *_scenario_sentences(weights, unit)]
    asked = _Asked(folder, "ensemble", settings.geopackage, settings.spreadsheet)
    region = _region(settings.name, list(limits.classes), simulated)
    with ranked_table(folder / "ensemble.parquet") as table:
        pieces = (_with_classes(piece, limits) for piece in table.pieces())
        _write(asked, region, source, pieces, pairs, report)
    return report


def _scenario_sentences(weights: Mapping[str, float], unit: str) -> list[str]:
    """Name the first scenarios."""
    return [f"{name_text(name)}: {weight:g} {unit}." for name, weight in [*weights.items()][:5]]


def _region(title: str, classes: Sequence[str], simulated: bool) -> Region:
    """Return a region without stations."""
    places = pd.DataFrame({"longitude": [], "latitude": []}, dtype="float64")
    return Region(title, classes, simulated, places)


def _with_classes(piece: pd.DataFrame, limits: ScreeningSettings) -> pd.DataFrame:
    """Return rows of an ensemble with the state and class of their probability and severity."""
    chance = piece["probability"].to_numpy(np.float64)
    velocity = piece["expected_impact_velocity"].to_numpy(np.float64)
    return piece.assign(
        state=pounding_state(chance, limits.states),
        risk_class=risk_class(velocity, limits.classes),
    )


def _write(
    asked: _Asked,
    region: Region,
    source: list[str],
    pieces: Iterator[pd.DataFrame],
    pairs: int,
    report: Report,
) -> None:
    """Read a table once, and write everything that people look at."""
    notes, shown, folder = Notes(region.classes), list[pd.DataFrame](), asked.folder
    # Of all pairs, and of those that the page holds
    worst = list[pd.DataFrame]()
    noted = _kept(_noted(pieces, pairs, notes, shown), worst)
    if asked.geopackage:
        files, none = layer_paths(folder, asked.stem), pd.DataFrame()
        with report.tried(*files):
            write_map_layers(noted, region, none, lambda: None, asked.outlines, files)
    # All rows, or those that a layer left when it failed
    for _ in noted:
        continue
    points = pd.concat(shown, ignore_index=True)
    written = Screening(folder, asked.stem, region, source, asked.spreadsheet)
    write_results(written, notes, points, report)
    with report.tried(folder / "report.html"):
        found = pd.concat(worst, ignore_index=True)
        write_table_page(folder, region, source, notes.tally, found)
    overview = folder / "figures" / "overview.png"
    with report.tried(overview):
        draw_overview(points, region, overview)


def _kept(
    pieces: Iterator[pd.DataFrame], worst: list[pd.DataFrame]
) -> Iterator[pd.DataFrame]:
    """Yield pieces, and keep the pairs that the page holds."""
    rows = 0
    for piece in pieces:
        kept = piece.head(max(PAGE_PAIRS - rows, 0))
        worst.append(kept[[name for name in PAIR_KINDS if name in kept]])
        rows += len(kept)
        yield piece


def _noted(
    pieces: Iterator[pd.DataFrame], pairs: int, notes: Notes, shown: list[pd.DataFrame]
) -> Iterator[pd.DataFrame]:
    """Yield pieces, and note numbers, worst rows and the pairs of figures."""
    step = -(-pairs // SHOWN)
    for piece in pieces:
        notes.add(piece)
        columns = [name for name in _SHOWN_COLUMNS if name in piece]
        shown.append(piece.loc[piece["rank"].to_numpy() % step == 1 % step, columns])
        yield piece
