"""
Spectra of one station: from its processed Stream to a Dataset.

The Dataset contains the spectra of every component, those of the two horizontals by azimuth, and
the processed horizontal motion, from which pairs of buildings are computed at their own periods.
"""

import json
from collections.abc import Iterable, Sequence
from importlib.metadata import version
from pathlib import Path
from typing import Any

import numpy as np
import xarray as xr
from obspy import Stream, Trace
from scipy.integrate import cumulative_trapezoid

from per_obspy import checks
from per_obspy.checks import ArrayLike, FloatArray
from per_obspy.constants import (
    LONGEST_STORED_PERIOD,
    SHORTEST_STORED_PERIOD,
    STORED_AZIMUTH_STEP,
    STORED_DAMPINGS,
    STORED_PERIODS,
    VERTICAL_DIP,
)
from per_obspy.errors import RecordRejected, printable
from per_obspy.spectra.azimuthal import (
    EVERY_AZIMUTH,
    azimuthal_spectra,
    rotd,
)
from per_obspy.spectra.elastic import response_spectra

#: Sensors closer than this to the same line do not resolve the plane; degrees. A choice: the error
#: of the resolved motion grows like 1/sin of the angle between them, here by a factor of 3.
SMALLEST_RESOLVED_ANGLE = 20.0


def north_and_east(
    first: FloatArray, second: FloatArray, azimuth_1: float, azimuth_2: float
) -> tuple[FloatArray, FloatArray]:
    """
    Resolve the motion of two horizontal sensors into north and east components.

    A sensor at azimuth θ, degrees clockwise from north, records a_N cos θ + a_E sin θ; two of them
    are solved for a_N and a_E. The sensors need not be orthogonal; within 20 degrees of the same
    line they are refused (``ValueError``).

    Examples
    --------
    >>> north, east = north_and_east(np.array([0.0, 2.0]), np.array([1.0, 0.0]), 90.0, 180.0)
    >>> north.round(12).tolist(), east.round(12).tolist()
    ([-1.0, 0.0], [0.0, 2.0])
    """
    cosine_1, sine_1 = _direction(azimuth_1)
    cosine_2, sine_2 = _direction(azimuth_2)
    # Two equations for a_N and a_E; the determinant is the sine of the angle between the sensors
    determinant = cosine_1 * sine_2 - cosine_2 * sine_1
    if abs(determinant) < np.sin(np.radians(SMALLEST_RESOLVED_ANGLE)):
        raise ValueError(
            f"sensor azimuths {azimuth_1:g} and {azimuth_2:g} degrees "
            "are too close to the same line"
        )
    north = (sine_2 * first - sine_1 * second) / determinant
    east = (cosine_1 * second - cosine_2 * first) / determinant
    return north, east


def _direction(azimuth: float) -> tuple[float, float]:
    """Return cosine and sine of an azimuth in degrees."""
    # Exact at multiples of 90 degrees, so that north and east sensors pass unchanged
    quarter, rest = divmod(azimuth % 360.0, 90.0)
    if rest == 0.0:
        return ((1.0, 0.0), (0.0, 1.0), (-1.0, 0.0), (0.0, -1.0))[int(quarter)]
    return float(np.cos(np.radians(azimuth))), float(np.sin(np.radians(azimuth)))


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


def record_facts(stream: Stream, horizontals: list[Trace]) -> dict[str, Variable]:
    """
    Describe the records of a station by texts: sources, instrument, level, warnings and flags.

    The horizontals are those of them that move the pairs of buildings. The texts are without
    control characters, and empty where unknown.
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
    return {
        name: ((), printable(text), {"long_name": MEANINGS[name]}) for name, text in texts.items()
    }


def _place_facts(horizontals: list[Trace]) -> dict[str, str]:
    """Return source and contradictions of the coordinates of the horizontals, each once."""
    names = ("coordinates_source", "coordinates_conflict")
    return {
        name: "; ".join(dict.fromkeys(filter(None, (t.stats.get(name, "") for t in horizontals))))
        for name in names
    }


def header_hypocentre(traces: Iterable[Trace]) -> dict[str, float]:
    """
    Return the hypocentre in the headers of records of one earthquake, where one has all of it.

    It is ``hypocentre_longitude``, ``hypocentre_latitude`` and ``hypocentre_depth``, degrees and m,
    of the first header with place and depth, else empty.
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


