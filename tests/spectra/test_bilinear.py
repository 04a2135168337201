"""Bilinear oscillators: energy, limits and symmetries first, then an ODE solver."""

from functools import partial

import numpy as np
import pytest
from numpy.testing import assert_allclose, assert_array_equal
from scipy.integrate import solve_ivp

from per_obspy.constants import STANDARD_GRAVITY
from per_obspy.spectra.bilinear import (
    bilinear_response,
    constant_yield_spectra,
)
from per_obspy.spectra.elastic import response_spectra

DT = 0.01
PERIOD, DAMPING = 0.5, 0.05
OMEGA = 2 * np.pi / PERIOD
CASES = [(0.02, 0.1), (0.02, 0.0), (0.003, 0.02), (0.012, 0.5)]


@pytest.fixture(scope="module")
def record():
    """6 s of smoothed noise that ends at zero, m/s²."""
    noise = np.convolve(np.random.default_rng(5).normal(size=596), np.ones(5) / 2)
    return np.append(noise[:-1], 0.0)


@pytest.mark.parametrize("hardening", [0.0, 0.3, 1.0])
def test_no_yielding_is_the_linear_oscillator(record, hardening):
    # catches any difference of the two solutions: step coefficients here, series there
    linear = response_spectra(record, DT, [PERIOD], DAMPING)
    for limit in (np.inf, 1.0001 * linear.sd[0]):
        ours = bilinear_response(record, DT, PERIOD, DAMPING, limit, hardening)
        assert_allclose(ours.displacement_maximum, linear.sd[0], rtol=1e-12)
        assert_allclose([ours.displacement_radius, ours.energy_radius], linear.per[0], rtol=1e-12)
        assert ours.hysteretic_energy == ours.residual == 0.0
        assert_array_equal(ours.plastic_displacement, np.zeros(record.size))


def test_full_hardening_is_the_linear_oscillator(record):
    linear = response_spectra(record, DT, [PERIOD], DAMPING)
    ours = bilinear_response(record, DT, PERIOD, DAMPING, 0.001, 1.0)
    # yielding begins 1e-12 beyond the yield displacement
    assert_allclose(ours.displacement_radius, linear.per[0], rtol=1e-10)
    assert ours.hysteretic_energy == 0.0


@pytest.mark.parametrize(("limit", "hardening"), CASES)
def test_energy_is_conserved(record, limit, hardening):
    # input - damping = kinetic + recoverable + hysteretic: catches a wrong event, offset or path. 8
    # samples between make the trapezoid of input and damping good to 1e-4 of the input; free
    # vibration is left out by comparing at the last sample, with the path up to there
    fine, dt = _finer(record, 8), DT / 8
    ours = bilinear_response(fine, dt, PERIOD, DAMPING, limit, hardening)
    u, v, p = ours.displacement, ours.velocity, ours.plastic_displacement
    given = -np.trapezoid(fine * v, dx=dt)
    damped = np.trapezoid(2 * DAMPING * OMEGA * v**2, dx=dt)

    # Per unit mass
    kinetic = 0.5 * v[-1] ** 2
    elastic = hardening * u[-1] ** 2 + (1 - hardening) * (u[-1] - p[-1]) ** 2
    recoverable = 0.5 * OMEGA**2 * elastic
    yielded = (1 - hardening) * OMEGA**2 * limit * np.abs(np.diff(p)).sum()
    assert_allclose(given - damped, kinetic + recoverable + yielded, atol=1e-3 * given)


def _finer(record, count):
    """Return so many times as many samples on the same straight lines."""
    steps = np.arange((record.size - 1) * count + 1) / count
    return np.interp(steps, np.arange(record.size), record)


@pytest.mark.parametrize(("limit", "hardening"), CASES)
def test_laws_of_the_branches(record, limit, hardening):
    ours = bilinear_response(record, DT, PERIOD, DAMPING, limit, hardening)
    elastic = ours.displacement - ours.plastic_displacement
    assert np.abs(elastic).max() <= limit * (1 + 1e-11)  # rounding of the event
    moving = np.diff(ours.plastic_displacement) != 0
    assert 0 < moving.sum() < record.size - 1
    assert ours.displacement_radius >= ours.displacement_maximum
    # recoverable energy at yielding is at least that of the yield displacement
    assert ours.energy_radius >= limit * np.sqrt(1 - hardening)
    assert ours.ductility == ours.displacement_maximum / limit
    assert ours.hysteretic_energy > 0


@pytest.mark.parametrize(("limit", "hardening"), CASES)
def test_mirrored_and_scaled_motion(record, limit, hardening):
    # catches a sign taken for granted and a threshold with a dimension
    once = bilinear_response(record, DT, PERIOD, DAMPING, limit, hardening)
    other = bilinear_response(-4.0 * record, DT, PERIOD, DAMPING, 4.0 * limit, hardening)
    assert_allclose(other.displacement, -4.0 * once.displacement, rtol=1e-12, atol=1e-15)
    assert_allclose(other.energy_radius, 4.0 * once.energy_radius, rtol=1e-12)
    assert_allclose(other.hysteretic_energy, 16.0 * once.hysteretic_energy, rtol=1e-9)
    assert_allclose(other.residual, -4.0 * once.residual, rtol=1e-9)


