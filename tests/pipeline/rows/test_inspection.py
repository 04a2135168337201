"""Plan of inspection from a whole run with rows of buildings."""

import pandas as pd
import pytest

from per_obspy.errors import CatalogError
from per_obspy.pipeline.rows.inspection import plan_inspection
from per_obspy.report.plan.visits import Teams


@pytest.fixture(scope="module")
def finished(small_run):
    """Return the folder of a finished run of sixty pairs."""
    return small_run / "out"


def teams(longitude, latitude):
    """Return two teams of eight hours."""
    return Teams([(longitude, latitude)] * 2, 8 * 3600.0, 1200.0, 1.0, 1.4, 8)


def test_the_worst_buildings_of_a_run_are_visited(finished, tmp_path):
    buildings = pd.read_parquet(finished / "buildings.parquet")
    worst = buildings.iloc[0]
    plan = plan_inspection(finished, teams(worst["longitude"], worst["latitude"]), tmp_path)
    assert worst["building_id"] in set(plan.visits["building_id"])
    assert plan.buildings == (buildings["neighbours_that_can_hit"] > 0).sum()
    # nothing but what the table of buildings has
    known = buildings.set_index("building_id")
    visits = plan.visits.set_index("building_id")
    assert (visits["rank"] == known["rank"].loc[visits.index]).all()
    assert plan.facts["simulated"] == "true"


def test_a_start_from_which_nothing_can_be_reached_is_refused(finished, tmp_path):
    with pytest.raises(CatalogError, match="from the nearest building"):
        plan_inspection(finished, teams(100.0, 80.0), tmp_path)
    assert not list(tmp_path.iterdir())
