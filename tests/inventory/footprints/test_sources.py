"""Every source: its pairs and their risk, one quarter in all formats, cells that need rules."""

import math

import numpy as np
import pandas as pd
import pyarrow as pa
import pyarrow.parquet
import pyogrio
import pytest
import shapely
from building_samples import OUTLINES, POINTS, Town, nsi, overture, small_town
from numpy.testing import assert_allclose
from screening_samples import make_station

import per_obspy
from per_obspy.errors import CatalogError
from per_obspy.inventory.footprints.building_columns import schema_columns
from per_obspy.inventory.footprints.footprint_pairs import pairs_from_footprints
from per_obspy.inventory.footprints.layer_files import read_raw_layer
from per_obspy.inventory.footprints.sources import source_of, sources, taxonomy
from per_obspy.inventory.schema import COLUMNS, SYSTEMS

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


@pytest.fixture(scope="module")
def station():
    return make_station()


@pytest.mark.parametrize("name", OUTLINES)
def test_from_a_file_to_risk_rows(tmp_path, name, station):
    source, write = OUTLINES[name]
    town = small_town()
    path = write(tmp_path, town)
    raw = read_raw_layer(path, None)
    assert source_of(raw.attributes.column_names).name == source
    columns = schema_columns(raw.attributes.to_pandas(), name)
    assert {"height", "storeys"} & set(columns)
    pairs = pairs_from_footprints(path)
    # the projection of small_town is a sphere: 0.7 % shorter than the ellipsoid here
    assert pairs["gap"].to_numpy() == pytest.approx(
        [0.05, 0.2], abs=0.02 if name == "osm_xml" else 0.002
    )
    assert pairs["azimuth"].to_numpy() == pytest.approx([90.0, 90.0], abs=0.1)
    for i, positions in ((1, [0, 1]), (2, [1, 2])):
        if "height" in columns:
            expected = [town.heights[k] for k in positions]
            assert pairs[f"height_{i}"].to_numpy() == pytest.approx(expected, rel=1e-6)
        if "storeys" in columns:
            assert pairs[f"storeys_{i}"].to_list() == [town.storeys[k] for k in positions]
    risk = per_obspy.risk_table([station], pairs)
    assert len(risk) == 2
    assert np.isfinite(risk["demand"]).all()


@pytest.mark.parametrize("name", POINTS)
def test_points_are_refused_as_pairs(tmp_path, name):
    _, write = POINTS[name]
    with pytest.raises(CatalogError, match=r"points.*walls") as error:
        pairs_from_footprints(write(tmp_path, small_town()))
    assert "\n" not in str(error.value)


@pytest.mark.real_data
def test_points_of_berkeley(real_data):
    # a real table of SimCenter; W1 is wood
    cells = pd.read_csv(real_data / "inventories" / "BerkeleyBuildings_full.csv")
    table = schema_columns(cells, "Berkeley")
    assert table["storeys"].tolist()[:2] == [2.0, 1.0]
    assert table["system"].tolist()[0] == "other"


def test_people_at_night_of_the_national_inventory(tmp_path):
    raw = read_raw_layer(nsi(tmp_path, small_town()), None)
    table = schema_columns(raw.attributes.to_pandas(), "nsi")
    assert table["occupants"].tolist() == [3, 3, 3, 3]
    assert table["storeys"].tolist() == [4, 3, 2, 3]
    # the height of the first floor above ground is not that of the building
    assert "height" not in table


@pytest.mark.parametrize("source", sources(), ids=lambda source: source.name)
def test_sources_use_the_words_of_the_schema(source):
    known = {name.removesuffix("_1") for name in COLUMNS if name.endswith("_1")} | {"storey_height"}
    assert set(source.columns) <= known
    assert set(source.systems.values()) <= set(SYSTEMS)


GEM = next(source.systems for source in sources() if source.name == "GEM exposure")


