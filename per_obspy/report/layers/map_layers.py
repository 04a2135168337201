"""All layers of a screening: ``risk.gpkg``, its project of QGIS, and GeoParquet."""

import json
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from contextlib import ExitStack
from pathlib import Path
from typing import TYPE_CHECKING, NamedTuple

import numpy as np
import pandas as pd
import pyarrow.parquet as pq
import shapely

from per_obspy.files import written_whole
from per_obspy.inventory.footprints.gdal_paths import literal_path
from per_obspy.report.layers.geopackage import (
    GeoParquet,
    Layer,
    Shapes,
    append_layer,
    geometry_type,
    pair_shapes,
    points,
    write_styles,
)
from per_obspy.report.layers.inspections import INSPECTIONS, MOST, inspection_layer
from per_obspy.report.layers.kml import has_both_places
from per_obspy.report.layers.qgis import (
    ProjectLayer,
    class_style,
    column_aliases,
    form_style,
    single_style,
    write_project,
)
from per_obspy.results.parts import batches, bounded_database, parquet_rows
from per_obspy.results.totals import RegionTotals
from per_obspy.screening.columns import known_column

if TYPE_CHECKING:
    from per_obspy.checks import FloatArray

#: Names of the layers: outlines, and buildings that have none where others do.
BUILDINGS, WITHOUT_OUTLINE = "buildings", "buildings_without_outline"

#: Buildings that are read together.
ROWS = 50_000

#: Column of the outlines while they are joined.
_OUTLINE = "outline_of_layer"


def building_layers(pairs: Path, ranked: Path, outlines: Path | None) -> Iterator[Layer]:
    """
    Yield the buildings in pieces, worst first.

    Parameters
    ----------
    pairs : Path
        Pairs of a risk table, Parquet, with the places of both buildings.
    ranked : Path
        Table of the buildings of the same run, Parquet; where it is missing, buildings are those
        of the pairs, each with its worst pair.
    outlines : Path or None
        GeoParquet with ``building_id``; None where no outline is known.
    """
    with bounded_database(pairs.parent) as database:
        if ranked.exists():
            database.register("found", parquet_rows([ranked]))
            query = "SELECT * FROM found"
        else:
            database.register("pairs", parquet_rows([pairs]))
            query = _worst_pairs(set(pq.read_schema(pairs.absolute()).names))
        # Each building has one outline, however often the file has it
        if outlines is not None:
            name = _primary_column(outlines)
            database.register("drawn", parquet_rows([outlines], ["building_id", name]))
            query = (
                f'SELECT found.*, first."{name}" AS {_OUTLINE} FROM ({query}) AS found LEFT JOIN '
                f'(SELECT CAST(building_id AS VARCHAR) AS name, any_value("{name}") AS "{name}" '
                "FROM drawn GROUP BY 1) AS first ON first.name = found.building_id"
            )
        for batch in batches(database, f"{query} ORDER BY rank", ROWS):
            yield from _layers(batch.to_pandas(), outlines is not None)


def _worst_pairs(columns: set[str]) -> str:
    """Return the query of the buildings of all pairs, each with its worst pair."""
    sides = " UNION ALL ".join(_side(number, columns) for number in (1, 2))
    return f"""
        SELECT row_number() OVER (ORDER BY min(rank)) AS rank, building_id,
            arg_min(risk_class, rank) AS risk_class, min(rank) AS worst_rank,
            arg_min(pair_id, rank) AS worst_pair, count(*) AS pairs,
            max(expected_impact_velocity) AS expected_impact_velocity,
            max(probability) AS probability_common,
            any_value(longitude) AS longitude, any_value(latitude) AS latitude
        FROM ({sides}) GROUP BY building_id
    """


def _side(number: int, columns: set[str]) -> str:
    """Return the query of one building of every pair; without a name its pair names it."""
    own = f"pair_id || '#{number}'"
    given = f"building_id_{number}"
    named = f"coalesce(nullif(CAST({given} AS VARCHAR), ''), {own})" if given in columns else own
    return (
        f"SELECT {named} AS building_id, pair_id, rank, risk_class, expected_impact_velocity, "
        f"probability, longitude_{number} AS longitude, latitude_{number} AS latitude FROM pairs"
    )


def _primary_column(outlines: Path) -> str:
    """Return the column of the outlines."""
    metadata = pq.read_schema(outlines.absolute()).metadata or {}
    return str(json.loads(metadata[b"geo"])["primary_column"])


def _layers(table: pd.DataFrame, with_outlines: bool) -> Iterator[Layer]:
    """Yield buildings with outlines, and those without."""
    if not with_outlines:
        yield Layer(BUILDINGS, table, points(table))
        return
    shapes = shapely.from_wkb(table.pop(_OUTLINE).to_numpy(dtype=object), on_invalid="ignore")
    # Buildings without a polygon are points
    drawn = np.isin(shapely.get_type_id(shapes), (3, 6))
    yield Layer(BUILDINGS, table[drawn], _multiple(shapes[drawn]))
    if not drawn.all():
        yield Layer(WITHOUT_OUTLINE, table[~drawn], points(table[~drawn]))


def _multiple(shapes: Shapes) -> Shapes:
    """Return polygons as multipolygons: shapes of a layer are all of one type."""
    several = shapely.get_type_id(shapes) == shapely.GeometryType.MULTIPOLYGON
    found = shapes.copy()
    for position in np.flatnonzero(~several):
        found[position] = shapely.multipolygons([shapes[position]])
    return found


PAIRS, STATIONS, AREAS = "pairs", "stations", "areas"

