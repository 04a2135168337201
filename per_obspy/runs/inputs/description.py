"""Description of any input or result, for ``per-obspy info``: one function per kind."""

from collections import Counter
from collections.abc import Callable, Iterable, Mapping, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np

from per_obspy.errors import CatalogError, Rejection, require_extra
from per_obspy.names import number_of
from per_obspy.runs.inputs.input_kinds import PAIR_KINDS, Kind, files_in, kind_of, records_place

if TYPE_CHECKING:
    import pandas as pd
    import pyarrow as pa
    import xarray as xr

    from per_obspy.checks import FloatArray
    from per_obspy.records.summary import RecordInfo

#: Longitudes and latitudes, degrees.
Places = tuple[Sequence[float], Sequence[float]]

#: Label and text of every fact.
Lines = list[tuple[str, str]]

#: Rows of a table that are read; earthquakes, rejections and keys of a configuration on the screen.
MOST_ROWS, MOST_EARTHQUAKES, MOST_REJECTIONS, MOST_KEYS = 100_000, 4, 2, 12

#: Signs on a map of a motion.
SHARES = ("map", "# from half of it, + from a quarter, - below")

#: Columns of a risk table that are read.
_RISK_COLUMNS = ["pair_id", "state", "longitude_1", "latitude_1", "longitude_2", "latitude_2"]


class Description(NamedTuple):
    """Description of an input or result."""

    #: Kind in words, and size in a few words.
    kind: Kind
    title: str
    #: Label and text of every fact.
    lines: Lines
    #: Sign on the map -> longitudes and latitudes, degrees; the empty sign is drawn by numbers.
    places: Mapping[str, Places] = {}
    #: Plain values, for machines.
    values: Mapping[str, Any] = {}
    #: Whether anything in it can be used.
    usable: bool = True


def describe(argument: str, stationxml: Path | None = None) -> Description:
    """
    Return the description of an input or result.

    Raises
    ------
    CatalogError
        If the input cannot be read as its recognised kind.
    """
    kind, path = kind_of(argument), Path(argument)
    if kind is Kind.EVENT_ID:
        lines = [("use", f"per-obspy run {argument} PAIRS fetches its records")]
        return Description(kind, "not looked up", lines, values={"event": argument})
    if kind is Kind.RECORDS:
        from per_obspy.records.summary import describe_records

        return _of_records(*describe_records(records_place(path)[0], stationxml))
    # A folder with one table or layer is described as that
    if path.is_dir() and kind in PAIR_KINDS:
        path = next(file for file, one in files_in(path).items() if one is kind)
    return _DESCRIBE[kind](path)


def span(values: Iterable[float], unit: str = "") -> str:
    """
    Return the range of the finite numbers as text.

    Examples
    --------
    >>> span([0.01, 0.02], "s"), span([5.0, 5.0], "m"), span([], "m")
    ('0.01 to 0.02 s', '5 m', 'unknown')
    """
    known = [value for value in values if value == value]
    if not known:
        return "unknown"
    ends = list(dict.fromkeys(f"{end:.4g}" for end in (min(known), max(known))))
    return f"{' to '.join(ends)} {unit}".strip()


def some(names: Sequence[str], count: int = 6) -> str:
    """
    Return the first names, and the number of the others, as text.

    Examples
    --------
    >>> some(["a", "b", "c"], 2), some([])
    ('a, b and 1 more', 'none')
    """
    more = f" and {len(names) - count} more" if len(names) > count else ""
    return ", ".join(names[:count]) + more or "none"


def _layer(places: Iterable[tuple[float, float]]) -> Places:
    """Return the longitudes and the latitudes of places."""
    east, north = zip(*places, strict=True) if (places := list(places)) else ((), ())
    return list(east), list(north)


