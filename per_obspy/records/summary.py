"""Summary of a folder, an archive, a file or a workspace of records, one row per trace."""

from collections import defaultdict
from collections.abc import Sequence
from pathlib import Path
from typing import NamedTuple

from obspy import Trace

from per_obspy.errors import Rejection
from per_obspy.processing.account import rejection
from per_obspy.records.asdf import find_asdf_stations, is_asdf
from per_obspy.records.earthquakes.groups import RecordSpan, event_groups, peak_motion, record_span
from per_obspy.records.folder import find_stations

#: Columns that are words of ``trace.stats``.
_SAME_WORDS = (
    "simulated",
    "coordinates_source",
    "coordinates_conflict",
    "site_class",
    "vs30",
)


class RecordInfo(NamedTuple):
    """
    One record.

    Attributes
    ----------
    record : str
        ``NET.STA.LOC.CHA``.
    format : str
        As ObsPy names it.
    level : str
        ``"raw"``, ``"processed"``, or empty if unknown.
    start : str
        Time of the first sample, ISO 8601, UTC.
    dt : float
        Sampling interval, s.
    duration : float
        From the first to the last sample, s.
    azimuth : float or None
        Of a horizontal sensor, degrees clockwise from north.
    latitude, longitude : float or None
        Degrees.
    peak : float
        Largest distance from the mean, in ``unit``; of raw counts by the sensitivity alone.
    unit : str
        Of the peak.
    file : str
        Path from the folder that was named.
    event : str
        Number and start of the earthquake that the record belongs to, by its time; of several
        where a continuous record holds them or a record has no date.
    simulated : bool
        Whether the motion is simulated.
    coordinates_source : str
        Name of the table of stations, ``"header"`` or ``"StationXML"``; empty if unknown.
    coordinates_conflict : str
        Places of other sources that are more than 1 km away.
    site_class : str
        Of the ground, any word; empty if unknown.
    vs30 : float or None
        Mean shear-wave velocity of the upper 30 m, m/s.
    """

    record: str
    format: str
    level: str
    start: str
    dt: float
    duration: float
    azimuth: float | None
    latitude: float | None
    longitude: float | None
    peak: float
    unit: str
    file: str
    event: str = ""
    simulated: bool = False
    coordinates_source: str = ""
    coordinates_conflict: str = ""
    site_class: str = ""
    vs30: float | None = None


def describe_records(
    path: str | Path, stationxml: str | Path | None = None
) -> tuple[tuple[RecordInfo, ...], tuple[Rejection, ...]]:
    """
    Describe every record that can be read, and reject all else with its reasons.

    Parameters
    ----------
    path : str or Path
        Folder, archive, waveform file or ASDF workspace (of which waveforms of all tags are
        described).
    stationxml : str or Path, optional
        A StationXML file or a folder of them, if it is not in the folder of the records.

    Returns
    -------
    records : tuple of RecordInfo
        One row per record.
    rejected : tuple of Rejection
        Files and records that cannot be read.

    Raises
    ------
    CatalogError
        If no file could be a record.
    """
    root = Path(path)
    if root.is_file() and is_asdf(root):
        found = find_asdf_stations(root, "*")
    else:
        found = find_stations(root, stationxml)
    # Station by station, so that one alone is in memory
    records, spans, rejected = [], [], list(found.rejected)
    for name, paths in found.stations.items():
        stream, unread = found.reader(paths, found.inventory, name)
        rejected += unread
        rejected += [rejection(one, "it has no samples") for one in stream if not one.stats.npts]
        for trace in (one for one in stream if one.stats.npts):
            records.append(_described(trace, root))
            spans.append(record_span(trace, Path(trace.stats.source)))
    # Times of all records show which are of one earthquake; a continuous one may hold several
    rows = zip(records, _events(spans), strict=True)
    return tuple(row._replace(event=event) for row, event in rows), tuple(rejected)


def _events(spans: Sequence[RecordSpan]) -> list[str]:
    """Return number and start of the earthquakes that each record belongs to."""
    numbers: dict[tuple[object, ...], list[str]] = defaultdict(list)
    for number, group in enumerate(event_groups(spans), start=1):
        for record in group.records:
            numbers[record.key].append(f"{number}: {group.label}")
    return [", ".join(numbers[span.key]) for span in spans]


def _described(trace: Trace, root: Path) -> RecordInfo:
    """Return the row of a trace."""
    stats = trace.stats
    place = stats.get("coordinates") or {}
    peak, unit = peak_motion(trace)
    # Seen from the folder that was named
    source = Path(stats.source)
    # Values that neither header nor metadata have stay empty
    return RecordInfo(
        record=trace.id,
        format=stats.get("_format", "ASDF"),
        level=stats.get("processing_level", ""),
        start=str(stats.starttime),
        dt=float(stats.delta),
        duration=float(stats.delta * (stats.npts - 1)),
        azimuth=stats.get("sensor_azimuth"),
        latitude=place.get("latitude"),
        longitude=place.get("longitude"),
        peak=peak,
        unit=unit,
        file=source.name if source == root else str(source.relative_to(root)),
        **{name: stats[name] for name in _SAME_WORDS if name in stats},
    )
