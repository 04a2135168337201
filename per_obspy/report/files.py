"""
Files of a report of any screening: its table is read once, then each file is written.

Page, summary, figures, layers and workbook read one `Results` and nothing else.
"""

import csv
from collections import deque
from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import contextmanager
from dataclasses import dataclass, replace
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd
import pyarrow.parquet as pq

from per_obspy.checks import FloatArray
from per_obspy.config import ReportTexts, Totals
from per_obspy.errors import CatalogError, PerError, printable
from per_obspy.files import remove_file
from per_obspy.report.evaluation import write_evaluation
from per_obspy.report.layers.kml import ROWS as KML_ROWS
from per_obspy.report.layers.kml import write_kml
from per_obspy.report.layers.spreadsheet import ROWS as SHEET_ROWS
from per_obspy.report.layers.spreadsheet import Sheet, write_workbook
from per_obspy.report.overview import draw_overview
from per_obspy.report.page.background import read_background
from per_obspy.report.page.document import (
    MOST_ROWS,
    REJECTED_COLUMNS,
    page_columns,
    write_page,
)
from per_obspy.report.page.map_lines import (
    continuous,
    lines_around,
    read_outlines,
    towns_around,
)
from per_obspy.report.pair_figure import DIFFERING, differing_pair, draw_record_to_pair
from per_obspy.report.results import Drawings, Results
from per_obspy.report.statements import alert_line
from per_obspy.report.summary.one_page import write_page as write_summary_page
from per_obspy.report.summary.spoken_text import write_text
from per_obspy.report.tally import COUNTED, PAGE_PAIRS, PairTally
from per_obspy.results.ranked_table import table_name
from per_obspy.results.station_summary import COLUMNS as STATION_COLUMNS
from per_obspy.results.totals import (
    CountedTotals,
    RegionTotals,
    areas_of,
    named_areas,
    piece_totals,
    region_totals,
    totals_columns,
    with_buildings,
    write_totals,
)
from per_obspy.screening.columns import column_table, known_column
from per_obspy.screening.ranking import UNKNOWN_CLASS

#: Pairs that a figure shows, evenly from all of them: marks of more would cover each other.
SHOWN = 20_000

#: Columns of the pairs that a figure shows, as far as the table has them.
SHOWN_COLUMNS = ["rank", "pair_id", "risk_class", "longitude", "latitude", "demand", "gap"]

#: Columns of the pairs whose pounding was observed.
OBSERVED_COLUMNS = ["observed", "state", "probability"]

#: Columns of the pairs that summary and KML list; those that a table lacks are left out.
LISTED_COLUMNS = (
    "rank", "pair_id", "risk_class", "state", "probability", "expected_impact_velocity",
    "impact_velocity_84", "expected_amplification", "gap", "demand", "demand_rule", "station",
    "distance", "flags", "derived", "missing_gap", "longitude", "latitude", "longitude_1",
    "latitude_1", "longitude_2", "latitude_2",
)  # fmt: skip

#: Towns of which the page chooses names for its map, as far as they have room.
MOST_TOWNS = 200

#: Column of the neighbours of a building that can hit it.
HIT = "neighbours_that_can_hit"


@dataclass
class Report:
    """
    Files that the report has written, and what it says first.

    Attributes
    ----------
    outputs : list of Path
        Its files.
    faults : list of str
        Figures and layers that could not be made, each with the reason.
    alert : str
        Level and sentence of the alert; empty without a pair.
    """

    outputs: list[Path]
    faults: list[str]
    alert: str = ""

    @contextmanager
    def tried(self, *paths: Path) -> Iterator[None]:
        """Note the files that a block writes, or one line on the fault that prevents them."""
        try:
            yield
        except (PerError, OSError, MemoryError):
            raise
        except Exception as error:  # noqa: BLE001 - whatever a library has against a picture
            # Pictures of an earlier table are none of this one
            for path in paths:
                remove_file(path)
            reason = " ".join(str(error).split())
            self.faults.append(f"{paths[0]}: cannot be drawn: {type(error).__name__} {reason:.200}")
        else:
            self.outputs.extend(paths)


@dataclass(frozen=True)
class PairTable:
    """
    The ranked pairs of a screening, and what is written of them.

    Attributes
    ----------
    pieces : iterator of DataFrame
        Its rows, worst first; with all columns, unless the results have their worst pairs already.
    pairs : int
        Number of its rows.
    totals : Totals
        Areas by which the pairs are counted.
    outlines : Path or None
        Outlines of the buildings, from :func:`outlines_beside`.
    texts : ReportTexts
        Settings of the page, among them its background.
    geopackage, spreadsheet : bool
        Whether the layers, and the workbook, are written; both need optional libraries.
    """

    pieces: Iterator[pd.DataFrame]
    pairs: int
    totals: Totals
    outlines: Path | None
    texts: ReportTexts
    geopackage: bool
    spreadsheet: bool


