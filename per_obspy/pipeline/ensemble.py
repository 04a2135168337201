"""
An ensemble of scenarios: each a run of its own, then the probability of every pair in all of them together.

A run that is done is not done again, and neither is the ensemble, whose ``ensemble.json`` is
written last.
"""

import json
import os
from concurrent.futures import Executor
from importlib.metadata import version
from pathlib import Path
from typing import Any

from per_obspy.config import Ensemble, EnsembleScenario, Run, load
from per_obspy.errors import CatalogError
from per_obspy.jobs.output_folder import (
    Result,
    earlier_record,
    file_hashes,
    held,
    now,
    recorded,
    software_versions,
)
from per_obspy.pipeline.run import run
from per_obspy.pipeline.stations import content_hash
from per_obspy.progress import Progress, silent
from per_obspy.tables.ensemble import Scenarios, write_ensemble

#: Written last.
RECORD = "ensemble.json"


def screen_scenarios(
    configuration: Path,
    output: Path | None = None,
    executor: Executor | None = None,
    progress: Progress = silent,
) -> Result:
    """
    Do the run of every scenario, unless it is done, and join their probabilities pair by pair.

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
        Told of every stage: scenario and name, done, total.

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
    settings = load(configuration, Ensemble)
    folder = (output or settings.output).resolve()
    _check_folders(settings, configuration, folder)
    started = now()
    runs = {
        one.name: run(one.run, None, executor, _prefixed(one.name, progress))
        for one in settings.scenario
    }
    with held(folder):
        head = _head(settings, configuration, runs)
        if known := earlier_record(folder / RECORD, head["key"]):
            return Result(folder, known, did_nothing=True)
        (folder / RECORD).unlink(missing_ok=True)
        progress("joining scenarios", 0, 1)
        facts = {"name": settings.name, "simulated": str(head["simulated"]).lower()}
        tables = {name: _risk_table(one) for name, one in runs.items()}
        scenarios = Scenarios(tables, settings.weights, settings.yearly)
        files, counts = write_ensemble(scenarios, folder, facts, settings.csv_rows)
        progress("joining scenarios", 1, 1)
        found = {
            "state": "complete" if counts["pairs"] else "nothing_usable",
            "partial": counts["rejected_pair"] > 0
            or any(one.record["partial"] for one in runs.values()),
            "counts": counts,
            "outputs": file_hashes(folder, files),
            "versions": software_versions(),
        }
        return recorded(
            folder / RECORD, {"name": settings.name, **found, "started": started, **head}
        )


def _check_folders(settings: Ensemble, configuration: Path, folder: Path) -> None:
    """Check that no run writes where another one or the ensemble does."""
    owners = {folder: "the ensemble"}
    for one in settings.scenario:
        place = load(one.run, Run).output.resolve()
        if place in owners:
            reason = f"scenario {one.name!r} has the output folder of {owners[place]}, {place}"
            raise CatalogError(str(configuration), reason)
        owners[place] = f"scenario {one.name!r}"


def _prefixed(name: str, progress: Progress) -> Progress:
    """Return what tells of a run's stages under the name of its scenario."""
    return lambda stage, done, total: progress(f"{name}: {stage}", done, total)


def _risk_table(result: Result) -> Path | None:
    """Return the risk table of a run, None if nothing usable was left."""
    return result.folder / "risk.parquet" if "risk.parquet" in result.record["outputs"] else None


def _head(settings: Ensemble, configuration: Path, runs: dict[str, Result]) -> dict[str, Any]:
    """Return what the ensemble stands on, and the key that tells whether the same was done before."""
    said = json.loads(settings.model_dump_json(context={"folder": configuration.parent}))
    scenarios = [_said(one, runs[one.name], configuration.parent) for one in settings.scenario]
    key = content_hash(
        {"version": version("per_obspy"), "configuration": said, "scenarios": scenarios}
    )
    simulated = any(one["simulated"] for one in scenarios)
    return {"key": key, "configuration": said, "scenarios": scenarios, "simulated": simulated}


def _said(scenario: EnsembleScenario, result: Result, folder: Path) -> dict[str, Any]:
    """Return what the record says of a scenario; paths are seen from the folder of the configuration."""
    record = result.record
    return {
        "name": scenario.name,
        "weight": scenario.weight,
        "rate": scenario.rate,
        "run": os.path.relpath(scenario.run, folder),
        "output": os.path.relpath(result.folder, folder),
        "key": record["key"],
        "risk": record["outputs"].get("risk.parquet"),
        "state": record["state"],
        "simulated": record["simulated"],
        "pairs": record["counts"]["pairs"],
    }
