"""``per-obspy watch``: watch for earthquakes, and keep a revision of their results."""

from pathlib import Path
from typing import Annotated

import typer

from per_obspy.commands.endings import Dask
from per_obspy.commands.operation.logged import LogFile, LogForm, LogFormat, Quiet, logged
from per_obspy.errors import PerError, TryLater


def watch(
    configuration: Annotated[
        Path, typer.Argument(help="TOML file of a run with a section \\[watch].")
    ],
    once: Annotated[
        bool, typer.Option("--once", help="Do all due runs once and end, for timers and cron.")
    ] = False,
    dask: Dask = None,
    log: LogFile = None,
    log_format: LogForm = LogFormat.text,
    quiet: Quiet = False,
) -> None:
    """
    Watch for earthquakes: fetch, run and report each that matters, again as records come.

    Results of an earthquake: OUTPUT/events/ID/latest, all revisions next to it.

    Example: per-obspy watch city.toml --once
    """
    with logged(log, log_format, quiet, timed=not once) as progress:
        from per_obspy.jobs.executor import on_cluster
        from per_obspy.operation.events.event_settings import read_settings
        from per_obspy.operation.watch import watch_forever, watch_once

        settings = on_cluster(read_settings(configuration), dask)
        if once:
            _raise_worst(watch_once(settings, progress=progress).errors)
        else:
            watch_forever(settings, progress=progress)


def _raise_worst(errors: tuple[PerError, ...]) -> None:
    """Raise the error that decides the exit code: one that passes, or else the first."""
    passing = [error for error in errors if isinstance(error, TryLater)]
    for error in [*passing, *errors][:1]:
        raise error
