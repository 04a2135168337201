"""Last stage: the risk table and the spectra become totals, figures and layers for a map."""

from collections import deque
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from pathlib import Path
from typing import NamedTuple

import pandas as pd
import xarray as xr

from per_obspy.config import Run
from per_obspy.errors import CatalogError, PerError
from per_obspy.files import remove_file
from per_obspy.jobs.ground_files import read_station_once
from per_obspy.jobs.station import FinishedStation
from per_obspy.pipeline.results.page import worst_pairs, write_run_page
from per_obspy.pipeline.stations import simulated_motion
from per_obspy.progress import Progress
from per_obspy.report.evaluation import write_evaluation
from per_obspy.report.figures import draw_overview, draw_record_to_pair
from per_obspy.report.page.tally import COUNTED, PairTally
from per_obspy.screening.uncertainty.unknown_gaps import UNKNOWN_CLASS
from per_obspy.spectra.storage import region, write_spectra
from per_obspy.tables.risk import RankedTable, ranked_table
from per_obspy.tables.totals import (
    PieceTotals,
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
SHOWN_COLUMNS = ["rank", "state", "longitude", "latitude", "demand", "gap"]

#: Columns of the pairs whose pounding was observed.
OBSERVED_COLUMNS = ["observed", "state", "probability"]


class RiskSummary(NamedTuple):
    """
    Everything that the report takes from the risk table, in one pass.

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
    page : (PairTally, DataFrame)
        Counts and worst pairs of the page.
    """

    worst: pd.Series | None
    shown: pd.DataFrame
    observed: pd.DataFrame
    totals: RegionTotals
    page: tuple[PairTally, pd.DataFrame]


class Report(NamedTuple):
    """
    What the report has written.

    Attributes
    ----------
    outputs : list of Path
        Its files.
    faults : list of str
        Figures and layers that could not be made, each with the reason.
    """

    outputs: list[Path]
    faults: list[str]

    @contextmanager
    def tried(self, *paths: Path) -> Iterator[None]:
        """Note files that the block writes; a fault of the drawing leaves them out, in one line."""
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


class _Pieces(NamedTuple):
    """Summaries of the pieces of a risk table, in their order."""

    rows: list[int]
    first_named: list[int]
    shown: list[pd.DataFrame]
    observed: list[pd.DataFrame]
    totals: list[PieceTotals]
    tally: PairTally


def reported(
    settings: Run, folder: Path, stations: Sequence[FinishedStation], progress: Progress
) -> Report:
    """
    Write the report of the results in the output folder.

    A figure or layer that cannot be made is left out, the tables are written.

    Parameters
    ----------
    settings : Run
        What to do.
    folder : Path
        Of the results; without a risk table only the spectra can be reported.
    stations : sequence of FinishedStation
        With shards.
    progress : callable
        Called when it begins and ends.
    """
    progress("report", 0, 1)
    simulated = simulated_motion(settings, stations)
    report, risk = Report([], []), folder / "risk.parquet"
    spectra = _write_spectra(stations, folder / "spectra.nc") if stations else None
    if spectra is not None:
        report.outputs.append(folder / "spectra.nc")
    # Without a pair there is no risk table
    if risk.exists():
        facts = _facts(settings, simulated)
        summary = _summary(settings, risk, folder, facts, report)
        # Totals, layers and the comparison with observations need no record
        write_totals(summary.totals.table, folder / "totals.csv")
        report.outputs.append(folder / "totals.csv")
        report.outputs.extend(write_evaluation(summary.observed, folder, simulated))
        if settings.geopackage:
            with report.tried(folder / "totals.gpkg"):
                _write_totals_layer(summary.totals, folder / "totals.gpkg", facts)
        if spectra is not None:
            _draw_figures(settings, summary, spectra, stations, folder, report)
        _write_page(settings, summary, stations, folder, report)
    progress("report", 1, 1)
    return report


def _write_page(
    settings: Run,
    summary: RiskSummary,
    stations: Sequence[FinishedStation],
    folder: Path,
    report: Report,
) -> None:
    """Write the page that holds everything for people."""
    found = (*summary.page, summary.totals.table)
    with report.tried(folder / "report.html"):
        simulated = simulated_motion(settings, stations)
        write_run_page(settings, folder, stations, found, simulated)


def _write_spectra(stations: Sequence[FinishedStation], path: Path) -> xr.Dataset:
    """Write the spectra of all stations, and return them."""
    spectra = region(station.spectra for station in stations if station.spectra is not None)
    write_spectra(spectra, path)
    return spectra


def _summary(
    settings: Run, risk: Path, folder: Path, facts: dict[str, str], report: Report
) -> RiskSummary:
    """Read the risk table once: for totals, figures, observations, and the layer of the pairs."""
    columns = None if settings.geopackage else _needed_columns(settings)
    # The layer takes the pieces one by one, and so they are noted on the way
    pieces = _Pieces([], [], [], [], [], PairTally(list(settings.screening.classes)))
    with ranked_table(risk, columns) as table:
        listed = worst_pairs(table, settings)
        noted = _noted(table, settings, pieces)
        if settings.geopackage:
            with report.tried(folder / "risk.gpkg"):
                _write_pairs_layer(settings, noted, folder / "risk.gpkg", facts)
        # All rows, or those that a layer left when it failed; a table that fails is a fault
        deque(noted, maxlen=0)
        if sum(pieces.rows) != table.pairs:
            raise CatalogError(str(risk), "cannot be read to its end: run again")
        worst = table.row(pieces.first_named[0]) if pieces.first_named else None
    totals = region_totals(pieces.totals, settings.totals)
    counted = with_buildings(totals.table, folder / "buildings.parquet")
    return RiskSummary(
        worst,
        pd.concat(pieces.shown, ignore_index=True),
        pd.concat(pieces.observed or [pd.DataFrame()], ignore_index=True),
        totals._replace(table=counted),
        (pieces.tally, listed),
    )


def _needed_columns(settings: Run) -> list[str]:
    """Return the columns of the risk table that the report takes of every pair."""
    needed = [*SHOWN_COLUMNS, *OBSERVED_COLUMNS, "station", *totals_columns(settings.totals)]
    return list(dict.fromkeys([*needed, *COUNTED]))


def _noted(table: RankedTable, settings: Run, found: _Pieces) -> Iterator[pd.DataFrame]:
    """Yield the pieces of a risk table, and note what the report takes of each."""
    step = -(-table.pairs // SHOWN)
    classes = [*settings.screening.classes, UNKNOWN_CLASS]
    for piece in table.pieces():
        found.rows.append(len(piece))
        rank = piece["rank"].to_numpy()
        # Rows with a record; ranks count from 1, rows from 0
        named = rank[(piece["station"] != "").to_numpy()] - 1
        found.first_named.extend(named[:1].tolist())
        found.shown.append(piece.loc[rank % step == 1 % step, SHOWN_COLUMNS])
        if "observed" in piece:
            observed = piece["observed"].notna()
            found.observed.append(piece.loc[observed, OBSERVED_COLUMNS])
        found.tally.add(piece)
        found.totals.append(piece_totals(piece, settings.totals, classes))
        yield piece


def _draw_figures(
    settings: Run,
    summary: RiskSummary,
    spectra: xr.Dataset,
    stations: Sequence[FinishedStation],
    folder: Path,
    report: Report,
) -> None:
    """Draw the worst pair that has a record, and the region."""
    walk, overview = (folder / "figures" / name for name in ("worst_pair.png", "overview.png"))
    with report.tried(overview):
        draw_overview(summary.shown, spectra, settings.name, overview)
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


def _facts(settings: Run, simulated: bool) -> dict[str, str]:
    """Return the facts of the whole table that layers state."""
    return {"name": settings.name, "simulated": str(simulated).lower()}


def _write_pairs_layer(
    settings: Run, pieces: Iterator[pd.DataFrame], path: Path, facts: dict[str, str]
) -> None:
    """Write the pairs as a layer for QGIS with the optional libraries."""
    from per_obspy.report.gis import write_pairs_layer

    write_pairs_layer(pieces, list(settings.screening.classes), path, facts)


def _write_totals_layer(totals: RegionTotals, path: Path, facts: dict[str, str]) -> None:
    """Write the totals as a layer for QGIS with the optional libraries."""
    from per_obspy.report.gis import write_totals_layer

    write_totals_layer(*totals, path, facts)
