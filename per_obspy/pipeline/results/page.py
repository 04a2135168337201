"""Data of ``report.html``, gathered from the results in the output folder."""

import csv
import math
from collections.abc import Mapping, Sequence
from importlib.metadata import version
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
import pandas as pd
import pyarrow.parquet as pq

from per_obspy.checks import FloatArray
from per_obspy.config import Run
from per_obspy.jobs.station import FinishedStation
from per_obspy.pipeline.results.layer_sources import outlines_beside
from per_obspy.pipeline.results.page_drawings import page_drawings
from per_obspy.pipeline.results.run_facts import event_of_run, revision_of_run
from per_obspy.pipeline.results.station_facts import pair_histories, station_rows
from per_obspy.report.overview import Region
from per_obspy.report.page.building_outlines import read_outlines
from per_obspy.report.page.coast import lines_around
from per_obspy.report.page.content import (
    BUILDING_KINDS,
    MOST_ROWS,
    REJECTED_COLUMNS,
    PageData,
)
from per_obspy.report.page.document import write_page
from per_obspy.report.page.export_columns import MOST_COLUMNS
from per_obspy.report.page.first_screen import Event, PageBuildings
from per_obspy.report.page.tally import PAGE_PAIRS, PairTally
from per_obspy.report.page.texts import LANGUAGES, Language
from per_obspy.report.summary.statements import event_sentences, station_sentences
from per_obspy.report.summary.wording import WORDING
from per_obspy.tables.coverage import Coverage
from per_obspy.tables.ranked.ranked_table import RankedTable
from per_obspy.tables.totals import areas_of

#: Column of the neighbours of a building that can hit it.
HIT = "neighbours_that_can_hit"


def worst_pairs(table: RankedTable, settings: Run) -> pd.DataFrame:
    """Return the worst pairs of a risk table with all columns and their areas."""
    # The leading columns are those of the package, those of the inventory follow
    area = [settings.totals.area] if settings.totals.area else []
    names = table.schema.names[: 2 * MOST_COLUMNS]
    worst = table.first(PAGE_PAIRS, [*names, *area])
    return worst.assign(area=areas_of(worst, settings.totals, settings.totals.area or ""))


def write_run_page(
    settings: Run,
    folder: Path,
    stations: Sequence[FinishedStation],
    found: tuple[PairTally, pd.DataFrame, pd.DataFrame, Coverage],
    simulated: bool,
) -> None:
    """
    Write ``report.html`` of a run.

    Parameters
    ----------
    settings : Run
        Settings of the finished run.
    folder : Path
        Of the results; its tables of stations, rejections and buildings are read.
    stations : sequence of FinishedStation
        With station files.
    found : (PairTally, DataFrame, DataFrame, Coverage)
        Counts of all pairs, the worst pairs, totals by area, and rows that are left out.
    simulated : bool
        Whether the motion is simulated.
    """
    tally, worst, areas, coverage = found
    # Files that the stages before have written
    region = Region(settings.name, tuple(settings.screening.classes), simulated, pd.DataFrame())
    # Sentences are made of tables, and the map of pairs
    table = station_rows(folder / "stations.csv", stations)
    event = _run_event(settings, folder, region, stations, table)
    rejected, rejections = _rejected(folder / "rejected.csv")
    data = PageData(
        title=region.title,
        language=settings.report.language,
        simulated=simulated,
        classes=tuple(region.classes),
        event=event,
        tally=tally,
        worst=worst,
        stations=table,
        areas=areas,
        rejected=rejected,
        rejections=rejections,
        buildings=_buildings(folder / "buildings.parquet"),
        outlines=_outlines(_outlines_of(settings, folder), worst),
        lines=lines_around(*(_column(worst, name) for name in ("longitude", "latitude"))),
        histories=pair_histories(worst, stations),
        provenance=_provenance(settings),
        coverage=coverage,
        drawings=page_drawings(settings, worst, stations),
    )
    write_page(data, folder / "report.html")


def _known(settings: Run, folder: Path, region: Region) -> Mapping[str, Any]:
    """Return the facts of the earthquake of a run for the page."""
    shakemap = settings.records.shakemap if settings.records else None
    return event_of_run(folder / "run.json", region, shakemap)


def _outlines_of(settings: Run, folder: Path) -> Path | None:
    """Return the file of outlines of a run: in its folder if footprints are configured."""
    given = settings.pairs.file if settings.pairs else None
    return outlines_beside(given, folder / "pairs.parquet")


