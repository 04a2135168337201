"""Pairs of neighbouring buildings from footprints, as a checked pair table."""

from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd
import pyproj
import shapely

from per_obspy import checks
from per_obspy.checks import FloatArray
from per_obspy.errors import CatalogError, Rejection
from per_obspy.inventory.checking import Rejections, checked_pairs, plain_numbers
from per_obspy.inventory.contact_height import floor_offset
from per_obspy.inventory.footprints.layers import Geometries, Layer, read_layer
from per_obspy.inventory.footprints.neighbours import IntArray, Neighbours, neighbours
from per_obspy.inventory.importers.recognition import imported
from per_obspy.inventory.schema import COLUMNS, POSITIONS
from per_obspy.inventory.table_columns import numbers_in

#: Share of the smaller footprint that may be covered by both: digitised party walls cross by
#: centimetres.
OVERLAP = 0.02

#: A local projection is true to scale within this range of longitudes, degrees.
WIDEST_LAYER = 6.0


def pairs_from_footprints(
    path: str | Path, distance: float = 3.0, layer: str | None = None, gap_std: float = 0.0
) -> pd.DataFrame:
    """
    Find pairs of neighbouring buildings in footprints, with their gaps and axes.

    Parameters
    ----------
    path : str or Path
        GeoPackage, GeoJSON, Shapefile, FlatGeobuf or GeoParquet of polygons with heights or
        storeys. Known sources are in ``per_obspy.inventory.importers``.
    distance : float, optional
        Largest gap of a pair, m.
    layer : str, optional
        Name of the layer, for files that have several.
    gap_std : float, optional
        Standard deviation of the gaps between drawn outlines, m; 0 for party walls.

    Returns
    -------
    pairs : DataFrame
        A pair table by the schema: ``gap`` (exact distance of the polygons in a local projection, 0
        for party walls), ``azimuth`` (normal of the facing walls), ``facing_length``, ``position``,
        and where both heights are known ``contact_height`` and ``floor_offset``.
        ``pairs.attrs["rejected"]`` has the features without a usable polygon (kind "building") and
        the unusable pairs (kind "pair"), such as overlaps beyond 2 % of the smaller footprint.

    Raises
    ------
    CatalogError
        If the file cannot be read, has no polygons, spans more than 6 degrees of longitude, or
        has no neighbours.
    ValueError
        If the distance is not positive or larger than any gap may be, or the deviation is negative.
    """
    largest, drawn = _checked_lengths(distance, gap_std)
    # Footprints, without those that repeat another
    source = str(path)
    layer_found = read_layer(path, layer)
    buildings = imported(layer_found.attributes, source)
    unique, repeated = _without_repetitions(layer_found, buildings, source)
    rejected = (*layer_found.rejected, *repeated)
    if len(unique.polygons) < 2:
        raise CatalogError(source, _too_few(len(unique.polygons), rejected))
    # Pairs, checked as if they came from a file
    table = _pair_table(unique, buildings.loc[unique.attributes.index], largest, source)
    pairs, overlapping = _without_overlaps(table, source)
    rejected += overlapping
    if not pairs.empty:
        pairs = checked_pairs(pairs.assign(gap_std=np.where(pairs["gap"] > 0, drawn, 0.0)), source)
        rejected += tuple(row._replace(row=None) for row in pairs.attrs["rejected"])
        pairs = _with_contact(pairs)
    pairs.attrs["rejected"] = Rejections(rejected)
    return pairs


def _checked_lengths(distance: float, gap_std: float) -> tuple[float, float]:
    """Return the largest gap and the standard deviation of gaps, m, if they are in range."""
    largest = checks.number("distance", distance, checks.positive)
    limit = COLUMNS["gap"].high
    if largest > limit:
        raise ValueError(
            f"distance must not be above the largest gap, {limit:g} m, got {largest:g}"
        )
    return largest, checks.number("gap_std", gap_std, checks.not_negative)


def _without_repetitions(
    layer: Layer, buildings: pd.DataFrame, source: str
) -> tuple[Layer, tuple[Rejection, ...]]:
    """Return the layer without features that repeat an earlier polygon or identifier."""
    shapes = pd.Series(shapely.to_wkb(shapely.normalize(layer.polygons)), index=buildings.index)
    identifiers = buildings["building_id"]
    same_shape, same_name = shapes.duplicated(), identifiers.duplicated()
    # Each repetition with its reasons
    rejected = []
    for number in buildings.index[same_shape | same_name]:
        name = identifiers[number]
        reasons = []
        if same_shape[number]:
            reasons.append("the polygon repeats an earlier one")
        if same_name[number]:
            reasons.append(f"building_id = {name!r} stands in an earlier feature already")
        rejected.append(Rejection("building", name, source, int(number), tuple(reasons)))
    good = ~(same_shape | same_name).to_numpy()
    return Layer(layer.polygons[good], layer.attributes[good], ()), tuple(rejected)


def _too_few(usable: int, rejected: Sequence[Rejection]) -> str:
    """Return the message for too few footprints, with the reasons of the first rejected one."""
    problem = f"{usable} usable footprints make no pair"
    if not rejected:
        return problem
    reasons = "; ".join(rejected[0].reasons)
    return f"{problem} ({len(rejected)} rejected, {rejected[0].name}: {reasons})"


