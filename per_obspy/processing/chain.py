"""
The processing chain: stations, their instruments, the steps of an instrument in their order.

Checks, m/s2, noise, baseline, corners, filter, usable periods; a reason for every rejected trace.
Records processed by others pass with the corners of their header.
"""

import logging
from collections import defaultdict
from collections.abc import Callable, Iterable

from obspy import Stream, Trace
from obspy.core import AttribDict
from obspy.core.event import Event

from per_obspy.config import Processing
from per_obspy.errors import RecordRejected, Rejection
from per_obspy.processing.account import (
    CLIPPED,
    SILENT_HEADER,
    copy_header,
    is_processed,
    judge,
    lenient,
    rejection,
    survivors,
    taken,
    with_flags,
    with_note,
)
from per_obspy.processing.components import (
    instruments,
    is_horizontal,
    orient,
    paired,
    split_structures,
    tell_apart,
)
from per_obspy.processing.earthquake import Corner, Source, fallback_highpass, source_of
from per_obspy.processing.filter.baseline import without_mean
from per_obspy.processing.filter.butterworth import bandpass, pad, taper
from per_obspy.processing.filter.corners import (
    LOWPASS_OF_NYQUIST,
    choose_corners,
    clean_corner,
    lowest_highpass,
    share_corners,
    with_usable_periods,
)
from per_obspy.processing.instrument_response import in_acceleration
from per_obspy.processing.merging import merged
from per_obspy.processing.motion_checks import (
    AT_REST,
    acceleration_findings,
    component_findings,
    final_findings,
)
from per_obspy.processing.noise_window import noise_windows
from per_obspy.processing.raw_checks import raw_findings

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

    The channels are unchanged by it; from :func:`.account.taken`, so that no other code holds them,
    raw records leave memory on the way. The event's origin helps to find the first wave, its
    magnitude gives a corner without noise. The best instrument is empty if no horizontal is usable.
    A bad trace is rejected alone. Sensors in structures are among the rejected: they recorded the
    structure, not the ground; `process_instruments` processes them.
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
    motion. Arguments are those of `process_station`; instruments without a usable trace are left
    out.
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


def process_instrument(
    instrument: Iterable[Trace], settings: Processing, source: Source | None
) -> tuple[Stream, tuple[Rejection, ...]]:
    """
    Process the components of one instrument and return a row for each that is left out.

    The traces are whole and oriented, all raw or all processed by others. Every step is done for
    one component at a time, and each leaves memory when its next form is there, if no other code
    holds it.
    """
    components = Stream(list(instrument))
    is_final = bool(components) and is_processed(components[0])
    pair, unusable = _physical_pair(components, settings, is_final)
    # Each component is judged by the others first
    if is_final:
        findings = component_findings(pair, settings.checks)
        ready, undecided = survivors(
            lambda trace: pass_through(judge(trace, findings.get(trace.id, ())), settings),
            taken(pair),
        )
        return ready, (*unusable, *undecided)
    done, rejected = _filtered_pair(pair, settings, source)
    return done, (*unusable, *rejected)


def _filtered_pair(
    pair: Stream, settings: Processing, source: Source | None
) -> tuple[Stream, tuple[Rejection, ...]]:
    """Return the components, m/s2, without baseline and filtered; empty the input."""
    # All components around the shaking, then baseline and corners of each
    pair = noise_windows(taken(pair), settings, source)
    fallback = _fallback(pair, settings, source)
    findings = component_findings(pair, settings.checks)

    # A `partial` or the variable of a step would keep the record that the next function gives up
    def with_corners_chosen(trace: Trace) -> Trace:
        judged = [judge(trace, findings.get(trace.id, ()))]
        del trace
        return choose_corners(judged.pop(), settings, fallback)

    def filtered(trace: Trace) -> Trace:
        given = [trace]
        del trace
        return _filter(given.pop(), settings)

    ready, undecided = survivors(with_corners_chosen, taken(pair))
    ready = share_corners(taken(ready))
    done, restless = survivors(filtered, taken(ready))
    return done, (*undecided, *restless)


def _physical_pair(
    components: Stream, settings: Processing, is_final: bool
) -> tuple[Stream, tuple[Rejection, ...]]:
    """Return the components in m/s2, the horizontals over their common time; empty the input."""

    def convert(trace: Trace) -> Trace:
        if not is_final:
            trace = judge(trace, raw_findings(trace, settings.checks))
        # Series of velocity or displacement are no acceleration
        trace = in_acceleration(trace, settings.gain_tolerance)
        return judge(trace, acceleration_findings(trace, settings.checks))

    physical, unfit = survivors(convert, taken(components))
    # Sensor and recorder are one: what one component lost at their limit, others lost as well
    clipped = [
        row.name for row in unfit if any(reason.startswith(CLIPPED) for reason in row.reasons)
    ]
    if clipped:
        reason = f"{CLIPPED}: {', '.join(clipped)} of the same instrument"
        return Stream(), (*unfit, *(rejection(trace, reason) for trace in physical))
    pair, unpaired = paired(taken(physical), settings.overlap)
    return pair, (*unfit, *unpaired)


