"""
Each station against the others and the earthquake: peaks, places, and repeated records.

What is wrong with one station shows beside the others only: units that make a record 100 times too
large, exchanged coordinates, the samples of another station under a new code.
"""

from collections.abc import Sequence
from itertools import product
from typing import NamedTuple

import numpy as np
import xarray as xr
from scipy.spatial import cKDTree

from per_obspy.checks import FloatArray
from per_obspy.constants import REFERENCE_DAMPING
from per_obspy.screening.amplitudes import (
    FLAGGED,
    MEASURES,
    REJECTED,
    Earthquake,
    Peaks,
    peak_deviations,
    peak_sentence,
)
from per_obspy.screening.assignment import site_class_of
from per_obspy.screening.motion_field import great_circle
from per_obspy.screening.values import BoolArray, number

#: A place is wrong if it is farther from the middle of the stations than this, m, and than so many
#: times their median distance, and another reading of its coordinates lies within this distance, m,
#: or so many times the median. Reasoned.
FAR, FAR_IN_MEDIANS = 300_000.0, 5.0
AS_NEAR, AS_NEAR_IN_MEDIANS = 100_000.0, 2.0

#: Stations from which they have a middle that two wrong ones cannot move; fewer have the epicentre.
PLACED = 5

#: Coordinates of an empty field are closer to 0, 0 than this, degrees.
EMPTY_FIELD = 1e-4

#: Largest difference of ln PER, about its mean over periods (s), of two components with the same
#: samples, and the fewest periods that say something. Real components differ by 0.29 at
#: least (3 400 couples of five earthquakes); pads and corners of a copy change it by less.
SAME_MOTION, MOTION_PERIODS, FEWEST_PERIODS = 0.03, (0.1, 2.0), 10

#: Stations this near to each other may share an instrument, m.
ONE_PLACE = 1000.0


class Comparison(NamedTuple):
    """
    What is said of one station.

    Attributes
    ----------
    flags : tuple of str
        ``implausible_amplitude``, ``implausible_place``, ``repeated_record``.
    warnings : tuple of str
        A sentence for each of them.
    rejected : tuple of str
        Those of the sentences that reject the station, unless its name is trusted.
    """

    flags: tuple[str, ...] = ()
    warnings: tuple[str, ...] = ()
    rejected: tuple[str, ...] = ()


def compare_stations(
    stations: Sequence[xr.Dataset], earthquake: Earthquake
) -> dict[str, Comparison]:
    """
    Compare the stations of an earthquake with each other; their motion is not needed.

    Returns what is said of a station, by its name; of others nothing is said.
    """
    names = [str(station["station"].item()) for station in stations]
    peaks = _peaks(stations)
    places = _wrong_places(peaks, earthquake)
    # A station in a wrong place is no neighbour, and has no distance
    longitude = peaks.longitude.copy()
    longitude[list(places)] = np.nan
    amplitudes = _wrong_peaks(peaks._replace(longitude=longitude), earthquake)
    repeated = _repeated(stations, names, peaks)
    # All that is said of a station
    said = dict[str, Comparison]()
    for i in sorted({*places, *amplitudes, *repeated}):
        parts = [part[i] for part in (amplitudes, places, repeated) if i in part]
        said[names[i]] = Comparison(*(sum(texts, ()) for texts in zip(*parts, strict=True)))
    return said


def _peaks(stations: Sequence[xr.Dataset]) -> Peaks:
    # The larger horizontal, which stations.csv shows; horizontals come before the vertical
    measured = [
        [
            float(station[name][: int(station.attrs["horizontals"])].max())
            if name in station
            else np.nan
            for station in stations
        ]
        for name in MEASURES
    ]
    longitude, latitude, vs30 = (
        np.array([number(station, name) for station in stations])
        for name in ("longitude", "latitude", "vs30")
    )
    classes = np.array([site_class_of(station) for station in stations], dtype=object)
    return Peaks(longitude, latitude, vs30, classes, *map(np.array, measured))


def _wrong_peaks(peaks: Peaks, earthquake: Earthquake) -> dict[int, Comparison]:
    """Return what is said of stations whose peaks are implausible, by the worse of both."""
    found = {name: peak_deviations(name, peaks, earthquake) for name in MEASURES}
    size = np.array([np.abs(one.deviations) for one in found.values()])
    names, said = list(found), dict[int, Comparison]()
    # The measure with the larger deviation
    for i in np.flatnonzero(size.max(axis=0) > FLAGGED).tolist():
        name = names[size[:, i].argmax()]
        sentence = peak_sentence(name, getattr(peaks, name)[i], found[name], i, earthquake)
        rejected = (sentence,) if size[:, i].max() > REJECTED else ()
        said[i] = Comparison(("implausible_amplitude",), (sentence,), rejected)
    return said


def _wrong_places(peaks: Peaks, earthquake: Earthquake) -> dict[int, Comparison]:
    """Return what is said of stations at 0, 0 and with exchanged coordinates or lost signs."""
    is_empty = np.maximum(np.abs(peaks.longitude), np.abs(peaks.latitude)) < EMPTY_FIELD
    said = dict.fromkeys(np.flatnonzero(is_empty).tolist(), EMPTY)
    return said | _misread(peaks, np.isfinite(peaks.longitude) & ~is_empty, earthquake)


