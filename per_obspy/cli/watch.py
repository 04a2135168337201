"""Commands of operation: watch and status, and the log of long commands."""

import json
import logging
import sys
from contextlib import contextmanager
from enum import StrEnum
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from per_obspy.cli.printing import (
    NOTHING_USABLE,
    TRY_LATER,
    AsJson,
    Dask,
    named_path,
    shown_progress,
)
from per_obspy.errors import TryLater, printable
from per_obspy.watch.logs import log_progress, logging_to

if TYPE_CHECKING:
    from collections.abc import Iterator

    from per_obspy.progress import Progress

log = logging.getLogger("per_obspy.command")


class LogFormat(StrEnum):
    """Formats of a log file."""

    text = "text"
    json = "json"


LogFile = Annotated[
    Path | None, typer.Option("--log", metavar="FILE", help="Append one line per event to a file.")
]
LogForm = Annotated[
    LogFormat, typer.Option("--log-format", help="Of the lines in the file of --log.")
]
Quiet = Annotated[
    bool, typer.Option("--quiet", "-q", help="Print warnings and errors only, for timers and cron.")
]


@contextmanager
def logged(
    file: Path | None, form: LogFormat, quiet: bool, timed: bool = False
) -> "Iterator[Progress]":
    """
    Log the events of a command, and yield its progress callback.

    A terminal shows bars; elsewhere each step is one line, unless ``quiet``. With ``timed`` lines
    begin with their time.
    """
    has_bars = sys.stderr.isatty() and not quiet
    if not has_bars:
        with logging_to(file, form is LogFormat.json, quiet, timed):
            yield log_progress
        return
    # Bars take the place of lines on a terminal; the file has both
    with (
        shown_progress() as bars,
        logging_to(file, form is LogFormat.json, quiet=True),
    ):

        def move(stage: str, done: int, total: int) -> None:
            bars(stage, done, total)
            log_progress(stage, done, total)

        yield move


def log_ending(record: dict[str, Any]) -> None:
    """Log state, counts, faults and losses of a result; standard output has them already."""
    counts = {name: count for name, count in record["counts"].items() if count}
    words = ", ".join(f"{count} {name}" for name, count in counts.items())
    facts = {"state": record["state"], "counts": record["counts"]}
    log.info("%s: %s", record["state"], words, extra={"facts": facts, "printed": True})
    # What people are shown after the result
    for sentence in (*record.get("faults", ()), *record.get("losses", ())):
        log.warning("%s", sentence, extra={"printed": True})


#: Exit code of each state; a folder that is none of a watcher or run is wrong input.
CODES = {
    "fine": 0,
    "late": TRY_LATER,
    "failing": TRY_LATER,
    "damaged": TRY_LATER,
    "stopped": TRY_LATER,
    "unfinished": TRY_LATER,
    "nothing_usable": NOTHING_USABLE,
}


def status(
    folder: Annotated[
        Path,
        typer.Argument(
            help="Folder of a watcher, or of the results of a run.",
            parser=named_path,
            metavar="FOLDER",
        ),
    ],
    late: Annotated[
        float, typer.Option(min=0.0, help="s behind its time, from which a watcher is late.")
    ] = 900.0,
    as_json: AsJson = False,
) -> None:
    """
    Print the state of a watcher or of a run; the exit code is for monitoring.

    0: fine. 2: no folder of a watcher or run. 3: no pair was usable. 75: late, failing,
    stopped, unfinished, or results that are not as they were written (the largest
    are not compared where that takes more than 10 s).

    Example: per-obspy status watched --json
    """
    from per_obspy.watch.health import folder_health

    health = folder_health(folder, late)
    if as_json:
        print(json.dumps(health.facts))
    else:
        print(*map(printable, health.lines), sep="\n")
    if code := CODES[health.state]:
        raise typer.Exit(code)


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
        from per_obspy.runs.tasks.executor import on_cluster
        from per_obspy.watch.event_settings import read_settings
        from per_obspy.watch.watch import watch_forever, watch_once

        settings = on_cluster(read_settings(configuration), dask)
        if once:
            errors = watch_once(settings, progress=progress).errors
            # The exit code is that of an error that passes, or else of the first
            for error in sorted(errors, key=lambda error: not isinstance(error, TryLater)):
                raise error
        else:
            watch_forever(settings, progress=progress)
