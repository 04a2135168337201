"""Tables of columns and flags, from the schema of the pair table and of the risk table."""

from collections.abc import Iterable
from pathlib import Path

from tables import code, table, write_page

from per_obspy.inventory.schema import COLUMNS, Column
from per_obspy.screening.codes import rule_columns
from per_obspy.screening.columns import ORDER, csv_columns, known_column
from per_obspy.screening.meanings import FLAGS

RISK = """
# Columns of `risk.parquet`

All columns and flags with unit and meaning, made from the table in the code that also writes
`risk.columns.csv`. [How to read the table](../start/reading.md) explains the important ones with
examples. A column that the pair table does not have, or that no rule fills, is missing from a
result, and `risk.csv` has those with a `yes` only. The unit `1` means without dimension; no unit
means text.
"""

PAIRS = """
# Columns of a pair table

All columns that `per-obspy run` understands, made from the schema that checks them. `required`
columns must be there; of `height`, `storeys` and `period` one is needed per building. Other columns
are carried through to the result.
"""


def write(folder: Path) -> None:
    """Write ``risk_columns.md`` and ``pair_columns.md`` to the folder."""
    known = filter(None, map(known_column, ORDER))
    flags = ((code(name), meaning) for name, meaning in FLAGS.items())
    write_page(
        folder / "risk_columns.md",
        RISK,
        "## Results",
        _meanings(known),
        "## Code and screening rules",
        _meanings(rule_columns().values()),
        "## Flags",
        table(("flag", "meaning"), flags),
    )
    write_page(folder / "pair_columns.md", PAIRS, _schema())


def _meanings(columns: Iterable[Column]) -> str:
    """Return a table of names, units and meanings."""
    rows = [
        (code(column.name), column.unit, "yes" * bool(csv_columns([column.name])), column.meaning)
        for column in columns
    ]
    return table(("column", "unit", "`risk.csv`", "meaning"), rows)


def _schema() -> str:
    """Return the table of the pair table, with ranges."""
    rows = [
        (
            code(column.name),
            column.unit,
            "required" if column.required else "",
            _allowed(column),
            column.meaning,
        )
        for column in COLUMNS.values()
    ]
    return table(("column", "unit", "needed", "allowed", "meaning"), rows)


def _allowed(column: Column) -> str:
    """Return the range or the texts of a column."""
    if column.choices:
        return ", ".join(column.choices)
    limits = [f"≥ {column.low:g}"] * (column.low > float("-inf"))
    limits += [f"≤ {column.high:g}"] * (column.high < float("inf"))
    return ", ".join(limits)
