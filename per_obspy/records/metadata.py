"""
Metadata of stations: the files that hold them, and what a trace takes from them.

Files are StationXML and other inventories that ObsPy reads, FDSN station text, tables of stations
and the metadata files of ITACA. A trace takes coordinates, orientation, response, and the ground
under the station, of the epoch in which it starts. The coordinates of a table that a user writes
count first, then those in the header of the record, then those of StationXML.
"""

import logging
import re
from collections.abc import Mapping, Sequence
from functools import reduce
from io import BytesIO
from itertools import pairwise
from operator import add
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
import obspy
from obspy import Inventory, Trace, UTCDateTime
from obspy.core import AttribDict
from obspy.core.inventory import Channel, Response, Station
from obspy.geodetics import degrees2kilometers, locations2degrees

from per_obspy.checks import FloatArray
from per_obspy.errors import CatalogError, RecordRejected, shortened
from per_obspy.formats.knet import with_knet_words
from per_obspy.formats.text.itaca_metadata import is_itaca_metadata, read_itaca_metadata
from per_obspy.formats.text.station_table import (
    SOURCE,
    StationRow,
    is_station_table,
    read_station_table,
)
from per_obspy.formats.text.station_text import (
    marked_open_starts,
    station_lines,
    with_open_starts,
)
from per_obspy.formats.text.vocabulary import horizontal
from per_obspy.names import code_problem
from per_obspy.processing.instrument_response import with_overall_sensitivity
from per_obspy.records.archive import read_file
from per_obspy.records.earthquakes.earthquake import Earthquake, header_event
from per_obspy.records.file_list import files_below
from per_obspy.records.obspy_readers import read_bytes_with_obspy, read_content
from per_obspy.records.station_list import MARK
from per_obspy.units import unit_of_si

log = logging.getLogger(__name__)

#: words at the beginning of StationXML, FDSN station text, QuakeML and descriptions of processed
#: records -> kind of file
_MARKS = {
    b"<FDSNStationXML": "inventory",
    b"#Network": "station text",
    b"quakeml": "event",
    b'"shard": ': "description",
    MARK: "amplitudes",
}

#: Beginnings of logical records of SEED: a number, and the type of a volume header or of data.
_VOLUME, _DATA = re.compile(rb"\d{6}V[ *]"), re.compile(rb"\d{6}[DRQM] ")

#: Smallest logical record of SEED that networks write, bytes.
_LOGICAL_RECORD = 256

#: Kinds of files that describe stations.
METADATA = ("inventory", "station text", "station table", "ITACA metadata")

#: Sources of coordinates that are no table.
HEADER, STATIONXML = "header", "StationXML"

#: Places of two sources farther apart than this contradict each other, m.
CONTRADICTION = 1000.0

_CODES = ("network", "station", "location", "channel")

#: name of a source of coordinates, and latitude, longitude, degrees, and perhaps elevation, m
Place = tuple[str, AttribDict]


class Metadata(NamedTuple):
    """
    What a file says about stations.

    Attributes
    ----------
    inventory : Inventory or None
        Of StationXML or station text.
    rows : tuple of StationRow
        Of a table of stations.
    event : Earthquake or None
        The earthquake that a metadata file of ITACA has besides.
    faults : tuple of str
        Lines that cannot be read.
    """

    inventory: Inventory | None = None
    rows: tuple[StationRow, ...] = ()
    event: Earthquake | None = None
    faults: tuple[str, ...] = ()


def kind_of(path: Path, content: bytes) -> str:
    """Return the kind of a file: a kind of metadata, event, description, or else record."""
    start = content[:1000]
    if path.suffix.lower() == ".csv" and is_station_table(start):
        return "station table"
    if is_itaca_metadata(start):
        return "ITACA metadata"
    # A volume of SEED may hold records of data in addition to its headers
    starts = range(0, len(content), _LOGICAL_RECORD)
    if _VOLUME.match(start) and not any(_DATA.match(content, place) for place in starts):
        return "inventory"
    return next((kind for mark, kind in _MARKS.items() if mark in start), "record")


def read_metadata(kind: str, path: Path, content: bytes) -> Metadata:
    """
    Read a file that describes stations.

    Parameters
    ----------
    kind : str
        From :func:`kind_of`; any other than those of tables and texts is read as an inventory.
    path : Path
        File, or a member of an archive.
    content : bytes
        Its bytes.

    Raises
    ------
    RecordRejected
        If it cannot be read.
    """
    if kind == "station text":
        return _read_station_text(path, content)
    if kind == "station table":
        return Metadata(rows=read_station_table(str(path), content))
    if kind == "ITACA metadata":
        station = read_itaca_metadata(str(path), content)
        return Metadata(rows=(station.row,), event=header_event(station.event))
    return Metadata(read_content(obspy.read_inventory, content, path))


