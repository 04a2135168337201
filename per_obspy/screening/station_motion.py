"""
Motion of stations: their records, their stored spectra, and the radii of pairs read from them.

Stations with few pairs each are joined: what needs no record is computed for all their pairs at
once, and the rest record by record (:func:`by_record`).

Every array of radii has the shape (n_pairs, n_azimuths): one azimuth where the pair's is known or
the station has a single horizontal, else every degree of the half circle, from which the pair's
worst is chosen by its demand. Both buildings are always driven along the same azimuth.
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import NamedTuple

import numpy as np
import xarray as xr
from numpy.typing import NDArray

from per_obspy.checks import FloatArray
from per_obspy.pounding.correlation import correlation_along, sample_products
from per_obspy.pounding.linearization import NARROW, record_bandwidth
from per_obspy.screening.values import (
    Both,
    IndexArray,
    Table,
    components,
    number,
    oscillators,
    values,
)
from per_obspy.spectra.azimuthal import (
    EVERY_AZIMUTH,
    azimuthal_per_spectrum,
    azimuthal_sd_spectrum,
)
from per_obspy.spectra.elastic import azimuth_maxima

#: Dampings are compared on a logarithmic scale; below this one they count as it.
SMALLEST_DAMPING = 1e-3


class LogSpectra(NamedTuple):
    """
    Stored spectra on logarithmic axes.

    Attributes
    ----------
    periods, dampings : (n_periods,), (n_dampings,) ndarray
        Logarithms of periods in s and of dampings as fractions of critical.
    radii : (n_azimuths, n_dampings, n_periods) ndarray
        Logarithms of PER or SD in m.
    """

    periods: FloatArray
    dampings: FloatArray
    radii: FloatArray


def log_oscillator(table: Table, i: int) -> Both:
    """Return ln period and ln damping of building i."""
    return log_period_and_damping(values(table, f"period_{i}"), values(table, f"damping_{i}"))


def log_period_and_damping(period: FloatArray, damping: FloatArray) -> Both:
    """Return ln period and ln damping, in s and fractions of critical."""
    return np.log(period), np.log(np.maximum(damping, SMALLEST_DAMPING))


def stored_log(
    spectra: LogSpectra, row: IndexArray, log_period: FloatArray, log_damping: FloatArray
) -> FloatArray:
    """
    Interpolate stored logarithms at rows of azimuths, ln period and ln damping.

    Arrays broadcast; the result is ln PER or ln SD in m, bilinear on the logarithmic axes and
    constant beyond the grid.
    """
    periods, dampings, radii = spectra
    # cell of the grid and position in it, along either axis
    column, period_share = _lower_neighbour(periods, log_period)
    plane, damping_share = _lower_neighbour(dampings, log_damping)
    # places of its corners in the stored row after row; a grid of one has one
    corner = (row * dampings.size + plane) * periods.size + column
    right, above = min(periods.size - 1, 1), min(dampings.size - 1, 1) * periods.size
    # along the period at the damping below and at that above, then from one to the other
    flat, rest = radii.ravel(), 1 - period_share
    lower = rest * flat.take(corner) + period_share * flat.take(corner + right)
    corner += above
    upper = rest * flat.take(corner) + period_share * flat.take(corner + right)
    stored: FloatArray = (1 - damping_share) * lower + damping_share * upper
    return stored


def _lower_neighbour(grid: FloatArray, points: FloatArray) -> tuple[IndexArray, FloatArray]:
    """Return the lower neighbour on a grid, and the fraction towards the next one, 0 to 1."""
    if grid.size == 1:
        return np.zeros(points.shape, dtype=np.intp), np.zeros(points.shape)
    lower = np.clip(np.searchsorted(grid, points) - 1, 0, grid.size - 2)
    return lower, np.clip((points - grid[lower]) / (grid[lower + 1] - grid[lower]), 0.0, 1.0)


@dataclass(frozen=True, eq=False)
class Record:
    """
    Record of one station.

    Attributes
    ----------
    north, east : (n_samples,) ndarray
        Ground acceleration, m/s². The record of a single horizontal is ``north``, to be used at
        azimuth 0; ``east`` is 0 then.
    dt : float
        Sampling interval, s.
    usable_periods : tuple of float
        Shortest and longest usable period, s.
    """

    north: FloatArray
    east: FloatArray
    dt: float
    usable_periods: tuple[float, float]

    @property
    def components(self) -> tuple[FloatArray, FloatArray, float]:
        """Accelerations to the north and east, m/s², and the sampling interval, s."""
        return self.north, self.east, self.dt

    @property
    def horizontal(self) -> FloatArray:
        """Accelerations to the north and east, (2, n_samples), m/s²."""
        return np.stack([self.north, self.east])

    @cached_property
    def is_narrow(self) -> bool:
        """Whether the power lies in a narrow band."""
        return record_bandwidth(*self.components) < NARROW

    @cached_property
    def products(self) -> Both:
        """Sums of products of samples, from which correlations follow."""
        return sample_products(self.north, self.east)


class StationMotion(NamedTuple):
    """
    Records and stored spectra of one station, or of several of equal grids and two horizontals.

    Attributes
    ----------
    records : tuple of Record
        One per station; the column ``station_index`` of pairs at several stations is the place of
        theirs.
    horizontals : int
        Number of horizontal sensors, 1 or 2.
    sensor_azimuth : float
        Of a single horizontal, degrees clockwise from north; NaN if unknown, or of two horizontals.
    azimuths : (n_azimuths,) ndarray
        Of the stored spectra, degrees, evenly spaced over the half circle; 0 of one horizontal.
    per, sd : LogSpectra
        Logarithms of the stored PER and SD in m, by station and azimuth.
    per_rotd50 : LogSpectra
        Logarithm of the stored median PER over the azimuths, in a row per station; of one
        horizontal its PER.
    """

    records: tuple[Record, ...]
    horizontals: int
    sensor_azimuth: float
    azimuths: FloatArray
    per: LogSpectra
    sd: LogSpectra
    per_rotd50: LogSpectra

    @property
    def grid(self) -> tuple[bytes, ...]:
        """What stations must share to be joined."""
        axes = self.azimuths, self.per.periods, self.per.dampings
        return tuple(axis.tobytes() for axis in axes)


def joined_stations(stations: Sequence[StationMotion]) -> StationMotion:
    """Return stations of equal grids and two horizontals as one, or the only one as it is."""
    first, *others = stations
    if not others:
        return first
    # rows of one station after those of the one before
    spectra = {}
    for name in ("per", "sd", "per_rotd50"):
        radii = np.concatenate([getattr(station, name).radii for station in stations])
        spectra[name] = getattr(first, name)._replace(radii=radii)
    return first._replace(records=tuple(one.records[0] for one in stations), **spectra)


def record_number(station: StationMotion, pairs: Table) -> IndexArray:
    """Return the place of the record of each pair, (n_pairs,)."""
    if len(station.records) == 1:
        return np.zeros(len(pairs[next(iter(pairs))]), dtype=np.intp)
    return np.asarray(pairs["station_index"]).astype(np.intp)


def by_record(
    station: StationMotion,
    pairs: Table,
    compute: Callable[..., FloatArray],
    columns: Sequence[FloatArray],
) -> FloatArray:
    """
    Compute what needs the record of pairs, record by record.

    ``compute`` takes a record and the ``columns``, (n_pairs, ...), of its pairs; the second axis of
    its result is that of the pairs.
    """
    if len(station.records) == 1:
        return compute(station.records[0], *columns)
    # each with its own rows
    number, parts = record_number(station, pairs), list[tuple[IndexArray, FloatArray]]()
    for one in np.unique(number).tolist():
        rows = np.flatnonzero(number == one)
        some = (column[rows] for column in columns)
        parts.append((rows, compute(station.records[one], *some)))
    first = parts[0][1]
    whole = np.empty((len(first), number.size, *first.shape[2:]))
    for rows, part in parts:
        whole[:, rows] = part
    return whole


def station_motion(station: xr.Dataset) -> StationMotion:
    """Decode the Dataset of one station, once for all its pairs."""
    horizontals = station.sizes["horizontal"]
    # the azimuth of the sensor is used of a single horizontal only
    sensor_azimuth = float(station["horizontal_azimuth"][0]) if horizontals == 1 else np.nan
    shortest = number(station, "shortest_usable_period")
    longest = number(station, "longest_usable_period")
    azimuths = station["azimuth"].to_numpy() if "azimuth" in station else np.zeros(1)
    return StationMotion(
        records=(Record(*components(station), (shortest, longest)),),
        horizontals=horizontals,
        sensor_azimuth=sensor_azimuth,
        azimuths=azimuths,
        per=_by_azimuth(station, "per"),
        sd=_by_azimuth(station, "sd"),
        per_rotd50=_median_over_azimuths(station),
    )


def nearest_azimuth(station: StationMotion, table: Table) -> IndexArray:
    """Return the row of the station's stored azimuth nearest to ``azimuth_used`` of each pair."""
    count = station.azimuths.size
    azimuth = np.nan_to_num(values(table, "azimuth_used")) % 180.0
    nearest: IndexArray = np.rint(azimuth / (180.0 / count)).astype(np.intp) % count
    return record_number(station, table) * count + nearest


