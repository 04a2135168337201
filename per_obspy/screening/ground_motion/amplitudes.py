"""
Peaks of stations against those of their neighbours and those of the earthquake.

A peak is compared with the median of the nearest stations, each seen as its ratio to a model of
attenuation at the distance of that station from the source (:mod:`.attenuation`), and with the
model itself where the magnitude is known. A median of five or more neighbours is the same with two
wrong ones among them; where there are fewer, only the model says something.
"""

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from per_obspy.checks import FloatArray
from per_obspy.screening.ground_motion.attenuation import (
    LONGEST_DISTANCE,
    deviations,
    ln_median,
    rupture_length,
)
from per_obspy.screening.ground_motion.spatial_correlation import great_circle

#: Measures that are compared, with their names and units in messages.
MEASURES = {"pga": ("peak ground acceleration", "m/s2"), "pgv": ("peak ground velocity", "m/s")}

#: Deviations beyond which a peak is flagged, and beyond which its station is rejected.
FLAGGED, REJECTED = 4.0, 8.0

#: Neighbours whose median is the expected peak: at most, and at least. Of the nearest 3 to 12, 8
#: left about the smallest deviations in Canterbury 2010, Christchurch 2011, Kobe 1995, Puebla 2017.
MOST_NEIGHBOURS, FEWEST_NEIGHBOURS = 8, 5

#: Log-standard deviations that the model does not contain. Reasoned: a region or kind of source
#: that is not that of the model (medians of the four earthquakes above differ by up to 1.1), and
#: ground of unknown Vs30 (a factor of 1.5 in Vs30, exponents -0.6 to -0.84 of the model).
OTHER_REGION, UNKNOWN_GROUND = 0.5, 0.3

#: Variance of the median of many normal values over that of one value and their number.
MEDIAN_VARIANCE = 0.5 * np.pi

#: Growth of the deviation with ln(1 + distance / NEAR, m) between a station and its neighbours.
#: Reasoned: attenuation varies between regions; without a source, peaks may fall as distance^-1.3,
#: of which half is one deviation.
NEAR, BY_REGION, WITHOUT_SOURCE = 10_000.0, 0.1, 0.65

#: Vs30 of ground without one, m/s, and magnitude that gives the model its shape without one;
#: reasoned: the middle of stiff soil, and a moderate earthquake.
USUAL_VS30, USUAL_MAGNITUDE = 400.0, 6.0

#: Depth down to which a source counts as shallow, m: distances of the model are to the surface
#: projection of shallow crustal ruptures. Reasoned.
SHALLOW = 20_000.0

#: Deviations from the model below which a station is not flagged, and not rejected, because of its
#: neighbours: where they are wrong, the model takes its part. Reasoned.
DOUBTED, DOUBTED_MUCH = 1.0, 2.0

#: Factors by which wrong units change a peak, with what was taken for what.
UNIT_ERRORS = {
    9.81: "m/s2 taken for g",
    100.0: "cm/s2 taken for m/s2",
    981.0: "cm/s2 taken for g",
    1 / 9.81: "g taken for m/s2",
    1 / 100.0: "m/s2 taken for cm/s2",
    1 / 981.0: "g taken for cm/s2",
}

#: Largest difference of a logarithm of ratio from that of a wrong unit; reasoned: above one
#: deviation, and below half of ln 9.81, which separates two of them.
LIKE_A_UNIT = 0.9


class Earthquake(NamedTuple):
    """Source of the motion: degrees, m, moment magnitude; NaN where unknown."""

    longitude: float = np.nan
    latitude: float = np.nan
    depth: float = np.nan
    magnitude: float = np.nan


class Peaks(NamedTuple):
    """
    Stations with their peaks, (n_stations,).

    Attributes
    ----------
    longitude, latitude : ndarray
        Degrees; NaN where unknown.
    vs30 : ndarray
        m/s; NaN where unknown.
    site_class : ndarray of str
        Empty where unknown.
    pga, pgv : ndarray
        Larger horizontal, m/s2 and m/s; NaN where unknown.
    """

    longitude: FloatArray
    latitude: FloatArray
    vs30: FloatArray
    site_class: NDArray[np.object_]
    pga: FloatArray
    pgv: FloatArray


class Deviations(NamedTuple):
    """
    Deviations of one measure, (n_stations,).

    Attributes
    ----------
    deviations : ndarray
        ln(peak / expected peak) in standard deviations; 0 where nothing can be said.
    expected : ndarray
        Expected peak in SI; NaN where nothing can be said.
    neighbours : ndarray of int
        Number of neighbours that the expected peak is from; 0 if it is that of the model.
    reach : ndarray
        Distance of the farthest of them, m; NaN if there are none.
    """

    deviations: FloatArray
    expected: FloatArray
    neighbours: NDArray[np.intp]
    reach: FloatArray


