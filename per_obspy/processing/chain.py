"""The processing chain, station by station, with a reason for every rejected trace."""

import logging
from collections import defaultdict
from collections.abc import Iterable

from obspy import Stream, Trace
from obspy.core.event import Event

from per_obspy.config import Processing
from per_obspy.errors import RecordRejected, Rejection
from per_obspy.processing.account import is_processed, rejection, taken
from per_obspy.processing.components import (
    instruments,
    is_horizontal,
    orient,
    split_structures,
    tell_apart,
)
from per_obspy.processing.earthquake import Source, source_of
from per_obspy.processing.filter.baseline import without_mean
from per_obspy.processing.instrument import process_instrument
from per_obspy.processing.instrument_response import in_acceleration
from per_obspy.processing.merging import merged

#: Settings of an empty configuration.
DEFAULTS = Processing()

log = logging.getLogger(__name__)


def process(
    stream: Stream | Trace, settings: Processing = DEFAULTS, event: Event | None = None
) -> Stream:
    """
    Process the records of a stream so that spectra can be computed from them.

    Parameters
    ----------
    stream : obspy Stream or Trace
        Any number of stations; counts with a response attached, or m/s2 (``stats.units``).
    settings : Processing
        Every number of the chain, with its unit.
    event : obspy Event, optional
        Its origin helps to find the first wave.

    Returns
    -------
    obspy Stream
        Acceleration, m/s2, of one instrument per station: at most two horizontals, with equal
        times, and a vertical. Filtered records keep the zero pads with the filter's transients.
        ``stats.processing`` lists the steps, ``stats.per_obspy`` the numbers chosen: corners,
        usable periods and so on.

    Raises
    ------
    RecordRejected
        If no trace is left, with every reason of every trace.
    TypeError
        If the argument is neither a Stream nor a Trace.
    """
    # One trace is a stream of one
    if isinstance(stream, Trace):
        stream = Stream([stream])
    if not isinstance(stream, Stream):
        raise TypeError(f"stream must be an ObsPy Stream or Trace, got {type(stream).__name__}")
    stations: dict[tuple[str, str], Stream] = defaultdict(Stream)
    for trace in stream:
        stations[trace.stats.network, trace.stats.station] += trace
    # Every station by itself
    out, reasons = Stream(), []
    for station in stations.values():
        accepted, rejected = process_station(station, settings, event)
        out += accepted
        for row in rejected:
            reasons += [f"{row.name}: {reason}" for reason in row.reasons]
    if not out:
        names = ", ".join(map(".".join, stations)) or "empty stream"
        raise RecordRejected(names, *(reasons or ["no traces"]))
    for reason in reasons:
        log.warning("left out: %s", reason)
    return out


def process_station(
    stream: Iterable[Trace], settings: Processing, event: Event | Source | None = None
) -> tuple[Stream, tuple[Rejection, ...]]:
    """
    Process a station and return the best instrument with a row for each other trace.

    Parameters
    ----------
    stream : iterable of obspy Trace
        All channels of one station, unchanged by it. From :func:`.account.taken`, so that no other
        code holds them, raw records leave memory on the way.
    settings : Processing
        Every number of the chain.
    event : obspy Event or Source, optional
        Its origin helps to find the first wave, its magnitude gives a corner without noise.

    Returns
    -------
    best : obspy Stream
        Empty if no horizontal is usable.
    rejected : tuple of Rejection
        One row per trace; a bad trace is rejected alone. Sensors in structures are among them: they
        recorded the structure, not the ground; `process_instruments` processes them.
    """
    ground, structure = split_structures(stream)
    candidates, unusable = process_instruments(taken(ground), settings, event)
    rejected = list(unusable)

    # Horizontals first, then all components
    def components(traces: Stream) -> tuple[int, int]:
        return sum(map(is_horizontal, traces)), len(traces)

    best = max(candidates, key=components, default=Stream())
    # Other instruments at the same place
    for traces in candidates:
        if traces is not best:
            reason = f"the instrument of {best[0].id} at the same station goes first"
            rejected += [rejection(trace, reason) for trace in traces]
    # Verticals alone
    if not any(map(is_horizontal, best)):
        reason = "no horizontal of its instrument is usable"
        rejected += [rejection(trace, reason) for trace in best]
        best = Stream()
    # Sensors in structures
    for trace in structure:
        reason = f"in a structure ({trace.stats.sensor_location}): kept apart"
        rejected.append(rejection(trace, reason))
    return best, tuple(rejected)


def process_instruments(
    stream: Iterable[Trace], settings: Processing, event: Event | Source | None = None
) -> tuple[list[Stream], tuple[Rejection, ...]]:
    """
    Process every instrument of a station by itself, the preferred instrument first.

    For arrays in structures, boreholes and co-located sensors, whose instruments see different
    motion.

    Parameters
    ----------
    stream, settings, event
        As in `process_station`.

    Returns
    -------
    instruments : list of Stream
        Without those that have no usable trace.
    rejected : tuple of Rejection
    """
    whole, broken = merged(stream)
    source = event if isinstance(event, Source) else None
    if isinstance(event, Event) and event.origins:
        source = source_of(event)
    processed, rejected = [], list(broken)
    # Each instrument by itself
    for instrument in instruments(taken(whole)):
        components, unclear = tell_apart(instrument)
        # Each component has one owner, and leaves memory when it is done
        instrument.clear()
        directed = map(orient, taken(components))
        traces, unusable = process_instrument(directed, settings, source)
        processed += [traces] if traces else []
        rejected += (*unclear, *unusable)
    return processed, tuple(rejected)


def before_processing(stream: Stream, processed: Trace, settings: Processing) -> Trace | None:
    """
    Return the raw record of a processed trace in m/s2 over the processed time.

    Only the mean of its noise is removed.

    Parameters
    ----------
    stream : obspy Stream
        All channels of the station as read.
    processed : obspy Trace
        From `process_station`.
    settings : Processing
        Settings of that processing.

    Returns
    -------
    obspy Trace or None
        None if the record came processed by others.
    """
    whole, _ = merged(
        trace for trace in stream if trace.id == processed.id and not is_processed(trace)
    )
    if not whole:
        return None
    physical = in_acceleration(whole[0], settings.gain_tolerance)
    # Start of the processed record without its pads, s and samples after that of the raw one
    chosen, dt = processed.stats.per_obspy, processed.stats.delta
    before = round(float(chosen.get("pad_before", 0.0)) / dt)
    after = round(float(chosen.get("pad_after", 0.0)) / dt)
    start = processed.stats.starttime + before * dt - physical.stats.starttime
    first = max(round(start / physical.stats.delta), 0)
    # The samples between the pads
    count = processed.stats.npts - (before + after)
    physical.data = physical.data[first : first + count]
    physical.stats.starttime += first * physical.stats.delta
    return without_mean(physical, float(chosen.noise))
