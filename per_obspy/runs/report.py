"""
Last stage of every screening: what it found becomes one `Results`, of which the files are written.

A run, a design spectrum and an ensemble differ in where their pairs, stations and sentences come
from; everything after that is :func:`per_obspy.report.files.write_report`.
"""

import math
from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import ExitStack, contextmanager
from dataclasses import replace
from importlib.metadata import version
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd
import xarray as xr

from per_obspy.config import Design, Ensemble, Run, Totals
from per_obspy.config import Screening as ScreeningSettings
from per_obspy.errors import CatalogError
from per_obspy.files import remove_file
from per_obspy.report.files import (
    Explained,
    PairTable,
    Report,
    needed_columns,
    outlines_beside,
    with_areas,
    write_report,
)
from per_obspy.report.hazard_figure import draw_gaps_for_target
from per_obspy.report.page.document import page_columns
from per_obspy.report.pair_figure import differing_pair
from per_obspy.report.results import Drawings, Region, Results, Revision
from per_obspy.report.statements import event_sentences
from per_obspy.report.tally import PAGE_PAIRS
from per_obspy.report.texts import LANGUAGES, marks, written
from per_obspy.report.words import name_text
from per_obspy.results.coverage import Coverage
from per_obspy.results.ranked_table import RankedTable, ranked_table, table_files
from per_obspy.results.totals import totals_columns
from per_obspy.runs.output_folder import WORST_PAIRS
from per_obspy.runs.provenance import RunContext
from per_obspy.runs.run_facts import event_of_run, read_stations, revision_of_run
from per_obspy.runs.scenario_runs import ScenarioRuns
from per_obspy.runs.stations import file_stem, simulated_motion
from per_obspy.runs.tasks.ground_files import GroundFiles, read_station_once
from per_obspy.runs.tasks.station import FinishedStation
from per_obspy.runs.worst_pairs import page_drawings, read_drawings, write_drawings
from per_obspy.screening.columns import HAZARD, known_column
from per_obspy.screening.design import DESIGN
from per_obspy.screening.ensemble import ensemble_columns
from per_obspy.screening.ranking import (
    NO_VERDICT,
    UNKNOWN_CLASS,
    UNKNOWN_STATE,
    pounding_state,
    risk_class,
)
from per_obspy.spectra.storage import region as joined_spectra
from per_obspy.spectra.storage import write_spectra


@contextmanager
def explaining(
    context: RunContext, stations: Sequence[FinishedStation], ground: GroundFiles
) -> Iterator[Explained]:
    """
    Begin histories and sensitivity of the worst pairs of a run in other processes.

    The block receives the function that waits for them, writes them and returns them; a fault
    leaves the page without them. None without a risk table.
    """
    path, files, begun = context.folder / WORST_PAIRS, table_files(context.folder), Report([], [])
    if not files:
        yield lambda _: Drawings()
        return
    # What an earlier table was explained by
    remove_file(path)
    # What cannot begin is noted where the others are written
    with ExitStack() as stack:
        finished: Callable[[], Drawings] | None = None
        with begun.tried(path):
            # Columns of the package only
            with ranked_table(files) as table:
                names = [name for name in table.schema.names if known_column(name)]
                worst = table.first(PAGE_PAIRS, names)
            drawings = page_drawings(context.settings, worst, stations, ground, context.workers)
            finished = stack.enter_context(drawings)

        def written(report: Report) -> Drawings:
            report.faults += begun.faults
            if finished is not None:
                with report.tried(path):
                    write_drawings(finished(), path)
            return read_drawings(path)

        yield written


