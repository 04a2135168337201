"""Pairs of neighbouring buildings from footprints."""

from collections.abc import Sequence
from pathlib import Path

import numpy as np
import pandas as pd
import pyproj
import shapely

from per_obspy import checks
from per_obspy.errors import CatalogError, Rejection
from per_obspy.inventory.checking import Rejections, checked_pairs
from per_obspy.inventory.contact_height import floor_offset
from per_obspy.inventory.footprints.importers import imported
from per_obspy.inventory.footprints.layers import Geometries, Layer, read_layer
from per_obspy.inventory.footprints.neighbours import Neighbours, neighbours
from per_obspy.inventory.schema import COLUMNS, POSITIONS
from per_obspy.inventory.table_columns import numbers_in

#: Share of the smaller footprint that may be covered by both: digitised party walls cross by
#: centimetres.
OVERLAP = 0.02

#: A local projection is true to scale within this range of longitudes, degrees.
WIDEST = 6.0


def pairs_from_footprints(
    path: str | Path, distance: float = 3.0, layer: str | None = None, gap_std: float = 0.0
) -> pd.DataFrame:
    """
    Find neighbouring buildings and what lies between them.

    Parameters
    ----------
    path : str or Path
        GeoPackage, GeoJSON, Shapefile, FlatGeobuf or GeoParquet of polygons with heights or
        storeys. Known column names stand in ``per_obspy.inventory.footprints.importers``.
    distance : float, optional
        Largest gap of a pair, m.
    layer : str, optional
        Name of the layer, for files that have several.
    gap_std : float, optional
        Standard deviation of the gaps that outlines as they were drawn leave, m; party walls stay
        without.

    Returns
    -------
    pairs : DataFrame
        A pair table by the schema: ``gap`` (exact distance of the polygons in a local projection, 0
        for party walls), ``azimuth`` (normal of the facing walls), ``facing_length``, ``position``,
        and where both heights are known ``contact_height`` and ``floor_offset``.
        ``pairs.attrs["rejected"]`` holds features without a usable polygon (kind "building") and
        pairs that are none (kind "pair"), such as overlaps beyond 2 % of the smaller footprint.

    Raises
    ------
    CatalogError
        If the file cannot be read, holds no polygons, spans more than 6 degrees of longitude, or
        has no neighbours.
    ValueError
        If the distance is not positive or larger than any gap may be, or the deviation is negative.
    """
    largest = checks.number("distance", distance, checks.positive)
    if largest > COLUMNS["gap"].high:
        raise ValueError(
            f"distance must not be above the largest gap, {COLUMNS['gap'].high:g} m, got {largest:g}"
        )
    drawn = checks.number("gap_std", gap_std, checks.not_negative)
    source = str(path)
    found = read_layer(path, layer)
    buildings = imported(found.attributes, source)
    unique, repeated = _without_repetitions(found, buildings, source)
    if len(unique.polygons) < 2:
        raise CatalogError(source, _too_few(len(unique.polygons), (*found.rejected, *repeated)))
    table = _table(unique, buildings.loc[unique.attributes.index], largest, source)
    pairs, overlapping = _without_overlaps(table, source)
    rejected = (*found.rejected, *repeated, *overlapping)
    if not pairs.empty:
        pairs = checked_pairs(pairs.assign(gap_std=np.where(pairs["gap"] > 0, drawn, 0.0)), source)
        rejected += tuple(one._replace(row=None) for one in pairs.attrs["rejected"])
        pairs = _with_floors(pairs)
    pairs.attrs["rejected"] = Rejections(rejected)
    return pairs


def _without_repetitions(
    found: Layer, buildings: pd.DataFrame, source: str
) -> tuple[Layer, tuple[Rejection, ...]]:
    """Return the layer without features that repeat an earlier polygon or identifier."""
    shapes = pd.Series(shapely.to_wkb(shapely.normalize(found.polygons)), index=buildings.index)
    identifiers = buildings["building_id"]
    same_shape, same_name = shapes.duplicated(), identifiers.duplicated()
    rejected = []
    for number in buildings.index[same_shape | same_name]:
        reasons = ["the polygon repeats an earlier one"] if same_shape[number] else []
        if same_name[number]:
            reasons.append(
                f"building_id = {identifiers[number]!r} stands in an earlier feature already"
            )
        rejected.append(
            Rejection("building", identifiers[number], source, int(number), tuple(reasons))
        )
    good = ~(same_shape | same_name).to_numpy()
    return Layer(found.polygons[good], found.attributes[good], ()), tuple(rejected)


