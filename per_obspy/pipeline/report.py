"""Last stage: the risk table and the spectra become totals, figures and layers for a map."""

import math
from collections import deque
from collections.abc import Iterator, Mapping, Sequence
from pathlib import Path
from typing import Any, NamedTuple

import pandas as pd
import xarray as xr

from per_obspy.config import Run
from per_obspy.errors import CatalogError
from per_obspy.jobs.ground_files import read_station_once
from per_obspy.jobs.station import FinishedStation
from per_obspy.pipeline.results.faults import Report
from per_obspy.pipeline.results.layer_sources import layer_paths, outlines_beside, write_map_layers
from per_obspy.pipeline.results.page import worst_pairs, write_run_page
from per_obspy.pipeline.results.result_files import Screening, write_results
from per_obspy.pipeline.results.run_facts import event_of_run, read_stations, revision_of_run
from per_obspy.pipeline.results.table_notes import Notes, needed_columns
from per_obspy.pipeline.stations import simulated_motion
from per_obspy.progress import Progress
from per_obspy.report.evaluation import write_evaluation
from per_obspy.report.overview import Region, draw_overview
from per_obspy.report.page.first_screen import revision_line
from per_obspy.report.page.tally import COUNTED, PairTally
from per_obspy.report.pair_figure import draw_record_to_pair
from per_obspy.report.summary.statements import event_sentences
from per_obspy.report.words import number
from per_obspy.screening.uncertainty.unknown_gaps import UNKNOWN_CLASS
from per_obspy.spectra.storage import region, write_spectra
from per_obspy.tables.coverage import Coverage
from per_obspy.tables.ranked.ranked_files import table_files
from per_obspy.tables.ranked.ranked_table import RankedTable, ranked_table
from per_obspy.tables.totals import (
    CountedTotals,
    RegionTotals,
    piece_totals,
    region_totals,
    totals_columns,
    with_buildings,
    write_totals,
)

#: Pairs that a figure shows, evenly from all of them: marks of more would cover each other.
SHOWN = 20_000

#: Columns of the pairs that a figure shows.
SHOWN_COLUMNS = ["rank", "pair_id", "risk_class", "longitude", "latitude", "demand", "gap"]

#: Columns of the pairs whose pounding was observed.
OBSERVED_COLUMNS = ["observed", "state", "probability"]


class RiskSummary(NamedTuple):
    """
    Data of the report from the risk table, read in one pass.

    Attributes
    ----------
    worst : Series or None
        The worst pair that has a record; None if no pair has one.
    shown : DataFrame
        Pairs that a figure shows: all of a small table, every tenth or so of a large one.
    observed : DataFrame
        Pairs whose pounding was observed.
    totals : RegionTotals
        By area.
    notes : Notes
        Numbers of the whole table, and its worst rows.
    page : (PairTally, DataFrame)
        Counts and worst pairs of the page.
    """

    worst: pd.Series | None
    shown: pd.DataFrame
    observed: pd.DataFrame
    totals: RegionTotals
    notes: Notes
    page: tuple[PairTally, pd.DataFrame]


class _Pieces(NamedTuple):
    """Summaries of the pieces of a risk table, in their order."""

    rows: list[int]
    first_named: list[int]
    shown: list[pd.DataFrame]
    observed: list[pd.DataFrame]
    totals: CountedTotals
    notes: Notes