def named_metadata(path: Path | None) -> list[Metadata]:
    """
    Read the descriptions of stations, or the table of them, that a user named.

    Raises
    ------
    CatalogError
        If there is none, or one cannot be read.
    """
    if path is None:
        return []
    # A table that the user named must be right
    try:
        if path.is_file() and kind_of(path, content := read_file(path)) == "station table":
            return [read_metadata("station table", path, content)]
    except RecordRejected as rejection:
        raise CatalogError(str(path), "; ".join(rejection.reasons)) from rejection
    return [Metadata(inventory) for inventory in read_inventories(path)]


def read_inventories(stationxml: Path) -> list[Inventory]:
    """
    Read a file of StationXML or station text, or all StationXML of a folder.

    Raises
    ------
    CatalogError
        If there is none, or one cannot be read.
    """
    paths, inventories = [stationxml], []
    if stationxml.is_dir():
        files, unread = files_below(stationxml)
        # Unreadable files are tried again below, for the reason
        unlisted = [Path(row.source) for row in unread if "cannot be listed" in row.reasons[0]]
        files += [Path(row.source) for row in unread]
        paths = [path for path in files if path.suffix == ".xml"] + unlisted
    if not paths:
        raise CatalogError(str(stationxml), "the folder holds no StationXML (*.xml)")
    for path in paths:
        try:
            content = read_file(path)
            # StationXML, whatever else the file may be
            is_text = kind_of(path, content) == "station text"
            metadata = read_metadata("station text" if is_text else "inventory", path, content)
        except RecordRejected as rejection:
            problem = f"is no StationXML: {'; '.join(rejection.reasons)}"
            raise CatalogError(rejection.record, problem) from rejection
        # A text whose lines are partly wrong serves with the others
        if metadata.faults:
            log.warning("%s: lines left out: %s", path, shortened("; ".join(metadata.faults)))
        inventories.append(metadata.inventory)
    return inventories


def merged_inventory(inventories: Sequence[Inventory]) -> Inventory | None:
    """Return one inventory of all; None of none."""
    return reduce(add, inventories) if inventories else None


def _read_station_text(path: Path, content: bytes) -> Metadata:
    """Read FDSN station text, whose empty start means an open one, without its wrong lines."""
    try:
        faults = {fault.number: fault.reason for fault in station_lines(content)[1]}
    except ValueError:
        faults = {}  # a list of networks, or no list at all
    head, *texts = marked_open_starts(content).decode().split("\n")
    lines = {
        number: line
        for number, line in enumerate(texts, 2)
        if line.strip() and number not in faults
    }
    try:
        inventory = _station_text(path, head, *lines.values())
    except RecordRejected:
        # Only where the whole cannot be read, line by line for columns that ObsPy alone reads
        faults |= _refused_lines(path, head, lines)
        good = (line for number, line in lines.items() if number not in faults)
        inventory = _station_text(path, head, *good)
    reasons = [shortened(f"line {number}: {fault}") for number, fault in sorted(faults.items())]
    # A file of which nothing is left is none
    if reasons and not any(inventory):
        raise RecordRejected(str(path), *(f"is no FDSN station text: {text}" for text in reasons))
    return Metadata(with_open_starts(inventory), faults=tuple(reasons))


def _refused_lines(path: Path, head: str, lines: Mapping[int, str]) -> dict[int, str]:
    """Return the number of each line that ObsPy refuses, and why."""
    refused = {}
    for number, line in lines.items():
        try:
            _station_text(path, head, line)
        except RecordRejected as rejection:
            refused[number] = rejection.reasons[0]
    return refused


def _station_text(path: Path, *lines: str) -> Any:
    """Return the inventory of lines of FDSN station text."""
    content = "\n".join(lines).encode()
    return read_bytes_with_obspy(obspy.read_inventory, content, str(path), format="STATIONTXT")


#: beginning of the comment by which simulated stations are known
SIMULATION_MARK = "SIMULATED by per_obspy"


def with_metadata(trace: Trace, inventory: Inventory | None) -> Trace:
    """
    Return a copy of a trace in the words of ``formats/text/vocabulary.py``.

    Parameters
    ----------
    trace : Trace
        Read from a file. Header words that a format plugin filled are kept; gaps are filled from
        StationXML.
    inventory : Inventory or None
        All the StationXML there is.

    Raises
    ------
    RecordRejected
        If a code holds other letters than those of codes, units or, for counts, the response are
        unknown, StationXML contradicts itself, or samples are not finite.
    """
    if problem := code_problem(*(trace.stats[name] for name in _CODES)):
        raise RecordRejected(trace.id, problem)
    result = with_knet_words(trace) if "knet" in trace.stats else trace.copy()
    stations = _stations(result, inventory)
    channel = _channel(result, stations)
    # Gaps of the header are filled from the channel
    if channel is not None:
        _describe(result, channel)
    elif "units" not in result.stats:
        missing = f"StationXML has no channel {trace.id} at {trace.stats.starttime}"
        missing = "there is no StationXML" if inventory is None else missing
        raise RecordRejected(trace.id, f"{missing}, so the unit of its samples is unknown")
    # Place and ground belong to the station, which may be known without the channel
    set_coordinates(result, _places(result, stations, channel))
    comments = [comment.value or "" for station in stations for comment in station.comments]
    result.stats.update(_ground(trace.id, comments))
    if any(comment.startswith(SIMULATION_MARK) for comment in comments):
        result.stats.simulated = True
    result.data = _samples(result)
    return result


