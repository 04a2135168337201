"""All layers of a screening: ``risk.gpkg``, its project of QGIS, and GeoParquet."""

from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from contextlib import ExitStack
from pathlib import Path
from typing import TYPE_CHECKING, NamedTuple

import pandas as pd
import shapely

from per_obspy.files import written_whole
from per_obspy.inventory.footprints.gdal_paths import literal_path
from per_obspy.report.layers.building_layer import building_layers
from per_obspy.report.layers.geopackage import Layer, append_layer, geometry_type, write_styles
from per_obspy.report.layers.geoparquet import GeoParquet
from per_obspy.report.layers.pair_places import has_both_places
from per_obspy.report.layers.qgis_project import ProjectLayer, write_project
from per_obspy.report.layers.qgis_style import class_style, column_aliases, single_style
from per_obspy.report.layers.shapes import pair_shapes, points
from per_obspy.screening.columns import known_column
from per_obspy.tables.totals import RegionTotals

if TYPE_CHECKING:
    from per_obspy.checks import FloatArray

PAIRS, STATIONS, AREAS = "pairs", "stations", "areas"

#: Layers from the top of the map to its bottom.
DRAWN = (STATIONS, PAIRS, "buildings_without_outline", "buildings", AREAS)

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
        places = table["longitude"].to_numpy(float), table["latitude"].to_numpy(float)
        chosen = [name for name in _OF_STATIONS if name in table]
        yield Layer(STATIONS, table[chosen], points(*places))
    # Totals are known once all pairs are taken
    totals = sources.totals()
    if totals is not None:
        yield _areas(totals)


def _areas(totals: RegionTotals) -> Layer:
    """Return totals as polygons of their cells, or as points amid their pairs."""
    table = totals.table
    if totals.outlines is None:
        places = table["longitude"].to_numpy(float), table["latitude"].to_numpy(float)
        return Layer(AREAS, table, points(*places))
    # Of one type with those of buildings
    polygons = [shapely.Polygon(corners) for corners in totals.outlines]
    shapes = shapely.multipolygons([[polygon] for polygon in polygons])
    return Layer(AREAS, table, shapes)
