"""
Records in a cache that end before their window: they are asked for again, and kept until then.

Minutes after an earthquake a service may have the beginning of a record only. Such records are set
aside while they are fetched again; where that fails they return to their place.
"""

import shutil
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from pathlib import Path

import obspy
from obspy import UTCDateTime

from per_obspy.config import Fdsn
from per_obspy.files import file_hash, is_part, writing
from per_obspy.records.fdsn.download import station_status
from per_obspy.resume import StatusError, read_status, write_status

#: Records that end this long before their window may be continued at their service, s.
CUT = 5.0

#: Folder of records set aside in a cache, and suffix of records.
ASIDE, SUFFIX = "cut", ".mseed"


@contextmanager
def cut_records_aside(request: Fdsn) -> Iterator[None]:
    """
    Set the records that end before the window of a request aside while they are fetched again.

    Parameters
    ----------
    request : Fdsn
        With start and end; files that a killed program has set aside are restored first.

    Raises
    ------
    WriteError
        If the cache cannot be written.
    """
    _restore(request.cache)
    for file in request.cache.glob(f"*-*-*/*{SUFFIX}"):
        if not is_part(file) and _is_of(file.parent, request):
            _set_aside(file, request)
    try:
        yield
    finally:
        _restore(request.cache)


def has_cut_records(request: Fdsn) -> bool:
    """Return whether the cache has records that end before the window of a request."""
    files = request.cache.glob(f"*-*-*/*{SUFFIX}")
    end = UTCDateTime(request.end or 0) - CUT
    return any(
        _ends(file) < end for file in files if not is_part(file) and _is_of(file.parent, request)
    )


def _is_of(folder: Path, request: Fdsn) -> bool:
    """Return whether a folder of a cache is that of the window of a request."""
    times = [UTCDateTime(time or 0) for time in (request.start, request.end)]
    return folder.name.startswith("-".join(time.strftime("%Y%m%dT%H%M%S") for time in times))


def _set_aside(file: Path, request: Fdsn) -> None:
    """Set records aside if they end before the window; their metadata stay."""
    if _ends(file) >= UTCDateTime(request.end or 0) - CUT:
        return
    place, aside = station_status(file), request.cache / ASIDE / file.parent.name
    with writing(aside), suppress(StatusError):
        status = read_status(place)
        aside.mkdir(parents=True, exist_ok=True)
        shutil.copyfile(place, aside / place.name)
        file.replace(aside / file.name)
        # A service writes the time of its answer into metadata, which would be a change
        outputs = {name: known for name, known in status["outputs"].items() if name != file.name}
        facts = {name: status[name] for name in status.keys() - {"key", "outputs"}}
        write_status(place, status["key"], outputs, facts)


def _ends(file: Path) -> UTCDateTime:
    """Return the end of the shortest channel of a file; that of an unreadable one is long ago."""
    ends: dict[str, UTCDateTime] = {}
    try:
        for trace in obspy.read(file, format="MSEED", headonly=True):
            ends[trace.id] = max(ends.get(trace.id, UTCDateTime(0)), trace.stats.endtime)
    except (OSError, ValueError, TypeError):
        return UTCDateTime(0)
    return min(ends.values(), default=UTCDateTime(0))


def _restore(cache: Path) -> None:
    """Return records that were set aside to their place, unless other ones have been fetched."""
    for file in cache.glob(f"{ASIDE}/*/*{SUFFIX}"):
        place, status = cache / file.parent.name / file.name, station_status(file)
        is_new = place.is_file() and file_hash(place) != file_hash(file)
        # The same records keep their status to the byte, by which a run knows them
        if not is_new and status.is_file():
            with writing(place):
                file.replace(place)
                status.replace(station_status(place))
    if (cache / ASIDE).is_dir():
        shutil.rmtree(cache / ASIDE, ignore_errors=True)
