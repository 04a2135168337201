"""
Ensemble of scenarios: one run per scenario, then the joint probability of every pair.

A run that is done is not done again, and neither is the ensemble, whose ``ensemble.json`` is
written last.
"""

import json
import os
from collections.abc import Iterator, Mapping, Sequence
from concurrent.futures import Executor
from importlib.metadata import version
from pathlib import Path
from typing import Any, NamedTuple

import pandas as pd
import pyarrow as pa
import pyarrow.parquet as pq

from per_obspy.config import Ensemble, EnsembleScenario, Run, in_language, load
from per_obspy.config.run import TARGET_RATE
from per_obspy.errors import CatalogError, Rejection
from per_obspy.files import content_hash, file_hash, remove_file, temporary_folder, written_whole
from per_obspy.progress import Progress, silent
from per_obspy.report.page.background import require_background
from per_obspy.results.coverage import Coverage, most_first
from per_obspy.results.parts import bounded_database, parquet_rows
from per_obspy.results.ranked_table import ROWS, table_files, table_outputs
from per_obspy.results.risk import write_worst
from per_obspy.results.table_files import write_described, write_rejected
from per_obspy.resume import earlier_status
from per_obspy.runs.inputs.extras import require_extras
from per_obspy.runs.output_folder import (
    Result,
    file_hashes,
    locked_folder,
    now,
    recorded,
    software_versions,
)
from per_obspy.runs.pairs import check_inputs
from per_obspy.runs.report import report_ensemble
from per_obspy.runs.run import run
from per_obspy.runs.scenario_runs import ScenarioRun, ScenarioRuns
from per_obspy.screening.columns import DEMAND_SHARES
from per_obspy.screening.ensemble import (
    ORDER,
    PERIODS,
    SAME,
    SEVERITY,
    ensemble_columns,
    ensemble_rejections,
    ensemble_rows,
)

#: Columns of a risk table that depend on the scenario; NULL where an earlier version has none.
OF_SCENARIO = ("probability", "demand", *SEVERITY, *DEMAND_SHARES)

_TYPES = {"float64": pa.float64(), "int64": pa.int64(), "str": pa.string()}


class Scenarios(NamedTuple):
    """Scenarios whose runs are done."""

    #: Files of the risk table of each; none for a scenario without a usable pair.
    tables: Mapping[str, Sequence[Path]]
    #: Weight of each, or its rate (1/year).
    weights: dict[str, float]
    #: Whether they are rates.
    yearly: bool
    #: Annual rate of contact that is accepted, 1/year.
    target_rate: float = TARGET_RATE


#: Numbers of pairs: all, and without a probability those of unknown gap, and the others.
_COUNTS = """
    SELECT 'pairs', count(*) FROM rows
    UNION ALL SELECT 'unknown_gap', count(*) FROM rows WHERE probability IS NULL AND gap IS NULL
    UNION ALL SELECT 'missing_scenario', count(*) FROM rows
        WHERE probability IS NULL AND gap IS NOT NULL
"""

#: The rows in their order, with the rank before the other columns.
_ORDERED = f"""
    COPY (
        SELECT row_number() OVER () AS rank, * EXCLUDE ({ORDER})
        FROM (
            SELECT * FROM rows
            ORDER BY {ORDER} DESC, expected_amplification DESC NULLS LAST,
                probability DESC NULLS LAST, pair_id
        )
    ) TO $path (FORMAT parquet, ROW_GROUP_SIZE {ROWS}, KV_METADATA {{per_obspy: $statement}})
"""


