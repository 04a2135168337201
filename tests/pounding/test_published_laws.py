"""Laws of pounding from the literature, on exact histories."""

import numpy as np
import pytest
from numpy.testing import assert_allclose, assert_array_equal

from per_obspy import pounding_histories, transfer_energies

DT = 0.005
TIME = np.arange(0.0, 30.0, DT)

#: Stiff and flexible periods, s.
PERIODS = ((0.3, 0.6), (0.4, 0.7), (0.5, 0.8), (0.3, 0.45))


def _sine(frequency):
    """Return harmonic ground acceleration of 1 m/s2 that grows for 2 s."""
    return np.sin(2.0 * np.pi * frequency * TIME) * np.minimum(TIME / 2.0, 1.0)


def _histories(motion, periods, gap, dt=DT, masses=(1.0, 1.0)):
    """Return the maxima of a pair with 5 % damping and restitution 0.6."""
    structures = periods[0], 0.05, masses[0], periods[1], 0.05, masses[1]
    return pounding_histories(motion, dt, *structures, gap=gap, restitution=0.6)


@pytest.mark.parametrize("masses", [(1.0, 1.0), (1.0, 4.0)])
def test_the_response_depends_on_ratios_alone(masses):
    # Dimitrakopoulos, Kappos, Makris (2009): with time in units of the motion's and length in units
    # of its acceleration times time squared, frequencies, masses, gap and restitution decide
    motion = np.random.default_rng(3).normal(size=2000) * np.exp(-(((TIME[:2000] - 5) / 3) ** 2))
    gaps = np.array([0.001, 0.005, 0.02])
    one = _histories(motion, (0.4, 0.7), gaps, masses=masses)
    slower, stronger, heavier = 2.5, 7.0, 300.0
    length = stronger * slower**2
    other = _histories(
        stronger * motion,
        (0.4 * slower, 0.7 * slower),
        gaps * length,
        dt=DT * slower,
        masses=[heavier * mass for mass in masses],
    )
    assert_array_equal(other.impacts, one.impacts)
    # rounding grows with every impact, of which there are dozens
    assert_allclose(other.per, length * one.per, rtol=1e-8)
    assert_allclose(other.impact_velocity, stronger * slower * one.impact_velocity, rtol=1e-8)


@pytest.mark.parametrize("periods", PERIODS)
def test_impacts_are_hardest_between_the_natural_frequencies(periods):
    # Chau, Wei, Guo, Shen (2003) on a shaking table
    stiff, flexible = 1.0 / periods[0], 1.0 / periods[1]
    frequencies = np.linspace(0.6 * flexible, 1.5 * stiff, 25)
    velocity = [
        float(_histories(_sine(one), periods, 0.002).impact_velocity) for one in frequencies
    ]
    assert flexible < frequencies[np.argmax(velocity)] < stiff


@pytest.mark.parametrize("periods", PERIODS)
def test_the_building_with_less_energy_gains(periods):
    # Sakai; Chau and others: in resonance with the flexible structure the stiff one is amplified
    # and the flexible one suppressed, and the other way round
    for resonant, other in ((0, 1), (1, 0)):
        motion = _sine(1.0 / periods[resonant])
        free = _histories(motion, periods, 10.0).per
        ratio = np.ravel(_histories(motion, periods, 0.002).per / free)
        energy = (np.ravel(free) / np.array(periods)) ** 2
        assert energy[other] < 0.5 * energy[resonant]
        assert ratio[other] > 1.5
        assert ratio[resonant] < 0.5


def test_of_equal_masses_the_slower_one_gains_what_the_faster_one_loses():
    # without loss both exchange their velocities, whatever these are
    velocity = np.random.default_rng(4).normal(size=(2, 1000))
    velocity = np.where(velocity[0] > velocity[1], velocity, velocity[::-1])
    energies = transfer_energies(*velocity, 2.0, 2.0, 1.0)
    first, second = np.asarray(energies[0]), np.asarray(energies[1])
    assert_allclose(first, -second, atol=1e-12)
    faster = np.abs(velocity[0]) > np.abs(velocity[1])
    # what structure 1 gives away is positive where it has more energy
    assert_array_equal(first > 0.0, faster)
