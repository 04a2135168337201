"""Layers of a plan, read back by another reader."""

import pandas as pd
import pyogrio
import shapely

from per_obspy.report.plan.plan_layers import write_plan_layers


def test_points_are_the_visits_and_lines_join_them_in_their_order(tmp_path):
    table = pd.DataFrame(
        {
            "team": [1, 1, 2],
            "visit": [1, 2, 1],
            "way": [5.0, 7.0, 1.0],
            "building_id": ["a", "<b>", "c"],
            "longitude": [20.0, 20.1, 20.2],
            "latitude": [40.0, 40.1, 40.2],
        }
    )
    write_plan_layers(table, tmp_path / "plan.gpkg", {"name": "town"})
    _, _, shapes, fields = pyogrio.raw.read(tmp_path / "plan.gpkg", layer="visits")
    assert shapely.get_x(shapely.from_wkb(shapes)).tolist() == table["longitude"].tolist()
    assert fields[3].tolist() == table["building_id"].tolist()
    _, _, lines, fields = pyogrio.raw.read(tmp_path / "plan.gpkg", layer="routes")
    first = shapely.from_wkb(lines)[0]
    assert shapely.get_coordinates(first)[[0, -1]].tolist() == [[20.0, 40.0], [20.1, 40.1]]
    assert fields[1].tolist() == [2, 1]
    assert fields[2].tolist() == [12.0, 1.0]
