"""Settings of a run from the arguments of a command: a configuration, or records and pairs."""

import logging
from collections import defaultdict
from collections.abc import Collection, Mapping, Sequence
from pathlib import Path
from typing import Any, NamedTuple

from per_obspy.config import Run, checked
from per_obspy.config.commented import merged, parsed_changes
from per_obspy.config.section import read_toml
from per_obspy.errors import CatalogError, printable
from per_obspy.runs.inputs.input_kinds import (
    PAIR_KINDS,
    RECORD_KINDS,
    Kind,
    files_in,
    kind_of,
    records_place,
    require_whole_json,
)

log = logging.getLogger(__name__)

#: Folder of the shell in which results are written where no other is named.
RESULTS = Path("results")


class Request(NamedTuple):
    """Settings of a run, from the arguments of its command."""

    #: TOML file of the run, or settings that no file holds yet.
    configuration: Path | Run
    #: How the arguments were understood; empty for the configuration of a file alone.
    line: str


def requested_run(
    first: str, second: str | None = None, output: Path | None = None, changes: Sequence[str] = ()
) -> Request:
    """
    Return the settings of the run for the arguments of a command.

    Parameters
    ----------
    first, second : str
        Configuration, or a folder that holds one; else records and pairs in either order. Which is
        which is seen by their content.
    output : Path, optional
        Folder of the results.
    changes : sequence of str
        ``key=value`` with dotted keys of the configuration and values of TOML.

    Raises
    ------
    CatalogError
        If records or pairs are missing, an argument is of another kind, or a change is wrong.
    """
    changed = parsed_changes(changes, Run)
    # A configuration, as it is or with changes
    if second is None and (file := _configuration(first)):
        line = "" if file == Path(first) else f"configuration: {file}"
        return Request(_configured(file, changed, output), line)
    # Records and pairs
    records, pairs = _roles(first, second, changed)
    pairs = pairs and str(_one_table(pairs))
    folder = (output or RESULTS / _stems("-", records, pairs)).absolute()
    content = run_content(records, pairs, folder)
    settings = checked(Run, merged(content, changed))
    results = _shown(output or settings.output)
    line = f"{_said('records', records)}; {_said('pairs', pairs)}; results: {results}"
    _require_apart(settings)
    return Request(settings, line)


def _configured(file: Path, changed: dict[str, Any], output: Path | None) -> Path | Run:
    """Return the settings of a file with changes; the file itself where there are none."""
    if not changed and output is None:
        return file
    given = read_toml(file)
    content = merged(given, changed)
    # The folder of the command takes the place of a missing one
    if output is not None:
        content.setdefault("output", str(output.absolute()))
    if content == given:
        return file
    source = f"{file} and --set" if changed else str(file)
    return checked(Run, content, source, file.resolve().parent)


def run_content(records: str | None, pairs: str | None, output: Path) -> dict[str, Any]:
    """
    Return the content of the configuration of a run, with absolute paths.

    Parameters
    ----------
    records, pairs : str, optional
        Arguments of the command; missing ones are left out.
    output : Path
        Folder of the results.
    """
    pairs = pairs and str(_one_table(pairs))
    content = dict[str, Any](
        name=_stems(", ", records, pairs) or "run", output=str(output.absolute())
    )
    if records is not None:
        content |= _records_content(records, output)
    if pairs is not None:
        content["pairs"] = _pairs_content(pairs)
    return content


def named_configuration(argument: Path, kinds: Collection[Kind] = (Kind.CONFIGURATION,)) -> Path:
    """
    Return a configuration, or the only one in a folder such as that of earlier results.

    Parameters
    ----------
    argument : Path
        TOML file or folder.
    kinds : collection of Kind
        Kinds of configurations that a folder is searched for.

    Raises
    ------
    CatalogError
        If a folder holds none of them, or several.
    """
    if not argument.is_dir():
        return argument
    if found := _only_configuration(argument, kinds):
        return found
    expected = " or ".join(kinds)
    raise CatalogError(str(argument), f"holds no {expected}: name a TOML file, or a folder of one")


def _only_configuration(folder: Path, kinds: Collection[Kind]) -> Path | None:
    """Return the only configuration in a folder, None if there is none."""
    found = [path for path, kind in files_in(folder).items() if kind in kinds]
    if len(found) > 1:
        names = ", ".join(file.name for file in found)
        raise CatalogError(str(folder), f"holds several configurations, name one: {names}")
    return found[0] if found else None