class _Model(NamedTuple):
    """Logarithms of the peaks that the model expects at all stations, and their deviations."""

    # For the least, middle and largest distance from the rupture
    nearest: FloatArray
    middle: FloatArray
    farthest: FloatArray
    # Between earthquakes, and within one
    between: float
    within: FloatArray
    # Where the model ends
    is_beyond: NDArray[np.bool_]

    @property
    def deviation(self) -> FloatArray:
        """Deviation of a peak, in any region."""
        total: FloatArray = np.sqrt(self.between**2 + OTHER_REGION**2 + self.within**2)
        return total

    @property
    def extent(self) -> FloatArray:
        """Deviation by the unknown extent of the rupture, a quarter of the range."""
        quarter: FloatArray = 0.25 * (self.nearest - self.farthest)
        return quarter


class _Neighbours(NamedTuple):
    """Differences of ln(peak) from the neighbours, their own scales, number and reach."""

    difference: FloatArray
    scale: FloatArray
    number: NDArray[np.intp]
    reach: FloatArray

    @property
    def deviations(self) -> FloatArray:
        """Differences in deviations, by the spread of the other stations where it is larger."""
        size, scale = np.abs(self.difference), self.scale.copy()
        compared = np.flatnonzero(np.isfinite(size))
        # A station does not widen the scale by which it is judged
        for i in compared if compared.size > 1 else ():
            others = compared[compared != i]
            # Median absolute deviation of a normal distribution
            scale[i] = max(scale[i], 1.4826 * float(np.median(size[others])))
        return np.nan_to_num(self.difference / scale)


def peak_deviations(measure: str, peaks: Peaks, earthquake: Earthquake) -> Deviations:
    """
    Compare a peak of every station with its neighbours and with the earthquake.

    Parameters
    ----------
    measure : str
        ``"pga"`` or ``"pgv"``.
    peaks : Peaks
        Stations; those without a place or peak are left out.
    earthquake : Earthquake
        What is known of the source.
    """
    value = _logarithms(getattr(peaks, measure), peaks.longitude)
    model = _model(measure, peaks, earthquake)
    neighbours = _neighbours(value, model, peaks, np.isfinite(earthquake.longitude).item())
    by_neighbours, by_model = neighbours.deviations, np.zeros(value.size)
    # Without a magnitude the model has only a shape
    if np.isfinite([earthquake.longitude, earthquake.magnitude]).all():
        by_neighbours = _unless_doubted(by_neighbours, (value - model.middle) / model.deviation)
        by_model = _from_model(value, model)
    # The larger of both
    larger = np.abs(by_model) > np.abs(by_neighbours)
    edge = np.where(by_model > 0, model.nearest, model.farthest)
    return Deviations(
        np.where(larger, by_model, by_neighbours),
        np.exp(np.where(larger, edge, value - neighbours.difference)),
        np.where(larger, 0, neighbours.number),
        np.where(larger, np.nan, neighbours.reach),
    )


def _logarithms(peak: FloatArray, longitude: FloatArray) -> FloatArray:
    """Return the logarithms of peaks, NaN without motion or place."""
    usable = (peak > 0) & np.isfinite(peak) & np.isfinite(longitude)
    return np.log(np.where(usable, peak, np.nan))


def _model(measure: str, peaks: Peaks, earthquake: Earthquake) -> _Model:
    """Return the expected peaks of the model at all stations; equal ones without a source."""
    # What is not known is assumed
    has_vs30 = np.isfinite(peaks.vs30)
    vs30 = np.where(has_vs30, peaks.vs30, USUAL_VS30)
    has_size = np.isfinite(earthquake.magnitude)
    magnitude = earthquake.magnitude if has_size else USUAL_MAGNITUDE
    along = great_circle(earthquake.longitude, earthquake.latitude, peaks.longitude, peaks.latitude)
    along = np.where(np.isfinite(along), along, NEAR)
    # The rupture starts at the hypocentre and may come nearer by its whole length
    below = max(float(np.nan_to_num(earthquake.depth)) - SHALLOW, 0.0)
    length = rupture_length(magnitude)
    away = [np.hypot(np.maximum(along - share * length, 0.0), below) for share in (1.0, 0.5, 0.0)]
    between, within = deviations(measure, magnitude, away[-1], vs30)
    nearest, middle, farthest = (ln_median(measure, magnitude, distance, vs30) for distance in away)
    within = np.hypot(within, np.where(has_vs30, 0.0, UNKNOWN_GROUND))
    return _Model(nearest, middle, farthest, between, within, along > LONGEST_DISTANCE)