def _of_records(records: "Sequence[RecordInfo]", rejected: Sequence[Rejection]) -> Description:
    """Describe a set of records; every record and every reason are values."""
    # Stations, and the places of those that have one
    stations = sorted({_station(record) for record in records})
    places = {
        _station(record): (record.longitude, record.latitude)
        for record in records
        if record.longitude is not None and record.latitude is not None
    }
    lines = _record_lines(records, stations) if records else []
    if missing := [name for name in stations if name not in places]:
        lines.append(("no place", f"{some(missing)}: coordinates are missing"))
    # Every record and every reason, for machines
    rows = [record._asdict() for record in records]
    return Description(
        Kind.RECORDS,
        f"{number_of(len(records), 'record')} of {number_of(len(stations), 'station')}, "
        f"{len(rejected)} rejected",
        [*lines, *(_earthquake_lines(records) if records else [])],
        {"^": _layer(places.values())},
        {"records": rows, "rejected": [one._asdict() for one in rejected]},
        usable=bool(records),
    )


def _record_lines(records: "Sequence[RecordInfo]", stations: Sequence[str]) -> Lines:
    """Return one line per fact of a set of records, with the largest motion of each unit."""
    # Formats with the level of processing
    simulated = sum(record.simulated for record in records)
    formats = Counter(f"{record.format} {record.level}".strip() for record in records)
    lines = [("simulated", f"{simulated} records are SIMULATED.")] if simulated else []
    lines += [
        ("formats", ", ".join(f"{count} {name}" for name, count in formats.items())),
        ("stations", some(stations, 8)),
        ("interval", span([record.dt for record in records], "s")),
        ("duration", span([record.duration for record in records], "s")),
    ]
    # Peaks of counts and of m/s2 cannot be compared
    for unit in sorted({record.unit for record in records}):
        peak, record = max((one.peak, one.record) for one in records if one.unit == unit)
        lines.append(("largest", f"{peak:.3g} {unit} of {record}"))
    return lines


def _earthquake_lines(records: "Sequence[RecordInfo]") -> Lines:
    """Return one line per earthquake with its records and stations, of many the first ones."""
    # A record may hold several earthquakes
    groups: dict[str, list[RecordInfo]] = {}
    for record in records:
        for label in record.event.split(", "):
            groups.setdefault(label, []).append(record)
    # By their number
    lines = []
    for label in sorted(groups, key=lambda one: int(one.partition(":")[0])):
        number, _, start = label.partition(": ")
        stations = len({_station(record) for record in groups[label]})
        text = (
            f"{start}: {number_of(stations, 'station')}, {number_of(len(groups[label]), 'record')}"
        )
        lines.append((f"earthquake {number}", text))
    rest = len(lines) - MOST_EARTHQUAKES
    return [*lines[:MOST_EARTHQUAKES], *([("earthquakes", f"{rest} more")] if rest > 0 else [])]


def _station(record: "RecordInfo") -> str:
    """Return ``"NET.STA"`` of a record."""
    return ".".join(record.record.split(".")[:2])


def _of_shakemap(path: Path) -> Description:
    """Describe a ShakeMap; places are marked by their share of the largest motion."""
    from per_obspy.records.shakemap import is_scenario, read_shakemap

    grid = read_shakemap(path)
    # Values of the mapped quantity: PGA, or PSA at the shortest period
    quantity = "PGA" if "pga" in grid else "PSA"
    values = (grid["pga"] if "pga" in grid else grid["psa"][0]).to_numpy()
    largest, periods = float(values.max()), grid["period"].to_numpy().tolist()
    event = str(grid.attrs.get("event_id", "of unknown identifier"))
    # Motion, and its map
    lines = [
        ("earthquake", f"{event}{', a scenario: SIMULATED' if is_scenario(path) else ''}"),
        ("periods", some([f"{period:g} s" for period in periods])),
        ("largest", f"{largest:.3g} m/s2 of {quantity}"),
        SHARES,
    ]
    east, north = np.meshgrid(grid["longitude"], grid["latitude"])
    known = {"event": event, "periods": periods, "largest": largest}
    title = "{1} by {0} points".format(*values.shape)
    return Description(Kind.SHAKEMAP, title, lines, _shares(east, north, values / largest), known)


