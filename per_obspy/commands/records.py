"""``per-obspy events``, ``fetch`` and ``info``: earthquakes and records, listed, fetched and looked at."""

import json
import sys
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from per_obspy.commands.endings import AsJson, end_if_nothing
from per_obspy.commands.printing import print_table, shown_progress

if TYPE_CHECKING:
    from per_obspy.errors import Rejection
    from per_obspy.records.fdsn.event_list import EventRow
    from per_obspy.records.summary import RecordInfo

#: What the table of records shows of each; JSON has everything.
SHOWN = ("record", "format", "level", "start", "dt", "duration", "azimuth", "peak", "unit", "file")


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
    from per_obspy.records.fdsn.event_list import find_events

    query = {"starttime": start, "endtime": end, "minmagnitude": magnitude}
    query |= {"latitude": latitude, "longitude": longitude, "maxradius": radius}
    rows = find_events(
        source, {name: str(value) for name, value in query.items() if value is not None}
    )
    if as_json:
        print(json.dumps([row._asdict() for row in rows]))
    else:
        titles = ("event", "time (UTC)", "latitude", "longitude", "depth (m)", "magnitude", "place")
        print_table(
            f"{len(rows)} events, the latest first", titles, [_shown_event(row) for row in rows]
        )
    end_if_nothing(len(rows))


def fetch(
    configuration: Annotated[
        Path, typer.Argument(help="TOML file of a run with a section [records.fdsn].")
    ],
    again: Annotated[
        bool, typer.Option("--again", help="Ask again for stations that had no data.")
    ] = False,
    as_json: AsJson = False,
) -> None:
    """
    Fetch the records of a run into its cache, and nothing else; what is there is not fetched again.

    Example: per-obspy fetch run.toml
    """
    from per_obspy.pipeline.fetch import fetch_configured

    with shown_progress() as progress:
        folder, stations, rejected = fetch_configured(configuration, again, progress)
    if as_json:
        rows = [one._asdict() for one in rejected]
        print(json.dumps({"folder": str(folder), "stations": stations, "rejected": rows}))
    else:
        print(f"{len(stations)} stations are in {folder}; {len(rejected)} rejected")
        _print_rejected(rejected)
    end_if_nothing(len(stations))


def info(
    path: Annotated[Path, typer.Argument(help="Folder, archive, waveform file or ASDF workspace.")],
    stationxml: Annotated[
        Path | None, typer.Option(help="StationXML file or folder, if not beside.")
    ] = None,
    as_json: AsJson = False,
) -> None:
    """
    Say what records there are, and why the others cannot be used.

    Example: per-obspy info shared/records
    """
    from per_obspy.records.summary import describe_records

    records, rejected = describe_records(path, stationxml)
    if as_json:
        useless = [one._asdict() for one in rejected]
        print(
            json.dumps({"records": [record._asdict() for record in records], "rejected": useless})
        )
    else:
        print_table(f"{len(records)} records", SHOWN, [_shown(record) for record in records])
        _print_rejected(rejected)
    end_if_nothing(len(records))


def _shown_event(row: "EventRow") -> list[object]:
    """Return the cells of an earthquake; nothing for what is unknown."""
    depth = "" if row.depth is None else f"{row.depth:.0f}"
    magnitude = "" if row.magnitude is None else f"{row.magnitude:g} {row.magnitude_type}"
    place = (f"{row.latitude:.3f}", f"{row.longitude:.3f}", depth)
    return [row.event_id, row.time[:19], *place, magnitude, row.place]


def _shown(record: "RecordInfo") -> list[object]:
    """Return the cells of a record; times to the second, nothing for what is unknown."""
    known = record._asdict() | {"start": record.start[:19]}
    return ["" if known[name] is None else known[name] for name in SHOWN]


def _print_rejected(rejected: "tuple[Rejection, ...]") -> None:
    """Print everything that cannot be used with all its reasons, on standard error."""
    for one in rejected:
        print(f"rejected {one.kind} {one.name}: {'; '.join(one.reasons)}", file=sys.stderr)
