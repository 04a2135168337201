"""Histories of rows against an ODE solver that stops at every event; they share no code."""

from itertools import pairwise

import numpy as np
import pytest
from numpy.testing import assert_allclose
from scipy.integrate import solve_ivp

from per_obspy.pounding.row_history import pounding_history
from per_obspy.pounding.structure import Structure

from .made_up import shaking

DT = 0.02
SOLVER = {"method": "DOP853", "rtol": 1e-12, "atol": 1e-15, "max_step": DT / 4}


def relative_acceleration(structure, displacement, velocity, ground):
    """Return the acceleration of a linear structure relative to the ground."""
    omega = structure.frequency
    return -2 * structure.damping * omega * velocity - omega**2 * displacement - ground


def until_contact(structures, gap, state, start, ground):
    """Integrate a pair from a time within a step to the end of the step, or to a contact."""

    def rate(t, y):
        a = ground(t)
        first = relative_acceleration(structures[0], y[0], y[1], a)
        return [y[1], first, y[3], relative_acceleration(structures[1], y[2], y[3], a)]

    def clearance(_, y):
        return gap - y[0] + y[2]

    # end at a contact only, not at a separation
    clearance.terminal, clearance.direction = True, -1
    end = solve_ivp(rate, (start, DT), state, events=clearance, **SOLVER)
    return end.t[-1], end.y[:, -1].copy(), end.status == 1


def after_impact(structures, v1, v2, restitution):
    """Return both velocities after an impact: momentum stays, relative velocity turns."""
    m1, m2 = (structure.mass for structure in structures)
    mean = (m1 * v1 + m2 * v2) / (m1 + m2)
    turned = restitution * (v1 - v2) / (m1 + m2)
    return mean - m2 * turned, mean + m1 * turned


def impacts_by_ode(acceleration, structures, gap, restitution, count):
    """Return the first impacts of a linear pair: time and velocities before and after of both."""
    found, state = [], np.zeros(4)
    for k in range(len(acceleration) - 1):
        slope, t = (acceleration[k + 1] - acceleration[k]) / DT, 0.0

        def ground(t, start=acceleration[k], slope=slope):
            return start + slope * t

        # from contact to contact, up to the end of the step
        while t < DT and len(found) < count:
            t, state, touch = until_contact(structures, gap, state, t, ground)
            if touch:
                v1, v2 = state[[1, 3]]
                state[[1, 3]] = after_impact(structures, v1, v2, restitution)
                found.append((k * DT + t, v1, state[1], v2, state[3]))
    return np.array(found)


@pytest.mark.parametrize(
    ("first", "second", "gap", "restitution"),
    [
        ((1.5, 0.05, 4.0), (0.6, 0.02, 1.0), 0.03, 0.65),
        ((0.5, 0.02, 1.0), (0.8, 0.10, 5.0), 0.015, 1.0),
        ((2.5, 0.00, 2.0), (0.3, 0.05, 3.0), 0.08, 0.3),
    ],
)
def test_first_impacts(first, second, gap, restitution):
    # catches: a first root that skips an earlier one, wrong step coefficients, impact with swapped
    # masses
    structures, acceleration = [Structure(*first), Structure(*second)], shaking(6.0, 0)
    reference = impacts_by_ode(acceleration, structures, gap, restitution, count=6)
    assert len(reference) >= 3
    impacts = pounding_history(acceleration, DT, structures, gap, restitution).impacts
    columns = [f"velocity_{when}_{i}" for i in (1, 2) for when in ("before", "after")]
    found = impacts[["time", *columns]].to_numpy()[: len(reference)]
    # the required accuracy of a contact, s; the solver's own, with accelerations ~ 5
    assert_allclose(found[:, 0], reference[:, 0], rtol=0, atol=1e-8)
    assert_allclose(found[:, 1:], reference[:, 1:], rtol=0, atol=1e-7)


class Branch:
    """Branch of a bilinear force: elastic (side 0) or yielding to one side (-1 or 1)."""

    def __init__(self, structure):
        """Begin on the elastic branch, without plastic displacement."""
        self.structure, self.side, self.plastic = structure, 0, 0.0

    def force(self, displacement):
        """Return the force per mass."""
        s, k = self.structure, self.structure.frequency**2
        spring = displacement - self.plastic if self.side == 0 else self.side * s.yield_displacement
        return s.hardening * k * displacement + (1 - s.hardening) * k * spring

    def leaves(self, _, state):
        """Return a number that falls to 0 where the branch ends."""
        if self.side:
            return self.side * state[1]
        return self.structure.yield_displacement - abs(state[0] - self.plastic)

    def change(self, displacement):
        """Yield, or unload with a margin that keeps the elastic branch from ending at once."""
        limit = self.structure.yield_displacement
        if self.side == 0:
            self.side = int(np.sign(displacement - self.plastic))
        else:
            self.plastic, self.side = displacement - self.side * limit * (1 - 1e-13), 0


def until_change(branch, state, start, ground):
    """Integrate from a time within a step to the end of the step, or to the end of the branch."""
    viscosity = 2 * branch.structure.damping * branch.structure.frequency

    def rate(t, y):
        return [y[1], -branch.force(y[0]) - viscosity * y[1] - ground(t)]

    def leaves(t, y):
        return branch.leaves(t, y)

    # the branch changes only on the way out
    leaves.terminal, leaves.direction = True, -1
    end = solve_ivp(rate, (start, DT), state, events=leaves, **SOLVER)
    return end.t[-1], end.y[:, -1], end.status == 1


def bilinear_by_ode(acceleration, structure):
    """Return the displacement at the samples, stopping at each change of stiffness."""
    branch, states = Branch(structure), [np.zeros(2)]
    for begin, end in pairwise(acceleration):
        t, state = 0.0, states[-1]

        def ground(t, begin=begin, slope=(end - begin) / DT):
            return begin + slope * t

        # from branch to branch, up to the next sample
        while t < DT:
            t, state, ends = until_change(branch, state, t, ground)
            if ends:
                branch.change(state[0])
        states.append(state)
    return np.array(states)[:, 0]


@pytest.mark.parametrize("oscillator", [(0.7, 0.03), (1.1, 0.05)])
def test_bilinear_without_contact(oscillator):
    # catches: yield force without hardening, plastic displacement not carried to the next cycle
    acceleration = shaking(6.0, 3)
    structure = Structure(*oscillator, 1.0, yield_displacement=0.02, hardening=0.1)
    history = pounding_history(
        acceleration, DT, [structure, structure], 10.0, 0.5, free_vibration=False
    )
    reference = bilinear_by_ode(acceleration, structure)
    # the solver's event tolerance
    assert_allclose(history.displacement[0], reference, rtol=0, atol=1e-8)
