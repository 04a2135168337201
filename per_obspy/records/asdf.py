"""
Workspaces of gmprocess, which are ASDF files (HDF5): waveforms, StationXML and the event.

ASDF keeps a waveform as ``Waveforms/NET.STA/ID__START__END__TAG``, with the sampling rate (Hz) and
the start (ns since 1970) as attributes (Krischer and others 2016). gmprocess adds its processing in
``AuxiliaryData`` and ``Provenance``. netCDF4, which reads HDF5, is enough for that.
"""

import json
import math
import re
from collections.abc import Iterator
from contextlib import contextmanager
from fnmatch import fnmatchcase
from pathlib import Path
from typing import Any

import netCDF4
import numpy as np
import obspy
from obspy import Inventory, Stream, Trace, UTCDateTime
from obspy.core import AttribDict
from obspy.core.event import Event

from per_obspy.errors import CatalogError, PerError, RecordRejected, Rejection
from per_obspy.records.contents.metadata_files import merged_inventory
from per_obspy.records.folder import SourceContents
from per_obspy.records.metadata import with_metadata
from per_obspy.records.obspy_readers import LARGEST_UNPACKED, read_bytes_with_obspy
from per_obspy.units import motion_unit

#: First bytes of an HDF5 file, which every ASDF file is.
ASDF_MARK = b"\x89HDF\r\n\x1a\n"

_OUTPUT_UNITS = re.compile(r"<seis_prov:output_units[^>]{0,500}>([^<]{1,100})<")

#: process level of waveforms that are not raw
_PROCESSED = "corrected physical"


def is_asdf(path: Path) -> bool:
    """Check from its first bytes whether a file is HDF5; opening it shows whether it is ASDF."""
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
        stations: dict[str, tuple[Path, ...]] = {}
        for name, group in sorted(groups.items()):
            if _names(group, tag):
                stations[name] = (Path(path),)
        if not stations:
            raise CatalogError(str(path), _no_waveform(groups, tag))
        # StationXML of every station, which may be damaged
        inventories, rejected = [], []
        for name in stations:
            try:
                inventories += _inventories(groups[name], f"{path}/{name}")
            except RecordRejected as rejection:
                rejected.append(Rejection("file", name, str(path), None, rejection.reasons))
    return SourceContents(stations, merged_inventory(inventories), tuple(rejected))


def _no_waveform(groups: dict[str, Any], tag: str) -> str:
    """Return the reason why no station is found: the tags that there are."""
    tags: set[str] = set()
    for group in groups.values():
        tags.update(_tag(name) for name in _names(group, "*"))
    return f"has no waveform of tag {tag}, only of {', '.join(sorted(tags)) or 'none'}"


def read_asdf_station(
    paths: tuple[Path, ...], inventory: Inventory | None, station: str, tag: str = "*_unprocessed"
) -> tuple[Stream, tuple[Rejection, ...]]:
    """Read the waveforms of one station and tag, as ``records.folder.read_station`` reads files."""
    stream, rejected = Stream(), []
    for path in paths:
        try:
            with _opened(path) as file:
                group = file["Waveforms"].groups[station]
                # A waveform that is refused does not stop the others
                for name in _names(group, tag):
                    try:
                        stream += with_metadata(_trace(file, group.variables[name]), inventory)
                        stream[-1].stats.source = str(path)
                    except RecordRejected as rejection:
                        record = (name.split("__")[0], str(path), None, rejection.reasons)
                        rejected.append(Rejection("record", *record))
        except CatalogError as error:
            rejected.append(Rejection("station", station, str(path), None, (error.problem,)))
    return stream, tuple(rejected)


def read_asdf_events(path: Path) -> list[Event]:
    """
    Read the events of an ASDF file.

    Raises
    ------
    CatalogError
        If its QuakeML cannot be read.
    """
    with _opened(path) as file:
        content = _bytes(file["QuakeML"]) if "QuakeML" in file.variables else b""
    # A file without QuakeML holds no event
    try:
        found = read_bytes_with_obspy(obspy.read_events, content, str(path)) if content else []
    except RecordRejected as rejection:
        raise CatalogError(str(path), "; ".join(rejection.reasons)) from rejection
    return list(found)


def has_event(path: Path) -> bool:
    """Check whether an ASDF file holds an event."""
    with _opened(path) as file:
        return "QuakeML" in file.variables


@contextmanager
def _opened(path: Path) -> Iterator[netCDF4.Dataset]:
    """Open an ASDF file; whatever HDF5 finds wrong with it becomes a ``CatalogError``."""
    if not path.is_file():
        raise CatalogError(str(path), "cannot be read as ASDF: no such file")
    try:
        file = netCDF4.Dataset(path)
    except Exception as error:
        raise CatalogError(str(path), f"cannot be read as ASDF: {_damage(error)}") from error
    # Faults below the groups show while they are read
    try:
        with file:
            if "file_format" not in file.ncattrs() or file.getncattr("file_format") != "ASDF":
                raise CatalogError(str(path), "is HDF5, but no ASDF file")
            # A sample that netCDF takes for missing is a sample
            file.set_auto_maskandscale(False)
            yield file
    except PerError:
        raise
    except Exception as error:
        raise CatalogError(str(path), f"the workspace is damaged: {_damage(error)}") from error


