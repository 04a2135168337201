"""
Pairs of neighbouring buildings from footprints, as a checked pair table, and their buildings.

Rows of the table are made and checked block by block, to bound memory. Buildings are written into a
file that goes with the pairs, which refer to it by ``building_id_1`` and ``building_id_2``.
"""

from collections.abc import Mapping
from pathlib import Path
from typing import NamedTuple

import numpy as np
import pandas as pd
import pyarrow as pa
import pyarrow.parquet
import pyproj
import shapely
from numpy.typing import NDArray

from per_obspy import checks
from per_obspy.checks import FloatArray
from per_obspy.errors import CatalogError, Rejection
from per_obspy.files import written_whole
from per_obspy.inventory.cells import NOTES
from per_obspy.inventory.checking import Rejections, checked_pairs
from per_obspy.inventory.contact_height import floor_offset
from per_obspy.inventory.footprints.building_columns import building_columns
from per_obspy.inventory.footprints.layer_files import Box
from per_obspy.inventory.footprints.layers import BLOCK, blocks, polygons, read_layer, transformed
from per_obspy.inventory.footprints.neighbours import IntArray, Outlines, neighbours
from per_obspy.inventory.footprints.raster_heights import raster_heights
from per_obspy.inventory.footprints.raw_layer import GEOMETRY, Geometries, geo_metadata
from per_obspy.inventory.footprints.sources import LEARNED, ORIGINS, OUTLINE_SOURCE, source_of
from per_obspy.inventory.schema import COLUMNS, POSITIONS
from per_obspy.inventory.table_columns import numbers_in

#: Share of the smaller footprint that may be covered by both: digitised party walls cross by
#: centimetres.
OVERLAP = 0.02

#: Pairs per block, to bound memory.
CHUNK = 50_000

#: Columns that help to make the row of a pair.
_HELPERS = ["first", "second", "overlap", "inside_1", "inside_2", "repeated"]

#: Columns that every building has besides those of its layer.
_PLACE = ["longitude", "latitude", "area"]


#: A local projection is true to scale within this range of longitudes, degrees.
WIDEST_LAYER = 6.0


class Buildings(NamedTuple):
    """
    Buildings with usable outlines.

    Attributes
    ----------
    outlines : pa.Array
        WKB in degrees (WGS 84).
    table : DataFrame
        One row per outline: ``building_id``, ``longitude``, ``latitude`` (degrees), ``area`` (m2),
        columns of the schema, all others.
    """

    outlines: pa.Array
    table: pd.DataFrame


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

    @property
    def restricted(self) -> list[str]:
        """Name and licence of the source of the buildings, if it forbids commercial use."""
        source = source_of(map(str, self.buildings.table.columns))
        return [f"{source.name} ({source.licence})"] if source.licence else []


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
        length and azimuth. Known column names are in ``sources.toml`` next to this module;
        lengths may have units (``6 m``, ``20 ft``).
    distance : float, optional
        Largest gap of a pair, m.
    layer : str, optional
        Name of the layer, for files that have several.
    gap_std : float, optional
        Standard deviation of the gaps between drawn outlines, m, touching ones too; 0 where
        outlines are exact. If not given, it is assumed by the origin of both outlines, and marked
        in ``gap_std_source``.
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
    bbox: Box | None = None,
    heights: Path | None = None,
) -> FootprintPairs:
    """
    Find pairs as :func:`pairs_from_footprints` does, and keep the buildings.

    With ``bbox`` (west, south, east, north, degrees) only buildings that touch it are read. Missing
    heights are taken from a raster ``heights``, see :func:`.raster_heights.raster_heights`.
    """
    largest = checks.number("distance", distance, checks.positive)
    _require_within("distance", largest, "gap")
    if gap_std is not None:
        gap_std = checks.number("gap_std", gap_std, checks.not_negative)
        _require_within("gap_std", gap_std, "gap_std")
    # Footprints, without those that repeat another
    source = str(path)
    buildings, rejected = _usable_buildings(path, layer, columns or {}, bbox, heights)
    buildings, outlines = projected(buildings, source)
    pairs = neighbours(outlines, largest)
    if pairs.empty:
        raise CatalogError(source, f"no two footprints lie within {largest:g} m")
    pairs = _with_names(pairs, buildings.table, outlines.meridian)
    # Pairs, checked as if they came from a file
    table, unusable = _checked_table(pairs, buildings.table, gap_std, source)
    table.attrs["rejected"] = Rejections((*rejected, *unusable))
    return FootprintPairs(table, buildings, _middle(pairs, buildings.table, unusable))


