"""Choose the one earthquake of a folder that is screened, and reject the records of others."""

import logging
from collections.abc import Iterable
from functools import partial
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
from obspy import Inventory, Stream, Trace, UTCDateTime
from obspy.core import AttribDict
from obspy.core.event import Event

from per_obspy import config
from per_obspy.errors import Rejection, shortened
from per_obspy.records.archive import LIMITS
from per_obspy.records.earthquakes.earthquake import (
    AgreedEvent,
    Earthquake,
    agreed_event,
    origin_of,
)
from per_obspy.records.earthquakes.groups import (
    GAP,
    HOURS,
    MARGIN,
    EventGroup,
    RecordSpan,
    chosen_group,
    differ_by_clocks,
    event_groups,
    follows,
    joining_gap,
    span_of,
    station_files,
)
from per_obspy.records.folder import SourceContents, read_station

log = logging.getLogger(__name__)

#: Reads a station from its files, metadata and name, as ``records.folder.read_station`` does.
Reader = partial[tuple[Stream, tuple[Rejection, ...]]]

_UNITS = {"acceleration": "m/s2", "velocity": "m/s", "displacement": "m"}


class OneEarthquake(NamedTuple):
    """
    Contents of a folder of which one earthquake is screened.

    Attributes
    ----------
    contents : tuple of (SourceContents, Reader)
        Stations whose files are read whole, with the rejections of all; then each station of which
        only a window is read.
    earthquakes : list of dict
        Facts of every group, for ``run.json``: ``start``, ``stations``, ``records``, ``undated``
        (records without a date that are taken for this earthquake), ``screened``, ``headers``: the
        earthquake by the headers of its records, see ``earthquakes.earthquake``; and
        ``joined_by``: the ``records.event_gap``, s, that takes a group for the screened earthquake,
        from which it may differ by its clocks only; else None.
    """

    contents: tuple[tuple[SourceContents, Reader], ...]
    earthquakes: list[dict[str, object]]


def one_earthquake(
    found: SourceContents, records: config.Records, event: Event | None
) -> OneEarthquake:
    """
    Separate the earthquake to screen from the others in a folder.

    Parameters
    ----------
    found : SourceContents
        Of the folder.
    records : config.Records
        Its ``time`` and ``event_gap``.
    event : Event or None
        The earthquake of the run.

    Raises
    ------
    CatalogError
        If no record is of the configured time or the origin time.
    """
    gap, (time, source) = records.event_gap, _time(records, event)
    groups = event_groups(found.records, gap)
    reader: Reader = partial(read_station)
    if records.archives != LIMITS:
        reader = partial(read_station, limits=records.archives)
    motion = partial(largest_motion, found, reader)
    group = chosen_group(groups, time, source, motion, gap)
    alike = differ_by_clocks(groups, group)
    joined = joining_gap([group, *alike])
    facts = [_facts(other, group, joined if other in alike else None) for other in groups]
    # Without an event of the configuration that of the headers counts
    if event is None:
        reader = reader_of_event(reader, group_event(group, gap))
    # Everything that is not of this earthquake is listed
    members = {record.key for record in group.records}
    others = [record for record in found.records if record.key not in members]
    found = found._replace(rejected=(*found.rejected, *_rejections(others, group, alike)))
    return OneEarthquake(_contents(found, group, {record.path for record in others}, reader), facts)


def read_station_of(
    paths: Iterable[Path],
    inventory: Inventory | None,
    station: str | None = None,
    *,
    event: Earthquake,
    **options: Any,
) -> tuple[Stream, tuple[Rejection, ...]]:
    """
    Read a station as ``records.folder.read_station``, with the earthquake of most headers.

    Parameters
    ----------
    paths, inventory, station, **options
        As for ``read_station``.
    event : Earthquake
        Takes the place of ``stats.event`` of every trace.
    """
    stream, rejected = read_station(paths, inventory, station, **options)
    for trace in stream:
        trace.stats.event = AttribDict(event.words)
    return stream, rejected


