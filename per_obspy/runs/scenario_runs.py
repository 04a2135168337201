"""Facts of an ensemble from the runs of its scenarios, which its table lacks."""

from collections.abc import Iterator, Mapping, Sequence
from pathlib import Path
from typing import Any, NamedTuple

import pandas as pd
import pyarrow.compute as pc
import pyarrow.parquet as pq

from per_obspy.config import Run, Totals
from per_obspy.inventory.schema import ROW_SUSPICIONS
from per_obspy.report.files import outlines_beside, with_radii
from per_obspy.results.parts import batches, bounded_database, parquet_rows
from per_obspy.results.ranked_table import ROWS, RankedTable, table_files
from per_obspy.results.totals import PLACE
from per_obspy.runs.output_folder import WORST_PAIRS
from per_obspy.runs.run_facts import read_stations
from per_obspy.runs.stations import stations_of_earlier_run
from per_obspy.runs.worst_pairs import HISTORIES, HISTORY_COLUMNS, pair_histories, read_drawings

#: Columns of a risk table that do not depend on the motion.
OF_BUILDINGS = (
    "building_id_1", "building_id_2", "longitude_1", "latitude_1", "longitude_2", "latitude_2",
    "height_1", "height_2", "storeys_1", "storeys_2", "period_1", "period_2", "damping_1",
    "damping_2", "period_log_std_1", "period_log_std_2", "yield_displacement_1",
    "yield_displacement_2", "derived",
)  # fmt: skip

#: Flags that do not depend on the motion.
OF_PAIRS = (
    "derived_inputs", "derived_period", "equal_by_formula", "floor_to_column", "touching",
    "unknown_gap", *ROW_SUSPICIONS,
)  # fmt: skip


class ScenarioRun(NamedTuple):
    """
    Run of a scenario.

    Attributes
    ----------
    settings : Run
        Its configuration.
    folder : Path
        Its results.
    """

    settings: Run
    folder: Path

    @property
    def risk(self) -> list[Path]:
        """Return the files of the risk table, none if no pair is usable."""
        return table_files(self.folder)


class ScenarioRuns:
    """
    Runs of all scenarios, by the name of the scenario.

    Parameters
    ----------
    runs : mapping of str to ScenarioRun
        In the order of the scenarios.
    """

    def __init__(self, runs: Mapping[str, ScenarioRun]) -> None:
        self.runs = {name: run for name, run in runs.items() if run.risk}

    @property
    def first(self) -> ScenarioRun | None:
        """Return the first run with results: all of them screen the same inventory."""
        return next(iter(self.runs.values()), None)

    def totals(self) -> Totals:
        """Return the areas of the first run."""
        return self.first.settings.totals if self.first else Totals()

    def outlines(self) -> Path | None:
        """Return the outlines of the buildings, None where none are known."""
        if self.first is None:
            return None
        pairs = self.first.settings.pairs
        given = pairs.file if pairs else None
        return outlines_beside(given, self.first.folder / "pairs.parquet")

    def pieces(self, table: Path) -> Iterator[pd.DataFrame]:
        """
        Yield an ensemble in pieces, worst first, with the buildings of every pair.

        Parameters
        ----------
        table : Path
            ``ensemble.parquet``.
        """
        query, columns = "SELECT * FROM pairs", self._columns()
        with bounded_database(table.parent) as database:
            database.register("pairs", parquet_rows([table]))
            # Pairs of all tables have the same names
            if columns:
                for number, (run, names) in enumerate(columns):
                    database.register(f"run{number}", parquet_rows(run.risk, ["pair_id", *names]))
                query = f"""
                    SELECT * FROM pairs LEFT JOIN ({_of_first_runs(len(columns))}) USING (pair_id)
                """
            for batch in batches(database, f"{query} ORDER BY rank", ROWS):
                yield _with_flags_of_pairs(batch.to_pandas())

    def _columns(self) -> list[tuple[ScenarioRun, list[str]]]:
        """Return each run with the columns that the ensemble takes from it."""
        area = self.totals().area or PLACE
        wanted = dict.fromkeys([*OF_BUILDINGS, "flags", area])
        tables = []
        for run in self.runs.values():
            known = set(pq.read_schema(run.risk[0].absolute()).names)
            # Names with a quotation mark are not quoted twice
            tables.append((run, [name for name in wanted if name in known and '"' not in name]))
        return tables

    def stations(self) -> pd.DataFrame:
        """Return the stations of all runs, each with the name of its scenario."""
        tables = list[pd.DataFrame]()
        # A run that only a map serves has none
        for name, run in self.runs.items():
            if len(table := read_stations(run.folder / "stations.csv")):
                # A run has its radii with its worst pairs
                table = with_radii(table, read_drawings(run.folder / WORST_PAIRS).radii)
                tables.append(table.assign(station=table["station"] + f" ({name})"))
        return pd.concat(tables, ignore_index=True) if tables else pd.DataFrame()

    def histories(self, ensemble: RankedTable) -> dict[int, dict[str, Any]]:
        """Return histories of the worst pairs, each in its worst scenario, by rank."""
        found = dict[int, dict[str, Any]]()
        worst = ensemble.first(HISTORIES, ["rank", "pair_id", "worst_scenario"])
        for name, pairs in worst.groupby("worst_scenario", sort=False):
            run = self.runs.get(str(name))
            if run is not None:
                rows = _rows_of(run.risk, pairs["pair_id"].tolist())
                # Ranks are those of the ensemble
                ranked = rows.merge(pairs[["pair_id", "rank"]], on="pair_id")
                found |= pair_histories(ranked, _stations(run))
        return found


def _of_first_runs(count: int) -> str:
    """Return a query for the rows of all pairs, each of the first run that has it."""
    return " UNION ALL BY NAME ".join(
        f"SELECT * FROM run{number}"
        + "".join(f" ANTI JOIN run{earlier} USING (pair_id)" for earlier in range(number))
        for number in range(count)
    )


def _stations(run: ScenarioRun) -> Sequence[Any]:
    """Return the stations of a finished run; empty if it has a ShakeMap only."""
    if not (run.folder / "stations").is_dir():
        return []
    return [station for station in stations_of_earlier_run(run.folder) if station.shard]


def _rows_of(risk: Sequence[Path], names: Sequence[str]) -> pd.DataFrame:
    """Return the rows of some pairs with the columns for a history, except the rank."""
    wanted = [name for name in ("pair_id", *HISTORY_COLUMNS) if name != "rank"]
    # Columns that a run may lack are left out
    known = set(pq.read_schema(risk[0].absolute()).names)
    rows = parquet_rows(risk, [name for name in wanted if name in known])
    named = rows.to_table(filter=pc.field("pair_id").isin(names), use_threads=False)
    found: pd.DataFrame = named.to_pandas()
    return found


def _with_flags_of_pairs(piece: pd.DataFrame) -> pd.DataFrame:
    """Return a piece whose flags are only those that hold in every scenario."""
    if "flags" not in piece:
        return piece
    kept = [
        " ".join(flag for flag in str(names or "").split() if flag in OF_PAIRS)
        for names in piece["flags"]
    ]
    return piece.assign(flags=kept)
