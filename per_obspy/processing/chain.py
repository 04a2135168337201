"""The chain, station by station, every reason kept."""

import logging
from collections import defaultdict

from obspy import Stream
from obspy.core.event import Event

from per_obspy.config import Processing
from per_obspy.errors import RecordRejected, Rejection
from per_obspy.processing.instrument import process_instrument
from per_obspy.processing.noise.windows import source_of
from per_obspy.processing.notes import rejection
from per_obspy.processing.station.components import instruments, is_horizontal, oriented
from per_obspy.processing.station.merging import merged
from per_obspy.processing.station.structures import kept_apart

DEFAULTS = Processing()
log = logging.getLogger(__name__)


def process(stream: Stream, settings: Processing = DEFAULTS, event: Event | None = None) -> Stream:
    """
    Return the records of a stream, ready for spectra.

    Parameters
    ----------
    stream : obspy Stream
        Any number of stations; counts with a response attached, or m/s2 (``stats.units``).
    settings : Processing
        Every number of the chain, with its unit.
    event : obspy Event, optional
        Helps to find the first wave; no event is fine.

    Returns
    -------
    obspy Stream
        Acceleration, m/s2, of one instrument a station: at most two horizontals, with equal times,
        and a vertical. Filtered records keep the zero pads that hold the transients of the filter.
        ``stats.processing`` lists the steps, ``stats.per_obspy`` the numbers chosen: corners,
        usable periods and so on.

    Raises
    ------
    RecordRejected
        If nothing is left, with every reason of every trace.
    """
    stations: dict[tuple[str, str], Stream] = defaultdict(Stream)
    for trace in stream:
        stations[trace.stats.network, trace.stats.station] += trace
    out, reasons = Stream(), []
    for station in stations.values():
        kept, rejected = process_station(station, settings, event)
        out += kept
        reasons += [f"{row.name}: {reason}" for row in rejected for reason in row.reasons]
    if not out:
        raise RecordRejected(
            ", ".join(map(".".join, stations)) or "empty stream", *(reasons or ["no traces"])
        )
    for reason in reasons:
        log.warning("left out: %s", reason)
    return out


def process_station(
    stream: Stream, settings: Processing, event: Event | None = None
) -> tuple[Stream, tuple[Rejection, ...]]:
    """
    Return the processed traces of the best instrument of a station, and a row for everything left out.

    Parameters
    ----------
    stream : obspy Stream
        All channels of one station.
    settings : Processing
        Every number of the chain.
    event : obspy Event, optional
        Helps to find the first wave, and a corner where there is no noise.

    Returns
    -------
    kept : obspy Stream
        Empty if no horizontal survived.
    rejected : tuple of Rejection
        One row a trace; one bad trace never loses the others. Sensors in structures are among them:
        they recorded the structure, not the ground; `process_instruments` processes them.
    """
    ground, structure = kept_apart(stream)
    candidates, rejected = process_instruments(ground, settings, event)
    best = max(candidates, key=lambda traces: sum(map(is_horizontal, traces)), default=Stream())
    others = (trace for traces in candidates if traces is not best for trace in traces)
    beside = [
        rejection(trace, f"the instrument of {best[0].id} at the same station goes first")
        for trace in others
    ]
    if not any(map(is_horizontal, best)):
        beside += [rejection(trace, "no horizontal of its instrument is usable") for trace in best]
        best = Stream()
    beside += [
        rejection(trace, f"in a structure ({trace.stats.sensor_location}): kept apart")
        for trace in structure
    ]
    return best, (*rejected, *beside)


def process_instruments(
    stream: Stream, settings: Processing, event: Event | None = None
) -> tuple[list[Stream], tuple[Rejection, ...]]:
    """
    Return the processed traces of every instrument of a station apart, the preferred instrument first.

    For arrays in structures, boreholes and co-located sensors, whose instruments see different
    motion.

    Parameters
    ----------
    stream, settings, event
        As in `process_station`.

    Returns
    -------
    instruments : list of Stream
        Empty ones left out.
    rejected : tuple of Rejection
    """
    whole, lost = merged(stream)
    source = source_of(event) if event is not None and event.origins else None
    processed, rejected = [], list(lost)
    for instrument in instruments(oriented(whole)):
        traces, lost = process_instrument(instrument, settings, source)
        processed += [traces] if traces else []
        rejected += lost
    return processed, tuple(rejected)
