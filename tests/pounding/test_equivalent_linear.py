"""Equivalent linear structures: the elastic limit, secant geometry, loop areas, labels."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from per_obspy.pounding.equivalent_linear import (
    METHODS,
    UnverifiedEquivalentLinear,
    equivalent_linear,
)


@pytest.mark.parametrize("method", METHODS)
def test_without_yielding_nothing_changes(method):
    assert equivalent_linear(method, 1.0, 0.8, 0.03, 0.05) == (0.8, 0.03)
    assert equivalent_linear(method, 0.4, 0.8, 0.03, 0.05) == (0.8, 0.03)


@pytest.mark.parametrize("method", [name for name in METHODS if name != "gulkan_sozen"])
def test_it_starts_at_the_elastic_structure(method):
    # mutation: ductility for ductility - 1
    period, damping = equivalent_linear(method, 1.0 + 1e-9, 0.8, 0.03, 0.05)
    assert period == pytest.approx(0.8, rel=1e-6)
    assert damping == pytest.approx(0.03, abs=1e-4)  # Iwan rises like (mu - 1)^0.371


@given(st.floats(1.01, 20.0), st.floats(0.0, 0.9))
def test_secant_stiffness_and_loop_area(ductility, hardening):
    # a loop of the bilinear force between -mu and +mu, by the shoelace formula; mutation: 4 for 2
    # pi, alpha misplaced
    peak = 1.0 + hardening * (ductility - 1.0)
    corners = np.array(
        [
            [ductility, peak],
            [ductility - 2, peak - 2],
            [-ductility, -peak],
            [2 - ductility, 2 - peak],
        ]
    )
    x, y = corners.T
    area = 0.5 * abs(np.dot(x, np.roll(y, 1)) - np.dot(y, np.roll(x, 1)))
    damping = 0.02 + area / (2 * np.pi * peak * ductility)
    found = equivalent_linear("rosenblueth_herrera", ductility, 1.5, 0.02, hardening)
    assert found.period == pytest.approx(1.5 * np.sqrt(ductility / peak), rel=1e-12)
    assert found.damping == pytest.approx(damping, abs=1e-12)
    for secant in ("gulkan_sozen", "kowalsky"):
        assert equivalent_linear(
            secant, min(ductility, 4.0), 1.5, 0.2, 0.0
        ).period == pytest.approx(1.5 * np.sqrt(min(ductility, 4.0)), rel=1e-12)


@pytest.mark.parametrize(("method", "ductility", "period", "damping"), [
    ("gulkan_sozen", 4.0, 2.0, 0.12), ("kowalsky", 4.0, 2.0, 0.05 + 0.5 / np.pi),
    ("iwan", 2.0, 1.121, 0.1087), ("fema_440", 3.0, 1.496, 0.05 + 0.108),
    ("fema_440", 5.0, 1.80, 0.05 + 0.1528),
])  # fmt: skip
def test_published_formulas_at_round_ductilities(method, ductility, period, damping):
    # worked by hand from the formulas with hardening 0 and 5 % damping
    assert equivalent_linear(method, ductility, 1.0, 0.05, 0.0) == pytest.approx(
        (period, damping), rel=1e-12
    )


def test_fema_440_is_continuous_at_its_upper_join():
    below, above = (
        equivalent_linear("fema_440", 6.5 + step, 1.0, 0.05, 0.0) for step in (-1e-9, 1e-9)
    )
    assert above == pytest.approx(below, rel=0.03)  # the published pieces meet within 3 %


def test_unverified_coefficients_say_so():
    for method in ("jeng_unverified", "kasai_unverified"):
        found = equivalent_linear(method, 2.0, 1.0, 0.05, 0.0)
        assert isinstance(found, UnverifiedEquivalentLinear)
        assert "Unverified" in repr(found)
    assert "Unverified" not in repr(equivalent_linear("iwan", 2.0, 1.0, 0.05, 0.0))
