"""``per-obspy pairs`` and ``per-obspy catalog``: make, check and store pair inventories."""

import datetime
import json
import sys
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer
from typer.core import TyperGroup

from per_obspy.cli.printing import (
    WRONG_INPUT,
    AsJson,
    output_option,
    print_table,
    stop_if_nothing,
)
from per_obspy.errors import CatalogError, printable, require_extra
from per_obspy.names import number_of

if TYPE_CHECKING:
    from collections.abc import Mapping, Sequence

    import pandas as pd

    from per_obspy.config import TableForm
    from per_obspy.errors import Rejection
    from per_obspy.inventory.catalogue import StoredInventory
    from per_obspy.inventory.files.formats import PairFile
    from per_obspy.inventory.footprints.footprint_pairs import FootprintPairs
    from per_obspy.inventory.footprints.layer_files import Box
    from per_obspy.results.coverage import Search


def is_terminal() -> bool:
    """Return whether standard input and output are a terminal."""
    return sys.stdin.isatty() and sys.stdout.isatty()


def asked_columns(path: "Path", form: "TableForm") -> "TableForm":
    """
    Ask for the headings of missing columns, and return the form of the table with them.

    Parameters
    ----------
    path : Path
        Pair table.
    form : TableForm
        Form of the table as far as it was recognised.
    """
    from per_obspy.inventory.files.formats import pair_file
    from per_obspy.inventory.files.headings import is_building_list
    from per_obspy.inventory.schema import missing_columns

    file = pair_file(path, form)
    columns = dict(form.columns)
    if is_building_list(file.headings):
        return form
    # What is missing, with the headings that may be meant first
    for name, *_ in missing_columns(file.names):
        proposed = file.meanings.proposals().get(name, [])
        heading = _choice(name, proposed, _unused(file, columns))
        if heading:
            columns[name] = heading
    return form.model_copy(update={"columns": columns})


def _unused(file: "PairFile", columns: "Mapping[str, str]") -> list[str]:
    """Return headings of a file without a known meaning."""
    used = {file.meanings.cells[place] for place in file.meanings.columns}
    return [cell for cell in file.meanings.cells if cell not in used | set(columns.values())]


def _choice(name: str, proposed: "Sequence[str]", others: "Sequence[str]") -> str:
    """Return the heading that the user chooses for a column, empty if none."""
    from per_obspy.inventory.schema import COLUMNS

    # The column, and the headings that may be meant
    column = COLUMNS[name]
    unit = f", {column.unit}" if column.unit not in ("", "1") else ""
    print(printable(f"{name} ({column.meaning}{unit}) is missing."))
    headings = [*proposed, *(heading for heading in others if heading not in proposed)]
    for number, heading in enumerate(headings, 1):
        print(printable(f"  {number} {heading}"))
    # Until the answer is one of them
    default = "1" if proposed else "0"
    while True:
        question = f"Which heading is it? number, or 0 for none [{default}]: "
        answer = input(question).strip() or default
        if answer == "0":
            return ""
        if answer.isdecimal() and int(answer) <= len(headings):
            return headings[int(answer) - 1]


def asked_units(units: "Mapping[str, str]") -> dict[str, str]:
    """Ask for the units of columns with implausible numbers, and return them."""
    from per_obspy.inventory.files.words import unit_of, unit_problem
    from per_obspy.inventory.schema import COLUMNS

    confirmed = dict[str, str]()
    for name, proposed in units.items():
        # Until the answer is a unit of the column
        known = COLUMNS[name].unit
        while True:
            question = f"Numbers of {name} look like {proposed}. Unit? [{proposed}; {known}]: "
            answer = input(question).strip() or proposed
            if answer == known or (known == "1" and answer in ("1", "no")):
                break
            if unit_of(answer, name):
                confirmed[name] = answer
                break
            print(unit_problem(answer, name))
    return confirmed


#: Rejected rows that are printed; the others are counted.
SHOWN = 10


class _FindByDefault(TyperGroup):
    """A command group with a default: ``pairs FOOTPRINTS`` is ``pairs find FOOTPRINTS``."""

    def parse_args(self, ctx: Any, args: list[str]) -> list[str]:
        known = (*self.commands, "--help", "-h")
        return super().parse_args(ctx, args if not args or args[0] in known else ["find", *args])


pairs = typer.Typer(
    cls=_FindByDefault,
    no_args_is_help=True,
    help="Pairs of neighbouring buildings: found in footprints, or checked. "
    "`pairs FILE` is `pairs find FILE`.",
)
catalog = typer.Typer(
    no_args_is_help=True, help="Stored inventories of pairs, with their sources and hashes."
)

Index = Annotated[Path, typer.Option("--index", help="Index of the stored inventories.")]
CATALOG = Path("catalogs/catalog.toml")


