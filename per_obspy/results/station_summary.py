"""Tables of stations and of processed records: place, motion, corners, sources, warnings."""

import json
from collections.abc import Iterable, Mapping
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
import pandas as pd
import xarray as xr

from per_obspy.errors import Rejection
from per_obspy.inventory.schema import Column
from per_obspy.records.station_list import StationAmplitudes
from per_obspy.results.table_files import rounded_table, write_csv, write_described
from per_obspy.screening.flags import record_flags
from per_obspy.screening.motion_field import great_circle
from per_obspy.spectra.station import lacks_azimuths


def _columns(dtype: str, *described: tuple[str, str, str]) -> dict[str, Column]:
    """Return columns of one type by name: name, unit and meaning of each."""
    return {name: Column(name, dtype, unit, meaning) for name, unit, meaning in described}


#: Columns of ``stations.csv`` in their order.
COLUMNS: dict[str, Column] = {
    **_columns(
        "str",
        ("station", "", "network and station code"),
        (
            "state",
            "",
            "used: its record or amplitudes serve the pairs near it; rejected: it serves none",
        ),
        ("rejected", "", "rejected records of the station, with every reason"),
        ("flags", "", "flags that every pair of the station has, separated by spaces"),
        ("warnings", "", "failed checks of its records to look at, with channel"),
        ("notes", "", "failed checks of its records that are bookkeeping, with channel"),
    ),
    **_columns("int64", ("pairs", "1", "number of pairs for which the record is used")),
    **_columns(
        "float64",
        ("longitude", "degrees", "longitude of the station, east"),
        ("latitude", "degrees", "latitude of the station, north"),
        ("elevation", "m", "elevation of the station"),
    ),
    **_columns(
        "str",
        ("coordinates_source", "", "name of the table of stations, header or StationXML"),
        ("coordinates_conflict", "", "places of other sources more than 1 km away, with both"),
        ("site_class", "", "site class of the ground; empty if unknown"),
    ),
    **_columns(
        "float64",
        ("vs30", "m/s", "mean shear-wave velocity of the upper 30 m; empty if unknown"),
        (
            "epicentral_distance",
            "m",
            "distance to the epicentre along the great circle; empty without a hypocentre",
        ),
        (
            "hypocentral_distance",
            "m",
            "straight distance to the hypocentre, the Earth taken as flat; empty "
            "without a hypocentre",
        ),
        ("pga", "m/s2", "peak ground acceleration of the processed horizontals, the larger one"),
        ("pgv", "m/s", "peak ground velocity of the processed horizontals, the larger one"),
        ("shortest_usable_period", "s", "shortest usable period of both horizontals"),
        ("longest_usable_period", "s", "longest usable period of both horizontals"),
        ("highpass", "Hz", "corner of the horizontals, the higher one"),
        ("lowpass", "Hz", "corner of the horizontals, the lower one"),
    ),
    **_columns(
        "str",
        ("highpass_source", "", "reasons for the high-pass corners of the horizontals"),
        ("lowpass_source", "", "reasons for the low-pass corners of the horizontals"),
        ("components", "", "channels that are used"),
        ("instrument", "", "location code, band and model; empty if unknown"),
        ("record_level", "", "raw, processed by others, or amplitudes without a record"),
        ("source_files", "", "files of the records"),
    ),
}

#: Flag of a station with a single horizontal.
ONE_HORIZONTAL = "one_horizontal"

#: Flag of a station whose record is not at hand, and of pairs that its amplitudes serve.
AMPLITUDES_ONLY = "amplitudes_only"


class StationSummary(NamedTuple):
    """
    Paths of the station table, and names of the stations by warning.

    Attributes
    ----------
    files : list of Path
        ``stations.csv`` and ``stations.columns.csv``.
    warnings : dict
        Flag -> names of the used stations that have it.
    """

    files: list[Path]
    warnings: dict[str, list[str]]


