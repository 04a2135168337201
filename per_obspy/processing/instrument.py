"""
Steps of one instrument in their order.

Checks, m/s2, noise, baseline, corners, filter, usable periods.
"""

from collections.abc import Callable, Iterable, Iterator
from functools import partial

from obspy import Stream, Trace
from obspy.core import AttribDict

from per_obspy.config import Processing
from per_obspy.errors import Rejection
from per_obspy.processing.already_processed import passed_through
from per_obspy.processing.filter.baseline_and_corners import corners_noted, offset_kept
from per_obspy.processing.filter.butterworth import filtered, padded
from per_obspy.processing.filter.corners import (
    Corner,
    corners_shared,
    fallback_highpass,
    usable_periods_noted,
)
from per_obspy.processing.instrument_response import in_acceleration
from per_obspy.processing.noise.windows import Source, noise_window_noted, trimmed
from per_obspy.processing.notes import copied, is_processed, rejection, taken
from per_obspy.processing.quality.final_checks import final_findings
from per_obspy.processing.quality.findings import Finding, judged, surviving
from per_obspy.processing.quality.physical_limits import acceleration_findings, component_findings
from per_obspy.processing.quality.raw_checks import CLIPPED, raw_findings
from per_obspy.processing.quality.record_flags import flags_noted
from per_obspy.processing.station.components import is_horizontal, paired

#: A step takes a Stream and returns a new one.
Step = Callable[[Stream], Stream]


def process_instrument(
    instrument: Iterable[Trace], settings: Processing, source: Source | None
) -> tuple[Stream, tuple[Rejection, ...]]:
    """
    Process the components of one instrument and return a row for each that is left out.

    Every step is done for one component at a time, and each leaves memory when its next form is
    there, if no other code holds it.

    Parameters
    ----------
    instrument : iterable of obspy Trace
        Whole, oriented traces, all raw or all processed by others.
    settings : Processing
        Every number of the chain.
    source : Source or None
        The event, if known.

    Returns
    -------
    processed : obspy Stream
    rejected : tuple of Rejection
    """
    components = Stream(list(instrument))
    if components and is_processed(components[0]):
        # Series of velocity or displacement are no acceleration
        pair, rejected = _physical_pair(components, settings, _conversion_steps(settings)[1:])
        compared = _compared(pair, settings)
        passed, unfit = _in_turn(
            taken(pair), (compared, partial(passed_through, settings=settings))
        )
        return passed, (*rejected, *unfit)
    # Each component in m/s2, then all of them around the shaking
    windowed, unusable = _windowed(components, settings, source)
    # Baseline and corners of each component; the horizontals share the narrower band
    steps = _baseline_steps(windowed, settings, source)
    ready, undecided = _in_turn(taken(windowed), steps)
    banded = _horizontals_banded(taken(ready))
    done, restless = _in_turn(taken(banded), _filter_steps(settings))
    return flags_noted(done), (*unusable, *undecided, *restless)


def _in_turn(
    stream: Iterable[Trace], steps: Iterable[Step]
) -> tuple[Stream, tuple[Rejection, ...]]:
    """Apply steps in turn to each trace by itself."""

    def apply(single: Stream) -> Stream:
        for step in steps:
            single = step(single)
        return single

    return surviving(apply, stream)


def _physical_pair(
    components: Stream, settings: Processing, steps: Iterable[Step]
) -> tuple[Stream, tuple[Rejection, ...]]:
    """Return the components in m/s2, the horizontals over their common time; empty the input."""
    physical, unfit = _in_turn(taken(components), steps)
    # Sensor and recorder are one: what one component lost at their limit, others lost as well
    clipped = [
        row.name for row in unfit if any(reason.startswith(CLIPPED) for reason in row.reasons)
    ]
    if clipped:
        reason = f"{CLIPPED}: {', '.join(clipped)} of the same instrument"
        return Stream(), (*unfit, *(rejection(trace, reason) for trace in physical))
    pair, unpaired = paired(physical, settings.overlap)
    return pair, (*unfit, *unpaired)