def station_spectra(
    stream: Stream | Trace,
    periods: ArrayLike | None = None,
    dampings: Sequence[float] = STORED_DAMPINGS,
    azimuth_step: int = STORED_AZIMUTH_STEP,
) -> xr.Dataset:
    """
    Compute the spectra of a station, with the processed motion they come from.

    Parameters
    ----------
    stream : Stream or Trace
        Processed acceleration of one station, m/s², one trace per component, as
        :func:`per_obspy.process` returns it. Two horizontals share their start, interval and
        length.
    periods : (n_periods,) array_like, optional
        Natural periods, s; 100 from 0.05 to 10 s, logarithmically spaced, if not given.
    dampings : sequence of float
        Fractions of critical.
    azimuth_step : int
        Degrees between the azimuths that are stored; RotD50 and RotD100 always use every degree.

    Returns
    -------
    Dataset
        Dimensions ``component`` (``component_name`` has the names horizontal_1, horizontal_2,
        vertical of those that exist), ``azimuth``, ``damping``, ``period``, ``horizontal`` and
        ``time``. Spectra are float32, m; ``acceleration`` is float64, m/s². With one horizontal
        there are no spectra by azimuth: the station serves its own azimuth only. Of two whose
        azimuths are not both known, azimuths count from the first sensor, at right angles to the
        second one, and ``horizontal_azimuth`` is NaN.

    Raises
    ------
    RecordRejected
        If there is no horizontal, no acceleration in m/s², or the horizontals do not match.
    """
    stream = Stream([stream]) if isinstance(stream, Trace) else stream
    grid = _grid(periods)
    damping = np.atleast_1d(checks.fraction_of_critical("dampings", dampings))
    traces = _components(stream)
    horizontals = [trace for name, trace in traces.items() if name != "vertical"]
    motion, azimuths = _horizontal_motion(horizontals)

    # Spectra by component and by azimuth, the motion, and the usable periods
    place = place_of(horizontals[0])
    variables = {
        **_component_spectra(traces, grid, damping),
        **_azimuthal_spectra(motion, horizontals[0].stats.delta, grid, damping, azimuth_step),
        **_motion(motion, azimuths, horizontals[0]),
        **place,
        **_usable(horizontals, grid),
        **record_facts(stream, horizontals),
    }
    # One Dataset of all: to join several takes as long as some spectra
    dataset = xr.Dataset(variables, attrs=_attributes(horizontals))
    dataset = dataset.set_coords(["component_name", *place])
    for name in dataset.data_vars:
        variable = dataset.variables[name]
        variable.attrs["coverage_content_type"] = _content_type(variable)
    return dataset


def _grid(periods: ArrayLike | None) -> FloatArray:
    if periods is None:
        return np.geomspace(SHORTEST_STORED_PERIOD, LONGEST_STORED_PERIOD, STORED_PERIODS)
    return np.atleast_1d(checks.positive("periods", periods))


def _components(stream: Stream) -> dict[str, Trace]:
    """Return the traces by name: horizontals in ascending azimuth, then the vertical."""
    station = stream[0].id if stream else "an empty stream"
    # Every trace in the same unit
    reasons = []
    for trace in stream:
        units = trace.stats.get("units")
        if units is None:
            reasons.append(
                f"{trace.id} has no stats.units: expected acceleration in m/s2, as "
                "per_obspy.process returns it, or marked by stats.units = 'm/s2'"
            )
        elif units != "m/s2":
            reasons.append(f"{trace.id} is in {units!r}, not m/s2")

    # One or two horizontals, and at most one vertical
    verticals = [trace for trace in stream if _is_vertical(trace)]
    horizontals = [trace for trace in stream if not _is_vertical(trace)]
    horizontals.sort(key=_azimuth)
    if not 1 <= len(horizontals) <= 2 or len(verticals) > 1:
        reasons.append(
            f"has {len(horizontals)} horizontal and {len(verticals)} vertical components"
        )
    if reasons:
        raise RecordRejected(station, *reasons)

    named = {f"horizontal_{i}": trace for i, trace in enumerate(horizontals, start=1)}
    return named | dict(zip(("vertical",), verticals, strict=False))


def _is_vertical(trace: Trace) -> bool:
    """Return whether the sensor is vertical by its dip or its channel code."""
    dip = abs(trace.stats.get("sensor_dip", 0.0))
    return bool(dip > VERTICAL_DIP or trace.stats.channel.endswith("Z"))


def _azimuth(trace: Trace) -> float:
    """Return the sensor's azimuth from metadata, else from a channel ending in N or E, else NaN."""
    by_code = {"N": 0.0, "E": 90.0}.get(trace.stats.channel[-1:], np.nan)
    return float(trace.stats.get("sensor_azimuth", by_code)) % 360.0


