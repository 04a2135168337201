"""The model of attenuation: against another implementation, and its laws."""

import numpy as np
import pytest

from per_obspy.constants import STANDARD_GRAVITY
from per_obspy.screening.amplitudes import (
    deviations,
    ln_median,
    rupture_length,
)

#: Magnitude, distance (km), Vs30 (m/s) -> PGA (g), PGV (cm/s), deviations of ln PGA between and
#: within earthquakes, then of ln PGV: pygmm 0.8.0, BooreStewartSeyhanAtkinson2014, mechanism U,
#: region global, rounded to the digits given.
BY_PYGMM = [
    ((4.0, 10, 760), (0.0099385, 0.272768, 0.398, 0.695, 0.401, 0.644)),
    ((5.2, 40, 400), (0.02672965, 0.991995, 0.363, 0.555, 0.3625, 0.5796)),
    ((6.5, 0.5, 250), (0.48182798, 56.503966, 0.348, 0.450637, 0.346, 0.501299)),
    ((7.1, 150, 180), (0.03280633, 4.87906, 0.348, 0.459541, 0.346, 0.502727)),
    ((8.2, 290, 1450), (0.00588787, 1.125346, 0.348, 0.595, 0.346, 0.634)),
]


@pytest.mark.parametrize(("scenario", "expected"), BY_PYGMM)
def test_medians_and_deviations_are_those_of_another_implementation(scenario, expected):
    magnitude, distance, vs30 = scenario
    place = np.array([1000.0 * distance]), np.array([float(vs30)])
    units = {"pga": STANDARD_GRAVITY, "pgv": 0.01}
    found = [np.exp(ln_median(name, magnitude, *place))[0] / units[name] for name in units]
    for name in units:
        between, within = deviations(name, magnitude, *place)
        found += [between, within[0]]
    # digits of the table: 6 decimals of values above 0.25, 8 of accelerations above 0.005
    np.testing.assert_allclose(found, expected, rtol=2e-6)


@pytest.mark.parametrize("measure", ["pga", "pgv"])
def test_motion_falls_with_distance_and_grows_with_magnitude_and_softness(measure):
    distance = np.geomspace(1e3, 4e5, 50)
    rock = np.full(50, 760.0)
    motion = np.array([ln_median(measure, size, distance, rock) for size in (4.0, 5.5, 7.0)])
    assert (np.diff(motion, axis=1) < 0).all()
    assert (np.diff(motion, axis=0) > 0).all()
    # far away the ground is linear: soft ground amplifies
    assert ln_median(measure, 6.0, distance, rock / 3)[-1] > motion[1, -1]
    # beyond its magnitudes and velocities the nearest of them counts
    np.testing.assert_array_equal(
        ln_median(measure, 9.5, distance, rock * 9), ln_median(measure, 8.5, distance, rock * 2)
    )


def test_a_rupture_of_magnitude_seven_is_fifty_kilometres_long():
    # Wells & Coppersmith (1994), table 2A, all slip types: log10 L = -2.44 + 0.59 M
    assert rupture_length(7.0) == pytest.approx(48_978, abs=1)