def _compared(stream: Stream, settings: Processing) -> Step:
    """Return the step that judges each component of a stream by the others."""
    findings = component_findings(stream, settings.checks)
    return lambda single: judged(single[0], findings.get(single[0].id, []))


def _horizontals_banded(stream: Iterable[Trace]) -> Stream:
    """Return the components, horizontals first and with the narrower of their bands."""
    horizontals, verticals = Stream(), Stream()
    for trace in stream:
        group = horizontals if is_horizontal(trace) else verticals
        group.append(trace)
    return corners_shared(horizontals) + verticals


def _conversion_steps(settings: Processing) -> tuple[Step, ...]:
    """Return the checks of raw samples, the conversion to m/s2, and the limits of its peak."""
    return (
        lambda stream: judged(stream[0], raw_findings(stream[0], settings.checks)),
        partial(in_acceleration, gain_tolerance=settings.gain_tolerance),
        lambda stream: judged(stream[0], acceleration_findings(stream[0], settings.checks)),
    )


def _windowed(
    components: Stream, settings: Processing, source: Source | None
) -> tuple[Stream, tuple[Rejection, ...]]:
    """Return physical components with noise windows, around the shaking; empty the input."""
    pair, rejected = _physical_pair(components, settings, _conversion_steps(settings))
    noted_windows = noise_window_noted(
        pair,
        settings.onset_margin,
        settings.shortest_noise,
        settings.pick_tolerance,
        source,
        settings.pre_event,
    )
    return trimmed(noted_windows, settings.longest_noise, settings.longest_signal), rejected


def _baseline_steps(
    stream: Stream, settings: Processing, source: Source | None
) -> tuple[Step, ...]:
    """Return the comparison of the components, and the choice of baseline and corners."""
    magnitude = source.magnitude if source else _header_magnitude(stream)

    def fallback() -> Corner:
        corner = fallback_highpass(magnitude, settings.fallback_highpass, settings.unknown_highpass)
        if source is not None:
            source.note(highpass=list(corner))
        return corner

    # The permanent offset is kept on request only
    if settings.permanent_offset:
        chosen: Step = partial(offset_kept, settings=settings)
    else:
        chosen = partial(corners_noted, settings=settings, fallback=fallback)
    return _compared(stream, settings), chosen


def _header_magnitude(stream: Stream) -> float | None:
    """Return the first magnitude in the headers, if there is one."""
    magnitudes = (trace.stats.get("event", {}).get("magnitude") for trace in stream)
    return next((float(magnitude) for magnitude in magnitudes if magnitude), None)


def _filter_steps(settings: Processing) -> tuple[Step, ...]:
    """Return the filter, the usable periods, the last checks and the mark of a processed trace."""
    return (
        partial(
            _low_passed if settings.permanent_offset else _padded_and_filtered, order=settings.order
        ),
        partial(usable_periods_noted, usable=settings.usable),
        lambda stream: judged(stream[0], _final_findings(stream[0], settings)),
        _marked,
    )


def _padded_and_filtered(stream: Stream, order: int) -> Stream:
    """Return the padded and filtered record, by the corners of its component."""
    highpass, lowpass = stream[0].stats.per_obspy.highpass, stream[0].stats.per_obspy.lowpass
    return filtered(padded(stream, highpass, order), highpass, lowpass, order)


def _low_passed(stream: Stream, order: int) -> Stream:
    """Return the record low-passed at the corner of its component."""
    return filtered(stream, 0.0, stream[0].stats.per_obspy.lowpass, order)


def _final_findings(trace: Trace, settings: Processing) -> Iterator[Finding]:
    """Yield the findings of motion that does not come to rest, but for a permanent offset."""
    for finding in final_findings(trace, settings.checks):
        if not (settings.permanent_offset and finding.check == "final_displacement"):
            yield finding


def _marked(stream: Stream) -> Stream:
    """Return a copy marked as processed, with its corners, so that a second pass keeps it."""
    out = copied(stream)
    for trace in out:
        corners = trace.stats.per_obspy
        trace.stats.processing_level = "processed"
        trace.stats.corners = AttribDict(highpass=corners.highpass, lowpass=corners.lowpass)
    return out
