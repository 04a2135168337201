"""Files that describe stations: StationXML, FDSN station text, tables; and other kinds of files."""

import logging
import re
from collections.abc import Mapping
from functools import reduce
from operator import add
from pathlib import Path

import obspy
from obspy import Inventory

from per_obspy.errors import CatalogError, RecordRejected, Rejection, shortened
from per_obspy.formats.text.itaca_metadata import is_itaca_metadata
from per_obspy.formats.text.station_table import (
    StationRow,
    is_station_table,
    read_station_table,
)
from per_obspy.formats.text.station_text import (
    marked_open_starts,
    station_lines,
    with_open_starts,
)
from per_obspy.records.archives.archive_files import read_file
from per_obspy.records.contents.file_list import files_below
from per_obspy.records.obspy_readers import read_bytes_with_obspy, read_content

log = logging.getLogger(__name__)

#: words at the beginning of StationXML, FDSN station text, QuakeML and descriptions of processed
#: records -> kind of file
_MARKS = {
    b"<FDSNStationXML": "inventory",
    b"#Network": "station text",
    b"quakeml": "event",
    b'"shard": ': "description",
}

#: Beginnings of logical records of SEED: a number, and the type of a volume header or of data.
_VOLUME, _DATA = re.compile(rb"\d{6}V[ *]"), re.compile(rb"\d{6}[DRQM] ")

#: Smallest logical record of SEED that networks write, bytes.
_LOGICAL_RECORD = 256

#: Kinds of files that describe stations.
METADATA = ("inventory", "station text", "station table", "ITACA metadata")


def kind_of(path: Path, content: bytes) -> str:
    """Return the kind of a file: a kind of metadata, event, description, or else record."""
    start = content[:1000]
    if path.suffix.lower() == ".csv" and is_station_table(start):
        return "station table"
    if is_itaca_metadata(start):
        return "ITACA metadata"
    if _VOLUME.match(start) and not _has_data(content):
        return "inventory"
    return next((kind for mark, kind in _MARKS.items() if mark in start), "record")


def _has_data(content: bytes) -> bool:
    """Return whether a volume of SEED holds records of data in addition to its headers."""
    starts = range(0, len(content), _LOGICAL_RECORD)
    return any(_DATA.match(content, start) for start in starts)


def named_metadata(path: Path | None) -> tuple[list[Inventory], list[StationRow]]:
    """Return the descriptions of stations, or the rows of a table of them, that a user named."""
    if path is None:
        return [], []
    # A table that the user named must be right
    try:
        if path.is_file() and kind_of(path, content := read_file(path)) == "station table":
            return [], [*read_station_table(str(path), content)]
    except RecordRejected as rejection:
        raise CatalogError(str(path), "; ".join(rejection.reasons)) from rejection
    return read_inventories(path), []


def _read_inventory(path: Path) -> Inventory:
    """Read StationXML or FDSN station text."""
    content = read_file(path)
    if kind_of(path, content) == "station text":
        inventory, faults = read_station_text(path, content)
        if faults:
            log.warning("%s: lines left out: %s", path, shortened("; ".join(faults)))
        return inventory
    return read_content(obspy.read_inventory, content, path)


def read_station_text(path: Path, content: bytes) -> tuple[Inventory, tuple[str, ...]]:
    """
    Read FDSN station text, whose empty start means an open one.

    Returns
    -------
    inventory : Inventory
        Of the lines that can be read.
    faults : tuple of str
        One per line that cannot be read.

    Raises
    ------
    RecordRejected
        If no line can be read.
    """
    try:
        faults = {fault.number: fault.reason for fault in station_lines(content)[1]}
    except ValueError:
        faults = {}  # a list of networks, or no list at all
    head, *lines = marked_open_starts(content).decode().split("\n")
    numbered = {number: line for number, line in enumerate(lines, 2) if line.strip()}
    for number in faults:
        numbered.pop(number, None)
    # Only where the whole cannot be read, line by line for columns that ObsPy alone reads
    try:
        inventory = _station_text(path, [head, *numbered.values()])
    except RecordRejected:
        faults |= _faults_of_obspy(path, head, numbered)
        good = [line for number, line in numbered.items() if number not in faults]
        inventory = _station_text(path, [head, *good])
    reasons = [f"line {number}: {faults[number]}" for number in sorted(faults)]
    # A file of which nothing is left is none
    if reasons and not any(inventory):
        raise RecordRejected(str(path), *(f"is no FDSN station text: {text}" for text in reasons))
    return with_open_starts(inventory), tuple(reasons)


def _faults_of_obspy(path: Path, head: str, lines: Mapping[int, str]) -> dict[int, str]:
    """Return the number of each line that ObsPy refuses, and why."""
    faults = dict[int, str]()
    for number, line in lines.items():
        try:
            _station_text(path, [head, line])
        except RecordRejected as rejection:
            faults[number] = rejection.reasons[0]
    return faults


def _station_text(path: Path, lines: list[str]) -> Inventory:
    """Return the inventory of lines of FDSN station text."""
    content = "\n".join(lines).encode()
    inventory: Inventory = read_bytes_with_obspy(
        obspy.read_inventory, content, str(path), format="STATIONTXT"
    )
    return inventory


def merged_inventory(inventories: list[Inventory]) -> Inventory | None:
    """Return one inventory of all; None of none."""
    return reduce(add, inventories) if inventories else None


def read_inventories(stationxml: Path) -> list[Inventory]:
    """
    Read a StationXML file, or all of a folder.

    Raises
    ------
    CatalogError
        If there is none, or one cannot be read.
    """
    paths = [stationxml]
    # Unreadable files are tried again below, for the reason
    if stationxml.is_dir():
        files, unread = files_below(stationxml)
        paths = [path for path in files if path.suffix == ".xml"]
        paths += [Path(rejection.source) for rejection in unread if _is_needed(rejection)]
    if not paths:
        raise CatalogError(str(stationxml), "the folder holds no StationXML (*.xml)")
    try:
        return [_read_inventory(path) for path in paths]
    except RecordRejected as rejection:
        raise CatalogError(
            rejection.record, f"is no StationXML: {'; '.join(rejection.reasons)}"
        ) from rejection


def _is_needed(rejection: Rejection) -> bool:
    """Return whether an unreadable file may hold StationXML."""
    return rejection.source.endswith(".xml") or "cannot be listed" in rejection.reasons[0]
