"""
One surveyed quarter written in the format of every source gives the same pairs.

Covers per_obspy.inventory.importers.sources.own_names,
per_obspy.inventory.importers.sources.seismic_building_exposure and the tables of all other sources.
"""

import numpy as np
import pandas as pd
import pyogrio
import pytest
import shapely
from building_samples import OUTLINES, Town

from per_obspy.inventory.footprints.footprint_pairs import pairs_from_footprints

#: Largest change of a gap, m. OSM XML has seven decimals of a degree: a corner moves by up to
#: 5.6 mm in each direction, two walls by 16 mm. All other formats keep every digit.
ROUNDED = {"osm_xml": 0.016}
EXACT = 1e-9


@pytest.fixture(scope="module")
def quarter(real_data, tmp_path_factory):
    """Return surveyed buildings of known height, their pairs by the survey and by own names."""
    folder = real_data / "inventories" / "footprints"
    path = folder / "san_jose_pilot_region_all_fields.gpkg"
    meta, _, geometries, fields = pyogrio.raw.read(path)
    outlines = shapely.force_2d(shapely.from_wkb(geometries))
    columns = dict(zip(meta["fields"], fields, strict=True))
    heights = np.asarray(columns["height"], dtype=float)
    # Missing heights are estimated for some sources; the sample of OSM XML has no holes and parts
    polygons = shapely.get_geometry(outlines, 0)
    is_plain = shapely.get_num_interior_rings(polygons) == 0
    is_plain &= shapely.get_num_geometries(outlines) == 1
    known = np.isfinite(heights) & shapely.is_valid(outlines) & is_plain
    # Names that occur twice reject the second building in the survey's own file
    pairs = pairs_from_footprints(path)
    known[[row.row - 1 for row in pairs.attrs["rejected"] if row.kind == "building"]] = False
    storeys = np.asarray(columns["n_storeys"], dtype=float)[known].astype(int).tolist()
    names = [f"b{number}" for number in np.flatnonzero(known)]
    town = Town(outlines[known], names, heights[known].tolist(), storeys)
    surveyed = _by_building(town, pairs)
    plain = tmp_path_factory.mktemp("quarter") / "plain.gpkg"
    pyogrio.raw.write(
        plain,
        geometry=shapely.to_wkb(town.outlines),
        field_data=[np.array(town.names, dtype=object), np.array(town.heights)],
        fields=["building_id", "height"],
        geometry_type=town.outlines[0].geom_type,
        crs="EPSG:4326",
    )
    own = _by_building(town, pairs_from_footprints(plain))
    return town, surveyed.dropna(subset=["height_1", "height_2"]), own


def _by_building(town: Town, pairs: pd.DataFrame) -> pd.DataFrame:
    """Return pairs of the town's buildings, by the two positions in the town."""
    tree = shapely.STRtree(shapely.centroid(town.outlines))
    keys, near = [], np.ones(len(pairs), dtype=bool)
    for i in (1, 2):
        places = shapely.points(pairs[f"longitude_{i}"], pairs[f"latitude_{i}"])
        # a centimetre is 1e-7 degrees
        found, distance = tree.query_nearest(places, return_distance=True, all_matches=False)
        keys.append(found[1])
        near &= distance < 2e-7
    return pairs.set_index(pd.MultiIndex.from_arrays(keys)).loc[near]


@pytest.mark.real_data
@pytest.mark.parametrize("name", OUTLINES)
def test_every_format_gives_the_same_pairs(tmp_path, quarter, name):
    town, surveyed, own = quarter
    written = _by_building(town, pairs_from_footprints(OUTLINES[name][1](tmp_path, town)))
    assert len(surveyed) > 600
    assert set(written.index) == set(surveyed.index)
    pairs = written.loc[surveyed.index]
    assert pairs["gap"].to_numpy() == pytest.approx(
        surveyed["gap"].to_numpy(), abs=ROUNDED.get(name, EXACT)
    )
    for i in (1, 2):
        if f"height_{i}" in pairs:
            assert pairs[f"height_{i}"].to_numpy() == pytest.approx(
                surveyed[f"height_{i}"].to_numpy(), rel=1e-9
            )
        if f"storeys_{i}" in pairs:
            assert pairs[f"storeys_{i}"].tolist() == surveyed[f"storeys_{i}"].tolist()
    # Directions and lengths of walls of a few centimetres change with a rounded corner, and with
    # the middle of the projection, which further buildings of the survey move
    if name not in ROUNDED:
        same = own.loc[surveyed.index]
        for column in ("azimuth", "facing_length"):
            assert pairs[column].to_numpy() == pytest.approx(same[column].to_numpy(), abs=1e-6)
