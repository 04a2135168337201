"""Spectra of all stations of a Stream in one Dataset."""

from collections import defaultdict
from collections.abc import Sequence

import xarray as xr
from obspy import Stream, Trace

from per_obspy.checks import ArrayLike
from per_obspy.constants import STORED_AZIMUTH_STEP, STORED_DAMPINGS
from per_obspy.spectra.station import station_spectra
from per_obspy.spectra.storage import region


def stream_spectra(
    stream: Stream | Trace,
    periods: ArrayLike | None = None,
    dampings: Sequence[float] = STORED_DAMPINGS,
    azimuth_step: int = STORED_AZIMUTH_STEP,
) -> xr.Dataset:
    """
    Compute the spectra of every station of a Stream.

    Parameters
    ----------
    stream : obspy Stream or Trace
        Processed acceleration of any number of stations, m/s², as :func:`per_obspy.process` returns
        it.
    periods, dampings, azimuth_step
        As of :func:`per_obspy.station_spectra`.

    Returns
    -------
    Dataset
        The spectra of ``spectra.nc``, without the processed motion, along ``station``: the codes of
        network and station, sorted. Components that a station lacks are missing values.

    Raises
    ------
    RecordRejected
        If a station has no horizontal, no acceleration in m/s², or horizontals that do not match.
    ValueError
        If the stream is empty, or a period, damping or step is out of range.

    Examples
    --------
    One component of a constant acceleration: an undamped oscillator swings to twice the static
    displacement.

    >>> import numpy as np
    >>> from obspy import Trace
    >>> header = {"network": "XX", "station": "A", "channel": "HNE", "units": "m/s2"}
    >>> trace = Trace(np.full(400, 9.81), {**header, "delta": 0.005})
    >>> spectra = stream_spectra(trace, periods=[1.0], dampings=[0.0])
    >>> spectra["per"].sel(station="XX.A").values.ravel().round(6)
    array([0.49698], dtype=float32)
    """
    # Stations by their codes, then all on one axis
    stations: dict[tuple[str, str], Stream] = defaultdict(Stream)
    for trace in [stream] if isinstance(stream, Trace) else stream:
        stations[trace.stats.network, trace.stats.station].append(trace)
    if not stations:
        raise ValueError("stream has no traces")
    joined = region(
        station_spectra(traces, periods, dampings, azimuth_step) for traces in stations.values()
    )
    return joined.assign_coords(station=joined["station_name"].to_numpy())
