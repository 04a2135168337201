"""Added damping and required gap: just enough, and found where bisection would fail."""

import numpy as np
import pytest

from per_obspy.pounding.correlation import ddc_correlation
from per_obspy.pounding.critical_gap import critical_gap
from per_obspy.pounding.single_hit import single_hit
from per_obspy.pounding.supplemental_damping import (
    _least,
    required_gap,
    supplemental_damping,
)
from per_obspy.spectra.elastic import per_spectrum

DT = 0.02
RNG = np.random.default_rng(8)
GROUND = RNG.standard_normal(600) * np.sin(np.linspace(0, np.pi, 600))


def needed_gap(damping_1, damping_2, period_1=0.9, period_2=1.2):
    per_1, per_2 = (
        per_spectrum(GROUND, DT, [t], x)[0]
        for t, x in ((period_1, damping_1), (period_2, damping_2))
    )
    return float(
        critical_gap(per_1, per_2, ddc_correlation(period_1, damping_1, period_2, damping_2))
    )


def test_the_added_damping_is_just_enough():
    # mutation: damping not given to the correlation; the grid point instead of the root
    gap = 0.8 * needed_gap(0.05, 0.05)
    found = supplemental_damping(GROUND, DT, 0.9, 0.05, 1.2, 0.05, gap)
    assert needed_gap(0.05 + found.damping, 0.05 + found.damping) == pytest.approx(gap, rel=1e-9)
    assert found.smallest_gap <= gap


def test_shares_go_to_their_structure():
    # mutation: shares exchanged
    gap = 0.95 * needed_gap(0.02, 0.05)
    found = supplemental_damping(GROUND, DT, 0.9, 0.02, 1.2, 0.05, gap, share_1=1.0, share_2=0.5)
    assert needed_gap(0.02 + found.damping, 0.05 + found.damping / 2) == pytest.approx(
        gap, rel=1e-9
    )


def test_enough_already_and_never_enough():
    largest = needed_gap(0.05, 0.05)
    assert supplemental_damping(GROUND, DT, 0.9, 0.05, 1.2, 0.05, 1.001 * largest).damping == 0.0
    never = supplemental_damping(GROUND, DT, 0.9, 0.05, 1.2, 0.05, 0.0)
    assert np.isnan(never.damping)
    assert not never.robust
    assert 0 < never.smallest_gap < largest


def test_a_demand_that_rises_again_is_not_robust():
    # mutation: plain bisection, which never sees the dip. A demand with its minimum 0.08 at 0.1, as
    # El Centro has one
    def demand(added):
        return 0.08 + 4.0 * (added - 0.1) ** 2

    found = _least(demand, 0.09, 0.4)
    assert found.damping == pytest.approx(0.05, abs=1e-10)
    assert not found.robust
    assert _least(demand, 0.5, 0.4) == (0.0, pytest.approx(0.08), True)
    assert _least(demand, 0.13, 0.4) == (0.0, pytest.approx(0.08), False)


def test_required_gap_is_the_last_that_fails():
    # mutation: the first gap that meets the target, which a smaller amplification at small gaps may
    # offer
    pair = 0.3, 0.4, 1.0, 1.3, 1.0, 2.0, 0.65, 0.5

    def worst(gap):
        hit = single_hit(*pair, gap)
        return np.maximum(hit.amplification_1, hit.amplification_2)

    gap = required_gap(*pair, 1.15)
    assert worst(gap) <= 1.15 < worst(gap * (1 - 1e-9))
    assert np.all(worst(np.linspace(gap, 0.5, 500)) <= 1.15)
    assert required_gap(*pair, 50.0) == 0.0
    assert required_gap(*pair, 1.0) == pytest.approx(0.5)
    assert np.isnan(required_gap(1.0, 0.3, 1.0, 1.4, 1.0, 1.0, 0.65, 0.2, 1.2))


def test_a_target_below_one_is_refused():
    with pytest.raises(ValueError, match="target"):
        required_gap(0.3, 0.4, 1.0, 1.3, 1.0, 2.0, 0.65, 0.5, 0.9)
