"""Facts of records, ShakeMaps, spectra, and descriptions of earthquakes and stations."""

from collections import Counter
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from per_obspy.checks import FloatArray
from per_obspy.errors import CatalogError, Rejection
from per_obspy.formats.text.station_table import is_station_table, read_station_table
from per_obspy.records.earthquakes.quakeml import read_event
from per_obspy.records.metadata import read_inventories
from per_obspy.records.shakemap import is_scenario, read_shakemap
from per_obspy.records.summary import RecordInfo
from per_obspy.runs.inputs.facts import Facts, Places, some, span, unzipped
from per_obspy.runs.inputs.input_kinds import Kind
from per_obspy.screening.design import read_design_spectrum

if TYPE_CHECKING:
    import xarray as xr

#: Earthquakes that are listed.
SHOWN = 4


def record_facts(records: Sequence[RecordInfo], rejected: Sequence[Rejection]) -> Facts:
    """Return the facts of a set of records from their descriptions."""
    stations = sorted({_station(record) for record in records})
    places = _places(records)
    title = f"{len(records)} records of {len(stations)} stations, {len(rejected)} rejected"
    # Every record and every reason, for machines
    rows = [record._asdict() for record in records]
    values = {"records": rows, "rejected": [one._asdict() for one in rejected]}
    lines = _record_lines(records, stations, places) if records else []
    layers = {"^": unzipped(list(places.values()))}
    return Facts(Kind.RECORDS, title, lines, layers, values, usable=bool(records))


def _record_lines(
    records: Sequence[RecordInfo], stations: Sequence[str], places: Mapping[str, object]
) -> list[tuple[str, str]]:
    """Return one line per fact of a set of records."""
    simulated = sum(record.simulated for record in records)
    lines = [("simulated", f"{simulated} records are SIMULATED.")] if simulated else []
    # Formats with the level of processing
    formats = Counter(f"{record.format} {record.level}".strip() for record in records)
    lines.append(("formats", ", ".join(f"{count} {name}" for name, count in formats.items())))
    lines.append(("stations", some(stations, 8)))
    lines.append(("interval", span([record.dt for record in records], "s")))
    lines.append(("duration", span([record.duration for record in records], "s")))
    # Motion, places that are missing, earthquakes
    missing = [name for name in stations if name not in places]
    unplaced = [("no place", f"{some(missing)}: coordinates are missing")] if missing else []
    return [*lines, *_largest_lines(records), *unplaced, *earthquake_lines(records)]


def _places(records: Sequence[RecordInfo]) -> dict[str, tuple[float, float]]:
    """Return longitude and latitude of every station that has them."""
    places = {}
    for record in records:
        if record.longitude is not None and record.latitude is not None:
            places[_station(record)] = (record.longitude, record.latitude)
    return places


def _largest_lines(records: Sequence[RecordInfo]) -> list[tuple[str, str]]:
    """Return the largest motion of each unit."""
    lines = []
    for unit in sorted({record.unit for record in records}):
        peak, record = max((one.peak, one.record) for one in records if one.unit == unit)
        lines.append(("largest", f"{peak:.3g} {unit} of {record}"))
    return lines


def earthquake_lines(records: Sequence[RecordInfo]) -> list[tuple[str, str]]:
    """Return one fact per earthquake with its records and stations."""
    groups: dict[str, list[RecordInfo]] = {}
    for record in records:
        for label in record.event.split(", "):
            groups.setdefault(label, []).append(record)
    # One line per earthquake, by number
    lines = []
    for label in sorted(groups, key=lambda one: int(one.partition(":")[0])):
        number, _, start = label.partition(": ")
        stations = len({_station(record) for record in groups[label]})
        text = f"{start}: {stations} stations, {len(groups[label])} records"
        lines.append((f"earthquake {number}", text))
    # Of many the first ones
    more = [("earthquakes", f"{len(lines) - SHOWN} more")] if len(lines) > SHOWN else []
    return [*lines[:SHOWN], *more]


def shakemap_facts(path: Path) -> Facts:
    """Return the facts of a ShakeMap; places are marked by their share of the largest motion."""
    grid = read_shakemap(path)
    # Values of the mapped quantity: PGA, or PSA at the shortest period
    values = (grid["pga"] if "pga" in grid else grid["psa"][0]).to_numpy()
    largest = float(values.max())
    event = str(grid.attrs.get("event_id", "of unknown identifier"))
    periods = [float(period) for period in grid["period"]]
    # Event, periods and largest motion
    lines = [
        ("earthquake", f"{event}{', a scenario: SIMULATED' if is_scenario(path) else ''}"),
        ("periods", some([f"{period:g} s" for period in periods])),
        ("largest", f"{largest:.3g} m/s2 of {'PGA' if 'pga' in grid else 'PSA'}"),
        ("map", "# from half of it, + from a quarter, - below"),
    ]
    title = f"{values.shape[1]} by {values.shape[0]} points"
    places = _shares(grid["longitude"].to_numpy(), grid["latitude"].to_numpy(), values / largest)
    known = {"event": event, "periods": periods, "largest": largest}
    return Facts(Kind.SHAKEMAP, title, lines, places, known)


