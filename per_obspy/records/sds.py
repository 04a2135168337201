"""SDS archives (SeisComP's folders of day files), of which a run needs a few minutes."""

from collections import defaultdict
from collections.abc import Iterable
from fnmatch import fnmatchcase
from pathlib import Path

from obspy import Inventory, Stream, UTCDateTime

from per_obspy.errors import CatalogError, Rejection, reason_of
from per_obspy.records.contents.metadata_files import merged_inventory, read_inventories
from per_obspy.records.folder import SourceContents, read_station

_DAY = 86400.0  # s


def find_sds_stations(
    archive: str | Path, start: UTCDateTime, end: UTCDateTime, stationxml: str | Path | None = None
) -> SourceContents:
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
    # The first two parts of a name are network and station
    files: dict[str, list[Path]] = defaultdict(list)
    paths, rejected = _day_files(folder, start, end)
    for path in paths:
        network, station = path.name.split(".")[:2]
        files[f"{network}.{station}"].append(path)
    if not files:
        problem = f"no day file YEAR/NET/STA/CHAN.D/... from {start} to {end}"
        raise CatalogError(str(folder), problem)
    # Metadata are outside the archive
    inventories = [] if stationxml is None else read_inventories(Path(stationxml))
    stations = {name: tuple(paths) for name, paths in sorted(files.items())}
    return SourceContents(stations, merged_inventory(inventories), tuple(rejected))


def _day_files(
    folder: Path, start: UTCDateTime, end: UTCDateTime
) -> tuple[list[Path], list[Rejection]]:
    """Return the files of all days of a window and of the day before it, and unreadable folders."""
    midnight = UTCDateTime(start.year, start.month, start.day)
    last = int((end - midnight) // _DAY)
    files, unlisted = [], dict[Path, Rejection]()
    # Names end with year and day of the year
    for number in range(-1, last + 1):
        day = midnight + _DAY * number
        paths = [folder / str(day.year)]
        for pattern in ("*", "*", "*.D", f"*.D.{day.year}.{day.julday:03d}"):
            paths = _listed(paths, pattern, unlisted)
        files += sorted(paths)
    return files, list(unlisted.values())


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
            unlisted[folder] = Rejection("file", folder.name, str(folder), None, (reason,))
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

    A station without samples in the window is a rejection.
    """
    stream, rejected = read_station(paths, inventory, station, start, end)
    if not stream and not rejected:
        reason = f"no samples from {start} to {end}"
        rejected = (Rejection("station", station, "", None, (reason,)),)
    return stream, rejected
