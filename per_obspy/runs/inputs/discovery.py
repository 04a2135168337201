"""First configuration from the files of a folder, for ``per-obspy init``."""

import os
from collections.abc import Sequence
from itertools import islice
from pathlib import Path
from typing import NamedTuple

from per_obspy.config import Run
from per_obspy.config.commented import commented
from per_obspy.config.section import with_paths
from per_obspy.errors import CatalogError
from per_obspy.files import written_whole
from per_obspy.records.folder import find_stations
from per_obspy.runs.inputs.arguments import RESULTS, run_content
from per_obspy.runs.inputs.input_kinds import (
    PAIR_KINDS,
    RECORD_KINDS,
    Kind,
    files_in,
    kind_of,
)

#: Kinds of files that are a ground motion without a record.
MOTIONS = (Kind.SHAKEMAP, Kind.STATION_LIST, Kind.SCENARIO)

#: Files of a folder that are tried as records before it counts as one without any.
TRIED = 20


class Found(NamedTuple):
    """
    Inputs for a configuration.

    Attributes
    ----------
    records, pairs : list of Path
        Candidates; a configuration needs one of each.
    """

    records: list[Path]
    pairs: list[Path]


def found_inputs(folder: Path) -> Found:
    """
    Return the possible inputs of a run in a folder: files, archives and subfolders.

    Loose records in the folder itself count as the folder.
    """
    files = files_in(folder)
    pairs = [path for path, kind in files.items() if kind in PAIR_KINDS]
    loose = [path for path, kind in files.items() if kind is Kind.RECORDS]
    records = [path for path, kind in files.items() if kind in MOTIONS]
    # Archives and workspaces stand for themselves, other records for their folder
    whole = [path for path in loose if _is_bundle(path)]
    single = [path for path in loose if path not in whole]
    records += [path for path in whole if _are_records([path])]
    records += [folder] if _are_records(single) else []
    # Subfolders by their content
    for path in _subfolders(folder):
        kind = kind_of(path)
        pairs += [path] if kind in PAIR_KINDS else []
        records += [path] if kind is Kind.RECORDS and _are_records(_first_files(path)) else []
    return Found(records, pairs)


def _subfolders(folder: Path) -> list[Path]:
    """Return the folders in a folder, hidden ones and links left out."""
    shown = (path for path in sorted(folder.iterdir()) if not path.name.startswith("."))
    return [path for path in shown if path.is_dir() and not path.is_symlink()]


def _first_files(folder: Path) -> list[Path]:
    """Return the first files below a folder."""
    files = (path for path in folder.rglob("*") if path.is_file())
    return sorted(islice(files, TRIED))


def write_first_configuration(
    path: Path, records: str | None, pairs: str | None, force: bool = False
) -> list[str]:
    """
    Write a configuration with the named inputs, or those of its folder, and help on every key.

    Parameters
    ----------
    path : Path
        TOML file.
    records, pairs : str, optional
        As in ``per-obspy run``; a missing one is looked for in the folder of the file.
    force : bool
        Whether an existing file may be replaced.

    Returns
    -------
    lines : list of str
        Sentences on found and missing inputs.

    Raises
    ------
    CatalogError
        If the file exists, or an argument is neither records nor pairs.
    """
    if path.exists() and not force:
        raise CatalogError(str(path), "exists already: --force writes it again, -o names another")
    folder = path.absolute().parent
    found = found_inputs(folder) if None in (records, pairs) and folder.is_dir() else Found([], [])
    # Named ones count, else the only one of its kind
    chosen_records, said_records = _chosen(records, found.records, RECORD_KINDS, "records")
    chosen_pairs, said_pairs = _chosen(pairs, found.pairs, PAIR_KINDS, "pairs")
    content = run_content(chosen_records, chosen_pairs, _output(folder, chosen_records))
    relative = with_paths(content, Run, lambda one: os.path.relpath(one, folder))
    text = commented(Run, relative, _heading(path))
    with written_whole(path) as part:
        part.write_text(text, encoding="utf-8")
    return [said_records, said_pairs]


def _is_bundle(path: Path) -> bool:
    """Return whether a file holds many records: an archive or a workspace."""
    from per_obspy.records.archive import is_archive
    from per_obspy.records.asdf import is_asdf

    return is_archive(path) or is_asdf(path)


def _are_records(files: Sequence[Path]) -> bool:
    """Return whether one of the first files can be read as a record."""
    for path in files[:TRIED]:
        try:
            if _is_bundle(path) or find_stations(path).stations:
                return True
        except CatalogError:
            continue
    return False


def _chosen(
    named: str | None, found: Sequence[Path], kinds: Sequence[Kind], role: str
) -> tuple[str | None, str]:
    """Return the input of a role, named or the only one found, and its description."""
    # Named, the only one found, none or several
    if named is not None:
        kind = kind_of(named)
        if kind not in kinds:
            raise CatalogError(named, f"{kind}, no {role}")
        return named, f"{role}: {named} ({kind})"
    if len(found) == 1:
        return str(found[0]), f"{role}: {found[0].name or '.'} ({kind_of(found[0])}, found here)"
    if not found:
        return None, f"{role}: none found here; fill in the section [{role}]"
    names = ", ".join(path.name for path in found)
    return None, f"{role}: several found ({names}); fill in the section [{role}]"


def _output(folder: Path, records: str | None) -> Path:
    """Return the folder of the results: next to the configuration, but not among the records."""
    is_inside = records is not None and folder.is_relative_to(Path(records).absolute())
    return folder.parent / f"{folder.name}_results" if is_inside else folder / RESULTS


def _heading(path: Path) -> tuple[str, ...]:
    """Return the comment at the top of a first configuration."""
    return (
        f"Configuration of a run: per-obspy run {path.name}",
        "Lines that begin with # and a blank are help. Keys and [sections] that begin with # alone",
        "are not set and show their defaults: remove the # to set them. Paths are relative to the",
        "folder of this file.",
    )