def _horizontal_motion(horizontals: list[Trace]) -> tuple[FloatArray, list[float]]:
    """Return motion to the north and east, or along the only sensor, with azimuths of its rows."""
    azimuths = [_azimuth(trace) for trace in horizontals]
    if len(horizontals) == 1:
        return np.array([horizontals[0].data], dtype=np.float64), azimuths
    first, second = horizontals
    _check_match(first, second)
    if not np.isfinite(azimuths).all():
        motion = np.array([first.data, second.data], dtype=np.float64)
        return motion, [np.nan, np.nan]
    # Sensors close to the same line do not resolve the plane
    try:
        north, east = north_and_east(first.data, second.data, *azimuths)
    except ValueError as error:
        raise RecordRejected(first.id, str(error)) from error
    return np.array([north, east]), [0.0, 90.0]


def lacks_azimuths(station: xr.Dataset) -> bool:
    """Return whether a station has two horizontals whose azimuths are not both known."""
    if "horizontal_azimuth" not in station:
        return False
    azimuths = station["horizontal_azimuth"].to_numpy()
    return bool(azimuths.size == 2 and np.isnan(azimuths).any())


def _check_match(first: Trace, second: Trace) -> None:
    """Reject two horizontals of different start, interval or length."""
    for field in ("starttime", "delta", "npts"):
        value, other = first.stats[field], second.stats[field]
        if value != other:
            raise RecordRejected(first.id, f"{field} is {value}, but {other} of {second.id}")


def _component_spectra(
    traces: dict[str, Trace], periods: FloatArray, dampings: FloatArray
) -> dict[str, Variable]:
    spectra = [
        response_spectra(trace.data, trace.stats.delta, periods, dampings)
        for trace in traces.values()
    ]
    channels = [trace.stats.channel for trace in traces.values()]
    processing = [_processing_record(trace) for trace in traces.values()]
    # Peaks of all components: acceleration, velocity
    peaks = np.transpose([peak_motions(trace) for trace in traces.values()])

    # Each spectrum is an array (component, damping, period)
    per = [spectrum.per for spectrum in spectra]
    sd = [spectrum.sd for spectrum in spectra]
    sa = [spectrum.sa for spectrum in spectra]
    return _axes(list(traces), periods, dampings) | {
        "per": _by_component(per, "m", "pseudo energy radius"),
        "sd": _by_component(sd, "m", "spectral displacement"),
        "sa": _by_component(sa, "m s-2", "absolute spectral acceleration"),
        "pga": ("component", peaks[0], {"units": "m s-2", "long_name": "peak ground acceleration"}),
        "pgv": ("component", peaks[1], {"units": "m s-1", "long_name": "peak ground velocity"}),
        "channel": ("component", channels, {"long_name": "SEED channel code"}),
        "processing": (
            "component",
            processing,
            {"long_name": "processing steps of the record and every number chosen for it, as JSON"},
        ),
    }


def _by_component(spectra: list[FloatArray], units: str, title: str) -> Variable:
    """Return spectra of all components as a float32 variable."""
    attributes = {"units": units, "long_name": title}
    return ("component", "damping", "period"), np.array(spectra, dtype=np.float32), attributes


def _axes(components: list[str], periods: FloatArray, dampings: FloatArray) -> dict[str, Variable]:
    damping = {"units": "1", "long_name": "damping ratio, fraction of critical"}
    return {
        "component_name": (
            "component",
            components,
            {"long_name": "horizontal_1, horizontal_2, vertical"},
        ),
        "damping": ("damping", dampings, damping),
        "period": ("period", periods, {"units": "s", "long_name": "natural period"}),
    }


def _processing_record(trace: Trace) -> str:
    """Return the steps and numbers of one trace as JSON."""
    steps = list(trace.stats.get("processing", []))
    numbers = dict(trace.stats.get("per_obspy", {}))
    return json.dumps({"steps": steps, **numbers}, default=str, sort_keys=True)


def _azimuthal_spectra(
    motion: FloatArray, dt: float, periods: FloatArray, dampings: FloatArray, step: int
) -> dict[str, Variable]:
    """Return PER and SD by azimuth with their percentiles; no variables for one horizontal."""
    if len(motion) == 1:
        return {}
    north, east = motion
    # Every degree for the percentiles, of which the stored azimuths are a part
    per, sd = azimuthal_spectra(north, east, dt, periods, dampings, EVERY_AZIMUTH)
    azimuth = {"units": "degree", "long_name": "azimuth, clockwise from north"}
    return {
        "azimuth": ("azimuth", EVERY_AZIMUTH[::step], azimuth),
        **_by_azimuth("per", per, "pseudo energy radius", step),
        **_by_azimuth("sd", sd, "spectral displacement", step),
    }