@pytest.mark.parametrize(
    ("text", "storeys", "system", "adjoining"),
    [
        # full form of 2.0, with both directions, and its short form
        ("DX/CR+CIP/LFM+DUC/DY/CR+CIP/LFM+DUC/HEX:4+HBEX:1/YEX:1990/RES+RES2/BP2/PLFR/IRRE/EW99/"
         "RSH3/F99/FOS99", 4.0, "concrete_mrf", 2),
        ("CR/LWAL/HAPP:7/BPD", 7.0, "concrete_wall", 0),
        ("S/LFM/HEX:12/BP3", 12.0, "steel_mrf", 3),
        ("CR/LDUAL/H:9", 9.0, "concrete_frame_wall", None),
        ("MUR+CLBRS/LWAL/H:2", 2.0, "masonry", None),
        ("MCF/LWAL/HEX:2", 2.0, "reinforced_masonry", None),
        ("CR/LFINF+DNO/HEX:3", 3.0, "other", None),
        # unknown storeys, storeys below ground and height of the ground floor are none
        ("MUR/LWAL/H99/BP99", math.nan, "masonry", None),
        ("MUR/LWAL/HBEX:2/HFEX:0.5", math.nan, "masonry", None),
        ("MATO/L99", math.nan, "", None),
        ("", math.nan, "", None),
    ],
)  # fmt: skip
def test_what_a_string_says(text, storeys, system, adjoining):
    known, _, code, near = taxonomy(text, GEM)
    assert (GEM.get(code, ""), near) == (system, adjoining)
    assert known == pytest.approx(storeys, nan_ok=True)


@pytest.mark.parametrize("text", ["CR/LFM/HBET:6,3", "CR/LFM/HBET:3,6", "CR/LFM/HBET:3-6", "H:3-6"])
def test_a_range_is_even_between_the_logarithms_of_its_ends(text):
    storeys, log_std, *_ = taxonomy(text, GEM)
    # median and deviation of a uniform distribution, sampled
    sampled = np.linspace(np.log(3.0), np.log(6.0), 100_001)
    assert storeys == pytest.approx(np.exp(np.median(sampled)))
    assert log_std == pytest.approx(np.std(sampled), rel=1e-4)


def test_exact_storeys_have_no_deviation():
    assert math.isnan(taxonomy("CR/LFM/HEX:4", GEM)[1])
    assert taxonomy("CR/LFM/HAPP:4", GEM)[1] > 0.0


@pytest.mark.parametrize("text", ["/" * 10**6, "+" * 10**6, "H:" * 10**5, "H:9999", "HBET:0-3"])
def test_hostile_strings_are_unknown(text):
    storeys, _, _, adjoining = taxonomy(text, GEM)
    assert math.isnan(storeys)
    assert adjoining is None


def test_a_building_under_the_ground_has_no_pairs(tmp_path):
    path = overture(tmp_path, small_town())
    assert len(pairs_from_footprints(path)) == 2
    table = pa.parquet.read_table(path)
    number = table.column_names.index("is_underground")
    below = pa.array([True, False, False, False])
    pa.parquet.write_table(table.set_column(number, "is_underground", below), path)
    pairs = pairs_from_footprints(path)
    assert pairs["building_id_1"].tolist() == ["b2"]
    reasons = [reason for row in pairs.attrs["rejected"] for reason in row.reasons]
    assert any("height_1 = 'underground'" in reason for reason in reasons)


def test_unknown_heights_of_microsoft_are_estimated_from_the_others():
    # 300 heights of log-deviation 0.4 about 8 m, one unknown
    known = 8.0 * np.exp(np.random.default_rng(1).normal(0, 0.4, 300))
    layer = pd.DataFrame({"height": [-1.0, *known], "confidence": -1.0})
    table = schema_columns(layer, "town")
    # three deviations of a median of 300
    assert abs(np.log(table["height"].to_numpy()[0] / 8.0)) < 3 * 1.25 * 0.4 / np.sqrt(300)
    # known ones are as uncertain as heights from images, by 3 m, the estimated one as its class
    assert_allclose(table["height_log_std"][1:], np.sqrt(np.log1p((3.0 / known) ** 2)), rtol=1e-12)
    assert abs(table["height_log_std"][0] / 0.4 - 1.0) < 3 / np.sqrt(2 * 300)
