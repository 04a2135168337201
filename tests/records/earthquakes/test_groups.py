"""Groups of records by earthquake."""

from pathlib import Path

import numpy as np
import pytest
from obspy import Trace, UTCDateTime

from per_obspy.errors import CatalogError
from per_obspy.records.earthquakes.earthquake import Earthquake
from per_obspy.records.earthquakes.groups import (
    EventGroup,
    RecordSpan,
    chosen_group,
    differ_by_clocks,
    event_groups,
    joining_gap,
    record_span,
    station_files,
)

MAIN = UTCDateTime(2019, 7, 6, 3, 19, 53)
FORE = UTCDateTime(2019, 7, 4, 17, 33, 49)


def span(station: str, start: UTCDateTime, length: float = 60.0, folder: str = "a") -> RecordSpan:
    """Return the time of a record of a station."""
    path = Path(folder) / f"{station}.mseed"
    return RecordSpan(f"{station}..HNN", station, path, start, start + length)


def stations(groups: tuple[EventGroup, ...]) -> list[set[str]]:
    """Return the stations of every group."""
    return list(map(_names, groups))


def _names(group: EventGroup) -> set[str]:
    return {record.station for record in group.records}


def no_motion(group: EventGroup) -> float:
    raise AssertionError(f"motion of {group.label} is not needed")


def test_records_that_start_together_are_of_one_earthquake():
    records = [span("N.A", MAIN), span("N.B", MAIN + 300), span("N.A", FORE), span("N.C", FORE)]
    groups = event_groups(records)
    assert stations(groups) == [{"N.A", "N.C"}, {"N.A", "N.B"}]
    assert [group.label for group in groups] == ["2019-07-04T17:33", "2019-07-06T03:19"]


def test_a_sequence_of_aftershocks_is_no_chain():
    # each 4 minutes after the other: the third is 8 minutes after the first
    groups = event_groups([span("N.A", MAIN + 240 * number) for number in range(4)])
    assert [len(group.records) for group in groups] == [2, 2]


def test_wrong_clocks_need_a_longer_gap():
    records = [span("N.A", MAIN), span("N.B", MAIN + 3200), span("N.C", MAIN + 4200)]
    assert len(event_groups(records)) == 3
    assert len(event_groups(records, gap=5400.0)) == 1


def test_groups_of_other_stations_within_a_day_may_differ_by_their_clocks_only():
    main = [span("N.A", MAIN), span("N.B", MAIN + 10)]
    hour = [span("N.C", MAIN - 4100)]
    # a station with records of both, or days between them, is of another earthquake
    both, days = [span("N.A", MAIN + 9000)], [span("N.D", MAIN + 3 * 86400)]
    groups = event_groups([*main, *hour, *both, *days])
    screened = next(group for group in groups if group.start == MAIN)
    (alike,) = differ_by_clocks(groups, screened)
    assert {record.station for record in alike.records} == {"N.C"}
    gap = joining_gap([alike, screened])
    assert gap == 4200.0
    assert {"N.A", "N.B", "N.C"} in stations(event_groups([*main, *hour], gap))


@pytest.mark.parametrize(
    ("event", "expected"),
    [(Earthquake(magnitude=8.5), 1), (Earthquake(magnitude=5.0), 0), (None, 1)],
)
def test_another_magnitude_in_a_header_is_another_earthquake(event, expected):
    main = span("N.A", MAIN)._replace(event=Earthquake(time=str(MAIN), magnitude=8.8))
    groups = event_groups([main, span("N.B", MAIN + 4000)._replace(event=event)])
    assert len(differ_by_clocks(groups, groups[0])) == expected


def test_a_continuous_record_joins_every_group_that_it_overlaps():
    hours = span("N.H", MAIN - 7200, 14400.0)
    groups = event_groups([span("N.A", MAIN), span("N.B", MAIN + 1800), span("N.C", FORE), hours])
    assert stations(groups) == [{"N.C"}, {"N.A", "N.H"}, {"N.B", "N.H"}]


