"""Page, summary and layers of a screening by a design spectrum or an ensemble."""

from collections.abc import Callable, Iterator, Mapping, Sequence
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
import pandas as pd

from per_obspy.config import Design, Ensemble, Totals
from per_obspy.config import Screening as ScreeningSettings
from per_obspy.errors import CatalogError
from per_obspy.pipeline.results.faults import Report
from per_obspy.pipeline.results.layer_sources import layer_paths, outlines_beside, write_map_layers
from per_obspy.pipeline.results.page import TableSources, write_table_page
from per_obspy.pipeline.results.result_files import Screening, write_results
from per_obspy.pipeline.results.scenario_runs import ScenarioRuns
from per_obspy.pipeline.results.table_notes import Notes
from per_obspy.report.overview import Region, draw_overview
from per_obspy.report.page.export_columns import MOST_COLUMNS
from per_obspy.report.page.tally import PAGE_PAIRS
from per_obspy.report.summary.wording import WORDING
from per_obspy.report.words import name_text
from per_obspy.screening.by_spectrum.design_table import DESIGN
from per_obspy.screening.ranking import pounding_state, risk_class
from per_obspy.screening.region.ensemble import ensemble_columns
from per_obspy.screening.uncertainty.unknown_gaps import UNKNOWN_CLASS
from per_obspy.tables.coverage import Coverage
from per_obspy.tables.totals import (
    CountedTotals,
    areas_of,
    piece_totals,
    region_totals,
    write_totals,
)

#: Pairs that a figure shows, evenly from all of them.
SHOWN = 20_000

#: Columns of the pairs that a figure shows, as far as the table has them.
_SHOWN_COLUMNS = ("rank", "pair_id", "risk_class", "longitude", "latitude", "demand", "gap")


class _Asked(NamedTuple):
    """
    Wanted results, their folder, and all data that are not in the table.

    Attributes
    ----------
    folder, stem : Path and str
        Of the results.
    settings : Design or Ensemble
        Which files and language are wanted.
    region : Region
        Title, classes, and whether the motion is simulated.
    source : list of str
        Sentences on the spectrum or the scenarios.
    totals : Totals
        Areas.
    outlines : Path or None
        Of the buildings.
    notes : list of str
        Sentences on contents that the page omits.
    own : sequence of str
        Columns that are computed, besides those of a risk table.
    coverage : Coverage
        Rows of the pair tables, and those that are left out.
    stations : DataFrame
        Of all scenarios; empty for a spectrum.
    histories : callable
        Returns the histories of the worst pairs; None where there is no record.
    """

    folder: Path
    stem: str
    settings: Design | Ensemble
    region: Region
    source: list[str]
    totals: Totals
    outlines: Path | None
    notes: list[str]
    own: Sequence[str]
    coverage: Coverage
    stations: pd.DataFrame = pd.DataFrame()
    histories: Callable[[pd.DataFrame], Mapping[int, dict[str, Any]]] | None = None


