"""
Earthquakes in a folder of records: records that start together, and the one group to screen.

A group begins with its earliest record and takes every record that starts within a gap of 300 s
after it: more than waves need across any network of strong motion, less than most aftershocks wait.
Three kinds of records are no evidence of another earthquake and found no group where they can join
one:

* continuous records, longer than 600 s, belong to every group that they overlap;
* records whose header has a date but no time start at midnight: they join the largest group that
  starts from half a day before to one and a half days after it, in whichever zone the date is;
* records without a date (film, or a clock that was never set: 1970 or 1980) join the group of the
  other records of their folder; if these form no group, every group of the folder is taken.
"""

import logging
import math
from collections import Counter, defaultdict
from collections.abc import Callable, Iterable, Sequence
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Literal, NamedTuple

import numpy as np
from obspy import Trace, UTCDateTime
from obspy.core.event import Event

from per_obspy import config
from per_obspy.constants import UNSET_DAYS
from per_obspy.errors import CatalogError, Rejection, shortened
from per_obspy.formats.knet import knet_event
from per_obspy.records.earthquakes.earthquake import (
    AgreedEvent,
    Earthquake,
    agreed_event,
    header_event,
    origin_of,
    same_earthquake,
)

if TYPE_CHECKING:
    from per_obspy.records.folder import Reader, RecordSource

log = logging.getLogger(__name__)

#: Longest time from the first start of a group to the last, s.
GAP = 300.0

#: Records longer than this, s, do not found a group where they overlap one.
CONTINUOUS = 600.0

#: Records longer than this, s, hold hours in which other earthquakes may be: only the window of the
#: group is read, with so many s before and after it.
HOURS, MARGIN = 3600.0, 60.0

_DAY = 86400.0

#: Units of the quantities of ground motion.
_UNITS = {"acceleration": "m/s2", "velocity": "m/s", "displacement": "m"}

#: Kinds of records: with a time that an earthquake triggered or without end, with a day alone,
#: or without a date.
Kind = Literal["triggered", "continuous", "day", "undated"]


class RecordSpan(NamedTuple):
    """
    Time of a record.

    Attributes
    ----------
    record : str
        ``NET.STA.LOC.CHA``.
    station : str
        ``NET.STA``.
    path : Path
        Its file.
    start, end : UTCDateTime
        Of the first and the last sample.
    event : Earthquake or None
        The earthquake by the record's header.
    """

    record: str
    station: str
    path: Path
    start: UTCDateTime
    end: UTCDateTime
    event: Earthquake | None = None

    @property
    def key(self) -> tuple[str, str, int, int]:
        """Record, file and times, by which records can be looked up."""
        return self.record, str(self.path), int(self.start.ns), int(self.end.ns)

    @property
    def is_dated(self) -> bool:
        """Whether the day of the record is known."""
        return (self.start.year, self.start.month, self.start.day) not in UNSET_DAYS

    @property
    def is_continuous(self) -> bool:
        """Whether the record is too long for one that an earthquake triggered."""
        return bool(self.end - self.start > CONTINUOUS)

    @property
    def kind(self) -> Kind:
        """What the times of the record say of its earthquake."""
        if not self.is_dated:
            return "undated"
        if self.is_continuous:
            return "continuous"
        return "triggered" if self.start.ns % int(_DAY * 1e9) else "day"


class EventGroup(NamedTuple):
    """
    Records of one earthquake.

    Attributes
    ----------
    records : tuple of RecordSpan
        The earliest first, continuous ones aside.
    """

    records: tuple[RecordSpan, ...]

    @property
    def start(self) -> UTCDateTime | None:
        """Start of the earliest record; None if no record has a date."""
        return self.records[0].start if self.records[0].is_dated else None

    @property
    def stations(self) -> int:
        """Number of stations."""
        return len({record.station for record in self.records})

    @property
    def window(self) -> tuple[UTCDateTime, UTCDateTime] | None:
        """Times of the first and the last sample, of triggered records if there are any."""
        dated = [record for record in self.records if record.is_dated]
        triggered = [record for record in dated if not record.is_continuous] or dated
        return span_of(triggered) if triggered else None

    @property
    def label(self) -> str:
        """Start of the earthquake's records to the minute, for people."""
        return str(self.start)[:16] if self.start else "without a date"


def record_span(trace: Trace, path: Path) -> RecordSpan:
    """Return the time of a trace of a file, from its header."""
    stats = trace.stats
    # Zeros that the processing put before and after the record are no part of it
    pads = stats.get("per_obspy", {})
    start = stats.starttime + (pads.get("pad_before") or 0.0)
    end = stats.endtime - (pads.get("pad_after") or 0.0)
    # The K-NET reader of ObsPy keeps the header apart
    event = header_event(knet_event(trace) if "knet" in stats else stats.get("event"))
    return RecordSpan(trace.id, f"{stats.network}.{stats.station}", path, start, end, event)


