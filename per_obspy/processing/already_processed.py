"""Records that others have processed: they pass as they are, with what can be said about their limits."""

from obspy import Stream, Trace

from per_obspy.config import Processing
from per_obspy.processing.filter.butterworth import tapered
from per_obspy.processing.filter.corners import (
    LOWPASS_OF_NYQUIST,
    Corner,
    clean_corner,
    lowest_highpass,
    usable_periods_noted,
)
from per_obspy.processing.notes import noted, remembered
from per_obspy.processing.quality.final_checks import final_findings
from per_obspy.processing.quality.findings import judged
from per_obspy.processing.quality.raw_checks import header_findings


def passed_through(stream: Stream, settings: Processing) -> Stream:
    """
    Return a copy of records that others have processed, with their corners and usable periods.

    Where the header is silent about the high-pass corner, the corner that would clean the
    displacement limits the usable periods (nothing is filtered); about the low-pass, 0.75 of the
    Nyquist frequency. Velocity or displacement that does not come to rest, and a peak that is not
    the header's, are warnings: the samples are not ours to change.

    Parameters
    ----------
    stream : obspy Stream
        Acceleration, m/s2.
    settings : Processing
        Every number of the chain.

    Returns
    -------
    obspy Stream
    """
    out = Stream()
    for trace in stream:
        known = _with_corners(trace, settings)
        found = (*header_findings(trace, settings.checks), *final_findings(trace, settings.checks))
        out += judged(known, [one._replace(level="warn") for one in found])
    return usable_periods_noted(out, settings.usable)


def _with_corners(trace: Trace, settings: Processing) -> Trace:
    out = trace.copy()
    noted(out, "processed already, passed through")
    told = trace.stats.get("corners", {})
    highpass = (
        Corner(told["highpass"], "header")
        if told.get("highpass")
        else _silent_highpass(trace, settings)
    )
    nyquist = trace.stats.sampling_rate / 2
    silent = Corner(LOWPASS_OF_NYQUIST * nyquist, "0.75 Nyquist, the header is silent")
    known = 0 < told.get("lowpass", 0) < nyquist  # 999 Hz and the like stand for none
    lowpass = Corner(told["lowpass"], "header") if known else silent
    remembered(out, highpass=float(highpass.frequency), highpass_source=highpass.reason)
    remembered(out, lowpass=float(lowpass.frequency), lowpass_source=lowpass.reason)
    return out


def _silent_highpass(trace: Trace, settings: Processing) -> Corner:
    """Return the corner below which the displacement is not clean, as a limit, not to be applied."""
    shape = tapered(Stream([trace]), settings.taper)[0]
    highest = settings.highpass_range[1]
    clean = clean_corner(shape, lowest_highpass(trace), highest, settings.drift, settings.order)
    if clean is None:
        return Corner(highest, "displacement drifts at any corner, the header is silent")
    return Corner(clean.frequency, f"{clean.reason}, the header is silent")