def _too_few(usable: int, rejected: Sequence[Rejection]) -> str:
    """Return that there are too few footprints, and why the first of the others is none."""
    others = (
        f" ({len(rejected)} rejected, {rejected[0].name}: {'; '.join(rejected[0].reasons)})"
        if rejected
        else ""
    )
    return f"{usable} usable footprints make no pair{others}"


def _table(found: Layer, buildings: pd.DataFrame, distance: float, source: str) -> pd.DataFrame:
    metres, centre = _in_metres(found.polygons, source)
    near = neighbours(metres, distance)
    if near.first.size == 0:
        raise CatalogError(source, f"no two footprints lie within {distance:g} m")
    place = shapely.get_coordinates(shapely.centroid(found.polygons))
    # the projection's north turns away from true north with distance from its central meridian
    turned = (place[near.first, 0] - centre[0]) * np.sin(np.deg2rad(place[near.first, 1]))
    area = shapely.area(metres)
    columns = {
        "pair_id": _joined(buildings, near),
        "gap": near.gap,
        "azimuth": (near.azimuth + turned) % 360.0,
        "facing_length": near.facing_length,
        "position": np.where(near.inside, POSITIONS[1], POSITIONS[0]),
        "overlap": near.overlap / np.minimum(area[near.first], area[near.second]),
        "overlap_area": near.overlap,
    }
    for i, rows in ((1, near.first), (2, near.second)):
        columns |= {
            f"longitude_{i}": place[rows, 0],
            f"latitude_{i}": place[rows, 1],
            f"area_{i}": area[rows],
        }
        columns |= {f"{name}_{i}": buildings[name].to_numpy()[rows] for name in buildings}
    return _with_heights(pd.DataFrame(columns))


def _joined(buildings: pd.DataFrame, near: Neighbours) -> pd.Series:
    identifiers = buildings["building_id"].to_numpy(dtype=object)
    return pd.Series(identifiers[near.first] + "/" + identifiers[near.second])


def _in_metres(polygons: Geometries, source: str) -> tuple[Geometries, tuple[float, float]]:
    """Return the polygons in a transverse Mercator projection about their middle, and that middle in degrees."""
    west, south, east, north = shapely.total_bounds(polygons)
    if east - west > WIDEST:
        span = f"{west:g} to {east:g} degrees east"
        raise CatalogError(
            source,
            f"footprints from {span}: split the layer, a local projection covers {WIDEST:g} degrees",
        )
    centre = (west + east) / 2.0, (south + north) / 2.0
    local = pyproj.CRS.from_dict(
        {"proj": "tmerc", "lon_0": centre[0], "lat_0": centre[1], "datum": "WGS84"}
    )
    transformer = pyproj.Transformer.from_crs("OGC:CRS84", local, always_xy=True)
    metres = shapely.transform(polygons, lambda xy: np.column_stack(transformer.transform(*xy.T)))
    return np.asarray(metres), centre


def _with_heights(table: pd.DataFrame) -> pd.DataFrame:
    """Return the table with heights from storeys of a given height, where a height is missing."""
    for i in (1, 2):
        if f"storey_height_{i}" in table:
            unknown = pd.Series(np.nan, index=table.index)
            storeys = pd.to_numeric(table.get(f"storeys_{i}", unknown), errors="coerce")
            product = storeys * pd.to_numeric(table[f"storey_height_{i}"], errors="coerce")
            table[f"height_{i}"] = table.get(f"height_{i}", unknown).fillna(product)
            table = table.drop(columns=f"storey_height_{i}")
    return table


def _with_floors(pairs: pd.DataFrame) -> pd.DataFrame:
    """Return checked pairs with contact height and floor offset where heights and storeys of both are known."""
    names = ("height_1", "storeys_1", "height_2", "storeys_2")
    known = [numbers_in(pairs, name) for name in names]
    full = ~np.isnan(known).any(axis=0)
    offset = np.where(full, floor_offset(*np.where(full, known, 1.0)), np.nan)
    pairs = pairs.assign(contact_height=np.minimum(known[0], known[2]), floor_offset=offset)
    ours = [name for name in COLUMNS if name in pairs]
    return pairs[[*ours, *pairs.columns.difference(ours, sort=False)]]


def _without_overlaps(
    table: pd.DataFrame, source: str
) -> tuple[pd.DataFrame, tuple[Rejection, ...]]:
    bad = (table["overlap"] > OVERLAP).to_numpy()
    faults = zip(
        *(table.loc[bad, name] for name in ("pair_id", "overlap_area", "overlap")), strict=True
    )
    rejected = tuple(
        Rejection(
            "pair",
            pair,
            source,
            None,
            (f"footprints overlap by {area:.3g} m2, {share:.0%} of the smaller one",),
        )
        for pair, area, share in faults
    )
    return table[~bad].drop(columns=["overlap", "overlap_area"]).reset_index(drop=True), rejected
