"""Facts of records, ShakeMaps, spectra, and descriptions of earthquakes and stations."""

from collections import Counter
from collections.abc import Sequence
from pathlib import Path

import numpy as np

from per_obspy.errors import CatalogError, Rejection
from per_obspy.pipeline.inputs.facts import Facts, Places, some, span
from per_obspy.pipeline.inputs.recognition import Kind
from per_obspy.records.event_file import read_event
from per_obspy.records.folder import read_inventories
from per_obspy.records.shakemap import is_scenario, read_shakemap
from per_obspy.records.summary import RecordInfo
from per_obspy.screening.by_spectrum.design_spectrum import read_design_spectrum

#: Earthquakes that are listed.
SHOWN = 4


def record_facts(records: Sequence[RecordInfo], rejected: Sequence[Rejection]) -> Facts:
    """Return the facts of records that were described one by one."""
    stations = sorted({_station(record) for record in records})
    formats = Counter(f"{record.format} {record.level}".strip() for record in records)
    known = {_station(one): (one.longitude, one.latitude) for one in records if _is_placed(one)}
    simulated = sum(record.simulated for record in records)
    lines = [("simulated", f"{simulated} records are SIMULATED.")] if simulated else []
    lines += [
        ("formats", ", ".join(f"{count} {name}" for name, count in formats.items())),
        ("stations", some(stations, 8)),
        ("interval", span([record.dt for record in records], "s")),
        ("duration", span([record.duration for record in records], "s")),
    ]
    # The largest motion of each unit
    for unit in sorted({record.unit for record in records}):
        largest = max((one for one in records if one.unit == unit), key=lambda one: one.peak)
        lines.append(("largest", f"{largest.peak:.3g} {unit} of {largest.record}"))
    missing = [name for name in stations if name not in known]
    lines += [("no place", f"{some(missing)}: coordinates are missing")] if missing else []
    lines += earthquake_lines(records)
    return Facts(
        Kind.RECORDS,
        f"{len(records)} records of {len(stations)} stations, {len(rejected)} rejected",
        lines if records else [],
        {"^": _unzipped([place for place in known.values() if None not in place])},
        {
            "records": [record._asdict() for record in records],
            "rejected": [one._asdict() for one in rejected],
        },
        usable=len(records) > 0,
    )


def earthquake_lines(records: Sequence[RecordInfo]) -> list[tuple[str, str]]:
    """Return one fact per earthquake with its records and stations."""
    groups: dict[str, list[RecordInfo]] = {}
    for record in records:
        for label in record.event.split(", "):
            groups.setdefault(label, []).append(record)
    # One line per earthquake, by number
    lines = []
    ordered = sorted(groups.items(), key=lambda item: int(item[0].partition(":")[0]))
    for label, members in ordered[:SHOWN]:
        number, _, start = label.partition(": ")
        stations = len({_station(record) for record in members})
        text = f"{start}: {stations} stations, {len(members)} records"
        lines.append((f"earthquake {number}", text))
    if len(ordered) > SHOWN:
        lines.append(("earthquakes", f"{len(ordered) - SHOWN} more"))
    return lines


def shakemap_facts(path: Path) -> Facts:
    """Return the facts of a ShakeMap; places are marked by their share of the largest motion."""
    grid = read_shakemap(path)
    motion = grid["pga"] if "pga" in grid else grid["psa"][0]
    longitude, latitude = np.meshgrid(grid["longitude"], grid["latitude"])
    values = motion.to_numpy()
    share = values / values.max()
    # From weak to strong, so that strong motion covers weak
    places = {}
    for sign, low, high in (("-", 0.0, 0.25), ("+", 0.25, 0.5), ("#", 0.5, np.inf)):
        inside = (share >= low) & (share < high)
        places[sign] = (longitude[inside].tolist(), latitude[inside].tolist())
    event = str(grid.attrs.get("event_id", "of unknown identifier"))
    periods = [float(period) for period in grid["period"]]
    lines = [
        ("earthquake", f"{event}{', a scenario: SIMULATED' if is_scenario(path) else ''}"),
        ("periods", some([f"{period:g} s" for period in periods])),
        ("largest", f"{values.max():.3g} m/s2 of {'PGA' if 'pga' in grid else 'PSA'}"),
        ("map", "# from half of it, + from a quarter, - below"),
    ]
    values_of = {"event": event, "periods": periods, "largest": float(values.max())}
    return Facts(
        Kind.SHAKEMAP, f"{values.shape[1]} by {values.shape[0]} points", lines, places, values_of
    )