def write_stations(
    spectra: Iterable[xr.Dataset],
    rejected: Iterable[Rejection],
    pairs: Mapping[str, int],
    folder: Path,
    amplitudes: Iterable[StationAmplitudes] = (),
) -> StationSummary:
    """
    Write ``stations.csv`` and ``stations.columns.csv``; see :func:`station_table`.

    Parameters
    ----------
    spectra, rejected, pairs, amplitudes
        As for :func:`station_table`.
    folder : Path
        The file.
    """
    table = station_table(spectra, rejected, pairs, amplitudes)
    text, columns = files = [folder / "stations.csv", folder / "stations.columns.csv"]
    write_csv(rounded_table(table, own=table.columns), text)
    write_described(COLUMNS.values(), columns)
    # Stations of each flag, in the order of the table
    warnings: dict[str, list[str]] = {}
    used = table[table["state"] == "used"]
    for name, flags in zip(used["station"], used["flags"], strict=True):
        for flag in flags.split():
            warnings.setdefault(flag, []).append(name)
    return StationSummary(files, warnings)


def station_table(
    spectra: Iterable[xr.Dataset],
    rejected: Iterable[Rejection],
    pairs: Mapping[str, int],
    amplitudes: Iterable[StationAmplitudes] = (),
) -> pd.DataFrame:
    """
    Return one row per station, sorted by name.

    Parameters
    ----------
    spectra : iterable of Dataset
        Of the stations with usable records, from :func:`per_obspy.station_spectra`; the motion is
        not needed.
    rejected : iterable of Rejection
        Rejections; those of files, services and pairs are passed over.
    pairs : mapping
        Station -> number of pairs for which its record is used.
    amplitudes : iterable of StationAmplitudes
        Stations of which only amplitudes are used.

    Returns
    -------
    DataFrame
        With the columns of ``COLUMNS``.
    """
    reasons = _reasons(rejected)
    rows = {name: _row(station, pairs) for name, station in _named(spectra).items()}
    rows = {station.name: _row_of_amplitudes(station) for station in amplitudes} | rows
    for name, texts in reasons.items():
        row = rows.setdefault(name, {"station": name, "state": "rejected", "pairs": 0})
        row["rejected"] = "; ".join(texts)
    # Text is empty where it is unknown, numbers are missing
    words = [name for name, column in COLUMNS.items() if column.dtype == "str"]
    unknown = dict.fromkeys(words, "")
    return pd.DataFrame([unknown | rows[name] for name in sorted(rows)], columns=list(COLUMNS))


def _named(spectra: Iterable[xr.Dataset]) -> dict[str, xr.Dataset]:
    """Return the Datasets by the name of their station."""
    return {str(station["station"].item()): station for station in spectra}


def _reasons(rejected: Iterable[Rejection]) -> dict[str, list[str]]:
    """Return the rejected records of each station, with reasons."""
    found: dict[str, list[str]] = {}
    for rejection in rejected:
        if rejection.kind not in ("station", "record"):
            continue
        # NET.STA, or NET.STA.LOC.CHA of a trace
        name = ".".join(rejection.name.split(".")[:2])
        rest = rejection.name[len(name) :].strip(".")
        text = "; ".join(rejection.reasons)
        found.setdefault(name, []).append(f"{rest}: {text}" if rest else text)
    return found


def _row(station: xr.Dataset, pairs: Mapping[str, int]) -> dict[str, Any]:
    """Return the row of a station with usable records; it serves pairs if its place is known."""
    # Place, and flags that every pair has
    name = str(station["station"].item())
    place = {key: float(station[key]) for key in ("longitude", "latitude", "elevation")}
    flags = record_flags(station)
    if station.attrs["horizontals"] == 1:
        flags.append(ONE_HORIZONTAL)
    if lacks_azimuths(station):
        flags.append("unknown_azimuths")
    return {
        "station": name,
        "state": "used" if np.isfinite(place["longitude"]) else "rejected",
        "flags": " ".join(flags),
        "pairs": pairs.get(name, 0),
        **place,
        "vs30": float(station["vs30"]),
        **_distances(station, place["longitude"], place["latitude"]),
        **_motion(station),
        **_corners(station),
        **_texts(station),
    }