def _of_station_list(path: Path) -> Description:
    """Describe a list of amplitudes; places are marked by their share of the largest motion."""
    from per_obspy.records.station_list import read_station_list

    stations, unusable, intensities, _ = read_station_list(path)
    # What is used, and what is left out
    lines = [
        ("stations", f"{len(stations)} usable, {len(unusable)} not"),
        *_rejected_lines([(row.name, row.reasons) for row in unusable]),
        ("intensities", f"{intensities} of people, left out"),
    ]
    known = {"stations": len(stations), "rejected": len(unusable)}
    if not stations:
        return Description(Kind.STATION_LIST, "no usable station", lines, {}, known, usable=False)
    # Motion by its largest SD
    periods = [period for station in stations for period in station.periods]
    largest = np.array([max(station.displacements) for station in stations])
    lines += [
        ("periods", span(periods, "s")),
        SHARES,
    ]
    east, north = np.array([(one.longitude, one.latitude) for one in stations]).T
    places = _shares(east, north, largest / largest.max())
    return Description(Kind.STATION_LIST, number_of(len(stations), "station"), lines, places, known)


def _shares(
    longitude: "FloatArray", latitude: "FloatArray", share: "FloatArray"
) -> dict[str, Places]:
    """Return places by their share of the largest value, the strongest last."""
    places = {}
    for sign, low, high in (("-", 0.0, 0.25), ("+", 0.25, 0.5), ("#", 0.5, np.inf)):
        inside = (share >= low) & (share < high)
        places[sign] = (longitude[inside].tolist(), latitude[inside].tolist())
    return places


def _of_spectrum(path: Path) -> Description:
    """Describe a design spectrum."""
    from per_obspy.screening.design import read_design_spectrum

    spectrum = read_design_spectrum(path)
    periods, dampings = spectrum.periods.tolist(), spectrum.dampings.tolist()
    largest = float(spectrum.sd.max())
    # Grid, largest value and use
    lines = [
        ("periods", span(periods, "s")),
        ("dampings", some([f"{damping:g}" for damping in dampings])),
        ("largest", f"{largest:.3g} m of displacement"),
        ("use", "per-obspy screen FILE.toml, with spectrum = and pairs ="),
    ]
    values = {"periods": periods, "dampings": dampings, "largest_displacement": largest}
    title = f"{len(periods)} periods, {len(dampings)} dampings"
    return Description(Kind.SPECTRUM, title, lines, values=values)


def _of_spectra(path: Path) -> Description:
    """Describe stored spectra of one station or several."""
    import xarray as xr

    try:
        with xr.open_dataset(path.absolute()) as stored:
            return _of_dataset(stored)
    except (OSError, ValueError, KeyError, RuntimeError) as error:
        raise CatalogError(str(path), f"holds no spectra of stations: {error}") from error


def _of_dataset(spectra: "xr.Dataset") -> Description:
    """Describe spectra; a station file holds one station, the file of a run all of them."""
    column = spectra["station_name" if "station_name" in spectra else "station"]
    names = np.atleast_1d(column.to_numpy()).astype(str).tolist()
    east, north = (np.atleast_1d(spectra[name]).tolist() for name in ("longitude", "latitude"))
    periods = spectra["period"].to_numpy().tolist()
    # Grid and largest motion
    lines = [
        ("stations", some(names, 8)),
        ("periods", f"{len(periods)}, {span(periods, 's')}"),
        ("dampings", some([f"{damping:g}" for damping in spectra["damping"].to_numpy()])),
        ("largest", f"{float(spectra['pga'].max()):.3g} m/s2 of PGA"),
    ]
    # Simulated motion is never shown without its mark
    if spectra.attrs.get("simulated") == "true":
        lines.append(("simulated", "the motion is SIMULATED."))
    known = {"stations": names, "periods": periods}
    return Description(
        Kind.SPECTRA, number_of(len(names), "station"), lines, {"^": (east, north)}, known
    )


