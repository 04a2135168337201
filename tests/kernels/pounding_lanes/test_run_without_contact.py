"""Pairs that never touch, so short that they also run uncompiled."""

import numpy as np
import pytest

from per_obspy.pounding.relative import yielding_relative_displacement


def test_a_structure_that_yields_moves_by_its_closed_form():
    # catches: an opening taken while the structure is still elastic, the end of free vibration
    dt, push, omega = 0.05, -4.0, 2.0 * np.pi
    ground = np.array([np.full(7, push), np.zeros(7)])
    strength = 0.02 * omega**2  # of structure 1; no stiffness after yielding
    maxima = yielding_relative_displacement(
        ground, dt, 1.0, 0.0, 0.5, 0.5, 0.0, 1.0, 1e-15, yield_displacement_1=0.02, hardening_1=0.0
    )
    # yields at u = 0.02 where (1 - cos) push / omega² gets there
    first = np.arccos(1.0 - strength / 4.0) / omega
    velocity = 4.0 / omega * np.sin(omega * first)
    # then under the constant push beyond its strength
    time = 6 * dt - first
    displacement = 0.02 + velocity * time + 0.5 * (4.0 - strength) * time**2
    velocity += (4.0 - strength) * time
    # then under one ramp of the push to zero in dt
    displacement += velocity * dt + 0.5 * (4.0 - strength) * dt**2 - 4.0 * dt**2 / 6.0
    velocity += (4.0 - strength) * dt - 0.5 * 4.0 * dt
    # its strength alone stops it
    displacement += 0.5 * velocity**2 / strength
    # exact up to rounding and the share 1e-15 of structure 2
    assert maxima.one_before_two == pytest.approx(displacement, rel=1e-9)
