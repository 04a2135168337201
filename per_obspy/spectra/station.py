"""
The spectra of one station: from its processed Stream to a Dataset.

The Dataset holds what is stored of a station: the spectra of every component, of the two
horizontals by azimuth, and the processed horizontal motion itself, from which pairs of buildings
are computed at their own periods.
"""

import json
from collections.abc import Sequence
from importlib.metadata import version
from typing import Any

import numpy as np
import xarray as xr
from numpy.typing import ArrayLike
from obspy import Stream, Trace

from per_obspy import checks
from per_obspy.checks import FloatArray
from per_obspy.constants import VERTICAL_DIP
from per_obspy.errors import RecordRejected
from per_obspy.spectra.azimuthal import azimuthal_per_spectrum, azimuthal_sd_spectrum, rotd
from per_obspy.spectra.elastic import response_spectra
from per_obspy.spectra.horizontals import north_and_east

#: Every degree, for the percentiles over azimuth.
EVERY_AZIMUTH = np.arange(180.0)

_RADIUS = {"units": "m"}


def station_spectra(
    stream: Stream,
    periods: ArrayLike | None = None,
    dampings: Sequence[float] = (0.02, 0.05, 0.10, 0.20),
    azimuth_step: int = 10,
) -> xr.Dataset:
    """
    Return the spectra of a station, with the processed motion they came from.

    Parameters
    ----------
    stream : Stream
        Processed acceleration of one station, m/s², one trace a component, as
        :func:`per_obspy.process` returns it. Two horizontals share their start, interval and
        length.
    periods : (n_periods,) array_like, optional
        Natural periods, s; 100 from 0.05 to 10 s, logarithmically spaced, if not given.
    dampings : sequence of float
        Fractions of critical.
    azimuth_step : int
        Degrees between the azimuths that are stored; RotD50 and RotD100 always come from every
        degree.

    Returns
    -------
    Dataset
        Dimensions ``component`` (their names, horizontal_1, horizontal_2, vertical, as far as there
        are, stand in ``component_name``), ``azimuth``, ``damping``, ``period``, ``horizontal`` and
        ``time``. Spectra are float32, m; ``acceleration`` is float64, m/s². With one horizontal
        there are no spectra by azimuth: the station serves its own azimuth only.

    Raises
    ------
    RecordRejected
        If there is no horizontal, no acceleration in m/s², or the horizontals do not match.
    """
    grid = (
        np.geomspace(0.05, 10.0, 100)
        if periods is None
        else np.atleast_1d(checks.positive("periods", periods))
    )
    damping = np.atleast_1d(checks.fraction_of_critical("dampings", dampings))
    traces = _components(stream)
    horizontals = [trace for name, trace in traces.items() if name != "vertical"]
    motion, azimuths = _horizontal_motion(horizontals)
    dataset = xr.merge(
        [
            _component_spectra(traces, grid, damping),
            _azimuthal_spectra(motion, horizontals[0].stats.delta, grid, damping, azimuth_step),
            _motion(motion, azimuths, horizontals[0]),
            _usable(horizontals, grid),
        ]
    )
    for variable in dataset.data_vars.values():
        variable.attrs["coverage_content_type"] = _content_type(variable)
    return dataset.assign_attrs(_attributes(horizontals))


def _components(stream: Stream) -> dict[str, Trace]:
    """Return the traces by name: horizontals in ascending azimuth, then the vertical."""
    station = stream[0].id if stream else "an empty stream"
    horizontals = sorted((trace for trace in stream if not _is_vertical(trace)), key=_azimuth)
    verticals = [trace for trace in stream if _is_vertical(trace)]
    reasons = [
        f"{t.id} is in {t.stats.get('units')!r}, not m/s2"
        for t in stream
        if t.stats.get("units") != "m/s2"
    ]
    if not 1 <= len(horizontals) <= 2 or len(verticals) > 1:
        reasons.append(
            f"has {len(horizontals)} horizontal and {len(verticals)} vertical components"
        )
    if reasons:
        raise RecordRejected(station, *reasons)
    named = {f"horizontal_{i}": trace for i, trace in enumerate(horizontals, start=1)}
    return named | dict(zip(("vertical",), verticals, strict=False))


def _is_vertical(trace: Trace) -> bool:
    return bool(
        abs(trace.stats.get("sensor_dip", 0.0)) > VERTICAL_DIP or trace.stats.channel.endswith("Z")
    )