def _of_event(path: Path) -> Description:
    """Describe the earthquake of a QuakeML file by its preferred origin, or else the first one."""
    from per_obspy.records.earthquakes.quakeml import read_event

    # The preferred origin and magnitude, or else the first ones
    event = read_event(path)
    origin = event.preferred_origin() or event.origins[0]
    magnitude = event.preferred_magnitude() or next(iter(event.magnitudes), None)
    size = f"{magnitude.magnitude_type or 'M'} {magnitude.mag:g}" if magnitude else "unknown"
    lines = [
        ("origin time", str(origin.time)),
        ("magnitude", size),
        ("use", "put it with the records, or --set records.event=FILE"),
    ]
    is_placed = None not in (origin.longitude, origin.latitude)
    places = {"*": _layer([(origin.longitude, origin.latitude)])} if is_placed else {}
    return Description(Kind.EVENT, "one earthquake", lines, places, {"time": str(origin.time)})


def _of_stations(path: Path) -> Description:
    """Describe StationXML, FDSN station text or a table of stations."""
    from per_obspy.formats.text.station_table import is_station_table, read_station_table
    from per_obspy.records.metadata import read_inventories

    # Code and place of each
    content = path.read_bytes()
    if path.suffix.lower() == ".csv" and is_station_table(content[:1000]):
        rows = read_station_table(str(path), content)
        stations = [(row.names[0], (row.longitude, row.latitude)) for row in rows]
    else:
        networks = [network for inventory in read_inventories(path) for network in inventory]
        found = [station for network in networks for station in network]
        stations = [(one.code, (one.longitude, one.latitude)) for one in found]
    # All networks together
    names = [name for name, _ in stations]
    lines = [
        ("stations", some(names, 8)),
        ("use", "put it with the records, or --set records.stationxml=FILE"),
    ]
    places = {"^": _layer(place for _, place in stations)}
    title = number_of(len(names), "station")
    return Description(Kind.STATIONS, title, lines, places, {"stations": names})


def _of_pairs(path: Path) -> Description:
    """Describe a pair table, by its first rows if it is large."""
    from per_obspy.inventory.files.reading import PairInventory, checked_chunk
    from per_obspy.inventory.table_checks import derived_counts, unused_columns

    inventory = PairInventory([path])
    table = checked_chunk(next(inventory.chunks(MOST_ROWS)))
    rejected = [one._asdict() for one in table.attrs["rejected"]]
    reasons = [(f"line {one['row']}", one["reasons"]) for one in rejected]
    derived = derived_counts(table) if len(table) else {}
    unused = unused_columns(table)
    # Ranges, derived and unknown columns, what is odd, and rejections
    odd = [("suspicious", sentence) for sentence in inventory.suspicions.sentences()]
    columns = _column_lines(derived, unused)
    lines = [*_range_lines(table), *columns, *odd, *_rejected_lines(reasons)]
    # Only the first rows of a large table are read
    counts = {"rows": inventory.count, "usable": len(table), "rejected": len(rejected)}
    values = {**counts, "derived": derived, "unknown": unused, "rejected": rejected}
    title = _title(counts)
    return Description(Kind.PAIRS, title, lines, {"": _centres(table)}, values, not table.empty)


def _title(counts: Mapping[str, int]) -> str:
    """Return the size of a pair table, of which the first rows are read if it is large."""
    first = f"the first {MOST_ROWS} of " if counts["rows"] > MOST_ROWS else ""
    rows = number_of(counts["rows"], "row")
    return f"{first}{rows}, {counts['usable']} usable, {counts['rejected']} rejected"


def _column_lines(derived: Mapping[str, int], unused: Sequence[str]) -> Lines:
    """Return the derived columns, and those that the schema does not know."""
    derivations = [f"{name} ({rows})" for name, rows in derived.items()]
    lines = [("derived", some(derivations, 8))] if derived else []
    return [*lines, *([("unknown", f"{some(unused)}: carried along unchanged")] if unused else [])]


