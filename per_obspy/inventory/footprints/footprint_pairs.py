"""Pairs of neighbouring buildings from footprints, as a checked pair table."""

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import NamedTuple

import numpy as np
import pandas as pd

from per_obspy import checks
from per_obspy.checks import FloatArray
from per_obspy.errors import CatalogError, Rejection
from per_obspy.inventory.checking import Rejections
from per_obspy.inventory.footprints.building_columns import building_columns
from per_obspy.inventory.footprints.buildings import Buildings, projected, without_repetitions
from per_obspy.inventory.footprints.footprint_rows import NearBuildings, pair_names, pair_table
from per_obspy.inventory.footprints.layers import read_layer
from per_obspy.inventory.footprints.neighbours import neighbours
from per_obspy.inventory.schema import COLUMNS

#: Standard deviation of a gap between drawn outlines without a known one, m: 0.2 mm, about the
#: finest that a plan shows, at a scale of 1:500. It is assumed, not measured.
DRAWN = 0.1


class FootprintPairs(NamedTuple):
    """
    Pairs of neighbouring buildings, and all buildings with usable outlines.

    Attributes
    ----------
    pairs : DataFrame
        As :func:`pairs_from_footprints` returns them.
    buildings : Buildings
        To which pairs refer by ``building_id_1`` and ``building_id_2``.
    left_out : (n, 2) ndarray
        Longitude and latitude of the neighbours that are rejected, degrees.
    """

    pairs: pd.DataFrame
    buildings: Buildings
    left_out: FloatArray


def pairs_from_footprints(
    path: str | Path,
    distance: float = 3.0,
    layer: str | None = None,
    gap_std: float | None = None,
    columns: Mapping[str, str] | None = None,
) -> pd.DataFrame:
    """
    Find pairs of neighbouring buildings in footprints, with their gaps and axes.

    Parameters
    ----------
    path : str or Path
        GeoPackage, GeoJSON, Shapefile, FlatGeobuf or GeoParquet of polygons with heights or
        storeys, or a CSV list of buildings with outlines as WKT or with longitude, latitude, width,
        length and azimuth. Known column names are in
        ``per_obspy/inventory/footprints/sources.toml``; lengths may have units (``6 m``, ``20 ft``).
    distance : float, optional
        Largest gap of a pair, m.
    layer : str, optional
        Name of the layer, for files that have several.
    gap_std : float, optional
        Standard deviation of the gaps between drawn outlines, m, touching ones too; 0 where
        outlines are exact. If not given, 0.1 m is assumed and marked in ``gap_std_source``.
    columns : mapping of str to str, optional
        Name of a building's quantity in the schema -> the layer's column, such as ``{"height":
        "altura"}``, where names are not recognised.

    Returns
    -------
    pairs : DataFrame
        A pair table by the schema: ``gap`` (exact distance of the polygons in a local projection, 0
        for party walls) with ``gap_std`` and ``gap_std_source``, ``azimuth`` (normal of the facing
        walls), ``facing_length``, ``position`` of the pair and ``position_1``, ``position_2`` of
        its buildings, where both heights are known ``contact_height`` and ``floor_offset``, and
        every other column of the layer for both buildings, with ``_1`` and ``_2``. A column whose
        name is needed otherwise begins with ``layer_``. ``pairs.attrs["rejected"]`` has
        the features without a usable polygon (kind "building") and the unusable pairs (kind
        "pair"), such as overlaps beyond 2 % of the smaller footprint.

    Raises
    ------
    CatalogError
        If the file cannot be read, has no polygons or lacks a named column, spans more than 6
        degrees of longitude, or has no neighbours.
    ValueError
        If the distance is not positive or larger than any gap may be, or the deviation is negative
        or larger than the schema allows.
    """
    return find_footprint_pairs(path, distance, layer, gap_std, columns).pairs


def find_footprint_pairs(
    path: str | Path,
    distance: float = 3.0,
    layer: str | None = None,
    gap_std: float | None = None,
    columns: Mapping[str, str] | None = None,
) -> FootprintPairs:
    """Find pairs as :func:`pairs_from_footprints` does, and keep the buildings."""
    largest = _checked_length("distance", distance, "gap")
    deviation = DRAWN if gap_std is None else _checked_length("gap_std", gap_std, "gap_std")
    drawn = {"gap_std": deviation, "gap_std_source": "assumed" if gap_std is None else "given"}
    # Footprints, without those that repeat another
    source = str(path)
    buildings, rejected = _usable_buildings(Path(path), layer, columns or {})
    shapes = projected(buildings.outlines, source)
    longitude, latitude = shapes.place.T
    table = buildings.table.assign(longitude=longitude, latitude=latitude, area=shapes.area)
    # Pairs, checked as if they came from a file
    near = neighbours(shapes.outlines, largest)
    if near.first.size == 0:
        raise CatalogError(source, f"no two footprints lie within {largest:g} m")
    found = NearBuildings(near, table, drawn, shapes.central_meridian)
    pairs = pair_table(found, source)
    middle = _middle(found, pairs.attrs["rejected"])
    pairs.attrs["rejected"] = Rejections(rejected + pairs.attrs["rejected"])
    return FootprintPairs(pairs, Buildings(buildings.outlines, table), middle)


def _middle(found: NearBuildings, rejected: Sequence[Rejection]) -> FloatArray:
    """Return longitude and latitude amid both buildings of rejected pairs, degrees."""
    names = {rejection.name for rejection in rejected}
    chosen = pair_names(found).isin(names).to_numpy()
    places = found.buildings[["longitude", "latitude"]].to_numpy()
    first, second = places[found.near.first[chosen]], places[found.near.second[chosen]]
    return np.asarray(0.5 * (first + second))


def _usable_buildings(
    file: Path, layer: str | None, columns: Mapping[str, str]
) -> tuple[Buildings, tuple[Rejection, ...]]:
    """Return the buildings of a layer, and the features that are none."""
    # Columns under the names of the schema, and outlines that are no second one
    outlines, attributes, lost = read_layer(file, layer)
    table = building_columns(attributes, columns, str(file))
    buildings, repeated = without_repetitions(outlines, table, str(file))
    rejected = (*lost, *repeated)
    if len(buildings.outlines) < 2:
        raise CatalogError(str(file), _too_few(len(buildings.outlines), rejected))
    return buildings, rejected


def _checked_length(name: str, value: float, column: str) -> float:
    """Return a length, m, if it is in the range of a column."""
    if column == name:
        length = checks.number(name, value, checks.not_negative)
    else:
        length = checks.number(name, value, checks.positive)
    limit = COLUMNS[column].high
    if length > limit:
        raise ValueError(
            f"{name} must not be above the largest {column}, {limit:g} m, got {length:g}"
        )
    return length


def _too_few(usable: int, rejected: Sequence[Rejection]) -> str:
    """Return the message for too few footprints, with the reasons of the first rejected one."""
    problem = f"{usable} usable footprints make no pair"
    if not rejected:
        return problem
    reasons = "; ".join(rejected[0].reasons)
    return f"{problem} ({len(rejected)} rejected, {rejected[0].name}: {reasons})"
