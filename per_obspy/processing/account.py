"""
The account of a record: its steps and numbers, failed checks, flags, and the row of a rejection.

``stats.processing`` has one line per step, ``stats.per_obspy`` every number that was chosen for the
record, the reasons of its warnings, and its flags. A check compares a figure with the limit of the
configuration; a failed one is a `Finding`, and none stops another check or trace.
"""

from collections.abc import Callable, Iterable, Iterator
from copy import copy
from typing import NamedTuple

from obspy import Stream, Trace
from obspy.core import AttribDict

from per_obspy.checks import FloatArray
from per_obspy.config import Checks
from per_obspy.constants import UNSET_DAYS
from per_obspy.errors import RecordRejected, Rejection

Value = str | float | int

#: Level of a check that would reject a record, if its station were not trusted, and the words that
#: its reason gets.
TRUSTED, USED_ANYWAY = "trusted", " (used: records.trust)"

#: Reasons of recorders that reached a limit begin with this word: see :mod:`.chain`.
CLIPPED = "clipped"

#: Check -> what its figure is, where that must be no less than the limit.
LEAST = {
    "sampling_rate": "sampling rate, Hz:",
    "duration": "duration, s:",
    "levels": "different values (dead channel):",
    "zero_crossings": "zero crossings a second:",
    "weak_motion": "peak acceleration, m/s2 (wrong unit?):",
    "signal_to_noise": "signal-to-noise ratio of the best octave",
    "clear_band": "signal-to-noise ratio in {:g}-{:g} Hz",
    "bandwidth": "low-pass over high-pass corner:",
}

#: Check -> what its figure is, where that must be no more than the limit.
MOST = {
    "sampling_interval": "sampling interval, s (are its times in milliseconds?):",
    "channel_rate": "sampling rate off the {:g} Hz of StationXML by a share of",
    **dict.fromkeys(
        ("saturation", "possible_saturation"),
        f"{CLIPPED}: samples within 5 % of an extreme over those 5 to 15 % below it:",
    ),
    "counter_use": "peak over the full scale of a 24-bit counter:",
    "dropout": "dropout, s without change:",
    "filled": "filled: {} samples on a straight line during the shaking, s:",
    "spike": "spike or step, over its vicinity:",
    **dict.fromkeys(
        ("header_peak", "header_rounding"), "largest sample off the header's {:g} by a share of"
    ),
    "outlier": "peak over that of {}:",
    "weak_component": "peak of {} over {}:",
    "copied_component": "its samples are those of {}: correlation",
    "late_component": "shifted in time against {}, s:",
    "exchanged_component": (
        "exchanged with the vertical? ln share of early motion over that of the others:"
    ),
    **dict.fromkeys(
        ("unusual_acceleration", "impossible_acceleration"),
        "peak acceleration, m/s2 (wrong unit?):",
    ),
    **dict.fromkeys(
        ("unusual_velocity", "impossible_velocity"),
        "peak velocity, m/s (wrong unit or sampling interval?):",
    ),
    "velocity_time": "peak velocity over peak acceleration, s (wrong sampling interval?):",
    "late_trigger": "late trigger: first second over the peak:",
    "cut_off": "ends while shaking: last second over the peak:",
    "second_event": "another event, over the peak:",
    "final_velocity": "final velocity over its peak:",
    "final_displacement": "final displacement over its peak:",
    "baseline_shift": (
        "the baseline shifted during the shaking: velocity that stayed, over the peak velocity"
    ),
}

#: Check -> the milder one of the same figure, which counts where the first does not fail.
MILDER = {
    "saturation": "possible_saturation",
    "impossible_acceleration": "unusual_acceleration",
    "impossible_velocity": "unusual_velocity",
    "header_peak": "header_rounding",
}

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

#: Flags of what the record is, whatever its checks say, with the texts of their warnings.
KINDS = {
    "contradicting_coordinates": (
        "two sources place the station more than 1 km apart: see coordinates_conflict"
    ),
    "digitised": "digitised from film: short and long periods are less certain",
    "nominal_sensitivity": (
        "converted by an overall sensitivity alone, which may be that of the model: the metadata "
        "have no stages of the response"
    ),
    "undated": "the start time is unknown: it is not known of which earthquake the record is",
}

#: Parts of the reasons of corners that neither the noise of the record nor its header gives.
SILENT_HEADER, FROM_TABLE, FROM_CONSTANT = "the header is silent", "table: no noise", "constant: "

