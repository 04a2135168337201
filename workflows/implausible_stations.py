"""
How many good stations are called implausible, and how many wrong ones are not.

Usage: ``python workflows/implausible_stations.py DATA CACHE``. DATA holds ``stationlists/*.json``
of ShakeMap and folders of ``records``, CACHE keeps their spectra. Every station is judged as it is;
then its peaks are multiplied by each factor of a wrong unit, one station at a time. Prints tables
in Markdown: with place and magnitude of the earthquake, without the magnitude, and without both.
"""

import csv
import json
import sys
from collections.abc import Iterator, Sequence
from pathlib import Path

import numpy as np
import xarray as xr
from calibration_events import LAKEBED, real_events

from per_obspy.checks import FloatArray
from per_obspy.config import Processing, Records, Spectra
from per_obspy.constants import STANDARD_GRAVITY
from per_obspy.records.sources import find_sources
from per_obspy.runs.stations import finished_stations, station_tasks
from per_obspy.runs.tasks.parallel import Workers
from per_obspy.screening.amplitudes import (
    FLAGGED,
    MEASURES,
    REJECTED,
    UNIT_ERRORS,
    Earthquake,
    Peaks,
    peak_deviations,
)

#: Earthquakes of the station lists, USGS; the lists' own distances give these places within 2 m.
LISTED = {
    "canterbury2010": Earthquake(171.830, -43.522, 12_000.0, 7.0),
    "christchurch2011": Earthquake(172.680, -43.583, 5_900.0, 6.1),
    "kobe1995": Earthquake(135.018, 34.583, 21_900.0, 6.9),
    "puebla2017": Earthquake(-98.4887, 18.5499, 48_000.0, 7.1),
}

#: Earthquakes of folders of records: headers, ``event.json``, or the folder's description. That of
#: the lakebed is known by its magnitude only, which alone says nothing.
RECORDED = {
    "ridgecrest2019_mseed": Earthquake(-117.599, 35.770, 8_000.0, 7.1),
    "aomori2018_knet": Earthquake(142.5, 41.0, 30_000.0, 6.2),
    "maule2010_renadic": Earthquake(-72.898, -36.122, 22_900.0, 8.8),
    "afad2023": Earthquake(37.043, 37.288, 8_600.0, 7.7),
    "kaikoura2016_geonet": Earthquake(173.054, -42.7373, 15_110.0, 7.8),
    LAKEBED: Earthquake(),
}

#: Places of the stations of Maule, whose headers have none.
PLACES = "stations_renadic_coords.csv"


def main(data: Path, cache: Path) -> None:
    """Print one table for each knowledge of the earthquake."""
    events = dict(all_events(data, cache))
    unknown = np.nan
    for title, change in {
        "place and magnitude known": {},
        "magnitude unknown": {"magnitude": unknown},
        "earthquake unknown": Earthquake()._asdict(),
    }.items():
        print(f"\n{title}\n\n{heading()}")
        rows = [
            (name, counts(peaks, source._replace(**change)))
            for name, (peaks, source) in events.items()
        ]
        for name, row in rows:
            print(written(name, row))
        print(written("all", np.sum([row for _, row in rows], axis=0)))


def all_events(data: Path, cache: Path) -> Iterator[tuple[str, tuple[Peaks, Earthquake]]]:
    """Yield the stations of every earthquake with its name and facts."""
    for name, source in LISTED.items():
        yield name, (listed_peaks(data / "stationlists" / f"{name}.json"), source)
    for name, source in RECORDED.items():
        folder = data / "records" / name
        yield name, (peaks_of(stations_of(folder, cache / name)), source)


def listed_peaks(path: Path) -> Peaks:
    """Return the instruments of a station list with their larger horizontals."""
    rows = []
    for feature in json.loads(path.read_text(encoding="utf-8"))["features"]:
        facts = feature["properties"]
        found: dict[str, list[float]] = {name: [np.nan] for name in MEASURES}
        for channel in facts["channels"] if facts["station_type"] == "seismic" else ():
            for one in channel["amplitudes"] if not channel["name"].endswith("Z") else ():
                if one["name"] in found and one["value"] not in (None, "null"):
                    found[one["name"]].append(float(one["value"]))
        # % of g, cm/s
        peak = np.fmax.reduce(found["pga"]) * 0.01 * STANDARD_GRAVITY
        if np.isfinite(peak):
            velocity = np.fmax.reduce(found["pgv"]) * 0.01
            rows.append((*feature["geometry"]["coordinates"][:2], facts["vs30"], peak, velocity))
    longitude, latitude, vs30, pga, pgv = np.array(rows, dtype=np.float64).T
    return Peaks(longitude, latitude, vs30, np.full(len(rows), "", dtype=object), pga, pgv)


