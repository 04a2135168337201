"""SDS archives (SeisComP's folders of day files), of which a run wants a few minutes."""

from collections import defaultdict
from collections.abc import Iterable
from pathlib import Path

from obspy import Inventory, Stream, UTCDateTime

from per_obspy.errors import CatalogError, Rejection
from per_obspy.records.folder import (
    SourceContents,
    merged_inventory,
    read_inventories,
    read_station,
)

_DAY = 86400.0  # s


def find_sds_stations(
    archive: str | Path, start: UTCDateTime, end: UTCDateTime, stationxml: str | Path | None = None
) -> SourceContents:
    """
    Find the stations of an SDS archive that have day files in a time window, from the names of the files only.

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
        If the archive is missing or has nothing in the window, or the StationXML cannot be read.
    """
    if end <= start:
        raise ValueError(f"end must be later than start, got {start} to {end}")
    folder = Path(archive)
    if not folder.is_dir():
        raise CatalogError(str(folder), "no such folder")
    stations: dict[str, list[Path]] = defaultdict(list)
    for path in _day_files(folder, start, end):
        network, station = path.name.split(".")[:2]
        stations[f"{network}.{station}"].append(path)
    if not stations:
        raise CatalogError(
            str(folder), f"no day file YEAR/NET/STA/CHAN.D/... from {start} to {end}"
        )
    inventory = merged_inventory([] if stationxml is None else read_inventories(Path(stationxml)))
    return SourceContents(
        {name: tuple(paths) for name, paths in sorted(stations.items())}, inventory, ()
    )


def _day_files(folder: Path, start: UTCDateTime, end: UTCDateTime) -> list[Path]:
    midnight = UTCDateTime(start.year, start.month, start.day)
    days = [midnight + _DAY * day for day in range(-1, int((end - midnight) // _DAY) + 1)]
    patterns = [f"{day.year}/*/*/*.D/*.D.{day.year}.{day.julday:03d}" for day in days]
    return [path for pattern in patterns for path in sorted(folder.glob(pattern))]


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
        rejected = (
            Rejection("station", station, "", None, (f"no samples from {start} to {end}",)),
        )
    return stream, rejected