class TableSources(NamedTuple):
    """
    Data of a page other than its pairs, for a screening by a spectrum or an ensemble.

    Attributes
    ----------
    region : Region
        Title, classes, epicentre, and whether the motion is simulated.
    language : Language
        Of the page.
    source : sequence of str
        Sentences on the spectrum or the scenarios, instead of an earthquake.
    stations, areas : DataFrame
        Stations and totals; may be empty.
    outlines : Path or None
        GeoParquet with the outlines of the buildings.
    histories : mapping of int to dict
        Rank -> history of a pair.
    notes : sequence of str
        Sentences on omitted contents, and on those from other sources.
    kind : str
        ``design`` or ``ensemble``.
    coverage : Coverage
        Rows of the pair tables, and those that are left out.
    """

    region: Region
    language: Language
    source: Sequence[str]
    stations: pd.DataFrame
    areas: pd.DataFrame
    outlines: Path | None
    histories: Mapping[int, dict[str, Any]]
    notes: Sequence[str]
    kind: str
    coverage: Coverage


def write_table_page(
    folder: Path, sources: TableSources, tally: PairTally, worst: pd.DataFrame
) -> None:
    """
    Write ``report.html`` of a screening by a design spectrum, or of an ensemble.

    Parameters
    ----------
    folder : Path
        Of the results.
    sources : TableSources
        Everything that is in no table of pairs.
    tally : PairTally
        Counts of all pairs.
    worst : DataFrame
        The worst pairs.
    """
    # Files that the stages before have written
    rejected, rejections = _rejected(folder / "rejected.csv")
    region, stations = sources.region, sources.stations
    # Stations of all scenarios; a spectrum has none
    used = int((stations["state"] == "used").sum()) if "state" in stations else 0
    counts = used, len(stations) - used
    # The sentences replace an earthquake
    data = PageData(
        title=region.title,
        language=sources.language,
        simulated=region.simulated,
        classes=tuple(region.classes),
        event=Event("", "", math.nan, None, *counts, " ".join(sources.source)),
        tally=tally,
        worst=worst,
        stations=stations,
        areas=sources.areas,
        rejected=rejected,
        rejections=rejections,
        buildings=None,
        outlines=_outlines(sources.outlines, worst),
        lines=lines_around(*(_column(worst, name) for name in ("longitude", "latitude"))),
        histories=sources.histories,
        provenance=[*_made(sources.language), *_content(sources.notes, sources.language)],
        coverage=sources.coverage,
        kind=sources.kind,
    )
    write_page(data, folder / "report.html")


def _content(notes: Sequence[str], language: Language) -> list[tuple[str, str]]:
    """Return sentences on the content of the page as a row of its provenance."""
    return [(WORDING[language]["page_content"], " ".join(notes))] if notes else []


def _column(table: pd.DataFrame, name: str) -> FloatArray:
    """Return a column of numbers, all NaN if the table lacks it."""
    return table[name].to_numpy(dtype=np.float64) if name in table else np.empty(0)


def _event(
    stations: Sequence[FinishedStation],
    table: pd.DataFrame,
    known: Mapping[str, Any],
    language: Language,
) -> Event:
    """Return the facts of the earthquake that its file and the spectra of the stations hold."""
    facts = [station.spectra.attrs for station in stations if station.spectra is not None]
    starts = [str(found["time_coverage_start"]) for found in facts if _is_dated(found)]
    start = min(starts)[:19].replace("T", " ") if starts else ""
    # Stations that are rejected have no spectra
    used = int((table["state"] == "used").sum()) if "state" in table else len(facts)
    return Event(
        start=start,
        time=str(known.get("time") or "")[:19].replace("T", " "),
        magnitude=_number(known.get("magnitude")),
        place=_place(facts, known),
        used=used,
        missing=len(table) - used,
        # A ShakeMap is named in sentences of its own
        source=" ".join(_map_sentences(known, table, language)),
    )


def _run_event(
    settings: Run,
    folder: Path,
    region: Region,
    stations: Sequence[FinishedStation],
    table: pd.DataFrame,
) -> Event:
    """Return the earthquake of a run with number and time of its revision, as far as known."""
    known = _known(settings, folder, region)
    event = _event(stations, table, known, settings.report.language)
    found = revision_of_run(folder / "run.json")
    number = settings.report.revision or found.number
    return event._replace(revision=number, revised=found.time, event_id=found.event_id)


