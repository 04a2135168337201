"""How commands print tables."""

import sys
from collections.abc import Iterable, Sequence


def print_table(title: str, columns: Sequence[str], rows: Iterable[Sequence[object]]) -> None:
    """Print rows as a table, numbers with three digits."""
    from rich.console import Console
    from rich.table import Table

    table = Table(title=title, title_justify="left")
    for column in columns:
        table.add_column(column, overflow="fold")
    for row in rows:
        table.add_row(*(cell(value) for value in row))
    Console(width=None if sys.stdout.isatty() else 120).print(table)


def cell(value: object) -> str:
    """Return a value as text: numbers with three digits, nothing for what is missing."""
    if isinstance(value, float):
        return "" if value != value else f"{value:.3g}"
    return str(value)
