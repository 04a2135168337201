"""
Records that this package processed, as files: MiniSEED with the samples, and beside it JSON with what MiniSEED lacks.

The samples are float64 as they are in memory, so that spectra of the file are those of the record:
Steim compression holds whole numbers only, and float32 would round. The JSON holds, trace by trace,
the words of ``formats/vocabulary.py``, the steps of the processing and every number chosen on the
way; and the hash of the MiniSEED file, so that neither is ever read with another's partner.
"""

import json
from pathlib import Path
from typing import Any

import numpy as np
from obspy import Stream, Trace
from obspy.core import AttribDict

from per_obspy.errors import RecordRejected
from per_obspy.files import bytes_hash, file_hash, written_whole

#: words of ``trace.stats`` that are kept where a trace has them
WORDS = (
    "network", "station", "location", "channel", "delta", "units", "quantity", "processing_level", "coordinates",
    "sensor_azimuth", "sensor_dip", "sensor_location", "station_name", "site_class", "vs30", "corners", "per_obspy",
    "processing",
)  # fmt: skip
_LENGTHS = {"network": 2, "station": 5, "location": 2, "channel": 3}  # of codes in MiniSEED


def write_processed(stream: Stream, path: Path) -> dict[str, Any]:
    """
    Write traces to one MiniSEED file, whole or not at all, and return what the JSON beside it has to tell.

    Parameters
    ----------
    stream : Stream
        Processed traces of one station.
    path : Path
        MiniSEED file. Codes longer than the format allows are cut there; the JSON has them whole.

    Returns
    -------
    dict
        ``{"traces": [...]}``: one description a trace, in the order of the file.
    """
    with written_whole(path) as part:
        Stream([_with_short_codes(trace) for trace in stream]).write(
            str(part), format="MSEED", encoding="FLOAT64"
        )
    return {"traces": [_description(trace) for trace in stream]}


def write_description(path: Path, facts: dict[str, Any]) -> None:
    """Write the JSON beside a MiniSEED file of :func:`write_processed`."""
    with written_whole(path.with_suffix(".json")) as part:
        part.write_text(json.dumps({"shard": file_hash(path), **facts}), encoding="utf-8")


def read_descriptions(path: Path, content: bytes | None = None) -> list[dict[str, Any]] | None:
    """
    Return what the JSON beside a MiniSEED file tells of its traces, or None where there is none.

    Parameters
    ----------
    path : Path
        MiniSEED file.
    content : bytes, optional
        Its bytes, where it has been read already.

    Raises
    ------
    RecordRejected
        If it tells of another file of this name.
    """
    try:
        note = json.loads(path.with_suffix(".json").read_text(encoding="utf-8"))
        descriptions: list[dict[str, Any]] = note["traces"]
        told = note["shard"]
    except (OSError, ValueError, KeyError, TypeError):
        return None
    found = file_hash(path) if content is None else bytes_hash(content)
    if told != found:
        raise RecordRejected(
            str(path), f"{path.with_suffix('.json').name} describes another file of this name"
        )
    return descriptions


def described(stream: Stream, path: Path, content: bytes | None = None) -> Stream:
    """
    Return traces just read from a file with what the JSON beside it tells of them; as they are where there is none.

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
        If the JSON tells of another file, or of other traces.
    """
    descriptions = read_descriptions(path, content)
    if descriptions is None:
        return stream
    if [one["npts"] for one in descriptions] != [trace.stats.npts for trace in stream]:
        raise RecordRejected(str(path), f"{path.with_suffix('.json').name} describes other traces")
    out = stream.copy()
    for trace, words in zip(out, descriptions, strict=True):
        trace.stats.update({name: _group(words[name]) for name in WORDS if name in words})
    return out


def _with_short_codes(trace: Trace) -> Trace:
    codes = {name: trace.stats[name][:length] for name, length in _LENGTHS.items()}
    times = {"starttime": trace.stats.starttime, "delta": trace.stats.delta}
    return Trace(np.asarray(trace.data, dtype=np.float64), codes | times)


def _description(trace: Trace) -> dict[str, Any]:
    known = {name: trace.stats[name] for name in WORDS if name in trace.stats}
    plain = {
        name: dict(value) if isinstance(value, AttribDict) else value
        for name, value in known.items()
    }
    source = Path(trace.stats.get("source", "")).name
    return {
        "id": trace.id,
        "source": source,
        "start": str(trace.stats.starttime),
        "npts": trace.stats.npts,
        **plain,
    }


def _group(value: Any) -> Any:
    return AttribDict(value) if isinstance(value, dict) else value
