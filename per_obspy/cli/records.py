"""``per-obspy events`` and ``fetch``: list earthquakes and fetch their records."""

import json
import sys
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from per_obspy.cli.printing import (
    AsJson,
    print_rejected,
    print_table,
    shown_progress,
    stop_if_nothing,
)

if TYPE_CHECKING:
    from collections.abc import Mapping

    from per_obspy.errors import Rejection
    from per_obspy.records.earthquakes.earthquake import Earthquake
    from per_obspy.records.earthquakes.shakemap_product import ShakeMapFiles

#: What the table of earthquakes shows of each.
EVENT_TITLES = ("event", "time (UTC)", "latitude", "longitude", "depth (m)", "magnitude", "place")


def events(
    source: Annotated[
        str,
        typer.Argument(help="QuakeML or GeoJSON file, URL of a feed, FDSN service (URL or name)."),
    ],
    start: Annotated[str | None, typer.Option(help="Earliest origin time, ISO 8601, UTC.")] = None,
    end: Annotated[str | None, typer.Option(help="Latest origin time, ISO 8601, UTC.")] = None,
    magnitude: Annotated[float | None, typer.Option(help="Smallest magnitude.")] = None,
    latitude: Annotated[float | None, typer.Option(help="Centre, degrees north.")] = None,
    longitude: Annotated[float | None, typer.Option(help="Centre, degrees east.")] = None,
    radius: Annotated[
        float | None, typer.Option(help="Of the circle around the centre, degrees.")
    ] = None,
    as_json: AsJson = False,
) -> None:
    """
    List earthquakes; their identifiers go into a configuration as records.fdsn.event_id.

    Example: per-obspy events USGS --start 2019-07-06 --end 2019-07-07 --magnitude 5
    """
    from per_obspy.records.earthquakes.services import find_events

    # Ask by the parameters of FDSN event services
    query = {"starttime": start, "endtime": end, "minmagnitude": magnitude}
    query |= {"latitude": latitude, "longitude": longitude, "maxradius": radius}
    given = {name: str(value) for name, value in query.items() if value is not None}
    rows = find_events(source, given)
    if as_json:
        print(json.dumps([row._asdict() for row in rows]))
    else:
        cells = [_event_cells(row) for row in rows]
        print_table(f"{len(rows)} events, the latest first", EVENT_TITLES, cells)
    stop_if_nothing(len(rows))


def fetch(
    source: Annotated[
        str,
        typer.Argument(
            help="TOML file of a run with a section \\[records.fdsn], or an earthquake: "
            "us7000abcd, geonet:2016p858000, emsc:20161113_0000040, ingv:8863681."
        ),
    ],
    folder: Annotated[
        Path | None,
        typer.Option("--output", "-o", help="Folder of an earthquake; its name if not given."),
    ] = None,
    radius: Annotated[
        float, typer.Option(help="Of the circle around the epicentre of an earthquake, m.")
    ] = 100_000.0,
    provider: Annotated[
        list[str] | None,
        typer.Option(help="Service that has records of an earthquake; may be given several times."),
    ] = None,
    event_service: Annotated[
        str | None,
        typer.Option(help="Event service of an earthquake (URL or name) instead of its own."),
    ] = None,
    seedlink: Annotated[
        list[str] | None,
        typer.Option(help="SeedLink server (host:port) for records that no service has yet."),
    ] = None,
    shakemap: Annotated[
        bool, typer.Option("--shakemap", help="Fetch the ShakeMap of an earthquake too.")
    ] = False,
    map_version: Annotated[
        str | None, typer.Option(help="Version of the ShakeMap; the preferred one if not given.")
    ] = None,
    again: Annotated[
        bool, typer.Option("--again", help="Ask again for stations that had no data.")
    ] = False,
    as_json: AsJson = False,
) -> None:
    """
    Fetch the records of a run, or of one earthquake, into the cache.

    Example: per-obspy fetch us7000abcd -o records
    """
    from per_obspy.runs.fetch import fetch_configured, fetch_event, fetch_map

    # Options that are given count for an earthquake; a configuration has its own
    named = {"providers": provider, "event_provider": event_service, "seedlink": seedlink}
    settings = {name: value for name, value in named.items() if value}
    with shown_progress() as progress:
        if Path(source).suffix == ".toml" or Path(source).is_file():
            _require_no_options(source, settings, folder or shakemap or map_version)
            place, stations, rejected = fetch_configured(Path(source), again, progress)
        else:
            target = folder or Path(source.replace(":", "-").replace("/", "-"))
            # In the first minutes there is a map, and no record yet
            if shakemap or map_version:
                _print_map(source, fetch_map(source, target, event_service, map_version))
            found = fetch_event(source, target, settings | {"radius": radius}, again, progress)
            place, stations, rejected = found.folder, found.stations, found.rejected
    _print_fetched(place, stations, rejected, as_json)
    stop_if_nothing(len(stations))


def _print_fetched(
    folder: Path, stations: list[str], rejected: "tuple[Rejection, ...]", as_json: bool
) -> None:
    """Print the records in a cache, as JSON or as text."""
    rows = [rejection._asdict() for rejection in rejected]
    if as_json:
        print(json.dumps({"folder": str(folder), "stations": stations, "rejected": rows}))
        return
    print(f"{len(stations)} stations are in {folder}; {len(rejected)} rejected")
    print_rejected(rows, len(rows))


def _print_map(source: str, found: "ShakeMapFiles | None") -> None:
    """Say on standard error which map there is, and how a run takes it."""
    if found is None:
        print(f"{source} has no ShakeMap yet: ask again later", file=sys.stderr)
        return
    # Keys of the configuration
    names = {
        "shakemap": found.grid,
        "shakemap_uncertainty": found.uncertainty,
        "stationlist": found.stations,
    }
    options = " ".join(f"--set records.{name}={path}" for name, path in names.items() if path)
    print(f"ShakeMap, version {found.version}: per-obspy run ... {options}", file=sys.stderr)


def _require_no_options(source: str, settings: "Mapping[str, object]", folder: object) -> None:
    """Raise ``CatalogError`` if options of an earthquake are given with a configuration."""
    from per_obspy.errors import CatalogError

    if settings or folder:
        problem = "is a configuration, whose section [records.fdsn] holds these options"
        raise CatalogError(source, problem)


def _event_cells(row: "Earthquake") -> list[object]:
    """Return the cells of an earthquake, empty where a value is unknown."""
    depth = "" if row.depth is None else f"{row.depth:.0f}"
    magnitude = "" if row.magnitude is None else f"{row.magnitude:g} {row.magnitude_type}"
    # Time to the second, position to 100 m
    position = (f"{row.latitude:.3f}", f"{row.longitude:.3f}")
    return [row.event_id, row.time[:19], *position, depth, magnitude, row.place]
