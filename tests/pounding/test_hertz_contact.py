"""Hertz-damp contact: exact without contact, elastic impacts of stiff ones, loss of energy."""

import numpy as np
from numpy.testing import assert_allclose

from per_obspy.pounding.contact_elements import hertz_damp_history
from per_obspy.pounding.row_history import pounding_history
from per_obspy.pounding.structure import Structure

DT = 0.02
LEFT, RIGHT = Structure(1.5, 0.05, 4.0), Structure(0.6, 0.02, 1.0)


def push():
    return -2.0 * np.sin(np.linspace(0.0, 3.0 * np.pi, 60))


def test_without_contact_is_the_exact_history():
    # catches: participation, damping or ground interpolation wrong
    free = hertz_damp_history(push(), DT, LEFT, RIGHT, 10.0, 1e6, 0.6)
    exact = pounding_history(push(), DT, [LEFT, RIGHT], 10.0, 0.6, free_vibration=False)
    assert free.contacts == 0
    assert free.force_maximum == 0.0
    assert_allclose(
        free.displacement, exact.displacement, rtol=0, atol=1e-7
    )  # the integration steps over the corners of the record


def test_converges_to_elastic_impacts():
    # catches: force with the wrong sign, contact that lasts on after separation
    short = push()[:26]  # two impacts
    exact = pounding_history(short, DT, [LEFT, RIGHT], 0.02, 1.0, free_vibration=False)
    errors = []
    for stiffness in (1e4, 1e7):
        history = hertz_damp_history(short, DT, LEFT, RIGHT, 0.02, stiffness, 1.0)
        assert history.contacts == len(exact.impacts) == 2
        errors.append(np.abs(history.displacement - exact.displacement).max())
    assert errors[1] < 0.15 * errors[0]  # overlap goes like stiffness**-0.4: 0.06


def test_damping_loses_energy():
    # catches: damping that drives
    lossy = hertz_damp_history(push(), DT, LEFT, RIGHT, 0.02, 1e6, 0.5)
    elastic = hertz_damp_history(push(), DT, LEFT, RIGHT, 0.02, 1e6, 1.0)
    exact = pounding_history(push(), DT, [LEFT, RIGHT], 0.02, 1.0, free_vibration=False)
    after = int(exact.impacts["time"][0] / DT) + 2
    separation = [h.velocity[1, after] - h.velocity[0, after] for h in (lossy, elastic)]
    assert 0.0 < separation[0] < 0.9 * separation[1]