def _configuration(argument: str) -> Path | None:
    """Return the configuration that an argument names; None if it names another kind of input."""
    path = Path(argument)
    if path.is_dir():
        return _only_configuration(path, (Kind.CONFIGURATION,))
    if path.is_file():
        return path if kind_of(path) is Kind.CONFIGURATION else None
    # A missing file is reported where it is read
    return path if path.suffix.lower() == ".toml" else None


def _roles(
    first: str, second: str | None, changed: Mapping[str, Any]
) -> tuple[str | None, str | None]:
    """Return records and pairs from arguments in any order."""
    given = [first] if second is None else [first, second]
    kinds = {argument: kind_of(argument) for argument in given}
    records = [argument for argument in given if kinds[argument] in RECORD_KINDS]
    pairs = [argument for argument in given if kinds[argument] in PAIR_KINDS]
    # A folder of records may also hold the table that is named as pairs
    if second is not None and len(records) == 2 and _tables_in(second):
        records, pairs = [first], [second]
    _require_both(given, kinds, (records, pairs), changed)
    return next(iter(records), None), next(iter(pairs), None)


def _require_both(
    given: Sequence[str],
    kinds: Mapping[str, Kind],
    found: tuple[list[str], list[str]],
    changed: Mapping[str, Any],
) -> None:
    """Raise CatalogError unless the arguments are one source of records and one inventory."""
    # Neither of them
    for argument in given:
        if kinds[argument] not in (*RECORD_KINDS, *PAIR_KINDS):
            raise CatalogError(argument, _misplaced(kinds[argument]))
    records, pairs = found
    example = "per-obspy run RECORDS PAIRS"
    # The same twice, or one alone
    for argument in given if len(pairs) > 1 else ():
        require_whole_json(Path(argument))
    if len(records) > 1 or len(pairs) > 1:
        missing = "records" if pairs else "a pair table or footprints of buildings"
        raise CatalogError(" and ".join(given), f"neither is {missing}: {example}")
    if not pairs and "pairs" not in changed and kinds[given[0]] is not Kind.SCENARIO:
        reason = "records without pairs: name a pair table or footprints too"
        raise CatalogError(given[0], f"{reason}, {example}, or --set pairs.simulated.count=100")
    if not records and not changed.keys() & {"records", "simulation"}:
        reason = "pairs without records: name a folder, archive or file of records, or the "
        raise CatalogError(given[0], f"{reason}identifier of an earthquake too: {example}")


def _misplaced(kind: Kind) -> str:
    """Return the advice for an input that is neither records nor pairs."""
    commands = {
        Kind.DESIGN: "per-obspy screen FILE",
        Kind.ENSEMBLE: "per-obspy screen FILE",
        Kind.RESULT: "per-obspy info FOLDER shows them, per-obspy report makes figures again",
        Kind.EVENT: "it belongs into --set records.event=FILE",
        Kind.STATIONS: "it belongs into --set records.stationxml=FILE",
        Kind.CONFIGURATION: "a configuration names its records and pairs itself; name it alone",
    }
    advice = commands.get(kind, "per-obspy run needs records and pairs")
    return f"{kind}, neither records nor pairs: {advice}"


def _tables_in(argument: str) -> list[Path]:
    """Return the pair tables and layers of footprints in a folder."""
    path = Path(argument)
    files = files_in(path) if path.is_dir() else {}
    return [file for file, kind in files.items() if kind in PAIR_KINDS]


#: Kinds of files with a motion without a record, and their keys of the configuration.
_MOTIONS = {Kind.SHAKEMAP: "shakemap", Kind.STATION_LIST: "stationlist"}


def _records_content(records: str, output: Path) -> dict[str, Any]:
    """Return the sections of a configuration that name the records."""
    kind = kind_of(records)
    if kind is Kind.EVENT_ID:
        return {"records": {"fdsn": _fdsn_content(records, output.absolute() / "fetched")}}
    # Motion that is simulated or mapped
    path = Path(records).absolute()
    if kind is Kind.SCENARIO:
        return {"simulation": str(path)}
    if kind in _MOTIONS:
        return {"records": {_MOTIONS[kind]: str(path)}}
    place, is_workspace = records_place(path)
    if is_workspace:
        return {"records": {"asdf": {"file": str(place)}}}
    if path.is_file():
        return {"records": {"folder": str(path)}}
    return {"records": _folder_content(path)}