#: Layers from the top of the map to its bottom.
DRAWN = (STATIONS, PAIRS, INSPECTIONS, "buildings_without_outline", "buildings", AREAS)

#: Columns of stations on a map.
_OF_STATIONS = ("station", "state", "pairs", "pga", "pgv", "warnings", "rejected")

#: Units of columns that the risk table does not have.
_UNITS = {"pga": "m/s2", "pgv": "m/s", "severity": "m/s", "worst_expected_impact_velocity": "m/s"}


class MapSources(NamedTuple):
    """
    Contents of the layers other than the pairs.

    Attributes
    ----------
    classes : sequence of str
        Names of the risk classes, worst first.
    facts : mapping of str to str
        Facts that hold for all rows, for example whether the motion is simulated.
    stations : DataFrame
        Rows of ``stations.csv``; may be empty.
    totals : callable
        Returns the totals of the areas once all pairs are taken.
    ranked : Path
        Table of the buildings, which need not exist.
    outlines : Path or None
        GeoParquet with the outlines of the buildings.
    """

    classes: Sequence[str]
    facts: Mapping[str, str]
    stations: pd.DataFrame
    totals: Callable[[], RegionTotals | None]
    ranked: Path
    outlines: Path | None


def write_layers(
    tables: Iterable[pd.DataFrame], sources: MapSources, files: tuple[Path, Path, Path]
) -> None:
    """
    Write all layers, each file whole or not at all.

    Parameters
    ----------
    tables : iterable of DataFrame
        The risk table, in one piece or in several with the same columns; only one is held at a
        time.
    sources : MapSources
        Contents of the layers other than the pairs.
    files : tuple of Path
        GeoPackage, project of QGIS, GeoParquet.
    """
    package, project, whole = files
    with ExitStack() as stack:
        table_part = stack.enter_context(written_whole(whole))
        part = stack.enter_context(literal_path(stack.enter_context(written_whole(package))))
        # All pairs in one pass
        book = _Package(part, sources)
        with GeoParquet(table_part) as rows:
            for table in tables:
                shapes = pair_shapes(table)
                rows.append(table, shapes)
                book.add(Layer(PAIRS, table, shapes))
        # Forms for the field, then what is drawn below the pairs
        book.add(inspection_layer(pd.concat(book.worst)))
        for layer in _other_layers(sources, table_part, book.has_places):
            book.add(layer)
        write_styles(part, {layer.name: layer.style for layer in book.described()})
        name = sources.facts.get("name", "")
        write_project(name, package.name, book.described(), book.extent, project)


class _Package:
    """Layers of a GeoPackage as they are written."""

    def __init__(self, path: Path, sources: MapSources) -> None:
        self.path, self.sources = path, sources
        self.layers: dict[str, ProjectLayer] = {}
        self.boxes: list[FloatArray] = []
        self.worst: list[pd.DataFrame] = []
        self.has_places = False

    def add(self, layer: Layer) -> None:
        """Write a layer, or append rows to it."""
        is_new = layer.name not in self.layers
        if is_new:
            kind = geometry_type(layer.shapes)
            style = _style(layer, kind, self.sources.classes)
            self.layers[layer.name] = ProjectLayer(layer.name, kind, style)
        # The view is that of the pairs
        append_layer(self.path, layer, is_new, self.sources.facts)
        if layer.name == PAIRS:
            self.has_places = has_both_places(layer.table.columns)
            left = MOST - sum(map(len, self.worst))
            if not self.worst or left:
                self.worst.append(layer.table[["pair_id", "rank", "longitude", "latitude"]][:left])
            if shapely.is_geometry(layer.shapes).any():
                self.boxes.append(shapely.total_bounds(layer.shapes))

    def described(self) -> list[ProjectLayer]:
        """Return the layers from the top of the map to its bottom."""
        return [self.layers[name] for name in DRAWN if name in self.layers]

    @property
    def extent(self) -> tuple[float, float, float, float]:
        """West, south, east, north of the pairs."""
        if not self.boxes:
            return -180.0, -90.0, 180.0, 90.0
        west, south, east, north = zip(*(box.tolist() for box in self.boxes), strict=True)
        return min(west), min(south), max(east), max(north)


def _style(layer: Layer, kind: str, classes: Sequence[str]) -> str:
    """Return the style of a layer: by severity, or one open symbol."""
    if layer.name == INSPECTIONS:
        return form_style()
    columns = [str(name) for name in layer.table]
    known = {name: column.unit for name in columns if (column := known_column(name))}
    aliases = column_aliases(columns, known | _UNITS)
    if layer.name in (STATIONS, AREAS):
        return single_style(kind, "#232323", aliases)
    return class_style(classes, kind, aliases)


def _other_layers(sources: MapSources, pairs: Path, has_places: bool) -> Iterator[Layer]:
    """Yield the layers of buildings, stations and areas that are not empty."""
    if has_places:
        yield from building_layers(pairs, sources.ranked, sources.outlines)
    if not sources.stations.empty:
        table = sources.stations
        chosen = [name for name in _OF_STATIONS if name in table]
        yield Layer(STATIONS, table[chosen], points(table))
    # Totals are known once all pairs are taken
    totals = sources.totals()
    if totals is not None:
        yield _areas(totals)


def _areas(totals: RegionTotals) -> Layer:
    """Return totals as polygons of their cells, or as points amid their pairs."""
    table = totals.table
    if totals.outlines is None:
        return Layer(AREAS, table, points(table))
    # Of one type with those of buildings
    polygons = [shapely.Polygon(corners) for corners in totals.outlines]
    shapes = shapely.multipolygons([[polygon] for polygon in polygons])
    return Layer(AREAS, table, shapes)
