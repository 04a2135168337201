"""The least link: on the edge of contact, zero where none is needed, NaN where none helps."""

import numpy as np
import pytest

from per_obspy.pounding.history.links import linked_history
from per_obspy.pounding.mitigation.required_link import (
    required_link_damping,
    required_link_stiffness,
)
from per_obspy.pounding.structure import Structure

DT = 0.01
MOTION = np.random.default_rng(2).normal(size=800) * np.hanning(800)
PAIR = Structure(1.0, 0.05, 2e5), Structure(0.6, 0.05, 1e5)
FREE = linked_history(MOTION, DT, *PAIR, 0.0).closing


@pytest.mark.parametrize("search", [required_link_stiffness, required_link_damping])
def test_the_least_link_just_keeps_the_gap_open(search):
    # mutation: stiffness and damping exchanged, the larger side of the interval refined, u2 - u1
    # for u1 - u2
    gap = 0.7 * FREE
    link = search(MOTION, DT, *PAIR, gap, 1e3, 1e9)
    arguments = (link.value, 0.0) if search is required_link_stiffness else (0.0, link.value)
    assert linked_history(MOTION, DT, *PAIR, *arguments).closing == pytest.approx(
        gap, rel=1e-4
    )  # slope times CLOSE
    assert link.force_maximum > 0


def test_no_link_is_needed_where_the_gap_suffices():
    link = required_link_stiffness(MOTION, DT, *PAIR, 1.01 * FREE, 1e3, 1e9)
    assert link.value == 0.0
    assert link.force_maximum == 0.0


def test_a_rigid_link_keeps_them_together():
    # mutation: a range that ends too early being called enough
    link = required_link_stiffness(MOTION, DT, *PAIR, 1e-3 * FREE, 1e3, 1e11)
    assert np.isfinite(link.value)
    weak = required_link_stiffness(MOTION, DT, *PAIR, 1e-3 * FREE, 1e-3, 1.0)
    assert np.isnan(weak.value)
    assert weak.smallest_closing == pytest.approx(FREE, rel=1e-3)  # 1 N/m beside 8e6 N/m


def test_bad_ranges_are_named():
    with pytest.raises(ValueError, match="largest must be above smallest"):
        required_link_stiffness(MOTION, DT, *PAIR, 0.1, 10.0, 1.0)
    with pytest.raises(ValueError, match=r"gap must be zero or more, got -1\.0"):
        required_link_stiffness(MOTION, DT, *PAIR, -1.0, 1.0, 10.0)