def reported(
    context: RunContext,
    stations: Sequence[FinishedStation],
    coverage: Coverage,
    explained: Explained | None = None,
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
    explained : callable, optional
        From :func:`explaining`; otherwise what an earlier run has written explains the worst pairs.
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
        results = _results_of_run(settings, folder, stations, coverage, spectra)
        _report_pairs(settings, folder, stations, results, report, explained)
    context.progress("report", 1, 1)
    return report


def _results_of_run(
    settings: Run,
    folder: Path,
    stations: Sequence[FinishedStation],
    coverage: Coverage,
    spectra: xr.Dataset | None,
) -> Results:
    """Return the results of a run but for its table of pairs."""
    shakemap = settings.records.shakemap if settings.records else None
    region = run_region(settings, simulated_motion(settings, stations), spectra)
    known = event_of_run(folder / "run.json", region, shakemap)
    if region.epicentre is None:
        region = region._replace(epicentre=_epicentre(known))
    language, revision = settings.report.language, revision_of_run(folder / "run.json")
    number = settings.report.revision or revision.number
    return Results(
        "risk", region, coverage, language, revision._replace(number=number),
        event_sentences(known, language),
        stations=read_stations(folder / "stations.csv"),
        drawings=read_drawings(folder / WORST_PAIRS), provenance=_provenance(settings),
        class_limits=settings.screening.classes,
    )  # fmt: skip


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


def _number(value: Any) -> float:
    """Return a number of a status file, NaN where there is none."""
    is_number = isinstance(value, int | float | np.number) and not isinstance(value, bool)
    return float(value) if is_number else math.nan


def _report_pairs(
    settings: Run,
    folder: Path,
    stations: Sequence[FinishedStation],
    results: Results,
    report: Report,
    explained: Explained | None,
) -> None:
    """Write everything that shows the pairs of a run."""
    is_whole = settings.geopackage or settings.spreadsheet
    columns = None if is_whole else needed_columns(settings.totals)
    outlines = outlines_beside(
        settings.pairs.file if settings.pairs else None, folder / "pairs.parquet"
    )
    with ranked_table(table_files(folder), columns) as table:
        # The pieces lack columns of the page
        worst = worst_pairs(table, settings.totals)
        pairs = _pair_table(settings, table.pieces(), table.pairs, settings.totals, outlines)
        results = replace(results, worst=worst, record=_record(worst, stations))
        write_report(results, pairs, folder, report, explained)
    if settings.pmtiles:
        _write_tiles(folder / "risk.gpkg", report)


def _pair_table(
    settings: Run | Design | Ensemble,
    pieces: Iterator[pd.DataFrame],
    pairs: int,
    totals: Totals,
    outlines: Path | None,
) -> PairTable:
    """Return the pairs of a screening with the settings of what is written of them."""
    files = settings.geopackage, settings.spreadsheet
    return PairTable(pieces, pairs, totals, outlines, settings.report, *files)


def _write_tiles(package: Path, report: Report) -> None:
    """Write the layers of a GeoPackage as vector tiles, with the optional libraries."""
    from per_obspy.report.layers.tiles import tile_files, write_tiles

    # A GeoPackage that could not be written is a fault already
    for layer, path in tile_files(package).items() if package in report.outputs else ():
        with report.tried(path):
            write_tiles(package, layer, path)


def worst_pairs(table: RankedTable, totals: Totals) -> pd.DataFrame:
    """Return the worst pairs of a risk table with the columns of the page and their areas."""
    names = [*page_columns(table.schema.names), *totals_columns(totals)]
    worst = table.first(PAGE_PAIRS, names)
    return with_areas(worst, worst, totals)


def _record(worst: pd.DataFrame, stations: Sequence[FinishedStation]) -> xr.Dataset | None:
    """Return the station file of the pair that is drawn, None where no pair has a record."""
    pair = differing_pair(worst)
    if pair is None:
        return None
    name = file_stem(pair["station"])
    # Only here a station's motion is needed again
    (station,) = (station for station in stations if station.shard and station.shard.stem == name)
    assert station.shard is not None  # chosen so
    return read_station_once(station.shard, station.hash)


def _provenance(settings: Run) -> list[tuple[str, str]]:
    """Return the provenance of the results as pairs of title and text."""
    # Everything else is in the files next to the page
    texts = LANGUAGES[settings.report.language]
    has_map = settings.records is not None and settings.records.shakemap is not None
    exact = {"exact": settings.screening.exact, "output": settings.output.name}
    return [
        _made_with(texts),
        (texts["files"], texts["files_list"]),
        (texts["configuration"], ", ".join(f"{name}: {value}" for name, value in exact.items())),
        _content_note([texts["page_shakemap"]] if has_map else [], texts),
    ]


def _made_with(texts: Mapping[str, str]) -> tuple[str, str]:
    """Return the software version as title and text of the provenance."""
    return texts["made_with"], f"per_obspy {version('per_obspy')}"


def _content_note(notes: Sequence[str], texts: Mapping[str, str]) -> tuple[str, str]:
    """Return sentences on the content of the page, and the source of its towns, as provenance."""
    return texts["page_content"], " ".join([*notes, texts["page_places"]])


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
    report = Report([], [])
    if table.empty:
        return report
    if (area := settings.totals.area) and area not in table:
        raise CatalogError("totals", f"area: the pair table has no column {area!r}")
    # The spectrum replaces the earthquake
    classes, language = list(settings.screening.classes), settings.report.language
    texts, kind = LANGUAGES[language], "hazard" if "gap_for_target" in table else "spectrum"
    title, source = _spectrum_texts(settings, kind)
    region = _region(title, classes, simulated=False)
    results = Results(
        "design", region, coverage, language, Revision(), [source],
        own=[*DESIGN, *HAZARD], class_limits=settings.screening.classes,
        provenance=_made_of(texts, "page_design"),
    )  # fmt: skip
    pieces, outlines = iter([_with_flags(table)]), outlines_beside(settings.pairs)
    pairs = _pair_table(settings, pieces, len(table), settings.totals, outlines)
    write_report(results, pairs, folder, report)
    if kind == "hazard":
        _draw_gaps(settings, folder / "design.parquet", report)
    return report


def _spectrum_texts(settings: Design, kind: str) -> tuple[str, str]:
    """Return the title of a page and its sentence on a spectrum or hazard."""
    texts = LANGUAGES[settings.report.language]
    facts = {"name": name_text(settings.spectrum.name), "years": _target_years(settings)}
    return texts[f"{kind}_title"].format(**facts), texts[kind].format(**facts)


def _draw_gaps(settings: Design | Ensemble, table: Path, report: Report) -> None:
    """Draw the gaps for the target rate."""
    figure = table.parent / "figures" / "gap_for_target.png"
    with report.tried(figure):
        gaps = pd.read_parquet(table, columns=["gap", "gap_for_target", "annual_probability"])
        draw_gaps_for_target(gaps, settings.target_rate, figure)


def _made_of(texts: Mapping[str, str], content: str) -> list[tuple[str, str]]:
    """Return with what a page was made, and the text on its content."""
    return [_made_with(texts), _content_note([texts[content]], texts)]


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
        Rows of the pair tables, and those that at least one scenario has.
    runs : ScenarioRuns
        Runs of the scenarios, which know buildings, stations and records.
    """
    report, table = Report([], []), folder / "ensemble.parquet"
    if not coverage.screened:
        return report
    # The scenarios replace the earthquake
    limits, language = ScreeningSettings(), settings.report.language
    texts, classes, stations = LANGUAGES[language], [*limits.classes, NO_VERDICT], runs.stations()
    region = _region(settings.name, classes, simulated, stations)
    _store_histories(runs, table, folder / WORST_PAIRS, report)
    results = Results(
        "ensemble", region, coverage, language, Revision(), _scenario_sentences(settings),
        stations=stations, drawings=read_drawings(folder / WORST_PAIRS),
        own=list(ensemble_columns(settings.weights, settings.yearly)), class_limits=limits.classes,
        provenance=_made_of(texts, "page_ensemble"),
    )  # fmt: skip
    # Buildings and outlines are those of the runs
    pieces = (_with_classes(piece, limits) for piece in runs.pieces(table))
    pairs = _pair_table(settings, pieces, coverage.screened, runs.totals(), runs.outlines())
    write_report(results, pairs, folder, report)
    if settings.yearly:
        _draw_gaps(settings, table, report)
    return report


def _store_histories(runs: ScenarioRuns, table: Path, path: Path, report: Report) -> None:
    """Write the histories of the worst pairs of an ensemble."""
    # Those of an earlier table are no answer where this fails
    remove_file(path)
    with report.tried(path), ranked_table([table]) as ranked:
        write_drawings(Drawings(histories=runs.histories(ranked)), path)


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
        *([texts["target"].format(years=_target_years(settings))] if settings.yearly else []),
    ]


def _target_years(settings: Design | Ensemble) -> str:
    """Return the mean time between two contacts that are accepted."""
    return written(1.0 / settings.target_rate, 0, settings.report.language)


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
    """Return rows of an ensemble with state, class, and the flag of pairs that a scenario lacks."""
    chance = piece["probability"].to_numpy(np.float64)
    velocity = piece["weighted_velocity"].to_numpy(np.float64)
    # Without a probability there is neither
    unknown, flags = np.isnan(chance), piece.get("flags", pd.Series("", piece.index))
    lacks = pd.Series(unknown & piece["gap"].notna(), piece.index)
    severity = risk_class(velocity, limits.classes)
    no_class = unknown | flags.str.contains("unknown_gap").to_numpy(bool)
    return piece.assign(
        state=np.where(unknown, UNKNOWN_STATE, pounding_state(chance, limits.states)),
        risk_class=np.where(lacks, NO_VERDICT, np.where(no_class, UNKNOWN_CLASS, severity)),
        flags=flags.where(~lacks, (flags + " missing_scenario").str.strip()),
    )
