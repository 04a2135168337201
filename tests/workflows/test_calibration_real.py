"""Stations of real earthquakes left out one by one: errors as large as predicted, on few pairs."""

from pathlib import Path

import numpy as np
import pandas as pd
import pytest

from per_obspy.config import Screening

pytestmark = pytest.mark.long

WORKFLOWS = Path(__file__).parents[2] / "workflows"

#: Two earthquakes of different size, ground and distance between stations.
FOLDERS = ("aomori2018_knet", "mexico_lakebed_1989")


@pytest.fixture(scope="module")
def modules():
    """Return the modules of the workflow, which import each other by name."""
    with pytest.MonkeyPatch.context() as patch:
        patch.syspath_prepend(WORKFLOWS)
        import calibration_events
        import calibration_left_out
        import calibration_real
        import calibration_real_scores

        # six pairs of periods along two axes, one gap
        patch.setattr(calibration_left_out, "PERIODS", (0.3, 2.4, 4))
        patch.setattr(calibration_left_out, "AZIMUTHS", (0.0, 90.0))
        patch.setattr(calibration_left_out, "GAPS", (1.0,))
        yield calibration_events, calibration_left_out, calibration_real, calibration_real_scores


@pytest.fixture(scope="module")
def events(modules, real_data, tmp_path_factory):
    """Return both earthquakes."""
    folders = [real_data / "records" / name for name in FOLDERS]
    return modules[0].real_events(folders, tmp_path_factory.mktemp("cache"))


@pytest.fixture(scope="module")
def rows(modules, events):
    """Return the predictions at all places of both earthquakes."""
    return pd.concat(map(modules[1].left_out, events), ignore_index=True)


@pytest.mark.real_data
def test_errors_between_stations_are_as_large_as_predicted(modules, rows):
    _, left_out, _, scores = modules
    exact = rows[rows["kind"] == left_out.EXACT]
    assert set(exact["event"]) == set(FOLDERS)
    error = np.log(exact["true"]) - exact["ln_median"]
    # every earthquake counts alike: 20 places, most of whose errors each share, leave a standard
    # error of 0.16; 0.15 is what the workflow shows over all pairs, and catches a deviation of the
    # field alone (1.55 on these records)
    weight = scores.weights(exact)
    assert 0.85 < scores.rms(error / exact["log_std"], weight) < 1.15
    alone = np.log(exact["true"]) - exact["ln_record"]
    assert scores.rms(alone / exact["record_log_std"], weight) > 1.3


@pytest.mark.real_data
def test_the_probability_is_that_of_the_predicted_demand(modules, rows):
    # the risk table's own probability against median and deviation: normal in ln
    _, left_out, _, scores = modules
    exact = rows[rows["kind"] == left_out.EXACT]
    margin = (exact["ln_median"] - np.log(exact["gap"])) / exact["log_std"]
    probability = exact["probability"]
    # would catch scores of a prediction that the table does not make
    np.testing.assert_array_equal(np.sign(margin), np.sign(probability - 0.5))
    # weighting and a wider deviation score better than the scaled record alone
    better, alone = scores.brier(exact, scores.weights(exact))
    assert better < alone


@pytest.mark.real_data
def test_the_page_has_a_row_for_every_earthquake_and_bin(modules, rows):
    text = "\n".join(modules[2].page(rows))
    assert all(name in text for name in FOLDERS)
    assert "| 0.4 to 0.5 |" in text
    assert "nan" not in text


def test_bins_are_means_and_shares_with_places_dependent(modules):
    _, _, _, scores = modules
    table = pd.DataFrame(
        {
            "event": ["one"] * 4,
            "station": ["a", "a", "b", "b"],
            "probability": [0.31, 0.33, 0.35, 0.37],
            "true": [2.0, 2.0, 0.5, 0.5],
            "gap": 1.0,
        }
    )
    found = scores.bins(table)
    # both cases of a place agree: two places, one of either kind, (1 + 1) / 4 of each
    assert found.loc[0.3].tolist() == pytest.approx([0.34, 0.5, np.sqrt(2.0) / 4.0, 4.0])


def test_settings_of_the_screening_are_those_of_users_but_for_the_reach(modules):
    users = Screening(largest_distance=2e7)
    assert users == modules[1].SCREENING