def _range_lines(table: "pd.DataFrame") -> Lines:
    """Return the ranges of the gaps, and of both buildings of all pairs together."""
    from per_obspy.inventory.schema import COLUMNS
    from per_obspy.inventory.table_columns import numbers_in

    # Pairs that touch count apart
    gaps = table["gap"]
    pairs = f"0 in {number_of(gaps.eq(0.0).sum(), 'pair')}, unknown in {gaps.isna().sum()}"
    lines = [("gap", f"{span(gaps, 'm')}; {pairs}")]
    for name in ("height", "storeys", "period"):
        numbers = np.concatenate([numbers_in(table, f"{name}_{i}") for i in (1, 2)])
        if not np.isnan(numbers).all():
            lines.append((name, span(numbers, COLUMNS[f"{name}_1"].unit.replace("1", ""))))
    return lines


def _rejected_lines(rejected: Sequence[tuple[str, Sequence[str]]]) -> Lines:
    """Return the first rejections with their reasons."""
    first = rejected[:MOST_REJECTIONS]
    return [("rejected", f"{name}: {'; '.join(reasons)}") for name, reasons in first]


def _of_footprints(path: Path) -> Description:
    """Describe a layer of footprints, as a search of pairs reads it."""
    require_extra("gis", "pyogrio", "pyproj", "shapely")
    from per_obspy.inventory.footprints.layers import read_layer

    layer = read_layer(path)
    # How many buildings have a value under each of the names
    given = {str(name): int(values.notna().sum()) for name, values in layer.attributes.items()}
    counted = [f"{name} ({count})" for name, count in given.items() if count]
    lines = [("columns", some(counted, 12))]
    # Features that are no building
    lines += _rejected_lines([(one.name, one.reasons) for one in layer.rejected])
    east, north = _outline_centres(layer.outlines)
    rejected = [one._asdict() for one in layer.rejected]
    values = {"outlines": len(east), "columns": given, "rejected": rejected}
    title = f"{len(east)} outlines, {len(rejected)} rejected"
    usable = len(east) > 0
    return Description(Kind.FOOTPRINTS, title, lines, {"": (east, north)}, values, usable)


def _outline_centres(outlines: "pa.Array") -> Places:
    """Return the centres of outlines, block by block: as geometries they are large."""
    import shapely

    # Without an outline there is still a table of centres
    centres = [np.empty((0, 2))]
    for start in range(0, len(outlines), MOST_ROWS):
        block = outlines[start : start + MOST_ROWS].to_numpy(zero_copy_only=False)
        centres.append(shapely.get_coordinates(shapely.centroid(shapely.from_wkb(block))))
    east, north = np.concatenate(centres).T.tolist()
    return east, north


def _of_risk_table(path: Path) -> Description:
    """Describe a risk table, CSV or Parquet, by its first rows if it is large."""
    import pandas as pd

    from per_obspy.results.parts import parquet_rows

    if path.suffix.lower() == ".csv":
        table = pd.read_csv(path, nrows=MOST_ROWS, usecols=lambda name: name in _RISK_COLUMNS)
    else:
        table = parquet_rows([path], _RISK_COLUMNS).head(MOST_ROWS).to_pandas()
    return _of_worst_pairs(table)


def _of_worst_pairs(table: "pd.DataFrame") -> Description:
    """Describe the first rows of a risk table, which are the worst."""
    from per_obspy.screening.ranking import EVERY_STATE, STATES

    # Unknown states only where there are such pairs
    states = {state: int((table["state"] == state).sum()) for state in EVERY_STATE}
    counted = [f"{n} {state}" for state, n in states.items() if n or state in STATES]
    worst = some([str(name) for name in table["pair_id"]], 5)
    lines = [("pounding", ", ".join(counted)), ("worst pairs", worst)]
    title = f"{number_of(len(table), 'pair')}{' and more' if len(table) == MOST_ROWS else ''}"
    values, usable = {"pairs": len(table), **states}, len(table) > 0
    return Description(Kind.RISK, title, lines, {"": _centres(table)}, values, usable)


