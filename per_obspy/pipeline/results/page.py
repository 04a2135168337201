"""Everything that the page of a run is made of, gathered from the results in the output folder."""

import csv
import math
from collections.abc import Mapping, Sequence
from importlib.metadata import version
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd
import pyarrow.parquet as pq

from per_obspy.checks import FloatArray
from per_obspy.config import Run
from per_obspy.jobs.station import FinishedStation
from per_obspy.pipeline.results.layer_sources import outlines_beside
from per_obspy.pipeline.results.page_drawings import histories, page_drawings
from per_obspy.pipeline.results.run_facts import event_of_run, revision_of_run
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
from per_obspy.report.page.first_screen import Event
from per_obspy.report.page.tally import PAGE_PAIRS, PairTally
from per_obspy.report.page.texts import LANGUAGES, Language
from per_obspy.tables.risk import RankedTable
from per_obspy.tables.totals import areas_of

#: Period and damping of the spectra in the table of stations.
SHOWN_PERIOD, SHOWN_DAMPING = 1.0, 0.05

def worst_pairs(table: RankedTable, settings: Run) -> pd.DataFrame:
    """Return the worst pairs of a risk table with all columns and their areas."""
    # The leading columns are those of the package, those of the inventory follow
    area = [settings.totals.area] if settings.totals.area else []
    names = table.file.schema_arrow.names[: 2 * MOST_COLUMNS]
    worst = table.first(PAGE_PAIRS, [*names, *area])
    return worst.assign(area=areas_of(worst, settings.totals, settings.totals.area or ""))


def write_run_page(
    settings: Run,
    folder: Path,
    stations: Sequence[FinishedStation],
    found: tuple[PairTally, pd.DataFrame, pd.DataFrame],
    simulated: bool,
) -> None:
    """
    Write ``report.html`` of a run.

    Parameters
    ----------
    settings : Run
        What was done.
    folder : Path
        Of the results; its tables of stations, rejections and buildings are read.
    stations : sequence of FinishedStation
        With shards.
    found : (PairTally, DataFrame, DataFrame)
        Counts of all pairs, the worst pairs, and totals by area.
    simulated : bool
        Whether the motion is simulated.
    """
    tally, worst, areas = found
    # Files that the stages before have written
    region = Region(settings.name, tuple(settings.screening.classes), simulated, pd.DataFrame())
    # Sentences are made of tables, and the map of pairs
    table = _station_table(folder / "stations.csv", stations)
    event = _event(stations, table, event_of_run(folder / "run.json", region))
    rejected, rejections = _rejected(folder / "rejected.csv")
    data = PageData(
        title=region.title,
        language=settings.report.language,
        simulated=simulated,
        classes=tuple(region.classes),
        event=_with_revision(event, settings, folder),
        tally=tally,
        worst=worst,
        stations=table,
        areas=areas,
        rejected=rejected,
        rejections=rejections,
        buildings=_buildings(folder / "buildings.parquet"),
        outlines=_outlines(settings, folder, worst),
        lines=lines_around(*(_column(worst, name) for name in ("longitude", "latitude"))),
        histories=histories(worst, stations),
        provenance=_provenance(settings),
        drawings=page_drawings(settings, worst, stations),
    )
    write_page(data, folder / "report.html")


def write_table_page(
    folder: Path, region: Region, source: Sequence[str], tally: PairTally, worst: pd.DataFrame
) -> None:
    """
    Write ``report.html`` of a screening without stations: by a design spectrum, or an ensemble.

    Parameters
    ----------
    folder : Path
        Of the results.
    region : Region
        Title, classes, and whether the motion is simulated.
    source : sequence of str
        Sentences on what stands for the earthquake.
    tally : PairTally
        Counts of all pairs.
    worst : DataFrame
        The worst pairs.
    """
    # There are no stations, totals and rows of buildings
    rejected, rejections = _rejected(folder / "rejected.csv")
    longitude, latitude = _column(worst, "longitude"), _column(worst, "latitude")
    data = PageData(
        title=region.title,
        language="en",
        simulated=region.simulated,
        classes=tuple(region.classes),
        event=Event("", "", math.nan, None, 0, 0, " ".join(source)),
        tally=tally,
        worst=worst,
        stations=pd.DataFrame(),
        areas=pd.DataFrame(),
        rejected=rejected,
        rejections=rejections,
        buildings=None,
        outlines=[],
        lines=lines_around(longitude, latitude),
        histories={},
        provenance=_made("en"),
    )
    write_page(data, folder / "report.html")


