"""Print tables and progress."""

import json
import logging
import sys
from collections import Counter
from contextlib import contextmanager, suppress
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any, NamedTuple

import typer

from per_obspy.constants import LANGUAGES
from per_obspy.errors import printable, shortened

if TYPE_CHECKING:
    from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
    from typing import TextIO

    from per_obspy.errors import Rejection
    from per_obspy.progress import Progress
    from per_obspy.runs.output_folder import Result


def print_table(title: str, columns: "Sequence[str]", rows: "Iterable[Sequence[object]]") -> None:
    """Print rows as a table, numbers with three digits."""
    from rich.console import Console
    from rich.table import Table
    from rich.text import Text

    # Text of data is literal: no [red], no :smile:
    table = Table(title=Text(printable(title)), title_justify="left")
    for column in columns:
        table.add_column(Text(printable(column)), overflow="fold")
    for row in rows:
        table.add_row(*(Text(cell(value)) for value in row))
    Console(width=None if sys.stdout.isatty() else 120).print(table)


def print_worst(columns: "Sequence[str]", rows: "Sequence[Sequence[object]]") -> None:
    """Print the worst pairs as a table, nothing without a pair."""
    if rows:
        title = "The worst pair" if len(rows) == 1 else f"The {len(rows)} worst pairs"
        print_table(title, columns, rows)


def state_texts(counts: "Mapping[str, int]") -> list[str]:
    """Return one text per state with its number of pairs; unknown gaps only if there are any."""
    from per_obspy.config.screening import EVERY_STATE, UNKNOWN_STATE

    shown = [state for state in EVERY_STATE if counts.get(state) or state != UNKNOWN_STATE]
    return [f"{counts.get(state, 0)} {state}" for state in shown]


def percent(probability: object) -> str:
    """
    Return a probability in percent: 0 and 100 only if exact, empty if unknown.

    Examples
    --------
    >>> [percent(value) for value in (0.0, 1e-48, 0.0042, 0.52, 0.9999, 1.0, None)]
    ['0', '< 0.1', '0.42', '52', '> 99.9', '100', '']
    """
    if not isinstance(probability, float) or probability != probability:
        return ""
    if 0.0 < probability < 0.001:
        return "< 0.1"
    if 0.999 < probability < 1.0:
        return "> 99.9"
    return f"{100.0 * probability:.3g}"


def cell(value: object) -> str:
    """Return a value as text on one line: numbers with three digits, missing ones empty."""
    if value is None:
        return ""
    if isinstance(value, float):
        return "" if value != value else f"{value:.3g}"
    return printable(str(value))


@contextmanager
def shown_progress() -> "Iterator[Progress]":
    """Yield a progress callback: bars on a terminal, plain lines elsewhere; on standard error."""
    from rich.console import Console
    from rich.markup import escape
    from rich.progress import Progress as Bars
    from rich.progress import TaskID

    # A log gets one line per step, whatever the environment asks of colours
    console = Console(stderr=True)
    if not sys.stderr.isatty():
        yield _print_line
        return

    # A terminal gets one bar per stage, made when the stage begins
    tasks: dict[str, TaskID] = {}
    with Bars(console=console) as bars, _notes(sys.stderr):

        def move(stage: str, done: int, total: int) -> None:
            if stage not in tasks:
                tasks[stage] = bars.add_task(escape(printable(stage)), total=total)
            bars.update(tasks[stage], completed=done, total=total)

        yield move


@contextmanager
def _notes(stream: "TextIO") -> "Iterator[None]":
    """Print events of a cluster: the address of its dashboard, and faults of workers."""
    log, handler = logging.getLogger("per_obspy.cluster"), logging.StreamHandler(stream)
    handler.setFormatter(logging.Formatter("per-obspy: %(message)s"))
    # Warnings have their line already
    handler.addFilter(lambda event: event.levelno == logging.INFO)
    before = log.level
    log.addHandler(handler)
    log.setLevel(logging.INFO)
    try:
        yield
    finally:
        log.removeHandler(handler)
        log.setLevel(before)


def _print_line(stage: str, done: int, total: int) -> None:
    """Print one line of progress; a closed standard error does not stop the work."""
    with suppress(BrokenPipeError):
        print(f"{stage}: {done} of {total}", file=sys.stderr, flush=True)