def _azimuth(trace: Trace) -> float:
    """Return the sensor's azimuth from its metadata, else from a channel code ending in N or E, else NaN."""
    by_code = {"N": 0.0, "E": 90.0}.get(trace.stats.channel[-1:], np.nan)
    return float(trace.stats.get("sensor_azimuth", by_code)) % 360.0


def _horizontal_motion(horizontals: list[Trace]) -> tuple[FloatArray, list[float]]:
    """Return motion to the north and east, or along the only sensor, with the azimuths of its rows."""
    first, azimuths = horizontals[0], [_azimuth(trace) for trace in horizontals]
    if len(horizontals) == 1:
        return np.array([first.data], dtype=np.float64), azimuths
    second = horizontals[1]
    if not np.isfinite(azimuths).all():
        raise RecordRejected(
            first.id, f"sensor azimuths of {first.id} and {second.id} are unknown: {azimuths}"
        )
    for field in ("starttime", "delta", "npts"):
        if first.stats[field] != second.stats[field]:
            raise RecordRejected(
                first.id,
                f"{field} is {first.stats[field]}, but {second.stats[field]} of {second.id}",
            )
    try:
        pair = north_and_east(first.data, second.data, *azimuths)
    except ValueError as error:
        raise RecordRejected(first.id, str(error)) from error
    return np.array(pair), [0.0, 90.0]


def _component_spectra(
    traces: dict[str, Trace], periods: FloatArray, dampings: FloatArray
) -> xr.Dataset:
    """Return PER, SD and absolute SA of every component."""
    spectra = [
        response_spectra(trace.data, trace.stats.delta, periods, dampings)
        for trace in traces.values()
    ]
    dimensions = ("component", "damping", "period")

    def stacked(name: str) -> np.ndarray[Any, np.dtype[np.float32]]:
        return np.array([getattr(spectrum, name) for spectrum in spectra], dtype=np.float32)

    return xr.Dataset(
        {
            "per": (dimensions, stacked("per"), _RADIUS | {"long_name": "pseudo energy radius"}),
            "sd": (dimensions, stacked("sd"), _RADIUS | {"long_name": "spectral displacement"}),
            "sa": (
                dimensions,
                stacked("sa"),
                {"units": "m s-2", "long_name": "absolute spectral acceleration"},
            ),
            "channel": (
                "component",
                [t.stats.channel for t in traces.values()],
                {"long_name": "SEED channel code"},
            ),
            "processing": (
                "component",
                [_processing_record(trace) for trace in traces.values()],
                {
                    "long_name": "what was done to the record and every number chosen for it, as JSON"
                },
            ),
        },
        coords={
            "component_name": (
                "component",
                list(traces),
                {"long_name": "horizontal_1, horizontal_2, vertical"},
            ),
            "damping": (
                "damping",
                dampings,
                {"units": "1", "long_name": "damping ratio, fraction of critical"},
            ),
            "period": ("period", periods, {"units": "s", "long_name": "natural period"}),
        },
    )


def _processing_record(trace: Trace) -> str:
    """Return the steps and numbers of one trace as JSON."""
    steps = list(trace.stats.get("processing", []))
    return json.dumps(
        {"steps": steps, **dict(trace.stats.get("per_obspy", {}))}, default=str, sort_keys=True
    )


def _azimuthal_spectra(
    motion: FloatArray, dt: float, periods: FloatArray, dampings: FloatArray, step: int
) -> xr.Dataset:
    """Return PER and SD by azimuth with their percentiles; nothing where there is one horizontal."""
    if len(motion) == 1:
        return xr.Dataset()
    north, east = motion
    spectra = {
        "per": (
            "pseudo energy radius",
            azimuthal_per_spectrum(north, east, dt, periods, dampings, EVERY_AZIMUTH),
        ),
        "sd": (
            "spectral displacement",
            azimuthal_sd_spectrum(north, east, dt, periods, dampings, EVERY_AZIMUTH),
        ),
    }
    dimensions = ("damping", "period")
    variables: dict[str, Any] = {}
    for name, (title, values) in spectra.items():
        stored = np.moveaxis(values[..., ::step], -1, 0).astype(np.float32)
        variables[f"{name}_azimuthal"] = (
            ("azimuth", *dimensions),
            stored,
            _RADIUS | {"long_name": f"{title} of the horizontal motion along the azimuth"},
        )
        for percentile in (50, 100):
            variables[f"{name}_rotd{percentile}"] = (
                dimensions,
                rotd(values, percentile).astype(np.float32),
                _RADIUS | {"long_name": f"{title}, percentile {percentile} over azimuth"},
            )
    azimuth = (
        "azimuth",
        EVERY_AZIMUTH[::step],
        {"units": "degree", "long_name": "azimuth, clockwise from north"},
    )
    return xr.Dataset(variables, coords={"azimuth": azimuth})