def spectrum_facts(path: Path) -> Facts:
    """Return the facts of a design spectrum."""
    spectrum = read_design_spectrum(path)
    periods, dampings = spectrum.periods.tolist(), spectrum.dampings.tolist()
    largest = float(spectrum.sd.max())
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
            found = stored.load()
        # A shard holds one station, the file of a run all of them
        name = "station_name" if "station_name" in found else "station"
        names = np.atleast_1d(found[name].to_numpy()).astype(str).tolist()
        places = {name: np.atleast_1d(found[name]).tolist() for name in ("longitude", "latitude")}
        periods = found["period"].to_numpy().tolist()
    except (OSError, ValueError, KeyError, RuntimeError) as error:
        raise CatalogError(str(path), f"holds no spectra of stations: {error}") from error
    pga = found["pga"].to_numpy() if "pga" in found else np.array([np.nan])
    lines = [
        ("stations", some(names, 8)),
        ("periods", f"{len(periods)}, {span(periods, 's')}"),
        ("dampings", some([f"{float(one):g}" for one in np.atleast_1d(found["damping"])])),
        ("largest", f"{np.nanmax(pga):.3g} m/s2 of PGA"),
    ]
    if str(found.attrs.get("simulated")) == "true":
        lines.append(("simulated", "the motion is SIMULATED."))
    values = {"stations": names, "periods": periods}
    layers = {"^": (places["longitude"], places["latitude"])}
    return Facts(Kind.SPECTRA, f"{len(names)} stations", lines, layers, values)


def event_facts(path: Path) -> Facts:
    """Return the facts of the earthquake of a QuakeML file."""
    event = read_event(path)
    origin = event.preferred_origin() or event.origins[0]
    magnitude = event.preferred_magnitude() or next(iter(event.magnitudes), None)
    size = f"{magnitude.magnitude_type or 'M'} {magnitude.mag:g}" if magnitude else "unknown"
    lines = [("origin time", str(origin.time)), ("magnitude", size)]
    places: dict[str, Places] = {}
    if None not in (origin.longitude, origin.latitude):
        places = {"*": ([origin.longitude], [origin.latitude])}
    lines.append(("use", "beside the records, or --set records.event=FILE"))
    return Facts(Kind.EVENT, "one earthquake", lines, places, {"time": str(origin.time)})


def station_facts(path: Path) -> Facts:
    """Return the facts of StationXML, FDSN station text or a table of stations."""
    from per_obspy.formats.text.station_table import is_station_table, read_station_table

    content = path.read_bytes()
    if path.suffix.lower() == ".csv" and is_station_table(content[:1000]):
        rows = read_station_table(str(path), content)
        names = [row.names[0] for row in rows]
        places = [(row.longitude, row.latitude) for row in rows]
    else:
        stations = [one for inventory in read_inventories(path) for net in inventory for one in net]
        names = [station.code for station in stations]
        places = [(station.longitude, station.latitude) for station in stations]
    lines = [
        ("stations", some(names, 8)),
        ("use", "beside the records, or --set records.stationxml=FILE"),
    ]
    layers = {"^": _unzipped(places)}
    return Facts(Kind.STATIONS, f"{len(names)} stations", lines, layers, {"stations": names})


def _station(record: RecordInfo) -> str:
    """Return ``"NET.STA"`` of a record."""
    return ".".join(record.record.split(".")[:2])


def _is_placed(record: RecordInfo) -> bool:
    """Return whether the place of a record is known."""
    return record.longitude is not None and record.latitude is not None


def _unzipped(places: Sequence[tuple[float | None, float | None]]) -> Places:
    """Return longitudes and latitudes of places."""
    known = [(x, y) for x, y in places if x is not None and y is not None]
    return [x for x, _ in known], [y for _, y in known]
