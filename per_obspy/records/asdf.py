"""
Workspaces of gmprocess, which are ASDF files (HDF5): raw or processed waveforms, StationXML and the event.

ASDF keeps a waveform as ``Waveforms/NET.STA/ID__START__END__TAG``, with the sampling rate (Hz) and
the start (ns since
1970) as attributes (Krischer and others 2016). gmprocess adds what it did in ``AuxiliaryData`` and ``Provenance``.
netCDF4, which reads HDF5, is enough for that.
"""

import json
import re
from fnmatch import fnmatchcase
from functools import reduce
from operator import add
from pathlib import Path
from typing import Any

import netCDF4
import numpy as np
import obspy
from obspy import Inventory, Stream, Trace, UTCDateTime
from obspy.core import AttribDict
from obspy.core.event import Event

from per_obspy.constants import GAL, STANDARD_GRAVITY
from per_obspy.errors import CatalogError, RecordRejected, Rejection
from per_obspy.records.folder import SourceContents
from per_obspy.records.metadata import with_metadata
from per_obspy.records.obspy_readers import foreign_bytes

#: unit that the provenance says the samples have -> m/s2
_UNITS = {"cm/s^2": GAL, "m/s^2": 1.0, "g": STANDARD_GRAVITY}

#: First bytes of an HDF5 file, which every ASDF file is.
ASDF_MARK = b"\x89HDF\r\n\x1a\n"

_OUTPUT_UNITS = re.compile(r"<seis_prov:output_units[^>]*>([^<]+)<")


def is_asdf(path: Path) -> bool:
    """Tell from its first bytes whether a file is HDF5; whether it is ASDF is said when it is opened."""
    with path.open("rb") as file:
        return file.read(len(ASDF_MARK)) == ASDF_MARK


def find_asdf_stations(path: str | Path, tag: str = "*_unprocessed") -> SourceContents:
    """
    Find the stations that have waveforms of a tag.

    Parameters
    ----------
    path : str or Path
        ASDF file.
    tag : str
        With ``*`` and ``?``; gmprocess calls raw records ``EVENT_unprocessed`` and its results
        ``EVENT_default``.

    Raises
    ------
    CatalogError
        If it is no ASDF file or has no waveform of the tag.
    """
    with _opened(Path(path)) as file:
        groups = file["Waveforms"].groups if "Waveforms" in file.groups else {}
        stations: dict[str, tuple[Path, ...]] = {
            name: (Path(path),) for name, group in sorted(groups.items()) if _names(group, tag)
        }
        if not stations:
            tags = sorted({_tag(name) for group in groups.values() for name in _names(group, "*")})
            raise CatalogError(
                str(path), f"has no waveform of tag {tag}, only of {', '.join(tags) or 'none'}"
            )
        inventories, rejected = [], []
        for name in stations:
            try:
                inventories += _inventories(groups[name], f"{path}/{name}")
            except RecordRejected as rejection:
                rejected.append(Rejection("file", name, str(path), None, rejection.reasons))
    return SourceContents(
        stations, reduce(add, inventories) if inventories else None, tuple(rejected)
    )


def read_asdf_station(
    paths: tuple[Path, ...], inventory: Inventory | None, station: str, tag: str = "*_unprocessed"
) -> tuple[Stream, tuple[Rejection, ...]]:
    """Read the waveforms of one station and tag, as ``records.folder.read_station`` reads files."""
    stream, rejected = Stream(), []
    for path in paths:
        with _opened(path) as file:
            group = file["Waveforms"].groups[station]
            for name in _names(group, tag):
                try:
                    stream += with_metadata(_trace(file, group.variables[name]), inventory)
                    stream[-1].stats.source = str(path)
                except RecordRejected as rejection:
                    rejected.append(
                        Rejection("record", name.split("__")[0], str(path), None, rejection.reasons)
                    )
    return stream, tuple(rejected)