def _middle(pairs: pd.DataFrame, buildings: pd.DataFrame, rejected: list[Rejection]) -> FloatArray:
    """Return longitude and latitude amid both buildings of rejected pairs, degrees, (n, 2)."""
    lost = pairs[pairs["pair_id"].isin({rejection.name for rejection in rejected})]
    places = buildings[["longitude", "latitude"]].to_numpy()
    return np.asarray(0.5 * (places[lost["first"]] + places[lost["second"]]))


def _require_within(name: str, length: float, column: str) -> None:
    """Raise ValueError if a length, m, is above the range of a column."""
    limit = COLUMNS[column].high
    if length > limit:
        problem = f"must not be above the largest {column}, {limit:g} m, got {length:g}"
        raise ValueError(f"{name} {problem}")


def _usable_buildings(
    path: str | Path,
    layer: str | None,
    columns: Mapping[str, str],
    box: Box | None,
    raster: Path | None,
) -> tuple[Buildings, tuple[Rejection, ...]]:
    """Return the buildings of a layer under the names of the schema, and features that are none."""
    outlines, attributes, lost = read_layer(path, layer, box)
    heights = None if raster is None else raster_heights(raster, outlines)
    table = building_columns(attributes, columns, str(path), heights)
    buildings, repeated = without_repetitions(outlines, table, str(path))
    rejected, usable = (*lost, *repeated), len(buildings.outlines)
    if usable < 2:
        problem = f"{usable} usable footprints make no pair"
        # With the reasons of the first rejected one
        for first in rejected[:1]:
            reasons = "; ".join(first.reasons)
            problem += f" ({len(rejected)} rejected, {first.name}: {reasons})"
        raise CatalogError(str(path), problem)
    return buildings, rejected


def _with_names(pairs: pd.DataFrame, buildings: pd.DataFrame, meridian: float) -> pd.DataFrame:
    """Return neighbours with the names of the pairs and azimuths from true north."""
    identifiers = buildings["building_id"].to_numpy(dtype=object)
    names = pd.Series(identifiers[pairs["first"]] + "/" + identifiers[pairs["second"]])
    # A projection's north turns with the longitude
    longitude, latitude = (buildings[name].to_numpy() for name in ("longitude", "latitude"))
    east = longitude[pairs["first"]] - meridian
    east -= 360.0 * np.round(east / 360.0)
    convergence = east * np.sin(np.deg2rad(latitude[pairs["first"]]))
    azimuth = (pairs["azimuth"] + convergence) % 360.0
    return pairs.assign(azimuth=azimuth, pair_id=names, repeated=names.duplicated())


def _checked_table(
    pairs: pd.DataFrame, buildings: pd.DataFrame, gap_std: float | None, source: str
) -> tuple[pd.DataFrame, list[Rejection]]:
    """Return the pair table, and a rejection for each pair that cannot be used."""
    columns, rejected = dict[str, list[pd.Series]](), list[Rejection]()
    for start in range(0, len(pairs), CHUNK):
        part = _with_positions(pairs.iloc[start : start + CHUNK])
        part = _with_buildings(part, buildings)
        checked = _checked_block(_with_deviation(part, gap_std), source, rejected)
        for name, column in checked.items():
            columns.setdefault(str(name), []).append(column.copy())
    # Joined column by column, so that no second copy of the whole table is in memory
    joined = {name: pd.concat(columns.pop(name), ignore_index=True) for name in list(columns)}
    return pd.DataFrame(joined, copy=False), rejected


def _with_positions(pairs: pd.DataFrame) -> pd.DataFrame:
    """Return pairs with the words for their place, and that of both buildings, in a row."""
    inside_1, inside_2 = pairs["inside_1"], pairs["inside_2"]
    inside = {"position": inside_1 & inside_2, "position_1": inside_1, "position_2": inside_2}
    words = dict(zip((False, True), POSITIONS, strict=True))
    return pairs.assign(**{name: each.map(words) for name, each in inside.items()})


