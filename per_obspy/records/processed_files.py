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

from per_obspy.errors import RecordRejected
from per_obspy.files import bytes_hash, file_hash, written_whole

_NUMBER = (int, float)

#: words of ``trace.stats`` that a description has where the trace has them -> their types, where
#: a wrong one would stop the processing later
STATS_WORDS: dict[str, type | tuple[type, ...]] = {
    **dict.fromkeys(("network", "station", "location", "channel", "delta"), object),
    **dict.fromkeys(("units", "quantity", "processing_level"), str),
    "coordinates": AttribDict,
    "coordinates_source": str,
    "coordinates_conflict": str,
    "event": AttribDict,
    **dict.fromkeys(("sensor_azimuth", "sensor_dip"), _NUMBER),
    **dict.fromkeys(("sensor_location", "station_name"), object),
    "site_class": str,
    "vs30": _NUMBER,
    "simulated": object,
    "corners": AttribDict,
    "digitised": object,
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
            codes = {name: trace.stats[name][:length] for name, length in _LENGTHS.items()}
            times = {"starttime": trace.stats.starttime, "delta": trace.stats.delta}
            short = Trace(np.asarray(trace.data, dtype=np.float64), codes | times)
            # ObsPy's writer of MiniSEED ignores errors of the disk: only memory is safe
            content = BytesIO()
            short.write(content, format="MSEED", encoding="FLOAT64")
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
    name = path.with_suffix(".json").name
    # Words are as this package wrote them, unless the file was edited
    try:
        lengths = [words["npts"] for words in descriptions]
        is_same = lengths == [trace.stats.npts for trace in stream]
        out = stream.copy()
        for trace, words in zip(out, descriptions if is_same else (), strict=is_same):
            _add_words(trace, words)
    except (LookupError, TypeError, ValueError, AttributeError, ArithmeticError) as error:
        problem = f"{name} is no description of records: {error!r}"
        raise RecordRejected(str(path), problem) from error
    if not is_same:
        raise RecordRejected(str(path), f"{name} describes other traces")
    return out


def _add_words(trace: Trace, words: dict[str, Any]) -> None:
    """Give a trace its words in groups, as the plugins of the formats do."""
    known = {name: words[name] for name in STATS_WORDS if name in words}
    # Groups are dictionaries of JSON, which has their times as texts
    for name, word in known.items():
        if isinstance(word, dict):
            time = {"time": UTCDateTime(word["time"])} if "time" in word else {}
            known[name] = AttribDict({**word, **time})
    trace.stats.update(known)
    # ObsPy takes words of any type
    for name, word in known.items():
        if not isinstance(word, STATS_WORDS[name]):
            raise TypeError(f"{name} is {word!r}")


def _description(trace: Trace) -> dict[str, Any]:
    """Return the words of a trace, as JSON can hold them."""
    description = {
        "id": trace.id,
        "source": Path(trace.stats.get("source", "")).name,
        "start": str(trace.stats.starttime),
        "npts": trace.stats.npts,
    }
    # Groups become plain dictionaries, and times in them texts
    for name in STATS_WORDS:
        word = trace.stats.get(name)
        if isinstance(word, AttribDict):
            times = {key: str(time) for key, time in word.items() if isinstance(time, UTCDateTime)}
            word = {**word, **times}
        if name in trace.stats:
            description[name] = word
    return description
