"""Facts of pair tables, footprints and risk tables."""

from pathlib import Path

import numpy as np
import pandas as pd

from per_obspy.errors import require_extra
from per_obspy.inventory.files.reading import PairInventory, checked_chunk
from per_obspy.inventory.schema import COLUMNS
from per_obspy.inventory.table_checks import derived_counts, suspicions, unused_columns
from per_obspy.inventory.table_columns import numbers_in
from per_obspy.pipeline.inputs.facts import Facts, Places, some, span
from per_obspy.pipeline.inputs.recognition import Kind
from per_obspy.screening.ranking import STATES
from per_obspy.tables.parts import parquet_rows

#: Rows of a table that are looked at.
MOST_ROWS = 100_000

#: Quantities of a pair or of its buildings whose range is said, with their columns.
_RANGES = {"height": ("height_1", "height_2"), "storeys": ("storeys_1", "storeys_2")}
_RANGES |= {"period": ("period_1", "period_2")}


def pair_table_facts(path: Path) -> Facts:
    """Return the facts of a pair table, by its first rows if it is large."""
    inventory = PairInventory([path])
    table = checked_chunk(next(inventory.chunks(MOST_ROWS)))
    rejected = table.attrs["rejected"]
    looked_at = min(inventory.count, MOST_ROWS)
    part = f"the first {looked_at} of " if inventory.count > MOST_ROWS else ""
    # What it gives, what is derived instead, and what is odd
    touching = int((table["gap"] == 0.0).sum())
    lines = [("gap", f"{span(table['gap'].tolist(), 'm')}; {touching} pairs touch")]
    for name, columns in _RANGES.items():
        numbers = np.concatenate([numbers_in(table, column) for column in columns])
        if not np.isnan(numbers).all():
            lines.append((name, span(numbers.tolist(), COLUMNS[columns[0]].unit.replace("1", ""))))
    derived = derived_counts(table) if len(table) else {}
    counted = [f"{name} ({rows})" for name, rows in derived.items()]
    lines += [("derived", some(counted, 5))] if counted else []
    unused = unused_columns(table)
    lines += [("unknown", f"{some(unused)}: carried along unchanged")] if unused else []
    lines += [("suspicious", sentence) for sentence in suspicions(table)]
    lines += [("rejected", f"line {one.row}: {'; '.join(one.reasons)}") for one in rejected[:2]]
    return Facts(
        Kind.PAIRS,
        f"{part}{inventory.count} rows, {len(table)} usable, {len(rejected)} rejected",
        lines,
        {"": _centres(table)},
        {"rows": inventory.count, "usable": len(table), "touching": touching}
        | {"rejected": [one._asdict() for one in rejected], "derived": derived}
        | {"unknown": unused, "columns": [str(name) for name in table]},
        usable=len(table) > 0,
    )


def footprint_facts(path: Path) -> Facts:
    """Return the facts of a layer of footprints."""
    require_extra("gis", "pyogrio", "pyproj", "shapely")
    import shapely

    from per_obspy.inventory.footprints.layers import read_layer

    layer = read_layer(path)
    centres = shapely.get_coordinates(shapely.centroid(layer.polygons))
    names = [str(name) for name in layer.attributes]
    # How many buildings have a value under each of the names
    given = {name: int(layer.attributes[name].notna().sum()) for name in names}
    lines = [("columns", some([f"{name} ({count})" for name, count in given.items()], 9))]
    lines += [("rejected", f"{one.name}: {'; '.join(one.reasons)}") for one in layer.rejected[:3]]
    return Facts(
        Kind.FOOTPRINTS,
        f"{len(centres)} outlines, {len(layer.rejected)} rejected",
        lines,
        {"": (centres[:, 0].tolist(), centres[:, 1].tolist())},
        {"outlines": len(centres), "columns": given}
        | {"rejected": [one._asdict() for one in layer.rejected]},
        usable=len(centres) > 0,
    )


def risk_table_facts(path: Path) -> Facts:
    """Return the facts of a risk table, CSV or Parquet."""
    names = ["pair_id", "state", "probability", "longitude_1", "latitude_1"]
    names += ["longitude_2", "latitude_2"]
    if path.suffix == ".csv":
        table = pd.read_csv(path, nrows=MOST_ROWS, usecols=lambda name: name in names)
    else:
        table = parquet_rows([path], names).head(MOST_ROWS).to_pandas()
    states = {state: int((table["state"] == state).sum()) for state in STATES}
    worst = [str(name) for name in table["pair_id"].head(5)]
    return Facts(
        Kind.RISK,
        f"{len(table)} pairs{' and more' if len(table) == MOST_ROWS else ''}",
        [
            ("pounding", ", ".join(f"{count} {state}" for state, count in states.items())),
            ("worst pairs", some(worst)),
        ],
        {"": _centres(table)},
        {"pairs": len(table), **states},
        usable=len(table) > 0,
    )


def _centres(table: pd.DataFrame) -> Places:
    """Return the middle of every pair."""
    places = []
    for name in ("longitude", "latitude"):
        first, second = numbers_in(table, f"{name}_1"), numbers_in(table, f"{name}_2")
        places.append(np.where(abs(first - second) > 180.0, first, (first + second) / 2.0).tolist())
    return places[0], places[1]
