"""Facts of configurations and of results."""

from pathlib import Path
from typing import Any

import pandas as pd

from per_obspy.config import Design, Ensemble, Run, Simulation, load
from per_obspy.config.commented import effective_content
from per_obspy.errors import CatalogError
from per_obspy.inventory.catalogue import stored_inventories
from per_obspy.pipeline.inputs.described_tables import risk_table_facts
from per_obspy.pipeline.inputs.facts import Facts, some
from per_obspy.pipeline.inputs.recognition import Kind
from per_obspy.resume import StatusError, read_status


def configuration_facts(path: Path) -> Facts:
    """Return the facts of the configuration of a run."""
    settings = load(path, Run)
    content = effective_content(settings, path.resolve().parent)
    named = [("name", settings.name), ("results", _presence(settings.output))]
    # Everything else that is set, and whether a path is there
    chosen = {
        key: value for key, value in _dotted(content).items() if key not in ("name", "output")
    }
    lines = [(key, _shown(path, value)) for key, value in chosen.items()]
    more = [("and", f"{len(lines) - 10} more keys")] if len(lines) > 10 else []
    use = ("use", f"per-obspy run {path}")
    return Facts(
        Kind.CONFIGURATION,
        f"{len(chosen)} keys differ from their defaults",
        [*named, *lines[:10], *more, use],
        {},
        {"configuration": content},
    )


def other_configuration_facts(path: Path, kind: Kind) -> Facts:
    """Return the facts of a design spectrum's, an ensemble's or a scenario's configuration."""
    if kind is Kind.DESIGN:
        design = load(path, Design)
        lines = [("spectrum", _presence(design.spectrum)), ("pairs", _presence(design.pairs))]
        return Facts(kind, "", [*lines, ("use", f"per-obspy screen {path}")], {}, {})
    if kind is Kind.ENSEMBLE:
        ensemble = load(path, Ensemble)
        lines = [(one.name, _presence(one.run)) for one in ensemble.scenario[:10]]
        title = f"{len(ensemble.scenario)} scenarios"
        return Facts(kind, title, [*lines, ("use", f"per-obspy screen {path}")], {}, {})
    if kind is Kind.CATALOG:
        stored = stored_inventories(path)
        lines = [(one.name, f"{one.pairs} pairs, {one.licence}") for one in stored[:12]]
        return Facts(kind, f"{len(stored)} inventories", lines, {}, {"inventories": len(stored)})
    # A scenario, its epicentre and the centre of its stations
    scenario = load(path, Simulation).scenario
    lines = [("magnitude", f"{scenario.magnitude:g}"), ("stations", f"{scenario.stations}")]
    lines.append(("use", f"per-obspy run {path} PAIRS, or per-obspy simulate {path} -o FOLDER"))
    places = {
        "*": ([scenario.longitude], [scenario.latitude]),
        "^": ([scenario.city_longitude], [scenario.city_latitude]),
    }
    return Facts(kind, scenario.name, lines, places, {})


def result_facts(folder: Path) -> Facts:
    """
    Return the facts of the results of a run or of an ensemble.

    Raises
    ------
    CatalogError
        If the record of the run is damaged.
    """
    file = folder / "run.json" if (folder / "run.json").is_file() else folder / "ensemble.json"
    try:
        record = read_status(file)
    except StatusError as error:
        raise CatalogError(str(file), f"cannot be read: {error}") from error
    counts = record.get("counts") or {}
    lines = [("name", str(record.get("name", ""))), ("state", str(record.get("state", "")))]
    lines += [("begun", str(record["started"]))] if "started" in record else []
    lines += [("simulated", "the ground motion is SIMULATED.")] if record.get("simulated") else []
    lines += [("earthquake", text) for text in _earthquakes(record)]
    lines += [("rejected", _rejected(counts))] if counts else []
    # The risk table has states, worst pairs and places
    places, risk = {}, folder / "risk.parquet"
    if risk.is_file():
        table = risk_table_facts(risk)
        lines, places = [*lines, *table.lines], dict(table.places)
    places |= _stations(folder / "stations.csv")
    lines.append(("files", some(sorted([*record["outputs"], file.name]), 12)))
    title = f"{counts.get('stations', 0)} stations, {counts.get('pairs', 0)} pairs"
    return Facts(Kind.RESULT, title, lines, places, record)


def _dotted(content: dict[str, Any], prefix: str = "") -> dict[str, Any]:
    """Return the values of nested tables by their dotted keys."""
    result: dict[str, Any] = {}
    for key, value in content.items():
        is_table = isinstance(value, dict) and value
        result |= _dotted(value, f"{prefix}{key}.") if is_table else {f"{prefix}{key}": value}
    return result


def _shown(configuration: Path, value: object) -> str:
    """Return a value of a configuration; of a path also whether it is there."""
    if isinstance(value, str) and ("/" in value or "." in value):
        place = configuration.resolve().parent / value
        return f"{value}{'' if place.exists() else ' (not there)'}"
    return str(value)


def _presence(path: Path) -> str:
    """Return a path and whether it is there."""
    return f"{path}{'' if path.exists() else ' (not there yet)'}"


def _earthquakes(record: dict[str, Any]) -> list[str]:
    """Return the start of the earthquake that was screened."""
    groups = record.get("earthquakes") or []
    return [f"{one['start']}, {one['stations']} stations" for one in groups if one["screened"]]


def _rejected(counts: dict[str, int]) -> str:
    """Return what was left out, by kind."""
    kinds = {name: count for name, count in counts.items() if name.startswith("rejected_")}
    parts = [f"{count} {name.removeprefix('rejected_')}" for name, count in kinds.items() if count]
    return f"{', '.join(parts)}: rejected.csv" if parts else "nothing"


def _stations(path: Path) -> dict[str, Any]:
    """Return the places of the stations of a run, nothing if there is no table."""
    try:
        table = pd.read_csv(path, usecols=["longitude", "latitude"])
    except (OSError, ValueError):
        return {}
    return {"^": (table["longitude"].tolist(), table["latitude"].tolist())}