def _misread(peaks: Peaks, placed: BoolArray, earthquake: Earthquake) -> dict[int, Comparison]:
    """Return what is said of placed stations far away whose coordinates read otherwise are near."""
    # Stations have a middle, few of them have that of the earthquake
    east, north = peaks.longitude, peaks.latitude
    middle, typical = _middle(east[placed], north[placed], earthquake)
    has_middle = int(np.count_nonzero(placed)) >= PLACED
    origin = "the middle of the stations" if has_middle else "the epicentre"
    far, said = great_circle(*middle, east, north), dict[int, Comparison]()
    for i in np.flatnonzero(placed & (far > max(FAR, FAR_IN_MEDIANS * typical))).tolist():
        here = f"its place {north[i]:.4f}, {east[i]:.4f} is {far[i] / 1000:.0f} km from {origin}"
        # An epicentre alone may be wrong itself
        if reading := _other_reading(float(east[i]), float(north[i]), middle, typical):
            said[i] = _wrong_place(f"{here}, {reading}", has_middle)
    return said


def _wrong_place(sentence: str, rejects: bool = True) -> Comparison:
    """Return what is said of a station in a wrong place."""
    return Comparison(("implausible_place",), (sentence,), (sentence,) if rejects else ())


#: What is said of a station at 0, 0.
EMPTY = _wrong_place("coordinates 0, 0 are an empty field, not a place")


def _middle(
    longitude: FloatArray, latitude: FloatArray, earthquake: Earthquake
) -> tuple[tuple[float, float], float]:
    """Return the middle of the stations, of few ones the epicentre, and their median distance."""
    if longitude.size < PLACED:
        return (earthquake.longitude, earthquake.latitude), 0.0
    # The station whose median distance to the others is least
    places = zip(longitude.tolist(), latitude.tolist(), strict=True)
    medians = {place: np.median(great_circle(*place, longitude, latitude)) for place in places}
    middle = min(medians, key=medians.__getitem__)
    return middle, float(medians[middle])


def _other_reading(
    longitude: float, latitude: float, middle: tuple[float, float], typical: float
) -> str:
    """Return how coordinates should be read to be near the middle; empty if in no way."""
    near = max(AS_NEAR, AS_NEAR_IN_MEDIANS * typical)
    for exchanged, sign, other_sign in product((False, True), (1.0, -1.0), (1.0, -1.0)):
        first, second = (latitude, longitude) if exchanged else (longitude, latitude)
        east, north = sign * first, other_sign * second
        # Exchanged longitudes beyond 90 degrees are no latitudes
        distance = float(great_circle(*middle, east, north))
        if abs(north) > 90.0 or distance > near:
            continue
        words = ["an exchange"] if exchanged else []
        words += ["a lost sign"] if min(sign, other_sign) < 0 else []
        # As a user would write it
        there = f"{north:.4f}, {east:.4f} would be {distance / 1000:.0f} km from it"
        return f"{there}, as by {' and '.join(words)}"
    return ""


def _repeated(
    stations: Sequence[xr.Dataset], names: Sequence[str], peaks: Peaks
) -> dict[int, Comparison]:
    """Return what is said of stations of different places with the same motion, up to a factor."""
    motions, owner = _motions(stations)
    others: dict[int, set[int]] = {}
    # Couples of components that are alike at every period
    for couple in cKDTree(motions).query_pairs(SAME_MOTION, p=np.inf) if owner else ():
        i, j = (owner[component] for component in couple)
        if i != j and not _at_one_place(peaks, i, j):
            others.setdefault(i, set()).add(j)
            others.setdefault(j, set()).add(i)
    # Which of them is the copy is not known
    said = {}
    for i, alike in sorted(others.items()):
        copies = ", ".join(names[j] for j in sorted(alike))
        sentence = f"its record is that of {copies}, perhaps times a factor: one of them is wrong"
        said[i] = Comparison(("repeated_record",), (sentence,))
    return said


def _motions(stations: Sequence[xr.Dataset]) -> tuple[FloatArray, list[int]]:
    """Return ln PER of all components about its mean, (n_components, n_periods), and stations."""
    curves, owner = list[FloatArray](), list[int]()
    grid = stations[0]["period"].to_numpy() if stations else np.empty(0)
    compared = (grid >= MOTION_PERIODS[0]) & (grid <= MOTION_PERIODS[1])
    # All stations of a run have one grid; few periods say nothing
    for i, station in enumerate(stations):
        same = np.array_equal(station["period"].to_numpy(), grid)
        if not same or np.count_nonzero(compared) < FEWEST_PERIODS:
            continue
        for curve in _ln_per(station)[:, compared]:
            # A component that did not move has no shape
            if np.isfinite(curve).all():
                curves.append(curve - curve.mean())
                owner.append(i)
    return np.array(curves), owner


def _ln_per(station: xr.Dataset) -> FloatArray:
    """Return ln PER of the components at the damping of reference, (n_components, n_periods)."""
    per = station["per"].sel(damping=REFERENCE_DAMPING, method="nearest")
    with np.errstate(divide="ignore"):
        radii = per.transpose("component", "period").to_numpy()
        logarithm: FloatArray = np.log(radii.astype(np.float64))
    return logarithm


def _at_one_place(peaks: Peaks, first: int, second: int) -> bool:
    """Return whether two stations may share an instrument."""
    places = zip(peaks.longitude[[first, second]], peaks.latitude[[first, second]], strict=True)
    (east, north), (other_east, other_north) = places
    return bool(great_circle(east, north, other_east, other_north) < ONE_PLACE)
