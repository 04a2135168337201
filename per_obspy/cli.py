"""
The command line: each command parses, calls one function, prints.

Exit codes: 0 done, 2 wrong input (one line says what), 3 nothing usable was left, 75 a service is unavailable.
"""

import json
import sys
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from per_obspy.commands.inventory import catalog, pairs
from per_obspy.errors import PerError, ServiceError

if TYPE_CHECKING:
    from per_obspy.run import Progress

WRONG_INPUT, NOTHING_USABLE, SERVICE_UNAVAILABLE = 2, 3, 75

app = typer.Typer(
    name="per-obspy",
    help="Which neighbouring buildings hit each other in an earthquake, how hard, and what would have prevented it.",
    no_args_is_help=True,
    add_completion=False,
    pretty_exceptions_enable=False,
    context_settings={"help_option_names": ["-h", "--help"]},
)
app.add_typer(pairs, name="pairs")
app.add_typer(catalog, name="catalog")

AsJson = Annotated[bool, typer.Option("--json", help="Print the result as JSON, for machines.")]


@app.command()
def run(
    configuration: Annotated[Path, typer.Argument(help="TOML file of the run.")],
    output: Annotated[Path | None, typer.Option("--output", "-o", help="Folder of the results.")] = None,
    as_json: AsJson = False,
) -> None:
    """
    Do a whole run: records to spectra to risk table to figures.

    Example: per-obspy run workflows/demo.toml
    """
    from per_obspy.run import run as whole_run

    with _progress() as progress:
        result = whole_run(configuration, output, progress=progress)
    if as_json:
        print(json.dumps({"folder": str(result.folder), "did_nothing": result.did_nothing, **result.record}))
    else:
        _print_result(result.folder, result.record, result.did_nothing)
    if result.record["state"] == "nothing_usable":
        print(f"nothing usable was left: see {result.folder / 'rejected.csv'}", file=sys.stderr)
        raise typer.Exit(NOTHING_USABLE)


@app.command()
def simulate(
    scenario: Annotated[Path, typer.Argument(help="TOML file of the scenario.")],
    output: Annotated[Path, typer.Option("--output", "-o", help="Folder for MiniSEED, StationXML and QuakeML.")],
) -> None:
    """
    Simulate the records of a scenario earthquake.

    Example: per-obspy simulate catalogs/demo/scenario.toml -o output/simulated
    """
    from per_obspy.config import Simulation, load
    from per_obspy.records.simulated import simulate as simulated
    from per_obspy.records.simulated import write_simulation

    simulation = simulated(load(scenario, Simulation).scenario)
    write_simulation(simulation, output)
    print(f"{len(simulation.stream)} simulated records are in {output}")


def _print_result(folder: Path, record: dict[str, Any], did_nothing: bool) -> None:
    counts = record["counts"]
    if did_nothing:
        print("Nothing to do: the same inputs were run before.")
    if record["simulated"]:
        print("The ground motion is SIMULATED.")
    rejected = sum(count for name, count in counts.items() if name.startswith("rejected_"))
    print(
        f"{counts['stations']} stations, {counts['pairs']} pairs: {counts['yes']} pounding, "
        f"{counts['possible']} possible, {counts['no']} not; {rejected} rejected"
    )
    if (folder / "risk.csv").exists():
        _print_worst(folder / "risk.parquet", 10)
    for name in sorted({*record["outputs"], "run.json"}):
        print(f"  {folder / name}")


def _print_worst(path: Path, count: int) -> None:
    """Print the worst pairs as a table."""
    import pandas as pd
    from rich.console import Console
    from rich.table import Table

    worst = pd.read_parquet(path).head(count)
    table = Table(title=f"The {len(worst)} worst pairs")
    shown = {
        "pair_id": "pair",
        "station": "station",
        "period_1": "T1 (s)",
        "period_2": "T2 (s)",
        "gap": "gap (m)",
        "demand": "demand (m)",
        "state": "pounding",
        "impact_velocity": "impact (m/s)",
        "amplification_1": "ampl. 1",
        "amplification_2": "ampl. 2",
    }
    for title in shown.values():
        table.add_column(title)
    for row in worst[list(shown)].itertuples(index=False):
        table.add_row(*(_cell(value) for value in row))
    Console(width=None if sys.stdout.isatty() else 120).print(table)


def _cell(value: object) -> str:
    if isinstance(value, float):
        return "" if value != value else f"{value:.3g}"
    return str(value)


@contextmanager
def _progress() -> "Iterator[Progress]":
    """Give what is told of progress: bars on a terminal, plain lines elsewhere; both on standard error."""
    from rich.console import Console
    from rich.progress import Progress as Bars
    from rich.progress import TaskID

    console = Console(stderr=True)
    if not console.is_terminal:
        yield _print_line
        return
    tasks: dict[str, TaskID] = {}
    with Bars(console=console) as bars:

        def move(stage: str, done: int, total: int) -> None:
            if stage not in tasks:
                tasks[stage] = bars.add_task(stage, total=total)
            bars.update(tasks[stage], completed=done, total=total)

        yield move


def _print_line(stage: str, done: int, total: int) -> None:
    print(f"{stage}: {done} of {total}", file=sys.stderr, flush=True)


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