@pairs.command("find")
def find_pairs(
    footprints: Annotated[
        Path | None,
        typer.Argument(
            help="Polygons: GeoPackage, GeoParquet, GeoJSON, Shapefile; or a list of buildings, "
            ".csv with outlines (wkt) or longitude, latitude, width, length and azimuth; not "
            "given, with --bbox: of the latest release of Overture Maps."
        ),
    ] = None,
    output: Annotated[Path, output_option("Pair table, .parquet or .csv.")] = Path("pairs.parquet"),
    distance: Annotated[
        float, typer.Option(min=0.001, max=10.0, help="Largest gap of a pair, m.")
    ] = 3.0,
    layer: Annotated[str | None, typer.Option(help="Layer, for files that have several.")] = None,
    gap_std: Annotated[
        float | None,
        typer.Option(
            min=0.0,
            max=3.0,
            help="Standard deviation of gaps, m, touching ones too; 0 for exact outlines. If it is "
            "not given, it is assumed by the origin of the outlines, and marked.",
        ),
    ] = None,
    id_column: Annotated[str | None, typer.Option(help="Column of the identifiers.")] = None,
    height_column: Annotated[str | None, typer.Option(help="Column of the heights, m.")] = None,
    storeys_column: Annotated[str | None, typer.Option(help="Column of the storeys.")] = None,
    column: Annotated[
        list[str] | None,
        typer.Option(help="Column of any other quantity, such as period=T1; may be repeated."),
    ] = None,
    bbox: Annotated[
        str | None,
        typer.Option(
            help="Box W,S,E,N in degrees: only buildings that touch it, of GeoParquet with a "
            "column bbox, as Overture's; only the parts of the file that hold it are read."
        ),
    ] = None,
    heights: Annotated[
        Path | None,
        typer.Option(
            help="GeoTIFF of heights above ground, m: of buildings without height, storeys and "
            "period, the median inside the outline."
        ),
    ] = None,
    as_json: AsJson = False,
) -> None:
    """
    Find neighbouring buildings in footprints; their outlines are kept next to the pairs.

    Example: per-obspy pairs town.gpkg -o pairs.parquet
    """
    require_extra("gis", "pyogrio", "pyproj", "shapely")
    if heights is not None:
        require_extra("raster", "rasterio")
    from per_obspy.inventory.footprints.footprint_pairs import find_footprint_pairs
    from per_obspy.runs.inputs.drawn_pairs import write_search

    # Names of columns, each of which may be given by an option of its own
    given = {"building_id": id_column, "height": height_column, "storeys": storeys_column}
    columns = {name: known for name, known in given.items() if known is not None}
    columns |= _named_columns(column or [])
    box = None if bbox is None else parsed_box(bbox)
    if footprints is None:
        footprints = _fetched(box, output)
    found = find_footprint_pairs(footprints, distance, layer, gap_std, columns, box, heights)
    search = write_search(found, output)
    _print_footprint_pairs(found, search, output, as_json)
    stop_if_nothing(len(found.pairs))


def _fetched(box: "Box | None", output: Path) -> Path:
    """Return the buildings of a box as Overture Maps has them."""
    if box is None:
        raise typer.BadParameter("give a layer, or --bbox", param_hint="FOOTPRINTS")
    require_extra("overture", "overturemaps")
    from per_obspy.inventory.footprints.overture import fetch_overture

    path = fetch_overture(box, output)
    # The release is in the name
    print(f"buildings of Overture Maps: {path}", file=sys.stderr)
    return path


def parsed_box(text: str) -> "Box":
    """Return west, south, east and north of an option, degrees."""
    from per_obspy.config.pairs import box_of

    try:
        numbers = tuple(map(float, text.split(",")))
    except ValueError:
        numbers = ()
    try:
        return box_of(repr(text), numbers)
    except ValueError as error:
        raise typer.BadParameter(str(error), param_hint="--bbox") from error


def _named_columns(options: "Sequence[str]") -> dict[str, str]:
    """Parse options such as ``period=T1`` into a mapping of quantities to columns."""
    from per_obspy.inventory.footprints.building_columns import GIVEN

    columns = {}
    for option in options:
        name, equals, column = option.partition("=")
        if not equals or name not in GIVEN:
            problem = f"{option!r} is not QUANTITY=COLUMN with one of {', '.join(GIVEN)}"
            raise typer.BadParameter(problem, param_hint="--column")
        columns[name] = column
    return columns