@pytest.mark.parametrize(("limit", "hardening"), CASES)
def test_more_samples_of_the_same_straight_lines_change_nothing(record, limit, hardening):
    # catches events taken at samples or span ends; events amplify rounding a little
    fine = _finer(record, 3)
    once = bilinear_response(record, DT, PERIOD, DAMPING, limit, hardening)
    finer = bilinear_response(fine, DT / 3, PERIOD, DAMPING, limit, hardening)
    scale = once.displacement_maximum
    assert_allclose(finer.displacement[::3], once.displacement, atol=1e-9 * scale)
    assert_allclose(finer[3:], once[3:], rtol=1e-9)


def test_elastoplastic_block_pushed_by_a_constant_acceleration():
    # closed form without hardening and damping: the yield force leaves the constant rest a - omega²
    # uy
    limit, pull = 0.01, 5.0
    push = np.full(40, -pull)
    ours = bilinear_response(push, DT, PERIOD, 0.0, limit, 0.0)
    static = pull / OMEGA**2
    phase = np.arccos(1 - limit / static)
    velocity = static * OMEGA * np.sin(phase)
    time = np.arange(40) * DT - phase / OMEGA
    expected = limit + velocity * time + 0.5 * (pull - OMEGA**2 * limit) * time**2
    yielding = time > 0
    assert_allclose(ours.displacement[yielding], expected[yielding], rtol=1e-11)


def _by_ode_solver(record, limit, hardening):
    """Displacements at the samples by DOP853 with its own event location, branch by branch."""
    ground = partial(np.interp, xp=np.arange(record.size) * DT, fp=record)
    state, plastic, branch, found = np.zeros(2), 0.0, 0, [0.0]
    for i in range(record.size - 1):
        time, end = i * DT, (i + 1) * DT
        while time < end:
            # The elastic part of the displacement stays at the limit on a yielding branch
            elastic = (0.0, branch * limit) if branch else (1.0, -plastic)
            piece = _solve_branch(ground, (time, end), state, elastic, limit, hardening)
            time, state = piece.t[-1], piece.y[:, -1]
            if branch:
                plastic = state[0] - branch * limit
            # An event begins yielding, or ends it at rest
            if piece.status == 1:
                branch = 0 if branch else int(np.sign(state[0] - plastic))
                if not branch:
                    state[1] = 0.0
        found.append(state[0])
    return np.array(found)


def _solve_branch(ground, span, state, elastic, limit, hardening):
    """Solve a branch, with the elastic displacement linear in the whole one, until it ends."""
    slope, offset = elastic

    def rates(t, x):
        force = OMEGA**2 * (hardening * x[0] + (1 - hardening) * (slope * x[0] + offset))
        return x[1], -2 * DAMPING * OMEGA * x[1] - force - ground(t)

    # Yielding begins at the yield displacement and ends when the velocity turns
    def over(_, x):
        return limit - abs(x[0] + offset) if slope else np.sign(offset) * x[1]

    over.terminal, over.direction = True, -1
    return solve_ivp(rates, span, state, "DOP853", events=over, rtol=1e-11, atol=1e-14)


@pytest.mark.parametrize(("limit", "hardening"), [(0.01, 0.1), (0.01, 0.0), (0.02, 0.5)])
def test_agrees_with_an_ode_solver(record, limit, hardening):
    # the solver's tolerance of 1e-11, amplified by some ten events
    part = record[:200]
    ours = bilinear_response(part, DT, PERIOD, DAMPING, limit, hardening)
    assert ours.ductility > 1.5
    assert_allclose(
        ours.displacement,
        _by_ode_solver(part, limit, hardening),
        atol=1e-8 * ours.displacement_maximum,
    )


def test_constant_yield_spectra_are_single_responses(record):
    periods = np.array([0.2, 0.5, 1.5])
    spectra = constant_yield_spectra(record, DT, periods, DAMPING, 0.1, 0.05)
    for i, period in enumerate(periods):
        limit = 0.1 * STANDARD_GRAVITY * (period / (2 * np.pi)) ** 2
        alone = bilinear_response(record, DT, period, DAMPING, limit, 0.05)
        # the yield displacement differs in the last bit
        assert_allclose(spectra.displacement_radius[i], alone.displacement_radius, rtol=1e-12)
        assert_allclose(spectra.residual[i], alone.residual, rtol=1e-12)
    assert_allclose(spectra.yield_coefficient, 0.1)


@pytest.mark.parametrize(
    ("changed", "message"),
    [
        ({"acceleration": [np.nan]}, "acceleration must be finite, got nan"),
        ({"dt": 0.0}, "dt must be positive, got 0"),
        ({"period": [1.0, 2.0]}, "period must be a single number"),
        ({"damping": 1.0}, "damping must be at least 0 and below 1, got 1.0"),
        ({"yield_displacement": 0.0}, "yield_displacement must be positive, got 0.0"),
        ({"yield_displacement": np.nan}, "yield_displacement must be .* got nan"),
        ({"hardening": 1.1}, "hardening must be between 0 and 1, got 1.1"),
    ],
)
def test_wrong_arguments_are_named(changed, message):
    given = {
        "acceleration": [1.0],
        "dt": DT,
        "period": 1.0,
        "damping": 0.05,
        "yield_displacement": 1,
        "hardening": 0,
    }
    with pytest.raises(ValueError, match=message):
        bilinear_response(**given | changed)