def _shares(longitude: FloatArray, latitude: FloatArray, share: FloatArray) -> dict[str, Places]:
    """Return the places of a grid by their share of its largest value, the strongest last."""
    east, north = np.meshgrid(longitude, latitude)
    places = {}
    for sign, low, high in (("-", 0.0, 0.25), ("+", 0.25, 0.5), ("#", 0.5, np.inf)):
        inside = (share >= low) & (share < high)
        places[sign] = (east[inside].tolist(), north[inside].tolist())
    return places


def spectrum_facts(path: Path) -> Facts:
    """Return the facts of a design spectrum."""
    spectrum = read_design_spectrum(path)
    periods, dampings = spectrum.periods.tolist(), spectrum.dampings.tolist()
    largest = float(spectrum.sd.max())
    # Grid and largest value
    lines = [
        ("periods", span(periods, "s")),
        ("dampings", some([f"{damping:g}" for damping in dampings])),
        ("largest", f"{largest:.3g} m of displacement"),
        ("use", "per-obspy screen FILE.toml, with spectrum = and pairs ="),
    ]
    values = {"periods": periods, "dampings": dampings, "largest_displacement": largest}
    title = f"{len(periods)} periods, {len(dampings)} dampings"
    return Facts(Kind.SPECTRUM, title, lines, {}, values)


def spectra_facts(path: Path) -> Facts:
    """
    Return the facts of stored spectra of stations.

    Raises
    ------
    CatalogError
        If the file cannot be read or holds no such spectra.
    """
    import xarray as xr

    try:
        with xr.open_dataset(path.absolute()) as stored:
            return _dataset_facts(stored)
    except (OSError, ValueError, KeyError, RuntimeError) as error:
        raise CatalogError(str(path), f"holds no spectra of stations: {error}") from error


def _dataset_facts(found: "xr.Dataset") -> Facts:
    """Return the facts of spectra of one station or several."""
    # A station file holds one station, the file of a run all of them
    column = found["station_name" if "station_name" in found else "station"]
    names = np.atleast_1d(column.to_numpy()).astype(str).tolist()
    place = [np.atleast_1d(found[name]).tolist() for name in ("longitude", "latitude")]
    periods = found["period"].to_numpy().tolist()
    dampings = [f"{damping:g}" for damping in found["damping"].to_numpy()]
    lines = [
        ("stations", some(names, 8)),
        ("periods", f"{len(periods)}, {span(periods, 's')}"),
        ("dampings", some(dampings)),
        ("largest", f"{float(found['pga'].max()):.3g} m/s2 of PGA"),
    ]
    # Simulated motion is never shown without its mark
    if found.attrs.get("simulated") == "true":
        lines.append(("simulated", "the motion is SIMULATED."))
    known = {"stations": names, "periods": periods}
    return Facts(Kind.SPECTRA, f"{len(names)} stations", lines, {"^": (place[0], place[1])}, known)


def event_facts(path: Path) -> Facts:
    """Return the facts of the earthquake of a QuakeML file."""
    event = read_event(path)
    # The preferred origin and magnitude, or else the first ones
    origin = event.preferred_origin() or event.origins[0]
    magnitude = event.preferred_magnitude() or next(iter(event.magnitudes), None)
    size = f"{magnitude.magnitude_type or 'M'} {magnitude.mag:g}" if magnitude else "unknown"
    lines = [("origin time", str(origin.time)), ("magnitude", size)]
    places: dict[str, Places] = {}
    if None not in (origin.longitude, origin.latitude):
        places = {"*": ([origin.longitude], [origin.latitude])}
    lines.append(("use", "put it with the records, or --set records.event=FILE"))
    return Facts(Kind.EVENT, "one earthquake", lines, places, {"time": str(origin.time)})


def station_facts(path: Path) -> Facts:
    """Return the facts of StationXML, FDSN station text or a table of stations."""
    names, places = _described_stations(path)
    lines = [
        ("stations", some(names, 8)),
        ("use", "put it with the records, or --set records.stationxml=FILE"),
    ]
    layers = {"^": unzipped(places)}
    return Facts(Kind.STATIONS, f"{len(names)} stations", lines, layers, {"stations": names})


def _described_stations(path: Path) -> tuple[list[str], list[tuple[float, float]]]:
    """Return codes and places of the stations that a file describes."""
    content = path.read_bytes()
    if path.suffix.lower() == ".csv" and is_station_table(content[:1000]):
        rows = read_station_table(str(path), content)
        places = [(row.longitude, row.latitude) for row in rows]
        return [row.names[0] for row in rows], places
    # Stations of all networks
    networks = [network for inventory in read_inventories(path) for network in inventory]
    stations = [station for network in networks for station in network]
    places = [(station.longitude, station.latitude) for station in stations]
    return [station.code for station in stations], places


def _station(record: RecordInfo) -> str:
    """Return ``"NET.STA"`` of a record."""
    return ".".join(record.record.split(".")[:2])
