"""What checks find: every failed check adds a reason with its figure; none stops another, or another trace."""

from collections.abc import Callable, Iterable
from typing import NamedTuple

from obspy import Stream, Trace

from per_obspy.config import Check
from per_obspy.errors import RecordRejected, Rejection
from per_obspy.processing.notes import rejection, remembered


class Finding(NamedTuple):
    """
    A failed check.

    Attributes
    ----------
    check : str
        Its name in the configuration.
    level : str
        reject, warn or note.
    reason : str
        With the figure and the threshold.
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
    Return a trace that knows its warnings and notes (a copy if there are any); raise if one finding rejects.

    Parameters
    ----------
    trace : obspy Trace
    findings : iterable of Finding

    Returns
    -------
    obspy Stream
        Of one trace, with ``warnings`` and ``notes`` in ``stats.per_obspy``: reasons joined by
        semicolons; the names of the checks that warn stand in ``failed_checks``, joined by spaces.

    Raises
    ------
    RecordRejected
        With the reasons that reject first, then the warnings.
    """
    found = list(findings)
    reject, warn, note = (
        [one.reason for one in found if one.level == level] for level in ("reject", "warn", "note")
    )
    if reject:
        raise RecordRejected(trace.id, *reject, *_earlier(trace, "warnings"), *warn)
    out = trace.copy() if warn or note else trace
    for name, reasons in (("warnings", warn), ("notes", note)):
        if reasons:
            remembered(out, **{name: "; ".join([*_earlier(trace, name), *reasons])})
    if warn:
        names = [one.check for one in found if one.level == "warn"]
        remembered(out, failed_checks=" ".join([*_earlier(trace, "failed_checks"), *names]))
    return Stream([out])


def _earlier(trace: Trace, name: str) -> list[str]:
    text = trace.stats.get("per_obspy", {}).get(name)
    return [text] if text else []


def surviving(
    step: Callable[[Stream], Stream], stream: Stream
) -> tuple[Stream, tuple[Rejection, ...]]:
    """
    Apply a step trace by trace, so that one bad trace never loses the others.

    Parameters
    ----------
    step : callable
        From Stream to new Stream; raises `RecordRejected`.
    stream : obspy Stream

    Returns
    -------
    kept : obspy Stream
        What the step returned for the traces that it accepted.
    lost : tuple of Rejection
        One row for each of the others.
    """
    kept, lost = Stream(), []
    for trace in stream:
        try:
            kept += step(Stream([trace]))
        except RecordRejected as fault:
            lost.append(rejection(trace, *fault.reasons))
    return kept, tuple(lost)
