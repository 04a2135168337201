"""Facts of the earthquake in the files of a station, which an update of the earthquake replaces."""

from collections.abc import Mapping
from pathlib import Path
from typing import Any

from per_obspy.config import Processing
from per_obspy.processing.earthquake import Source, same_decisions, source_of
from per_obspy.records.earthquakes.quakeml import EventFile
from per_obspy.spectra.storage import read_spectra, write_spectra


def hypocentre_attributes(file: EventFile | None) -> dict[str, float]:
    """Return the hypocentre as attributes of a station file, degrees and m; empty if unknown."""
    if file is None:
        return {}
    origin = file.event.preferred_origin() or next(iter(file.event.origins), None)
    if not origin or None in (origin.longitude, origin.latitude, origin.depth):
        return {}
    return {
        f"hypocentre_{name}": float(origin[name]) for name in ("longitude", "latitude", "depth")
    }


def source_of_job(event: EventFile | None, decisions: list[dict[str, Any]]) -> Source | None:
    """Return the earthquake for the processing, which collects its decisions; None without one."""
    if event is None or not event.event.origins:
        return None
    return source_of(event.event, decisions)


def source_facts(event: EventFile | None) -> dict[str, object] | None:
    """Return everything of an earthquake that can change a station, as plain values."""
    if event is None:
        return None
    source = source_of(event.event)
    return {
        "time": source.time.ns,
        "place": [source.latitude, source.longitude, source.depth],
        "magnitude": source.magnitude,
        "hypocentre": hypocentre_attributes(event),
    }


def is_of_event(status: Mapping[str, Any], event: EventFile, processing: Processing) -> bool:
    """
    Return whether the motion of a station is that which an earthquake gives.

    Parameters
    ----------
    status : mapping
        Content of the station's status file.
    event : EventFile
        The earthquake now.
    processing : Processing
        Settings of the station.
    """
    decisions = status.get("decisions")
    if not isinstance(decisions, list) or not isinstance(status.get("source"), dict):
        return False
    return same_decisions(decisions, source_of(event.event), processing)


def moved_shard(shard: Path, before: Mapping[str, Any], event: EventFile) -> bool:
    """
    Write the hypocentre of an earthquake into a station file unless it is there.

    Parameters
    ----------
    shard : Path
        Whole station file.
    before : mapping
        From :func:`source_facts`, of the earthquake for which it was written.
    event : EventFile
        The earthquake now.

    Returns
    -------
    is_possible : bool
        False if one of both hypocentres is unknown: that of the headers is in its place.
    """
    known, new = before.get("hypocentre"), hypocentre_attributes(event)
    if known == new:
        return True
    if not known or not new:
        return False
    dataset = read_spectra(shard, shard.read_bytes()).drop_encoding()
    dataset.attrs |= new
    write_spectra(dataset, shard)
    return True