def _row_of_amplitudes(station: StationAmplitudes) -> dict[str, Any]:
    """Return the row of a station without a record."""
    facts = ("longitude", "latitude", "vs30", "pga", "pgv", "warnings")
    return {
        "station": station.name,
        "state": "used",
        "flags": AMPLITUDES_ONLY,
        "pairs": 0,
        **{name: getattr(station, name) for name in facts},
        "shortest_usable_period": station.periods[0],
        "longest_usable_period": station.periods[-1],
        "components": " ".join(station.channels),
        "record_level": "amplitudes",
    }


def _texts(station: xr.Dataset) -> dict[str, str]:
    """Return the facts of a station that are text."""
    known = (
        *("site_class", "coordinates_source", "coordinates_conflict", "warnings", "notes"),
        *("instrument", "record_level", "source_files"),
    )
    texts = {name: str(station[name].item()) for name in known if name in station}
    return {**texts, "components": " ".join(map(str, station["channel"].values))}


def _distances(station: xr.Dataset, longitude: float, latitude: float) -> dict[str, float]:
    """Return the distances to epicentre and hypocentre, m, as far as these are known."""
    # Attributes of the hypocentre are there together or not at all
    if "hypocentre_longitude" not in station.attrs or not np.isfinite(longitude):
        return {}
    east, north = station.attrs["hypocentre_longitude"], station.attrs["hypocentre_latitude"]
    epicentral = float(great_circle(longitude, latitude, east, north))
    hypocentral = float(np.hypot(epicentral, station.attrs["hypocentre_depth"]))
    return {"epicentral_distance": epicentral, "hypocentral_distance": hypocentral}


def _motion(station: xr.Dataset) -> dict[str, float]:
    """Return the peaks of the horizontals and the usable periods."""
    count = int(station.attrs["horizontals"])
    # Horizontals come before the vertical
    found = {name: float(station[name][:count].max()) for name in ("pga", "pgv") if name in station}
    for name in ("shortest_usable_period", "longest_usable_period"):
        value = float(station[name])
        found[name] = value if np.isfinite(value) else np.nan
    return found


def _corners(station: xr.Dataset) -> dict[str, Any]:
    """Return the narrower corners of the horizontals and the reasons for them."""
    count = int(station.attrs["horizontals"])
    records = [json.loads(str(text)) for text in station["processing"].values[:count]]
    # The narrower band of both; records without corners have none
    found: dict[str, Any] = {}
    for name, narrower in (("highpass", max), ("lowpass", min)):
        corners = [float(record[name]) for record in records if name in record]
        found[name] = narrower(corners, default=np.nan)
        reasons = {str(record.get(f"{name}_source", "")) for record in records} - {""}
        found[f"{name}_source"] = "; ".join(sorted(reasons))
    return found