def write_ensemble(
    scenarios: Scenarios, folder: Path, facts: Mapping[str, str], csv_rows: int
) -> tuple[list[Path], dict[str, int]]:
    """
    Write ``ensemble.parquet``, ``ensemble.csv``, ``ensemble.columns.csv`` and ``rejected.csv``.

    Parameters
    ----------
    scenarios : Scenarios
        The scenarios.
    folder : Path
        Folder of the files.
    facts : mapping of str to str
        Facts of the whole table that the Parquet file states.
    csv_rows : int
        Number of rows of ``ensemble.csv``, the worst ones.
    """
    names = ("ensemble.parquet", "ensemble.csv", "ensemble.columns.csv", "rejected.csv")
    table, text, columns, rejected = files = [folder / name for name in names]
    statement = json.dumps({"version": version("per_obspy"), **facts})
    with temporary_folder(folder) as room:
        joined, rows = room / "joined.parquet", room / "rows.parquet"
        # Join by pair, compute the probabilities, and order by them
        _join(scenarios, joined)
        _write_rows(scenarios, joined, rows)
        with bounded_database(room) as database, written_whole(table) as part:
            database.register("rows", parquet_rows([rows]))
            database.execute(_ORDERED, {"path": str(part), "statement": statement})
            counts = dict(database.execute(_COUNTS).fetchall())
        kinds = write_rejected(_rejections(scenarios, joined), rejected)
    # The worst rows as text, and the meaning of every column
    write_worst(table, csv_rows, text)
    described = ensemble_columns(scenarios.weights, scenarios.yearly)
    write_described(described.values(), columns)
    return files, {**counts, "rejected_pair": kinds["pair"]}


def _join(scenarios: Scenarios, path: Path) -> None:
    """Write one row per pair name, in the form for ``screening.ensemble_rows``."""
    tables = list(scenarios.tables.values())
    with bounded_database(path.parent) as database:
        for number, table in enumerate(tables):
            if table:
                database.register(f"table{number}", parquet_rows(table))
        database.execute(_join_query(tables), {"path": str(path)})


def _join_query(tables: Sequence[Sequence[Path]]) -> str:
    """Return the query that joins the risk tables ``table0``, ``table1`` ... by pair."""
    # Without any table there is still a header
    numbers = (*SAME, *PERIODS, *OF_SCENARIO)
    zeros = ", ".join(f"0::DOUBLE AS {name}" for name in numbers)
    rows = [f"SELECT -1 AS scenario, '' AS pair_id, '' AS configuration, {zeros} WHERE false"]
    rows += [
        f"SELECT {number} AS scenario, {_names_in(table)} FROM table{number}"
        for number, table in enumerate(tables)
        if table
    ]
    # Columns of probability and severity per scenario, extremes of columns that should be equal
    columns = [
        f"max({name}) FILTER (scenario = {number}) AS {name}_{number}"
        for number in range(len(tables))
        for name in OF_SCENARIO
    ]
    columns += [f"min({name}) AS {name}, max({name}) AS {name}_largest" for name in SAME]
    columns += [f"max({name}) AS {name}" for name in ("configuration", *PERIODS)]
    return f"""
        COPY (
            SELECT pair_id, {", ".join(columns)} FROM ({" UNION ALL ".join(rows)})
            GROUP BY pair_id ORDER BY pair_id
        ) TO $path (FORMAT parquet, ROW_GROUP_SIZE {ROWS})
    """


def _names_in(table: Sequence[Path]) -> str:
    """Return the columns of a risk table for its query; NULL for those that it lacks."""
    lacking = {*DEMAND_SHARES}.difference(pq.read_schema(table[0].absolute()).names)
    wanted = ("pair_id", "configuration", *SAME, *PERIODS, *OF_SCENARIO)
    return ", ".join(f"NULL AS {name}" if name in lacking else name for name in wanted)


def _pieces(scenarios: Scenarios, joined: Path) -> Iterator[pd.DataFrame]:
    """Yield the joined rows in pieces, with the names of the scenarios."""
    names = {}
    for number, name in enumerate(scenarios.tables):
        for column in OF_SCENARIO:
            names[f"{column}_{number}"] = f"{column}_{name}"
    with pq.ParquetFile(joined, pre_buffer=False) as table:
        for batch in table.iter_batches(ROWS):
            piece: pd.DataFrame = batch.to_pandas().rename(columns=names)
            # A batch of empty cells has no type
            yield piece.astype(dict.fromkeys([*names.values(), *SAME, *PERIODS], "float64"))


