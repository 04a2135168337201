"""Identity of a run: its configuration, its input files, and their common key."""

import json
import os
from collections.abc import Mapping
from concurrent.futures import Executor
from dataclasses import dataclass
from importlib.metadata import version
from pathlib import Path
from typing import TYPE_CHECKING, Any

from per_obspy.config import Engine, Notify, Run, load
from per_obspy.config.commented import commented, effective_content
from per_obspy.errors import CatalogError
from per_obspy.files import content_hash, written_whole
from per_obspy.inventory.files.side_file import side_file
from per_obspy.progress import Progress
from per_obspy.records.archive import hash_if_readable
from per_obspy.records.file_list import input_files
from per_obspy.results.ranked_table import table_files
from per_obspy.runs.inputs.drawn_pairs import footprint_files
from per_obspy.runs.inputs.extras import require_extras
from per_obspy.runs.tasks.parallel import Workers

if TYPE_CHECKING:
    from per_obspy.records.fdsn.cache import Fetched

#: Effective configuration of a run in its output folder.
CONFIGURATION = "configuration.toml"

#: First line of this file, by which it is known.
WRITTEN = "Effective configuration, written by per-obspy run."

#: Further lines at its top.
HEADING = (
    WRITTEN,
    "It runs again with the same result: per-obspy run configuration.toml. Keys that start with #",
    "have their defaults. The next run of this folder writes the file again: edit a copy.",
)


@dataclass(frozen=True)
class RunContext:
    """
    Everything that the stages of a run share.

    Attributes
    ----------
    settings : Run
        Settings of the run.
    folder : Path
        Of the results.
    workers : Workers
        Where to work.
    """

    settings: Run
    folder: Path
    workers: Workers

    @property
    def progress(self) -> Progress:
        """Callback for the progress of every stage."""
        return self.workers.progress


class RunSettings:
    """
    Settings of a run, its output folder, and the folder to which its paths are relative.

    Parameters
    ----------
    configuration : str, Path or Run
        TOML file, or settings that no file holds; their paths are seen from the output folder.
    output : str or Path, optional
        Folder of the results, instead of the configured one.

    Raises
    ------
    CatalogError
        If the configuration is wrong.
    MissingExtra
        If an optional library that it needs is not installed.
    """

    def __init__(self, configuration: str | Path | Run, output: str | Path | None) -> None:
        if isinstance(configuration, Run):
            self.file, self.settings = None, configuration
        else:
            self.file = Path(configuration).resolve()
            self.settings = load(self.file, Run)
        require_extras(self.settings)
        self.folder = Path(output or self.settings.output).resolve()
        self.base = self.file.parent if self.file else self.folder

    def use_fetched_map(self) -> None:
        """Let all stages read the ShakeMap that the cache of the records has, if there is one."""
        records = self.settings.records
        fdsn = records.fdsn if records else None
        if records is None or fdsn is None or not fdsn.shakemap or records.shakemap:
            return
        from per_obspy.records.fdsn.cache import known_shakemap

        # The configuration stays as it was given: a later run may have another version
        if found := known_shakemap(fdsn):
            files = {"shakemap": found.grid, "shakemap_uncertainty": found.uncertainty}
            files["stationlist"] = records.stationlist or found.stations
            update = {"records": records.model_copy(update=files)}
            self.settings = self.settings.model_copy(update=update)

    def context(self, executor: Executor | None, progress: Progress) -> RunContext:
        """Return what the stages of the run share."""
        workers = Workers(self.settings.workers, executor, progress)
        return RunContext(self.settings, self.folder, workers)

    def head(self, fetched: "Fetched | None", hashes: Mapping[Path, str]) -> dict[str, Any]:
        """
        Return key, configuration and inputs of a run; files with a known hash are not hashed again.

        The key is the same for every file that holds the same settings.
        """
        found = {
            path: hashes.get(path) or hash_if_readable(path)
            for path in _input_files(self.settings, fetched)
        }
        # Where the work is done, in how many processes, watching and messages change no result
        unused = {"workers": 0, "engine": Engine(), "watch": None}
        placed = self._public.model_copy(update={"output": self.folder, **unused})
        content = {
            "version": version("per_obspy"),
            "configuration": _values(placed, self.folder),
            "inputs": {os.path.relpath(path, self.folder): one for path, one in found.items()},
        }
        return {
            "key": content_hash(content),
            "configuration": _values(self._public, self.base),
            "inputs": {os.path.relpath(path, self.base): one for path, one in found.items()},
        }

    @property
    def _public(self) -> Run:
        """Return the settings without section ``[notify]``, whose commands may contain secrets."""
        return self.settings.model_copy(update={"notify": Notify()})

    def write(self) -> None:
        """
        Write the effective configuration into the output folder unless the run reads it from there.

        Raises
        ------
        CatalogError
            If a file of its name is there that no run has written.
        """
        path = self.folder / CONFIGURATION
        if path == self.file:
            return
        placed = self._public.model_copy(update={"output": self.folder})
        text = commented(Run, effective_content(placed, self.folder), HEADING)
        # A file of that name that no run has written is kept
        before = path.read_text(encoding="utf-8", errors="replace") if path.is_file() else None
        if before and not before.startswith(f"# {WRITTEN}"):
            raise CatalogError(
                str(path), "is not written by a run and would be lost: name another folder with -o"
            )
        if before != text:
            with written_whole(path) as part:
                part.write_text(text, encoding="utf-8")


def _values(settings: Run, folder: Path) -> dict[str, Any]:
    """Return all settings as plain values, with paths relative to a folder."""
    values: dict[str, Any] = json.loads(settings.model_dump_json(context={"folder": folder}))
    return values


def _input_files(settings: Run, fetched: "Fetched | None") -> list[Path]:
    """Return every input file of a run: records and their metadata, scenario and inventory."""
    given = [settings.simulation, settings.report.background, *_inventory_files(settings)]
    given += table_files(settings.after) if settings.after else []
    files = [path for path in given if path and path.is_file()]
    return [*input_files(settings.records, fetched), *files]


def _inventory_files(settings: Run) -> list[Path]:
    """Return every file from which pairs may be taken, and the index that names them."""
    pairs = settings.pairs
    if pairs is None or pairs.simulated is not None:
        return []
    if pairs.footprints is not None:
        return footprint_files(pairs.footprints)
    if pairs.catalog is None:
        # A file next to the table may describe how it is read
        return [pairs.file, side_file(pairs.file)] if pairs.file else []
    from per_obspy.inventory.catalogue import stored_inventories

    # Stored inventories, all of which the region may touch
    stored = stored_inventories(pairs.catalog)
    chosen = [entry.file for entry in stored if not pairs.names or entry.name in pairs.names]
    return [pairs.catalog, *chosen, *map(side_file, chosen)]
