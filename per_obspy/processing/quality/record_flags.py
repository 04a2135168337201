"""Flags of a record: short names of warnings and assumptions, for tables and the console."""

from obspy import Stream, Trace

from per_obspy.constants import UNSET_DAYS
from per_obspy.processing.filter.corners import ASSUMED_REASONS, SHIFTED_BASELINE
from per_obspy.processing.notes import copied_trace, remembered

#: Flag -> the checks that raise it where they warn; others raise ``record_warning``.
FLAGGED_CHECKS = {
    "baseline_shift": ("baseline_shift",),
    "second_event": ("second_event",),
    "clipped": ("clipped_run", "pinned", "saturation", "possible_saturation"),
    "wrapped": ("wrapped",),
    "filled": ("filled", "dropout"),
    "implausible_record": (
        "sampling_interval", "channel_rate", "outlier", "weak_component", "copied_component",
        "late_component", "exchanged_component", "unusual_acceleration", "impossible_acceleration",
        "unusual_velocity", "impossible_velocity", "weak_motion", "velocity_time",
    ),
}  # fmt: skip
FLAG_OF_CHECK = {check: flag for flag, checks in FLAGGED_CHECKS.items() for check in checks}

#: Flags of what the record is, whatever its checks found, with the texts of their warnings.
KINDS = {
    "digitised": "digitised from film: short and long periods are less certain",
    "undated": "the start time is unknown: it is not known of which earthquake the record is",
    "contradicting_coordinates": (
        "two sources place the station more than 1 km apart: see coordinates_conflict"
    ),
}


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
        ``second_event``, ``clipped``, ``wrapped``, ``filled``, ``implausible_record``,
        ``assumed_corners``, ``record_warning`` (another check that warns), ``digitised``,
        ``undated`` and ``contradicting_coordinates``; it is missing where there is none. The last
        three are in ``warnings`` too. Flags of an earlier processing stay.
    """
    out = Stream()
    for trace in stream:
        flags = record_flags(trace)
        flagged = copied_trace(trace) if flags else trace
        if flags:
            remembered(flagged, record_flags=" ".join(flags))
            _warn_of_kind(flagged, flags)
        out += flagged
    return out


def record_flags(trace: Trace) -> list[str]:
    """Return the names of the flags of one processed record, sorted."""
    known = trace.stats.get("per_obspy", {})
    # Flags of an earlier processing, and the checks that warn
    flags = set(known.get("record_flags", "").split())
    for check in known.get("failed_checks", "").split():
        flags.add(FLAG_OF_CHECK.get(check, "record_warning"))
    # Corners that neither the noise nor a header gives, or that a shifted baseline asks for
    reasons = [str(known.get(name, "")) for name in ("highpass_source", "lowpass_source")]
    for reason in reasons:
        if any(assumed in reason for assumed in ASSUMED_REASONS):
            flags.add("assumed_corners")
        if SHIFTED_BASELINE in reason:
            flags.add("baseline_shift")
    return sorted(flags | _kinds(trace))


def _kinds(trace: Trace) -> set[str]:
    """Return the flags of film, of a clock that was never set, and of contradicting places."""
    # Zeros that the filter put before the record are no part of it
    pads = trace.stats.get("per_obspy", {})
    start = trace.stats.starttime + (pads.get("pad_before") or 0.0)
    is_undated = (start.year, start.month, start.day) in UNSET_DAYS
    kinds = {
        "digitised": bool(trace.stats.get("digitised")),
        "undated": is_undated,
        "contradicting_coordinates": bool(trace.stats.get("coordinates_conflict")),
    }
    return {name for name, is_so in kinds.items() if is_so}


def _warn_of_kind(trace: Trace, flags: list[str]) -> None:
    """Append the warnings of film, unset clocks and places to those of a trace, each once."""
    earlier = str(trace.stats.per_obspy.get("warnings") or "")
    texts = [KINDS[flag] for flag in flags if flag in KINDS and KINDS[flag] not in earlier]
    if texts:
        remembered(trace, warnings="; ".join([earlier, *texts] if earlier else texts))
