"""
Peaks of stations against those of their neighbours and those of the earthquake.

A peak is compared with the median of the nearest stations, each seen as its ratio to a model of
attenuation at the distance of that station from the source, and with the model itself where the
magnitude is known. A median of five or more neighbours is the same with two wrong ones among them;
where there are fewer, only the model says something.

The model is that of Boore and others (2014) for shallow crustal earthquakes. The style of faulting
is unspecified, the region global and basins are left out. Coefficients as in two implementations
that agree: OpenQuake (``openquake/hazardlib/gsim/boore_2014.py``) and pygmm
(``boore_stewart_seyhan_atkinson-2014.csv``, revised 15 July 2014).

References
----------
Boore, D. M., Stewart, J. P., Seyhan, E. & Atkinson, G. M. (2014). NGA-West2 equations for
predicting PGA, PGV, and 5 % damped PSA for shallow crustal earthquakes. Earthquake Spectra 30 (3),
1057-1085.

Wells, D. L. & Coppersmith, K. J. (1994). New empirical relationships among magnitude, rupture
length, rupture width, rupture area, and surface displacement. Bulletin of the Seismological Society
of America 84 (4), 974-1002.
"""

from typing import NamedTuple

import numpy as np

from per_obspy.checks import FloatArray
from per_obspy.constants import STANDARD_GRAVITY
from per_obspy.screening.motion_field import great_circle
from per_obspy.screening.values import BoolArray, IndexArray, TextArray

#: Magnitudes and Vs30 (m/s) for which the model was made; others count as the nearest of them.
MAGNITUDES, VELOCITIES = (3.0, 8.5), (150.0, 1500.0)

#: Distance to which the model was made, m.
LONGEST_DISTANCE = 400_000.0

#: Reference Vs30 of the site term, m/s, and reference magnitude of the path.
REFERENCE_VELOCITY, REFERENCE_MAGNITUDE = 760.0, 4.5

#: Acceleration that keeps the nonlinear site term finite, g.
LINEAR_ACCELERATION = 0.1

#: Vs30 between which the deviation falls, m/s.
SOFT, FIRM = 225.0, 300.0


class Coefficients(NamedTuple):
    """Coefficients of one measure, named as in the paper; distances in km, velocities in m/s."""

    # Source: unspecified mechanism, slopes below the hinge magnitude, and above it
    e0: float
    e4: float
    e5: float
    e6: float
    hinge: float
    # Path: spreading and its dependence on magnitude, anelastic attenuation, pseudo-depth
    c1: float
    c2: float
    c3: float
    h: float
    # Site: linear slope and the Vs30 that limits it, nonlinear terms
    c: float
    limit: float
    f4: float
    f5: float
    # Deviation within an earthquake: distances and size of its growth, its fall on soft ground,
    # small and large magnitudes; deviation between earthquakes of small and large magnitudes
    near: float
    far: float
    growth: float
    fall: float
    within: tuple[float, float]
    between: tuple[float, float]


#: Of ln PGA, g.
PGA = Coefficients(
    e0=0.4473, e4=1.431, e5=0.05053, e6=-0.1662, hinge=5.5,
    c1=-1.134, c2=0.1917, c3=-0.008088, h=4.5,
    c=-0.6, limit=1500.0, f4=-0.15, f5=-0.00701,
    near=110.0, far=270.0, growth=0.1, fall=0.07, within=(0.695, 0.495), between=(0.398, 0.348),
)  # fmt: skip

#: Of ln PGV, cm/s.
PGV = Coefficients(
    e0=5.037, e4=1.073, e5=-0.1536, e6=0.2252, hinge=6.2,
    c1=-1.243, c2=0.1489, c3=-0.00344, h=5.3,
    c=-0.84, limit=1300.0, f4=-0.1, f5=-0.00844,
    near=105.0, far=272.0, growth=0.082, fall=0.08, within=(0.644, 0.552), between=(0.401, 0.346),
)  # fmt: skip

#: Model of each measure, and its unit in SI.
MODELS = {"pga": (PGA, STANDARD_GRAVITY), "pgv": (PGV, 0.01)}


def ln_median(measure: str, magnitude: float, distance: FloatArray, vs30: FloatArray) -> FloatArray:
    """
    Return the logarithm of the median peak of RotD50.

    Parameters
    ----------
    measure : str
        ``"pga"`` (m/s2) or ``"pgv"`` (m/s).
    magnitude : float
        Moment magnitude.
    distance : ndarray
        Shortest distance to the surface projection of the rupture (Joyner-Boore), m.
    vs30 : ndarray
        Mean shear-wave velocity of the upper 30 m, m/s.
    """
    model, unit = MODELS[measure]
    size = float(np.clip(magnitude, *MAGNITUDES))
    velocity = np.clip(vs30, *VELOCITIES)
    # The nonlinear term follows the acceleration on rock
    rock = np.exp(_on_rock(PGA, size, distance))
    linear = model.c * np.log(np.minimum(velocity, model.limit) / REFERENCE_VELOCITY)
    soft = np.exp(model.f5 * (np.minimum(velocity, REFERENCE_VELOCITY) - 360.0))
    slope = model.f4 * (soft - np.exp(model.f5 * (REFERENCE_VELOCITY - 360.0)))
    nonlinear = slope * np.log1p(rock / LINEAR_ACCELERATION)
    median: FloatArray = _on_rock(model, size, distance) + linear + nonlinear + np.log(unit)
    return median