def _print_footprint_pairs(
    found: "FootprintPairs", search: "Search", output: Path, as_json: bool
) -> None:
    """Print the account of a search, for machines or with the most common reasons."""
    from per_obspy.inventory.footprints.building_columns import raster_counts
    from per_obspy.report.coverage import search_sentence

    # Counts
    table, of_raster = found.pairs, raster_counts(found.buildings.table)
    rejected, buildings = table.attrs["rejected"], output.with_suffix(".buildings.parquet")
    touching = int((table["gap"] == 0.0).sum())
    if as_json:
        counts = {"pairs": len(table), "touching": touching, "rejected": len(rejected)}
        of_search = {"neighbours": search.neighbours, "left_out": dict(search.left_out)}
        places = {"output": str(output), "buildings": str(buildings)}
        of_licence = {"restricted": search.restricted} if search.restricted else {}
        print(json.dumps({**places, **counts, **of_search, **of_raster, **of_licence}))
        return
    print(printable(search_sentence(search, "en")))
    counted = (
        f"{number_of(len(table), 'pair')}, {touching} of them touching, {len(rejected)} rejected"
    )
    print(f"{counted}: {output}")
    # Further files and assumptions
    print(f"  outlines and columns of all buildings: {buildings}")
    _print_assumptions(table, of_raster)


def _print_assumptions(table: "pd.DataFrame", counts: "Mapping[str, int | float]") -> None:
    """Print the assumed deviation of gaps, and how many heights are from a raster."""
    if "given" not in set(table["gap_std_source"]):
        largest = table["gap_std"].max()
        print(f"  deviation of gaps, assumed by the origin of the outlines: up to {largest:g} m")
    # Without a raster there are no counts
    if counts:
        filled, largest = counts["heights_from_raster"], counts["largest_height_log_std"]
        said = f"{filled} buildings, log-deviation up to {largest:.2g}" if filled else "no building"
        print(f"  height from the raster: {said}; {counts['without_size']} without a size")


@pairs.command("check")
def check_pairs(
    file: Annotated[Path, typer.Argument(help="Pair table: .csv, .tsv, .txt, .parquet, .xlsx.")],
    write: Annotated[
        bool,
        typer.Option("--write", help="Write names and units of its columns to FILE.toml."),
    ] = False,
    as_json: AsJson = False,
) -> None:
    """
    Check a pair table and describe it; in a terminal, ask for headings and units.

    Example: per-obspy pairs check pairs.xlsx --write
    """
    from per_obspy.inventory.files.reading import checked_file, read_pairs
    from per_obspy.inventory.files.side_file import form_as_toml, form_of, write_form

    # Names and units that are not plain, which a person confirms
    asks = is_terminal() and not as_json
    form = asked_columns(file, form_of(file)) if asks else form_of(file)
    table = read_pairs(file, form)
    proposed = table.attrs["proposed_units"]
    if asks and proposed:
        form = form.model_copy(update={"units": {**form.units, **asked_units(proposed)}})
        table = read_pairs(file, form)
    _show_check(file, table, as_json)

    # What is written, or may be
    found = checked_file(file, form).meanings.as_form(form)
    if write:
        print(f"written: {write_form(file, found)}", file=sys.stderr)
    elif proposed and not as_json:
        print("\nUnits for a configuration, or for --write in a terminal:\n")
        print(form_as_toml(form.model_copy(update={"units": proposed}), "pairs"))
    stop_if_nothing(len(table), f"no usable row in {file}")


def _show_check(file: Path, table: "pd.DataFrame", as_json: bool) -> None:
    """Print the description of a pair table, as JSON or as text."""
    from per_obspy.inventory.files.reading import recognised_line

    # Counts, and findings about the table as a whole
    counts = {"pairs": len(table), "touching": int((table["gap"] == 0.0).sum())}
    rejected, odd = table.attrs["rejected"], table.attrs["suspicions"]
    found = {name: table.attrs[name] for name in ("recognised", "proposed_units")}
    if as_json:
        known = {"rejected": [row._asdict() for row in rejected], **_described(table)}
        known["doubtful"] = _noted(table).to_dict("records")
        print(json.dumps({**counts, **known, "suspicions": odd, **found}))
        return
    # People first learn how the table is read
    if found["recognised"]:
        print(recognised_line(file, found["recognised"]))
    counted = f"{counts['pairs']} usable pairs, {counts['touching']} of them touching"
    print(f"{file}: {counted}, {len(rejected)} rejected rows")
    _print_rejected(rejected)
    _print_doubtful(table)
    if not table.empty:
        _print_profile(table)
    for suspicion in odd:
        print("Suspicious:", suspicion)


def _described(table: "pd.DataFrame") -> "dict[str, Any]":
    """Return the profile of a pair table, the counts of derived values, and unused columns."""
    from per_obspy.inventory.table_checks import derived_counts, inventory_profile, unused_columns

    columns = json.loads(inventory_profile(table).to_json(orient="records"))
    unused = unused_columns(table, results_in(table))
    return {"columns": columns, "derived": derived_counts(table), "unused": unused}


