"""Last stage of a run: the risk table and the spectra become totals, figures, layers and a page."""

import math
from collections.abc import Mapping, Sequence
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd
import xarray as xr

from per_obspy.config import Run
from per_obspy.report.evaluation import write_evaluation
from per_obspy.report.page.document import write_page
from per_obspy.report.page.packing import MOST_COLUMNS
from per_obspy.report.pair_figure import DIFFERING, differing_pair, draw_record_to_pair
from per_obspy.report.results import Region, Results
from per_obspy.report.statements import event_sentences
from per_obspy.report.tally import PAGE_PAIRS
from per_obspy.report.texts import LANGUAGES
from per_obspy.results.coverage import Coverage
from per_obspy.results.ranked_table import RankedTable, ranked_table, table_files
from per_obspy.runs.provenance import RunContext
from per_obspy.runs.results.drawings import page_drawings, station_rows
from per_obspy.runs.results.report_files import (
    Report,
    TableReader,
    content_note,
    made_with,
    needed_columns,
    outlines_beside,
    read_table,
    with_areas,
    with_page_data,
    write_files,
    write_overview,
)
from per_obspy.runs.results.run_facts import event_of_run, read_stations, revision_of_run
from per_obspy.runs.stations import simulated_motion
from per_obspy.runs.tasks.ground_files import read_station_once
from per_obspy.runs.tasks.station import FinishedStation
from per_obspy.spectra.storage import region as joined_spectra
from per_obspy.spectra.storage import write_spectra


def reported(
    context: RunContext, stations: Sequence[FinishedStation], coverage: Coverage
) -> Report:
    """
    Write the report of the results in the output folder.

    A figure or layer that cannot be made is left out, the tables are written.

    Parameters
    ----------
    context : RunContext
        The run; without a risk table in its folder only the spectra can be reported.
    stations : sequence of FinishedStation
        With station files.
    coverage : Coverage
        Rows of the pair tables, and those that are left out.
    """
    settings, folder = context.settings, context.folder
    # Spectra of all stations, as far as there are any
    context.progress("report", 0, 1)
    report, spectra = Report([], []), None
    usable = [station.spectra for station in stations if station.spectra is not None]
    if stations:
        spectra = joined_spectra(iter(usable))
        write_spectra(spectra, folder / "spectra.nc")
        report.outputs.append(folder / "spectra.nc")
    # Without a pair there is no risk table
    if table_files(folder):
        shakemap = settings.records.shakemap if settings.records else None
        region = run_region(settings, simulated_motion(settings, stations), spectra)
        known = event_of_run(folder / "run.json", region, shakemap)
        if region.epicentre is None:
            region = region._replace(epicentre=_epicentre(known))
        _report_pairs(settings, folder, stations, coverage, region, known, report)
    context.progress("report", 1, 1)
    return report


def run_region(settings: Run, simulated: bool, spectra: xr.Dataset | None) -> Region:
    """Return title, classes, stations and epicentre of a run, as far as its spectra know them."""
    places = pd.DataFrame({"longitude": [], "latitude": []}, dtype="float64")
    epicentre = None
    if spectra is not None:
        names = ("longitude", "latitude")
        places = pd.DataFrame({name: spectra[name].to_numpy() for name in names})
        attributes = [f"hypocentre_{name}" for name in names]
        if set(attributes) <= set(spectra.attrs):
            epicentre = (float(spectra.attrs[attributes[0]]), float(spectra.attrs[attributes[1]]))
    # Classes in their order, the worst first
    return Region(settings.name, list(settings.screening.classes), simulated, places, epicentre)


def _epicentre(known: Mapping[str, Any]) -> tuple[float, float] | None:
    """Return longitude and latitude of an epicentre, None if unknown."""
    longitude, latitude = _number(known.get("longitude")), _number(known.get("latitude"))
    is_known = math.isfinite(longitude) and math.isfinite(latitude)
    return (longitude, latitude) if is_known else None


