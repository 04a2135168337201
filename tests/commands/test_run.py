"""Lines that ``per-obspy run`` prints of its earthquakes and of simulated motion."""

from per_obspy.commands.run import _earthquake_lines, _simulated_line


def test_the_screened_earthquake_is_printed():
    first = {"start": "2019-07-04T17:33", "stations": 2, "records": 6, "undated": 0}
    second = {"start": "2019-07-06T03:19", "stations": 11, "records": 34, "undated": 1}
    groups = [first | {"screened": False}, second | {"screened": True}]
    assert _earthquake_lines(groups) == [
        "Records of 2 earthquakes: 2019-07-06T03:19, 11 stations; others, left out: "
        "2019-07-04T17:33",
        "1 records have no date and are taken for this one.",
    ]
    assert _earthquake_lines([first | {"screened": True}]) == []


def test_simulated_stations_are_counted_if_others_are_real():
    counts = {"stations": 5, "stations_simulated": 2}
    line = "The ground motion of 2 of 5 stations is SIMULATED."
    assert _simulated_line(counts) == line
    assert _simulated_line(counts | {"stations": 2}) == "The ground motion is SIMULATED."