def stations_of(folder: Path, cache: Path) -> list[xr.Dataset]:
    """Return the spectra of the stations of a folder whose place is known."""
    if folder.name == LAKEBED:
        return real_events([folder], cache)[0].stations
    # Clocks of Maule are wrong by more than an hour
    found = find_sources(Records(folder=folder, event_gap=5400.0), None)
    tasks = station_tasks(found.stations, cache, Processing(), Spectra(), found.event)
    done = [one.spectra for one in finished_stations(tasks, Workers(1))]
    stations = [placed(one, folder / PLACES) for one in done if one is not None]
    return [one for one in stations if np.isfinite(one["longitude"].item())]


def placed(station: xr.Dataset, places: Path) -> xr.Dataset:
    """Return a station with its place by a table beside the records, if there is one."""
    if not places.is_file():
        return station
    with places.open(encoding="utf-8") as table:
        for row in csv.DictReader(table):
            if str(station["source_files"].item()).startswith(row["file_prefix"]):
                place = {"longitude": float(row["lon"]), "latitude": float(row["lat"])}
                return station.assign_coords(place)
    return station


def peaks_of(stations: Sequence[xr.Dataset]) -> Peaks:
    """Return places, ground and larger horizontals of stations."""
    number = {
        name: np.array([float(one[name]) for one in stations])
        for name in ("longitude", "latitude", "vs30")
    }
    larger = {
        name: np.array([float(one[name][: one.attrs["horizontals"]].max()) for one in stations])
        for name in MEASURES
    }
    classes = np.array([str(one["site_class"].item()) for one in stations], dtype=object)
    return Peaks(**number, **larger, site_class=classes)


def counts(peaks: Peaks, source: Earthquake) -> FloatArray:
    """Return stations, and flagged and rejected ones: as they are, by factor, and bystanders."""
    size = peaks.pga.size
    good = largest(peaks, source)
    row = [size, np.sum(good > FLAGGED), np.sum(good > REJECTED)]
    bystanders = 0
    for factor in UNIT_ERRORS:
        own = np.zeros(size)
        for i in range(size):
            changed = np.where(np.arange(size) == i, factor, 1.0)
            wrong = peaks._replace(pga=peaks.pga * changed, pgv=peaks.pgv * changed)
            found = largest(wrong, source)
            own[i] = found[i]
            bystanders += int(np.sum(np.delete(found, i) > FLAGGED))
        row += [np.sum(own > FLAGGED), np.sum(own > REJECTED)]
    return np.array([*row, bystanders], dtype=np.float64)


def largest(peaks: Peaks, source: Earthquake) -> FloatArray:
    """Return the larger deviation of both measures."""
    both = [np.abs(peak_deviations(name, peaks, source).deviations) for name in MEASURES]
    return np.maximum(*both)


def heading() -> str:
    """Return the heading of a table."""
    factors = [f"x {factor:.4g}" if factor > 1 else f"/ {1 / factor:.4g}" for factor in UNIT_ERRORS]
    cells = ["", "stations", "as they are", *factors, "bystanders"]
    return f"| {' | '.join(cells)} |\n|{'---|' * len(cells)}"


def written(name: str, row: FloatArray) -> str:
    """Return a row of a table: flagged ones, of which rejected."""
    numbers = row.astype(int).tolist()
    couples = zip(numbers[1:-1:2], numbers[2:-1:2], strict=True)
    cells = [name, numbers[0], *(f"{first}, {second}" for first, second in couples), numbers[-1]]
    return f"| {' | '.join(map(str, cells))} |"


if __name__ == "__main__":
    main(*map(Path, sys.argv[1:3]))