def test_continuous_records_alone_are_grouped_by_overlap():
    records = [span("N.A", MAIN, 900.0), span("N.B", MAIN + 600, 900.0), span("N.C", FORE, 900.0)]
    assert stations(event_groups(records)) == [{"N.C"}, {"N.A", "N.B"}]


def test_records_with_a_day_alone_join_the_largest_group_of_that_day():
    midnight = UTCDateTime(2019, 7, 6)
    records = [
        span("N.A", MAIN),
        span("N.B", MAIN),
        span("N.C", MAIN + 7200),
        span("N.D", midnight),
    ]
    assert stations(event_groups(records)) == [{"N.A", "N.B", "N.D"}, {"N.C"}]
    # and are told apart by their days where there is no other record
    days = [span("N.A", UTCDateTime(1940, 5, 19)), span("N.B", UTCDateTime(1952, 7, 21))]
    assert stations(event_groups(days)) == [{"N.A"}, {"N.B"}]


@pytest.mark.parametrize("year", [1970, 1980])
def test_records_without_a_date_join_the_group_of_their_folder(year: int):
    unset = span("N.F", UTCDateTime(year, 1, 1), folder="b")
    records = [span("N.A", MAIN), span("N.B", FORE, folder="b"), unset]
    assert stations(event_groups(records)) == [{"N.B", "N.F"}, {"N.A"}]
    # in a folder of their own they go with whichever earthquake is screened
    alone = unset._replace(path=Path("c") / "f.mseed")
    assert stations(event_groups([*records[:2], alone])) == [{"N.B", "N.F"}, {"N.A", "N.F"}]
    (group,) = event_groups([alone])
    assert (group.start, group.label) == (None, "without a date")


def test_files_of_a_station_are_named_once_and_sorted():
    first, second = span("N.A", MAIN), span("N.A", MAIN, folder="b")
    files = station_files([second, first, first, span("N.B", MAIN)])
    assert files == {"N.A": (first.path, second.path), "N.B": (Path("a") / "N.B.mseed",)}


def test_pads_of_processed_records_do_not_count():
    # would catch records of one earthquake that processing padded by minutes
    header = {"network": "N", "station": "A", "starttime": MAIN - 400, "delta": 1.0}
    trace = Trace(np.zeros(1001), header)
    trace.stats.per_obspy = {"pad_before": 400.0, "pad_after": 500.0}
    record = record_span(trace, Path("a.mseed"))
    assert (record.start, record.end) == (MAIN, MAIN + 100)


def as_strong(group: EventGroup) -> float:
    return 0.0 * group.stations  # the same of every group


def test_of_groups_as_large_the_strongest_and_then_the_latest_is_chosen():
    groups = event_groups([span("N.A", FORE), span("N.A", MAIN)])
    assert chosen_group(groups, None, "", lambda group: -float(group.start)) is groups[0]
    assert chosen_group(groups, None, "", as_strong) is groups[1]


@pytest.mark.parametrize(("before", "chosen"), [(0.0, 1), (299.0, 1), (-59.0, 1)])
def test_a_time_chooses_the_group_that_contains_or_follows_it(before: float, chosen: int):
    groups = event_groups([span("N.A", FORE), span("N.B", FORE), span("N.A", MAIN)])
    assert chosen_group(groups, MAIN - before, "event.xml", no_motion) is groups[chosen]


def test_a_time_without_records_is_refused():
    groups = event_groups([span("N.A", FORE), span("N.A", MAIN)])
    message = r"records\.event: no record is of 2019-07-06T03:10.*17:33, .*03:19: choose one"
    with pytest.raises(CatalogError, match=message):
        chosen_group(groups, MAIN - 593, "records.event", no_motion)


def test_the_group_of_most_stations_is_chosen():
    groups = event_groups([span("N.A", FORE), span("N.B", FORE), span("N.A", MAIN)])
    assert chosen_group(groups, None, "", no_motion) is groups[0]