def station_files(records: Iterable[RecordSpan]) -> dict[str, tuple[Path, ...]]:
    """Return the files of every station, by their names, each once and sorted as paths are."""
    files: dict[str, dict[Path, None]] = defaultdict(dict)
    for record in records:
        files[record.station][record.path] = None
    return {station: tuple(sorted(paths)) for station, paths in sorted(files.items())}


def event_groups(records: Iterable[RecordSpan], gap: float = GAP) -> tuple[EventGroup, ...]:
    """
    Group records into earthquakes.

    Parameters
    ----------
    records : iterable of RecordSpan
        Records of all stations.
    gap : float
        Longest time from the first start of a group to the last, s.

    Returns
    -------
    tuple of EventGroup
        By start. Every record is in a group, a continuous one perhaps in several.
    """
    # Each kind by start
    kinds: dict[Kind, list[RecordSpan]] = defaultdict(list)
    for record in sorted(records, key=lambda one: (one.start.ns, one.record, str(one.path))):
        kinds[record.kind].append(record)
    # Only triggered records found a group where there is one to join
    groups = _join(kinds["triggered"], [], _overlaps, lambda group: group[0].start + gap)
    groups += _join(kinds["continuous"], groups, _overlaps, lambda group: span_of(group)[1])
    groups += _join(kinds["day"], groups, _is_near, lambda group: group[0].start)
    _join_folders(groups, kinds["undated"])
    # The earliest record has founded the group
    groups.sort(key=lambda group: group[0].start.ns)
    return tuple(EventGroup(tuple(members)) for members in groups)


def _join(
    records: Sequence[RecordSpan],
    groups: Sequence[list[RecordSpan]],
    fits: Callable[[list[RecordSpan], RecordSpan], bool],
    latest: Callable[[list[RecordSpan]], UTCDateTime],
) -> list[list[RecordSpan]]:
    """
    Add records of one kind, sorted by start, to the groups that they fit, and group the others.

    These join the new group before them if they start until its latest time.
    """
    new: list[list[RecordSpan]] = []
    for record in records:
        fitting = [group for group in groups if fits(group, record)]
        # A day may hold several earthquakes, of which only one has the record
        if fitting and record.kind == "day":
            fitting = [max(fitting, key=lambda group: len({member.station for member in group}))]
        if not fitting and new and record.start <= latest(new[-1]):
            fitting = [new[-1]]
        for group in fitting:
            group.append(record)
        if not fitting:
            new.append([record])
    return new


def span_of(records: Iterable[RecordSpan]) -> tuple[UTCDateTime, UTCDateTime]:
    """Return the times of the first and the last sample of some records."""
    spans = list(records)
    start = min(record.start for record in spans)
    return start, max(record.end for record in spans)


def chosen_group(
    groups: Sequence[EventGroup],
    time: UTCDateTime | None,
    source: str,
    motion: Callable[[EventGroup], float],
    gap: float = GAP,
) -> EventGroup:
    """
    Return the group to screen.

    Parameters
    ----------
    groups : sequence of EventGroup
        At least one.
    time : UTCDateTime or None
        Origin time of the earthquake, or another time within its records. Without it the group of
        most stations is taken, of these the one of the largest motion, of these the latest.
    source : str
        Source of the time, for the error.
    motion : callable
        Returns the largest motion of a group; called only if several have as many stations.
    gap : float
        Longest time from the time to the start of the records, s.

    Raises
    ------
    CatalogError
        If the records of no group contain the time, or follow it within the gap.
    """
    if time is not None:
        fitting = [group for group in groups if follows(group, time, gap)]
        if not fitting:
            starts = ", ".join(group.label for group in groups)
            problem = f"no record is of {time}, they start {starts}: choose one by records.time"
            raise CatalogError(source, problem)
        # Of two earthquakes within minutes, the one that starts nearer to the time
        return min(fitting, key=lambda group: abs(group.start - time) if group.start else 0.0)
    largest = max(group.stations for group in groups)
    tied = [group for group in groups if group.stations == largest]
    return tied[0] if len(tied) == 1 else max(reversed(tied), key=motion)