def _with_deviation(pairs: pd.DataFrame, gap_std: float | None) -> pd.DataFrame:
    """
    Return pairs with the deviation of their gaps: the given one, or that of the outlines.

    Outlines that touch have that of drawn ones, whatever their origin: a wider error would make
    their contact less likely, for which there is no evidence.
    """
    word = "assumed" if gap_std is None else "given"
    # Of two origins the less accurate one counts
    # A gap of 0 stays as it is drawn
    touching, drawn = pairs["gap"] == 0.0, ORIGINS["drawn"].gap_std
    deviation = np.full(len(pairs), drawn)
    learned = np.zeros(len(pairs), dtype=bool)
    for i in (1, 2):
        if f"{OUTLINE_SOURCE}_{i}" in pairs:
            origin = pairs[f"{OUTLINE_SOURCE}_{i}"]
            own = origin.map({name: each.gap_std for name, each in ORIGINS.items()})
            deviation, learned = np.maximum(deviation, own), learned | origin.isin(LEARNED)
    return pairs.assign(
        gap_std=np.where(touching, drawn, deviation) if gap_std is None else gap_std,
        gap_std_source=np.where(learned, "learned", word),
    )


def _checked_block(part: pd.DataFrame, source: str, rejected: list[Rejection]) -> pd.DataFrame:
    """Return the usable pairs of a block, and add the rejections of the others to a list."""
    # One reason at most
    share = part["overlap"] / part[["area_1", "area_2"]].min(axis=1)
    overlaps = share[share > OVERLAP]
    for row in overlaps.index:
        area, name = part.loc[row, "overlap"], str(part.loc[row, "pair_id"])
        reason = f"footprints overlap by {area:.3g} m2, {share[row]:.0%} of the smaller one"
        rejected.append(Rejection("pair", name, source, None, (reason,)))
    clear = part.drop(index=overlaps.index).reset_index(drop=True)
    repeated, lines = clear["repeated"].to_numpy(), np.arange(2, len(clear) + 2)
    # Pairs have no line in the file
    checked = checked_pairs(clear.drop(columns=_HELPERS), source, lines, repeated)
    rejected += [row._replace(row=None) for row in checked.attrs["rejected"]]
    checked.attrs = {}
    return _with_contact(checked)


def _with_buildings(pairs: pd.DataFrame, buildings: pd.DataFrame) -> pd.DataFrame:
    """Return some pairs with the columns of both buildings, before any check."""
    names = [*_PLACE, *buildings.columns.drop(_PLACE)]
    sides = [pairs.reset_index(drop=True)]
    for i, side in ((1, "first"), (2, "second")):
        chosen = _with_height(buildings.iloc[pairs[side]][names].reset_index(drop=True))
        # Columns of a pair, in notes too, have the number of the building
        if NOTES in chosen:
            notes, word = chosen[NOTES].fillna("").astype(str), r"(^|; )(\w+) = "
            chosen[NOTES] = notes.str.replace(word, rf"\g<1>\g<2>_{i} = ", regex=True)
        sides.append(chosen.add_suffix(f"_{i}"))
    table = pd.concat(sides, axis=1)
    # The notes on both buildings are those on the pair
    if NOTES in buildings:
        both = table.pop(f"{NOTES}_1") + "; " + table.pop(f"{NOTES}_2")
        table[NOTES] = both.str.strip("; ")
    return table


def _with_height(buildings: pd.DataFrame) -> pd.DataFrame:
    """Return buildings with missing heights from storeys and their given height."""
    if "storey_height" not in buildings:
        return buildings
    unknown = pd.Series(np.nan, index=buildings.index)
    storeys, height = (buildings.get(name, unknown) for name in ("storeys", "height"))
    by_storeys = storeys * buildings["storey_height"]
    return buildings.drop(columns="storey_height").assign(height=height.fillna(by_storeys))


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


def without_repetitions(
    outlines: pa.Array, table: pd.DataFrame, source: str
) -> tuple[Buildings, tuple[Rejection, ...]]:
    """
    Return buildings without those that repeat an earlier outline or ``building_id``.

    Outlines are WKB in degrees; the index of the table is the number of the feature.
    """
    identifiers = table["building_id"]
    same_shape, same_name = _repeated(outlines), identifiers.duplicated().to_numpy()
    repeats = same_shape | same_name
    # Each repetition with its reasons
    rejected = []
    for i in np.flatnonzero(repeats).tolist():
        name, number = identifiers.iloc[i], int(table.index[i])
        shape = ["the polygon repeats an earlier one"] * int(same_shape[i])
        again = [f"building_id = {name!r} occurs in an earlier feature already"] * int(same_name[i])
        rejected.append(Rejection("building", name, source, number, (*shape, *again)))
    if rejected:
        outlines, table = outlines.filter(pa.array(~repeats)), table[~repeats]
    return Buildings(outlines, table), tuple(rejected)


