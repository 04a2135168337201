"""Settings of a watcher, and settings of the run of one earthquake derived from them."""

from collections.abc import Callable
from concurrent.futures import Executor
from datetime import datetime, timedelta
from pathlib import Path
from typing import Any, NamedTuple

from per_obspy.config import Fdsn, Run, Watch, Window, checked
from per_obspy.config.section import read_toml
from per_obspy.errors import CatalogError
from per_obspy.progress import Progress
from per_obspy.records.fdsn.providers import ROUTERS, base_url
from per_obspy.watch.notified_run import check_groups
from per_obspy.watch.relevance import Places
from per_obspy.watch.state import EventState, moment

#: Windows of records begin at multiples of this, s, so that a small change of the origin time
#: changes no window.
STEP = 10.0

#: Retries of a request for records; what still fails is asked for by the next run.
RETRIES = 2

#: Age from which a record file of a watched folder counts as finished, s.
SETTLE = 10.0

#: Keys of one earthquake, which a watcher sets itself.
OF_ONE_EVENT = ("event", "time")
OF_ONE_WINDOW = ("event_id", "shakemap_version", "start", "end", "latitude", "longitude")


class Watcher(NamedTuple):
    """Settings and state that the runs of all earthquakes share."""

    #: With a section ``watch``.
    settings: Run
    #: Watched folder.
    folder: Path
    #: Of the inventory.
    places: Places
    #: Returns the time, with its zone.
    now: Callable[[], datetime]
    #: Called for every stage of a run.
    progress: Progress
    #: Where stations and chunks are done, if not in processes of this machine.
    executor: Executor | None

    @property
    def watch(self) -> Watch:
        """Section of the watcher, which `read_settings` demands."""
        assert self.settings.watch is not None
        return self.settings.watch


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
        raise CatalogError(str(file), "has no section [watch]")
    records = content.get("records")
    if not isinstance(records, dict):
        raise CatalogError(str(file), "has no section [records]")
    _refuse_one_event(file, records)
    # The watcher gives every run its earthquake and its folder of fetched records
    placed = {**records, "event": "event.xml"}
    if isinstance(records.get("fdsn"), dict):
        placed["fdsn"] = {"cache": "records", **records["fdsn"]}
    # A folder that is watched grows: half-written files wait
    if "folder" in records:
        placed["settle"] = records.get("settle", SETTLE)
    settings = checked(Run, {**content, "records": placed}, str(file), file.resolve().parent)
    assert settings.watch is not None
    check_groups(settings)
    _require_services(file, settings.watch, settings.records.fdsn if settings.records else None)
    return settings


def _require_services(file: Path, watch: Watch, fdsn: Fdsn | None) -> None:
    """Raise ``CatalogError`` if a service is unknown, or none lists ShakeMaps that are wanted."""
    if fdsn and fdsn.shakemap and not watch.service:
        problem = "records.fdsn.shakemap needs watch.service: a file names no ShakeMap"
        raise CatalogError(str(file), problem)
    # A mistake at the start, not a failure of every poll
    for provider in (watch.service, *(fdsn.providers if fdsn else ())):
        if provider is not None and provider not in ROUTERS:
            base_url(provider)


def _refuse_one_event(file: Path, records: dict[str, Any]) -> None:
    """Raise ``CatalogError`` if records are configured for one earthquake."""
    sections: dict[str, tuple[dict[str, Any], tuple[str, ...]]]
    sections = {"records": (records, OF_ONE_EVENT)}
    # Keys of windows may be in two sections
    for name in ("fdsn", "sds"):
        if isinstance(records.get(name), dict):
            sections[f"records.{name}"] = (records[name], OF_ONE_WINDOW)
    for name, (section, keys) in sections.items():
        for key in keys:
            if key in section:
                problem = f"{name}.{key} is of one earthquake: leave it out to watch for any"
                raise CatalogError(str(file), problem)


def settings_of_event(settings: Run, folder: Path, state: EventState, delay: float) -> Run:
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
    delay : float
        Of the run, s after the origin time.
    """
    assert settings.records is not None
    assert settings.watch is not None
    # Windows end where records may end by now, and begin at multiples of a step
    records, ends = settings.records, delay - settings.watch.latency
    origin = moment(state.time)
    origin -= timedelta(seconds=origin.timestamp() % STEP)
    changes: dict[str, object] = {"event": folder / "event.xml"}
    # Downloads stay with the earthquake, and what fails is left for the next run
    if fdsn := records.fdsn:
        update = {"cache": folder / "records", "retries": min(fdsn.retries, RETRIES)}
        # The service that lists the earthquake has its map
        if fdsn.shakemap:
            update |= {"event_id": state.event_id, "event_provider": settings.watch.service}
        changes["fdsn"] = fdsn.model_copy(update=update | _window(fdsn, origin, ends))
    if records.sds is not None:
        changes["sds"] = records.sds.model_copy(update=_window(records.sds, origin, ends))
    update = {
        "name": f"{settings.name}: {state.event_id}",
        "output": folder / "work",
        "records": records.model_copy(update=changes),
        "watch": None,
    }
    return settings.model_copy(update=update)


def _window(window: Window, origin: datetime, ends: float) -> dict[str, str]:
    """Return start and end of the window of records."""
    start = origin - timedelta(seconds=window.before)
    end = origin + timedelta(seconds=min(window.after, ends))
    return {"start": f"{start:%Y-%m-%dT%H:%M:%S.%f}", "end": f"{end:%Y-%m-%dT%H:%M:%S.%f}"}
