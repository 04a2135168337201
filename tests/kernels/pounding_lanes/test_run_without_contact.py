"""The kernel of pairs that never touch, so short that it also runs uncompiled."""

import numpy as np
import pytest

from per_obspy.pounding.history.relative_yielding import yielding_relative_displacement


def test_one_structure_of_a_pair_yields_as_the_plastic_limit_says():
    # no stiffness after yielding: under a constant push beyond its strength it accelerates by what
    # is left of the push
    dt, push, omega = 0.05, -4.0, 2.0 * np.pi
    ground = np.array([np.full(9, push), np.zeros(9)])
    found = yielding_relative_displacement(
        ground[:, :7],
        dt,
        1.0,
        0.0,
        0.5,
        0.5,
        0.0,
        1.0,
        1e-15,
        yield_displacement_1=0.02,
        hardening_1=0.0,
    )
    # yields at u = 0.02 where (1 - cos) push / omega² gets there; then v' = 4 - omega² 0.02 until
    # the ramp ends at 0
    first = np.arccos(1.0 - 0.02 * omega**2 / 4.0) / omega
    speed, left = 4.0 / omega * np.sin(omega * first), 4.0 - 0.02 * omega**2
    time = 6 * dt - first  # of the full push; then one ramp to zero in dt
    place, speed = 0.02 + speed * time + 0.5 * left * time**2, speed + left * time
    place += speed * dt + 0.5 * left * dt**2 - 4.0 * dt**2 / 6.0
    speed += left * dt - 0.5 * 4.0 * dt
    place += 0.5 * speed**2 / (0.02 * omega**2)  # the yield force alone stops it
    assert found.one_before_two == pytest.approx(
        place, rel=1e-9
    )  # exact up to rounding and the share 1e-15 of 2
