"""
Expected peak acceleration and velocity of shallow crustal earthquakes, after Boore and others 2014.

The style of faulting is unspecified, the region global and basins are left out. Coefficients as in
two implementations that agree: OpenQuake (``openquake/hazardlib/gsim/boore_2014.py``) and pygmm
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
    """
    Return the log-standard deviations between earthquakes and within one.

    Parameters
    ----------
    measure, magnitude, distance, vs30
        As for :func:`ln_median`.
    """
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
