"""
Spectra of one station: from its processed Stream to a Dataset.

The Dataset contains the spectra of every component, those of the two horizontals by azimuth, and
the processed horizontal motion, from which pairs of buildings are computed at their own periods.
"""

import json
from collections.abc import Sequence
from importlib.metadata import version
from typing import Any

import numpy as np
import xarray as xr
from obspy import Stream, Trace

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
from per_obspy.errors import RecordRejected
from per_obspy.spectra.azimuthal import (
    EVERY_AZIMUTH,
    azimuthal_spectra,
    rotd,
)
from per_obspy.spectra.elastic import response_spectra
from per_obspy.spectra.horizontals import north_and_east
from per_obspy.spectra.record_facts import (
    Variable,
    header_hypocentre,
    peak_motions,
    place_of,
    record_facts,
)


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
    parts = [
        _component_spectra(traces, grid, damping),
        _azimuthal_spectra(motion, horizontals[0].stats.delta, grid, damping, azimuth_step),
        _motion(motion, azimuths, horizontals[0]),
        _usable(horizontals, grid),
        record_facts(stream, horizontals),
    ]
    dataset = xr.merge(parts)
    for variable in dataset.data_vars.values():
        variable.attrs["coverage_content_type"] = _content_type(variable)
    return dataset.assign_attrs(_attributes(horizontals))


def _grid(periods: ArrayLike | None) -> FloatArray:
    """Return the periods of the spectra, s."""
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
    azimuths = station.get("horizontal_azimuth", xr.DataArray([]))
    return bool(azimuths.size == 2 and azimuths.isnull().any())


def _check_match(first: Trace, second: Trace) -> None:
    """Reject two horizontals of different start, interval or length."""
    for field in ("starttime", "delta", "npts"):
        value, other = first.stats[field], second.stats[field]
        if value != other:
            raise RecordRejected(first.id, f"{field} is {value}, but {other} of {second.id}")


def _component_spectra(
    traces: dict[str, Trace], periods: FloatArray, dampings: FloatArray
) -> xr.Dataset:
    """Return PER, SD and absolute SA of every component."""
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
    variables = {
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
    return xr.Dataset(variables, coords=_axes(list(traces), periods, dampings))


def _by_component(spectra: list[FloatArray], units: str, title: str) -> Variable:
    """Return spectra of all components as a float32 variable."""
    attributes = {"units": units, "long_name": title}
    return ("component", "damping", "period"), np.array(spectra, dtype=np.float32), attributes


def _axes(components: list[str], periods: FloatArray, dampings: FloatArray) -> dict[str, Variable]:
    """Return the coordinates of spectra of components."""
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
) -> xr.Dataset:
    """Return PER and SD by azimuth with their percentiles; no variables for one horizontal."""
    if len(motion) == 1:
        return xr.Dataset()
    north, east = motion
    # Every degree for the percentiles, of which the stored azimuths are a part
    per, sd = azimuthal_spectra(north, east, dt, periods, dampings, EVERY_AZIMUTH)
    azimuth = {"units": "degree", "long_name": "azimuth, clockwise from north"}
    return xr.Dataset(
        _by_azimuth("per", per, "pseudo energy radius", step)
        | _by_azimuth("sd", sd, "spectral displacement", step),
        coords={"azimuth": ("azimuth", EVERY_AZIMUTH[::step], azimuth)},
    )


def _by_azimuth(name: str, values: FloatArray, title: str, step: int) -> dict[str, Variable]:
    """Return the stored azimuths and the percentiles of a spectrum (damping, period, azimuth)."""
    stored = np.moveaxis(values[..., ::step], -1, 0).astype(np.float32)
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


def _motion(motion: FloatArray, azimuths: list[float], trace: Trace) -> xr.Dataset:
    """Return the processed horizontal acceleration."""
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
    return xr.Dataset(
        {
            "acceleration": (
                ("horizontal", "time"),
                motion,
                {"units": "m s-2", "long_name": "processed ground acceleration"},
            ),
            "horizontal_azimuth": ("horizontal", azimuths, azimuth),
            "sampling_interval": ((), trace.stats.delta, interval),
        },
        coords={"time": ("time", seconds, time), **place_of(trace)},
    )


def _usable(horizontals: list[Trace], periods: FloatArray) -> xr.Dataset:
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
    return xr.Dataset(
        {
            "usable": ("period", usable, flags),
            "shortest_usable_period": ((), shortest, lower),
            "longest_usable_period": ((), longest, upper),
        }
    )


def _content_type(variable: xr.DataArray) -> str:
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
    """Return whether any of some traces is marked as simulated."""
    return any(trace.stats.get("simulated", False) for trace in traces)
