"""
Pairs near a station of which only amplitudes are known: motion between stations, without a record.

Spectral displacement at 5 % damping is interpolated between stations as PER is between records
(`per_obspy.screening.motion_field`): stations with a record contribute that of their larger
horizontal. Pairs are screened by it as by a ShakeMap, with the error of the estimate from SD
(`per_obspy.pounding.reliability`). Between the periods of a list SD is linear on logarithmic axes,
beyond them nothing is known. How far a spectrum is from that line is part of the deviation.
"""

from collections.abc import Iterable, Sequence
from itertools import pairwise
from typing import NamedTuple

import numpy as np
import pandas as pd
import xarray as xr

from per_obspy.checks import FloatArray
from per_obspy.config import Interpolation, Screening
from per_obspy.errors import Rejection
from per_obspy.records.station_list import StationAmplitudes, StationList
from per_obspy.screening.assignment import Sites, nearest_station, sites
from per_obspy.screening.motion_field import MotionField, fitted_field, great_circle, motion_at
from per_obspy.screening.shakemap import MapMotion, mapped_rows
from per_obspy.screening.site_motion import (
    Hypocentre,
    ln_at_reference_damping,
    places_of_pairs,
    with_source_distance,
)
from per_obspy.screening.values import BoolArray, Both, both, number, values

#: Distances within which a station of the list is one with a record, m: of any name, and of the
#: same station code. Agencies round coordinates, and name networks in different ways.
SAME_PLACE, SAME_CODE = 50.0, 2000.0

#: Largest ratio of neighbouring periods at which the motion is interpolated.
STEP = 1.15

#: Variance of ln SD between two given periods, per unit of ln period: that of a random walk which
#: both ends hold. Of 17 stations of Ridgecrest 2019, Maule 2010 and Kahramanmaras 2023, 0.32
#: is the deviation in the middle of 0.3 and 1 s and of 1 and 3 s (0.21 to 0.25 an eighth from an
#: end, where this law has 0.21).
SHAPE = 0.34


class AmplitudeField(NamedTuple):
    """
    Motion of stations without a record.

    Attributes
    ----------
    stations : tuple of StationAmplitudes
        Those without a record.
    field : MotionField
        ln SD in m at 5 % damping, of them and of the stations with a record.
    source : Hypocentre or None
        Hypocentre of the earthquake, if it is known.
    shape_std : ndarray
        Log-standard deviation by the shape of the spectrum between given periods, (n_periods,).
    intensities : int
        Number of reports of people that the list has besides.
    """

    stations: tuple[StationAmplitudes, ...]
    field: MotionField
    source: Hypocentre | None
    shape_std: FloatArray
    intensities: int


def amplitude_field(
    listed: StationList,
    source: str,
    records: Sequence[xr.Dataset],
    settings: Interpolation,
    hypocentre: Hypocentre | None,
) -> tuple[AmplitudeField | None, tuple[Rejection, ...]]:
    """
    Return the motion of the stations of a list that have no record.

    Parameters
    ----------
    listed : StationList
        Amplitudes of stations.
    source : str
        Name of the list in rejections.
    records : sequence of Dataset
        Stations with records and coordinates.
    settings : Interpolation
        For the motion between the stations.
    hypocentre : Hypocentre or None
        Of the earthquake.

    Returns
    -------
    field : AmplitudeField or None
        None if no station of the list can be used.
    rejected : tuple of Rejection
        Stations of the list that cannot be used, and those with a record, which wins.
    """
    alone, rejected = _without_record(listed, source, records)
    if not alone:
        return None, rejected
    given = np.unique(np.concatenate([station.periods for station in alone]))
    periods = _grid(given)
    # Stations of the list, and those with a record as far as they moved
    known = [*map(_of_amplitudes, alone), *map(_of_record, records)]
    # As PER between records
    moving = [one for one in known if np.isfinite(one.ln_sd).all()]
    longitude, latitude, vs30 = np.array([one.place for one in moving]).T
    located = with_source_distance(hypocentre, sites(longitude, latitude, vs30=vs30))
    ln_sd = [np.interp(np.log(periods), np.log(one.periods), one.ln_sd) for one in moving]
    usable = [one.usable for one in moving]
    field = fitted_field(located, ln_sd, usable, periods, settings)
    shape = _shape_std(given, periods)
    return AmplitudeField(tuple(alone), field, hypocentre, shape, listed.intensities), rejected


