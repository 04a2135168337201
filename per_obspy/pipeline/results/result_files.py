"""Summary, KML and workbook of a screening of any kind."""

from collections.abc import Sequence
from importlib.metadata import version
from pathlib import Path
from typing import NamedTuple

import pandas as pd
import pyarrow.parquet as pq

from per_obspy.pipeline.results.faults import Report
from per_obspy.pipeline.results.table_notes import Notes
from per_obspy.report.layers.kml import ROWS as KML_ROWS
from per_obspy.report.layers.kml import write_kml
from per_obspy.report.layers.spreadsheet import ROWS as SHEET_ROWS
from per_obspy.report.layers.spreadsheet import Sheet, write_workbook
from per_obspy.report.overview import Region
from per_obspy.report.page.texts import Language
from per_obspy.report.summary.one_page import write_page
from per_obspy.report.summary.spoken_text import write_text
from per_obspy.report.summary.statements import LISTED, SummaryFacts, place_text
from per_obspy.report.summary.wording import WORDING
from per_obspy.report.words import name_text
from per_obspy.screening.columns import column_table, known_column
from per_obspy.tables.coverage import Coverage
from per_obspy.tables.ranked.ranked_files import table_name
from per_obspy.tables.station_summary import COLUMNS as STATION_COLUMNS


class Screening(NamedTuple):
    """
    Facts of a screening that are not in its table.

    Attributes
    ----------
    folder : Path
        Of the results.
    stem : str
        Name of its files: ``risk``, ``design`` or ``ensemble``.
    region : Region
        Title, classes, stations and epicentre.
    source : list of str
        Sentences on the earthquake, spectrum or scenarios.
    coverage : Coverage
        Rows of the pair tables, and those that are left out.
    spreadsheet : bool
        Whether a workbook is written.
    language : Language
        Of the summary.
    own : sequence of str
        Columns of pairs that are computed, besides those of every risk table.
    stations : DataFrame
        Rows of ``stations.csv``; empty where there are none.
    areas : DataFrame
        Totals by area; empty where there are none.
    """

    folder: Path
    stem: str
    region: Region
    source: list[str]
    coverage: Coverage
    spreadsheet: bool = False
    language: Language = "en"
    own: Sequence[str] = ()
    stations: pd.DataFrame = pd.DataFrame()
    areas: pd.DataFrame = pd.DataFrame()


def write_results(screening: Screening, notes: Notes, shown: pd.DataFrame, report: Report) -> None:
    """
    Write summary, KML and workbook; note each file that cannot be written as a fault.

    Parameters
    ----------
    screening : Screening
        Facts that are not in the table.
    notes : Notes
        Of all rows of the table.
    shown : DataFrame
        Pairs of the map of the summary.
    report : Report
        Takes files and faults.
    """
    folder, stem = screening.folder, screening.stem
    worst = notes.worst
    buildings = _worst_buildings(folder / "buildings.parquet")
    facts = _facts(screening, notes, worst, buildings)
    # Each file by itself: one that fails leaves the others
    with report.tried(folder / "summary.txt"):
        write_text(facts, folder / "summary.txt")
    with report.tried(folder / "summary.pdf"):
        write_page(facts, shown, folder / "summary.pdf")
    with report.tried(folder / f"{stem}.kml"):
        title, classes = screening.region.title, screening.region.classes
        note = _extent(screening, notes, KML_ROWS)
        write_kml(worst, classes, title, folder / f"{stem}.kml", note)
    # The workbook needs an optional library
    if screening.spreadsheet:
        with report.tried(folder / f"{stem}.xlsx"):
            note = _extent(screening, notes, SHEET_ROWS)
            sheets = _sheets(screening, worst, buildings, note)
            write_workbook(sheets, folder / f"{stem}.xlsx")


def _facts(
    screening: Screening, notes: Notes, worst: pd.DataFrame, buildings: pd.DataFrame
) -> SummaryFacts:
    """Return the facts of the summary."""
    # The area with most pounding is worth a name where there are several
    area, totals, texts = "", screening.areas, WORDING[screening.language]
    if len(totals) > 1:
        most = totals.iloc[int(totals["expected_pounding"].argmax())]
        place = place_text(float(most["latitude"]), float(most["longitude"]), 4, screening.language)
        area = texts["around"].format(name=name_text(most["area"]), place=place)
    made = texts["made"].format(version=version("per_obspy"), table=screening.stem)
    listed = worst.head(LISTED), buildings.head(LISTED)
    return SummaryFacts(
        screening.region,
        screening.source,
        notes.counts,
        *listed,
        screening.stations,
        area,
        made,
        screening.coverage,
        screening.language,
    )


def _worst_buildings(path: Path) -> pd.DataFrame:
    """Return the first rows of the table of the buildings; none where there is no such table."""
    if not path.exists():
        return pd.DataFrame()
    with pq.ParquetFile(path.absolute(), pre_buffer=False) as file:
        batch = next(file.iter_batches(5000), None)
        return pd.DataFrame() if batch is None else batch.to_pandas()


def _extent(screening: Screening, notes: Notes, most: int) -> str:
    """Return a sentence on the number of pairs in a file, and on the table with all pairs."""
    pairs = notes.counts.pairs
    if pairs <= most:
        return f"All {pairs} pairs."
    table = table_name(screening.folder, screening.stem)
    return f"The worst {most} of {pairs} pairs; all of them are in {table}."


def _sheets(
    screening: Screening, worst: pd.DataFrame, buildings: pd.DataFrame, note: str
) -> list[Sheet]:
    """Return the sheets of the workbook."""
    units = {
        str(name): column.unit for name in worst if (column := known_column(str(name))) is not None
    }
    of_stations = {name: column.unit for name, column in STATION_COLUMNS.items()}
    # What every column means is a sheet too
    meanings = column_table(map(str, worst))
    velocity = {"worst_expected_impact_velocity": "m/s"}
    given = [
        Sheet("pairs", worst, units, screening.own),
        Sheet("contents", pd.DataFrame({"sheet": ["pairs"], "content": [note]}), {}),
        Sheet("buildings", buildings, {"severity": "m/s"}, buildings.columns),
        Sheet("areas", screening.areas, velocity, screening.areas.columns),
        Sheet("stations", screening.stations, of_stations, screening.stations.columns),
        Sheet("columns", meanings, {}),
    ]
    return [sheet for sheet in given if not sheet.table.empty]
