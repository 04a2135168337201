"""Dispersions: root of the sum of squares, moments of a lognormal sample, slope of a spectrum."""

import numpy as np
import pytest

from per_obspy.pounding.probability import (
    combined_dispersion,
    combined_dispersion_correlation,
    lognormal_dispersion,
    period_dispersion,
)


def test_dispersions_combine():
    assert combined_dispersion([0.3, 0.4]) == pytest.approx(0.5)
    # shared ground motion 0.3 and 0.4 at 0.9, own periods 0.4 and 0.3: 0.9 * 0.12 / 0.25
    assert combined_dispersion_correlation([0.3, 0.4], [0.4, 0.3], [0.9, 0.0]) == pytest.approx(
        0.432
    )
    assert combined_dispersion_correlation([0.0], [0.3], [1.0]) == 0.0
    rng = np.random.default_rng(2)
    dispersion = float(lognormal_dispersion(0.1, 0.05))
    sample = 0.1 * np.exp(-(dispersion**2) / 2 + dispersion * rng.standard_normal(400_000))
    assert sample.mean() == pytest.approx(0.1, rel=5e-3)  # three standard errors
    assert sample.std() == pytest.approx(0.05, rel=1e-2)


def test_period_dispersion_is_the_slope_over_a_span():
    periods = np.geomspace(0.1, 10.0, 50)
    assert period_dispersion(periods, 0.1 * periods**1.5, 1.0, 0.3) == pytest.approx(0.45)
    with pytest.raises(ValueError, match="do not cover"):
        period_dispersion(periods, periods, 9.0, 0.3)