def read_asdf_event(path: Path) -> Event:
    """
    Read the one event of an ASDF file.

    Raises
    ------
    CatalogError
        If it does not hold exactly one event with an origin.
    """
    with _opened(path) as file:
        content = file["QuakeML"][:].tobytes() if "QuakeML" in file.variables else b""
    try:
        events = foreign_bytes(obspy.read_events, content, str(path)) if content else []
    except RecordRejected as rejection:
        raise CatalogError(str(path), "; ".join(rejection.reasons)) from rejection
    if len(events) != 1 or not events[0].origins:
        raise CatalogError(
            str(path), f"must hold one event with an origin, holds {len(events)} events"
        )
    return events[0]


def has_event(path: Path) -> bool:
    """Tell whether an ASDF file holds an event."""
    with _opened(path) as file:
        return "QuakeML" in file.variables


def _opened(path: Path) -> netCDF4.Dataset:
    try:
        file = netCDF4.Dataset(path)
    except OSError as error:
        raise CatalogError(str(path), f"cannot be read as ASDF: {error.strerror}") from error
    if "file_format" not in file.ncattrs() or file.getncattr("file_format") != "ASDF":
        file.close()
        raise CatalogError(str(path), "is HDF5, but no ASDF file")
    file.set_auto_maskandscale(False)  # a sample that netCDF takes for missing is a sample
    return file


def _names(group: Any, tag: str) -> list[str]:
    """Return the names of the waveforms of a tag, each channel's in the order of time."""
    return sorted(
        name for name in group.variables if name != "StationXML" and fnmatchcase(_tag(name), tag)
    )


def _tag(name: str) -> str:
    return name.split("__")[-1]


def _inventories(group: Any, name: str) -> list[Inventory]:
    if "StationXML" not in group.variables:
        return []
    return [foreign_bytes(obspy.read_inventory, group.variables["StationXML"][:].tobytes(), name)]


def _trace(file: netCDF4.Dataset, waveform: Any) -> Trace:
    """Return a waveform with what gmprocess says of it; one of which it says nothing counts as raw."""
    identifier, tag = waveform.name.split("__")[0], _tag(waveform.name)
    trace = Trace(np.asarray(waveform[:]))
    trace.id = identifier
    trace.stats.sampling_rate = float(waveform.sampling_rate)
    trace.stats.starttime = UTCDateTime(ns=int(waveform.starttime))
    stream_name = f"{identifier[:-1]}_{tag}"
    if "corrected physical" in _said(file, "StreamSupplementalStats", stream_name).get(
        "standard", {}
    ).get("process_level", ""):
        _describe_processed(file, trace, f"{identifier}_{tag}")
    return trace


def _describe_processed(file: netCDF4.Dataset, trace: Trace, name: str) -> None:
    provenance = file["Provenance"].variables.get(name) if "Provenance" in file.groups else None
    units = _OUTPUT_UNITS.findall(
        "" if provenance is None else provenance[:].tobytes().decode("utf-8", "replace")
    )
    if not units or units[-1] not in _UNITS:
        raise RecordRejected(
            trace.id, f"its provenance gives {units[-1] if units else 'no unit'} as output_units"
        )
    trace.data = trace.data * _UNITS[units[-1]]
    trace.stats.update(
        {"units": "m/s2", "quantity": "acceleration", "processing_level": "processed"}
    )
    corners = _said(file, "TraceProcessingParameters", name).get("corner_frequencies", {})
    trace.stats.corners = AttribDict(
        {key: corners[key] for key in ("highpass", "lowpass") if key in corners}
    )


def _said(file: netCDF4.Dataset, kind: str, name: str) -> dict[str, Any]:
    """Return what gmprocess says of a stream or trace in its auxiliary data; nothing if it says nothing."""
    station = ".".join(name.split(".")[:2])
    groups = file.groups.get("AuxiliaryData")
    for part in (kind, station):
        groups = groups.groups.get(part) if groups is not None else None
    if groups is None or name not in groups.variables:
        return {}
    said: dict[str, Any] = json.loads(groups.variables[name][:].tobytes())
    return said
