"""
The command line: each command parses, calls one function, prints.

Exit codes: 0 done, 2 wrong input (one line says what), 3 nothing usable was left, 75 a service is
unavailable.
"""

import sys

import typer

from per_obspy.commands.endings import SERVICE_UNAVAILABLE, WRONG_INPUT
from per_obspy.commands.pairs import catalog, pairs
from per_obspy.commands.records import events, fetch, info
from per_obspy.commands.run import process, report, run, simulate, spectra
from per_obspy.commands.screen import screen
from per_obspy.errors import PerError, ServiceError

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
for command in (run, simulate, process, spectra, screen, report, events, fetch, info):
    app.command()(command)


def main() -> None:
    """Run the command line; wrong input ends in one line and an exit code, not in a traceback."""
    try:
        app()
    except ServiceError as error:
        _stop(error, SERVICE_UNAVAILABLE)
    except PerError as error:
        _stop(error, WRONG_INPUT)


def _stop(error: PerError, code: int) -> None:
    print(f"per-obspy: {' '.join(str(error).split())}", file=sys.stderr)
    raise SystemExit(code)
