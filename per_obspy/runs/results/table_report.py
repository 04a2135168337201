"""Page, summary and layers of a screening by a design spectrum or an ensemble."""

from collections.abc import Callable, Iterator, Sequence
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd

from per_obspy.config import Design, Ensemble
from per_obspy.config import Screening as ScreeningSettings
from per_obspy.errors import CatalogError
from per_obspy.report.page.document import write_page
from per_obspy.report.results import Drawings, Region, Results, Revision
from per_obspy.report.texts import LANGUAGES, marks
from per_obspy.report.words import name_text
from per_obspy.results.coverage import Coverage
from per_obspy.runs.results.report_files import (
    Report,
    TableReader,
    content_note,
    made_with,
    outlines_beside,
    read_table,
    with_page_data,
    write_files,
    write_overview,
)
from per_obspy.runs.results.scenario_runs import ScenarioRuns
from per_obspy.screening.design import DESIGN
from per_obspy.screening.ensemble import ensemble_columns
from per_obspy.screening.ranking import pounding_state, risk_class


def report_design(
    settings: Design, table: pd.DataFrame, coverage: Coverage, folder: Path
) -> Report:
    """
    Write page, summary, totals, overview, KML, layers and workbook of a design spectrum.

    Parameters
    ----------
    settings : Design
        Settings of the screening.
    table : DataFrame
        From :func:`per_obspy.screening.design.design_table`.
    coverage : Coverage
        Rows of the pair table, and those that are left out.
    folder : Path
        Of the results.

    Raises
    ------
    CatalogError
        If the pair table lacks the column of the areas.
    """
    if table.empty:
        return Report([], [])
    if settings.totals.area and settings.totals.area not in table:
        reason = f"area: the pair table has no column {settings.totals.area!r}"
        raise CatalogError("totals", reason)
    # The spectrum replaces the earthquake
    classes, language = list(settings.screening.classes), settings.report.language
    texts, spectrum = LANGUAGES[language], name_text(settings.spectrum.name)
    region = _region(texts["spectrum_title"].format(name=spectrum), classes, simulated=False)
    source = [texts["spectrum"].format(name=spectrum)]
    results = Results(
        "design", region, coverage, language, Revision(), source,
        own=list(DESIGN), class_limits=settings.screening.classes,
        provenance=[made_with(language), content_note([texts["page_design"]], language)],
    )  # fmt: skip
    reader, outlines = (
        TableReader(classes, settings.totals, len(table)),
        outlines_beside(settings.pairs),
    )
    return _write(settings, results, reader, iter([_with_flags(table)]), folder, outlines)


def _with_flags(table: pd.DataFrame) -> pd.DataFrame:
    """Return a table with the flags of its pairs that need no record."""
    derived = np.where(table["derived"].fillna("") != "", "derived_inputs", "")
    touching = np.where(table["gap"] == 0.0, "touching", "")
    return table.assign(flags=pd.Series(derived + " " + touching, table.index).str.strip())


def report_ensemble(
    settings: Ensemble, folder: Path, simulated: bool, coverage: Coverage, runs: ScenarioRuns
) -> Report:
    """
    Write page, summary, totals, overview, KML, layers and workbook of an ensemble.

    An ensemble has no limits of states and classes of its own: those of a run's defaults are used.

    Parameters
    ----------
    settings : Ensemble
        Settings of the ensemble.
    folder : Path
        With ``ensemble.parquet``.
    simulated : bool
        Whether the motion of a scenario is simulated.
    coverage : Coverage
        Rows of the pair tables, and those that have a probability in every scenario.
    runs : ScenarioRuns
        Runs of the scenarios, which know buildings, stations and records.
    """
    if not coverage.screened:
        return Report([], [])
    # The scenarios replace the earthquake
    limits, language = ScreeningSettings(), settings.report.language
    texts, classes, stations = LANGUAGES[language], list(limits.classes), runs.stations()
    region = _region(settings.name, classes, simulated, stations)
    source = _scenario_sentences(settings)
    results = Results(
        "ensemble", region, coverage, language, Revision(), source,
        stations=stations, own=list(ensemble_columns(settings.weights, settings.yearly)),
        class_limits=limits.classes,
        provenance=[made_with(language), content_note([texts["page_ensemble"]], language)],
    )  # fmt: skip
    # Buildings, outlines and histories are those of the runs
    pieces = (_with_classes(piece, limits) for piece in runs.pieces(folder / "ensemble.parquet"))
    reader = TableReader(classes, runs.totals(), coverage.screened)
    return _write(settings, results, reader, pieces, folder, runs.outlines(), runs.histories)


def _write(
    settings: Design | Ensemble,
    results: Results,
    reader: TableReader,
    pieces: Iterator[pd.DataFrame],
    folder: Path,
    outlines: Path | None,
    histories: Callable[[pd.DataFrame], dict[int, dict[str, Any]]] | None = None,
) -> Report:
    """Read a table once, and write everything that shows it."""
    report = Report([], [])
    results = read_table(results, reader, pieces, folder, outlines, settings.geopackage, report)
    write_files(results, folder, settings.spreadsheet, report)
    # The page has the histories of the worst pairs, if there are records
    with report.tried(folder / "report.html"):
        drawings = Drawings(histories=histories(results.worst) if histories else {})
        page = with_page_data(results, folder, outlines, settings.report, report)
        write_page(replace(page, drawings=drawings), folder / "report.html")
    write_overview(results, folder, report)
    return report


def _scenario_sentences(settings: Ensemble) -> list[str]:
    """Return sentences on the number of scenarios, and the names of the first ones."""
    language = settings.report.language
    texts, first = LANGUAGES[language], [*settings.weights.items()][:5]
    sentence = texts["scenario_rate" if settings.yearly else "scenario_weight"]
    # Weights with all their digits
    values = (f"{value:g}".translate(marks(language)) for _, value in first)
    named = zip(first, values, strict=True)
    return [
        texts["scenarios"].format(count=len(settings.weights)),
        *(sentence.format(name=name_text(name), value=value) for (name, _), value in named),
    ]


def _region(
    title: str, classes: Sequence[str], simulated: bool, stations: pd.DataFrame | None = None
) -> Region:
    """Return a region with the stations that are used, if there are any."""
    places = pd.DataFrame({"longitude": [], "latitude": []}, dtype="float64")
    if stations is not None and len(stations):
        used = stations[stations["state"] == "used"]
        places = used[["longitude", "latitude"]].drop_duplicates()
    return Region(title, classes, simulated, places)


def _with_classes(piece: pd.DataFrame, limits: ScreeningSettings) -> pd.DataFrame:
    """Return rows of an ensemble with the state and class of their probability and severity."""
    chance = piece["probability"].to_numpy(np.float64)
    velocity = piece["expected_impact_velocity"].to_numpy(np.float64)
    return piece.assign(
        state=pounding_state(chance, limits.states),
        risk_class=risk_class(velocity, limits.classes),
    )