class TableReader:
    """
    Summaries of a ranked table that is read once, in pieces.

    Parameters
    ----------
    classes : sequence of str
        Names of the risk classes, worst first.
    totals : Totals
        Areas by which the pairs are counted.
    pairs : int
        Rows of the table.
    is_whole : bool
        Whether the pieces have all columns, so that the worst pairs of the page are taken from
        them.

    Attributes
    ----------
    tally : PairTally
        Counts of all pairs.
    """

    def __init__(
        self, classes: Sequence[str], totals: Totals, pairs: int, is_whole: bool = True
    ) -> None:
        self.tally = PairTally(classes)
        # Settings, then the summaries of the pieces
        self.totals, self.pairs, self.is_whole = totals, pairs, is_whole
        self._classes = [*classes, UNKNOWN_CLASS]
        self._counted = CountedTotals()
        self._listed = list[pd.DataFrame]()
        self._shown = list[pd.DataFrame]()
        self._observed = list[pd.DataFrame]()
        self._worst = list[pd.DataFrame]()

    def read(self, pieces: Iterator[pd.DataFrame]) -> Iterator[pd.DataFrame]:
        """Yield the pieces, and add each to the summaries."""
        for piece in pieces:
            self.add(piece)
            yield piece

    def add(self, piece: pd.DataFrame) -> None:
        """Take some rows."""
        rank = piece["rank"].to_numpy()
        if self.is_whole:
            # The page holds the worst pairs
            kept = piece.head(max(PAGE_PAIRS - self.tally.pairs, 0))
            self._worst.append(with_areas(kept[page_columns(kept)], kept, self.totals))
        self.tally.add(piece)
        self._counted.append(piece_totals(piece, self.totals, self._classes))
        self._listed.append(piece[piece["rank"] <= SHEET_ROWS])
        # Figures show all pairs of a small table, every tenth or so of a large one
        step = -(-self.pairs // SHOWN)
        columns = [name for name in SHOWN_COLUMNS if name in piece]
        self._shown.append(piece.loc[rank % step == 1 % step, columns])
        if set(OBSERVED_COLUMNS) <= set(piece):
            self._observed.append(piece.loc[piece["observed"].notna(), OBSERVED_COLUMNS])

    def region_totals(self, folder: Path) -> RegionTotals:
        """Return the totals of all rows, with the buildings of each area where they are known."""
        totals = region_totals(self._counted, self.totals)
        return totals._replace(table=with_buildings(totals.table, folder / "buildings.parquet"))

    @property
    def listed(self) -> pd.DataFrame:
        """Return the worst rows, as many as a workbook has."""
        return _joined(self._listed).sort_values("rank", ignore_index=True)

    @property
    def shown(self) -> pd.DataFrame:
        """Return the pairs that a figure shows."""
        return _joined(self._shown).sort_values("rank", ignore_index=True)

    @property
    def observed(self) -> pd.DataFrame:
        """Return the pairs whose pounding was observed."""
        return _joined(self._observed)

    @property
    def worst(self) -> pd.DataFrame:
        """Return the worst pairs, if the pieces have all columns."""
        return _joined(self._worst)


def _joined(pieces: Sequence[pd.DataFrame]) -> pd.DataFrame:
    """Return pieces as one table, empty without a piece."""
    return pd.concat(pieces, ignore_index=True) if pieces else pd.DataFrame({"rank": []})


def needed_columns(totals: Totals) -> list[str]:
    """Return the columns of a risk table that a report without layers and workbook needs."""
    figures = [*SHOWN_COLUMNS, *OBSERVED_COLUMNS, *totals_columns(totals), *COUNTED]
    return list(dict.fromkeys([*LISTED_COLUMNS, *figures]))


def with_areas(pairs: pd.DataFrame, rows: pd.DataFrame, totals: Totals) -> pd.DataFrame:
    """Return pairs of the page with the areas of the rows that they come from."""
    return named_areas(pairs.assign(area=areas_of(rows, totals, totals.area or "")), totals)


def outlines_beside(*pairs: Path | None) -> Path | None:
    """Return the first file of outlines that lies next to one of these pair tables, if any."""
    for table in pairs:
        if table is not None and (beside := table.with_suffix(".buildings.parquet")).is_file():
            return beside
    return None


#: Return what explains the worst pairs as soon as it is known, and note its file.
Explained = Callable[[Report], Drawings]


def write_report(
    results: Results,
    table: PairTable,
    folder: Path,
    report: Report,
    explained: Explained | None = None,
) -> None:
    """
    Write everything that shows the results of a screening; a file that fails leaves the others.

    Parameters
    ----------
    results : Results
        Everything that is not in the table.
    table : PairTable
        The pairs.
    folder : Path
        Of the results.
    report : Report
        Takes files, faults and alert.
    explained : callable, optional
        Asked for the drawings of the page, which is written last.

    Raises
    ------
    CatalogError
        If the table ends too early.
    """
    reader = TableReader(results.region.classes, table.totals, table.pairs, results.worst.empty)
    results = read_table(results, reader, table, folder, report)
    if results.stem == "risk":
        observed, simulated = reader.observed, results.region.simulated
        report.outputs.extend(write_evaluation(observed, folder, simulated))
    report.alert = alert_line(results)
    write_summaries(results, folder, report)
    write_lists(results, folder, table.spreadsheet, report)
    _draw_figures(results, folder, report)
    # Other processes were at work on what the page shows of single pairs
    if explained is not None:
        results = replace(results, drawings=explained(report))
    with report.tried(folder / "report.html"):
        page = with_page_data(results, folder, table.outlines, table.texts, report)
        write_page(page, folder / "report.html")


def read_table(
    results: Results, reader: TableReader, table: PairTable, folder: Path, report: Report
) -> Results:
    """Read a table once, write its layers and totals, and return the results with its rows."""
    rows = reader.read(table.pieces)
    if table.geopackage:
        names = (f"{results.stem}.{suffix}" for suffix in ("gpkg", "qgz", "geoparquet"))
        package, project, parquet = (folder / name for name in names)
        with report.tried(package, project, parquet):
            _write_layers(rows, results, reader, table.outlines, (package, project, parquet))
    # All rows, or those that a layer left when it failed; a table that fails is a fault
    deque(rows, maxlen=0)
    if reader.tally.pairs != reader.pairs:
        file = folder / table_name(folder, results.stem)
        raise CatalogError(str(file), "cannot be read to its end: run again")
    areas = reader.region_totals(folder).table
    write_totals(areas, folder / "totals.csv")
    report.outputs.append(folder / "totals.csv")
    buildings, hit = _worst_buildings(folder / "buildings.parquet")
    # Areas have names for people from here on
    return replace(
        results,
        tally=reader.tally,
        worst=reader.worst if reader.is_whole else results.worst,
        listed=reader.listed,
        shown=reader.shown,
        areas=named_areas(areas, table.totals),
        buildings=buildings,
        buildings_hit=hit,
    )


def _write_layers(
    rows: Iterator[pd.DataFrame],
    results: Results,
    reader: TableReader,
    outlines: Path | None,
    files: tuple[Path, Path, Path],
) -> None:
    """Write all layers, with the optional libraries; totals are known after the last piece."""
    from per_obspy.report.layers.map_layers import MapSources, write_layers

    region, folder = results.region, files[0].parent
    facts = {"name": region.title, "simulated": str(region.simulated).lower()}
    ranked = folder / "buildings.parquet"
    totals = partial(reader.region_totals, folder)
    sources = MapSources(region.classes, facts, results.stations, totals, ranked, outlines)
    write_layers(rows, sources, files)


def _worst_buildings(path: Path) -> tuple[pd.DataFrame, int | None]:
    """Return the worst buildings, and how many of all a neighbour can hit, as far as known."""
    if not path.is_file():
        return pd.DataFrame(), None
    with pq.ParquetFile(path.absolute(), pre_buffer=False) as file:
        first = next(file.iter_batches(PAGE_PAIRS), None)
        if first is None:
            return pd.DataFrame(), None
        # Counted in all rows: the page shows the worst only
        hit = _count_hit(file) if HIT in file.schema_arrow.names else None
    return first.to_pandas(), hit


def _count_hit(file: pq.ParquetFile) -> int:
    """Return the number of buildings that a neighbour can hit."""
    batches = file.iter_batches(columns=[HIT])
    return sum(
        int(np.count_nonzero(batch[HIT].to_numpy(zero_copy_only=False) > 0)) for batch in batches
    )


def write_summaries(results: Results, folder: Path, report: Report) -> None:
    """Write the summary as text and as one page of PDF."""
    with report.tried(folder / "summary.txt"):
        write_text(results, folder / "summary.txt")
    with report.tried(folder / "summary.pdf"):
        write_summary_page(results, folder / "summary.pdf")


def write_lists(results: Results, folder: Path, spreadsheet: bool, report: Report) -> None:
    """Write the worst pairs as KML and, where it is wanted, as a workbook."""
    stem, region = results.stem, results.region
    # Both say how many pairs they leave out
    with report.tried(folder / f"{stem}.kml"):
        note = _extent(results, folder, KML_ROWS)
        write_kml(results.listed, region.classes, region.title, folder / f"{stem}.kml", note)
    if spreadsheet:
        with report.tried(folder / f"{stem}.xlsx"):
            sheets = _sheets(results, _extent(results, folder, SHEET_ROWS))
            write_workbook(sheets, folder / f"{stem}.xlsx")


def _draw_figures(results: Results, folder: Path, report: Report) -> None:
    """Draw the map of all pairs, and a pair from its record to pounding where one has a record."""
    overview, walk = (folder / "figures" / f"{name}.png" for name in ("overview", "worst_pair"))
    with report.tried(overview):
        region = results.region
        # Stations of an ensemble have no amplitudes
        if {"state", "pga"} <= set(results.stations):
            used = results.stations[results.stations["state"] == "used"]
            region = region._replace(stations=used[["longitude", "latitude", "pga"]].dropna())
        draw_overview(results.shown, region, overview, results.language)
    # Equal circles explain nothing
    pair = differing_pair(results.worst)
    if results.record is not None and pair is not None:
        with report.tried(walk):
            draw_record_to_pair(results.record, pair, walk, note=DIFFERING)


def _extent(results: Results, folder: Path, most: int) -> str:
    """Return a sentence on the number of pairs in a file, and on the table with all pairs."""
    pairs = results.tally.pairs
    if pairs <= most:
        return f"All {pairs} pairs."
    table = table_name(folder, results.stem)
    return f"The worst {most} of {pairs} pairs; all of them are in {table}."


def _sheets(results: Results, note: str) -> list[Sheet]:
    """Return the sheets of the workbook."""
    worst, areas, buildings = results.listed, results.areas, results.buildings
    # Units are those of the tables
    columns = {str(name): known_column(str(name)) for name in worst}
    units = {name: column.unit for name, column in columns.items() if column is not None}
    of_stations = {name: column.unit for name, column in STATION_COLUMNS.items()}
    # What every column means is a sheet too
    sheets = [
        Sheet("pairs", worst, units, results.own),
        Sheet("contents", pd.DataFrame({"sheet": ["pairs"], "content": [note]}), {}),
        Sheet("buildings", buildings, {"severity": "m/s"}, buildings.columns),
        Sheet("areas", areas, {"worst_expected_impact_velocity": "m/s"}, areas.columns),
        Sheet("stations", results.stations, of_stations, results.stations.columns),
        Sheet("columns", column_table(map(str, worst)), {}),
    ]
    return [sheet for sheet in sheets if not sheet.table.empty]


def with_page_data(
    results: Results, folder: Path, outlines: Path | None, settings: ReportTexts, report: Report
) -> Results:
    """Return results with rejections, outlines, and lines and towns of the map for the page."""
    rejected, rejections = _rejected(folder / "rejected.csv")
    worst, rings = results.worst, list[tuple[str, list[float]]]()
    # Outlines of the buildings of these pairs, if the pairs came with them
    if outlines is not None and "building_id_1" in worst:
        names = pd.concat([worst["building_id_1"], worst["building_id_2"]]).dropna().astype(str)
        rings = read_outlines(outlines, names.unique().tolist())
    stations = with_radii(results.stations, results.drawings.radii)
    placed = replace(
        results, stations=stations, rejected=rejected, rejections=rejections, outlines=rings
    )
    # Pairs that the page has one by one, and those that it counts
    places = [worst, results.tally.cells.table()]
    if not {"longitude", "latitude"} <= set(worst):
        return placed
    longitude, latitude = pd.concat(places)[["longitude", "latitude"]].dropna().to_numpy(float).T
    return _with_map(placed, continuous(longitude), latitude, settings, report)


def _with_map(
    results: Results,
    longitude: FloatArray,
    latitude: FloatArray,
    settings: ReportTexts,
    report: Report,
) -> Results:
    """Return results with coast lines, towns and background around places (degrees)."""
    lines: dict[str, Sequence[Any]] = dict(lines_around(longitude, latitude))
    lines["towns"] = towns_around(longitude, latitude, MOST_TOWNS)
    if settings.background is None or not longitude.size:
        return replace(results, lines=lines)
    # A file that cannot be read leaves the page without its lines
    try:
        layers = settings.background_layers
        lines["background"], credit = read_background(
            settings.background, layers, longitude, latitude
        )
    except CatalogError as error:
        report.faults.append(f"{error}; the page has no background")
        return replace(results, lines=lines)
    source = ": ".join(filter(None, [printable(settings.background.name), credit]))
    provenance = [*results.provenance, (results.texts["background"], source)]
    return replace(results, lines=lines, provenance=provenance)


def with_radii(stations: pd.DataFrame, radii: Mapping[str, list[float]]) -> pd.DataFrame:
    """Return stations with the PER and SD of those that have them."""
    if stations.empty or not radii:
        return stations
    columns = {
        column: stations["station"].map({name: pair[number] for name, pair in radii.items()})
        for number, column in enumerate(("per", "sd"))
    }
    return stations.assign(**columns).astype(dict.fromkeys(columns, "float64"))


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
