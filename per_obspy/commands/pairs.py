"""``per-obspy pairs`` and ``per-obspy catalog``: inventories of building pairs, made, checked and stored."""

import datetime
import json
import sys
from collections import Counter
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer
from typer.core import TyperGroup

from per_obspy.commands.endings import WRONG_INPUT, AsJson, end_if_nothing
from per_obspy.commands.printing import print_table
from per_obspy.errors import CatalogError, require_extra

if TYPE_CHECKING:
    from collections.abc import Sequence

    import pandas as pd

    from per_obspy.errors import Rejection
    from per_obspy.inventory.catalogue import StoredInventory

#: Rejected rows that are printed, the others are counted; and the most common reasons for
#: rejections.
SHOWN, COMMON = 10, 3


class _FindByDefault(TyperGroup):
    """A group whose first word may be left out: ``pairs FOOTPRINTS`` is ``pairs find FOOTPRINTS``."""

    def parse_args(self, ctx: Any, args: list[str]) -> list[str]:
        known = (*self.commands, "--help", "-h")
        return super().parse_args(ctx, args if not args or args[0] in known else ["find", *args])


pairs = typer.Typer(
    cls=_FindByDefault,
    no_args_is_help=True,
    help="Pairs of neighbouring buildings: found in footprints, or checked. `pairs FILE` is `pairs find FILE`.",
)
catalog = typer.Typer(
    no_args_is_help=True, help="Stored inventories of pairs, with their sources and hashes."
)

Index = Annotated[Path, typer.Option("--index", help="Index of the stored inventories.")]
CATALOG = Path("catalogs/catalog.toml")


@pairs.command("find")
def find_pairs(
    footprints: Annotated[
        Path, typer.Argument(help="Polygons: GeoPackage, GeoParquet, GeoJSON, Shapefile.")
    ],
    output: Annotated[
        Path, typer.Option("--output", "-o", help="Pair table, .parquet or .csv.")
    ] = Path("pairs.parquet"),
    distance: Annotated[
        float, typer.Option(min=0.001, max=10.0, help="Largest gap of a pair, m.")
    ] = 3.0,
    layer: Annotated[str | None, typer.Option(help="Layer, for files that have several.")] = None,
    gap_std: Annotated[
        float, typer.Option(min=0.0, help="Standard deviation of drawn gaps, m.")
    ] = 0.0,
    as_json: AsJson = False,
) -> None:
    """
    Find neighbouring buildings in footprints.

    Example: per-obspy pairs town.gpkg -o pairs.parquet
    """
    require_extra("gis", "pyogrio", "pyproj", "shapely")
    from per_obspy.inventory.files.writing import write_pairs
    from per_obspy.inventory.footprints.pairs import pairs_from_footprints
    from per_obspy.tables.table_files import write_rejected

    table = pairs_from_footprints(footprints, distance, layer, gap_std)
    rejected = table.attrs["rejected"]
    write_pairs(table, output)
    write_rejected(rejected, output.with_suffix(".rejected.csv"))
    facts = {
        "pairs": len(table),
        "touching": int((table["gap"] == 0.0).sum()),
        "rejected": len(rejected),
    }
    if as_json:
        print(json.dumps({"output": str(output), **facts}))
    else:
        print(
            f"{facts['pairs']} pairs, {facts['touching']} of them touching, {len(rejected)} rejected: {output}"
        )
        for reason, count in Counter(
            reason for one in rejected for reason in one.reasons
        ).most_common(COMMON):
            print(f"  {count} times: {reason}")
    end_if_nothing(len(table))


@pairs.command("check")
def check_pairs(
    file: Annotated[Path, typer.Argument(help="Pair table, .csv or .parquet.")],
    as_json: AsJson = False,
) -> None:
    """
    Check a pair table and say what it gives.

    Example: per-obspy pairs check pairs.csv
    """
    from per_obspy.inventory.files.reading import read_pairs
    from per_obspy.inventory.profile import (
        derived_counts,
        inventory_profile,
        suspicions,
        unused_columns,
    )

    table = read_pairs(file)
    rejected = table.attrs["rejected"]
    profile = inventory_profile(table)
    touching = int((table["gap"] == 0.0).sum())
    derived, unused, odd = derived_counts(table), unused_columns(table), suspicions(table)
    if as_json:
        columns = json.loads(profile.to_json(orient="records"))
        faults = [one._asdict() for one in rejected]
        known = {"pairs": len(table), "touching": touching, "rejected": faults, "columns": columns}
        print(json.dumps({**known, "derived": derived, "unused": unused, "suspicions": odd}))
    else:
        print(
            f"{file}: {len(table)} usable pairs, {touching} of them touching, {len(rejected)} rejected rows"
        )
        _print_rejected(rejected)
        if not table.empty:
            _print_profile(profile, derived, unused, odd)
    end_if_nothing(len(table), f"no usable row in {file}")


