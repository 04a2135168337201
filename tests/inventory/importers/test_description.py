"""Every source through its description, its pairs and the risk of its pairs."""

import numpy as np
import pytest
from building_samples import OUTLINES, POINTS, small_town
from screening_samples import make_station

import per_obspy
from per_obspy.errors import CatalogError
from per_obspy.inventory.footprints.footprint_pairs import pairs_from_footprints
from per_obspy.inventory.importers.description import describe_buildings

#: Metres by which coordinates are rounded: OSM has seven decimals of a degree.
ROUNDED = {"osm_xml": 0.02}


@pytest.fixture(scope="module")
def station():
    return make_station()


@pytest.mark.parametrize("name", OUTLINES)
def test_from_a_file_to_risk_rows(tmp_path, name, station):
    source, write = OUTLINES[name]
    town = small_town()
    path = write(tmp_path, town)
    described = describe_buildings(path)
    assert (described.source, described.features, described.outlines) == (source, 4, 4)
    assert {"height", "storeys"} & set(described.columns)
    # seven decimals
    assert described.bounds == pytest.approx((20.0, 10.0, 20.00044, 10.000108), abs=1e-6)
    pairs = pairs_from_footprints(path)
    # the projection of small_town is a sphere: 0.7 % shorter than the ellipsoid here
    assert pairs["gap"].to_numpy() == pytest.approx([0.05, 0.2], abs=ROUNDED.get(name, 0.002))
    assert pairs["azimuth"].to_numpy() == pytest.approx([90.0, 90.0], abs=0.1)
    for i, positions in ((1, [0, 1]), (2, [1, 2])):
        if "height" in described.columns:
            expected = [town.heights[k] for k in positions]
            assert pairs[f"height_{i}"].to_numpy() == pytest.approx(expected, rel=1e-6)
        if "storeys" in described.columns:
            assert pairs[f"storeys_{i}"].to_list() == [town.storeys[k] for k in positions]
    risk = per_obspy.risk_table([station], pairs)
    assert len(risk) == 2
    assert np.isfinite(risk["demand"]).all()


@pytest.mark.parametrize("name", POINTS)
def test_points_are_described_and_refused_as_pairs(tmp_path, name):
    source, write = POINTS[name]
    path = write(tmp_path, small_town())
    described = describe_buildings(path)
    assert (described.source, described.features, described.outlines) == (source, 4, 0)
    assert "storeys" in described.columns
    assert described.bounds is not None
    assert described.bounds[0] == pytest.approx(20.0, abs=1e-3)
    with pytest.raises(CatalogError, match=r"points.*walls") as error:
        pairs_from_footprints(path)
    assert "\n" not in str(error.value)
