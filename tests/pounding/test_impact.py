"""Equations (7)-(10): momentum, restitution, energy, walls."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from per_obspy.pounding.single_hit import post_impact_velocities, transfer_energies

velocities = st.floats(-10.0, 10.0)
masses = st.floats(1.0, 1e6)
restitutions = st.floats(0.0, 1.0)
ROUNDING = 1e-12  # of the largest term; a dozen operations on doubles


@given(velocities, velocities, masses, masses, restitutions)
def test_momentum_and_restitution(velocity_1, velocity_2, mass_1, mass_2, restitution):
    # mutation: m1 and m2 exchanged in one equation; 1 - e for 1 + e
    after_1, after_2 = post_impact_velocities(velocity_1, velocity_2, mass_1, mass_2, restitution)
    momentum = mass_1 * velocity_1 + mass_2 * velocity_2
    scale = 10 * (mass_1 + mass_2)
    assert mass_1 * after_1 + mass_2 * after_2 == pytest.approx(momentum, abs=ROUNDING * scale)
    assert after_2 - after_1 == pytest.approx(
        restitution * (velocity_1 - velocity_2), abs=ROUNDING * 10
    )


@given(velocities, velocities, masses, masses, restitutions)
def test_energies_are_what_the_structures_lose(velocity_1, velocity_2, mass_1, mass_2, restitution):
    # mutation: the sign of (9) or (10) as printed, or their labels exchanged
    after_1, after_2 = post_impact_velocities(velocity_1, velocity_2, mass_1, mass_2, restitution)
    left_1, left_2 = transfer_energies(velocity_1, velocity_2, mass_1, mass_2, restitution)
    scale = 100 * (mass_1 + mass_2)
    assert left_1 == pytest.approx(mass_1 * (velocity_1**2 - after_1**2) / 2, abs=ROUNDING * scale)
    assert left_2 == pytest.approx(mass_2 * (velocity_2**2 - after_2**2) / 2, abs=ROUNDING * scale)
    loss = (
        (1 - restitution**2)
        * mass_1
        * mass_2
        / (mass_1 + mass_2)
        * (velocity_1 - velocity_2) ** 2
        / 2
    )
    assert left_1 + left_2 == pytest.approx(loss, abs=ROUNDING * scale)


@given(velocities, velocities, masses, masses, restitutions)
def test_corrected_closed_forms(velocity_1, velocity_2, mass_1, mass_2, restitution):
    # the bracketed polynomials of (9) and (10) with their signs put right; mutation: 2 m1 for m1,
    # (1 - e) for (1 + e)
    total, difference = mass_1 + mass_2, velocity_1 - velocity_2
    common = (1 + restitution) * mass_1 * mass_2 / total**2 / 2 * difference
    bracket_1 = (2 * mass_1 + (1 - restitution) * mass_2) * velocity_1 + (
        1 + restitution
    ) * mass_2 * velocity_2
    bracket_2 = (1 + restitution) * mass_1 * velocity_1 + (
        2 * mass_2 + (1 - restitution) * mass_1
    ) * velocity_2
    left_1, left_2 = transfer_energies(velocity_1, velocity_2, mass_1, mass_2, restitution)
    scale = 100 * total
    assert left_1 == pytest.approx(common * bracket_1, abs=ROUNDING * scale)
    assert left_2 == pytest.approx(-common * bracket_2, abs=ROUNDING * scale)


@given(velocities, velocities, masses, masses, restitutions)
def test_mirror(velocity_1, velocity_2, mass_1, mass_2, restitution):
    # seen from the other side of the street, 1 and 2 and all signs change places; mutation: shares
    # m1/M and m2/M mixed
    after_1, after_2 = post_impact_velocities(velocity_1, velocity_2, mass_1, mass_2, restitution)
    mirror_2, mirror_1 = post_impact_velocities(
        -velocity_2, -velocity_1, mass_2, mass_1, restitution
    )
    assert -mirror_1 == pytest.approx(after_1, abs=ROUNDING * 10)
    assert -mirror_2 == pytest.approx(after_2, abs=ROUNDING * 10)


def test_a_wall_gives_back_the_velocity_times_restitution():
    # mutation: inf/inf instead of the limit of the shares
    after = post_impact_velocities(2.0, 0.0, 5.0, np.inf, 0.5)
    assert after == (-1.0, 0.0)
    assert transfer_energies(2.0, 0.0, 5.0, np.inf, 0.5) == (7.5, 0.0)
    assert post_impact_velocities(0.0, -2.0, np.inf, 5.0, 0.5) == (0.0, 1.0)


def test_twins_exchange_velocities_when_elastic_and_share_them_when_plastic():
    assert post_impact_velocities(3.0, -1.0, 7.0, 7.0, 1.0) == (-1.0, 3.0)
    assert post_impact_velocities(3.0, -1.0, 7.0, 7.0, 0.0) == (1.0, 1.0)


def test_broadcasting():
    after_1, after_2 = post_impact_velocities(np.ones((3, 1)), 0.0, [1.0, 2.0], 1.0, 0.5)
    assert after_1.shape == after_2.shape == (3, 2)
