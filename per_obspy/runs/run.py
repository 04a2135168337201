"""
One run, from records to report, or one of its stages alone.

Whether the work is done is found out here with few libraries, so that a finished run answers at
once; :mod:`per_obspy.runs.stages` does what is left, in the order of its functions.
"""

import logging
from collections.abc import Mapping
from concurrent.futures import Executor
from pathlib import Path
from typing import TYPE_CHECKING, Any

from per_obspy.config import Run
from per_obspy.errors import CatalogError
from per_obspy.progress import Progress, silent
from per_obspy.resume import StatusError, changed_outputs, earlier_status, read_status
from per_obspy.runs.output_folder import (
    RECORD,
    STATIONS,
    UNFINISHED,
    WORST_PAIRS,
    Result,
    locked_folder,
)
from per_obspy.runs.provenance import RunSettings
from per_obspy.runs.tasks.parallel import Workers, prepare_workers
from per_obspy.runs.tasks.worker_start import loading

if TYPE_CHECKING:
    from per_obspy.records.fdsn.cache import Fetched

log = logging.getLogger(__name__)


def run(
    configuration: str | Path | Run,
    output: str | Path | None = None,
    executor: Executor | None = None,
    progress: Progress = silent,
    facts: Mapping[str, object] | None = None,
    fetched: "Fetched | None" = None,
) -> Result:
    """
    Do a whole run: records to spectra to risk table to figures.

    Parameters
    ----------
    configuration : str, Path or Run
        TOML file, or the settings themselves, see :class:`per_obspy.config.Run`.
    output : str or Path, optional
        Folder of the results, instead of the configured one.
    executor : Executor, optional
        Where stations are processed; processes of this machine if not given.
    progress : callable
        Called for every stage: name, done, total.
    facts : mapping, optional
        Plain values for ``run.json`` that change no result, such as the number of a revision.
    fetched : Fetched, optional
        Records of FDSN services, if they have been fetched; otherwise they are fetched here.

    Returns
    -------
    Result
        The folder and the content of its ``run.json``.

    Raises
    ------
    CatalogError
        If the configuration, the folder of records or the pair table is wrong as a whole, or
        another run holds the output folder.
    ServiceError
        If services fail and no record is at hand.
    WriteError
        If the machine cannot write: the run stays unfinished.
    Unfinished
        If the machine failed at some stations or chunks of pairs, after all others of this stage.
    """
    asked = RunSettings(configuration, output)
    folder = asked.folder
    with locked_folder(folder):
        fetched = fetched or _fetched_records(asked.settings, progress)
        asked.use_fetched_map()
        # Inputs are hashed here only to compare them with those of a finished run
        head = None
        if (folder / RECORD).is_file():
            head = asked.head(fetched, {})
            if known := _earlier_run(folder, head["key"]):
                asked.write()
                return Result(folder, known, did_nothing=True)

        _prepare_workers(asked.settings, executor)
        with loading():
            from per_obspy.runs.stages import new_run

        return new_run(asked, asked.context(executor, progress), fetched, head, facts or {})


def screen(
    configuration: Path | Run,
    output: Path | None = None,
    executor: Executor | None = None,
    progress: Progress = silent,
) -> Result:
    """
    Screen the inventory again with the stations of an earlier run, and write the report.

    Only chunks of the inventory that have changed are computed. Parameters and errors are those of
    :func:`run`; it is an error as well if there are no stations.
    """
    asked = RunSettings(configuration, output)
    with locked_folder(asked.folder):
        # Stations and their facts are those of the latest run
        _require_stations(asked.folder)
        asked.use_fetched_map()
        _prepare_workers(asked.settings, executor)
        with loading():
            from per_obspy.runs.stages import new_screening

        return new_screening(asked, asked.context(executor, progress))


def report(
    configuration: Path | Run, output: Path | None = None, progress: Progress = silent
) -> Result:
    """
    Write totals, figures and layers again from the risk table of a finished run.

    Raises
    ------
    CatalogError
        If there is no finished run, or its files have changed.
    """
    asked = RunSettings(configuration, output)
    with locked_folder(asked.folder):
        record = _finished(asked.folder / RECORD)
        asked.use_fetched_map()
        with loading():
            from per_obspy.runs.stages import new_report

        return new_report(asked.context(None, progress), record)


def _prepare_workers(settings: Run, executor: Executor | None) -> None:
    """Let workers load their libraries while this process loads its own, unless others work."""
    if executor is None and settings.engine.dask is None:
        prepare_workers(Workers(settings.workers).count)


def _fetched_records(settings: Run, progress: Progress) -> "Fetched | None":
    """Bring the configured FDSN records into their cache, None if there are none."""
    if settings.records is None or settings.records.fdsn is None:
        return None
    from per_obspy.records.fdsn.cache import fetch

    fetched = fetch(settings.records.fdsn, settings.records.event, progress)
    for row in fetched.rejected:
        if row.kind == "service":
            log.warning("%s: %s", row.name, "; ".join(row.reasons))
    return fetched


def _require_stations(folder: Path) -> None:
    """Raise ``CatalogError`` if the latest run has not finished its stations."""
    try:
        record = read_status(folder / RECORD)
    except StatusError:
        return
    if (record.get("state"), record.get("stage")) == (UNFINISHED, STATIONS):
        raise CatalogError(
            str(folder / RECORD), "the run is unfinished: some stations are missing, run again"
        )


def _earlier_run(folder: Path, key: str) -> dict[str, Any] | None:
    """Return ``run.json`` of an identical earlier run if its files are unchanged."""
    record = earlier_status(folder / RECORD, key)
    known = record and record.get("intermediate")
    if record is None or not isinstance(known, dict):
        return None
    changed = changed_outputs(folder / RECORD, {**record, "outputs": known})
    return None if changed else record


def _finished(file: Path) -> dict[str, Any]:
    """Return ``run.json`` of a finished run if its risk table and spectra are unchanged."""
    try:
        record = read_status(file)
    except StatusError as error:
        raise CatalogError(str(file), "no finished run here: run `per-obspy run` first") from error
    if record.get("state") == UNFINISHED:
        raise CatalogError(str(file), "no finished run here: the last one is unfinished, run again")
    from per_obspy.results.ranked_table import table_outputs

    # Other results are written again
    others = {
        name: one for name, one in record["outputs"].items() if name in ("spectra.nc", WORST_PAIRS)
    }
    needed = table_outputs(record["outputs"]) | others
    changed = changed_outputs(file, {**record, "outputs": needed})
    if changed:
        raise CatalogError(str(changed[0]), "has changed since the run wrote it: run again")
    return record
