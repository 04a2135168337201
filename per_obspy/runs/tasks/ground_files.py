"""Ground motion of a region as files and small tables, each read once per process."""

from collections.abc import Iterable
from functools import lru_cache
from pathlib import Path
from typing import NamedTuple

import numpy as np
import xarray as xr

from per_obspy.config import Interpolation
from per_obspy.errors import MachineFault, Rejection
from per_obspy.files import bytes_hash, file_hash
from per_obspy.records.shakemap import read_shakemap
from per_obspy.records.station_list import read_station_list
from per_obspy.runs.tasks.station import FinishedStation
from per_obspy.screening.assignment import Stations, site_class_of
from per_obspy.screening.site_motion import (
    Hypocentre,
    RegionalMotion,
    StationField,
    hypocentre_of,
    prepared_field,
)
from per_obspy.screening.station_amplitudes import AmplitudeField, amplitude_field
from per_obspy.screening.station_motion import StationMotion, station_motion
from per_obspy.spectra.storage import read_spectra

#: Stations that a worker keeps in memory, each of about 2 MB.
STATIONS_KEPT = 200


class StationFile(NamedTuple):
    """A station that can serve pairs."""

    #: ``NETWORK.STATION``.
    name: str
    #: Degrees east and north.
    longitude: float
    latitude: float
    #: Of the ground, empty if unknown.
    site_class: str
    #: Its Dataset.
    shard: Path
    #: Of the station file.
    hash: str
    #: Of its record, those of the comparison with other stations included.
    flags: str = ""


class GroundFiles(NamedTuple):
    """Ground motion of a region, for other processes to read."""

    #: Stations that can serve pairs.
    stations: tuple[StationFile, ...]
    #: The motion between them; None if there are none.
    field: StationField | None
    #: ``grid.xml``, perhaps ``uncertainty.xml`` as well; empty if there is no map.
    shakemap: tuple[Path, ...]
    #: Hash of all their contents.
    key: str
    #: The motion of stations of which only amplitudes are known; None if there are none.
    amplitudes: AmplitudeField | None = None


def ground_files(
    stations: Iterable[FinishedStation],
    shakemap: tuple[Path, ...],
    settings: Interpolation,
    amplitudes: Path | None = None,
    event: Hypocentre | None = None,
) -> tuple[GroundFiles, tuple[Rejection, ...]]:
    """Describe the ground motion by finished stations and a ShakeMap; no station file is opened."""
    files, spectra, rejected = _placed(stations)
    # Motion between the stations, which recorded the same earthquake
    hypocentre = hypocentre_of([dataset.attrs for dataset in spectra])
    field = prepared_field(spectra, settings, hypocentre) if spectra else None
    # Everything that decides the motion at a pair
    contents = [(file.name, file.hash, file.flags) for file in files]
    known = [*contents, *map(file_hash, shakemap), hypocentre]
    key = bytes_hash(repr(known).encode())
    ground = GroundFiles(tuple(files), field, shakemap, key)
    if amplitudes is None:
        return ground, rejected
    added, unused = _with_amplitudes(ground, amplitudes, spectra, settings, hypocentre or event)
    return added, (*rejected, *unused)


def _placed(
    stations: Iterable[FinishedStation],
) -> tuple[list[StationFile], list[xr.Dataset], tuple[Rejection, ...]]:
    """Return the stations with coordinates and their spectra, and rejections of the others."""
    files, spectra, rejected = list[StationFile](), list[xr.Dataset](), list[Rejection]()
    # Pairs are given stations by distance
    for station in stations:
        file, dataset = _station_file(station)
        if np.isfinite(file.longitude):
            files.append(file)
            spectra.append(dataset)
        else:
            reason = "its coordinates are unknown: it serves no pair"
            rejected.append(Rejection("station", file.name, "", None, (reason,)))
    return files, spectra, tuple(rejected)


def _with_amplitudes(
    ground: GroundFiles,
    amplitudes: Path,
    records: list[xr.Dataset],
    settings: Interpolation,
    source: Hypocentre | None,
) -> tuple[GroundFiles, tuple[Rejection, ...]]:
    """Return a ground motion with the stations of a list, and those that are not used."""
    listed = read_station_list(amplitudes)
    # Records and the description of the earthquake know better where it began
    source = source or (listed.hypocentre and Hypocentre(*listed.hypocentre))
    field, unused = amplitude_field(listed, str(amplitudes), records, settings, source)
    key = bytes_hash(repr([ground.key, file_hash(amplitudes), source]).encode())
    return ground._replace(amplitudes=field, key=key), unused


def _station_file(station: FinishedStation) -> tuple[StationFile, xr.Dataset]:
    """Return name, place and ground of a station with its spectra."""
    spectra, shard = station.spectra, station.shard
    assert spectra is not None  # stations without a station file serve no pair
    assert shard is not None
    name, longitude, latitude = (
        spectra[key].item() for key in ("station", "longitude", "latitude")
    )
    site_class = site_class_of(spectra)
    flags = str(spectra["record_flags"].item()) if "record_flags" in spectra else ""
    file = StationFile(name, longitude, latitude, site_class, shard, station.hash, flags)
    return file, spectra


def read_ground(files: GroundFiles) -> RegionalMotion:
    """Return the ground motion of a region; each station is read at its first use."""
    places = [(file.longitude, file.latitude) for file in files.stations]
    longitude, latitude = np.array(places).reshape(-1, 2).T
    names = np.array([file.name for file in files.stations], dtype=object)
    classes = np.array([file.site_class for file in files.stations], dtype=object)
    # Stations and the map stay in memory from one chunk to the next
    stations = Stations(
        names,
        longitude,
        latitude,
        classes,
        read=lambda index: _flagged_station(files.stations[index]),
        motion=lambda index: _motion_once(files.stations[index].shard, files.stations[index].hash),
    )
    shakemap = _shakemap(files.shakemap, files.key) if files.shakemap else None
    return RegionalMotion(stations, files.field, shakemap, files.amplitudes)


@lru_cache(1)
def _shakemap(files: tuple[Path, ...], key: str) -> xr.Dataset:
    """Read a ShakeMap, cached by the key of the ground motion."""
    del key
    return read_shakemap(*files)


@lru_cache(STATIONS_KEPT)
def read_station_once(shard: Path, digest: str) -> xr.Dataset:
    """Read a station file, cached by its hash."""
    content = shard.read_bytes()
    # Its pairs are not at fault, and the next run makes the station file again
    if bytes_hash(content) != digest:
        raise MachineFault(f"{shard}: changed while the run read it")
    return read_spectra(shard, content)


@lru_cache(STATIONS_KEPT)
def _motion_once(shard: Path, digest: str) -> StationMotion:
    """Return the decoded motion of a station file."""
    return station_motion(read_station_once(shard, digest))


def _flagged_station(file: StationFile) -> xr.Dataset:
    """Read a station with the flags of the comparison with others, which its file does not have."""
    station = read_station_once(file.shard, file.hash)
    if not file.flags or file.flags == str(station["record_flags"].item()):
        return station
    return station.assign(record_flags=station["record_flags"].copy(data=file.flags))