def _by_azimuth(station: xr.Dataset, name: str) -> LogSpectra:
    """Return the stored PER (``per``) or SD (``sd``) by azimuth; one horizontal has one azimuth."""
    by_azimuth = f"{name}_azimuthal"
    if by_azimuth in station:
        return _log_spectra(station, station[by_azimuth].to_numpy())
    return _log_spectra(station, station[name].to_numpy()[:1])


def _median_over_azimuths(station: xr.Dataset) -> LogSpectra:
    """Return the stored RotD50 of PER in one row, or the PER of the only horizontal."""
    if "per_rotd50" in station:
        return _log_spectra(station, station["per_rotd50"].to_numpy()[None])
    first = _by_azimuth(station, "per")
    return first._replace(radii=first.radii[:1])


def _log_spectra(station: xr.Dataset, stored: NDArray[np.float32]) -> LogSpectra:
    """Return stored radii, (n_rows, n_dampings, n_periods), on logarithmic axes."""
    # spectra are stored as float32: a radius of 0 counts as the smallest of these
    radii = np.log(np.maximum(stored.astype(np.float64), np.finfo(np.float32).tiny))
    dampings = np.log(np.maximum(station["damping"].to_numpy(), SMALLEST_DAMPING))
    return LogSpectra(np.log(station["period"].to_numpy()), dampings, np.ascontiguousarray(radii))