def reported(
    settings: Run,
    folder: Path,
    stations: Sequence[FinishedStation],
    coverage: Coverage,
    progress: Progress,
) -> Report:
    """
    Write the report of the results in the output folder.

    A figure or layer that cannot be made is left out, the tables are written.

    Parameters
    ----------
    settings : Run
        Settings of the run.
    folder : Path
        Of the results; without a risk table only the spectra can be reported.
    stations : sequence of FinishedStation
        With station files.
    coverage : Coverage
        Rows of the pair tables, and those that are left out.
    progress : callable
        Called when it begins and ends.
    """
    progress("report", 0, 1)
    simulated = simulated_motion(settings, stations)
    report, risk = Report([], []), table_files(folder)
    spectra = _write_spectra(stations, folder / "spectra.nc") if stations else None
    if spectra is not None:
        report.outputs.append(folder / "spectra.nc")
    # Without a pair there is no risk table
    if risk:
        place = _region(settings, simulated, spectra, folder)
        summary = _summary(settings, risk, folder, place, report)
        # Totals, layers and the comparison with observations need no record
        write_totals(summary.totals.table, folder / "totals.csv")
        report.outputs.append(folder / "totals.csv")
        report.outputs.extend(write_evaluation(summary.observed, folder, simulated))
        _write_summary(settings, summary, folder, place, coverage, report)
        _draw_figures(summary, place, stations, folder, report)
        with report.tried(folder / "report.html"):
            found = (*summary.page, summary.totals.table, coverage)
            write_run_page(settings, folder, stations, found, simulated)
    progress("report", 1, 1)
    return report


def _region(settings: Run, simulated: bool, spectra: xr.Dataset | None, folder: Path) -> Region:
    """Return title, classes, stations and epicentre of a run."""
    places = pd.DataFrame({"longitude": [], "latitude": []}, dtype="float64")
    epicentre = None
    if spectra is not None:
        names = ("longitude", "latitude")
        places = pd.DataFrame({name: spectra[name].to_numpy() for name in names})
        attributes = [f"hypocentre_{name}" for name in names]
        if set(attributes) <= set(spectra.attrs):
            epicentre = (float(spectra.attrs[attributes[0]]), float(spectra.attrs[attributes[1]]))
    # Classes in their order, the worst first
    classes = list(settings.screening.classes)
    region = Region(settings.name, classes, simulated, places, epicentre)
    if epicentre is None:
        region = region._replace(epicentre=_epicentre_of(_event(settings, folder, region)))
    return region


def _event(settings: Run, folder: Path, place: Region) -> dict[str, Any]:
    """Return the facts of the earthquake, of records or of the ShakeMap."""
    shakemap = settings.records.shakemap if settings.records else None
    return event_of_run(folder / "run.json", place, shakemap)


def _epicentre_of(event: Mapping[str, Any]) -> tuple[float, float] | None:
    """Return longitude and latitude of an epicentre, None if unknown."""
    longitude, latitude = (number(event, name) for name in ("longitude", "latitude"))
    known = math.isfinite(longitude) and math.isfinite(latitude)
    return (longitude, latitude) if known else None


def _write_summary(
    settings: Run,
    summary: RiskSummary,
    folder: Path,
    place: Region,
    coverage: Coverage,
    report: Report,
) -> None:
    """Write summary, KML and workbook."""
    language = settings.report.language
    revision = revision_of_run(folder / "run.json")
    number = settings.report.revision or revision.number
    # Which result this is comes first, then the earthquake
    line = revision_line(number, revision.time, revision.event_id, language)
    source = [f"{line}."] if line else []
    source += event_sentences(_event(settings, folder, place), language)
    stations = read_stations(folder / "stations.csv")
    written = Screening(folder, "risk", place, source, coverage, settings.spreadsheet, language)
    written = written._replace(stations=stations, areas=summary.totals.table)
    write_results(written, summary.notes, summary.shown, report)


def _write_spectra(stations: Sequence[FinishedStation], path: Path) -> xr.Dataset:
    """Write the spectra of all stations, and return them."""
    spectra = region(station.spectra for station in stations if station.spectra is not None)
    write_spectra(spectra, path)
    return spectra


