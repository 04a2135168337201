"""Facts of a run for its summary: the earthquake and the stations."""

import re
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

import pandas as pd

from per_obspy.errors import shortened
from per_obspy.records.shakemap import map_event
from per_obspy.report.results import Region, Revision
from per_obspy.results.station_summary import COLUMNS
from per_obspy.resume import StatusError, read_status

#: A time of ISO 8601 up to its minute.
TIME = re.compile(r"\d{4}-\d\d-\d\d[T ]\d\d:\d\d")


#: Characters of the longest identifier that is shown.
LONGEST_ID = 80


def event_facts(event: Any) -> dict[str, object]:
    """
    Return time, place and size of an earthquake, as far as it has them.

    Parameters
    ----------
    event : obspy.core.event.Event
        With at least one origin.
    """
    origin = event.preferred_origin() or event.origins[0]
    magnitude = event.preferred_magnitude() or next(iter(event.magnitudes), None)
    # What an event does not have is None
    facts = {
        "time": str(origin.time)[:19],
        "longitude": origin.longitude,
        "latitude": origin.latitude,
        "depth": origin.depth,
        "magnitude": magnitude.mag if magnitude else None,
    }
    return {name: value for name, value in facts.items() if value is not None}


def with_event(groups: Sequence[dict[str, object]], event: Any | None) -> list[dict[str, object]]:
    """
    Return the earthquakes of a run, the screened one with the facts of its event file.

    Records that were fetched for an event have no groups: it is the only earthquake.
    """
    if event is None:
        return list(groups)
    facts = event_facts(event)
    if not groups:
        return [{"screened": True, "event": facts}]
    return [group | {"event": facts} if group["screened"] else group for group in groups]


def event_of_run(record: Path, region: Region, shakemap: Path | None = None) -> dict[str, Any]:
    """
    Return the facts of the earthquake of a run, from its event file or the records' headers.

    Parameters
    ----------
    record : Path
        ``run.json``, finished or not.
    region : Region
        Region whose epicentre counts where no event file or record gives one.
    shakemap : Path, optional
        Grid of the map that serves pairs without a station; it names itself, and the earthquake
        where no record does.
    """
    try:
        groups = read_status(record).get("earthquakes")
    except StatusError:
        groups = None
    facts: dict[str, Any] = dict(map_event(shakemap)) if shakemap else {}
    if region.epicentre is not None:
        facts |= dict(zip(("longitude", "latitude"), region.epicentre, strict=True))
    # One earthquake is screened
    for group in groups if isinstance(groups, list) else ():
        if isinstance(group, Mapping) and group.get("screened"):
            known = group.get("event") or group.get("headers") or {}
            facts |= {"start": group.get("start")}
            facts |= {name: value for name, value in known.items() if value is not None}
    return facts


def revision_of_run(record: Path) -> Revision:
    """
    Return the revision that a run is made for.

    Parameters
    ----------
    record : Path
        ``run.json``, finished or not: ``revision``, ``event_id``, and ``revised`` or ``started``.
    """
    try:
        known = read_status(record)
    except StatusError:
        return Revision(0, "", "")
    given, time = known.get("revision"), str(known.get("revised") or known.get("started") or "")
    # Anything else than a whole number above 0 is none
    is_number = isinstance(given, int) and not isinstance(given, bool) and given > 0
    number = int(str(given)) if is_number else 0
    name = known.get("event_id")
    return Revision(
        number,
        time[:16].replace("T", " ") if TIME.match(time) else "",
        shortened(name, LONGEST_ID) if isinstance(name, str) else "",
    )


def read_stations(path: Path) -> pd.DataFrame:
    """Return the rows of ``stations.csv``; none where there is no such table."""
    if not path.exists():
        return pd.DataFrame()
    types = {name: "str" for name, column in COLUMNS.items() if column.dtype == "str"}
    return pd.read_csv(
        path,
        dtype=types,
        keep_default_na=False,
        na_values={name: [""] for name, column in COLUMNS.items() if column.dtype != "str"},
    )