def _motion(motion: FloatArray, azimuths: list[float], trace: Trace) -> xr.Dataset:
    """Return the processed horizontal acceleration."""
    start = trace.stats.starttime
    return xr.Dataset(
        {
            "acceleration": (
                ("horizontal", "time"),
                motion,
                {"units": "m s-2", "long_name": "processed ground acceleration"},
            ),
            "horizontal_azimuth": (
                "horizontal",
                azimuths,
                {
                    "units": "degree",
                    "long_name": "azimuth of the motion, clockwise from north; missing if unknown",
                },
            ),
            "sampling_interval": (
                (),
                trace.stats.delta,
                {"units": "s", "long_name": "sampling interval"},
            ),
        },
        coords={
            "time": (
                "time",
                np.arange(motion.shape[1]) * trace.stats.delta,
                {
                    "units": f"seconds since {start}",
                    "standard_name": "time",
                    "long_name": "time",
                    "calendar": "standard",
                    "units_metadata": "leap_seconds: none",
                },
            ),
            **_place(trace),
        },
    )


def _place(trace: Trace) -> dict[str, Any]:
    """Return name, coordinates and ground of the station; missing (NaN, no text) where they are not known."""
    known = trace.stats.get("coordinates", {})
    described = {
        "latitude": {
            "units": "degrees_north",
            "standard_name": "latitude",
            "long_name": "latitude",
        },
        "longitude": {
            "units": "degrees_east",
            "standard_name": "longitude",
            "long_name": "longitude",
        },
        "elevation": {
            "units": "m",
            "standard_name": "surface_altitude",
            "long_name": "elevation",
            "positive": "up",
        },
    }
    station = f"{trace.stats.network}.{trace.stats.station}"
    names: dict[str, Any] = {
        "station": ((), station, {"cf_role": "timeseries_id", "long_name": "station"})
    }
    names["site_class"] = (
        (),
        str(trace.stats.get("site_class", "")),
        {"long_name": "site class; empty if unknown"},
    )
    velocity = {
        "units": "m s-1",
        "long_name": "mean shear-wave velocity of the upper 30 m of ground",
    }
    names["vs30"] = ((), float(trace.stats.get("vs30", np.nan)), velocity)
    return names | {
        name: ((), float(known.get(name, np.nan)), text) for name, text in described.items()
    }


def _usable(horizontals: list[Trace], periods: FloatArray) -> xr.Dataset:
    """Return which periods every horizontal supports, and the limits."""
    limits = [trace.stats.get("per_obspy", {}) for trace in horizontals]
    shortest = max(float(limit.get("shortest_period", 0.0)) for limit in limits)
    longest = min(float(limit.get("longest_period", np.inf)) for limit in limits)
    usable = ((periods >= shortest) & (periods <= longest)).astype(np.int8)
    flags = {"flag_values": np.array([0, 1], dtype=np.int8), "flag_meanings": "not_usable usable"}
    return xr.Dataset(
        {
            "usable": (
                "period",
                usable,
                {"long_name": "whether the processing leaves the period usable"} | flags,
            ),
            "shortest_usable_period": (
                (),
                shortest,
                {"units": "s", "long_name": "shortest usable period"},
            ),
            "longest_usable_period": (
                (),
                longest,
                {"units": "s", "long_name": "longest usable period"},
            ),
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
    known = first.get("coordinates", {})
    place = {
        f"geospatial_{name[:3]}_{end}": known[name]
        for name in ("latitude", "longitude")
        for end in ("min", "max")
        if name in known
    }
    return {
        "Conventions": "CF-1.11, ACDD-1.3",
        "title": f"Pseudo energy radius spectra of station {station}",
        "summary": "Pseudo energy radius and response spectra of strong-motion records, exact between samples.",
        "keywords": "earthquake, strong motion, response spectrum, pseudo energy radius, structural pounding",
        "references": "Valles-Mattox and Reinhorn, An energy approach to pounding of structures, 11WCEE, 1996",
        "id": station,
        "source": software,
        "history": f"computed from processed acceleration by {software}",
        "processing_level": "spectra of processed records",
        "standard_name_vocabulary": "CF Standard Name Table v93",
        "cdm_data_type": "Station",
        "time_coverage_start": str(first.starttime),
        "time_coverage_end": str(first.endtime),
        "horizontals": len(horizontals),
        "simulated": "false",
        **place,
    }