def _without_record(
    listed: StationList, source: str, records: Sequence[xr.Dataset]
) -> tuple[list[StationAmplitudes], tuple[Rejection, ...]]:
    """Return the stations of a list that have no record, and the rejections of the others."""
    alone, recorded = list[StationAmplitudes](), list[Rejection]()
    for station in listed.stations:
        record = _record_of(station, records)
        # A record is the better source
        if record is None:
            alone.append(station)
        else:
            reason = f"its amplitudes are not needed: {record} has a record there"
            recorded.append(Rejection("record", station.name, source, None, (reason,)))
    return alone, (*listed.rejected, *recorded)


def _record_of(station: StationAmplitudes, records: Iterable[xr.Dataset]) -> str | None:
    """Return the name of the station with a record that a station of a list is."""
    code = station.name.partition(".")[2]
    for dataset in records:
        name = str(dataset["station"].item())
        place = number(dataset, "longitude"), number(dataset, "latitude")
        # Networks are named in different ways
        apart = float(great_circle(station.longitude, station.latitude, *place))
        is_named = name.partition(".")[2] == code and apart <= SAME_CODE
        if name == station.name or is_named or apart <= SAME_PLACE:
            return name
    return None


class _KnownMotion(NamedTuple):
    """Motion of a station: longitude, latitude and Vs30, usable periods in s, ln SD in m."""

    place: tuple[float, float, float]
    usable: tuple[float, float]
    periods: FloatArray
    ln_sd: FloatArray


def _of_amplitudes(station: StationAmplitudes) -> _KnownMotion:
    """Return the motion of a station of a list."""
    return _KnownMotion(
        (station.longitude, station.latitude, station.vs30),
        (station.periods[0], station.periods[-1]),
        np.array(station.periods),
        np.log(station.displacements),
    )


def _of_record(station: xr.Dataset) -> _KnownMotion:
    """Return the motion of a station with a record: SD at 5 % damping of the larger horizontal."""
    horizontals = np.asarray(station["sd"][: int(station.attrs["horizontals"])])
    vs30 = number(station, "vs30") if "vs30" in station else np.nan
    # Usable periods as those of a list
    ends = (number(station, f"{end}_usable_period") for end in ("shortest", "longest"))
    shortest, longest = ends
    return _KnownMotion(
        (number(station, "longitude"), number(station, "latitude"), vs30),
        (shortest, longest),
        station["period"].to_numpy(),
        ln_at_reference_damping(station, horizontals.max(axis=0)),
    )


def _grid(given: FloatArray) -> FloatArray:
    """Return the given periods and enough between them, rising, s."""
    parts = [given[-1:]]
    for low, high in pairwise(given.tolist()):
        count = int(np.ceil(np.log(high / low) / np.log(STEP)))
        parts.append(np.geomspace(low, high, count + 1)[:-1])
    return np.sort(np.concatenate(parts))


def _shape_std(given: FloatArray, periods: FloatArray) -> FloatArray:
    """Return the deviation of ln SD between given periods: none at them, see ``SHAPE``."""
    above = np.clip(np.searchsorted(given, periods), 1, given.size - 1)
    low, high = np.log(periods / given[above - 1]), np.log(given[above] / periods)
    deviation: FloatArray = np.sqrt(SHAPE * np.maximum(low * high, 0.0) / (low + high))
    return deviation


class AmplitudesInReach(NamedTuple):
    """
    Nearest station whose amplitudes cover both periods of a pair, (n_pairs,).

    Attributes
    ----------
    distance : ndarray
        To the pair, m; infinite where the amplitudes of none cover its periods.
    reasons : list of str
        Why no station serves a pair; empty where one does.
    """

    distance: FloatArray
    reasons: list[str]


