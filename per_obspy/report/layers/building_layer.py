"""Buildings of a risk table as a layer: outlines where a file has them, points elsewhere."""

import json
from collections.abc import Iterator
from pathlib import Path

import numpy as np
import pandas as pd
import pyarrow.parquet as pq
import shapely

from per_obspy.report.layers.geopackage import Layer
from per_obspy.report.layers.shapes import Shapes, points
from per_obspy.tables.parts import batches, bounded_database, parquet_rows

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
    places = table["longitude"].to_numpy(float), table["latitude"].to_numpy(float)
    if not with_outlines:
        yield Layer(BUILDINGS, table, points(*places))
        return
    shapes = shapely.from_wkb(table.pop(_OUTLINE).to_numpy(dtype=object), on_invalid="ignore")
    # Buildings without a polygon are points
    drawn = np.isin(shapely.get_type_id(shapes), (3, 6))
    yield Layer(BUILDINGS, table[drawn], _multiple(shapes[drawn]))
    if not drawn.all():
        yield Layer(WITHOUT_OUTLINE, table[~drawn], points(*(values[~drawn] for values in places)))


def _multiple(shapes: Shapes) -> Shapes:
    """Return polygons as multipolygons: shapes of a layer are all of one type."""
    several = shapely.get_type_id(shapes) == shapely.GeometryType.MULTIPOLYGON
    found = shapes.copy()
    for position in np.flatnonzero(~several):
        found[position] = shapely.multipolygons([shapes[position]])
    return found