def _pair_table(
    layer: Layer, buildings: pd.DataFrame, distance: float, source: str
) -> pd.DataFrame:
    """Return one row per pair of footprints within a distance, m, before any check."""
    metres, (central_meridian, _) = _in_metres(layer.polygons, source)
    near = neighbours(metres, distance)
    if near.first.size == 0:
        raise CatalogError(source, f"no two footprints lie within {distance:g} m")
    place = shapely.get_coordinates(shapely.centroid(layer.polygons))
    area = shapely.area(metres)
    # The pair
    columns = {
        "pair_id": _joined(buildings, near),
        "gap": near.gap,
        "azimuth": _true_azimuth(near, place, central_meridian),
        "facing_length": near.facing_length,
        "position": np.where(near.inside, POSITIONS[1], POSITIONS[0]),
        "overlap": near.overlap / np.minimum(area[near.first], area[near.second]),
        "overlap_area": near.overlap,
    }
    # Its buildings
    located = buildings.assign(longitude=place[:, 0], latitude=place[:, 1], area=area)
    columns |= _building_columns(located, near.first, 1)
    columns |= _building_columns(located, near.second, 2)
    return _with_heights(pd.DataFrame(columns))


def _building_columns(buildings: pd.DataFrame, rows: IntArray, i: int) -> dict[str, Any]:
    """Return the columns of building i of each pair: position and area first, then attributes."""
    names = ["longitude", "latitude", "area"]
    names += [str(name) for name in buildings if name not in names]
    return {f"{name}_{i}": buildings[name].to_numpy()[rows] for name in names}


def _true_azimuth(near: Neighbours, place: FloatArray, central_meridian: float) -> FloatArray:
    """Return azimuths from true north, degrees: a projection's north turns with the longitude."""
    longitude, latitude = place[near.first].T
    convergence = (longitude - central_meridian) * np.sin(np.deg2rad(latitude))
    return np.asarray((near.azimuth + convergence) % 360.0)


def _joined(buildings: pd.DataFrame, near: Neighbours) -> pd.Series:
    """Return identifiers of pairs from those of the buildings."""
    identifiers = buildings["building_id"].to_numpy(dtype=object)
    return pd.Series(identifiers[near.first] + "/" + identifiers[near.second])


def _in_metres(polygons: Geometries, source: str) -> tuple[Geometries, tuple[float, float]]:
    """Return the polygons in a transverse Mercator projection, and its centre in degrees."""
    west, south, east, north = shapely.total_bounds(polygons)
    if east - west > WIDEST_LAYER:
        raise CatalogError(
            source,
            f"footprints from {west:g} to {east:g} degrees east: split the layer, "
            f"a local projection covers {WIDEST_LAYER:g} degrees",
        )
    # Projection about the middle of the layer
    longitude, latitude = (west + east) / 2.0, (south + north) / 2.0
    local = pyproj.CRS.from_dict(
        {"proj": "tmerc", "lon_0": longitude, "lat_0": latitude, "datum": "WGS84"}
    )
    transformer = pyproj.Transformer.from_crs("OGC:CRS84", local, always_xy=True)
    metres = shapely.transform(polygons, lambda xy: np.column_stack(transformer.transform(*xy.T)))
    return np.asarray(metres), (longitude, latitude)


def _with_heights(table: pd.DataFrame) -> pd.DataFrame:
    """Return the table with missing heights from storeys and their given height."""
    unknown = pd.Series(np.nan, index=table.index)
    for i in (1, 2):
        if f"storey_height_{i}" in table:
            # Text that is no number is left to the checks
            storeys = plain_numbers(table.get(f"storeys_{i}", unknown))
            storey_height = plain_numbers(table[f"storey_height_{i}"])
            height = table.get(f"height_{i}", unknown)
            table[f"height_{i}"] = height.fillna(storeys * storey_height)
            table = table.drop(columns=f"storey_height_{i}")
    return table


def _with_contact(pairs: pd.DataFrame) -> pd.DataFrame:
    """Return checked pairs with contact height and floor offset where both buildings allow it."""
    names = ("height_1", "storeys_1", "height_2", "storeys_2")
    sizes = [numbers_in(pairs, name) for name in names]
    # Floors are known where heights and storeys of both are; 1 is a placeholder elsewhere
    is_known = ~np.isnan(sizes).any(axis=0)
    offset = np.where(is_known, floor_offset(*np.where(is_known, sizes, 1.0)), np.nan)
    pairs = pairs.assign(contact_height=np.minimum(sizes[0], sizes[2]), floor_offset=offset)
    # Columns of the schema first, in its order
    known = [name for name in COLUMNS if name in pairs]
    return pairs[[*known, *pairs.columns.difference(known, sort=False)]]


def _without_overlaps(
    table: pd.DataFrame, source: str
) -> tuple[pd.DataFrame, tuple[Rejection, ...]]:
    """Return the pairs whose footprints do not overlap, and a rejection for each other one."""
    overlaps = (table["overlap"] > OVERLAP).to_numpy()
    # Reasons with area and share
    rejected = []
    columns = table.loc[overlaps, ["pair_id", "overlap_area", "overlap"]]
    for pair, area, share in columns.itertuples(index=False, name=None):
        reason = f"footprints overlap by {area:.3g} m2, {share:.0%} of the smaller one"
        rejected.append(Rejection("pair", pair, source, None, (reason,)))
    clear = table[~overlaps].drop(columns=["overlap", "overlap_area"]).reset_index(drop=True)
    return clear, tuple(rejected)