#: Column -> (unit, meaning), in the order of the table; every useful number of
#: ``stats.per_obspy``.
RECORD_COLUMNS: dict[str, tuple[str, str]] = {
    "id": ("", "network.station.location.channel"),
    "file": ("", "MiniSEED file with the processed samples, m/s2, pads included"),
    "source": ("", "file that was processed"),
    "start": ("", "time of the first sample, UTC, pads included"),
    "delta": ("s", "sampling interval"),
    "npts": ("1", "number of samples, pads included"),
    "latitude": ("degrees", "latitude of the station, north"),
    "longitude": ("degrees", "longitude of the station, east"),
    "elevation": ("m", "elevation of the station"),
    "coordinates_source": ("", "name of the table of stations, header or StationXML"),
    "coordinates_conflict": ("", "places of other sources more than 1 km away, with both"),
    "site_class": ("", "site class of the ground; empty if unknown"),
    "vs30": ("m/s", "mean shear-wave velocity of the upper 30 m; empty if unknown"),
    "sensor_azimuth": (
        "degrees",
        "azimuth of the sensor, clockwise from north; empty for verticals",
    ),
    "sensor_dip": ("degrees", "dip of the sensor, down from horizontal; up is -90"),
    "azimuth_source": ("", "source of sensor_azimuth: metadata, channel code or unknown"),
    "sensor_location": ("", "place of the sensor according to the header"),
    "simulated": ("", "True where the motion is simulated; empty for real records"),
    "conversion": ("", "conversion of counts to m/s2; empty for physical records"),
    "onset": ("", "time of the first wave, UTC"),
    "onset_source": ("", "source of the onset: pick, travel time or configuration"),
    "noise": ("s", "length of the noise window, from the first sample after the pad"),
    "signal_to_noise": ("1", "signal-to-noise ratio of the best octave, smoothed"),
    "clear_from": ("Hz", "lowest frequency at which the signal clears the noise"),
    "clear_to": ("Hz", "highest frequency at which the signal clears the noise"),
    "baseline": ("", "kind of baseline that was removed in addition to the mean"),
    "residual_velocity": (
        "m/s",
        "velocity that remains at the end of the shaking before any filter, as "
        "after a shift of the baseline",
    ),
    "certain_period": (
        "s",
        "natural period beyond which PER depends on when the baseline shifted; empty: no limit",
    ),
    "highpass": ("Hz", "high-pass corner, where the amplitude is 1/sqrt(2)"),
    "highpass_source": (
        "",
        "reason of the high-pass corner; shared: the other horizontal needs it",
    ),
    "own_highpass": ("Hz", "high-pass corner that this component alone would have"),
    "lowest_highpass": ("Hz", "lowest high-pass corner that noise and duration allow"),
    "lowest_highpass_source": ("", "whether noise or duration decides lowest_highpass"),
    "lowpass": ("Hz", "low-pass corner, where the amplitude is 1/sqrt(2)"),
    "lowpass_source": ("", "reason of the low-pass corner"),
    "own_lowpass": ("Hz", "low-pass corner that this component alone would have"),
    "order": (
        "1",
        "order n of the Butterworth filter; empty for records that were processed already",
    ),
    "taper": ("1", "fraction of the record that is tapered at each end"),
    "pad_before": ("s", "length of zeros before the record, filtered with it"),
    "pad_after": ("s", "length of zeros after the record, filtered with it"),
    "clock_shift": ("s", "shift of the samples to those of the other horizontal"),
    "shortest_period": ("s", "shortest usable natural period"),
    "longest_period": ("s", "longest usable natural period"),
    "failed_checks": (
        "",
        "names in the configuration of the checks that warn, separated by spaces",
    ),
    "record_flags": (
        "",
        "names of the flags that pairs with this record have, separated by spaces",
    ),
    "warnings": ("", "failed checks that do not reject, with figure and threshold"),
    "notes": ("", "failed checks without consequence, with figure and threshold"),
}


def processed_table(descriptions: Mapping[str, Iterable[Mapping[str, Any]]]) -> pd.DataFrame:
    """
    Return one row per record.

    Parameters
    ----------
    descriptions : mapping
        Name of the file -> descriptions of its traces, from
        ``records.processed_files.read_descriptions``.

    Returns
    -------
    DataFrame
        With the columns of ``RECORD_COLUMNS``; empty where a record has no value.
    """
    rows = [
        {**trace, **trace.get("coordinates", {}), **trace.get("per_obspy", {}), "file": name}
        for name, traces in descriptions.items()
        for trace in traces
    ]
    return pd.DataFrame(rows, columns=list(RECORD_COLUMNS))


def write_processed_table(
    descriptions: Mapping[str, Iterable[Mapping[str, Any]]], folder: Path
) -> None:
    """Write ``processed.csv`` and ``processed.columns.csv``; see :func:`processed_table`."""
    table = processed_table(descriptions)
    # Sampling intervals such as 1/300 s keep their digits
    rounded = rounded_table(table, own=[name for name in RECORD_COLUMNS if name != "delta"])
    write_csv(rounded, folder / "processed.csv")
    rows = [(name, *meaning) for name, meaning in RECORD_COLUMNS.items()]
    described = pd.DataFrame(rows, columns=["name", "unit", "meaning"])
    write_csv(described, folder / "processed.columns.csv")