class PairMotion(NamedTuple):
    """
    Response of pairs of buildings to a record, (n_pairs, n_azimuths).

    Attributes
    ----------
    azimuth : ndarray
        Of the ground motion, degrees clockwise from north; NaN where the only sensor's azimuth is
        unknown.
    per, sd : pairs of ndarray
        Pseudo energy radius and spectral displacement of the two oscillators, m.
    correlation : ndarray
        Of the two responses over all time, dimensionless.
    """

    azimuth: FloatArray
    per: Both
    sd: Both
    correlation: FloatArray


def motion_along_azimuths(station: StationMotion, pairs: Table, azimuth: FloatArray) -> PairMotion:
    """Compute the motion along one azimuth per pair, (n_pairs,), degrees clockwise from north."""
    # every pair has one azimuth: arrays (n_pairs, 1)
    column = azimuth[:, None]
    found = by_record(station, pairs, _along_azimuths, (*oscillators(pairs), column))
    per_1, sd_1, per_2, sd_2, correlation = found
    return PairMotion(column, (per_1, per_2), (sd_1, sd_2), correlation)


def _along_azimuths(
    record: Record,
    period_1: FloatArray,
    damping_1: FloatArray,
    period_2: FloatArray,
    damping_2: FloatArray,
    azimuth: FloatArray,
) -> FloatArray:
    """Return PER and SD of buildings 1, of buildings 2, and correlation, (5, n_pairs, 1)."""
    along = azimuth[:, 0]
    first, second = (period_1, damping_1, along), (period_2, damping_2, along)
    # one call for both buildings, whose results are parted again
    distinct, place = _distinct(np.concatenate([first, second], axis=1))
    radii = np.stack(azimuth_maxima(*record.components, *distinct))[:, place]
    rows = radii.reshape(2, 2, -1).swapaxes(0, 1).reshape(4, -1, 1)
    pairs = period_1, damping_1, period_2, damping_2
    correlation = correlation_along(record.products, record.dt, *pairs, azimuth)
    return np.concatenate([rows, correlation[None]])


