"""Floors by modes, against the coupled equations by SciPy, and against the oscillator that stands for the building."""

from itertools import pairwise

import numpy as np
from numpy.testing import assert_allclose
from scipy.linalg import expm

from per_obspy.inventory.modal_history import modal_history
from per_obspy.inventory.shear_building import equivalent_sdof, shear_building
from per_obspy.spectra.bilinear import bilinear_response

DT = 0.01
MOTION = np.random.default_rng(3).normal(size=600) * np.hanning(600)
MASSES, STIFFNESSES = np.array([3e5, 2e5, 1e5]), np.array([2e8, 1.5e8, 8e7])


def test_against_the_coupled_equations():
    # mutation: shapes not normalised alike, a participation factor without its square, floors in
    # the wrong order
    above = np.append(STIFFNESSES[1:], 0.0)
    stiffness = (
        np.diag(STIFFNESSES + above) - np.diag(STIFFNESSES[1:], 1) - np.diag(STIFFNESSES[1:], -1)
    )
    periods, shapes = shear_building(MASSES, STIFFNESSES)
    viscous = (
        shapes @ np.diag(2 * 0.05 * 2 * np.pi / periods) @ np.linalg.inv(shapes)
    )  # 5 % in every mode
    system = np.zeros((8, 8))  # displacements, velocities, ground acceleration and its slope
    system[:3, 3:6], system[6, 7] = np.eye(3), 1.0
    system[3:6, :3], system[3:6, 3:6], system[3:6, 6] = -stiffness / MASSES[:, None], -viscous, -1.0
    step, state, floors = expm(system * DT), np.zeros(6), [np.zeros(3)]
    for before, after in pairwise(MOTION):
        state = (step @ np.concatenate([state, [before, (after - before) / DT]]))[:6]
        floors.append(state[:3])
    scale = np.abs(floors).max()
    # both are exact for a piecewise-linear ground; round-off of 600 steps
    assert_allclose(
        modal_history(MOTION, DT, MASSES, STIFFNESSES), np.transpose(floors), atol=1e-9 * scale
    )


def test_the_first_mode_carries_most_of_the_roof():
    # the oscillator at contact level is the first mode: the rest of this building's roof is the
    # higher modes
    sdof = equivalent_sdof(MASSES, STIFFNESSES, 2)
    first = (
        sdof.participation
        * bilinear_response(MOTION, DT, sdof.period, 0.05, np.inf, 0.0).displacement
    )
    roof = modal_history(MOTION, DT, MASSES, STIFFNESSES)[2]
    assert (
        np.abs(first[: roof.size] - roof).max() < 0.35 * np.abs(roof).max()
    )  # white noise excites all modes
    assert np.corrcoef(first[: roof.size], roof)[0, 1] > 0.9


def test_one_floor_is_its_oscillator():
    period = 2 * np.pi * np.sqrt(1e5 / 1e7)
    alone = bilinear_response(MOTION, DT, period, 0.05, np.inf, 0.0).displacement[:600]
    assert_allclose(modal_history(MOTION, DT, [1e5], [1e7])[0], alone, rtol=1e-12)
