"""Settings of a watcher, and those of the run of one earthquake that they make."""

from pathlib import Path
from typing import Any

from obspy import UTCDateTime
from obspy.core.event import Event

from per_obspy.config import Fdsn, Records, Run, Sds, checked
from per_obspy.config.section import read_toml
from per_obspy.errors import CatalogError
from per_obspy.operation.events.state import EventState
from per_obspy.records.fdsn.providers import base_url

#: Windows of records begin at multiples of this, s, so that a small change of the origin time
#: changes no window.
STEP = 10.0

#: Retries of a request for records; what still fails is asked for by the next run.
RETRIES, LONGEST_PAUSE = 2, 5.0

#: Keys of one earthquake, which a watcher sets itself.
OF_ONE_EVENT = ("event", "time")
OF_ONE_WINDOW = ("event_id", "start", "end", "latitude", "longitude")


def read_settings(file: Path) -> Run:
    """
    Read the configuration of a watcher: that of a run without an earthquake, with ``[watch]``.

    Raises
    ------
    CatalogError
        If it is wrong, has no section ``[watch]`` or no ``[records]``, or names one earthquake.
    """
    content: dict[str, Any] = read_toml(file)
    if "watch" not in content:
        raise CatalogError(str(file), "has no section [watch], which says what is watched")
    records = content.get("records")
    if not isinstance(records, dict):
        raise CatalogError(str(file), "has no section [records], which says where records are")
    _refuse_one_event(file, records)
    # The watcher gives every run its earthquake and its folder of fetched records
    placed = {**records, "event": "event.xml"}
    if isinstance(records.get("fdsn"), dict):
        placed["fdsn"] = {"cache": "records", **records["fdsn"]}
    settings = checked(Run, {**content, "records": placed}, str(file), file.resolve().parent)
    assert settings.watch is not None
    # An unknown service is a mistake at the start, not a failure of every poll
    if settings.watch.service is not None:
        base_url(settings.watch.service)
    return settings


def _refuse_one_event(file: Path, records: dict[str, Any]) -> None:
    """Raise ``CatalogError`` if records are configured for one earthquake."""
    sections = {"records": (records, OF_ONE_EVENT)}
    for name in ("fdsn", "sds"):
        if isinstance(records.get(name), dict):
            sections[f"records.{name}"] = (records[name], OF_ONE_WINDOW)
    for name, (section, keys) in sections.items():
        for key in keys:
            if key in section:
                problem = f"{name}.{key} is of one earthquake: leave it out to watch for any"
                raise CatalogError(str(file), problem)


def settings_of_event(settings: Run, folder: Path, state: EventState, event: Event, delay: float) -> Run:
    """
    Return the settings of the run of an earthquake.

    The same earthquake and delay give the same settings, whichever runs came before.

    Parameters
    ----------
    settings : Run
        Of the watcher.
    folder : Path
        Of the earthquake.
    state : EventState
        Of the earthquake.
    event : Event
        With an origin.
    delay : float
        Of the run, s after the origin time.
    """
    assert settings.watch is not None
    assert settings.records is not None
    records = settings.records
    ends = delay - settings.watch.latency
    changes: dict[str, object] = {"event": folder / "event.xml"}
    if records.fdsn is not None:
        changes["fdsn"] = _placed_fdsn(records.fdsn, folder, event, ends)
    if records.sds is not None:
        changes["sds"] = _placed_sds(records.sds, event, ends)
    update = {
        "name": f"{settings.name}: {state.event_id}",
        "output": folder / "work",
        "records": records.model_copy(update=changes),
        "watch": None,
    }
    return settings.model_copy(update=update)


def _placed_fdsn(fdsn: Fdsn, folder: Path, event: Event, ends: float) -> Fdsn:
    """Return the request for the records of an earthquake."""
    start, end = _window(fdsn.before, fdsn.after, event, ends)
    pause = LONGEST_PAUSE if fdsn.longest_pause is None else fdsn.longest_pause
    update = {
        "cache": folder / "records",
        "start": start,
        "end": end,
        "retries": min(fdsn.retries, RETRIES),
        "longest_pause": pause,
    }
    return fdsn.model_copy(update=update)


def _placed_sds(sds: Sds, event: Event, ends: float) -> Sds:
    """Return the window of an archive for an earthquake."""
    start, end = _window(sds.before, sds.after, event, ends)
    return sds.model_copy(update={"start": start, "end": end})


def _window(before: float, after: float, event: Event, ends: float) -> tuple[str, str]:
    """Return start and end of the window of records, which ends where records may end by now."""
    origin = event.preferred_origin() or event.origins[0]
    rounded = UTCDateTime(origin.time.timestamp // STEP * STEP)
    return str(rounded - before), str(rounded + min(after, ends))


def has_other_sources(records: Records) -> bool:
    """Return whether records come from elsewhere than FDSN services."""
    others = (records.folder, records.columns, records.sds, records.asdf, records.shakemap)
    return any(bool(source) for source in others)