#: Part of the reason of a corner that was raised as far as allowed.
SHIFTED_BASELINE = "the baseline shifts during the shaking"


# Steps and numbers


def with_note(
    trace: Trace, step: str, data: FloatArray | None = None, /, **numbers: Value
) -> Trace:
    """
    Return the trace after a step: a copy with a line in ``stats.processing``.

    It has new samples, if the step gives some, and the numbers that the step chose for this record
    in ``stats.per_obspy``.
    """
    out = with_numbers(trace, **numbers)
    out.stats.setdefault("processing", []).append(f"per_obspy: {step}")
    if data is not None:
        out.data = data
    return out


def with_numbers(trace: Trace, **numbers: Value) -> Trace:
    """Return a copy with numbers of the record in ``stats.per_obspy``."""
    out = copy_header(trace)
    out.stats.setdefault("per_obspy", AttribDict()).update(numbers)
    return out


def copy_header(trace: Trace) -> Trace:
    """
    Return a trace with a header of its own that shares the samples.

    They are never changed in place: a step that changes samples assigns new ones. Nor is anything
    below the lists and dictionaries of the header, such as ``stats.response``. Copies of a day of
    three components took gigabytes, those of the response a quarter of the whole chain.
    """
    out = copy(trace)
    out.stats = _copy_level(trace.stats)
    values = vars(out.stats)
    for name, value in values.items():
        if type(value) is list:
            values[name] = value.copy()
        elif type(value) is AttribDict:
            values[name] = _copy_level(value)
    return out


def _copy_level(header: AttribDict) -> AttribDict:
    """Return a dictionary of its own with the same values; ObsPy checks each and derives others."""
    out: AttribDict = object.__new__(type(header))
    vars(out).update(vars(header))
    return out


def taken(stream: Stream) -> Iterator[Trace]:
    """
    Yield the traces of a stream while taking them out of it.

    The caller that receives them is their only owner, so that a record of a day leaves memory as
    soon as its next form is there.
    """
    while stream:
        yield stream.pop(0)


def is_processed(trace: Trace) -> bool:
    """Return whether a trace is marked as processed, by others or by an earlier run."""
    return bool(trace.stats.get("processing_level") == "processed")


# Rejections


def rejection(trace: Trace, *reasons: str) -> Rejection:
    """Return the row of ``rejected.csv`` for a trace."""
    return Rejection("record", trace.id, str(trace.stats.get("source", "")), None, reasons)


def survivors(
    step: Callable[[Trace], Trace], traces: Iterable[Trace]
) -> tuple[Stream, tuple[Rejection, ...]]:
    """
    Apply a step to each trace by itself, so that a bad trace is rejected alone.

    The step raises `RecordRejected`. The traces are from `taken` where each may leave memory after
    its step.
    """
    accepted, rejected, remaining = Stream(), list[Rejection](), list(traces)
    while remaining:
        # The step receives the only reference to the trace
        row = rejection(remaining[0])
        try:
            accepted += step(remaining.pop(0))
        except RecordRejected as fault:
            rejected.append(row._replace(reasons=fault.reasons))
    return accepted, tuple(rejected)


# Checks


class Finding(NamedTuple):
    """A failed check."""

    #: name of the check in the configuration
    check: str
    #: reject, warn or note
    level: str
    #: with the figure and the threshold
    reason: str


class Findings(list[Finding]):
    """Failed checks of a record, by the limits and levels of the configuration."""

    def __init__(self, checks: Checks) -> None:
        super().__init__()
        self.checks = checks

    def compare(self, check: str, figure: float, *words: object) -> bool:
        """
        Compare a figure with the limit of its check, and with that of a milder one.

        The words are what the text of the check names. Return whether a check failed.
        """
        limit, is_least = getattr(self.checks, check).threshold, check in LEAST
        if figure >= limit if is_least else figure <= limit:
            return check in MILDER and self.compare(MILDER[check], figure, *words)
        # In the words of the check
        meaning = (LEAST[check] if is_least else MOST[check]).format(*words)
        bound = f", needs {limit:g}" if is_least else f", allowed {limit:g}"
        self.add(check, f"{meaning} {figure:.4g}{bound}")
        return True

    def add(self, check: str, reason: str) -> None:
        """Add a failed check with a reason of its own."""
        level = getattr(self.checks, check).level
        if level == TRUSTED:
            level, reason = "warn", f"{reason}{USED_ANYWAY}"
        self.append(Finding(check, level, reason))


