"""Checks of a processed record: its velocity, and that velocity and displacement come to rest."""

from collections.abc import Iterator

import numpy as np
from obspy import Stream, Trace
from scipy.integrate import cumulative_trapezoid

from per_obspy.config import Checks
from per_obspy.processing.notes import copied, noted
from per_obspy.processing.quality.findings import Finding, above
from per_obspy.processing.quality.physical_limits import velocity_findings

#: Checks of whether the motion comes to rest: only warnings where others have processed a record.
AT_REST = ("final_velocity", "final_displacement", "baseline_shift")

#: Quantity -> its integral and the unit of that.
INTEGRALS = {"acceleration": ("velocity", "m/s"), "velocity": ("displacement", "m")}


def integrated(stream: Stream) -> Stream:
    """
    Return a copy integrated once by the trapezoidal rule, from rest at the first sample.

    Parameters
    ----------
    stream : obspy Stream
        Acceleration, m/s2, or velocity, m/s; with the pads of its filter, where it has any.

    Returns
    -------
    obspy Stream
        Velocity, m/s, or displacement, m.
    """
    out = copied(stream)
    for trace in out:
        quantity, units = INTEGRALS[trace.stats.get("quantity", "acceleration")]
        trace.data = cumulative_trapezoid(trace.data, dx=trace.stats.delta, initial=0)
        trace.stats.quantity, trace.stats.units = quantity, units
        noted(trace, f"integrated to {quantity}")
    return out


def final_findings(trace: Trace, checks: Checks) -> Iterator[Finding]:
    """
    Yield findings of a velocity that no ground has, and of motion that does not come to rest.

    Velocity and displacement come to rest with the pads. A residual velocity before the filter is
    a finding too.

    Parameters
    ----------
    trace : obspy Trace
        Processed acceleration, m/s2.
    checks : Checks
        Thresholds and levels.

    Yields
    ------
    Finding
    """
    velocity = integrated(Stream([trace]))
    displacement = integrated(velocity)[0].data
    peak_velocity = float(np.abs(velocity[0].data).max())
    yield from velocity_findings(trace, peak_velocity, checks)
    # Last value over the largest
    motions = {"final_velocity": velocity[0].data, "final_displacement": displacement}
    for name, motion in motions.items():
        peak = np.abs(motion).max()
        ratio = float(abs(motion[-1]) / peak) if peak else 0.0
        meaning = f"{name.replace('_', ' ')} over its peak:"
        yield from above(name, getattr(checks, name), ratio, meaning)
    yield from _shift_findings(trace, peak_velocity, checks)


def _shift_findings(trace: Trace, peak: float, checks: Checks) -> Iterator[Finding]:
    """Yield a finding where the residual velocity before the filter is large for the peak, m/s."""
    known = trace.stats.get("per_obspy", {})
    ratio = float(known.get("residual_velocity", 0.0)) / peak if peak else 0.0
    meaning = (
        "the baseline shifted during the shaking: velocity that stayed, over the peak velocity"
    )
    found = above("baseline_shift", checks.baseline_shift, ratio, meaning)
    # A smaller one shortens the usable periods
    certain = float(known.get("certain_period", np.inf))
    if not found and certain <= float(known.get("longest_period", 0.0)):
        reason = (
            f"the baseline may have shifted during the shaking: PER beyond {certain:.3g} s depends "
            "on when"
        )
        found = [Finding("baseline_shift", "warn", reason)]
    yield from found
