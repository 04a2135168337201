"""Files on which the result of a run may depend, and their hashes; found with few libraries."""

from pathlib import Path
from typing import TYPE_CHECKING

from per_obspy import config
from per_obspy.errors import RecordRejected
from per_obspy.files import opened_hash
from per_obspy.records.archives.archive_files import open_file
from per_obspy.records.contents.file_list import files_below

if TYPE_CHECKING:
    from per_obspy.records.fdsn.cache import Fetched


def input_files(records: config.Records | None, fetched: "Fetched | None") -> list[Path]:
    """Return every file on which the result may depend; of an SDS archive those of the window."""
    if records is None:
        return []
    # Files, and folders with everything below them
    named = [records.folder, records.stationxml, records.event]
    named += [table.file for table in records.columns]
    if fetched:
        named += [fetched.folder, fetched.event.path if fetched.event else None]
    named += [records.asdf.file] if records.asdf else []
    named += [records.shakemap, records.shakemap_uncertainty]
    files = [path for place in named if place for path in _files_below(place)]
    if records.sds:
        files += _day_files(records, records.sds)
    return [path for path in files if path.is_file()]


def _files_below(place: Path) -> list[Path]:
    """Return a file, or all files below a folder, sorted."""
    return files_below(place)[0] if place.is_dir() else [place]


def _day_files(records: config.Records, sds: config.Sds) -> list[Path]:
    """Return the day files of an SDS archive in its window."""
    from per_obspy.records.earthquakes.quakeml import read_event
    from per_obspy.records.fdsn.request import window
    from per_obspy.records.sds import find_sds_stations

    event = read_event(records.event) if records.event else None
    found = find_sds_stations(sds.folder, *window(sds, event), records.stationxml)
    return [path for paths in found.stations.values() for path in paths]


def hash_if_readable(path: Path) -> str:
    """Return the hash of a file or of a member of an archive, empty if it cannot be read."""
    try:
        with open_file(path) as file:
            return opened_hash(file)
    except (OSError, RecordRejected):
        return ""  # reading the station gives the reason
