"""
MiniSEED 3 (FDSN): any encoding of numbers that libmseed decodes, with source identifiers.

Records that follow each other become one trace, as ObsPy joins those of miniSEED 2. What ObsPy has
no place for stands in ``stats.mseed3``. The reader is libmseed, by the package ``pymseed``.
"""

import json
from collections.abc import Iterator
from importlib import import_module
from pathlib import Path
from types import ModuleType
from typing import Any, BinaryIO, NamedTuple

import numpy as np
from numpy.typing import NDArray
from obspy import Stream, Trace, UTCDateTime

from per_obspy.errors import MissingExtra, RecordRejected, require_extra
from per_obspy.formats.text.lines import WaveformFile, head, named_content, write_content

#: Start of every record: letters and version.
_START = b"MS\x03"

#: Kinds of samples in libmseed's letters; "t" are characters, as of a log.
_TEXT = "t"
_LETTERS = {"int32": "i", "float32": "f", "float64": "d"}

#: Encodings that can be written, by the type of the samples; the first one is the default.
_ENCODINGS = {"i": ("STEIM2", "STEIM1", "INT32", "INT16"), "f": ("FLOAT32",), "d": ("FLOAT64",)}

#: Bytes of a record that is written, as most archives have them.
_RECORD_LENGTH = 4096

#: Largest step between records that is still none, as a part of the sample interval: libmseed's.
_JOINED = 0.5


class _Kind(NamedTuple):
    """What is equal in all records of a trace."""

    identifier: str
    rate: float  # Hz
    version: int
    encoding: str


class _Record(NamedTuple):
    """One record with numbers."""

    kind: _Kind
    start: int  # ns since 1970
    flags: int
    samples: NDArray[Any]
    extra: str  # JSON


def is_miniseed3(file: WaveformFile) -> bool:
    """Check whether a file starts like miniSEED 3."""
    return head(file, len(_START)) == _START


def read_miniseed3(file: WaveformFile, headonly: bool = False, **_unused: Any) -> Stream:
    """
    Read miniSEED 3; a checksum that is wrong, or a record that is cut, rejects the file.

    Parameters
    ----------
    file : str, Path or binary file
    headonly : bool
        Leave the samples out; their number stays.

    Returns
    -------
    Stream
        One trace per run of records without a gap, in the units of the file. ``stats.mseed3`` has
        ``source_identifier``, ``publication_version``, ``encoding``, ``flags`` (all bits that any
        record has) and ``extra_headers``: pairs of the first sample and the headers from there on.

    Raises
    ------
    RecordRejected
        If a record is damaged, has no FDSN source identifier, or the file holds texts alone.
    """
    name, content = named_content(file)
    # Records of several channels alternate in most files
    runs: list[list[_Record]] = []
    last: dict[_Kind, list[_Record]] = {}
    for record in _records(content, name):
        run = last.get(record.kind)
        if run is None or not _follows(run[-1], record):
            run = last[record.kind] = []
            runs.append(run)
        run.append(record)
    if not runs:
        raise RecordRejected(name, "it holds no samples, only texts")
    return Stream([_trace(run, name, headonly) for run in runs])


def _records(content: bytes, name: str) -> Iterator[_Record]:
    """Yield the records with numbers."""
    library = _pymseed(name)
    number = 0
    try:
        for number, record in enumerate(
            library.MS3Record.from_buffer(content, unpack_data=True), 1
        ):
            if record.formatversion != 3:
                reason = f"record {number} is miniSEED {record.formatversion}, the first one is 3"
                raise RecordRejected(name, reason)
            # Texts stand beside the motion, as the log of an instrument
            if not record.numsamples or record.sampletype == _TEXT:
                continue
            if not 0 < record.samprate < np.inf:
                reason = (
                    f"record {number}, sample rate: {record.samprate:g} Hz, expected more than 0"
                )
                raise RecordRejected(name, reason)
            kind = _Kind(record.sourceid, record.samprate, record.pubversion, record.encoding_str())
            # The samples belong to the library, which reads the next record into their place
            samples = record.np_datasamples.copy()
            yield _Record(kind, record.starttime, record.flags, samples, record.extra)
    except (library.MiniSEEDError, ValueError) as error:
        reason = " ".join(str(error).split())
        raise RecordRejected(name, f"record {number + 1}: {reason}") from error


def _follows(last: _Record, record: _Record) -> bool:
    """Return whether a record starts where the one before it ends."""
    interval = 1e9 / last.kind.rate
    step = record.start - last.start - last.samples.size * interval
    return abs(step) <= _JOINED * interval