class _Noted(NamedTuple):
    """Summaries of a table that is read in pieces."""

    notes: Notes
    shown: list[pd.DataFrame]
    worst: list[pd.DataFrame]
    totals: CountedTotals


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
        From :func:`per_obspy.screening.by_spectrum.design_table.design_table`.
    coverage : Coverage
        Rows of the pair table, and those that are left out.
    folder : Path
        Of the results.

    Raises
    ------
    CatalogError
        If the pair table lacks the column of the areas.
    """
    report = Report([], [])
    if table.empty:
        return report
    # The spectrum replaces the earthquake
    if settings.totals.area and settings.totals.area not in table:
        reason = f"area: the pair table has no column {settings.totals.area!r}"
        raise CatalogError("totals", reason)
    texts, spectrum = WORDING[settings.report.language], name_text(settings.spectrum.name)
    title = texts["spectrum_title"].format(name=spectrum)
    asked = _Asked(
        folder,
        "design",
        settings,
        _region(title, list(settings.screening.classes), simulated=False),
        [texts["spectrum"].format(name=spectrum)],
        settings.totals,
        outlines_beside(settings.pairs),
        [texts["page_design"]],
        list(DESIGN),
        coverage,
    )
    _write(asked, iter([_with_flags(table)]), len(table), report)
    return report


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
    report = Report([], [])
    if not coverage.screened:
        return report
    # The scenarios replace the earthquake
    limits, texts = ScreeningSettings(), WORDING[settings.report.language]
    asked = _Asked(
        folder,
        "ensemble",
        settings,
        _region(settings.name, list(limits.classes), simulated),
        [texts["scenarios"].format(count=len(settings.weights)), *_scenario_sentences(settings)],
        runs.totals(),
        runs.outlines(),
        [texts["page_ensemble"]],
        list(ensemble_columns(settings.weights, settings.yearly)),
        coverage,
        runs.stations(),
        runs.histories,
    )
    pieces = (_with_classes(piece, limits) for piece in runs.pieces(folder / "ensemble.parquet"))
    _write(asked, pieces, coverage.screened, report)
    return report


def _scenario_sentences(settings: Ensemble) -> list[str]:
    """Return sentences that name the first scenarios."""
    key = "scenario_rate" if settings.yearly else "scenario_weight"
    sentence, first = WORDING[settings.report.language][key], [*settings.weights.items()][:5]
    return [sentence.format(name=name_text(name), value=f"{value:g}") for name, value in first]


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


def _write(asked: _Asked, pieces: Iterator[pd.DataFrame], pairs: int, report: Report) -> None:
    """Read a table once, and write page, summary, totals, layers and workbook."""
    found = _Noted(Notes(asked.region.classes), [], [], CountedTotals())
    noted = _noted(pieces, pairs, asked, found)
    if asked.settings.geopackage:
        files = layer_paths(asked.folder, asked.stem)
        with report.tried(*files):
            write_map_layers(
                noted,
                asked.region,
                asked.stations,
                lambda: region_totals(found.totals, asked.totals),
                asked.outlines,
                files,
            )
    # All rows, or those that a layer left when it failed
    for _ in noted:
        continue
    areas = region_totals(found.totals, asked.totals).table
    write_totals(areas, asked.folder / "totals.csv")
    report.outputs.append(asked.folder / "totals.csv")
    _write_files(asked, found, areas, report)


def _write_files(asked: _Asked, found: _Noted, areas: pd.DataFrame, report: Report) -> None:
    """Write summary, KML, workbook, page and overview."""
    # Each file is tried by itself
    folder, region = asked.folder, _with_stations(asked)
    # Pairs of figures, and those of the page
    points = pd.concat(found.shown, ignore_index=True)
    worst = pd.concat(found.worst, ignore_index=True)
    language = asked.settings.report.language
    # Files of every screening, then the page
    written = Screening(
        folder,
        asked.stem,
        region,
        asked.source,
        asked.coverage,
        asked.settings.spreadsheet,
        language,
        asked.own,
        asked.stations,
        areas,
    )
    write_results(written, found.notes, points, report)
    with report.tried(folder / "report.html"):
        histories = asked.histories(worst) if asked.histories else {}
        sources = TableSources(
            region,
            language,
            asked.source,
            asked.stations,
            areas,
            asked.outlines,
            histories,
            asked.notes,
            asked.stem,
            asked.coverage,
        )
        write_table_page(folder, sources, found.notes.tally, worst)
    # The map of all pairs
    overview = folder / "figures" / "overview.png"
    with report.tried(overview):
        draw_overview(points, region, overview)


def _with_stations(asked: _Asked) -> Region:
    """Return the region with the stations of all scenarios that are used."""
    if asked.stations.empty:
        return asked.region
    used = asked.stations[asked.stations["state"] == "used"]
    return asked.region._replace(stations=used[["longitude", "latitude"]].drop_duplicates())


def _noted(
    pieces: Iterator[pd.DataFrame], pairs: int, asked: _Asked, found: _Noted
) -> Iterator[pd.DataFrame]:
    """Yield the pieces of a table, and add each to the summaries."""
    step, totals = -(-pairs // SHOWN), asked.totals
    classes = [*asked.region.classes, UNKNOWN_CLASS]
    for piece in pieces:
        before = found.notes.tally.pairs
        found.notes.add(piece)
        # Figures show some of the pairs
        columns = [name for name in _SHOWN_COLUMNS if name in piece]
        found.shown.append(piece.loc[piece["rank"].to_numpy() % step == 1 % step, columns])
        # Totals by area, and the rest from the same pass
        found.totals.append(piece_totals(piece, totals, classes))
        # The page holds the worst pairs, with all columns for its export
        kept = piece.head(max(PAGE_PAIRS - before, 0))
        columns = [str(name) for name in kept if name != "area"][: 2 * MOST_COLUMNS]
        found.worst.append(kept[columns].assign(area=areas_of(kept, totals, totals.area or "")))
        yield piece
