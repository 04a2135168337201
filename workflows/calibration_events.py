"""Spectra of all stations of real earthquakes, for leaving stations out one by one."""

import csv
import re
from collections.abc import Iterable
from pathlib import Path
from typing import NamedTuple

import numpy as np
import xarray as xr
from obspy import Stream

from per_obspy import process, station_spectra
from per_obspy.config import Processing, Records, Spectra
from per_obspy.errors import CatalogError, RecordRejected
from per_obspy.records.sources import find_sources
from per_obspy.records.text_table import read_columns
from per_obspy.runs.stations import finished_stations, station_tasks
from per_obspy.runs.tasks.parallel import Workers
from per_obspy.screening.site_motion import HYPOCENTRE, Hypocentre, hypocentre_of
from per_obspy.spectra.storage import read_spectra

#: Folders of one earthquake whose records are in two formats: stations of the second that the
#: first lacks join it.
JOINED = {"ridgecrest2019_csmip": "ridgecrest2019_mseed"}

#: Hypocentres that neither headers nor a QuakeML file beside the records have: degrees, m; USGS.
HYPOCENTRES = {"ridgecrest2019_mseed": Hypocentre(-117.599, 35.770, 8000.0)}

#: Folder of plain tables with one component each, the date in their names, and their units.
LAKEBED, DATE, UNITS = "mexico_lakebed_1989", "250489", "cm/s2"

#: Sampling interval where the table of the records has none, s.
USUAL_DT = 0.01


class RealEvent(NamedTuple):
    """An earthquake: its name and the stations with coordinates and two horizontals."""

    name: str
    stations: list[xr.Dataset]


def real_events(folders: Iterable[Path], cache: Path) -> list[RealEvent]:
    """
    Return the earthquakes that at least two usable stations recorded.

    Parameters
    ----------
    folders : iterable of Path
        Records of one earthquake each; the QuakeML file ``event.xml`` is used where a folder has
        it, else the hypocentre in the headers.
    cache : Path
        Keeps the spectra for the next time.
    """
    found: dict[str, dict[str, xr.Dataset]] = {}
    for place in folders:
        stations = _lakebed(place) if place.name == LAKEBED else _stations(place, cache)
        found[place.name] = {name: one for name, one in stations.items() if _is_usable(one)}
    # stations of one earthquake in two folders
    for second, first in JOINED.items():
        if second in found and first in found:
            found[first] = found.pop(second) | found[first]
    events = []
    for name, stations in found.items():
        described = [_with_hypocentre(name, station) for station in stations.values()]
        if len(described) > 1 and _of_one_earthquake(described):
            events.append(RealEvent(name, described))
    return events


def _with_hypocentre(name: str, station: xr.Dataset) -> xr.Dataset:
    """Return a station with the hypocentre of an earthquake whose records do not have it."""
    known = HYPOCENTRES.get(name)
    return station.assign_attrs(dict(zip(HYPOCENTRE, known, strict=True))) if known else station


def _of_one_earthquake(stations: list[xr.Dataset]) -> bool:
    """Return whether no two stations name different hypocentres."""
    known = [station.attrs for station in stations if HYPOCENTRE[0] in station.attrs]
    return not known or hypocentre_of(known) is not None


def _is_usable(station: xr.Dataset) -> bool:
    """Return whether a station has a place and both horizontals of known direction."""
    return bool(np.isfinite(station["latitude"].item())) and station.sizes["horizontal"] == 2


def _stations(folder: Path, cache: Path) -> dict[str, xr.Dataset]:
    """Return the stations of a folder of records by name, processed as in a run."""
    quakeml = folder / "event.xml"
    records = Records(folder=folder, event=quakeml if quakeml.is_file() else None)
    try:
        found = find_sources(records, None)
    except CatalogError as error:
        print(error)
        return {}
    shards = cache / folder.name
    tasks = station_tasks(found.stations, shards, Processing(), Spectra(), found.event)
    done = finished_stations(tasks, Workers(1))
    return {
        station.station: read_spectra(station.shard, station.shard.read_bytes())
        for station in done
        if station.shard
    }


def _lakebed(folder: Path) -> dict[str, xr.Dataset]:
    """Return the stations of Mexico City's lakebed whose place is known."""
    text = (folder / "record-parameters.yml").read_text(encoding="utf-8")
    with (folder / "stations_cires_coords.csv").open(encoding="utf-8") as table:
        rows = [row for row in csv.DictReader(table) if row["lat"]]
    stations = {}
    for row in rows:
        stream = Stream()
        for direction, code in (("NS", "HNN"), ("EW", "HNE")):
            for path in folder.glob(f"*_{row['prefix']}{DATE}{direction}.csv"):
                stream += _component(path, row, code, text)
        stations |= _spectra(f"MX.{row['prefix']}", stream)
    return stations


def _component(path: Path, row: dict[str, str], code: str, parameters: str) -> Stream:
    """Return one component; ``parameters`` names its sampling interval where it is not 0.01 s."""
    known = re.search(re.escape(path.name) + r":\n(?:  .*\n)*?  dt: (\S+)", parameters)
    place = {"latitude": float(row["lat"]), "longitude": float(row["lon"]), "units": UNITS}
    dt = float(known[1]) if known else USUAL_DT
    code_of_column = {code: 0}
    return read_columns(
        path, station=row["prefix"], network="MX", dt=dt, channels=code_of_column, **place
    )


def _spectra(name: str, stream: Stream) -> dict[str, xr.Dataset]:
    """Return the spectra of two components, the shorter one with zeros at its end; or None."""
    if len(stream) != 2:
        return {}
    longest = max(trace.stats.npts for trace in stream)
    for trace in stream:
        trace.data = np.pad(trace.data, (0, longest - trace.stats.npts))
    try:
        return {name: station_spectra(process(stream))}
    except RecordRejected as error:
        print(error)
        return {}
