"""Findings of failed checks, each with its figure; no finding stops another check or trace."""

from collections.abc import Callable, Iterable
from typing import NamedTuple

from obspy import Stream, Trace

from per_obspy.config import Check
from per_obspy.errors import RecordRejected, Rejection
from per_obspy.processing.notes import copied_trace, rejection, remembered


class Finding(NamedTuple):
    """
    A failed check.

    Attributes
    ----------
    check : str
        Name of the check in the configuration.
    level : str
        reject, warn or note.
    reason : str
        Contains the figure and the threshold.
    """

    check: str
    level: str
    reason: str


def below(check: str, setting: Check, figure: float, meaning: str) -> list[Finding]:
    """Return a finding if the figure is below the threshold."""
    if figure >= setting.threshold:
        return []
    return [Finding(check, setting.level, f"{meaning} {figure:.4g}, needs {setting.threshold:g}")]


def above(check: str, setting: Check, figure: float, meaning: str) -> list[Finding]:
    """Return a finding if the figure is above the threshold."""
    if figure <= setting.threshold:
        return []
    return [Finding(check, setting.level, f"{meaning} {figure:.4g}, allowed {setting.threshold:g}")]


def judged(trace: Trace, findings: Iterable[Finding]) -> Stream:
    """
    Return a trace with its warnings and notes, a copy if there are any.

    Parameters
    ----------
    trace : obspy Trace
    findings : iterable of Finding

    Returns
    -------
    obspy Stream
        Of one trace, with ``warnings`` and ``notes`` in ``stats.per_obspy``: reasons joined by
        semicolons; ``failed_checks`` has the names of the checks that warn, joined by spaces.

    Raises
    ------
    RecordRejected
        If a finding rejects, with the rejecting reasons first, then the warnings.
    """
    found = list(findings)
    rejecting, warnings = _reasons(found, "reject"), _reasons(found, "warn")
    if rejecting:
        raise RecordRejected(trace.id, *rejecting, *_earlier(trace, "warnings"), *warnings)
    # Texts of earlier checks come first
    notes = _reasons(found, "note")
    out = copied_trace(trace) if warnings or notes else trace
    for name, reasons in (("warnings", warnings), ("notes", notes)):
        if reasons:
            remembered(out, **{name: _joined("; ", trace, name, reasons)})
    # Names of the checks behind the warnings
    if warnings:
        names = [finding.check for finding in found if finding.level == "warn"]
        remembered(out, failed_checks=_joined(" ", trace, "failed_checks", names))
    return Stream([out])


def _joined(separator: str, trace: Trace, name: str, texts: list[str]) -> str:
    """Return earlier and new texts, each once: a file that is read back is checked again."""
    earlier = [part for text in _earlier(trace, name) for part in text.split(separator)]
    return separator.join(dict.fromkeys([*earlier, *texts]))


def _reasons(findings: list[Finding], level: str) -> list[str]:
    """Return the reasons of the findings of one level."""
    return [finding.reason for finding in findings if finding.level == level]


def _earlier(trace: Trace, name: str) -> list[str]:
    """Return the text of earlier checks on a trace, if there is one."""
    text = trace.stats.get("per_obspy", {}).get(name)
    return [text] if text else []


def surviving(
    step: Callable[[Stream], Stream], stream: Iterable[Trace]
) -> tuple[Stream, tuple[Rejection, ...]]:
    """
    Apply a step trace by trace, so that a bad trace is rejected alone.

    Parameters
    ----------
    step : callable
        From Stream to new Stream; raises `RecordRejected`.
    stream : iterable of obspy Trace
        From `taken` where each may leave memory after its step.

    Returns
    -------
    accepted : obspy Stream
        Results of the step.
    rejected : tuple of Rejection
        One row for each other trace.
    """
    accepted, rejected = Stream(), []
    remaining = Stream(list(stream))
    while remaining:
        # The step receives the only reference to the trace
        row = rejection(remaining[0])
        try:
            accepted += step(Stream([remaining.pop(0)]))
        except RecordRejected as fault:
            rejected.append(row._replace(reasons=fault.reasons))
    return accepted, tuple(rejected)