def _stations(trace: Trace, inventory: Inventory | None) -> list[Station]:
    """Return the descriptions of a trace's station that are valid at its start, tables too."""
    stats = trace.stats
    networks = [network for network in inventory or () if network.code == stats.network]
    stations = (station for network in networks for station in network)
    active = (station for station in stations if station.is_active(stats.starttime))
    return [station for station in active if station.code == stats.station]


def _channel(trace: Trace, stations: Sequence[Station]) -> Channel | None:
    """Return the channel of a trace at its start, or None."""
    stats = trace.stats
    codes = (stats.channel, stats.location)
    channels = (channel for station in stations for channel in station)
    same = (one for one in channels if (one.code, one.location_code) == codes)
    return _only(trace, "channel", [one for one in same if one.is_active(stats.starttime)])


def _only(trace: Trace, kind: str, sites: Sequence[Any], source: str = STATIONXML) -> Any:
    """Return the one channel or station there is, or None; several must have the same facts."""
    for first, second in pairwise(sites):
        # Name every fact in which two descriptions differ
        facts, repeated = _facts(first), _facts(second)
        differing = [name for name in facts if facts[name] != repeated[name]]
        if differing:
            where = f"{source} contradicts itself about the {kind} at {trace.stats.starttime}"
            both = (f"{name} {facts[name]} and {repeated[name]}" for name in differing)
            raise RecordRejected(trace.id, f"{where}: {', '.join(both)}")
    return sites[0] if sites else None


def _facts(site: Channel | Station) -> dict[str, Any]:
    """Return what two descriptions of a channel or station must have in common."""
    is_channel = isinstance(site, Channel)
    names = ("latitude", "longitude", "elevation", *(("azimuth", "dip") if is_channel else ()))
    facts = {name: getattr(site, name) for name in names}
    return facts | {"sensitivity": _response(site)[1]} if is_channel else facts


def _response(channel: Channel) -> tuple[Response | None, float | None]:
    """Return a response and its overall sensitivity, counts per unit of the ground motion."""
    if channel.response is None:
        return None, None
    response = with_overall_sensitivity(channel.response)
    sensitivity = response.instrument_sensitivity
    return response, sensitivity.value if sensitivity else None


def _describe(trace: Trace, channel: Channel) -> None:
    """Fill the gaps of a trace's words from its channel."""
    stats = trace.stats
    if "sensor_azimuth" not in stats and "sensor_dip" not in stats:
        stats.update(_direction(channel))
    if channel.sample_rate:
        stats.channel_rate = float(channel.sample_rate)
    if stats.get("units", "counts") != "counts":
        return
    # Counts need a response, unless the file has their gain and StationXML no sensitivity
    response, sensitivity = _response(channel)
    if not sensitivity and stats.calib == 1:
        raise RecordRejected(trace.id, f"StationXML gives no sensitivity at {stats.starttime}")
    if response is None or not sensitivity:
        return
    unit = response.instrument_sensitivity.input_units
    motion = unit_of_si(unit)
    if motion is None:
        problem = f"the instrument measures {unit!r} by its StationXML, not ground motion"
        raise RecordRejected(trace.id, problem)
    stats.response = response
    stats.update({"units": "counts", "quantity": motion.quantity, "processing_level": "raw"})


def _direction(channel: Channel) -> dict[str, float]:
    """Return azimuth and dip of a channel as far as they are known; the dip of a vertical alone."""
    dip = channel.dip
    # A vertical may be known by its code only
    vertical = -90.0 if dip is None and channel.code.endswith("Z") else dip
    if vertical is not None and abs(vertical) == 90:
        return {"sensor_dip": float(vertical)}
    if channel.azimuth is None:
        return {}
    return horizontal(float(channel.azimuth)) | ({} if dip is None else {"sensor_dip": float(dip)})