def _trace(run: list[_Record], name: str, headonly: bool) -> Trace:
    """Return the trace of records that follow each other."""
    first = run[0]
    try:
        network, station, location, channel = _pymseed(name).sourceid2nslc(first.kind.identifier)
    except ValueError as error:
        reason = f"source identifier {first.kind.identifier!r} is not one of the FDSN"
        raise RecordRejected(name, reason) from error
    sizes = [record.samples.size for record in run]
    # What ObsPy has no place for is kept as it is
    header = {
        "network": network,
        "station": station,
        "location": location,
        "channel": channel,
        "sampling_rate": first.kind.rate,
        "starttime": UTCDateTime(ns=first.start),
        "mseed3": {
            "source_identifier": first.kind.identifier,
            "publication_version": first.kind.version,
            "encoding": first.kind.encoding,
            "flags": int(np.bitwise_or.reduce([record.flags for record in run])),
            "extra_headers": _extra_headers(run, sizes, name),
        },
    }
    # ObsPy shows heads by their number of samples
    if headonly:
        return Trace(header=header | {"npts": sum(sizes)})
    return Trace(np.concatenate([record.samples for record in run]), header)


def _extra_headers(
    run: list[_Record], sizes: list[int], name: str
) -> list[tuple[int, dict[str, Any]]]:
    """Return where extra headers begin or change, in samples, and what they are."""
    changes: list[tuple[int, dict[str, Any]]] = []
    starts = np.cumsum([0, *sizes[:-1]])
    last = ""
    for start, record in zip(starts, run, strict=True):
        if record.extra == last:
            continue
        last = record.extra
        # The library does not look into them
        try:
            changes.append((int(start), json.loads(last) if last else {}))
        except ValueError as error:
            raise RecordRejected(name, f"extra headers are not JSON: {error}") from error
    return changes


def write_miniseed3(
    stream: Stream,
    filename: str | Path | BinaryIO,
    encoding: str | None = None,
    record_length: int = _RECORD_LENGTH,
    **_unused: Any,
) -> None:
    """
    Write traces as miniSEED 3, with the ``stats.mseed3`` that the reader gives.

    Parameters
    ----------
    stream : Stream
        Samples are int32, float32 or float64.
    filename : str, Path or binary file
    encoding : str, optional
        STEIM2 (default), STEIM1, INT32 or INT16 for integers; FLOAT32 and FLOAT64 for the others.
    record_length : int
        Largest length of a record, bytes.

    Raises
    ------
    ValueError
        If samples have another type, are masked, or do not fit the encoding.
    """
    library = _pymseed(str(filename))
    records = [
        record for trace in stream for record in _packed(library, trace, encoding, record_length)
    ]
    write_content(filename, b"".join(records))


def _packed(
    library: ModuleType, trace: Trace, encoding: str | None, record_length: int
) -> Iterator[bytes]:
    """Yield the records of a trace; extra headers begin a record where they change."""
    letter, name = _encoding(trace, encoding)
    stats = trace.stats
    # Runs of equal extra headers; the first begins with the trace
    changes = list(stats.get("mseed3", {}).get("extra_headers", []))
    if not changes or changes[0][0]:
        changes.insert(0, (0, {}))
    ends = [start for start, _ in changes[1:]] + [stats.npts]
    record = _template(library, stats, library.DataEncoding[name], record_length)
    # A time of its own for each run
    for (start, extra), end in zip(changes, ends, strict=True):
        record.starttime = stats.starttime.ns + round(start * 1e9 / stats.sampling_rate)
        record.extra = json.dumps(extra) if extra else ""
        yield from record.generate(np.ascontiguousarray(trace.data[start:end]), letter)


def _template(library: ModuleType, stats: Any, encoding: int, record_length: int) -> Any:
    """Return a record of the library with what all records of a trace have."""
    record = library.MS3Record(reclen=record_length, encoding=encoding)
    record.formatversion = 3
    codes = (stats.network, stats.station, stats.location, stats.channel)
    record.sourceid = library.nslc2sourceid(*codes)
    record.samprate = stats.sampling_rate
    # What the reader keeps, or the usual
    kept = stats.get("mseed3", {})
    record.pubversion, record.flags = kept.get("publication_version", 1), kept.get("flags", 0)
    return record


def _encoding(trace: Trace, asked: str | None) -> tuple[str, str]:
    """Return the library's letter for the samples, and the name of the encoding."""
    # Other types would lose digits
    letter = _LETTERS.get(trace.data.dtype.name, "")
    if not letter or np.ma.isMaskedArray(trace.data):
        raise ValueError(
            f"{trace.id}: samples must be int32, float32 or float64 without a mask, "
            f"got {trace.data.dtype.name}"
        )
    name = asked or _ENCODINGS[letter][0]
    if name not in _ENCODINGS[letter]:
        expected = ", ".join(_ENCODINGS[letter])
        raise ValueError(f"{trace.id}: encoding must be one of {expected}, got {name!r}")
    return letter, name


def _pymseed(name: str) -> ModuleType:
    """Return the library, an extra of this package; without it the file is rejected."""
    try:
        require_extra("miniseed3", "pymseed")
    except MissingExtra as error:
        raise RecordRejected(name, str(error)) from error
    return import_module("pymseed")
