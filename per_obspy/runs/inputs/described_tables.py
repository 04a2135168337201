"""Facts of pair tables, footprints and risk tables."""

from collections.abc import Iterable, Sequence
from itertools import islice
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np
import pandas as pd

from per_obspy.errors import require_extra
from per_obspy.inventory.files.reading import PairInventory, checked_chunk
from per_obspy.inventory.schema import COLUMNS
from per_obspy.inventory.table_checks import derived_counts, unused_columns
from per_obspy.inventory.table_columns import numbers_in
from per_obspy.results.parts import parquet_rows
from per_obspy.results.ranked_table import ranked_table
from per_obspy.runs.inputs.facts import Facts, Places, some, span
from per_obspy.runs.inputs.input_kinds import Kind
from per_obspy.screening.ranking import EVERY_STATE, STATES

if TYPE_CHECKING:
    import pyarrow as pa

#: Rows of a table that are looked at.
MOST_ROWS = 100_000

#: Rejections that are listed.
FIRST = 2

#: Quantities of a building whose range is listed.
_RANGES = ("height", "storeys", "period")


def pair_table_facts(path: Path) -> Facts:
    """Return the facts of a pair table, by its first rows if it is large."""
    inventory = PairInventory([path])
    table = checked_chunk(next(inventory.chunks(MOST_ROWS)))
    rejected = [one._asdict() for one in table.attrs["rejected"]]
    derived, unused = derived_counts(table) if len(table) else {}, unused_columns(table)
    lines = _pair_lines(table, derived, unused)
    lines += [("suspicious", sentence) for sentence in inventory.suspicions.sentences()]
    lines += _rejected_lines([(f"line {one['row']}", one["reasons"]) for one in rejected])
    values = {
        "rows": inventory.count, "usable": len(table), "derived": derived,
        "unknown": unused, "rejected": rejected,
    }  # fmt: skip
    # Only the first rows of a large table are read
    first = f"the first {MOST_ROWS} of " if inventory.count > MOST_ROWS else ""
    title = f"{first}{inventory.count} rows, {len(table)} usable, {len(rejected)} rejected"
    return Facts(Kind.PAIRS, title, lines, {"": _centres(table)}, values, not table.empty)


def _pair_lines(
    table: pd.DataFrame, derived: dict[str, int], unused: Sequence[str]
) -> list[tuple[str, str]]:
    """Return ranges of gaps and of both buildings together, derived and unknown columns."""
    # Pairs that touch count apart
    gaps = table["gap"]
    pairs = f"{gaps.eq(0.0).sum()} pairs touch, {gaps.isna().sum()} unknown"
    lines = [("gap", f"{span(gaps, 'm')}; {pairs}")]
    for name in _RANGES:
        numbers = np.concatenate([numbers_in(table, f"{name}_{i}") for i in (1, 2)])
        if not np.isnan(numbers).all():
            lines.append((name, span(numbers, COLUMNS[f"{name}_1"].unit.replace("1", ""))))
    # Derived columns, and those that the schema does not know
    if derived:
        lines.append(("derived", some([f"{name} ({rows})" for name, rows in derived.items()], 8)))
    if unused:
        lines.append(("unknown", f"{some(unused)}: carried along unchanged"))
    return lines


def _rejected_lines(rejected: Iterable[tuple[str, Sequence[str]]]) -> list[tuple[str, str]]:
    """Return the first rejections with their reasons."""
    return [
        ("rejected", f"{name}: {'; '.join(reasons)}") for name, reasons in islice(rejected, FIRST)
    ]


def footprint_facts(path: Path) -> Facts:
    """Return the facts of a layer of footprints."""
    require_extra("gis", "pyogrio", "pyproj", "shapely")
    from per_obspy.inventory.footprints.layers import read_layer

    # Everything in the file, as a search of pairs reads it
    layer = read_layer(path)
    # How many buildings have a value under each of the names
    given = {str(name): int(values.notna().sum()) for name, values in layer.attributes.items()}
    counted = [f"{name} ({count})" for name, count in given.items() if count]
    lines = [("columns", some(counted, 12))]
    rejected = [one._asdict() for one in layer.rejected]
    lines += _rejected_lines((one.name, one.reasons) for one in layer.rejected)
    east, north = _outline_centres(layer.outlines)
    values = {"outlines": len(east), "columns": given, "rejected": rejected}
    title = f"{len(east)} outlines, {len(rejected)} rejected"
    return Facts(Kind.FOOTPRINTS, title, lines, {"": (east, north)}, values, usable=len(east) > 0)


def _outline_centres(outlines: "pa.Array") -> Places:
    """Return the centres of outlines, block by block: as geometries they are large."""
    import shapely

    # As lists, which a map and JSON take
    east, north = list[float](), list[float]()
    for start in range(0, len(outlines), MOST_ROWS):
        block = outlines[start : start + MOST_ROWS].to_numpy(zero_copy_only=False)
        centres = shapely.get_coordinates(shapely.centroid(shapely.from_wkb(block)))
        east += centres[:, 0].tolist()
        north += centres[:, 1].tolist()
    return east, north


#: Columns of a risk table that are shown.
_RISK_COLUMNS = ["pair_id", "state", "longitude_1", "latitude_1", "longitude_2", "latitude_2"]


def risk_table_facts(path: Path) -> Facts:
    """Return the facts of a risk table, CSV or Parquet, by its first rows if it is large."""
    # Only the shown columns are read
    if path.suffix.lower() == ".csv":
        table = pd.read_csv(path, nrows=MOST_ROWS, usecols=lambda name: name in _RISK_COLUMNS)
    else:
        table = parquet_rows([path], _RISK_COLUMNS).head(MOST_ROWS).to_pandas()
    return _risk_facts(table)


def ranked_table_facts(files: Sequence[Path]) -> Facts:
    """Return the facts of a risk table in one file or one per cell, by its worst rows."""
    with ranked_table(files) as table:
        return _risk_facts(table.first(MOST_ROWS, _RISK_COLUMNS))


def _risk_facts(table: pd.DataFrame) -> Facts:
    """Return the facts of the worst rows of a risk table."""
    # States, unknown ones only where there are such pairs, and the first rows, which are the worst
    states = {state: int((table["state"] == state).sum()) for state in EVERY_STATE}
    shown = [f"{n} {state}" for state, n in states.items() if n or state in STATES]
    worst = some([str(name) for name in table["pair_id"]], 5)
    lines = [("pounding", ", ".join(shown)), ("worst pairs", worst)]
    title = f"{len(table)} pairs{' and more' if len(table) == MOST_ROWS else ''}"
    values = {"pairs": len(table), **states}
    return Facts(Kind.RISK, title, lines, {"": _centres(table)}, values, usable=len(table) > 0)


def _centres(table: pd.DataFrame) -> Places:
    """Return the middle of every pair."""
    places = []
    for name in ("longitude", "latitude"):
        first, second = numbers_in(table, f"{name}_1"), numbers_in(table, f"{name}_2")
        places.append(np.where(abs(first - second) > 180.0, first, (first + second) / 2.0).tolist())
    return places[0], places[1]