def _write_rows(scenarios: Scenarios, joined: Path, path: Path) -> None:
    """Write the rows of the ensemble, not ranked yet."""
    described = ensemble_columns(scenarios.weights, scenarios.yearly)
    # The rank is known when the rows are in order
    fields = [(name, _TYPES[column.dtype]) for name, column in described.items() if name != "rank"]
    schema = pa.schema([*fields, (ORDER, pa.float64())])
    with pq.ParquetWriter(path, schema) as writer:
        for piece in _pieces(scenarios, joined):
            rows = ensemble_rows(piece, scenarios.weights, scenarios.yearly, scenarios.target_rate)
            writer.write_table(pa.Table.from_pandas(rows, schema=schema, preserve_index=False))


def _rejections(scenarios: Scenarios, joined: Path) -> Iterator[Rejection]:
    """Yield the pairs that differ between scenarios."""
    for piece in _pieces(scenarios, joined):
        yield from ensemble_rejections(piece)


#: Written last.
RECORD = "ensemble.json"


def screen_scenarios(
    configuration: Path,
    output: Path | None = None,
    executor: Executor | None = None,
    progress: Progress = silent,
    language: str | None = None,
) -> Result:
    """
    Run every scenario that is not up to date, and join the probabilities pair by pair.

    Parameters
    ----------
    configuration : Path
        TOML file, see :class:`per_obspy.config.Ensemble`.
    output : Path, optional
        Folder of the ensemble's results, instead of the configured one; those of the runs stay
        where they are.
    executor : Executor, optional
        Where stations and chunks are processed; processes of this machine if not given.
    progress : callable
        Called for every stage: scenario and name, done, total.
    language : {'en', 'es'}, optional
        Of page and summary of the ensemble, instead of the configured one.

    Returns
    -------
    Result
        The folder and the content of its ``ensemble.json``.

    Raises
    ------
    CatalogError
        If the configuration or that of a run is wrong, two of them have the same output folder, or
        a run cannot be done.
    ServiceError
        If services fail and no record is at hand.
    """
    configuration = configuration.resolve()
    settings = in_language(load(configuration, Ensemble), language)
    require_extras(settings)
    require_background(settings.report.background)
    folder = (output or settings.output).resolve()
    _check_runs(settings, configuration, folder)
    # Each run takes its own folder, one after the other
    started = now()
    runs = {
        scenario.name: run(scenario.run, None, executor, _prefixed(scenario.name, progress))
        for scenario in settings.scenario
    }
    with locked_folder(folder):
        head = _head(settings, configuration, runs)
        # The same runs with the same weights were joined before
        known = earlier_status(folder / RECORD, head["key"])
        if known is not None:
            return Result(folder, known, did_nothing=True)
        remove_file(folder / RECORD)
        progress("joining scenarios", 0, 1)
        found = _joined(settings, folder, runs, head["simulated"])
        progress("joining scenarios", 1, 1)
        record = {"name": settings.name, **found, "started": started, **head}
        return recorded(folder / RECORD, record)


def _joined(
    settings: Ensemble, folder: Path, runs: Mapping[str, Result], simulated: bool
) -> dict[str, Any]:
    """Join the risk tables of the runs and return the results' part of ``ensemble.json``."""
    facts = {"name": settings.name, "simulated": str(simulated).lower()}
    joined = _scenarios(settings, _risk_tables(runs))
    files, counts = write_ensemble(joined, folder, facts, settings.csv_rows)
    # Results of the runs know buildings, stations and records
    scenarios_run = {
        scenario.name: ScenarioRun(load(scenario.run, Run), runs[scenario.name].folder)
        for scenario in settings.scenario
    }
    # Pairs that a run or a scenario lacks make a result partial
    missing = counts["missing_scenario"]
    losses = [counts["rejected_pair"], missing, *(one.record["partial"] for one in runs.values())]
    coverage = _coverage(runs, counts)
    made = report_ensemble(settings, folder, simulated, coverage, ScenarioRuns(scenarios_run))
    return {
        "state": "complete" if counts["pairs"] > missing else "nothing_usable",
        "partial": any(losses),
        "counts": counts,
        "coverage": coverage.as_record(),
        "faults": made.faults,
        "alert": made.alert,
        "outputs": file_hashes(folder, [*files, *made.outputs]),
        "versions": software_versions(),
    }