def _places(trace: Trace, stations: Sequence[Station], channel: Channel | None) -> list[Place]:
    """
    Return the places that tables and StationXML give a trace, in the order of their preference.

    Unknown ones stay absent: spectra need none.
    """
    tables: dict[str, list[Station]] = {}
    for station in stations:
        tables.setdefault(_table_of(station), []).append(station)
    described = tables.pop("", [])
    # Tables that people write, which are CSV, go before those of agencies
    places = []
    for name in sorted(tables, key=lambda table: (not table.lower().endswith(".csv"), table)):
        row = _only(trace, "station", tables[name], f"the table {name}")
        places.append((name, _coordinates(row)))
    # Of StationXML the channel, which is nearer to the sensor
    site = channel or _only(trace, "station", described)
    return places if site is None else [*places, (STATIONXML, _coordinates(site))]


def _table_of(station: Station) -> str:
    """Return the name of the table that describes a station, or an empty text."""
    names = (str(comment.value or "").partition(SOURCE) for comment in station.comments)
    return next((name for before, mark, name in names if mark and not before), "")


def _coordinates(site: Channel | Station) -> AttribDict:
    """Return the coordinates of a channel or station, degrees and m, as far as they are known."""
    place = AttribDict(latitude=float(site.latitude), longitude=float(site.longitude))
    # Tables may have no elevation
    if all(comment.value != "elevation=unknown" for comment in site.comments):
        place.elevation = float(site.elevation)
    return place


def set_coordinates(trace: Trace, places: Sequence[Place]) -> None:
    """
    Set the coordinates of a trace from the first source that has them.

    Parameters
    ----------
    trace : Trace
        Gets ``stats.coordinates`` and ``stats.coordinates_source``, and
        ``stats.coordinates_conflict`` where another source has a place more than 1 km away; none
        of them if no source knows a place. Coordinates that it has are those of its header.
    places : sequence of (str, AttribDict)
        Source and coordinates from tables of stations and StationXML, in the order of their
        preference.
    """
    stats = trace.stats
    header = stats.pop("coordinates", None)
    # A record that this package processed contains the source of its coordinates
    source, earlier = stats.pop("coordinates_source", HEADER), stats.pop("coordinates_conflict", "")
    known = [place for place in places if place[0] != STATIONXML]
    known += [(source, AttribDict(header))] if header else []
    known += [place for place in places if place[0] == STATIONXML]
    if not known:
        return
    first, *others = known
    stats.coordinates, stats.coordinates_source = AttribDict(first[1]), first[0]
    conflicts = [_conflict(first, other) for other in others]
    # An elevation may come from another source of the same place
    for (_, place), conflict in zip(others, conflicts, strict=True):
        if not conflict and place.get("elevation") is not None:
            stats.coordinates.setdefault("elevation", place.elevation)
    if texts := list(filter(None, [*conflicts, earlier])):
        stats.coordinates_conflict = "; ".join(dict.fromkeys(texts))


def _conflict(used: Place, other: Place) -> str:
    """Return the text of a contradiction, with both places; empty if there is none."""
    here, there = used[1], other[1]
    angle = locations2degrees(here.latitude, here.longitude, there.latitude, there.longitude)
    metres = 1000.0 * float(degrees2kilometers(angle))
    # Both places, and which of them counts
    if metres <= CONTRADICTION:
        return ""
    places = [f"{name} {at.latitude:.4f}, {at.longitude:.4f}" for name, at in (used, other)]
    return f"{places[0]} used, {places[1]} is {metres / 1000:.1f} km away"


def _ground(identifier: str, comments: Sequence[str]) -> Mapping[str, str | float]:
    """Return the ground of comments: ``site_class=`` any word, ``vs30=`` m/s."""
    parts = [comment.partition("=") for comment in comments]
    words = {name.strip(): value.strip() for name, _, value in parts}
    ground: dict[str, str | float] = {}
    if words.get("site_class"):
        ground["site_class"] = words["site_class"]
    # The velocity must be a decimal number above zero
    if "vs30" in words:
        vs30 = words["vs30"]
        if not vs30.replace(".", "", 1).isdecimal() or not float(vs30):
            raise RecordRejected(identifier, f"vs30={vs30} in StationXML is not a velocity in m/s")
        ground["vs30"] = float(vs30)
    return ground


def _samples(trace: Trace) -> FloatArray:
    """Return the samples in double precision; all must be finite."""
    samples = np.asarray(trace.data, dtype=np.float64)
    finite = np.isfinite(samples)
    if not finite.all():
        first = int(np.argmin(finite))
        problem = f"{np.sum(~finite)} samples are not finite, the first is sample {first + 1}"
        raise RecordRejected(trace.id, problem)
    return samples


def metadata_text(inventory: Inventory) -> bytes:
    """Return the metadata as StationXML that is the same whenever and wherever it is written."""
    text = BytesIO()
    # The names of source and time of creation would differ
    undated = Inventory(networks=inventory.networks, source="", created=UTCDateTime(0))
    undated.write(text, format="STATIONXML")
    return text.getvalue()