def differ_by_clocks(groups: Sequence[EventGroup], screened: EventGroup) -> list[EventGroup]:
    """
    Return the groups that may be of the screened earthquake, at stations whose clocks differ.

    They start within a day of it, no station of them has a record of it, and no place or magnitude
    in their headers contradicts. They may as well be other earthquakes: nothing is joined here.
    """
    stations = {record.station for record in screened.records}
    events = [record.event for record in screened.records if record.event]
    alike = []
    for group in groups:
        if group is screened or not group.start or not screened.start:
            continue
        # A time in a header is that of its clock
        others = [record.event._replace(time="") for record in group.records if record.event]
        is_apart = stations.isdisjoint(record.station for record in group.records)
        is_near = abs(group.start - screened.start) <= _DAY
        fits = all(same_earthquake(one, other) for one in events for other in others)
        if is_apart and is_near and fits:
            alike.append(group)
    return alike


def joining_gap(groups: Sequence[EventGroup]) -> float:
    """Return the gap, s, with which groups are one: up to the next 100 s; 0 without dates."""
    records = (record for group in groups for record in group.records)
    starts = [record.start for record in records if record.is_dated]
    return 100.0 * math.ceil(float(max(starts) - min(starts)) / 100.0) if starts else 0.0


def _join_folders(groups: list[list[RecordSpan]], undated: list[RecordSpan]) -> None:
    """Add records without a date to the group that has most records in their folder."""
    counts = Counter((id(group), record.path.parent) for group in groups for record in group)
    for record in undated:
        in_folder = [counts[id(group), record.path.parent] for group in groups]
        most = max(in_folder, default=0)
        # Without a located group in their folder they join whichever group is screened
        for group in [groups[in_folder.index(most)]] if most else groups:
            group.append(record)
    if undated and not groups:
        groups.append(undated)


def _overlaps(group: list[RecordSpan], record: RecordSpan) -> bool:
    """Return whether a continuous record contains a part of the triggered records of a group."""
    start, end = span_of(member for member in group if not member.is_continuous)
    return bool(record.start <= end and record.end >= start)


def _is_near(group: list[RecordSpan], record: RecordSpan) -> bool:
    """Return whether a group may be of the day of a record that starts at midnight."""
    return bool(-0.5 * _DAY <= group[0].start - record.start <= 1.5 * _DAY)


def follows(group: EventGroup, time: UTCDateTime, gap: float) -> bool:
    """Return whether a group's records contain a time or start within a gap, s, after it."""
    window = group.window
    if window is None:
        return True
    # The day of records without a time begins and ends in whichever zone
    is_timed = any(record.kind in ("triggered", "continuous") for record in group.records)
    before, after = (gap, 0.0) if is_timed else (0.5 * _DAY, 1.5 * _DAY)
    return bool(window[0] - before <= time <= window[1] + after)


def one_earthquake(
    folder: "RecordSource", records: config.Records, event: Event | None
) -> "tuple[list[RecordSource], list[dict[str, object]]]":
    """
    Separate the earthquake to screen from the others in a folder.

    Parameters
    ----------
    folder : RecordSource
        From ``records.folder.find_stations``.
    records : config.Records
        Its ``time`` and ``event_gap``.
    event : Event or None
        The earthquake of the run.

    Returns
    -------
    parts : list of RecordSource
        Stations whose files are read whole, with the rejections of all; then each station of which
        only a window is read.
    earthquakes : list of dict
        Facts of every group, for ``run.json``: ``start``, ``stations``, ``records``, ``undated``
        (records without a date that are taken for this earthquake), ``screened``, ``headers``: the
        earthquake by the headers of its records, see ``earthquakes.earthquake``; and
        ``joined_by``: the ``records.event_gap``, s, that takes a group for the screened earthquake,
        from which it may differ by its clocks only; else None.

    Raises
    ------
    CatalogError
        If no record is of the configured time or the origin time.
    """
    gap = records.event_gap
    groups = event_groups(folder.records, gap)
    time, source = event and origin_of(event).time, "records.event"
    if records.time is not None:
        time, source = UTCDateTime(records.time), "records.time"
    group = chosen_group(groups, time, source, partial(largest_motion, folder), gap)
    alike = differ_by_clocks(groups, group)
    joined_by = joining_gap([group, *alike])
    facts = [_facts(other, group, joined_by if other in alike else None) for other in groups]
    # Without an event of the configuration that of the headers counts
    if event is None:
        folder = folder._replace(reader=reader_of_event(folder.reader, group_event(group, gap)))
    # Everything that is not of this earthquake is listed
    members = {record.key for record in group.records}
    others = [record for record in folder.records if record.key not in members]
    rows = _rejections(others, group, alike, joined_by)
    return _parts(folder._replace(rejected=(*folder.rejected, *rows)), group, others), facts


def _facts(group: EventGroup, screened: EventGroup, gap: float | None) -> dict[str, object]:
    """Return the facts of a group, with the gap that takes it for the screened one."""
    headers = group_event(group)
    return {
        "start": group.label,
        "stations": group.stations,
        "records": len(group.records),
        "undated": sum(not record.is_dated for record in group.records),
        "screened": group is screened,
        "headers": headers.facts if headers else None,
        "joined_by": gap,
    }


