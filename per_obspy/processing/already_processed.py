"""Records processed by others: their samples pass unchanged, with corners and usable periods."""

from obspy import Stream, Trace

from per_obspy.config import Processing
from per_obspy.processing.filter.butterworth import tapered
from per_obspy.processing.filter.corners import (
    LOWPASS_OF_NYQUIST,
    SILENT_HEADER,
    Corner,
    clean_corner,
    lowest_highpass,
    usable_periods_noted,
)
from per_obspy.processing.notes import copied_trace, noted, remembered
from per_obspy.processing.quality.final_checks import AT_REST, final_findings
from per_obspy.processing.quality.findings import judged
from per_obspy.processing.quality.raw_checks import final_sample_findings
from per_obspy.processing.quality.record_flags import flags_noted


def passed_through(stream: Stream, settings: Processing) -> Stream:
    """
    Return a copy of records processed by others, with their corners and usable periods.

    Without a high-pass corner in the header, the corner that would clean the displacement limits
    the usable periods (no filter is applied); without a low-pass corner, 0.75 of the Nyquist
    frequency. Velocity or displacement that does not come to rest, and a peak that is not the
    header's, are warnings: the samples are final. What no ground motion can be is rejected as in
    raw records.

    Parameters
    ----------
    stream : obspy Stream
        Acceleration, m/s2.
    settings : Processing
        Every number of the chain.

    Returns
    -------
    obspy Stream

    Raises
    ------
    RecordRejected
        If a check of a trace rejects, with every reason.
    """
    out = Stream()
    for trace in stream:
        limited = _with_corners(trace, settings)
        findings = list(final_sample_findings(trace, settings.checks))
        for finding in final_findings(trace, settings.checks):
            # Their corners are no choice of this program
            is_final = finding.check in AT_REST
            findings.append(finding._replace(level="warn") if is_final else finding)
        out += judged(limited, findings)
    return flags_noted(usable_periods_noted(out, settings.usable))


def _with_corners(trace: Trace, settings: Processing) -> Trace:
    """Return a copy with the corners of the header, or else with limits in their place."""
    out = copied_trace(trace)
    noted(out, "processed already, passed through")
    header = trace.stats.get("corners", {})
    if header.get("highpass"):
        highpass = Corner(header["highpass"], "header")
    else:
        highpass = _limiting_highpass(trace, settings)
    # Corners like 999 Hz mean none
    nyquist = trace.stats.sampling_rate / 2
    lowpass = Corner(LOWPASS_OF_NYQUIST * nyquist, f"0.75 Nyquist, {SILENT_HEADER}")
    if 0 < header.get("lowpass", 0) < nyquist:
        lowpass = Corner(header["lowpass"], "header")
    remembered(out, highpass=float(highpass.frequency), highpass_source=highpass.reason)
    remembered(out, lowpass=float(lowpass.frequency), lowpass_source=lowpass.reason)
    return out


def _limiting_highpass(trace: Trace, settings: Processing) -> Corner:
    """Return the corner below which the displacement is not clean, as a limit of usable periods."""
    shape = tapered(Stream([trace]), settings.taper)[0]
    highest = settings.highpass_range[1]
    clean = clean_corner(shape, lowest_highpass(trace), highest, settings.drift, settings.order)
    if clean is None:
        return Corner(highest, f"displacement drifts at any corner, {SILENT_HEADER}")
    return Corner(clean.frequency, f"{clean.reason}, {SILENT_HEADER}")