def _distinct(buildings: FloatArray) -> tuple[FloatArray, IndexArray]:
    """Return distinct columns, and the place of each among them: most have two neighbours."""
    # equal ones are next to each other in this order
    order = np.lexsort(buildings)
    ordered = buildings[:, order]
    is_new = np.ones(order.size, dtype=bool)
    is_new[1:] = (ordered[:, 1:] != ordered[:, :-1]).any(axis=0)
    place = np.empty(order.size, dtype=np.intp)
    place[order] = np.cumsum(is_new) - 1
    return ordered[:, is_new], place


def motion_found(table: Table) -> PairMotion:
    """Return the motion along the azimuth used of pairs whose demand was computed."""
    return PairMotion(
        azimuth=values(table, "azimuth_used")[:, None],
        per=(values(table, "per_1")[:, None], values(table, "per_2")[:, None]),
        sd=(values(table, "sd_1")[:, None], values(table, "sd_2")[:, None]),
        correlation=values(table, "correlation_record")[:, None],
    )


def motion_of_one_horizontal(station: StationMotion, pairs: Table) -> PairMotion:
    """Compute the motion along the only horizontal of a station, whatever the pairs' azimuths."""
    motion = motion_along_azimuths(station, pairs, np.zeros(len(pairs["azimuth"])))
    return motion._replace(azimuth=np.full_like(motion.azimuth, station.sensor_azimuth))


def motion_along_every_azimuth(station: StationMotion, pairs: Table) -> PairMotion:
    """Compute the motion along every degree of the half circle, for pairs of unknown azimuth."""
    found = by_record(station, pairs, _along_every_azimuth, oscillators(pairs))
    per_1, sd_1, per_2, sd_2, correlation = found
    azimuth = np.broadcast_to(EVERY_AZIMUTH, correlation.shape)
    return PairMotion(azimuth, (per_1, per_2), (sd_1, sd_2), correlation)


def _along_every_azimuth(
    record: Record,
    period_1: FloatArray,
    damping_1: FloatArray,
    period_2: FloatArray,
    damping_2: FloatArray,
) -> FloatArray:
    """Return the same as :func:`_along_azimuths`, (5, n_pairs, 180)."""
    radii = *_every_radius(record, period_1, damping_1), *_every_radius(record, period_2, damping_2)
    pairs = period_1, damping_1, period_2, damping_2
    correlation = correlation_along(record.products, record.dt, *pairs, EVERY_AZIMUTH[None, :])
    return np.stack([*radii, correlation])


def _every_radius(record: Record, periods: FloatArray, dampings: FloatArray) -> Both:
    """Return PER and SD along every azimuth, (n, 180); equal oscillators are computed once."""
    per, sd = np.empty((2, periods.size, EVERY_AZIMUTH.size))
    for damping in np.unique(dampings):
        damped = np.flatnonzero(dampings == damping)
        # one spectrum of the distinct periods serves all oscillators of this damping
        distinct, position = np.unique(periods[damped], return_inverse=True)
        spectrum = *record.components, distinct, damping, EVERY_AZIMUTH
        per[damped] = azimuthal_per_spectrum(*spectrum)[position]
        sd[damped] = azimuthal_sd_spectrum(*spectrum)[position]
    return per, sd
