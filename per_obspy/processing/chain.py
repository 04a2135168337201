"""The chain: the steps in their order, station by station, every reason kept."""

import logging
from collections import defaultdict
from collections.abc import Callable
from functools import partial, reduce

from obspy import Stream, Trace

from per_obspy.config import Processing
from per_obspy.errors import RecordRejected, Rejection
from per_obspy.processing.baseline import mean_removed, trend_removed
from per_obspy.processing.filtering import filtered, padded, tapered
from per_obspy.processing.gathering import instruments, is_horizontal, merged, oriented, paired, surviving
from per_obspy.processing.physical import in_acceleration
from per_obspy.processing.provenance import noted, rejection, remembered
from per_obspy.processing.usable import usable_periods_noted

LOWPASS_OF_NYQUIST = 0.75
DEFAULTS = Processing()
log = logging.getLogger(__name__)


def process(stream: Stream, settings: Processing = DEFAULTS) -> Stream:
    """
    Return the records of a stream, ready for spectra.

    Parameters
    ----------
    stream : obspy Stream
        Any number of stations; counts with a response attached, or m/s2 (``stats.units``).
    settings : Processing
        Every number of the chain, with its unit.

    Returns
    -------
    obspy Stream
        Acceleration, m/s2, of one instrument a station: at most two horizontals, with equal times, and a vertical.
        Filtered records keep the zero pads that hold the transients of the filter. ``stats.processing`` lists the
        steps, ``stats.per_obspy`` the numbers chosen: corners, usable periods and so on.

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
        kept, rejected = process_station(station, settings)
        out += kept
        reasons += [f"{row.name}: {reason}" for row in rejected for reason in row.reasons]
    if not out:
        raise RecordRejected(", ".join(map(".".join, stations)) or "empty stream", *(reasons or ["no traces"]))
    for reason in reasons:
        log.warning("left out: %s", reason)
    return out


def process_station(stream: Stream, settings: Processing) -> tuple[Stream, tuple[Rejection, ...]]:
    """
    Return the processed traces of the best instrument of a station, and a row for everything left out.

    Parameters
    ----------
    stream : obspy Stream
        All channels of one station.
    settings : Processing
        Every number of the chain.

    Returns
    -------
    kept : obspy Stream
        Empty if no horizontal survived.
    rejected : tuple of Rejection
        One row a trace; one bad trace never loses the others.
    """
    whole, lost = merged(stream)
    rejected = list(lost)
    candidates = []
    for instrument in instruments(oriented(whole)):
        traces, lost = _process_instrument(instrument, settings)
        candidates.append(traces)
        rejected += lost
    best = max(candidates, key=lambda traces: sum(map(is_horizontal, traces)), default=Stream())
    rejected += [_left_out(trace, best) for traces in candidates if traces is not best for trace in traces]
    if not any(map(is_horizontal, best)):
        rejected += [rejection(trace, "no horizontal of its instrument is usable") for trace in best]
        best = Stream()
    return best, tuple(rejected)


def _left_out(trace: Trace, best: Stream) -> Rejection:
    return rejection(trace, f"the instrument of {best[0].id} at the same station goes first")


def _process_instrument(instrument: Stream, settings: Processing) -> tuple[Stream, tuple[Rejection, ...]]:
    pair, unpaired = paired(instrument, settings.overlap)
    physical, lost = surviving(partial(in_acceleration, gain_tolerance=settings.gain_tolerance), pair)
    processed = Stream([trace for trace in physical if trace.stats.get("processing_level") == "processed"])
    raw = Stream([trace for trace in physical if trace not in processed])
    return _corrected(raw, settings) + _passed_through(processed, settings), (*unpaired, *lost)


def _corrected(stream: Stream, settings: Processing) -> Stream:
    out = Stream()
    for trace in stream:
        out += reduce(lambda record, step: step(record), _steps(trace, settings), Stream([trace]))
    return out


def _steps(trace: Trace, settings: Processing) -> tuple[Callable[[Stream], Stream], ...]:
    lowpass = min(settings.lowpass, LOWPASS_OF_NYQUIST * trace.stats.sampling_rate / 2)
    return (
        partial(mean_removed, pre_event=settings.pre_event),
        trend_removed,
        partial(tapered, fraction=settings.taper),
        partial(padded, highpass=settings.highpass, order=settings.order),
        partial(filtered, highpass=settings.highpass, lowpass=lowpass, order=settings.order),
        partial(usable_periods_noted, usable=settings.usable),
    )


def _passed_through(stream: Stream, settings: Processing) -> Stream:
    """Return a copy of records that others have processed, with the corners that their headers tell."""
    out = stream.copy()
    for trace in out:
        told = trace.stats.get("corners", {})
        guesses = {
            "highpass": (1 / (trace.stats.npts * trace.stats.delta), "1 / duration, the header is silent"),
            "lowpass": (LOWPASS_OF_NYQUIST * trace.stats.sampling_rate / 2, "0.75 Nyquist, the header is silent"),
        }
        noted(trace, "processed already, passed through")
        for name, (guess, reason) in guesses.items():
            source = {f"{name}_source": "header" if name in told else reason}
            remembered(trace, **{name: float(told.get(name, guess))}, **source)
    return usable_periods_noted(out, settings.usable)