def amplitudes_in_reach(
    amplitudes: AmplitudeField, pairs: pd.DataFrame, reach: float
) -> AmplitudesInReach:
    """Find the nearest station with amplitudes at both periods of completed pairs."""
    east, north = values(pairs, "longitude"), values(pairs, "latitude")
    shortest, longest = np.sort(np.stack(both(pairs, "period")), axis=0)
    distance = np.full(east.size, np.inf)
    # Nearly all stations of a list have the same periods
    by_range: dict[tuple[float, float], list[StationAmplitudes]] = {}
    for station in amplitudes.stations:
        by_range.setdefault((station.periods[0], station.periods[-1]), []).append(station)
    # Stations whose periods hold both of the pair
    for (first, last), stations in by_range.items():
        apart = _to_nearest(stations, east, north)
        covered = (shortest >= first) & (longest <= last)
        distance = np.where(covered, np.minimum(distance, apart), distance)
    return AmplitudesInReach(distance, _reasons(distance, (shortest, longest), amplitudes, reach))


def _reasons(
    distance: FloatArray, periods: Both, amplitudes: AmplitudeField, reach: float
) -> list[str]:
    """Return why no amplitudes serve a pair, empty where they do."""
    span = amplitudes.field.periods[[0, -1]]
    facts = zip(distance.tolist(), *(period.tolist() for period in periods), strict=True)
    return [_reason(apart, (low, high), tuple(span), reach) for apart, low, high in facts]


def _to_nearest(
    stations: Sequence[StationAmplitudes], east: FloatArray, north: FloatArray
) -> FloatArray:
    """Return the distance of places, degrees, to the nearest station, m."""
    places = np.array([(station.longitude, station.latitude) for station in stations]).T
    return nearest_station(east, north, *places)[1]


def _reason(
    distance: float, periods: tuple[float, float], known: tuple[float, float], reach: float
) -> str:
    """Return why no amplitudes serve a pair, empty if they do."""
    # Near enough is no reason
    if np.isfinite(distance):
        near = f"nearest amplitudes are {distance:.0f} m away, beyond {reach:.0f} m"
        return near if distance > reach else ""
    span = f"{known[0]:g} s to {known[1]:g} s"
    return f"periods {periods[0]:g} s and {periods[1]:g} s are outside the amplitudes' {span}"


def served_by_amplitudes(
    in_reach: FloatArray, record_distance: FloatArray, screening: Screening
) -> BoolArray:
    """
    Return which pairs amplitudes serve, by the distances to them and to a record, m, (n_pairs,).

    A record within ``flag_distance`` serves its pairs, and one that is nearer than the amplitudes.
    """
    far = record_distance > screening.flag_distance
    return (in_reach <= screening.largest_distance) & far & (in_reach < record_distance)


def amplitude_rows(
    amplitudes: AmplitudeField, pairs: pd.DataFrame, screening: Screening
) -> pd.DataFrame:
    """Compute the rows of completed pairs by amplitudes of stations, not ranked."""
    places = with_source_distance(amplitudes.source, _without_classes(places_of_pairs(pairs)))
    periods = amplitudes.field.periods
    motions = [motion_at(amplitudes.field, places, period) for period in periods.tolist()]
    ln_sd = np.stack([motion.ln_median for motion in motions], axis=1)
    between = np.stack([motion.log_std for motion in motions], axis=1)
    log_std = np.hypot(between, amplitudes.shape_std)
    # By this motion as under a ShakeMap
    every = np.ones(len(pairs), dtype=bool)
    motion = MapMotion(periods, ln_sd, log_std)
    return mapped_rows(motion, pairs, screening, "amplitudes", {"amplitudes_only": every})


def _without_classes(places: Sites) -> Sites:
    """Return places whose site class is unknown, as that of the stations of a list is."""
    return sites(places.longitude, places.latitude, vs30=places.vs30)
