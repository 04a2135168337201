"""What records a folder, an archive, a file or a workspace holds, one row a trace."""

from functools import partial
from pathlib import Path
from typing import NamedTuple

import numpy as np
from obspy import Trace

from per_obspy.errors import Rejection
from per_obspy.records.asdf import find_asdf_stations, is_asdf, read_asdf_station
from per_obspy.records.folder import find_stations, read_station

_UNITS = {"acceleration": "m/s2", "velocity": "m/s", "displacement": "m"}


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
        s.
    duration : float
        s.
    azimuth : float or None
        Of a horizontal sensor, degrees clockwise from north.
    latitude, longitude : float or None
        Degrees.
    peak : float
        Largest distance from the mean, in ``unit``; of raw counts by the sensitivity alone.
    unit : str
    file : str
        Seen from the folder that was named.
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


def describe_records(
    path: str | Path, stationxml: str | Path | None = None
) -> tuple[tuple[RecordInfo, ...], tuple[Rejection, ...]]:
    """
    Return a row for every record that can be read, and a rejection with its reasons for everything else.

    Parameters
    ----------
    path : str or Path
        Folder, archive, waveform file or ASDF workspace (of which waveforms of all tags are
        described).
    stationxml : str or Path, optional
        A StationXML file or a folder of them, if it is not beside the records.

    Raises
    ------
    CatalogError
        If there is nothing that could be a record.
    """
    given = Path(path)
    if given.is_file() and is_asdf(given):
        found, reader = find_asdf_stations(given, "*"), partial(read_asdf_station, tag="*")
    else:
        found, reader = find_stations(given, stationxml), partial(read_station)
    records, rejected = [], list(found.rejected)
    for name, paths in found.stations.items():
        stream, unread = reader(paths, found.inventory, name)
        rejected += unread
        records += [_described(trace, given) for trace in stream if trace.stats.npts]
        rejected += [
            Rejection("record", trace.id, str(trace.stats.source), None, ("it has no samples",))
            for trace in stream
            if not trace.stats.npts
        ]
    return tuple(records), tuple(rejected)


def _described(trace: Trace, given: Path) -> RecordInfo:
    stats, place = trace.stats, trace.stats.get("coordinates") or {}
    scale, unit = _scale(trace)
    source = Path(stats.source)
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
        peak=float(np.abs(trace.data - trace.data.mean()).max()) * scale,
        unit=unit,
        file=source.name if source == given else str(source.relative_to(given)),
    )


def _scale(trace: Trace) -> tuple[float, str]:
    """Return what a sample counts for, and its unit."""
    stats = trace.stats
    if stats.units != "counts":
        return 1.0, stats.units
    if "response" in stats:
        return 1.0 / stats.response.instrument_sensitivity.value, _UNITS[stats.quantity]
    return stats.calib, _UNITS[stats.quantity]
