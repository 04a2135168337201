"""Facts of the records behind the spectra of a station: peaks, sources, warnings and flags."""

from pathlib import Path
from typing import Any

import numpy as np
import xarray as xr
from obspy import Stream, Trace
from scipy.integrate import cumulative_trapezoid

from per_obspy.files import printable

#: Part of the step in ``stats.processing`` of records processed by others.
PASSED_THROUGH = "passed through"

#: Dimensions, values and attributes of a variable of a Dataset.
Variable = tuple[str | tuple[str, ...], Any, dict[str, Any]]


def peak_motions(trace: Trace) -> tuple[float, float]:
    """Return peak acceleration, m/s2, and peak velocity, m/s, of one trace."""
    # Velocity by the trapezoidal rule, exact where acceleration is linear between samples
    velocity = cumulative_trapezoid(trace.data, dx=trace.stats.delta, initial=0.0)
    return float(np.abs(trace.data).max()), float(np.abs(velocity).max())


def record_facts(stream: Stream, horizontals: list[Trace]) -> xr.Dataset:
    """Return source, instrument and level of the records, their warnings and their flags, as text."""
    sources = sorted({Path(str(trace.stats.get("source", ""))).name for trace in stream} - {""})
    instruments = sorted({_instrument(trace) for trace in stream} - {""})
    is_final = any(PASSED_THROUGH in step for step in horizontals[0].stats.get("processing", []))
    # Flags concern the motion of the pairs, warnings every component
    flags = set[str]()
    for trace in horizontals:
        flags.update(trace.stats.get("per_obspy", {}).get("record_flags", "").split())
    facts = {
        "source_files": (", ".join(sources), "names of the files of the records"),
        "instrument": (", ".join(instruments), "location code, band and model; empty if unknown"),
        "record_level": (
            "processed by others" if is_final else "raw",
            "level of the records as they were read",
        ),
        "record_flags": (" ".join(sorted(flags)), "flags of the horizontals, separated by spaces"),
        "warnings": (_remarks(stream, "warnings"), "failed checks that do not reject"),
        "notes": (_remarks(stream, "notes"), "failed checks without consequence"),
    }
    variables: dict[str, Variable] = {}
    for name, (text, meaning) in facts.items():
        variables[name] = ((), printable(text), {"long_name": meaning})
    return xr.Dataset(variables)


def _instrument(trace: Trace) -> str:
    """Return location code, band and instrument code, and the model if the header names it."""
    model = trace.stats.get("instrument", {}).get("model") or ""
    code = trace.stats.channel[:2] if len(trace.stats.channel) == 3 else ""
    return " ".join(filter(None, (trace.stats.location, code, str(model))))


def _remarks(stream: Stream, name: str) -> str:
    """Return the warnings or notes of all components, each with its channel."""
    remarks = []
    for trace in stream:
        text = trace.stats.get("per_obspy", {}).get(name)
        if text:
            remarks.append(f"{trace.stats.channel}: {text}")
    return "; ".join(remarks)
