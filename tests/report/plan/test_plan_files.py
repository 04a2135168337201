"""Files of a plan: hostile names stay data, and readers of GPX get every visit."""

import gpxpy
import pandas as pd
import pytest

from per_obspy.report.plan.plan_files import gpx_routes, visit_table, write_plan
from per_obspy.screening.building_rows.row_columns import BUILDINGS

NAMES = ["<script>alert(1)</script>", '=HYPERLINK("x")', "a\x00\u202eb"]


@pytest.fixture
def table():
    """Return three visits of two teams."""
    buildings = pd.DataFrame(
        {
            "rank": [1, 2, 3],
            "building_id": NAMES,
            "risk_class": "high",
            "worst_neighbour": NAMES[::-1],
            "longitude": [20.0, 20.1, 20.2],
            "latitude": 40.0,
        }
    )
    visits = pd.DataFrame(
        {
            "team": [1, 1, 2],
            "visit": [1, 2, 1],
            "building": [2, 0, 1],
            "way": [10.4, 20.0, 5.0],
            "arrival": [60.0, 1000.0, 30.0],
            "departure": [660.0, 1600.0, 630.0],
        }
    )
    return visit_table(visits, buildings)


def test_every_visit_has_its_building_and_minutes(table):
    assert table["building_id"].tolist() == [NAMES[2], NAMES[0], NAMES[1]]
    assert table["departure"].tolist() == [11.0, 26.7, 10.5]


def test_another_program_reads_the_routes(table):
    document = gpxpy.parse(gpx_routes(table))
    assert [(route.name, len(route.points)) for route in document.routes] == [
        ("team 1", 2),
        ("team 2", 1),
    ]
    points = [point for route in document.routes for point in route.points]
    assert [(point.longitude, point.latitude) for point in points] == [
        (20.2, 40.0),
        (20.0, 40.0),
        (20.1, 40.0),
    ]
    assert points[1].name == "2: <script>alert(1)</script>"
    assert "\x00" not in points[0].name
    assert "\u202e" not in points[0].name


def test_no_text_is_a_formula_to_a_spreadsheet(table, tmp_path):
    described = [column for column in BUILDINGS if column.name in table]
    files = write_plan(table, described, tmp_path)
    assert [file.name for file in files] == ["plan.csv", "plan.columns.csv", "plan.gpx"]
    read = pd.read_csv(files[0])
    assert not read["building_id"].str.startswith("=").any()
    assert pd.read_csv(files[1])["name"].tolist()[:5] == list(read)[:5]
