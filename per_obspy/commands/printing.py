"""Print tables and progress."""

import logging
import sys
from contextlib import contextmanager, suppress
from typing import TYPE_CHECKING

from per_obspy.errors import printable

if TYPE_CHECKING:
    from collections.abc import Iterable, Iterator, Mapping, Sequence
    from typing import TextIO

    from per_obspy.progress import Progress


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
