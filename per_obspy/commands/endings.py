"""Exit codes, options and final messages that several commands share."""

import csv
import json
import sys
from enum import StrEnum
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from per_obspy.errors import printable

if TYPE_CHECKING:
    from collections.abc import Callable

    from per_obspy.jobs.output_folder import Result

#: Exit codes; 0 is done, and 1 is left to crashes, which are bugs.
WRONG_INPUT, NOTHING_USABLE, TRY_LATER = 2, 3, 75


class PageLanguage(StrEnum):
    """Languages of the page ``report.html`` and of the summaries."""

    en = "en"
    es = "es"


Language = Annotated[
    PageLanguage | None,
    typer.Option("--language", help="Of report.html and summaries, instead of the configured one."),
]

Strict = Annotated[
    bool,
    typer.Option("--strict", help="End with exit code 3 if rows of the pair tables were lost."),
]


Dask = Annotated[
    str | None,
    typer.Option(
        "--dask",
        metavar="ADDRESS | FILE | local[:N]",
        help="Work on a Dask cluster: its scheduler, or N processes here; needs per_obspy[dask].",
    ),
]


def named_path(text: str | Path) -> Path:
    """Return a path from the command line; refuse an empty one, which means the current folder."""
    if not str(text).strip():
        raise typer.BadParameter("the path is empty: name a file or folder")
    return Path(text)


def output_option(meaning: str) -> Any:
    """Return the option ``--output`` with its help text."""
    return typer.Option("--output", "-o", help=meaning, parser=named_path, metavar="PATH")


AsJson = Annotated[bool, typer.Option("--json", help="Print the result as JSON, for machines.")]


def stop_if_nothing(usable: int, reason: str = "") -> None:
    """Stop with exit code 3 if ``usable`` is 0; print the reason first if there is one."""
    if usable:
        return
    if reason:
        print(reason, file=sys.stderr)
    raise typer.Exit(NOTHING_USABLE)


def print_and_end(
    result: "Result", as_json: bool, show: "Callable[[Result], None]", strict: bool = False
) -> None:
    """
    Print the result of a run or of several, and stop without a usable record or pair.

    Losses of rows are printed on standard error; with ``strict`` they end in exit code 3.
    """
    if as_json:
        known = {"folder": str(result.folder), "did_nothing": result.did_nothing}
        print(json.dumps({**known, **result.record}))
    else:
        show(result)
    for fault in result.record.get("faults", []):
        print(f"per-obspy: {fault}", file=sys.stderr)
    # How the pair tables are read, and what is odd of them
    notes = result.record.get("pair_tables", {})
    for sentence in (*notes.get("recognised", ()), *notes.get("suspicions", ())):
        print(printable(f"per-obspy: {sentence}"), file=sys.stderr)
    # Losses are for people and for unattended jobs
    lost = result.record.get("losses", [])
    for sentence in lost:
        print(f"per-obspy: {sentence}", file=sys.stderr)
    if strict and lost:
        stop_if_nothing(0)
    if result.record["state"] == "nothing_usable":
        stop_if_nothing(0, why_nothing(result.folder / "rejected.csv"))


def why_nothing(rejected: Path) -> str:
    """Return a message that names the table of rejections and quotes its first row."""
    with rejected.open(encoding="utf-8", newline="") as file:
        first = next(csv.DictReader(file), None)
    example = f", first {first['kind']} {first['name']}: {first['reasons']}" if first else ""
    return printable(f"no usable record or pair: see {rejected}{example}")