def _repeated(outlines: pa.Array) -> NDArray[np.bool_]:
    """Return where an outline repeats an earlier one, whatever the order of its points."""
    hashes = [np.empty(0, dtype=np.uint64)]
    for _, shapes in blocks(outlines):
        normal = shapely.to_wkb(shapely.normalize(shapes))
        hashes.append(pd.util.hash_array(normal, categorize=False))
    # A hash may be shared by chance: the outlines themselves decide
    shared = np.flatnonzero(pd.Series(np.concatenate(hashes)).duplicated(keep=False))
    shapes = shapely.to_wkb(shapely.normalize(polygons(outlines.take(pa.array(shared)))))
    repeated = np.zeros(len(outlines), dtype=bool)
    repeated[shared] = pd.Series(shapes, dtype=object).duplicated()
    return repeated


def projected(buildings: Buildings, source: str) -> tuple[Buildings, Outlines]:
    """
    Return buildings with their places, degrees, and areas, m2, and their outlines in metres.

    Raises
    ------
    CatalogError
        If they span more than 6 degrees of longitude.
    """
    outlines = buildings.outlines
    # Places in degrees, and the region for which the projection is to be
    place, boxes = [], []
    for _, degrees in blocks(outlines):
        place.append(shapely.get_coordinates(shapely.centroid(degrees)))
        boxes.append(shapely.bounds(degrees))
    transformer, meridian = _projection(np.concatenate(boxes), source)
    # Boxes and areas in metres
    bounds, area = [], []
    for _, degrees in blocks(outlines):
        metres = transformed(degrees, transformer)
        bounds.append(shapely.bounds(metres))
        area.append(shapely.area(metres))

    def in_metres(numbers: IntArray) -> Geometries:
        return transformed(polygons(outlines.take(pa.array(numbers))), transformer)

    # Outlines may go on beyond 180 degrees, places do not
    longitude, latitude = np.concatenate(place).T
    table = buildings.table.assign(
        longitude=np.where(longitude > 180.0, longitude - 360.0, longitude),
        latitude=latitude,
        area=np.concatenate(area),
    )
    return Buildings(outlines, table), Outlines(np.concatenate(bounds), in_metres, meridian)


def _projection(boxes: FloatArray, source: str) -> tuple[pyproj.Transformer, float]:
    """Return a transverse Mercator projection about the middle of boxes, and its meridian."""
    # Around all boxes; across 180 degrees those to the west of it go on beyond it
    if np.ptp(boxes[:, ::2]) > 180.0:
        beyond = boxes[:, 2] < 0.0
        boxes = np.where(beyond[:, None] & [True, False, True, False], boxes + 360.0, boxes)
    west, south = boxes[:, :2].min(axis=0)
    east, north = boxes[:, 2:].max(axis=0)
    if east - west > WIDEST_LAYER:
        raise CatalogError(
            source,
            f"footprints from {west:g} to {east:g} degrees east: split the layer, "
            f"a local projection covers {WIDEST_LAYER:g} degrees",
        )
    # True to scale along the meridian in their middle
    longitude, latitude = float(west + east) / 2.0, float(south + north) / 2.0
    local = pyproj.CRS.from_dict(
        {"proj": "tmerc", "lon_0": longitude, "lat_0": latitude, "datum": "WGS84"}
    )
    return pyproj.Transformer.from_crs("OGC:CRS84", local, always_xy=True), longitude


def write_buildings(buildings: Buildings, path: Path) -> None:
    """
    Write buildings as GeoParquet, whole or not at all.

    Outlines are the column ``geometry``, longitude and latitude in degrees.
    """
    table = pa.Table.from_pandas(buildings.table, preserve_index=False)
    outlines = buildings.outlines.cast(pa.binary())
    table = table.append_column(GEOMETRY, outlines)
    with written_whole(path) as part:
        described = table.replace_schema_metadata(geo_metadata(["Polygon", "MultiPolygon"]))
        pa.parquet.write_table(described, part, row_group_size=5 * BLOCK)