def _parts(
    folder: "RecordSource", group: EventGroup, others: Iterable[RecordSpan]
) -> "list[RecordSource]":
    """Return the stations of a group; the first part has the rejections."""
    whole, windows = {}, []
    mixed = {record.path for record in others}
    for station, paths in station_files(group.records).items():
        own = [record for record in group.records if record.station == station]
        limits = {}
        # Hours of record are cut to the time of the triggered records of all stations
        if any(record.end - record.start > HOURS for record in own):
            limits = _limits(group)
        # A file with records of several earthquakes is cut to the chosen one
        elif not mixed.isdisjoint(paths):
            limits = dict(zip(("start", "end"), span_of(own), strict=True))
        # Stations of which only a window is read have a separate reader
        if limits:
            reader = partial(folder.reader, **limits)
            part = folder._replace(stations={station: paths}, rejected=(), reader=reader)
            windows.append(part)
        else:
            whole[station] = paths
    return [folder._replace(stations=whole), *windows]


def _limits(group: EventGroup) -> dict[str, UTCDateTime]:
    """Return the window of a group as a reader takes it; empty without any date."""
    if group.window is None:
        return {}
    return {"start": group.window[0] - MARGIN, "end": group.window[1] + MARGIN}


def largest_motion(folder: "RecordSource", group: EventGroup) -> float:
    """Return the largest acceleration of a group's readable records, m/s2; 0 without any."""
    largest = 0.0
    for station, paths in station_files(group.records).items():
        stream, _ = folder.reader(paths, folder.inventory, station, **_limits(group))
        for trace in stream:
            peak, unit = peak_motion(trace)
            largest = max(largest, peak if unit == "m/s2" else 0.0)
    return largest


def peak_motion(trace: Trace) -> tuple[float, str]:
    """Return the largest distance from the mean and its unit; of raw counts by the sensitivity."""
    if not trace.stats.npts:
        return 0.0, ""
    stats, scale, unit = trace.stats, 1.0, trace.stats.units
    if unit == "counts":
        has_response = "response" in stats
        scale = 1.0 / stats.response.instrument_sensitivity.value if has_response else stats.calib
        unit = _UNITS[stats.quantity]
    # Raw records have an offset
    return float(np.abs(trace.data - trace.data.mean()).max()) * scale, unit


def _rejections(
    records: Iterable[RecordSpan], screened: EventGroup, alike: list[EventGroup], gap: float
) -> list[Rejection]:
    """Return the rows of records that are of another earthquake, or perhaps of another clock."""
    by_clock = {record.key for group in alike for record in group.records}
    rows = []
    for record in records:
        start = str(record.start)[:16] if record.is_dated else "without a date"
        reason = f"belongs to another earthquake: starts {start}, the screened one {screened.label}"
        # Whether it is one is for the user to say
        if record.key in by_clock:
            reason = (
                f"starts {start}, the screened records {screened.label}: another earthquake, or "
                "the same by a clock that differs, as no station has records of both; "
                f"records.event_gap = {gap:g} takes them as one"
            )
        rows.append(Rejection("record", record.record, str(record.path), None, (reason,)))
    return rows


def group_event(group: EventGroup, gap: float = GAP) -> AgreedEvent | None:
    """
    Return the earthquake by the headers of a group's records; None if no header describes one.

    Parameters
    ----------
    group : EventGroup
        Records of one earthquake.
    gap : float
        Longest time from the origin to the start of the records, s; an origin at another time is
        no earthquake of these records.
    """
    headers = agreed_event((record.station, record.event) for record in group.records)
    if headers is None or headers.event is None or not headers.event.time:
        return headers
    if follows(group, UTCDateTime(headers.event.time), gap):
        return headers
    # An origin hours away: the headers or the clocks are wrong
    stations = sorted({record.station for record in group.records if record.event})
    return AgreedEvent(None, 0, dict.fromkeys(stations, headers.event) | headers.others)


def reader_of_event(reader: "Reader", headers: AgreedEvent | None) -> "Reader":
    """Return a reader of stations whose records have the earthquake of most headers, if any has."""
    if headers is None:
        return reader
    # Headers that contradict are for the user to judge
    others = "; ".join(f"{name}: {event}" for name, event in headers.others.items())
    if headers.event is None:
        if others:
            message = "headers of records describe no common earthquake: %s"
            log.warning(message, shortened(others))
        return reader
    if others:
        message = "%d headers describe another earthquake than the %d of most, %s: %s"
        count = len(headers.others)
        log.warning(message, count, headers.stations, headers.event, shortened(others))
    return partial(reader, event=headers.event)