def _summary(
    settings: Run, risk: Sequence[Path], folder: Path, place: Region, report: Report
) -> RiskSummary:
    """Read the risk table once, and write its layers; return totals, worst pairs and notes."""
    is_whole = settings.geopackage or settings.spreadsheet
    columns = None if is_whole else _needed_columns(settings)
    # The layer takes the pieces one by one, and so they are noted on the way
    pieces = _Pieces([], [], [], [], CountedTotals(), Notes(list(settings.screening.classes)))
    with ranked_table(risk, columns) as table:
        listed = worst_pairs(table, settings)
        noted = _noted(table, settings, pieces)
        if settings.geopackage:
            files = layer_paths(folder, "risk")
            with report.tried(*files):
                _write_layers(settings, noted, pieces, place, files)
        # All rows, or those that a layer left when it failed; a table that fails is a fault
        deque(noted, maxlen=0)
        if sum(pieces.rows) != table.pairs:
            raise CatalogError(str(risk[0]), "cannot be read to its end: run again")
        worst = table.row(min(pieces.first_named)) if pieces.first_named else None
    return RiskSummary(
        worst,
        pd.concat(pieces.shown).sort_values("rank", ignore_index=True),
        pd.concat(pieces.observed or [pd.DataFrame()], ignore_index=True),
        _totals(settings, pieces, folder),
        pieces.notes,
        (pieces.notes.tally, listed),
    )


def _needed_columns(settings: Run) -> list[str]:
    """Return the columns of the risk table that the report needs for every pair."""
    figures = [*SHOWN_COLUMNS, *OBSERVED_COLUMNS, *totals_columns(settings.totals)]
    return needed_columns([*figures, *COUNTED])


def _totals(settings: Run, pieces: _Pieces, folder: Path) -> RegionTotals:
    """Return the totals of all pieces, with the buildings of each area where they are known."""
    totals = region_totals(pieces.totals, settings.totals)
    return totals._replace(table=with_buildings(totals.table, folder / "buildings.parquet"))


def _write_layers(
    settings: Run,
    noted: Iterator[pd.DataFrame],
    pieces: _Pieces,
    place: Region,
    files: tuple[Path, Path, Path],
) -> None:
    """Write all layers; totals are available after the last piece."""
    write_map_layers(
        noted,
        place,
        read_stations(files[0].with_name("stations.csv")),
        lambda: _totals(settings, pieces, files[0].parent),
        outlines_beside(
            settings.pairs.file if settings.pairs else None, files[0].with_name("pairs.csv")
        ),
        files,
    )


def _noted(table: RankedTable, settings: Run, found: _Pieces) -> Iterator[pd.DataFrame]:
    """Yield the pieces of a risk table, and add each to the summaries of the report."""
    step = -(-table.pairs // SHOWN)
    classes = [*settings.screening.classes, UNKNOWN_CLASS]
    for piece in table.pieces():
        found.rows.append(len(piece))
        rank = piece["rank"].to_numpy()
        # Rows with a record
        named = rank[(piece["station"] != "").to_numpy()]
        found.first_named.extend(named[:1].tolist())
        found.shown.append(piece.loc[rank % step == 1 % step, SHOWN_COLUMNS])
        if "observed" in piece:
            observed = piece["observed"].notna()
            found.observed.append(piece.loc[observed, OBSERVED_COLUMNS])
        found.totals.append(piece_totals(piece, settings.totals, classes))
        found.notes.add(piece)
        yield piece


def _draw_figures(
    summary: RiskSummary,
    place: Region,
    stations: Sequence[FinishedStation],
    folder: Path,
    report: Report,
) -> None:
    """Draw the region, and the worst pair that has a record."""
    walk, overview = (folder / "figures" / name for name in ("worst_pair.png", "overview.png"))
    with report.tried(overview):
        draw_overview(summary.shown, place, overview)
    worst = summary.worst
    if worst is None:
        return
    # Only here a station's motion is needed again
    name = worst["station"].strip(".")
    (station,) = (station for station in stations if station.shard and station.shard.stem == name)
    assert station.shard is not None  # chosen so
    motion = read_station_once(station.shard, station.hash)
    with report.tried(walk):
        draw_record_to_pair(motion, worst, walk)
