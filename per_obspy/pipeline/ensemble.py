"""
Ensemble of scenarios: one run per scenario, then the joint probability of every pair.

A run that is done is not done again, and neither is the ensemble, whose ``ensemble.json`` is
written last.
"""

import json
import os
from collections.abc import Mapping
from concurrent.futures import Executor
from importlib.metadata import version
from pathlib import Path
from typing import Any

from per_obspy.config import Ensemble, EnsembleScenario, Run, in_language, load
from per_obspy.errors import CatalogError
from per_obspy.files import content_hash, remove_file
from per_obspy.jobs.output_folder import (
    Result,
    file_hashes,
    locked_folder,
    now,
    recorded,
    software_versions,
)
from per_obspy.pipeline.inputs.extras import require_extras
from per_obspy.pipeline.inputs.preflight import check_inputs
from per_obspy.pipeline.results.scenario_runs import ScenarioRun, ScenarioRuns
from per_obspy.pipeline.results.table_report import report_ensemble
from per_obspy.pipeline.run import run
from per_obspy.progress import Progress, silent
from per_obspy.resume import earlier_status
from per_obspy.tables.coverage import Coverage, most_first
from per_obspy.tables.ensemble import Scenarios, write_ensemble
from per_obspy.tables.ranked_table import table_files, table_outputs

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
    tables = {name: _risk_table(result) for name, result in runs.items()}
    scenarios = Scenarios(tables, settings.weights, settings.yearly)
    files, counts = write_ensemble(scenarios, folder, facts, settings.csv_rows)
    # Results of the runs know buildings, stations and records
    scenarios_run = {
        scenario.name: ScenarioRun(load(scenario.run, Run), runs[scenario.name].folder)
        for scenario in settings.scenario
    }
    coverage = _coverage(runs, counts)
    made = report_ensemble(settings, folder, simulated, coverage, ScenarioRuns(scenarios_run))
    # Rejections make a result partial, those of a run too
    is_partial = any(result.record["partial"] for result in runs.values())
    return {
        "state": "complete" if counts["pairs"] else "nothing_usable",
        "partial": counts["rejected_pair"] > 0 or is_partial,
        "counts": counts,
        "coverage": coverage.as_record(),
        "faults": made.faults,
        "outputs": file_hashes(folder, [*files, *made.outputs]),
        "versions": software_versions(),
    }


def _coverage(runs: Mapping[str, Result], counts: Mapping[str, int]) -> Coverage:
    """Return the coverage of an ensemble: pairs with a probability in every scenario."""
    of_runs = [Coverage.of_record(result.record) for result in runs.values()]
    fullest, widest = min(of_runs, key=_left_out), max(of_runs, key=lambda one: one.pairs)
    pairs, rejected = counts["pairs"], counts["rejected_pair"]
    rows = max(pairs + rejected, *(one.rows for one in of_runs))
    # Rows that every scenario leaves out have the reasons of the one that leaves out least
    kinds = {"no probability in every scenario": rejected} if rejected else {}
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


def _risk_table(result: Result) -> list[Path]:
    """Return the files of the risk table of a run, none without a usable pair."""
    return table_files(result.folder) if table_outputs(result.record["outputs"]) else []


def _head(settings: Ensemble, configuration: Path, runs: Mapping[str, Result]) -> dict[str, Any]:
    """Return key, configuration and scenarios of an ensemble."""
    folder = configuration.parent
    values = json.loads(settings.model_dump_json(context={"folder": folder}))
    scenarios = [_facts(scenario, runs[scenario.name], folder) for scenario in settings.scenario]
    content = {"configuration": values, "scenarios": scenarios}
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
