"""Facts of the records of a station: peaks, sources, hypocentre, warnings and flags."""

from collections.abc import Iterable
from pathlib import Path
from typing import Any

import numpy as np
import xarray as xr
from obspy import Stream, Trace
from scipy.integrate import cumulative_trapezoid

from per_obspy.errors import printable

#: Part of the step in ``stats.processing`` of records processed by others.
PASSED_THROUGH = "passed through"

#: Texts about the records of a station, with their meanings.
MEANINGS = {
    "source_files": "names of the files of the records",
    "instrument": "location code, band and model; empty if unknown",
    "record_level": "level of the records as they were read",
    "record_flags": "flags of the horizontals, separated by spaces",
    "warnings": "failed checks that do not reject",
    "notes": "failed checks without consequence",
    "coordinates_source": "where the coordinates of the station come from; empty if unknown",
    "coordinates_conflict": "places of other sources more than 1 km away; empty if none",
}

#: Words of a hypocentre: degrees, and m.
PLACE = ("longitude", "latitude", "depth")

#: Attributes of the coordinates of a station, as CF asks for them.
COORDINATES = {
    "latitude": {"units": "degrees_north", "standard_name": "latitude", "long_name": "latitude"},
    "longitude": {"units": "degrees_east", "standard_name": "longitude", "long_name": "longitude"},
    "elevation": {
        "units": "m",
        "standard_name": "surface_altitude",
        "long_name": "elevation",
        "positive": "up",
    },
}

#: Dimensions, values and attributes of a variable of a Dataset.
Variable = tuple[str | tuple[str, ...], Any, dict[str, Any]]


def peak_motions(trace: Trace) -> tuple[float, float]:
    """Return peak acceleration, m/s2, and peak velocity, m/s, of one trace."""
    # Velocity by the trapezoidal rule, exact where acceleration is linear between samples
    velocity = cumulative_trapezoid(trace.data, dx=trace.stats.delta, initial=0)
    return float(np.abs(trace.data).max()), float(np.abs(velocity).max())


def record_facts(stream: Stream, horizontals: list[Trace]) -> xr.Dataset:
    """
    Describe the records of a station by texts: sources, instrument, level, warnings and flags.

    Parameters
    ----------
    stream : Stream
        Processed records of one station.
    horizontals : list of Trace
        Those of them that move the pairs of buildings.

    Returns
    -------
    Dataset
        Scalar texts without control characters, empty where unknown.
    """
    # Level and files as they were read
    is_final = any(PASSED_THROUGH in step for step in horizontals[0].stats.get("processing", []))
    sources = [Path(str(trace.stats.get("source", ""))).name for trace in stream]
    # Flags concern the motion of the pairs, warnings every component
    flags = " ".join(_noted(trace, "record_flags") for trace in horizontals).split()
    texts = {
        "source_files": _listed(sources),
        "instrument": _listed(map(_instrument, stream)),
        "record_level": "processed by others" if is_final else "raw",
        "record_flags": " ".join(sorted(set(flags))),
        "warnings": _remarks(stream, "warnings"),
        "notes": _remarks(stream, "notes"),
        **_place_facts(horizontals),
    }
    variables: dict[str, Variable] = {}
    for name, text in texts.items():
        variables[name] = ((), printable(text), {"long_name": MEANINGS[name]})
    return xr.Dataset(variables)


def _place_facts(horizontals: list[Trace]) -> dict[str, str]:
    """Return source and contradictions of the coordinates of the horizontals, each once."""
    names = ("coordinates_source", "coordinates_conflict")
    return {
        name: "; ".join(dict.fromkeys(filter(None, (t.stats.get(name, "") for t in horizontals))))
        for name in names
    }


def header_hypocentre(traces: Iterable[Trace]) -> dict[str, float]:
    """
    Return the hypocentre in the headers of records: the first one with place and depth.

    Parameters
    ----------
    traces : iterable of Trace
        Records of one earthquake, in the words of ``formats/text/vocabulary.py``.

    Returns
    -------
    dict
        ``hypocentre_longitude``, ``hypocentre_latitude``, ``hypocentre_depth``, degrees and m;
        empty where no header has all three.
    """
    for trace in traces:
        event = trace.stats.get("event") or {}
        place = np.array([event.get(name, np.nan) for name in PLACE], dtype=np.float64)
        # Headers write 0, 0 for an unknown place
        if np.isfinite(place).all() and place[:2].any():
            return {f"hypocentre_{name}": float(place[i]) for i, name in enumerate(PLACE)}
    return {}


def _noted(trace: Trace, name: str) -> str:
    """Return a text that the processing noted on a trace, empty if there is none."""
    return str(trace.stats.get("per_obspy", {}).get(name) or "")


def _listed(texts: Iterable[str]) -> str:
    """Return different texts in their order, separated by commas."""
    return ", ".join(sorted(set(texts) - {""}))


def _instrument(trace: Trace) -> str:
    """Return location code, band and instrument code, and the model if the header names it."""
    model = trace.stats.get("instrument", {}).get("model") or ""
    code = trace.stats.channel[:2] if len(trace.stats.channel) == 3 else ""
    return " ".join(filter(None, (trace.stats.location, code, str(model))))


def _remarks(stream: Stream, name: str) -> str:
    """Return the warnings or notes of all components, each with its channel."""
    remarks = []
    for trace in stream:
        text = _noted(trace, name)
        if text:
            remarks.append(f"{trace.stats.channel}: {text}")
    return "; ".join(remarks)


def place_of(trace: Trace) -> dict[str, Variable]:
    """Return name, coordinates and ground of the station; NaN or no text where unknown."""
    stats = trace.stats
    name = f"{stats.network}.{stats.station}"
    velocity = {
        "units": "m s-1",
        "long_name": "mean shear-wave velocity of the upper 30 m of ground",
    }
    place: dict[str, Variable] = {
        "station": ((), name, {"cf_role": "timeseries_id", "long_name": "station"}),
        "site_class": (
            (),
            str(stats.get("site_class", "")),
            {"long_name": "site class; empty if unknown"},
        ),
        "vs30": ((), float(stats.get("vs30", np.nan)), velocity),
    }
    # Latitude, longitude and elevation, as far as the metadata have them
    known = stats.get("coordinates", {})
    for coordinate, attributes in COORDINATES.items():
        place[coordinate] = ((), float(known.get(coordinate, np.nan)), dict(attributes))
    return place