def _centres(table: "pd.DataFrame") -> Places:
    """Return the middle of every pair."""
    from per_obspy.inventory.table_columns import numbers_in

    places = []
    for name in ("longitude", "latitude"):
        first, second = numbers_in(table, f"{name}_1"), numbers_in(table, f"{name}_2")
        places.append(np.where(abs(first - second) > 180.0, first, (first + second) / 2.0).tolist())
    return places[0], places[1]


def _of_configuration(path: Path) -> Description:
    """Describe the configuration of a run by the keys that differ from their defaults."""
    from per_obspy.config import Run, load
    from per_obspy.config.commented import effective_content

    settings, folder = load(path, Run), path.resolve().parent
    content = effective_content(settings, folder)
    chosen = _dotted({key: one for key, one in content.items() if key not in ("name", "output")})
    # A value that may be a path says whether it is there
    keys = [
        (key, _presence(value, folder) if _is_path(value) else str(value))
        for key, value in chosen.items()
    ]
    # Of many keys the first ones
    lines = [("name", settings.name), ("results", _presence(settings.output, folder, " yet"))]
    lines += keys[:MOST_KEYS]
    lines += [("and", f"{len(keys) - MOST_KEYS} more keys")] if len(keys) > MOST_KEYS else []
    lines.append(("use", f"per-obspy run {path}"))
    title = f"{len(chosen)} keys differ from their defaults"
    return Description(Kind.CONFIGURATION, title, lines, values={"configuration": content})


def _is_path(value: object) -> bool:
    """Return whether a value of a configuration may be a path."""
    return isinstance(value, str) and ("/" in value or "." in value)


def _presence(path: str | Path, folder: Path, still: str = "") -> str:
    """Return a path that is seen from a folder, and whether it is there."""
    return f"{path}{'' if (folder / path).exists() else f' (not there{still})'}"


def _dotted(content: dict[str, Any], prefix: str = "") -> dict[str, Any]:
    """Return the values of nested tables by their dotted keys."""
    result: dict[str, Any] = {}
    for key, value in content.items():
        is_table = isinstance(value, dict) and value
        result |= _dotted(value, f"{prefix}{key}.") if is_table else {f"{prefix}{key}": value}
    return result


def _of_design(path: Path) -> Description:
    """Describe the configuration of a screening by a spectrum."""
    from per_obspy.config import Design, load

    design = load(path, Design)
    files = {"spectrum": design.spectrum, "pairs": design.pairs}
    lines = [(name, _presence(file, Path(), " yet")) for name, file in files.items()]
    return Description(Kind.DESIGN, "", [*lines, ("use", f"per-obspy screen {path}")])


def _of_ensemble(path: Path) -> Description:
    """Describe the configuration of an ensemble."""
    from per_obspy.config import Ensemble, load

    scenarios = load(path, Ensemble).scenario
    lines = [(one.name, _presence(one.run, Path(), " yet")) for one in scenarios]
    lines.append(("use", f"per-obspy screen {path}"))
    return Description(Kind.ENSEMBLE, number_of(len(scenarios), "scenario"), lines)


def _of_catalog(path: Path) -> Description:
    """Describe an index of stored inventories."""
    from per_obspy.inventory.catalogue import stored_inventories

    stored = stored_inventories(path)
    lines = [(one.name, f"{number_of(one.pairs, 'pair')}, {one.licence}") for one in stored]
    values = {"inventories": len(stored)}
    return Description(Kind.CATALOG, f"{len(stored)} inventories", lines, values=values)


def _of_scenario(path: Path) -> Description:
    """Describe a scenario; the map has its epicentre and the centre of its stations."""
    from per_obspy.config import Simulation, load

    scenario = load(path, Simulation).scenario
    lines = [
        ("magnitude", f"{scenario.magnitude:g}"),
        ("stations", f"{scenario.stations}"),
        ("use", f"per-obspy run {path} PAIRS, or per-obspy simulate {path} -o FOLDER"),
    ]
    # Epicentre and stations
    places = {
        "*": _layer([(scenario.longitude, scenario.latitude)]),
        "^": _layer([(scenario.city_longitude, scenario.city_latitude)]),
    }
    return Description(Kind.SCENARIO, scenario.name, lines, places)


