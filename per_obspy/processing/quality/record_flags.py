"""Flags of a record: short names of what its reader must know, for tables and the console."""

from obspy import Stream, Trace

from per_obspy.processing.filter.corners import ASSUMED_REASONS, SHIFTED_BASELINE
from per_obspy.processing.notes import remembered

#: Checks that have a flag of their own.
NAMED_CHECKS = ("baseline_shift", "second_event")


def flags_noted(stream: Stream) -> Stream:
    """
    Return a copy with the flags of every record, names separated by spaces.

    Parameters
    ----------
    stream : obspy Stream
        Processed records with ``failed_checks`` and the reasons of their corners in
        ``stats.per_obspy``.

    Returns
    -------
    obspy Stream
        ``stats.per_obspy.record_flags`` of a record may hold ``baseline_shift``,
        ``second_event``, ``assumed_corners`` and ``record_warning`` (another check that warns); it
        is missing where there is none. Flags of an earlier processing stay.
    """
    out = Stream()
    for trace in stream:
        flags = record_flags(trace)
        flagged = trace.copy() if flags else trace
        if flags:
            remembered(flagged, record_flags=" ".join(flags))
        out += flagged
    return out


def record_flags(trace: Trace) -> list[str]:
    """Return the names of the flags of one processed record, sorted."""
    known = trace.stats.get("per_obspy", {})
    # Flags of an earlier processing, and the checks that warn
    flags = set(known.get("record_flags", "").split())
    for check in known.get("failed_checks", "").split():
        flags.add(check if check in NAMED_CHECKS else "record_warning")
    # Corners that neither the noise nor a header gives, or that a shifted baseline asks for
    reasons = [str(known.get(name, "")) for name in ("highpass_source", "lowpass_source")]
    for reason in reasons:
        if any(assumed in reason for assumed in ASSUMED_REASONS):
            flags.add("assumed_corners")
        if SHIFTED_BASELINE in reason:
            flags.add("baseline_shift")
    return sorted(flags)