def print_rejected(
    rejected: "Sequence[Mapping[str, Any]]", count: int, width: int | None = None
) -> None:
    """Print rejections with their reasons on standard error, and the number of the others."""
    for one in rejected:
        line = f"rejected {one['kind']} {one['name']}: {'; '.join(one['reasons'])}"
        print(shortened(line, width) if width else printable(line), file=sys.stderr)
    if count > len(rejected):
        print(f"and {count - len(rejected)} more rejected: --all", file=sys.stderr)


#: Files of every result that people open, in this order: name, with the stem of its table, and
#: meaning.
TO_OPEN = {
    "report.html": "the page: which pairs, where, how sure, what first",
    "{}.csv": "the pairs, the worst first",
    "rejected.csv": "what was left out, and why",
}


def files_to_open(names: "Iterable[str]", table: str = "risk") -> dict[str, str]:
    """
    Return the files of a result to open, in their order, with their meanings.

    Examples
    --------
    >>> list(files_to_open(["run.json", "risk.csv", "report.html"]))
    ['report.html', 'risk.csv']
    """
    meanings = {name.format(table): meaning for name, meaning in TO_OPEN.items()}
    given = set(names)
    return {name: meaning for name, meaning in meanings.items() if name in given}


def print_files(folder: Path, names: "Iterable[str]", table: str = "risk") -> None:
    """Print the number of files of a result, and as the last lines those to open, in order."""
    given = set(names)
    print(f"{len(given)} files are in {printable(str(folder))}. Open in this order:")
    for name, meaning in files_to_open(given, table).items():
        print(f"  {printable(str(folder / name))}: {meaning}")


#: Exit codes; 0 is done, and 1 is left to crashes, which are bugs.
WRONG_INPUT, NOTHING_USABLE, TRY_LATER = 2, 3, 75


#: Beginning of the reason of records that were left out on purpose.
BYSTANDER = "belongs to another earthquake"


def _language(name: str) -> str:
    """Return a language of the page ``report.html`` and of the summaries."""
    if name not in LANGUAGES:
        raise typer.BadParameter(f"{name!r} is none of {', '.join(LANGUAGES)}")
    return name


Language = Annotated[
    str | None,
    typer.Option(
        "--language",
        help="Of report.html and summaries, instead of the configured one.",
        parser=_language,
        metavar=" | ".join(LANGUAGES),
    ),
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
    # Recognised form of the pair tables, and suspicious values
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


class Reason(NamedTuple):
    """Reason of rejections in the order of its weight: of others last, of pairs first."""

    is_bystander: bool
    is_of_no_pair: bool
    kind: str
    words: str


def why_nothing(rejected: Path) -> str:
    """
    Return a message that names the table of rejections and the most frequent reasons in it.

    Pairs come first, because results are pairs; a record of another earthquake explains nothing
    and comes last.
    """
    from per_obspy.results.coverage import stored_rejections

    # Line by line, as rejections may be many
    counts, first = Counter[Reason](), dict[Reason, str]()
    for rejection in stored_rejections(rejected):
        reason = _reason(rejection)
        counts[reason] += 1
        first.setdefault(reason, f"{rejection.name}: {'; '.join(rejection.reasons)}")
    # The reason that weighs most as it is in the table, and the next one, which may be its cause
    ordered = sorted(counts, key=lambda reason: (*reason[:2], -counts[reason]))[:2]
    parts = [f"first {reason.kind} {first[reason]}" for reason in ordered[:1]]
    for reason in ordered:
        plural = "" if counts[reason] == 1 else "s"
        parts.append(f"{counts[reason]} {reason.kind}{plural}: {reason.words}")
    return printable("; ".join([f"no usable record or pair: see {rejected}", *parts]))


def _reason(rejection: "Rejection") -> Reason:
    """Return the reason of a rejection: of pairs, which are many, its kind, else its sentence."""
    from per_obspy.results.coverage import kind_of

    is_bystander, is_pair = rejection.reasons[0].startswith(BYSTANDER), rejection.kind == "pair"
    words = kind_of(rejection.reasons) if is_pair else rejection.reasons[0]
    return Reason(is_bystander, not is_pair, rejection.kind, BYSTANDER if is_bystander else words)