def _print_rejected(rejected: "Sequence[Rejection]") -> None:
    """Print the first rejected rows, and where there are more, how many were rejected for what."""
    from per_obspy.inventory.profile import faults_by_column

    for one in rejected[:SHOWN]:
        print(f"  line {one.row}, {one.name}: {'; '.join(one.reasons)}")
    if len(rejected) > SHOWN:
        counts = ", ".join(
            f"{fault} ({count})" for fault, count in faults_by_column(rejected).items()
        )
        print(f"  and {len(rejected) - SHOWN} more; rows by fault: {counts}")


def _print_profile(
    profile: "pd.DataFrame", derived: dict[str, int], unused: list[str], suspicions: list[str]
) -> None:
    # the commonest of many numbers says nothing, and a place needs more than three digits
    described = profile.assign(
        most_frequent=profile["most_frequent"].where(profile["median"].isna(), "")
    )
    for name in ("smallest", "median", "largest"):
        degrees = described["column"].str.match("longitude|latitude")
        described[name] = (
            described[name].astype(object).mask(degrees, described[name].map("{:.5f}".format))
        )
    titles = [str(name).replace("_", " ") for name in profile.columns]
    print_table("What it gives", titles, described.itertuples(index=False))
    if derived:
        print(
            "Derived or assumed instead (rows):",
            ", ".join(f"{name} ({rows})" for name, rows in derived.items()),
        )
    if unused:
        print("Unknown columns, carried along unchanged:", "; ".join(unused))
    for one in suspicions:
        print("Suspicious:", one)


@catalog.command("add")
def add(
    file: Annotated[Path, typer.Argument(help="Pair table, .csv or .parquet.")],
    name: Annotated[str, typer.Option(help="Unique in the index.")],
    source: Annotated[str, typer.Option(help="Where the data come from.")],
    licence: Annotated[str, typer.Option(help="Under which they may be used.")],
    index: Index = CATALOG,
) -> None:
    """
    Enter a pair table into the index.

    Example: per-obspy catalog add pairs.parquet --name "old town" --source survey --licence CC0-1.0
    """
    from per_obspy.inventory.catalogue import Origin, add_inventory

    today = datetime.datetime.now(datetime.UTC).date()
    entry = add_inventory(index, file, Origin(name, source, licence, today))
    print(f"{entry.name}: {entry.pairs} pairs, sha256 {entry.sha256}, entered in {index}")


@catalog.command("list")
def list_inventories(index: Index = CATALOG, as_json: AsJson = False) -> None:
    """
    List the stored inventories.

    Example: per-obspy catalog list
    """
    from per_obspy.inventory.catalogue import stored_inventories

    _print_inventories(stored_inventories(index), as_json)


@catalog.command("check")
def check(index: Index = CATALOG, as_json: AsJson = False) -> None:
    """
    Compare every stored inventory with its hash; exit code 2 if one has changed or is missing.

    Example: per-obspy catalog check
    """
    from per_obspy.inventory.catalogue import check_inventories, stored_inventories

    count, faults = len(stored_inventories(index)), check_inventories(index)
    if as_json:
        print(json.dumps({"inventories": count, "faults": [one._asdict() for one in faults]}))
    else:
        print(f"{count - len(faults)} of {count} stored inventories are unchanged")
    for one in faults:
        print(f"per-obspy: {one.source}: {'; '.join(one.reasons)}", file=sys.stderr)
    if faults:
        raise typer.Exit(WRONG_INPUT)


@catalog.command("find")
def find(
    bbox: Annotated[
        tuple[float, float, float, float], typer.Option(help="West, south, east, north, degrees.")
    ],
    index: Index = CATALOG,
    as_json: AsJson = False,
) -> None:
    """
    Find the stored inventories that a region touches.

    Example: per-obspy catalog find --bbox -99.3 19.2 -98.9 19.6
    """
    from per_obspy.inventory.catalogue import Box, find_inventories

    try:
        found = find_inventories(index, Box(*bbox))
    except CatalogError:  # a ValueError as well, but of the index
        raise
    except ValueError as error:
        raise typer.BadParameter(str(error), param_hint="--bbox") from error
    _print_inventories(found, as_json)


def _print_inventories(entries: "Sequence[StoredInventory]", as_json: bool) -> None:
    if as_json:
        print(json.dumps([entry.model_dump(mode="json") for entry in entries]))
        return
    rows = [
        (
            one.name,
            one.pairs,
            " ".join(f"{x:g}" for x in one.bounding_box),
            one.licence,
            one.source,
            one.date,
        )
        for one in entries
    ]
    titles = ("name", "pairs", "west south east north", "licence", "source", "date")
    print_table(f"{len(rows)} stored inventories", titles, rows)
