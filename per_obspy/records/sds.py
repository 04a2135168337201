"""SDS archives (SeisComP's folders of day files), of which a run needs a few minutes."""

from collections import defaultdict
from collections.abc import Iterable
from fnmatch import fnmatchcase
from functools import partial
from pathlib import Path

import obspy
from obspy import Inventory, Stream, UTCDateTime

from per_obspy.errors import CatalogError, RecordRejected, Rejection, reason_of
from per_obspy.records.archive import read_file
from per_obspy.records.file_list import file_row
from per_obspy.records.folder import RecordSource, read_station
from per_obspy.records.metadata import merged_inventory, read_inventories
from per_obspy.records.obspy_readers import read_content

_DAY = 86400.0  # s


def find_sds_stations(
    archive: str | Path, start: UTCDateTime, end: UTCDateTime, stationxml: str | Path | None = None
) -> RecordSource:
    """
    Find the stations of an SDS archive that have day files in a time window.

    Only the names of the files are read.

    Parameters
    ----------
    archive : str or Path
        Folder with ``YEAR/NET/STA/CHAN.D/NET.STA.LOC.CHAN.D.YEAR.DAY`` below it.
    start, end : UTCDateTime
        Time window, UTC. The day before it counts too, because a last block may reach over
        midnight.
    stationxml : str or Path, optional
        A StationXML file or a folder of them.

    Raises
    ------
    ValueError
        If the window is empty.
    CatalogError
        If the archive is missing or has no record in the window, or the StationXML cannot be read.
    """
    if end <= start:
        raise ValueError(f"end must be later than start, got {start} to {end}")
    folder = Path(archive)
    if not folder.is_dir():
        raise CatalogError(str(folder), "no such folder")
    paths, unlisted = _day_files(folder, start, end)
    # The first two parts of a name are network and station
    files = defaultdict[str, list[Path]](list)
    for path in paths:
        files[".".join(path.name.split(".")[:2])].append(path)
    if not files:
        problem = f"no day file YEAR/NET/STA/CHAN.D/... from {start} to {end}"
        raise CatalogError(str(folder), problem)
    # Metadata are outside the archive
    inventories = [] if stationxml is None else read_inventories(Path(stationxml))
    stations = {name: tuple(files[name]) for name in sorted(files)}
    reader = partial(read_sds_station, start=start, end=end)
    return RecordSource(stations, merged_inventory(inventories), unlisted, reader=reader)


def _day_files(
    folder: Path, start: UTCDateTime, end: UTCDateTime
) -> tuple[list[Path], tuple[Rejection, ...]]:
    """Return the files of all days of a window and of the day before it, and unreadable folders."""
    files, unlisted = [], dict[Path, Rejection]()
    # Names end with year and day of the year
    day = UTCDateTime(start.year, start.month, start.day) - _DAY
    while day <= end:
        paths = [folder / str(day.year)]
        for pattern in ("*", "*", "*.D", f"*.D.{day.year}.{day.julday:03d}"):
            paths = _listed(paths, pattern, unlisted)
        files += sorted(paths)
        day += _DAY
    return files, tuple(unlisted.values())


def _listed(folders: list[Path], pattern: str, unlisted: dict[Path, Rejection]) -> list[Path]:
    """Return the files of folders that match a pattern; those that cannot be listed are noted."""
    paths: list[Path] = []
    for folder in folders:
        try:
            paths += [path for path in folder.iterdir() if fnmatchcase(path.name, pattern)]
        except (FileNotFoundError, NotADirectoryError):
            continue
        except OSError as error:
            reason = f"the folder cannot be listed: {reason_of(error)}"
            unlisted[folder] = file_row(folder, reason)
    return paths


def read_sds_station(
    paths: Iterable[Path],
    inventory: Inventory | None,
    station: str,
    start: UTCDateTime,
    end: UTCDateTime,
) -> tuple[Stream, tuple[Rejection, ...]]:
    """
    Read one station's part of the window, as ``records.folder.read_station`` does.

    A day file that holds another channel or day than its name says is a rejection, and so is a
    station without samples in the window.
    """
    # Names of files are the index of an archive
    reasons = {path: _other_than_named(path) for path in paths}
    others = [file_row(path, reason) for path, reason in reasons.items() if reason]
    usable = [path for path, reason in reasons.items() if not reason]
    stream, rejected = read_station(usable, inventory, station, start, end)
    if not stream and not rejected and not others:
        reason = f"no samples from {start} to {end}"
        rejected = (Rejection("station", station, "", None, (reason,)),)
    return stream, (*others, *rejected)


def _other_than_named(path: Path) -> str:
    """Return what a day file holds instead of the channel and day of its name; else empty."""
    *codes, _, year, day = path.name.split(".")
    # Whatever cannot be read is refused when it is read
    try:
        traces = read_content(obspy.read, read_file(path), path, headonly=True)
        midnight = UTCDateTime(year=int(year), julday=int(day))
    except (RecordRejected, ValueError, TypeError):
        return ""
    names = sorted({trace.id for trace in traces} - {".".join(codes)})
    if names:
        return f"holds records of {', '.join(names)} under the name of another channel"
    # A first and last block may reach over midnight
    spans = [(trace.stats.starttime, trace.stats.endtime) for trace in traces]
    if any(start < midnight + 2 * _DAY and end > midnight - _DAY for start, end in spans):
        return ""
    first = min(start for start, _ in spans)
    last = max(end for _, end in spans)
    return f"holds records of {first} to {last} under the name of another day"
