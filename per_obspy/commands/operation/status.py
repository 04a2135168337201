"""``per-obspy status``: the state of a watcher or run, with an exit code for monitoring."""

import json
from pathlib import Path
from typing import Annotated

import typer

from per_obspy.commands.endings import NOTHING_USABLE, TRY_LATER, AsJson, named_path
from per_obspy.errors import printable

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
    from per_obspy.operation.health import folder_health

    health = folder_health(folder, late)
    if as_json:
        print(json.dumps(health.facts))
    else:
        print(*map(printable, health.lines), sep="\n")
    if code := CODES[health.state]:
        raise typer.Exit(code)