def _map_sentences(known: Mapping[str, Any], table: pd.DataFrame, language: Language) -> list[str]:
    """Return sentences on earthquake, ShakeMap and stations; none where there is no map."""
    if not known.get("map"):
        return []
    return [*event_sentences(known, language), *station_sentences(table, language)]


def _place(
    facts: Sequence[Mapping[str, Any]], known: Mapping[str, Any]
) -> tuple[float, float, float] | None:
    """Return longitude, latitude and depth of the hypocentre, None if it is unknown."""
    places = [_coordinates(found, "hypocentre_") for found in facts]
    for place in (*places, _coordinates(known, "")):
        # The depth may be unknown
        if np.isfinite(place[:2]).all():
            return place
    return None


def _coordinates(facts: Mapping[str, Any], prefix: str) -> tuple[float, float, float]:
    """Return longitude, latitude and depth of keys with a prefix, NaN where missing."""
    longitude, latitude, depth = (
        _number(facts.get(f"{prefix}{axis}")) for axis in ("longitude", "latitude", "depth")
    )
    return longitude, latitude, depth


def _number(value: Any) -> float:
    """Return a number of a status file, NaN where there is none."""
    is_number = isinstance(value, int | float | np.number) and not isinstance(value, bool)
    return float(value) if is_number else math.nan


def _is_dated(facts: Mapping[str, Any]) -> bool:
    """Return whether a record has a start time; undated ones begin in 1970."""
    return str(facts.get("time_coverage_start", "1970")) >= "1971"


def _rejected(path: Path) -> tuple[pd.DataFrame, int]:
    """Return the first rows of the table of rejections, and its number of rows."""
    # Line by line: rejections of a large inventory are many
    rows, count = list[list[str]](), 0
    if path.is_file():
        with path.open(encoding="utf-8", newline="") as file:
            lines = csv.reader(file)
            next(lines, None)
            for row in lines:
                count += 1
                if count <= MOST_ROWS and len(row) == len(REJECTED_COLUMNS):
                    rows.append(row)
    return pd.DataFrame(rows, columns=list(REJECTED_COLUMNS)), count


def _buildings(path: Path) -> PageBuildings | None:
    """Return the worst buildings with the columns of the page, None without a table."""
    if not path.is_file():
        return None
    with pq.ParquetFile(path, pre_buffer=False) as file:
        names = [name for name in BUILDING_KINDS if name in file.schema_arrow.names]
        first = next(file.iter_batches(PAGE_PAIRS, columns=names), None)
        if first is None:
            return None
        # Counted in all rows: the page shows the worst only
        hit = _hit(file) if HIT in names else None
    return PageBuildings(first.to_pandas(), hit)


def _hit(file: pq.ParquetFile) -> int:
    """Return the number of buildings that a neighbour can hit."""
    batches = file.iter_batches(columns=[HIT])
    return sum(
        int(np.count_nonzero(batch[HIT].to_numpy(zero_copy_only=False) > 0)) for batch in batches
    )


def _outlines(beside: Path | None, worst: pd.DataFrame) -> list[tuple[str, list[float]]]:
    """Return the outlines of the buildings of the worst pairs, if the pairs came with them."""
    if beside is None or "building_id_1" not in worst:
        return []
    names = pd.concat([worst["building_id_1"], worst["building_id_2"]]).dropna().astype(str)
    return read_outlines(beside, names.unique().tolist())


def _provenance(settings: Run) -> list[tuple[str, str]]:
    """Return the provenance of the results as pairs of title and text."""
    # Everything else is in the files next to the page
    texts = LANGUAGES[settings.report.language]
    has_map = settings.records is not None and settings.records.shakemap is not None
    notes = [WORDING[settings.report.language]["page_shakemap"]] if has_map else []
    exact = {"exact": settings.screening.exact, "output": settings.output.name}
    return [
        *_made(settings.report.language),
        (texts["files"], texts["files_list"]),
        (texts["configuration"], ", ".join(f"{name}: {value}" for name, value in exact.items())),
        *_content(notes, settings.report.language),
    ]


def _made(language: Language) -> list[tuple[str, str]]:
    """Return time and software versions of the page as pairs of title and text."""
    texts = LANGUAGES[language]
    return [
        (texts["made_with"], f"per_obspy {version('per_obspy')}"),
    ]
