"""The made-up centre under the amplitudes of two earthquakes, and drawn gaps against surveys."""

from pathlib import Path

import numpy as np
import pytest

WORKFLOWS = Path(__file__).parents[2] / "workflows"

pytestmark = [pytest.mark.real_data, pytest.mark.usefixtures("real_data")]


@pytest.fixture
def workflow():
    """Return the workflow with few rows of buildings."""
    with pytest.MonkeyPatch.context() as patch:
        patch.syspath_prepend(WORKFLOWS)
        import observed_pounding

        patch.setattr(observed_pounding, "ROWS", 20)
        yield observed_pounding


def test_amplitudes_are_those_of_the_lists(workflow):
    # read by hand from the file: the larger horizontal, % g and cm/s
    peaks = workflow.peaks("February 2011")
    assert set(peaks) == set(workflow.STATIONS)
    assert peaks["REHS"]["pga"] == 0.7134
    assert peaks["REHS"]["pgv"] == 0.8656
    assert peaks["CHHC"]["sa(0.3)"] == 1.1101
    assert workflow.peaks("September 2010")["CCCC"] == {"pga": 0.202171, "pgv": 0.57045}


def test_the_threshold_leaves_the_observed_share_and_the_weaker_motion_less(workflow):
    strong, weak = (
        workflow.centres(name, workflow.Stock(), 1) for name in ("February 2011", "September 2010")
    )
    limit = workflow.threshold(strong)
    # 480 buildings: one more or less
    assert abs((strong > limit).mean() - workflow.OBSERVED) < 0.003
    assert (weak > limit).mean() < 0.2 * workflow.OBSERVED
    # the same buildings, hit less hard
    assert np.mean(weak <= strong) > 0.99


def test_neighbours_that_touch_are_drawn_apart():
    with pytest.MonkeyPatch.context() as patch:
        patch.syspath_prepend(WORKFLOWS)
        import outline_accuracy

        gap = outline_accuracy.touching_neighbours("san_jose")
    # what docs/inventories.md says of the deviation of drawn outlines
    assert 0.7 < (gap == 0.0).mean() < 0.9
    assert 0.1 < np.sqrt((gap[gap <= 1.0] ** 2).mean()) < 0.3