def _column(table: pd.DataFrame, name: str) -> FloatArray:
    """Return a column of numbers, none of them if the table lacks it."""
    return table[name].to_numpy(dtype=np.float64) if name in table else np.empty(0)


def _event(
    stations: Sequence[FinishedStation], table: pd.DataFrame, known: Mapping[str, Any]
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
    )


def _with_revision(event: Event, settings: Run, folder: Path) -> Event:
    """Return an event with number and time of the revision, if the run has them."""
    number, time = revision_of_run(folder / "run.json")
    return event._replace(revision=settings.report.revision or number, revised=time)


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
    """Return longitude, latitude and depth of names with a prefix, NaN where one is missing."""
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


def _station_table(path: Path, stations: Sequence[FinishedStation]) -> pd.DataFrame:
    """Return the table of the stations with PER and SD of each at one period, cm."""
    if not path.is_file():
        return pd.DataFrame()
    texts = dict.fromkeys(("station", "state", "warnings", "rejected"), str)
    table = pd.read_csv(path, dtype=texts, keep_default_na=True)
    # Largest of the horizontals
    for name in ("per", "sd"):
        values = {
            station.station: _at_one_period(station.spectra, name)
            for station in stations
            if station.spectra is not None
        }
        table[name] = table["station"].map(values)
    return table


def _at_one_period(spectra: Any, name: str) -> float:
    """Return the largest spectral value of a station over its horizontals, cm."""
    chosen = spectra[name].sel(damping=SHOWN_DAMPING, method="nearest")
    values = chosen.sel(period=SHOWN_PERIOD, method="nearest").to_numpy()
    horizontals = values[: int(spectra.attrs.get("horizontals", values.size))]
    return 100.0 * float(np.nanmax(horizontals)) if horizontals.size else math.nan


def _rejected(path: Path) -> tuple[pd.DataFrame, int]:
    """Return the first rows of the table of rejections, and how many it has."""
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


def _buildings(path: Path) -> pd.DataFrame | None:
    """Return the worst buildings with the columns of the page, None without a table."""
    if not path.is_file():
        return None
    with pq.ParquetFile(path) as file:
        names = [name for name in BUILDING_KINDS if name in file.schema_arrow.names]
        batches = file.iter_batches(PAGE_PAIRS, columns=names)
        first = next(batches, None)
    return None if first is None else first.to_pandas()


def _outlines(settings: Run, folder: Path, worst: pd.DataFrame) -> list[tuple[str, list[float]]]:
    """Return the outlines of the buildings of the worst pairs, if the pairs came with them."""
    given = settings.pairs.file if settings.pairs else None
    # Of a layer, a run keeps pairs and outlines in its folder
    beside = outlines_beside(given, folder / "pairs.parquet")
    if beside is None or "building_id_1" not in worst:
        return []
    names = pd.concat([worst["building_id_1"], worst["building_id_2"]]).dropna().astype(str)
    return read_outlines(beside, names.unique().tolist())


def _provenance(settings: Run) -> list[tuple[str, str]]:
    """Return how the results were made."""
    # Everything else is in the files beside the page
    texts = LANGUAGES[settings.report.language]
    exact = {"exact": settings.screening.exact, "output": settings.output.name}
    return [
        *_made(settings.report.language),
        (texts["files"], texts["files_list"]),
        (texts["configuration"], ", ".join(f"{name}: {value}" for name, value in exact.items())),
    ]


def _made(language: Language) -> list[tuple[str, str]]:
    """Return when and with what the page was made."""
    texts = LANGUAGES[language]
    return [
        (texts["made_with"], f"per_obspy {version('per_obspy')}"),
    ]
