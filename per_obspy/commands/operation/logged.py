"""Options for the log of a command, and the context that writes the log."""

import logging
import sys
from contextlib import contextmanager
from enum import StrEnum
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from per_obspy.commands.printing import shown_progress
from per_obspy.operation.logs import LogOptions, log_progress, logging_to

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
        with logging_to(LogOptions(file, form is LogFormat.json, quiet, timed)):
            yield log_progress
        return
    # Bars take the place of lines on a terminal; the file has both
    with (
        shown_progress() as bars,
        logging_to(LogOptions(file, form is LogFormat.json, quiet=True)),
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
