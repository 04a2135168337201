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
from functools import partial
from pathlib import Path
from typing import Any

import netCDF4
import numpy as np
from obspy import Inventory, Stream, Trace, UTCDateTime, read_events, read_inventory
from obspy.core import AttribDict
from obspy.core.event import Event

from per_obspy.errors import CatalogError, PerError, RecordRejected, Rejection
from per_obspy.records.folder import Files, RecordSource
from per_obspy.records.metadata import merged_inventory, with_metadata
from per_obspy.records.obspy_readers import LARGEST_UNPACKED, read_bytes_with_obspy
from per_obspy.units import motion_unit

#: First bytes of an HDF5 file, which every ASDF file is.
ASDF_MARK = b"\x89HDF\r\n\x1a\n"

#: Errors of netCDF, HDF5 and their users for damaged files.
_DAMAGES = (
    *(OSError, RuntimeError, LookupError, AttributeError),
    *(ValueError, TypeError, ArithmeticError),
)

_OUTPUT_UNITS = re.compile(r"<seis_prov:output_units[^>]{0,500}>([^<]{1,100})<")

#: process level of waveforms that are not raw
_PROCESSED = "corrected physical"


def is_asdf(path: Path) -> bool:
    """Check from its first bytes whether a file is HDF5; opening it shows whether it is ASDF."""
    with path.open("rb") as file:
        return file.read(len(ASDF_MARK)) == ASDF_MARK


def find_asdf_stations(path: str | Path, tag: str = "*_unprocessed") -> RecordSource:
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
    inventories, rejected = [], []
    # StationXML of every station, which may be damaged
    with _opened(Path(path)) as file:
        groups = file["Waveforms"].groups if "Waveforms" in file.groups else {}
        tagged = [name for name in sorted(groups) if _names(groups[name], tag)]
        if not tagged:
            tags = {_tag(name) for group in groups.values() for name in _names(group, "*")}
            problem = f"has no waveform of tag {tag}, only of {', '.join(sorted(tags)) or 'none'}"
            raise CatalogError(str(path), problem)
        for name in tagged:
            try:
                inventories += _inventories(groups[name], f"{path}/{name}")
            except RecordRejected as rejection:
                rejected.append(Rejection("file", name, str(path), None, rejection.reasons))
    # All stations are in the one file
    stations: Files = dict.fromkeys(tagged, (Path(path),))
    reader = partial(read_asdf_station, tag=tag)
    return RecordSource(stations, merged_inventory(inventories), tuple(rejected), reader=reader)


def _inventories(group: Any, name: str) -> list[Inventory]:
    """Return the StationXML of a station, if there is any."""
    if "StationXML" not in group.variables:
        return []
    content = _bytes(group.variables["StationXML"])
    return [read_bytes_with_obspy(read_inventory, content, name)]


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
                        with _damage_as(RecordRejected, name, "the workspace is damaged"):
                            trace = _trace(file, group.variables[name])
                        stream += with_metadata(trace, inventory)
                        stream[-1].stats.source = str(path)
                    except RecordRejected as rejection:
                        record = name.split("__")[0]
                        row = Rejection("record", record, str(path), None, rejection.reasons)
                        rejected.append(row)
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
        found = read_bytes_with_obspy(read_events, content, str(path)) if content else []
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
    with _damage_as(CatalogError, str(path), "cannot be read as ASDF"):
        file = netCDF4.Dataset(path)
    # Faults below the groups show while they are read
    with _damage_as(CatalogError, str(path), "the workspace is damaged"), file:
        if "file_format" not in file.ncattrs() or file.getncattr("file_format") != "ASDF":
            raise CatalogError(str(path), "is HDF5, but no ASDF file")
        # A sample that netCDF takes for missing is a sample
        file.set_auto_maskandscale(False)
        yield file


@contextmanager
def _damage_as(
    refusal: type[CatalogError] | type[RecordRejected], name: str, problem: str
) -> Iterator[None]:
    """Turn the errors of libraries for damaged files into a refusal, on one line."""
    try:
        yield
    except PerError:
        raise
    except _DAMAGES as error:
        text = f"{type(error).__name__}: {' '.join(str(error).split())}"
        reason = error.strerror if isinstance(error, OSError) and error.strerror else text
        raise refusal(name, f"{problem}: {reason}") from error


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
    """Return the tag at the end of the name of a waveform."""
    return name.split("__")[-1]


def _trace(file: netCDF4.Dataset, waveform: Any) -> Trace:
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
    provenance = file["Provenance"].variables.get(name) if "Provenance" in file.groups else None
    steps = "" if provenance is None else _bytes(provenance).decode("utf-8", "replace")
    # The unit of the last step; one that is missing or unknown must not be guessed
    word = ["no unit", *_OUTPUT_UNITS.findall(steps)][-1]
    unit = motion_unit(word)
    if unit is None or unit.quantity != "acceleration":
        raise RecordRejected(trace.id, f"its provenance gives {word} as output_units")
    trace.data = trace.data * unit.factor
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


def _auxiliary(file: netCDF4.Dataset, kind: str, name: str) -> dict[str, Any]:
    """Return gmprocess's auxiliary data of a stream or trace, JSON; empty if there is none."""
    group: Any = file
    for part in ("AuxiliaryData", kind, ".".join(name.split(".")[:2])):
        group = group.groups.get(part) if group is not None else None
    if group is None or name not in group.variables:
        return {}
    content: dict[str, Any] = json.loads(_bytes(group.variables[name]))
    return content
