"""Coefficients of Krylov-Bogoliubov averaging against averages over amplitude and phase."""

import numpy as np
import pytest
from scipy.integrate import quad

from per_obspy.pounding.linearization import equivalent_stiffness, equivalent_viscosity


@pytest.mark.parametrize("level", [0.3, 1.0, 2.0, 4.0])
def test_krylov_bogoliubov_coefficients(level):
    # mutation: a factor of Caughey's integrals. Here: his averages over amplitude and phase by
    # brute force
    def in_phase(amplitude):
        if amplitude <= level:
            return amplitude**2
        turn = np.arccos(1 - 2 * level / amplitude)
        return amplitude**2 / np.pi * (turn - 0.5 * np.sin(2 * turn))

    def average(function):
        return quad(
            lambda a: function(a) * a * np.exp(-(a**2) / 2), 0, 14, points=[level], limit=400
        )[0]

    assert equivalent_stiffness(level) == pytest.approx(average(in_phase) / 2, abs=1e-9)
    # energy of an elastoplastic loop 4 uy (A - uy) against that of a dashpot, pi A² per unit of I_S
    dissipated = average(lambda a: 4 * level * max(a - level, 0.0) / np.pi) / 2
    assert equivalent_viscosity(level) == pytest.approx(dissipated, abs=1e-9)


def test_limits():
    # a structure that never yields is elastic, one without strength has no stiffness left
    assert equivalent_stiffness(np.inf) == 1.0
    assert equivalent_viscosity(np.inf) == 0.0
    assert equivalent_stiffness(1e-6) == pytest.approx(0.0, abs=1e-5)
