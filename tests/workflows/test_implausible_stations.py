"""The count of implausible stations: real station lists, as they are and with wrong units."""

from pathlib import Path

import numpy as np
import pytest

WORKFLOWS = Path(__file__).parents[2] / "workflows"


@pytest.mark.real_data
@pytest.mark.parametrize("name", ["kobe1995", "puebla2017"])
def test_good_instruments_of_a_list_are_plausible_and_wrong_units_are_found(name, real_data):
    with pytest.MonkeyPatch.context() as patch:
        patch.syspath_prepend(WORKFLOWS)
        import implausible_stations as workflow
    peaks = workflow.listed_peaks(real_data / "stationlists" / f"{name}.json")
    source = workflow.LISTED[name]
    row = workflow.counts(peaks, source)
    stations, good, rejected = row[:3]
    # none flagged: the issue allows 1 in 200
    assert (good, rejected, row[-1]) == (0, 0, 0)
    # factors of 100 and 981, both ways: all of them are flagged, as the documentation prints
    flagged = row[3:-1:2]
    np.testing.assert_array_equal(flagged[[1, 2, 4, 5]], stations)
