"""Pair rows that a screening loses: rejected ones by kind and area, and fewer than before."""

import json
from collections import Counter
from collections.abc import Mapping, Sequence
from pathlib import Path

import numpy as np
import pandas as pd
from numpy.typing import NDArray

from per_obspy.config import Pairs, Run, Totals
from per_obspy.errors import Rejection
from per_obspy.inventory.cells import plain_numbers
from per_obspy.inventory.files.headings import IDENTIFIER
from per_obspy.inventory.files.raw_rows import RawRows
from per_obspy.inventory.places import place_columns, place_names
from per_obspy.results.coverage import Search, search_of_table
from per_obspy.results.totals import PLACE, areas_of, named_areas

#: Coordinates of both buildings of a pair, without their number.
_PLACE = ("longitude", "latitude")


def number_of_rows(record: Path) -> int | None:
    """
    Return the number of rows of the pair tables by ``run.json`` of the run before.

    Returns
    -------
    int or None
        That of the run before, if this one is unfinished; None if there is no record, or if it
        cannot be read.
    """
    try:
        content = json.loads(record.read_text(encoding="utf-8"))
        # An unfinished run keeps the number of the one before it
        if "counts" not in content:
            earlier: int | None = content["earlier_rows"]
            return earlier
        return _rows(content["counts"])
    except (OSError, ValueError, KeyError, TypeError):
        return None


def losses(settings: Run, counts: Mapping[str, int], earlier: int | None) -> list[str]:
    """
    Return one sentence per kind of loss.

    Parameters
    ----------
    settings : Run
        Its ``pairs.largest_rejected_share`` is the largest share of rejected rows.
    counts : mapping
        Counts of the run's record.
    earlier : int or None
        Number of rows in the run before it.
    """
    sentences = []
    rows, rejected = _rows(counts), counts["rejected_pair"]
    # A table that was only half saved
    if earlier is not None and rows < earlier:
        sentences.append(
            f"rows lost: the pair tables hold {rows} rows, {earlier} in the previous run of this "
            "folder"
        )
    # A table whose rows are wrong, or far from every station
    limit = (settings.pairs or Pairs.model_construct()).largest_rejected_share
    if rejected > limit * rows:
        sentences.append(
            f"rows rejected: {rejected} of {rows} rows ({rejected / rows:.0%}), more than "
            f"pairs.largest_rejected_share = {limit:g}; see rejected.csv"
        )
    return sentences


def _rows(counts: Mapping[str, int]) -> int:
    """Return the number of rows from the counts of a run."""
    return counts["pairs"] + counts["rejected_pair"]


def areas_left_out(totals: Totals, rejected: Sequence[Rejection], rows: RawRows) -> dict[str, int]:
    """
    Return the number of rejected rows in each area, of those whose coordinates can be read.

    Parameters
    ----------
    totals : Totals
        Kind of areas.
    rejected : sequence of Rejection
        Of these rows; one without a line is known by its name.
    rows : RawRows
        Rows as the file has them.
    """
    if not rejected:
        return {}
    lost = _lost_rows(rejected, rows)
    # Cells as they were read, as numbers or as text
    known = rows.table.column_names
    columns = [f"{name}_{i}" for name in _PLACE for i in (1, 2)]
    columns += [totals.area] if totals.area else place_columns(known)
    chosen = [name for name in known if name in columns]
    table = rows.table.select(chosen).filter(lost).to_pandas()
    if totals.area is None:
        return Counter(_cells_of(totals, table))
    return Counter(table[totals.area].fillna("").astype(str)) if totals.area in table else {}


def _lost_rows(rejected: Sequence[Rejection], rows: RawRows) -> NDArray[np.bool_]:
    """Return a mask of the rejected rows; a table without names knows those with a line."""
    lines = [rejection.row for rejection in rejected if rejection.row is not None]
    lost = np.isin(rows.lines, np.array(lines, dtype=np.int64))
    # A row that is rejected after its checks has no line any more
    names = {rejection.name for rejection in rejected if rejection.row is None}
    if names and IDENTIFIER in rows.table.column_names:
        lost |= [str(name).strip() in names for name in rows.table[IDENTIFIER].to_pylist()]
    return lost


def _cells_of(totals: Totals, table: pd.DataFrame) -> Sequence[str]:
    """Return the place or cell of each row whose coordinates can be read, as people read it."""
    # The middle of both buildings, across the date line too, or the one that has coordinates
    east, far_east, north, far_north = (
        plain_numbers(table[f"{name}_{i}"]) for name in _PLACE for i in (1, 2)
    )
    east, north = east.fillna(far_east), north.fillna(far_north)
    half = ((far_east - east + 180.0) % 360.0 - 180.0) / 2.0
    longitude = (east + half.fillna(0.0) + 180.0) % 360.0 - 180.0
    latitude = (north + far_north.fillna(north)) / 2.0
    # A coordinate in metres or exchanged is in no cell
    usable = east.abs().le(180.0) & latitude.abs().le(90.0)
    named = {PLACE: place_names(table)[PLACE]}
    places = pd.DataFrame({"longitude": longitude, "latitude": latitude, **named})[usable]
    if places.empty:
        return []
    return list(named_areas(places.assign(area=areas_of(places, totals, "")), totals)["area"])


def search_of_tables(tables: Mapping[Path, int]) -> Search | None:
    """Return the account of the searches that made pair tables of so many rows, None if unknown."""
    accounts = {path: search_of_table(path, rows) for path, rows in tables.items()}
    if not any(accounts.values()):
        return None
    joined = Search()
    for path, account in accounts.items():
        joined = joined.joined(account or Search(tables[path]))
    return joined
