"""Table ``changes.csv``: the difference between a revision and the one before."""

import csv
from collections.abc import Iterator, Mapping
from pathlib import Path
from typing import Any

import pandas as pd
import pyarrow as pa

from per_obspy.files import written_whole
from per_obspy.inventory.files.text_cells import cell
from per_obspy.tables.parts import batches, bounded_database, parquet_rows
from per_obspy.tables.ranked_table import table_files

#: Name of the table in a revision.
CHANGES = "changes.csv"

#: Its columns: event, station, pair or building; its name; what changed; values.
COLUMNS = ("kind", "name", "quantity", "before", "after")

#: Facts of the earthquake whose changes are listed.
EVENT_FACTS = ("time", "latitude", "longitude", "depth", "magnitude", "magnitude_type")

#: kind -> table, column of names, columns whose changes are listed
TABLES = {
    "pair": ("risk", "pair_id", ("state", "risk_class")),
    "building": ("buildings", "building_id", ("risk_class",)),
}

#: Rows that are written at once.
ROWS = 50_000

Row = tuple[object, ...]


def write_changes(before: Path | None, after: Path, facts: Mapping[str, Any]) -> None:
    """
    Write the changes of a revision into its folder.

    Parameters
    ----------
    before : Path or None
        Folder of the revision before; None if this is the first: its stations came, and its
        earthquake has no values before.
    after : Path
        Folder of the revision.
    facts : mapping
        ``"event"``: facts of the earthquake now; ``"event_before"``: in the revision before.
    """
    target = after / CHANGES
    with written_whole(target) as part, part.open("w", encoding="utf-8", newline="") as file:
        rows = csv.writer(file, lineterminator="\n")
        rows.writerow(COLUMNS)
        for row in _all_changes(before, after, facts):
            rows.writerow(map(cell, row))


def _all_changes(before: Path | None, after: Path, facts: Mapping[str, Any]) -> Iterator[Row]:
    """Yield the changes of the earthquake, of stations, of pairs and of buildings."""
    yield from event_changes(facts.get("event_before") or {}, facts.get("event") or {})
    yield from _station_changes(before, after)
    # All pairs of a first result are new
    if before is None:
        return
    for kind, (name, identifier, quantities) in TABLES.items():
        tables = (table_files(before, name), table_files(after, name))
        if all(tables):
            yield from _table_changes(kind, tables, identifier, quantities)


def event_changes(before: Mapping[str, Any], after: Mapping[str, Any]) -> Iterator[Row]:
    """
    Yield the facts of an earthquake that have changed.

    Examples
    --------
    >>> list(event_changes({"magnitude": 6.8}, {"magnitude": 7.1}))
    [('event', '', 'magnitude', 6.8, 7.1)]
    """
    for name in EVENT_FACTS:
        old, new = before.get(name), after.get(name)
        if old != new:
            yield ("event", str(after.get("event_id", "")), name, old, new)


def _station_changes(before: Path | None, after: Path) -> Iterator[Row]:
    """Yield the stations that are new, missing or of a changed state, by name."""
    old = _station_states(before / "stations.csv") if before is not None else {}
    new = _station_states(after / "stations.csv")
    for name in sorted(old.keys() | new.keys()):
        states = (old.get(name, "absent"), new.get(name, "absent"))
        if states[0] != states[1]:
            yield ("station", name, "state", *states)


def _station_states(table: Path) -> dict[str, str]:
    """Return the state of every station of a table, empty without a table."""
    if not table.is_file():
        return {}
    columns = ["station", "state"]
    found = pd.read_csv(table, usecols=columns, dtype="str", keep_default_na=False)
    return dict(zip(found["station"], found["state"], strict=True))


def _table_changes(
    kind: str, tables: tuple[list[Path], list[Path]], identifier: str, quantities: tuple[str, ...]
) -> Iterator[Row]:
    """Yield the changes between two tables, by name, in bounded memory."""
    # Named so that the database finds them
    columns = [identifier, *quantities]
    old, new = (parquet_rows(table, columns) for table in tables)
    with bounded_database(tables[1][0].parent) as database:
        database.register("old", old)
        database.register("new", new)
        for quantity in quantities:
            query = _query(identifier, quantity)
            for batch in batches(database, query, ROWS):
                for name, before, after in _rows(batch):
                    yield (kind, name, quantity, before, after)


def _query(identifier: str, quantity: str) -> str:
    """Return the query for the rows whose value differs or which only one table has."""
    return (
        f"SELECT {identifier} AS name, old.{quantity} AS before, new.{quantity} AS after "
        f"FROM old FULL OUTER JOIN new USING ({identifier}) "
        f"WHERE old.{quantity} IS DISTINCT FROM new.{quantity} ORDER BY name"
    )


def _rows(batch: pa.RecordBatch) -> Iterator[Row]:
    """Yield the rows of a piece of a table; a missing row has the value absent."""
    lists = [column.to_pylist() for column in batch.columns]
    for name, before, after in zip(*lists, strict=True):
        yield (name, *("absent" if value is None else value for value in (before, after)))