def _from_model(value: FloatArray, model: _Model) -> FloatArray:
    """Return the deviations from the model, whatever part of the rupture is nearest."""
    excess = np.maximum(value - model.nearest, 0.0) + np.minimum(value - model.farthest, 0.0)
    return np.nan_to_num(np.where(model.is_beyond, 0.0, excess) / model.deviation)


def _unless_doubted(by_neighbours: FloatArray, by_model: FloatArray) -> FloatArray:
    """Return deviations from neighbours without those that the model does not share."""
    agreement = np.where(np.sign(by_model) == np.sign(by_neighbours), np.abs(by_model), 0.0)
    kept = np.where(agreement < DOUBTED, 0.0, by_neighbours)
    return np.where(agreement < DOUBTED_MUCH, np.clip(kept, -REJECTED, REJECTED), kept)


def _neighbours(value: FloatArray, model: _Model, peaks: Peaks, has_source: bool) -> _Neighbours:
    """Compare the ratio of every peak to the model with the median of its neighbours."""
    residual = value - model.middle
    difference, scale, reach = np.full((3, value.size), np.nan)
    number = np.zeros(value.size, dtype=np.intp)
    usable = np.isfinite(residual)
    # Few neighbours say nothing
    for i in np.flatnonzero(usable).tolist():
        near, distance = _nearest(i, usable, peaks)
        if near.size < FEWEST_NEIGHBOURS:
            continue
        difference[i] = residual[i] - np.median(residual[near])
        number[i], reach[i] = near.size, distance.max()
        scale[i] = _scale(model, i, near, distance, BY_REGION if has_source else WITHOUT_SOURCE)
    return _Neighbours(difference, scale, number, reach)


def _scale(
    model: _Model, station: int, near: NDArray[np.intp], distance: FloatArray, growth: float
) -> float:
    """Return the deviation of a difference from neighbours in their distances."""
    # Ground and path of the station and of the median, attenuation, extent of the rupture
    own = model.within[station] * np.sqrt(1.0 + MEDIAN_VARIANCE / near.size)
    away = growth * np.log1p(np.median(distance) / NEAR)
    extent = model.extent[station] - np.median(model.extent[near])
    return float(np.hypot(np.hypot(own, away), extent))


def _nearest(
    station: int, usable: NDArray[np.bool_], peaks: Peaks
) -> tuple[NDArray[np.intp], FloatArray]:
    """Return the nearest others, on the station's ground where enough are, and their distances."""
    others = usable.copy()
    others[station] = False
    # Ground of the same class
    own = peaks.site_class[station]
    alike = others & (peaks.site_class == own)
    index = np.flatnonzero(
        alike if own and np.count_nonzero(alike) >= FEWEST_NEIGHBOURS else others
    )
    east, north = peaks.longitude, peaks.latitude
    distance = great_circle(east[station], north[station], east[index], north[index])
    nearest = np.argsort(distance, kind="stable")[:MOST_NEIGHBOURS]
    return index[nearest], distance[nearest]


def peak_sentence(
    measure: str, peak: float, found: Deviations, station: int, earthquake: Earthquake
) -> str:
    """
    Return a sentence with peak, expected peak and deviations, and the unit that explains it.

    Parameters
    ----------
    measure : str
        ``"pga"`` or ``"pgv"``.
    peak : float
        m/s2 or m/s.
    found : Deviations
        Of this measure.
    station : int
        Index of the station.
    earthquake : Earthquake
        As for :func:`peak_deviations`.
    """
    # From neighbours, or from the model
    name, unit = MEASURES[measure]
    expected, count = found.expected[station], found.neighbours[station]
    source = f"Boore and others 2014 for magnitude {earthquake.magnitude:g}"
    if count:
        source = f"median of {count} neighbours within {found.reach[station] / 1000:.0f} km"
    # Ratios below 1 are read more easily as fractions
    ratio = peak / expected
    size = max(ratio, 1 / ratio)
    written = f"{size:.0f}" if 100 <= size < 1e6 else f"{size:.2g}"
    times = f"{written} times as much" if ratio > 1 else f"1/{written} of that"
    sentence = (
        f"{name} {peak:.3g} {unit}, expected {expected:.3g} {unit} ({source}): {times}, "
        f"{abs(found.deviations[station]):.1f} deviations"
    )
    return sentence + _wrong_unit(ratio)


def _wrong_unit(ratio: float) -> str:
    """Return the wrong unit that would bring a peak near to the expected one, if there is one."""
    apart = {factor: abs(np.log(ratio / factor)) for factor in UNIT_ERRORS}
    factor = min(apart, key=apart.__getitem__)
    error = f", as by a wrong unit ({UNIT_ERRORS[factor]})"
    return error if apart[factor] <= LIKE_A_UNIT else ""
