"""``per-obspy info``: describe an input or a result on one screen."""

import json
import textwrap
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from per_obspy.cli.printing import (
    AsJson,
    files_to_open,
    named_path,
    print_rejected,
    print_table,
    stop_if_nothing,
)
from per_obspy.errors import printable, shortened

if TYPE_CHECKING:
    from per_obspy.runs.inputs.description import Description

#: Columns and lines of the screen that everything fits on.
WIDTH, HEIGHT = 100, 24

#: Characters of a path, and lines of a fact, that are shown.
LONGEST_PATH, MOST_LINES = 48, 2

#: Longest label of a fact: names of scenarios and keys may be longer.
LONGEST_LABEL = 32

#: Rejections that are printed without --all.
FIRST = 3

#: What the table of records shows of each; JSON has everything.
SHOWN = (
    "record",
    "format",
    "level",
    "start",
    "dt",
    "duration",
    "azimuth",
    "peak",
    "unit",
    "event",
    "file",
)


def info(
    path: Annotated[
        str,
        typer.Argument(
            help="Records, pair table, footprints, ShakeMap, spectrum, configuration or results."
        ),
    ],
    stationxml: Annotated[
        Path | None, typer.Option(help="StationXML file or folder, if not with the records.")
    ] = None,
    everything: Annotated[
        bool, typer.Option("--all", help="List every record and every rejection.")
    ] = False,
    as_json: AsJson = False,
) -> None:
    """
    Describe an input or a result on one screen, with a map of its places.

    Example: per-obspy info records
    """
    from per_obspy.runs.inputs.description import describe

    named_path(path)  # an empty name would be the folder of the shell
    found = describe(path, stationxml)
    if as_json:
        print(json.dumps({"kind": found.kind, **found.values}))
    else:
        # Faults of records are listed below, those of other inputs among their facts
        rejected = found.values.get("rejected", []) if found.kind == "records" else []
        few = rejected if everything else rejected[:FIRST]
        for line in screen_of(path, found, len(few) + (len(few) < len(rejected))):
            print(line)
        if everything and found.kind == "records":
            records = found.values["records"]
            print_table(f"{len(records)} records", SHOWN, map(_cells, records))
        print_rejected(few, len(rejected), None if everything else WIDTH)
    stop_if_nothing(int(found.usable))


def screen_of(path: str, found: "Description", taken: int = 0) -> list[str]:
    """
    Return the description of an input as lines that fit on one screen.

    Parameters
    ----------
    path : str
        As it was named.
    found : Description
        The description.
    taken : int
        Lines of the screen that are needed for other text.
    """
    from per_obspy.cli.text_map import text_map

    drawn = text_map(found.places)
    named = path if len(path) <= LONGEST_PATH else f"…{path[-LONGEST_PATH:]}"
    head = ": ".join(part for part in (named, found.kind, found.title) if part)
    named_facts = _with_place(found, bool(drawn))
    # Of a result, what a person opens first
    outputs = found.values.get("outputs", ())
    if to_open := files_to_open(outputs, "ensemble" if "ensemble.csv" in outputs else "risk"):
        named_facts = [("open", ", then ".join(to_open)), *named_facts]
    facts = [line for fact in named_facts for line in _wrapped(found, *fact)]
    # Facts that have no room are counted
    room = HEIGHT - 1 - len(drawn) - taken
    if len(facts) > room:
        facts = [*facts[: room - 1], f"  and {len(facts) - room + 1} more lines: --json has all"]
    return [shortened(head, WIDTH), *facts, *drawn]


def _with_place(found: "Description", is_drawn: bool) -> list[tuple[str, str]]:
    """Return the facts of an input; a single place is a fact instead of a map."""
    places = [place for layer in found.places.values() for place in zip(*layer, strict=True)]
    if is_drawn or not places:
        return found.lines
    longitude, latitude = places[0]
    return [*found.lines, ("place", f"latitude {latitude:g}, longitude {longitude:g}, degrees")]


def _wrapped(found: "Description", label: str, text: str) -> list[str]:
    """Return a fact as wrapped lines, the last one shortened."""
    width = min(max(len(known) for known, _ in [*found.lines, ("place", "")]), LONGEST_LABEL)
    lines = textwrap.wrap(printable(text), WIDTH - width - 4, break_on_hyphens=False) or [""]
    # What is longer is cut in the last line
    if len(lines) > MOST_LINES:
        lines[MOST_LINES - 1 :] = [shortened(" ".join(lines[MOST_LINES - 1 :]), WIDTH - width - 4)]
    labels = [shortened(label, LONGEST_LABEL), *[""] * (len(lines) - 1)]
    return [f"  {one:<{width}}  {line}" for one, line in zip(labels, lines, strict=True)]


def _cells(record: dict[str, Any]) -> list[object]:
    """Return the cells of a record, times to the second, empty where a value is unknown."""
    known = record | {"start": record["start"][:19]}
    return ["" if known[name] is None else known[name] for name in SHOWN]
