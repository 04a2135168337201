"""Constants agree with each other and with their definitions."""

import math

import pytest

from per_obspy import constants


def test_a_degree_is_an_arc_of_the_mean_earth():
    arc = math.radians(1.0) * constants.EARTH_RADIUS
    # rounded to six digits
    assert pytest.approx(arc, rel=1e-6) == constants.METRES_PER_DEGREE


def test_a_thousand_gal_are_slightly_more_than_gravity():
    # by definition 1 g = 980.665 Gal
    assert pytest.approx(980.665, rel=1e-15) == constants.STANDARD_GRAVITY / constants.GAL