def _of_result(folder: Path) -> Description:
    """Describe the results of a run or of an ensemble."""
    from per_obspy.results.ranked_table import listed_outputs, ranked_table, table_files
    from per_obspy.resume import StatusError, read_status

    file = folder / "run.json" if (folder / "run.json").is_file() else folder / "ensemble.json"
    try:
        record = read_status(file)
    except StatusError as error:
        raise CatalogError(str(file), f"cannot be read: {error}") from error
    # What run.json says, and the stations
    counts = record.get("counts") or {}
    lines, places = _run_lines(record, counts), _station_places(folder / "stations.csv")
    # The risk table has states, worst pairs and places
    if files := table_files(folder):
        with ranked_table(files) as table:
            worst = _of_worst_pairs(table.first(MOST_ROWS, _RISK_COLUMNS))
        lines, places = [*lines, *worst.lines], {**worst.places, **places}
    lines.append(("files", some(listed_outputs([*record["outputs"], file.name]), 12)))
    title = ", ".join(number_of(counts.get(f"{thing}s", 0), thing) for thing in ("station", "pair"))
    return Description(Kind.RESULT, title, lines, places, record)


def _run_lines(record: Mapping[str, Any], counts: Mapping[str, int]) -> Lines:
    """Return the facts in ``run.json``."""
    lines = [(name, str(record.get(name, ""))) for name in ("name", "state")]
    lines += [("begun", str(record["started"]))] if "started" in record else []
    lines += [("simulated", "the ground motion is SIMULATED.")] if record.get("simulated") else []
    for one in record.get("earthquakes") or []:
        if one.get("screened"):
            # Of the event where there are no groups
            time = one.get("start") or (one.get("event") or {}).get("time", "")
            stations = one.get("stations", counts.get("stations", 0))
            lines.append(("earthquake", f"{time}, {number_of(stations, 'station')}"))
    # Rejections of footprints before the run, of everything else in it
    drawn = record.get("drawn") or {}
    if drawn.get("rejected"):
        lines.append(("footprints", f"{drawn['rejected']} rejected: pairs.rejected.csv"))
    return [*lines, *([("rejected", _rejections(counts))] if counts else [])]


def _rejections(counts: Mapping[str, int]) -> str:
    """Return the number of rejections of each kind as text."""
    kinds = {name: count for name, count in counts.items() if name.startswith("rejected_")}
    parts = [f"{count} {name.removeprefix('rejected_')}" for name, count in kinds.items() if count]
    return f"{', '.join(parts)}: rejected.csv" if parts else "nothing"


def _station_places(path: Path) -> dict[str, Places]:
    """Return the places of the stations of a run, empty without a table."""
    import pandas as pd

    try:
        table = pd.read_csv(path, usecols=["longitude", "latitude"])
    except (OSError, ValueError):
        return {}
    return {"^": (table["longitude"].tolist(), table["latitude"].tolist())}


_DESCRIBE: dict[Kind, Callable[[Path], Description]] = {
    Kind.PAIRS: _of_pairs,
    Kind.FOOTPRINTS: _of_footprints,
    Kind.RISK: _of_risk_table,
    Kind.SHAKEMAP: _of_shakemap,
    Kind.STATION_LIST: _of_station_list,
    Kind.SPECTRUM: _of_spectrum,
    Kind.SPECTRA: _of_spectra,
    Kind.EVENT: _of_event,
    Kind.STATIONS: _of_stations,
    Kind.CONFIGURATION: _of_configuration,
    Kind.DESIGN: _of_design,
    Kind.ENSEMBLE: _of_ensemble,
    Kind.CATALOG: _of_catalog,
    Kind.SCENARIO: _of_scenario,
    Kind.RESULT: _of_result,
}