def _folder_content(path: Path) -> dict[str, str]:
    """Return the keys of a folder of records, and of files in it that describe the earthquake."""
    found, beside = dict[str, str](), defaultdict[str, list[Path]](list)
    kinds = files_in(path)
    for file, one in kinds.items():
        if key := _beside_records(file, one):
            beside[key].append(file)
    for key, files in beside.items():
        if len(files) == 1:
            found[key] = str(files[0])
        elif key != "event":  # records show theirs
            names = ", ".join(file.name for file in files)
            log.warning("%s: none of %s is used: name one in records.%s", path, names, key)
    if "shakemap" not in found:
        found.pop("shakemap_uncertainty", None)
    # A motion without any record is all there is
    is_alone = Kind.RECORDS not in kinds.values() and not any(map(Path.is_dir, path.iterdir()))
    if not (is_alone and found.keys() & {*_MOTIONS.values()}):
        found["folder"] = str(path)
    return found


def _beside_records(file: Path, kind: Kind) -> str | None:
    """Return the key of the records for a file among them that describes the earthquake."""
    # Both files of a ShakeMap are grids
    if kind is Kind.SHAKEMAP and "uncertainty" in file.name.lower():
        return "shakemap_uncertainty"
    return {Kind.EVENT: "event", **_MOTIONS}.get(kind)


def _fdsn_content(identifier: str, cache: Path) -> dict[str, Any]:
    """Return the section ``[records.fdsn]`` for the identifier of an earthquake."""
    from per_obspy.records.earthquakes.services import OTHERS, RECORDS_OF, event_of
    from per_obspy.runs.fetch import CHANNELS

    provider, event = event_of(identifier)
    return {
        "event_id": event,
        "event_provider": provider,
        "providers": list(RECORDS_OF.get(provider, OTHERS)),
        "channels": list(CHANNELS),
        "cache": str(cache),
        "shakemap": provider == "USGS",
    }


def _pairs_content(pairs: str) -> dict[str, Any]:
    """Return the section of a configuration that names the pairs."""
    path = _one_table(pairs)
    kind = kind_of(path)
    if kind is Kind.FOOTPRINTS:
        return {"footprints": {"file": str(path)}}
    return {"catalog" if kind is Kind.CATALOG else "file": str(path)}


def _one_table(pairs: str) -> Path:
    """Return the pair table or layer of an argument; a folder must contain exactly one."""
    tables = _tables_in(pairs) if Path(pairs).is_dir() else [Path(pairs)]
    if len(tables) > 1:
        names = ", ".join(file.name for file in tables)
        raise CatalogError(pairs, f"holds several pair tables or layers, name one: {names}")
    return tables[0].absolute()


def _require_apart(settings: Run) -> None:
    """Raise CatalogError if results would be written among the records that are read."""
    folder = settings.records.folder if settings.records else None
    if folder and folder.is_dir() and settings.output.resolve().is_relative_to(folder.resolve()):
        reason = f"lies inside the folder of the records, {folder}: name another one with -o"
        raise CatalogError(str(settings.output), reason)


def _stems(between: str, *arguments: str | None) -> str:
    """Return the names of the inputs that there are."""
    return between.join(_stem(one) for one in arguments if one is not None)


def _stem(argument: str) -> str:
    """Return the name of an input without its suffix, as a valid folder name."""
    path = Path(argument)
    name = path.resolve().name if path.exists() else argument
    stem = name.partition(".")[0] if path.is_file() else name
    return printable("".join(one if one.isalnum() or one in "-_" else "_" for one in stem))


def _said(role: str, argument: str | None) -> str:
    """Return a sentence on the recognised kind of an argument."""
    if argument is None:
        return f"{role}: those of the scenario or of --set"
    kind, path = kind_of(argument), Path(argument)
    if kind is Kind.RECORDS:
        return f"{role}: {argument} ({'folder' if path.is_dir() else 'file'})"
    return f"{role}: {_shown(path) if path.exists() else argument} ({kind})"


def _shown(path: Path) -> str:
    """Return a path relative to the current folder if it lies below it."""
    here = Path.cwd()
    return str(path.relative_to(here) if path.is_relative_to(here) else path)
