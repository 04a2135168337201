"""How a command ends, and the option that makes it print for machines: the same for all."""

import csv
import json
import sys
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

if TYPE_CHECKING:
    from collections.abc import Callable

    from per_obspy.jobs.output_folder import Result

#: Exit codes; 0 is done, and 1 is left to crashes, which are bugs.
WRONG_INPUT, NOTHING_USABLE, SERVICE_UNAVAILABLE = 2, 3, 75

AsJson = Annotated[bool, typer.Option("--json", help="Print the result as JSON, for machines.")]


def end_if_nothing(usable: int, said: str = "") -> None:
    """Stop with the exit code for nothing usable if the count of what is left is 0, saying why if that is given."""
    if usable:
        return
    if said:
        print(said, file=sys.stderr)
    raise typer.Exit(NOTHING_USABLE)


def tell(result: "Result", as_json: bool, show: "Callable[[Result], None]") -> None:
    """Print the result of a run or of several, and stop where nothing usable was left."""
    if as_json:
        print(
            json.dumps(
                {"folder": str(result.folder), "did_nothing": result.did_nothing, **result.record}
            )
        )
    else:
        show(result)
    if result.record["state"] == "nothing_usable":
        end_if_nothing(0, why_nothing(result.folder / "rejected.csv"))


def why_nothing(rejected: Path) -> str:
    """Return that nothing usable was left, where the reasons are, and the first of them."""
    with rejected.open(encoding="utf-8", newline="") as file:
        first = next(csv.DictReader(file), None)
    example = f", first {first['kind']} {first['name']}: {first['reasons']}" if first else ""
    return f"nothing usable was left: see {rejected}{example}"
