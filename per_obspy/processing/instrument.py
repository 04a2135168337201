"""The steps of one instrument in their order: checks, m/s2, noise, baseline, corners, filter, usable periods."""

from collections.abc import Callable, Iterable, Iterator
from functools import partial, reduce

from obspy import Stream, Trace
from obspy.core import AttribDict

from per_obspy.config import Processing
from per_obspy.errors import Rejection
from per_obspy.processing.already_processed import passed_through
from per_obspy.processing.filter.automatic import corners_noted, offset_kept
from per_obspy.processing.filter.butterworth import filtered, padded
from per_obspy.processing.filter.corners import corners_shared
from per_obspy.processing.instrument_response import in_acceleration
from per_obspy.processing.noise.windows import Source, noise_window_noted, trimmed
from per_obspy.processing.notes import is_processed
from per_obspy.processing.quality.final_checks import final_findings
from per_obspy.processing.quality.findings import Finding, judged, surviving
from per_obspy.processing.quality.raw_checks import outlier_findings, raw_findings
from per_obspy.processing.station.components import is_horizontal, paired
from per_obspy.processing.usable_periods import usable_periods_noted

Step = Callable[[Stream], Stream]


def process_instrument(
    instrument: Stream, settings: Processing, source: Source | None
) -> tuple[Stream, tuple[Rejection, ...]]:
    """
    Return the processed components of one instrument, and a row for each that was left out.

    Parameters
    ----------
    instrument : obspy Stream
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
    if instrument and is_processed(instrument[0]):
        # Series of velocity or displacement are no acceleration
        physical, unfit = _in_turn(instrument, (in_acceleration,))
        pair, rejected = paired(physical, settings.overlap)
        return passed_through(pair, settings), (*unfit, *rejected)
    physical, unfit = _in_turn(instrument, _before(settings))
    pair, unpaired = paired(physical, settings.overlap)
    windowed = _windowed(pair, settings, source)
    ready, undecided = _in_turn(windowed, _between(windowed, settings, source))
    horizontals = corners_shared(Stream([trace for trace in ready if is_horizontal(trace)]))
    verticals = Stream([trace for trace in ready if not is_horizontal(trace)])
    done, restless = _in_turn(horizontals + verticals, _after(settings))
    return done, (*unfit, *unpaired, *undecided, *restless)


def _windowed(stream: Stream, settings: Processing, source: Source | None) -> Stream:
    margin, shortest, tolerance = (
        settings.onset_margin,
        settings.shortest_noise,
        settings.pick_tolerance,
    )
    noted_windows = noise_window_noted(
        stream, margin, shortest, tolerance, source, settings.pre_event
    )
    return trimmed(noted_windows, settings.longest_noise, settings.longest_signal)


def _between(stream: Stream, settings: Processing, source: Source | None) -> tuple[Step, ...]:
    outliers = outlier_findings(stream, settings.checks)
    magnitude = source.magnitude if source else _told_magnitude(stream)
    automatic = partial(corners_noted, settings=settings, magnitude=magnitude)
    kept = partial(offset_kept, settings=settings)
    return (
        lambda one: judged(one[0], outliers.get(one[0].id, [])),
        kept if settings.permanent_offset else automatic,
    )


def _told_magnitude(stream: Stream) -> float | None:
    """Return the magnitude that a header tells, if one does."""
    told = (trace.stats.get("event", {}).get("magnitude") for trace in stream)
    return next((float(magnitude) for magnitude in told if magnitude), None)


def _in_turn(stream: Stream, steps: Iterable[Step]) -> tuple[Stream, tuple[Rejection, ...]]:
    return surviving(lambda one: reduce(lambda record, step: step(record), steps, one), stream)


def _before(settings: Processing) -> tuple[Step, ...]:
    return (
        lambda stream: judged(stream[0], raw_findings(stream[0], settings.checks)),
        partial(in_acceleration, gain_tolerance=settings.gain_tolerance),
    )


def _after(settings: Processing) -> tuple[Step, ...]:
    return (
        partial(
            _low_passed if settings.permanent_offset else _padded_and_filtered, order=settings.order
        ),
        partial(usable_periods_noted, usable=settings.usable),
        lambda stream: judged(stream[0], _final_findings(stream[0], settings)),
        _marked,
    )


def _padded_and_filtered(stream: Stream, order: int) -> Stream:
    corners = stream[0].stats.per_obspy
    return filtered(
        padded(stream, corners.highpass, order), corners.highpass, corners.lowpass, order
    )


def _low_passed(stream: Stream, order: int) -> Stream:
    return filtered(stream, 0.0, stream[0].stats.per_obspy.lowpass, order)


def _final_findings(trace: Trace, settings: Processing) -> Iterator[Finding]:
    """Give what does not come to rest; a permanent offset that was asked for may stay."""
    for finding in final_findings(trace, settings.checks):
        if not (settings.permanent_offset and finding.check == "final_displacement"):
            yield finding


def _marked(stream: Stream) -> Stream:
    """Return a copy that says it is processed, with its corners, so that a second pass leaves it alone."""
    out = stream.copy()
    for trace in out:
        corners = trace.stats.per_obspy
        trace.stats.processing_level = "processed"
        trace.stats.corners = AttribDict(highpass=corners.highpass, lowpass=corners.lowpass)
    return out
