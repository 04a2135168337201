"""
Command line: each command parses its arguments, calls one function and prints.

Exit codes: 0 done, 2 wrong input (one line with the reason), 3 no usable record or pair, 75 try
later: a service is unavailable, another run holds the output folder, a file cannot be written, or
the machine failed otherwise, 130 interrupted, 143 ended by SIGTERM.
"""

import errno
import os
import sys
from pathlib import Path
from typing import Annotated

import typer

import per_obspy
from per_obspy.cli.info import info
from per_obspy.cli.init import init, warm_up
from per_obspy.cli.pairs import catalog, pairs
from per_obspy.cli.printing import NOTHING_USABLE, TRY_LATER, WRONG_INPUT
from per_obspy.cli.records import events, fetch
from per_obspy.cli.results import observed, show
from per_obspy.cli.run import process, report, run, simulate, spectra
from per_obspy.cli.screen import screen
from per_obspy.cli.watch import status, watch
from per_obspy.errors import NothingUsable, PerError, TryLater, WriteError
from per_obspy.files import writing
from per_obspy.garbage import keep_all
from per_obspy.machine import machine_fault
from per_obspy.runs.tasks.worker_start import forked_workers
from per_obspy.termination import (
    INTERRUPTED,
    TERMINATED,
    end_now,
    ending_in_time,
    has_working_threads,
)

#: Words for the ends by a signal.
SIGNALLED = {INTERRUPTED: "interrupted", TERMINATED: "terminated"}

#: Errors of writing, rather than of opening files or starting processes.
_ROOMLESS = {errno.ENOSPC, errno.EDQUOT, errno.EFBIG, errno.EIO}

app = typer.Typer(
    name="per-obspy",
    help=(
        "Which neighbouring buildings hit each other in an earthquake, how hard, and what "
        "would have prevented it."
    ),
    no_args_is_help=True,
    add_completion=False,
    pretty_exceptions_enable=False,
    context_settings={"help_option_names": ["-h", "--help"]},
)
app.add_typer(pairs, name="pairs")
app.add_typer(catalog, name="catalog")
COMMANDS = (
    *(run, init, warm_up, simulate, process, spectra, screen),
    *(report, show, observed, events, fetch, info, watch, status),
)
for command in COMMANDS:
    app.command()(command)


def _print_version(asked: bool) -> None:
    """Print the version and stop, if asked."""
    if asked:
        print(per_obspy.__version__)
        raise typer.Exit


@app.callback()
def options(
    version: Annotated[
        bool,
        typer.Option(
            "--version", help="Print the version and exit.", callback=_print_version, is_eager=True
        ),
    ] = False,
) -> None:
    """Offer the options of the program itself."""


def main() -> None:
    """Run the command line; wrong input ends in one line and an exit code, not in a traceback."""
    with ending_in_time(), forked_workers():
        code = _exit_code()
        if code in SIGNALLED:
            _end_by_signal(code)
    try:
        with writing(Path("standard output")):
            sys.stdout.flush()
    except BrokenPipeError:
        _drop_output()
    except WriteError as error:
        code = _failed_output(error)
    # Searching all libraries for cycles would take half a second, and their memory ends with this
    keep_all()
    raise SystemExit(code)


def _end_by_signal(code: int) -> None:
    """Print one word; end at once if a thread still works, which the interpreter would wait for."""
    print(SIGNALLED[code], file=sys.stderr, flush=True)
    if has_working_threads():
        end_now(code)


def _drop_output() -> None:
    """Drop the rest of the output: the interpreter would write it at its end and complain."""
    os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())


def _failed_output(error: OSError) -> int:
    """Print that the output cannot be written and return the exit code."""
    _drop_output()
    reason = error.strerror or "unknown reason"
    return _failed(WriteError("standard output", reason), TRY_LATER)


def _exit_code() -> int:
    """Run a command and return its exit code."""
    try:
        app()
    except KeyboardInterrupt:
        return INTERRUPTED
    except TryLater as error:
        return _failed(error, TRY_LATER)
    except NothingUsable as error:
        return _failed(error, NOTHING_USABLE)
    except PerError as error:
        # An input that the machine cannot read is not known to be wrong; one of a wrong name is
        fault = machine_fault(error, missing=False)
        return _failed(error, WRONG_INPUT if fault is None else TRY_LATER)
    except (MemoryError, OSError) as error:
        # Of all that is written, only the standard output has no name
        if isinstance(error, OSError) and error.filename is None and error.errno in _ROOMLESS:
            return _failed_output(error)
        fault = machine_fault(error)
        if fault is None:
            raise
        return _failed(TryLater(f"{fault}; try again later"), TRY_LATER)
    except SystemExit as ending:
        # A reader that has enough, such as ``head``, is no failure
        if isinstance(ending.__context__, BrokenPipeError):
            return 0
        return ending.code if isinstance(ending.code, int) else 0
    return 0


def _failed(error: PerError, code: int) -> int:
    """Print an error as one line and return the exit code."""
    print(f"per-obspy: {' '.join(str(error).split())}", file=sys.stderr)
    return code