def results_in(table: "pd.DataFrame") -> list[str]:
    """Return the columns of a pair table that a screening has added."""
    from per_obspy.inventory.schema import COLUMNS
    from per_obspy.screening.columns import HAZARD, known_column
    from per_obspy.screening.design import DESIGN

    added = [name for name in map(str, table) if name not in COLUMNS]
    # Names of places are the user's, too
    if "state" not in added:
        return []
    return [name for name in added if name in {**DESIGN, **HAZARD} or known_column(name)]


def _print_rejected(rejected: "Sequence[Rejection]") -> None:
    """Print the first rejected rows; count the others by column and fault."""
    from per_obspy.inventory.table_checks import faults_by_column

    for row in rejected[:SHOWN]:
        print(printable(f"  line {row.row}, {row.name}: {'; '.join(row.reasons)}"))
    # Where there are many, their faults by column
    if len(rejected) > SHOWN:
        faults = faults_by_column(rejected)
        counts = ", ".join(f"{fault} ({count})" for fault, count in faults.items())
        print(f"  and {len(rejected) - SHOWN} more; rows by fault: {counts}")


def _noted(table: "pd.DataFrame") -> "pd.DataFrame":
    """Return the pairs with a note on their cells, none if the table has no notes."""
    notes = table.reindex(columns=["pair_id", "cell_notes"]).astype(object).fillna("")
    return notes[notes["cell_notes"] != ""]


def _print_doubtful(table: "pd.DataFrame") -> None:
    """Print the first notes on cells that were not understood or are no exact value."""
    noted = _noted(table)
    if noted.empty:
        return
    # Some of them as examples
    print(f"{len(noted)} rows with a doubtful cell, which are screened:")
    for name, note in noted.head(SHOWN).itertuples(index=False):
        print(printable(f"  {name}: {note}"))
    if len(noted) > SHOWN:
        print(f"  and {len(noted) - SHOWN} more: column cell_notes of the result")


def _print_profile(table: "pd.DataFrame") -> None:
    """Print the columns of a pair table: given, derived and unknown ones."""
    from per_obspy.inventory.table_checks import derived_counts, inventory_profile, unused_columns

    profile, derived, results = inventory_profile(table), derived_counts(table), results_in(table)
    # The most frequent of many numbers is meaningless
    frequent = profile["most_frequent"].where(profile["median"].isna(), "")
    described = profile.assign(most_frequent=frequent)
    # Coordinates need more than three digits
    degrees = described["column"].str.match("longitude|latitude")
    for name in ("smallest", "median", "largest"):
        digits = described[name].map("{:.5f}".format)
        described[name] = described[name].astype(object).mask(degrees, digits)
    titles = [str(name).replace("_", " ") for name in profile.columns]
    print_table("What it gives", titles, described.itertuples(index=False))
    # Derived values, unknown columns
    if derived:
        counts = ", ".join(f"{name} ({rows})" for name, rows in derived.items())
        print("Derived or assumed instead (rows):", counts)
    if results:
        print(f"Columns of an earlier screening: {len(results)}")
    _print_unused(unused_columns(table, results))


def _print_unused(unused: list[str]) -> None:
    """Print the columns that are only carried, those of places apart."""
    from per_obspy.inventory.places import place_columns

    # They name pairs and buildings
    places = [name for name in unused if name == "place" or name in place_columns(unused)]
    unknown = [name for name in unused if name not in places]
    for title, names in (("Names of places", places), ("Unknown columns", unknown)):
        if names:
            print(f"{title}, carried along unchanged:", printable("; ".join(names)))


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
    print(
        f"{entry.name}: {number_of(entry.pairs, 'pair')}, sha256 {entry.sha256}, entered in {index}"
    )


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
        rows = [fault._asdict() for fault in faults]
        print(json.dumps({"inventories": count, "faults": rows}))
    else:
        print(f"{count - len(faults)} of {count} stored inventories are unchanged")
    # One line per fault, whatever the form of the result
    for fault in faults:
        print(f"per-obspy: {fault.source}: {'; '.join(fault.reasons)}", file=sys.stderr)
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
    """Print stored inventories, one row per inventory."""
    if as_json:
        print(json.dumps([entry.model_dump(mode="json") for entry in entries]))
        return
    titles = ("name", "pairs", "west south east north", "licence", "source", "date")
    rows = [_inventory_cells(entry) for entry in entries]
    print_table(f"{len(rows)} stored inventories", titles, rows)


def _inventory_cells(entry: "StoredInventory") -> tuple[object, ...]:
    """Return the cells of one stored inventory."""
    box = " ".join(f"{degrees:g}" for degrees in entry.bounding_box)
    return entry.name, entry.pairs, box, entry.licence, entry.source, entry.date