def lenient(checks: Checks, names: Iterable[str]) -> Checks:
    """Return checks of which some only warn."""
    warnings = {name: getattr(checks, name).model_copy(update={"level": "warn"}) for name in names}
    return checks.model_copy(update=warnings)


def trusting(checks: Checks) -> Checks:
    """Return checks of which those of plausibility warn, and say that the record is trusted."""
    trusted = {
        name: getattr(checks, name).model_copy(update={"level": TRUSTED})
        for name in FLAGGED_CHECKS["implausible_record"]
        if getattr(checks, name).level == "reject"
    }
    return checks.model_copy(update=trusted)


def judge(trace: Trace, findings: Iterable[Finding]) -> Trace:
    """
    Return a trace with its warnings and notes, a copy if there are any.

    ``warnings`` and ``notes`` in ``stats.per_obspy`` have the reasons, joined by semicolons, and
    ``failed_checks`` the names of the checks that warn, joined by spaces. A finding that rejects
    raises `RecordRejected` with the rejecting reasons first, then the warnings.
    """
    reasons: dict[str, list[str]] = {"reject": [], "warn": [], "note": [], "failed": []}
    for check, level, reason in findings:
        reasons[level].append(reason)
        reasons["failed"] += [check] if level == "warn" else []
    # A trace that is left out takes its earlier warnings along
    account = trace.stats.get("per_obspy", {})
    if reasons["reject"]:
        earlier = filter(None, [account.get("warnings")])
        raise RecordRejected(trace.id, *reasons["reject"], *earlier, *reasons["warn"])
    # After the texts of earlier checks, each once: a file that is read back is checked again
    texts = {}
    places = (("warnings", "warn", "; "), ("notes", "note", "; "), ("failed_checks", "failed", " "))
    for name, level, separator in places:
        if reasons[level]:
            earlier = filter(None, account.get(name, "").split(separator))
            texts[name] = separator.join(dict.fromkeys([*earlier, *reasons[level]]))
    return with_numbers(trace, **texts) if texts else trace


# Flags


def with_flags(trace: Trace) -> Trace:
    """
    Return a processed record with its flags, names separated by spaces; a copy if there are any.

    ``stats.per_obspy.record_flags`` may hold ``baseline_shift``, ``second_event``, ``clipped``,
    ``wrapped``, ``filled``, ``implausible_record``, ``assumed_corners``, ``record_warning``
    (another check that warns), ``digitised``, ``nominal_sensitivity``, ``undated`` and
    ``contradicting_coordinates``; it is missing where there is none. The last four are in
    ``warnings`` too. Flags of an earlier processing stay.
    """
    flags = record_flags(trace)
    if not flags:
        return trace
    out = with_numbers(trace, record_flags=" ".join(flags))
    # The kind of a record is a warning too, once
    warnings = str(out.stats.per_obspy.get("warnings") or "")
    texts = [text for flag, text in KINDS.items() if flag in flags and text not in warnings]
    if texts:
        out.stats.per_obspy.warnings = "; ".join([warnings, *texts] if warnings else texts)
    return out


def record_flags(trace: Trace) -> list[str]:
    """Return the names of the flags of one processed record, sorted."""
    stats, account = trace.stats, trace.stats.get("per_obspy", {})
    # Flags of an earlier processing, and the checks that warn
    flags = set(account.get("record_flags", "").split())
    failed = account.get("failed_checks", "").split()
    flags |= {FLAG_OF_CHECK.get(check, "record_warning") for check in failed}
    # Corners that neither the noise nor a header gives, or that a shifted baseline asks for
    reasons = f"{account.get('highpass_source', '')}, {account.get('lowpass_source', '')}"
    if any(assumed in reasons for assumed in (SILENT_HEADER, FROM_TABLE, FROM_CONSTANT)):
        flags.add("assumed_corners")
    if SHIFTED_BASELINE in reasons:
        flags.add("baseline_shift")
    # Zeros that the filter put before the record are no part of it
    start = stats.starttime + (account.get("pad_before") or 0.0)
    kinds = {
        "contradicting_coordinates": stats.get("coordinates_conflict"),
        "digitised": stats.get("digitised"),
        "nominal_sensitivity": account.get("conversion") == "sensitivity",
        "undated": (start.year, start.month, start.day) in UNSET_DAYS,
    }
    return sorted(flags | {name for name, is_so in kinds.items() if is_so})
