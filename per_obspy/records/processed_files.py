"""
Files of records that this package processed: MiniSEED and a JSON description of the same name.

The samples are float64 as they are in memory, so that spectra of the file are those of the record:
Steim compression holds whole numbers only, and float32 would round. The JSON has the words that
MiniSEED lacks: for each trace those of ``formats/text/vocabulary.py``, the steps of the processing
and every number chosen on the way; and the hash of the MiniSEED file, so that neither is ever read
with another's partner.
"""

import json
from io import BytesIO
from pathlib import Path
from typing import Any

import numpy as np
from obspy import Stream, Trace, UTCDateTime
from obspy.core import AttribDict

from per_obspy.errors import PerError, RecordRejected
from per_obspy.files import bytes_hash, file_hash, written_whole

#: words of ``trace.stats`` that a description has where the trace has them
STATS_WORDS = (
    "network",
    "station",
    "location",
    "channel",
    "delta",
    "units",
    "quantity",
    "processing_level",
    "coordinates",
    "coordinates_source",
    "coordinates_conflict",
    "event",
    "sensor_azimuth",
    "sensor_dip",
    "sensor_location",
    "station_name",
    "site_class",
    "vs30",
    "simulated",
    "corners",
    "digitised",
    "per_obspy",
    "processing",
)

#: words whose wrong type would stop the processing later -> their types
_KINDS_OF_WORDS: dict[str, type | tuple[type, ...]] = {
    "units": str,
    "quantity": str,
    "processing_level": str,
    "coordinates": AttribDict,
    "coordinates_source": str,
    "coordinates_conflict": str,
    "event": AttribDict,
    "site_class": str,
    "vs30": (int, float),
    "sensor_azimuth": (int, float),
    "sensor_dip": (int, float),
    "corners": AttribDict,
    "per_obspy": AttribDict,
    "processing": list,
}

_LENGTHS = {"network": 2, "station": 5, "location": 2, "channel": 3}  # of codes in MiniSEED


def write_processed(stream: Stream, path: Path) -> dict[str, Any]:
    """
    Write traces to one MiniSEED file, whole or not at all, and return their descriptions.

    Parameters
    ----------
    stream : Stream
        Processed traces of one station.
    path : Path
        MiniSEED file. Codes longer than the format allows are cut there; the JSON has them whole.

    Returns
    -------
    dict
        ``{"traces": [...]}``: one description per trace, in the order of the file.
    """
    with written_whole(path) as part, part.open("wb") as file:
        for trace in stream:
            # ObsPy's writer of MiniSEED ignores errors of the disk: only memory is safe
            content = BytesIO()
            _with_short_codes(trace).write(content, format="MSEED", encoding="FLOAT64")
            file.write(content.getbuffer())
    return {"traces": [_description(trace) for trace in stream]}


def write_description(path: Path, facts: dict[str, Any]) -> None:
    """Write the JSON of a MiniSEED file of :func:`write_processed`."""
    with written_whole(path.with_suffix(".json")) as part:
        part.write_text(json.dumps({"shard": file_hash(path), **facts}), encoding="utf-8")


def read_descriptions(path: Path, content: bytes | None = None) -> list[dict[str, Any]] | None:
    """
    Read the descriptions of the traces of a MiniSEED file; None where there is no JSON of its name.

    Parameters
    ----------
    path : Path
        MiniSEED file.
    content : bytes, optional
        Its bytes, where it has been read already.

    Raises
    ------
    RecordRejected
        If the JSON describes another file of this name.
    """
    note_file = path.with_suffix(".json")
    if not note_file.is_file():
        return None
    try:
        note = json.loads(note_file.read_text(encoding="utf-8"))
        descriptions: list[dict[str, Any]] = note["traces"]
        described_hash = note["shard"]
    except (OSError, ValueError, KeyError, TypeError, RecursionError):
        return None
    # A file that changed after its description was written
    found = file_hash(path) if content is None else bytes_hash(content)
    if described_hash != found:
        raise RecordRejected(
            str(path), f"{path.with_suffix('.json').name} describes another file of this name"
        )
    return descriptions


def described(stream: Stream, path: Path, content: bytes | None = None) -> Stream:
    """
    Return traces just read from a file with the words of its JSON; unchanged where there is none.

    Parameters
    ----------
    stream : Stream
        Traces of the file.
    path : Path
        MiniSEED file.
    content : bytes, optional
        Its bytes, where it has been read already.

    Raises
    ------
    RecordRejected
        If the JSON describes another file, or other traces.
    """
    descriptions = read_descriptions(path, content)
    if descriptions is None:
        return stream
    # Words are as this package wrote them, unless the file was edited
    try:
        _require_same_lengths(stream, descriptions, path)
        return _with_words(stream, descriptions)
    except PerError:
        raise
    except Exception as error:
        problem = f"{path.with_suffix('.json').name} is no description of records: {error!r}"
        raise RecordRejected(str(path), problem) from error


def _with_words(stream: Stream, descriptions: list[dict[str, Any]]) -> Stream:
    """Return traces with their words in groups, as the plugins of the formats give them."""
    out = stream.copy()
    for trace, words in zip(out, descriptions, strict=True):
        known = {name: _group(words[name]) for name in STATS_WORDS if name in words}
        trace.stats.update(known)
        # ObsPy takes words of any type
        for name, kind in _KINDS_OF_WORDS.items():
            if name in known and not isinstance(known[name], kind):
                raise TypeError(f"{name} is {known[name]!r}")
    return out


def _require_same_lengths(stream: Stream, descriptions: list[dict[str, Any]], path: Path) -> None:
    """Refuse descriptions of other traces."""
    lengths = [description["npts"] for description in descriptions]
    if lengths != [trace.stats.npts for trace in stream]:
        raise RecordRejected(str(path), f"{path.with_suffix('.json').name} describes other traces")


def _with_short_codes(trace: Trace) -> Trace:
    """Return the samples under codes that MiniSEED can hold."""
    codes = {name: trace.stats[name][:length] for name, length in _LENGTHS.items()}
    times = {"starttime": trace.stats.starttime, "delta": trace.stats.delta}
    return Trace(np.asarray(trace.data, dtype=np.float64), codes | times)


def _description(trace: Trace) -> dict[str, Any]:
    """Return the words of a trace, as JSON can hold them."""
    description = {
        "id": trace.id,
        "source": Path(trace.stats.get("source", "")).name,
        "start": str(trace.stats.starttime),
        "npts": trace.stats.npts,
    }
    # Groups become plain dictionaries
    for name in STATS_WORDS:
        if name in trace.stats:
            word = trace.stats[name]
            description[name] = _plain(word) if isinstance(word, AttribDict) else word
    return description


def _plain(group: AttribDict) -> dict[str, Any]:
    """Return a group of words as JSON can hold it: times as text."""
    return {
        name: str(word) if isinstance(word, UTCDateTime) else word for name, word in group.items()
    }


def _group(word: Any) -> Any:
    """Return a dictionary of JSON as a group of words, its time as one; any other word as it is."""
    if not isinstance(word, dict):
        return word
    time = {"time": UTCDateTime(word["time"])} if "time" in word else {}
    return AttribDict({**word, **time})