def _contents(
    found: SourceContents, group: EventGroup, mixed: set[Path], reader: Reader
) -> tuple[tuple[SourceContents, Reader], ...]:
    """Return the stations of a group with their readers; the first contents have rejections."""
    whole, windows = dict[str, tuple[Path, ...]](), list[tuple[SourceContents, Reader]]()
    for station, paths in station_files(group.records).items():
        own = [record for record in group.records if record.station == station]
        limits = dict[str, UTCDateTime]()
        # Hours of record are cut to the time of the triggered records of all stations
        if any(record.end - record.start > HOURS for record in own):
            limits = _limits(group)
        # A file with records of several earthquakes is cut to the chosen one
        elif not mixed.isdisjoint(paths):
            start, end = span_of(own)
            limits = {"start": start, "end": end}
        # Stations of which only a window is read have a separate reader
        if limits:
            part = found._replace(stations={station: paths}, rejected=())
            windows.append((part, partial(reader, **limits)))
        else:
            whole[station] = paths
    return (found._replace(stations=whole), reader), *windows


def largest_motion(found: SourceContents, reader: Reader, group: EventGroup) -> float:
    """Return the largest acceleration of a group's readable records, m/s2; 0 without any."""
    largest = 0.0
    for station, paths in station_files(group.records).items():
        stream, _ = reader(paths, found.inventory, station, **_limits(group))
        for trace in stream:
            peak, unit = peak_motion(trace)
            largest = max(largest, peak if unit == "m/s2" else 0.0)
    return largest


def peak_motion(trace: Trace) -> tuple[float, str]:
    """Return the largest distance from the mean and its unit; of raw counts by the sensitivity."""
    if not trace.stats.npts:
        return 0.0, ""
    stats, scale = trace.stats, 1.0
    if stats.units == "counts":
        has_response = "response" in stats
        scale = 1.0 / stats.response.instrument_sensitivity.value if has_response else stats.calib
    unit = _UNITS[stats.quantity] if stats.units == "counts" else stats.units
    # Raw records have an offset
    return float(np.abs(trace.data - trace.data.mean()).max()) * scale, unit


def _time(records: config.Records, event: Event | None) -> tuple[UTCDateTime | None, str]:
    """Return the time of the earthquake to screen, if one is known, and where it comes from."""
    if records.time is not None:
        return UTCDateTime(records.time), "records.time"
    if event is None:
        return None, ""
    return origin_of(event).time, "records.event"


def _limits(group: EventGroup) -> dict[str, UTCDateTime]:
    """Return the window of a group as a reader takes it; empty without any date."""
    window = group.window
    if window is None:
        return {}
    return {"start": window[0] - MARGIN, "end": window[1] + MARGIN}


def _rejections(
    records: Iterable[RecordSpan], screened: EventGroup, alike: list[EventGroup]
) -> list[Rejection]:
    """Return the rows of records that are of another earthquake, or perhaps of another clock."""
    gap = joining_gap([screened, *alike])
    by_clock = {record.key for group in alike for record in group.records}
    rows = list[Rejection]()
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
    found = agreed_event((record.station, record.event) for record in group.records)
    if found is None or found.event is None or not found.event.time:
        return found
    if follows(group, UTCDateTime(found.event.time), gap):
        return found
    # An origin hours away: the headers or the clocks are wrong
    stations = {record.station for record in group.records if record.event}
    return AgreedEvent(None, 0, dict.fromkeys(sorted(stations), found.event) | found.others)


def reader_of_event(reader: Reader, found: AgreedEvent | None) -> Reader:
    """Return a reader of stations whose records have the earthquake of most headers, if any has."""
    if found is None:
        return reader
    # Headers that contradict are for the user to judge
    others = "; ".join(f"{name}: {event}" for name, event in found.others.items())
    if others and found.event is None:
        log.warning("headers of records describe no common earthquake: %s", shortened(others))
    elif others:
        message = "%d headers describe another earthquake than the %d of most, %s: %s"
        log.warning(message, len(found.others), found.stations, found.event, shortened(others))
    if found.event is None:
        return reader
    return partial(read_station_of, event=found.event, **reader.keywords)


def _facts(group: EventGroup, screened: EventGroup, gap: float | None) -> dict[str, object]:
    """Return the facts of a group, with the gap that takes it for the screened one."""
    undated = sum(not record.is_dated for record in group.records)
    by_headers = group_event(group)
    return {
        "start": group.label,
        "stations": group.stations,
        "records": len(group.records),
        "undated": undated,
        "screened": group is screened,
        "headers": by_headers.facts if by_headers else None,
        "joined_by": gap,
    }