def _by_azimuth(name: str, values: FloatArray, title: str, step: int) -> dict[str, Variable]:
    """Return the stored azimuths and the percentiles of a spectrum (damping, period, azimuth)."""
    stored = np.ascontiguousarray(np.moveaxis(values[..., ::step], -1, 0), dtype=np.float32)
    along = {
        "units": "m",
        "long_name": f"{title} of the horizontal motion along the azimuth",
    }
    variables: dict[str, Variable] = {
        f"{name}_azimuthal": (("azimuth", "damping", "period"), stored, along)
    }
    # Percentiles use every degree, stored or not
    for percentile in (50, 100):
        text = {"units": "m", "long_name": f"{title}, percentile {percentile} over azimuth"}
        spectrum = rotd(values, percentile).astype(np.float32)
        variables[f"{name}_rotd{percentile}"] = (("damping", "period"), spectrum, text)
    return variables


def _motion(motion: FloatArray, azimuths: list[float], trace: Trace) -> dict[str, Variable]:
    azimuth = {
        "units": "degree",
        "long_name": "azimuth of the motion, clockwise from north; missing if unknown",
    }
    interval = {"units": "s", "long_name": "sampling interval"}
    time = {
        "units": f"seconds since {trace.stats.starttime}",
        "standard_name": "time",
        "long_name": "time",
        "calendar": "standard",
        "units_metadata": "leap_seconds: none",
    }
    # Time is relative to the start, so that it is exact
    seconds = np.arange(motion.shape[1]) * trace.stats.delta
    acceleration = {"units": "m s-2", "long_name": "processed ground acceleration"}
    return {
        "acceleration": (("horizontal", "time"), motion, acceleration),
        "horizontal_azimuth": ("horizontal", azimuths, azimuth),
        "sampling_interval": ((), trace.stats.delta, interval),
        "time": ("time", seconds, time),
    }


def _usable(horizontals: list[Trace], periods: FloatArray) -> dict[str, Variable]:
    """Return the limits of the periods that every horizontal supports, and a flag per period."""
    limits = [trace.stats.get("per_obspy", {}) for trace in horizontals]
    shortest = max(float(limit.get("shortest_period", 0.0)) for limit in limits)
    longest = min(float(limit.get("longest_period", np.inf)) for limit in limits)
    usable = ((periods >= shortest) & (periods <= longest)).astype(np.int8)
    # Flag variables as CF describes them
    flags = {
        "long_name": "whether the processing leaves the period usable",
        "flag_values": np.array([0, 1], dtype=np.int8),
        "flag_meanings": "not_usable usable",
    }
    lower = {"units": "s", "long_name": "shortest usable period"}
    upper = {"units": "s", "long_name": "longest usable period"}
    return {
        "usable": ("period", usable, flags),
        "shortest_usable_period": ((), shortest, lower),
        "longest_usable_period": ((), longest, upper),
    }


def _content_type(variable: xr.Variable) -> str:
    """Return the kind of content in the words of ISO 19115-1, which ACDD asks for."""
    if "flag_values" in variable.attrs:
        return "qualityInformation"
    return "modelResult" if variable.dtype == np.float32 else "auxiliaryInformation"


def _attributes(horizontals: list[Trace]) -> dict[str, Any]:
    """Return the attributes of CF 1.11 and ACDD 1.3 that are true of one station."""
    first = horizontals[0].stats
    station, software = f"{first.network}.{first.station}", f"per_obspy {version('per_obspy')}"
    # Title, source and time of the Dataset
    attributes = {
        "Conventions": "CF-1.11, ACDD-1.3",
        "title": f"Pseudo energy radius spectra of station {station}",
        "summary": (
            "Pseudo energy radius and response spectra of strong-motion records, "
            "exact between samples."
        ),
        "keywords": (
            "earthquake, strong motion, response spectrum, pseudo energy radius, "
            "structural pounding"
        ),
        "references": (
            "Valles-Mattox and Reinhorn, An energy approach to pounding of structures, 11WCEE, 1996"
        ),
        "id": station,
        "source": software,
        "history": f"computed from processed acceleration by {software}",
        "processing_level": "spectra of processed records",
        "standard_name_vocabulary": "CF Standard Name Table v93",
        "cdm_data_type": "Station",
        "time_coverage_start": str(first.starttime),
        "time_coverage_end": str(first.endtime),
        "horizontals": len(horizontals),
        "simulated": str(_is_simulated(horizontals)).lower(),
        **header_hypocentre(horizontals),
    }
    # The box of ACDD is a point, if the station's place is known
    known = first.get("coordinates", {})
    for name in ("latitude", "longitude"):
        if name in known:
            attributes[f"geospatial_{name[:3]}_min"] = known[name]
            attributes[f"geospatial_{name[:3]}_max"] = known[name]
    return attributes


def _is_simulated(traces: list[Trace]) -> bool:
    return any(trace.stats.get("simulated", False) for trace in traces)
