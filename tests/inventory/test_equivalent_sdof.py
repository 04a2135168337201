"""
The equivalent oscillator against the history of every floor of its building.

The floors come from all modes superposed, and these from the coupled equations. Covers
per_obspy.inventory.shear_building.
"""

from itertools import pairwise

import numpy as np
from numpy.testing import assert_allclose
from scipy.linalg import expm

from per_obspy.inventory.shear_building import equivalent_sdof, shear_building
from per_obspy.spectra.bilinear import bilinear_response

DT = 0.01
DAMPING = 0.05
MOTION = np.random.default_rng(3).normal(size=600) * np.hanning(600)
MASSES, STIFFNESSES = np.array([3e5, 2e5, 1e5]), np.array([2e8, 1.5e8, 8e7])


def oscillator_displacement(period):
    """Return the displacement of a linear oscillator at the samples of the motion, m."""
    response = bilinear_response(MOTION, DT, period, DAMPING, np.inf, 0.0)
    return response.displacement[: MOTION.size]


def modal_history(masses, stiffnesses):
    """
    Return the displacement of every floor, (n_floors, n_samples), m: all modes superposed.

    ``u(t) = sum(phi_k Gamma_k D_k(t))`` with ``Gamma_k = sum(m phi_k) / sum(m phi_k**2)`` and the
    response D_k of an oscillator with the period of mode k (Chopra 2012, ch. 13).
    """
    building = shear_building(masses, stiffnesses)
    displacement = np.zeros((len(masses), MOTION.size))
    for period, shape in zip(building.periods, building.shapes.T, strict=True):
        factor = (masses @ shape) / (masses @ shape**2)
        displacement += factor * np.outer(shape, oscillator_displacement(float(period)))
    return displacement


def coupled_system():
    """
    Return the matrix of the coupled equations of motion.

    The state is displacements, velocities, the ground acceleration and its slope.
    """
    # Stiffness of the storeys, and the damping matrix with 5 % in every mode
    above = np.append(STIFFNESSES[1:], 0.0)
    stiffness = np.diag(STIFFNESSES + above)
    stiffness -= np.diag(STIFFNESSES[1:], 1) + np.diag(STIFFNESSES[1:], -1)
    periods, shapes = shear_building(MASSES, STIFFNESSES)
    viscous = shapes @ np.diag(2 * DAMPING * 2 * np.pi / periods) @ np.linalg.inv(shapes)
    # Displacements follow velocities, the ground follows its slope
    system = np.zeros((8, 8))
    system[:3, 3:6] = np.eye(3)
    system[6, 7] = 1.0
    # Accelerations of the floors
    system[3:6, :3] = -stiffness / MASSES[:, None]
    system[3:6, 3:6] = -viscous
    system[3:6, 6] = -1.0
    return system


def test_the_modes_solve_the_coupled_equations():
    # would catch shapes not normalised alike, a participation factor without its square, floors in
    # the wrong order
    step, state, floors = expm(coupled_system() * DT), np.zeros(6), [np.zeros(3)]
    for before, after in pairwise(MOTION):
        ground = [before, (after - before) / DT]
        state = (step @ np.concatenate([state, ground]))[:6]
        floors.append(state[:3])
    # both are exact for a piecewise-linear ground; round-off of 600 steps
    tolerance = 1e-9 * np.abs(floors).max()
    assert_allclose(modal_history(MASSES, STIFFNESSES), np.transpose(floors), atol=tolerance)


def test_the_first_mode_carries_most_of_the_roof():
    # the oscillator at contact level is the first mode: the rest of this building's roof is the
    # higher modes
    sdof = equivalent_sdof(MASSES, STIFFNESSES, 2)
    first = sdof.participation * oscillator_displacement(sdof.period)
    roof = modal_history(MASSES, STIFFNESSES)[2]
    # white noise excites all modes
    assert np.abs(first - roof).max() < 0.35 * np.abs(roof).max()
    assert np.corrcoef(first, roof)[0, 1] > 0.9


def test_one_floor_is_its_oscillator():
    period = 2 * np.pi * np.sqrt(1e5 / 1e7)
    floor = modal_history(np.array([1e5]), np.array([1e7]))[0]
    assert_allclose(floor, oscillator_displacement(period), rtol=1e-12)