def _on_rock(model: Coefficients, magnitude: float, distance: FloatArray) -> FloatArray:
    """Return the logarithm of the median at the reference Vs30, g or cm/s."""
    # Source, spreading, anelastic attenuation
    above = magnitude - model.hinge
    source = model.e6 * above if above > 0 else model.e4 * above + model.e5 * above**2
    radius = np.hypot(distance / 1000.0, model.h)
    spreading = model.c1 + model.c2 * (magnitude - REFERENCE_MAGNITUDE)
    rock: FloatArray = model.e0 + source + spreading * np.log(radius) + model.c3 * (radius - 1.0)
    return rock


def deviations(
    measure: str, magnitude: float, distance: FloatArray, vs30: FloatArray
) -> tuple[float, FloatArray]:
    """Return log-standard deviations between earthquakes and within one, see :func:`ln_median`."""
    model, _ = MODELS[measure]
    size = (4.5, 5.5)
    between = float(np.interp(magnitude, size, model.between))
    # Logarithmic between the limits of distance and of Vs30
    away = np.maximum(distance / 1000.0, 1.0)
    growth = np.interp(np.log(away), np.log((model.near, model.far)), (0.0, model.growth))
    fall = np.interp(np.log(vs30), np.log((SOFT, FIRM)), (model.fall, 0.0))
    within: FloatArray = np.interp(magnitude, size, model.within) + growth - fall
    return between, within


def rupture_length(magnitude: float) -> float:
    """Return the median length of a rupture below the surface, m (Wells & Coppersmith 1994)."""
    return float(1000.0 * 10.0 ** (-2.44 + 0.59 * magnitude))


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
    site_class: TextArray
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
    neighbours: IndexArray
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
    is_beyond: BoolArray

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


def peak_deviations(measure: str, peaks: Peaks, earthquake: Earthquake) -> Deviations:
    """
    Compare a peak (``"pga"`` or ``"pgv"``) of every station with its neighbours and the earthquake.

    Stations without a place or peak are left out.
    """
    value = _logarithms(getattr(peaks, measure), peaks.longitude)
    model = _model(measure, peaks, earthquake)
    has_source = np.isfinite(earthquake.longitude).item()
    difference, scale, number, reach = _neighbours(value, model, peaks, has_source)
    by_neighbours, by_model = _in_scales(difference, scale), np.zeros(value.size)
    # without a magnitude the model has only a shape
    if np.isfinite([earthquake.longitude, earthquake.magnitude]).all():
        by_neighbours = _unless_doubted(by_neighbours, (value - model.middle) / model.deviation)
        by_model = _from_model(value, model)
    # the larger of both
    larger = np.abs(by_model) > np.abs(by_neighbours)
    edge = np.where(by_model > 0, model.nearest, model.farthest)
    return Deviations(
        np.where(larger, by_model, by_neighbours),
        np.exp(np.where(larger, edge, value - difference)),
        np.where(larger, 0, number).astype(np.intp),
        np.where(larger, np.nan, reach),
    )


def _logarithms(peak: FloatArray, longitude: FloatArray) -> FloatArray:
    """Return the logarithms of peaks, NaN without motion or place."""
    usable = (peak > 0) & np.isfinite(peak) & np.isfinite(longitude)
    return np.log(np.where(usable, peak, np.nan))


def _in_scales(difference: FloatArray, scale: FloatArray) -> FloatArray:
    """Return differences in deviations, by the spread of the other stations where it is larger."""
    size, scale = np.abs(difference), scale.copy()
    compared = np.flatnonzero(np.isfinite(size))
    # A station does not widen the scale by which it is judged
    for i in compared if compared.size > 1 else ():
        others = compared[compared != i]
        # Median absolute deviation of a normal distribution
        scale[i] = max(scale[i], 1.4826 * float(np.median(size[others])))
    return np.nan_to_num(difference / scale)


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


def _neighbours(value: FloatArray, model: _Model, peaks: Peaks, has_source: bool) -> FloatArray:
    """
    Compare the ratio of every peak to the model with the median of its neighbours.

    Returns differences of ln(peak), their own scales, number and reach (m) of the neighbours, as
    rows; few neighbours say nothing (NaN).
    """
    residual = value - model.middle
    rows = np.full((4, value.size), np.nan)
    rows[2] = 0
    usable = np.isfinite(residual)
    growth = BY_REGION if has_source else WITHOUT_SOURCE
    for i in np.flatnonzero(usable).tolist():
        near, distance = _nearest(i, usable, peaks)
        if near.size < FEWEST_NEIGHBOURS:
            continue
        # Ground and path of the station and of the median, attenuation, extent of the rupture
        own = model.within[i] * np.sqrt(1.0 + MEDIAN_VARIANCE / near.size)
        away = growth * np.log1p(np.median(distance) / NEAR)
        extent = model.extent[i] - np.median(model.extent[near])
        scale = np.hypot(np.hypot(own, away), extent)
        # what the peak differs by
        difference = residual[i] - np.median(residual[near])
        rows[:, i] = difference, scale, near.size, distance.max()
    return rows


def _nearest(station: int, usable: BoolArray, peaks: Peaks) -> tuple[IndexArray, FloatArray]:
    """Return the nearest others, on the station's ground where enough are, and their distances."""
    others = usable.copy()
    others[station] = False
    # Ground of the same class
    own = peaks.site_class[station]
    alike = others & (peaks.site_class == own)
    enough = own and np.count_nonzero(alike) >= FEWEST_NEIGHBOURS
    index = np.flatnonzero(alike if enough else others)
    east, north = peaks.longitude, peaks.latitude
    distance = great_circle(east[station], north[station], east[index], north[index])
    nearest = np.argsort(distance, kind="stable")[:MOST_NEIGHBOURS]
    return index[nearest], distance[nearest]


def peak_sentence(
    measure: str, peak: float, found: Deviations, station: int, earthquake: Earthquake
) -> str:
    """Return a sentence with peak, expected peak and deviations, and the unit that explains it."""
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
