"""Constants agree with each other, and defaults are the same wherever they are used."""

import inspect

import numpy as np
import pytest

import per_obspy
from per_obspy import constants
from per_obspy.config import Spectra


def test_a_degree_is_an_arc_on_the_mean_earth():
    arc = np.radians(constants.EARTH_RADIUS)
    assert abs(constants.METRES_PER_DEGREE - arc) < 0.5  # m: six digits


def test_gravity_in_gal():
    # by definition 1 g = 980.665 Gal
    assert pytest.approx(980.665, rel=1e-15) == constants.STANDARD_GRAVITY / constants.GAL


def test_the_stored_grid_is_one_in_configuration_and_signature():
    # would catch a default that is changed in one place
    defaults = inspect.signature(per_obspy.station_spectra).parameters
    settings = Spectra()
    assert settings.dampings == defaults["dampings"].default
    assert settings.azimuth_step == defaults["azimuth_step"].default
    # stations are compared at a damping within the stored ones
    assert min(settings.dampings) <= constants.REFERENCE_DAMPING <= max(settings.dampings)
