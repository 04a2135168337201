"""
Spectra on disk: one netCDF file per station, and one file for the region.

A station file contains everything of a station, its processed motion included. ``spectra.nc`` of a
region contains the spectra of all stations along the dimension ``station`` without the motion.
"""

from collections import defaultdict
from collections.abc import Hashable, Iterable, Sequence
from pathlib import Path

import netCDF4
import numpy as np
import xarray as xr
from obspy import Stream, Trace

from per_obspy.checks import ArrayLike
from per_obspy.constants import STORED_AZIMUTH_STEP, STORED_DAMPINGS
from per_obspy.errors import CatalogError
from per_obspy.files import written_whole
from per_obspy.spectra.station import station_spectra

#: Variables of the motion, sample by sample, which only the station files contain.
MOTION = ("acceleration", "horizontal_azimuth", "sampling_interval")

#: Values from which on a variable takes less space compressed.
FEWEST_COMPRESSED = 1000


def write_spectra(dataset: xr.Dataset, path: Path) -> None:
    """Write a Dataset of spectra as compressed netCDF-4; the file appears whole or not at all."""
    # As CF asks for: coordinates that are no axes are named by each variable that has them
    coordinates = set(dataset.coords)
    places = {
        str(name): {*dataset.variables[name].dims}
        for name in sorted(coordinates - set(dataset.dims), key=str)
    }
    with written_whole(path) as part, netCDF4.Dataset(part, "w") as file:
        file.setncatts(dataset.attrs)
        for axis, size in dataset.sizes.items():
            file.createDimension(str(axis), size)
        for name in [*dataset.data_vars, *dataset.coords]:
            _write_variable(
                file, str(name), dataset.variables[name], None if name in coordinates else places
            )


def _write_variable(
    file: netCDF4.Dataset,
    name: str,
    variable: xr.Variable,
    places: dict[str, set[Hashable]] | None,
) -> None:
    """Write a variable with its attributes; data name those of the places whose axes they have."""
    is_text = variable.dtype.kind not in "fi"
    stored = file.createVariable(
        name,
        str if is_text else variable.dtype,
        [str(axis) for axis in variable.dims],
        fill_value=np.nan if variable.dtype.kind == "f" and places is not None else None,
        # Processed samples take as much space compressed, and twice the time
        zlib=variable.size >= FEWEST_COMPRESSED and name != "acceleration",
    )
    own = [place for place, axes in (places or {}).items() if axes <= {*variable.dims}]
    stored.setncatts(variable.attrs | ({"coordinates": " ".join(own)} if own else {}))
    stored[...] = variable.values.astype(object) if is_text else variable.values


def read_spectra(path: Path, content: bytes | None = None) -> xr.Dataset:
    """
    Read a Dataset that :func:`write_spectra` wrote, identical to it, from a file or its bytes.

    A file that is missing, damaged or of another kind is a `CatalogError`.
    """
    # A name that exists would be opened too
    source = path if content is None else f"{path.name} in memory"
    try:
        with netCDF4.Dataset(source, memory=content) as file:
            file.set_auto_maskandscale(False)
            variables, places = {}, set[str]()
            for name, stored in file.variables.items():
                attributes = dict(stored.__dict__)
                attributes.pop("_FillValue", None)
                places |= {*attributes.pop("coordinates", "").split()}
                values = np.asarray(stored[...], dtype=str if stored.dtype is str else None)
                variables[name] = (stored.dimensions, values, attributes)
            attributes = dict(file.__dict__)
    # Damaged parts are errors of the netCDF library
    except (OSError, RuntimeError, ValueError) as error:
        reason = getattr(error, "strerror", None) or error
        raise CatalogError(str(path), f"cannot be read as netCDF: {reason}") from error
    if "per" not in variables:
        raise CatalogError(str(path), f"has no variable 'per', only {sorted(variables)}")
    return xr.Dataset(variables, attrs=attributes).set_coords(places)


def region(stations: Iterable[xr.Dataset]) -> xr.Dataset:
    """
    Join the spectra of several stations along ``station``, sorted by name, without the motion.

    Components that a station lacks are missing values. Periods, dampings and azimuths must be
    those of all stations, else ``ValueError``.
    """
    ordered = sorted(stations, key=lambda station: str(station["station"].item()))
    spectra = [_for_region(station) for station in ordered]
    joined = xr.concat(
        spectra,
        dim="station",
        join="outer",
        data_vars="all",
        coords="all",
        compat="equals",
        fill_value={"channel": "", "processing": ""},
        combine_attrs="drop_conflicts",
    )
    for axis in ("period", "damping", "azimuth"):
        # An outer join of different axes is longer than each of them
        longest = max(station.sizes.get(axis, 0) for station in spectra)
        if axis in joined.sizes and joined.sizes[axis] != longest:
            raise ValueError(
                f"{axis} differs between the stations: the spectra are not on one grid"
            )
    named = _unlabelled(joined).assign_attrs(
        title="Pseudo energy radius spectra of a region", id="region"
    )
    # Simulated motion of one station must be seen in the region
    simulated = any(station.attrs.get("simulated") == "true" for station in spectra)
    return named.assign_attrs(_box(named), simulated=str(simulated).lower())


def without_motion(station: xr.Dataset) -> xr.Dataset:
    """Return the Dataset of a station without its motion, sample by sample; the spectra stay."""
    return station.drop_vars([*MOTION, "time"], errors="ignore")


def _for_region(station: xr.Dataset) -> xr.Dataset:
    """Return the spectra, with names and numbers that differ by station as variables."""
    spectra = without_motion(station).rename(station="station_name").drop_encoding()
    # Components are joined by their names
    spectra = spectra.assign_coords(component=spectra["component_name"].values)
    spectra = spectra.drop_vars("component_name")
    horizontals = (
        (),
        int(station.attrs["horizontals"]),
        {"units": "1", "long_name": "number of horizontal components"},
    )
    return spectra.assign(horizontals=horizontals)


def _unlabelled(joined: xr.Dataset) -> xr.Dataset:
    """Return the components' names as CF wants them: text along a dimension without coordinate."""
    names = (
        "component",
        joined["component"].values,
        {"long_name": "horizontal_1, horizontal_2, vertical"},
    )
    return joined.drop_vars("component").assign_coords(component_name=names)


def _box(region: xr.Dataset) -> dict[str, float]:
    """Return the smallest box of coordinates as ACDD names it; empty without coordinates."""
    known = region[["latitude", "longitude"]].dropna("station")
    if not known.sizes["station"]:
        return {}
    # Plain limits, also of a region across the date line
    box = {}
    for name in ("latitude", "longitude"):
        box[f"geospatial_{name[:3]}_min"] = float(known[name].min())
        box[f"geospatial_{name[:3]}_max"] = float(known[name].max())
    return box


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