def _report_pairs(
    settings: Run,
    folder: Path,
    stations: Sequence[FinishedStation],
    coverage: Coverage,
    region: Region,
    known: Mapping[str, Any],
    report: Report,
) -> None:
    """Write everything that shows pairs; ``known`` are the facts of the earthquake."""
    outlines = outlines_beside(
        settings.pairs.file if settings.pairs else None, folder / "pairs.parquet"
    )
    results = _results_of_run(settings, folder, coverage, region, known)
    results, reader = _with_pairs(settings, folder, results, outlines, report)
    # Totals, layers and the comparison with observations need no record
    report.outputs.extend(write_evaluation(reader.observed, folder, region.simulated))
    write_files(results, folder, settings.spreadsheet, report)
    write_overview(results, folder, report)
    _draw_worst_pair(differing_pair(results.worst), stations, folder, report)
    with report.tried(folder / "report.html"):
        page = with_page_data(results, folder, outlines)
        drawings = page_drawings(settings, results.worst, stations)
        table = station_rows(folder / "stations.csv", stations)
        write_page(replace(page, stations=table, drawings=drawings), folder / "report.html")


def _with_pairs(
    settings: Run, folder: Path, results: Results, outlines: Path | None, report: Report
) -> tuple[Results, TableReader]:
    """Return the results with their pairs, and what was read of all."""
    is_whole = settings.geopackage or settings.spreadsheet
    columns = None if is_whole else needed_columns(settings.totals)
    with ranked_table(table_files(folder), columns) as table:
        # The pieces may lack columns, the pairs of the page have all of them
        results = replace(results, worst=worst_pairs(table, settings))
        reader = TableReader(results.region.classes, settings.totals, table.pairs, is_whole=False)
        results = read_table(
            results, reader, table.pieces(), folder, outlines, settings.geopackage, report
        )
    if settings.pmtiles:
        _write_tiles(folder / "risk.gpkg", report)
    return results, reader


def _write_tiles(package: Path, report: Report) -> None:
    """Write the layers of a GeoPackage as vector tiles, with the optional libraries."""
    from per_obspy.report.layers.tiles import tile_files, write_tiles

    # A GeoPackage that could not be written is a fault already
    for layer, path in tile_files(package).items() if package in report.outputs else ():
        with report.tried(path):
            write_tiles(package, layer, path)


def _results_of_run(
    settings: Run, folder: Path, coverage: Coverage, region: Region, known: Mapping[str, Any]
) -> Results:
    """Return the results of a run but for its table of pairs."""
    language, revision = settings.report.language, revision_of_run(folder / "run.json")
    number = settings.report.revision or revision.number
    return Results(
        "risk", region, coverage, language, revision._replace(number=number),
        event_sentences(known, language), stations=read_stations(folder / "stations.csv"),
        provenance=_provenance(settings), class_limits=settings.screening.classes,
    )  # fmt: skip


def worst_pairs(table: RankedTable, settings: Run) -> pd.DataFrame:
    """Return the worst pairs of a risk table with all columns and their areas."""
    # The leading columns are those of the package, those of the inventory follow
    area = [settings.totals.area] if settings.totals.area else []
    names = table.schema.names[: 2 * MOST_COLUMNS]
    worst = table.first(PAGE_PAIRS, [*names, *area])
    return with_areas(worst, worst, settings.totals)


def _draw_worst_pair(
    worst: "pd.Series[Any] | None",
    stations: Sequence[FinishedStation],
    folder: Path,
    report: Report,
) -> None:
    """Draw a pair from its record to pounding; nothing where no pair has a record."""
    if worst is None:
        return
    # Only here a station's motion is needed again
    name, walk = worst["station"].strip("."), folder / "figures" / "worst_pair.png"
    (station,) = (station for station in stations if station.shard and station.shard.stem == name)
    assert station.shard is not None  # chosen so
    motion = read_station_once(station.shard, station.hash)
    with report.tried(walk):
        draw_record_to_pair(motion, worst, walk, note=DIFFERING)


def _number(value: Any) -> float:
    """Return a number of a status file, NaN where there is none."""
    is_number = isinstance(value, int | float | np.number) and not isinstance(value, bool)
    return float(value) if is_number else math.nan


def _provenance(settings: Run) -> list[tuple[str, str]]:
    """Return the provenance of the results as pairs of title and text."""
    # Everything else is in the files next to the page
    language = settings.report.language
    texts = LANGUAGES[language]
    has_map = settings.records is not None and settings.records.shakemap is not None
    exact = {"exact": settings.screening.exact, "output": settings.output.name}
    return [
        made_with(language),
        (texts["files"], texts["files_list"]),
        (texts["configuration"], ", ".join(f"{name}: {value}" for name, value in exact.items())),
        content_note([LANGUAGES[language]["page_shakemap"]] if has_map else [], language),
    ]
