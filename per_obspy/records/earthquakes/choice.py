"""Choose the one earthquake of a folder that is screened, and reject the records of others."""

import logging
from collections.abc import Iterable
from functools import partial
from pathlib import Path

import numpy as np
from obspy import Trace, UTCDateTime
from obspy.core.event import Event

from per_obspy import config
from per_obspy.errors import Rejection, shortened
from per_obspy.records.earthquakes.earthquake import AgreedEvent, agreed_event, origin_of
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
from per_obspy.records.folder import Reader, RecordSource

log = logging.getLogger(__name__)

_UNITS = {"acceleration": "m/s2", "velocity": "m/s", "displacement": "m"}


def one_earthquake(
    folder: RecordSource, records: config.Records, event: Event | None
) -> tuple[list[RecordSource], list[dict[str, object]]]:
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
    folder: RecordSource, group: EventGroup, others: Iterable[RecordSpan]
) -> list[RecordSource]:
    """Return the stations of a group; the first part has the rejections."""
    whole, windows = dict[str, tuple[Path, ...]](), list[RecordSource]()
    mixed = {record.path for record in others}
    for station, paths in station_files(group.records).items():
        own = [record for record in group.records if record.station == station]
        limits = dict[str, UTCDateTime]()
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


def largest_motion(folder: RecordSource, group: EventGroup) -> float:
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
    headers = agreed_event((record.station, record.event) for record in group.records)
    if headers is None or headers.event is None or not headers.event.time:
        return headers
    if follows(group, UTCDateTime(headers.event.time), gap):
        return headers
    # An origin hours away: the headers or the clocks are wrong
    stations = sorted({record.station for record in group.records if record.event})
    return AgreedEvent(None, 0, dict.fromkeys(stations, headers.event) | headers.others)


def reader_of_event(reader: Reader, headers: AgreedEvent | None) -> Reader:
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