def _damage(error: Exception) -> str:
    """Return the fault of a file on one line."""
    if isinstance(error, OSError) and error.strerror:
        return error.strerror
    return f"{type(error).__name__}: {' '.join(str(error).split())}"


def _values(variable: Any) -> Any:
    """Return the array of a variable; one of absurd size is refused before it takes memory."""
    size = variable.size * variable.dtype.itemsize
    if size > LARGEST_UNPACKED:
        problem = f"{size} bytes, at most {LARGEST_UNPACKED} are read"
        raise RecordRejected(variable.name, problem)
    return np.asarray(variable[:])


def _bytes(variable: Any) -> bytes:
    """Return the bytes that ASDF keeps as an array."""
    content: bytes = _values(variable).tobytes()
    return content


def _names(group: Any, tag: str) -> list[str]:
    """Return the names of the waveforms of a tag, each channel's in the order of time."""
    waveforms = (name for name in group.variables if name != "StationXML")
    return sorted(name for name in waveforms if fnmatchcase(_tag(name), tag))


def _tag(name: str) -> str:
    return name.split("__")[-1]


def _inventories(group: Any, name: str) -> list[Inventory]:
    """Return the StationXML of a station, if there is any."""
    if "StationXML" not in group.variables:
        return []
    content = _bytes(group.variables["StationXML"])
    return [read_bytes_with_obspy(obspy.read_inventory, content, name)]


def _trace(file: netCDF4.Dataset, waveform: Any) -> Trace:
    """Return a waveform, whatever is wrong with which rejects it alone."""
    try:
        return _described_trace(file, waveform)
    except PerError:
        raise
    except Exception as error:
        raise RecordRejected(
            waveform.name, f"the workspace is damaged: {_damage(error)}"
        ) from error


def _described_trace(file: netCDF4.Dataset, waveform: Any) -> Trace:
    """Return a waveform with the words of its processing; without any it counts as raw."""
    identifier, tag = waveform.name.split("__")[0], _tag(waveform.name)
    rate = float(waveform.sampling_rate)
    if not 1e-5 <= rate <= 1e5:
        raise RecordRejected(identifier, f"sampling_rate: {rate:g} Hz is not plausible")
    trace = Trace(_values(waveform))
    trace.id = identifier
    trace.stats.sampling_rate = rate
    trace.stats.starttime = UTCDateTime(ns=int(waveform.starttime))
    # The level belongs to the stream of all components, whose name lacks their letter
    level = _auxiliary(file, "StreamSupplementalStats", f"{identifier[:-1]}_{tag}")
    if _PROCESSED in level.get("standard", {}).get("process_level", ""):
        _describe_processed(file, trace, f"{identifier}_{tag}")
    return trace


def _describe_processed(file: netCDF4.Dataset, trace: Trace, name: str) -> None:
    """Put a processed waveform into m/s2, with the words of the vocabulary."""
    trace.data = trace.data * _output_unit(file, trace, name)
    trace.stats.update(
        {"units": "m/s2", "quantity": "acceleration", "processing_level": "processed"}
    )
    # Corners of the filter, Hz
    parameters = _auxiliary(file, "TraceProcessingParameters", name)
    corners = parameters.get("corner_frequencies", {})
    known = {key: float(corners[key]) for key in ("highpass", "lowpass") if key in corners}
    if not all(map(math.isfinite, known.values())):
        raise RecordRejected(trace.id, f"corner_frequencies: {known} are not finite")
    trace.stats.corners = AttribDict(known)


def _output_unit(file: netCDF4.Dataset, trace: Trace, name: str) -> float:
    """Return the unit of the last step of the processing, m/s2."""
    provenance = file["Provenance"].variables.get(name) if "Provenance" in file.groups else None
    steps = "" if provenance is None else _bytes(provenance).decode("utf-8", "replace")
    units = _OUTPUT_UNITS.findall(steps)
    unit = motion_unit(units[-1]) if units else None
    # A unit that is missing or unknown must not be guessed
    if unit is None or unit.quantity != "acceleration":
        name = units[-1] if units else "no unit"
        raise RecordRejected(trace.id, f"its provenance gives {name} as output_units")
    return unit.factor


def _auxiliary(file: netCDF4.Dataset, kind: str, name: str) -> dict[str, Any]:
    """Return gmprocess's auxiliary data of a stream or trace; empty if there is none."""
    station = ".".join(name.split(".")[:2])
    groups = file.groups.get("AuxiliaryData")
    for part in (kind, station):
        groups = groups.groups.get(part) if groups is not None else None
    # Data of a stream or trace is JSON
    if groups is None or name not in groups.variables:
        return {}
    content: dict[str, Any] = json.loads(_bytes(groups.variables[name]))
    return content
