"""Table of processed records: corners, windows and their reasons, one row per record."""

from collections.abc import Iterable, Mapping
from pathlib import Path
from typing import Any

import pandas as pd

from per_obspy.tables.rounding import rounded_table
from per_obspy.tables.table_files import write_csv

#: Column -> (unit, meaning), in the order of the table; every useful number of
#: ``stats.per_obspy``.
COLUMNS: dict[str, tuple[str, str]] = {
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
        With the columns of ``COLUMNS``; empty where a record has no value.
    """
    rows = [
        {**trace, **trace.get("coordinates", {}), **trace.get("per_obspy", {}), "file": name}
        for name, traces in descriptions.items()
        for trace in traces
    ]
    return pd.DataFrame(rows, columns=list(COLUMNS))


def write_processed_table(
    descriptions: Mapping[str, Iterable[Mapping[str, Any]]], folder: Path
) -> None:
    """Write ``processed.csv`` and ``processed.columns.csv``; see :func:`processed_table`."""
    table = processed_table(descriptions)
    # Sampling intervals such as 1/300 s keep their digits
    rounded = rounded_table(table, own=[name for name in COLUMNS if name != "delta"])
    write_csv(rounded, folder / "processed.csv")
    rows = [(name, *meaning) for name, meaning in COLUMNS.items()]
    described = pd.DataFrame(rows, columns=["name", "unit", "meaning"])
    write_csv(described, folder / "processed.columns.csv")