def _fallback(pair: Stream, settings: Processing, source: Source | None) -> Callable[[], Corner]:
    """Return the function that gives the high-pass corner of a record without noise."""
    # The first magnitude in the headers, where there is no event
    magnitudes = [trace.stats.get("event", {}).get("magnitude") for trace in pair]
    in_header = next((float(magnitude) for magnitude in magnitudes if magnitude), None)
    magnitude = source.magnitude if source else in_header

    def fallback() -> Corner:
        corner = fallback_highpass(magnitude, settings.fallback_highpass, settings.unknown_highpass)
        if source is not None:
            source.note(highpass=list(corner))
        return corner

    return fallback


def _filter(trace: Trace, settings: Processing) -> Trace:
    """Return the filtered record with usable periods and flags, marked as processed."""
    chosen, order = trace.stats.per_obspy, settings.order
    corners = AttribDict(highpass=chosen.highpass, lowpass=chosen.lowpass)
    # A permanent offset takes no high-pass, and its displacement stays
    if settings.permanent_offset:
        trace = bandpass(trace, 0.0, corners.lowpass, order)
    else:
        padded = [pad(trace, corners.highpass, order)]
        del trace
        trace = bandpass(padded.pop(), corners.highpass, corners.lowpass, order)
    trace = with_usable_periods(trace, settings.usable)
    findings = final_findings(trace, settings.checks)
    if settings.permanent_offset:
        findings[:] = [one for one in findings if one.check != "final_displacement"]
    # A second pass keeps a processed record with its corners
    trace = copy_header(judge(trace, findings))
    trace.stats.processing_level, trace.stats.corners = "processed", corners
    return with_flags(trace)


def pass_through(trace: Trace, settings: Processing) -> Trace:
    """
    Return a copy of a record processed by others, m/s2, with its corners and usable periods.

    Without a high-pass corner in the header, the corner that would clean the displacement limits
    the usable periods (no filter is applied); without a low-pass corner, 0.75 of the Nyquist
    frequency. Velocity or displacement that does not come to rest, and a peak that is not the
    header's, are warnings: the samples are final. What no ground motion can be is rejected as in
    raw records.
    """
    header, nyquist = trace.stats.get("corners", {}), trace.stats.sampling_rate / 2
    highpass = Corner(header.get("highpass"), "header")
    if not highpass.frequency:
        highpass = _limiting_highpass(trace, settings)
    # Corners like 999 Hz mean none
    lowpass = Corner(LOWPASS_OF_NYQUIST * nyquist, f"0.75 Nyquist, {SILENT_HEADER}")
    if 0 < header.get("lowpass", 0) < nyquist:
        lowpass = Corner(header["lowpass"], "header")
    out = with_note(
        trace,
        "processed already, passed through",
        highpass=float(highpass.frequency),
        highpass_source=highpass.reason,
        lowpass=float(lowpass.frequency),
        lowpass_source=lowpass.reason,
    )
    # Their corners are no choice of this program
    findings = raw_findings(trace, settings.checks, is_final=True)
    findings += final_findings(trace, lenient(settings.checks, AT_REST))
    return with_flags(with_usable_periods(judge(out, findings), settings.usable))


def _limiting_highpass(trace: Trace, settings: Processing) -> Corner:
    """Return the corner below which the displacement is not clean, as a limit of usable periods."""
    highest = settings.highpass_range[1]
    clean = clean_corner(taper(trace, settings.taper), lowest_highpass(trace), highest, settings)
    clean = clean or Corner(highest, "displacement drifts at any corner")
    return Corner(clean.frequency, f"{clean.reason}, {SILENT_HEADER}")


def before_processing(stream: Stream, processed: Trace, settings: Processing) -> Trace | None:
    """
    Return the raw record of a processed trace in m/s2 over the processed time.

    The stream is that of the station as read, the settings are those of its processing. Only the
    mean of the noise is removed. None if the record came processed by others.
    """
    whole, _ = merged(
        trace for trace in stream if trace.id == processed.id and not is_processed(trace)
    )
    if not whole:
        return None
    physical = in_acceleration(whole[0], settings.gain_tolerance)
    # Start of the processed record without its pads, s and samples after that of the raw one
    chosen, dt = processed.stats.per_obspy, processed.stats.delta
    before, after = (
        round(float(chosen.get(f"pad_{side}", 0.0)) / dt) for side in ("before", "after")
    )
    start = processed.stats.starttime + before * dt - physical.stats.starttime
    first = max(round(start / physical.stats.delta), 0)
    # The samples between the pads
    count = processed.stats.npts - (before + after)
    physical.data = physical.data[first : first + count]
    physical.stats.starttime += first * physical.stats.delta
    return without_mean(physical, float(chosen.noise))