def _risk_tables(runs: Mapping[str, Result]) -> dict[str, list[Path]]:
    """Return the files of the risk table of each run; a run without a usable pair has none."""
    return {
        name: table_files(one.folder) if table_outputs(one.record["outputs"]) else []
        for name, one in runs.items()
    }


def _scenarios(settings: Ensemble, tables: Mapping[str, Sequence[Path]]) -> Scenarios:
    return Scenarios(tables, settings.weights, settings.yearly, settings.target_rate)


def _coverage(runs: Mapping[str, Result], counts: Mapping[str, int]) -> Coverage:
    """Return the coverage of an ensemble: pairs that at least one scenario has."""
    of_runs = [Coverage.of_record(result.record) for result in runs.values()]
    fullest, widest = min(of_runs, key=_left_out), max(of_runs, key=lambda one: one.pairs)
    pairs, rejected = counts["pairs"], counts["rejected_pair"]
    rows = max(pairs + rejected, *(one.rows for one in of_runs))
    # Rows that every scenario leaves out have the reasons of the one that leaves out least
    kinds = {"scenarios disagree": rejected} if rejected else {}
    everywhere = rows - pairs - rejected
    if everywhere == _left_out(fullest):
        kinds |= fullest.left_out
    elif everywhere:
        kinds["left out of every scenario"] = everywhere
    return Coverage(rows, pairs, most_first(kinds), fullest.areas, widest.search)


def _left_out(coverage: Coverage) -> int:
    """Return the number of rows without a verdict."""
    return coverage.rows - coverage.screened


def _check_runs(settings: Ensemble, configuration: Path, folder: Path) -> None:
    """Check the inputs of every run, and that runs and ensemble write into separate folders."""
    owners = {folder: "the ensemble"}
    for scenario in settings.scenario:
        run_settings = load(scenario.run, Run)
        place = run_settings.output.resolve()
        name = f"scenario {scenario.name!r}"
        if place in owners:
            reason = f"{name} has the output folder of {owners[place]}, {place}"
            raise CatalogError(str(configuration), reason)
        owners[place] = name
        # A fault of the last run would otherwise be found after all others are done
        require_extras(run_settings)
        check_inputs(run_settings, run_settings.output)


def _prefixed(name: str, progress: Progress) -> Progress:
    """Return a progress callback that reports a run's stages under the name of its scenario."""
    return lambda stage, done, total: progress(f"{name}: {stage}", done, total)


def _head(settings: Ensemble, configuration: Path, runs: Mapping[str, Result]) -> dict[str, Any]:
    """Return key, configuration and scenarios of an ensemble."""
    folder = configuration.parent
    values = json.loads(settings.model_dump_json(context={"folder": folder}))
    scenarios = [_facts(scenario, runs[scenario.name], folder) for scenario in settings.scenario]
    content = {"configuration": values, "scenarios": scenarios}
    if background := settings.report.background:
        content["background"] = file_hash(background)
    key = content_hash({"version": version("per_obspy"), **content})
    # One simulated scenario makes the ensemble simulated
    simulated = any(scenario["simulated"] for scenario in scenarios)
    return {"key": key, **content, "simulated": simulated}


def _risk_hash(outputs: Mapping[str, str]) -> str | None:
    """Return the hash of the risk table of a run, None without a usable pair."""
    table = table_outputs(outputs)
    return content_hash(table) if len(table) > 1 else next(iter(table.values()), None)


def _facts(scenario: EnsembleScenario, result: Result, folder: Path) -> dict[str, Any]:
    """Return the facts of a scenario; paths are seen from the folder of the configuration."""
    record = result.record
    return {
        "name": scenario.name,
        "weight": scenario.weight,
        "rate": scenario.rate,
        "run": os.path.relpath(scenario.run, folder),
        "output": os.path.relpath(result.folder, folder),
        "key": record["key"],
        "risk": _risk_hash(record["outputs"]),
        "state": record["state"],
        "simulated": record["simulated"],
        "pairs": record["counts"]["pairs"],
    }
