"""Facts of configurations and of results."""

from pathlib import Path
from typing import Any

import pandas as pd

from per_obspy.config import Design, Ensemble, Run, Simulation, load
from per_obspy.config.commented import effective_content
from per_obspy.errors import CatalogError
from per_obspy.inventory.catalogue import stored_inventories
from per_obspy.results.ranked_table import listed_outputs, table_files
from per_obspy.resume import StatusError, read_status
from per_obspy.runs.inputs.described_tables import ranked_table_facts
from per_obspy.runs.inputs.facts import Facts, Places, some
from per_obspy.runs.inputs.input_kinds import Kind

#: Keys of a configuration that are listed.
MOST_KEYS = 12


def configuration_facts(path: Path) -> Facts:
    """Return the facts of the configuration of a run."""
    settings = load(path, Run)
    content = effective_content(settings, path.resolve().parent)
    lines = [("name", settings.name), ("results", _presence(settings.output))]
    # Everything else that is set, and whether a path is there
    chosen = _dotted({key: one for key, one in content.items() if key not in ("name", "output")})
    keys = [(key, _shown(path, value)) for key, value in chosen.items()]
    lines += keys[:MOST_KEYS]
    lines += [("and", f"{len(keys) - MOST_KEYS} more keys")] if len(keys) > MOST_KEYS else []
    lines.append(("use", f"per-obspy run {path}"))
    title = f"{len(chosen)} keys differ from their defaults"
    return Facts(Kind.CONFIGURATION, title, lines, {}, {"configuration": content})


def design_facts(path: Path) -> Facts:
    """Return the facts of the configuration of a screening by a spectrum."""
    design = load(path, Design)
    lines = [("spectrum", _presence(design.spectrum)), ("pairs", _presence(design.pairs))]
    lines.append(("use", f"per-obspy screen {path}"))
    return Facts(Kind.DESIGN, "", lines, {}, {})


def ensemble_facts(path: Path) -> Facts:
    """Return the facts of the configuration of an ensemble."""
    ensemble = load(path, Ensemble)
    lines = [(one.name, _presence(one.run)) for one in ensemble.scenario]
    lines.append(("use", f"per-obspy screen {path}"))
    return Facts(Kind.ENSEMBLE, f"{len(ensemble.scenario)} scenarios", lines, {}, {})


def catalog_facts(path: Path) -> Facts:
    """Return the facts of an index of stored inventories."""
    stored = stored_inventories(path)
    lines = [(one.name, f"{one.pairs} pairs, {one.licence}") for one in stored]
    known = {"inventories": len(stored)}
    return Facts(Kind.CATALOG, f"{len(stored)} inventories", lines, {}, known)


def scenario_facts(path: Path) -> Facts:
    """Return the facts of a scenario; the map has its epicentre and the centre of its stations."""
    scenario = load(path, Simulation).scenario
    lines = [("magnitude", f"{scenario.magnitude:g}"), ("stations", f"{scenario.stations}")]
    lines.append(("use", f"per-obspy run {path} PAIRS, or per-obspy simulate {path} -o FOLDER"))
    # Epicentre and stations
    places: dict[str, Places] = {
        "*": ([scenario.longitude], [scenario.latitude]),
        "^": ([scenario.city_longitude], [scenario.city_latitude]),
    }
    return Facts(Kind.SCENARIO, scenario.name, lines, places, {})


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
    # Facts of run.json
    counts = record.get("counts") or {}
    # The risk table has states, worst pairs and places
    risk = table_files(folder)
    table = ranked_table_facts(risk) if risk else None
    lines = [*_record_lines(record, counts), *(table.lines if table else [])]
    lines.append(("files", some(listed_outputs([*record["outputs"], file.name]), 12)))
    places = (table.places if table else {}) | _stations(folder / "stations.csv")
    title = f"{counts.get('stations', 0)} stations, {counts.get('pairs', 0)} pairs"
    return Facts(Kind.RESULT, title, lines, places, record)


def _record_lines(record: dict[str, Any], counts: dict[str, int]) -> list[tuple[str, str]]:
    """Return the facts in ``run.json``."""
    lines = [("name", str(record.get("name", ""))), ("state", str(record.get("state", "")))]
    lines += [("begun", str(record["started"]))] if "started" in record else []
    lines += [("simulated", "the ground motion is SIMULATED.")] if record.get("simulated") else []
    # Screened earthquake, and rejections
    groups = [one for one in record.get("earthquakes") or [] if one.get("screened")]
    for one in groups:
        # Of the event where there are no groups
        time = one.get("start") or (one.get("event") or {}).get("time", "")
        stations = one.get("stations", counts.get("stations", 0))
        lines.append(("earthquake", f"{time}, {stations} stations"))
    # Of footprints before the run, of everything else in it
    drawn = record.get("drawn") or {}
    if drawn.get("rejected"):
        lines.append(("footprints", f"{drawn['rejected']} rejected: pairs.rejected.csv"))
    return [*lines, *([("rejected", _rejected(counts))] if counts else [])]


def _rejected(counts: dict[str, int]) -> str:
    """Return the number of rejections of each kind as text."""
    kinds = {name: count for name, count in counts.items() if name.startswith("rejected_")}
    parts = [f"{count} {name.removeprefix('rejected_')}" for name, count in kinds.items() if count]
    return f"{', '.join(parts)}: rejected.csv" if parts else "nothing"


def _dotted(content: dict[str, Any], prefix: str = "") -> dict[str, Any]:
    """Return the values of nested tables by their dotted keys."""
    result: dict[str, Any] = {}
    for key, value in content.items():
        is_table = isinstance(value, dict) and value
        result |= _dotted(value, f"{prefix}{key}.") if is_table else {f"{prefix}{key}": value}
    return result


def _shown(configuration: Path, value: object) -> str:
    """Return a value of a configuration as text; of a path also whether it exists."""
    if isinstance(value, str) and ("/" in value or "." in value):
        place = configuration.resolve().parent / value
        return f"{value}{'' if place.exists() else ' (not there)'}"
    return str(value)


def _presence(path: Path) -> str:
    """Return a path and whether it exists."""
    return f"{path}{'' if path.exists() else ' (not there yet)'}"


def _stations(path: Path) -> dict[str, Places]:
    """Return the places of the stations of a run, empty without a table."""
    try:
        table = pd.read_csv(path, usecols=["longitude", "latitude"])
    except (OSError, ValueError):
        return {}
    return {"^": (table["longitude"].tolist(), table["latitude"].tolist())}
