"""Probabilities against exact outcomes in simulated motion: the calibration on few pairs."""

import runpy
import sys
from pathlib import Path

import numpy as np
import pandas as pd
import pytest

from per_obspy.config import Building

pytestmark = pytest.mark.long

WORKFLOWS = Path(__file__).parents[2] / "workflows"


@pytest.fixture(scope="module")
def calibration():
    """Return the modules of the workflow, which import each other by name."""
    with pytest.MonkeyPatch.context() as patch:
        patch.syspath_prepend(WORKFLOWS)
        import calibration_cases
        import calibration_scores

        yield calibration_cases, calibration_scores


@pytest.fixture(scope="module")
def at_stations(calibration):
    """Return linear pairs at stations of two earthquakes, all with gaps that were estimated."""
    cases, _ = calibration
    told, linear = [], Building(strength="none")
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(cases, "ESTIMATED", 1.0)
        for event in (1, 2):
            known = cases.network(event, 3, 1, varied=False)
            rows = cases.predicted(known, known.recorded, 2500, event, linear)
            told.append(
                rows.assign(pounded=cases.outcomes(rows, known.recorded, event), event=event)
            )
    rows = pd.concat(told, ignore_index=True)
    return rows.assign(**cases.kinds(rows))


def test_estimated_gaps_are_closed_as_often_as_told(calibration, at_stations):
    # the motion is known, periods are given: pairs are independent, and nothing is uncertain but
    # their gaps
    some = at_stations[at_stations[calibration[0].KINDS[2]]]
    told, pounded = some["probability"].to_numpy(), some["pounded"].to_numpy()
    variance = told * (1.0 - told)
    excess = pounded - told
    # three standard deviations of independent pairs, in the mean and in the Brier score; would
    # catch a deviation that is half or twice as wide (7.6 and 4.6 standard deviations of the score)
    assert abs(excess.sum()) < 3.0 * np.sqrt(variance.sum())
    spread = np.sqrt((variance * (1.0 - 2.0 * told) ** 2).sum())
    assert abs((excess**2 - variance).sum()) < 3.0 * spread
    # gaps well inside and well outside the demand are sure
    assert pounded[told > 0.999].all()
    assert not pounded[told < 0.001].any()


def test_derived_periods_pound_as_often_as_told(calibration, at_stations):
    _, scores = calibration
    some = at_stations[at_stations["periods derived"]]
    mean, _ = scores.difference(some)
    # pairs of a place share its motion: three standard deviations with those of a site dependent;
    # would catch estimates taken for exact ones, whose median is 1.16 of them (8 standard
    # deviations)
    _, by_site = scores.difference(some.assign(event=6 * some["event"] + some["site"]))
    assert abs(mean) < 3.0 * by_site
    assert by_site < 0.007  # so that a bias of 0.02 is seen


def test_pairs_that_touch_pound_and_are_told_so(calibration, at_stations):
    # would catch nodes at which equal buildings move as one
    touching = at_stations[at_stations[calibration[0].TOUCHING]]
    assert len(touching) > 100
    assert touching["pounded"].all()
    assert (touching["probability"] == 1.0).all()


@pytest.mark.usefixtures("calibration")
def test_the_tables_replace_the_measured_part_of_their_page(monkeypatch, tmp_path):
    page = tmp_path / "page.md"
    page.write_text(
        "By hand.\n\n## Measured in simulated earthquakes\n\nlong ago\n", encoding="utf-8"
    )
    few = ["-e", "1", "-n", "60", "-s", "1"]
    monkeypatch.setattr(sys, "argv", ["calibration.py", "-o", str(page), *few])
    runpy.run_path(str(WORKFLOWS / "calibration.py"), run_name="__main__")
    said, measured = page.read_text(encoding="utf-8").split("## Measured in simulated earthquakes")
    assert said == "By hand.\n\n"
    assert "1 earthquakes, 180 pairs" in measured
    assert {path.name for path in (tmp_path / "figures").glob("*.png")} == {
        "calibration_demand.png",
        "calibration_reliability.png",
    }
