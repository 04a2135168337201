"""Tables that the kernels of pounding work on."""

import math

import pytest

from per_obspy.pounding.history.tables import refinement


class TestRefinement:
    @pytest.mark.parametrize(
        ("period", "dt"), [(1.0, 0.01), (0.05, 0.02), (0.001, 0.01), (0.2, 0.02)]
    )
    def test_keeps_the_angle_of_a_segment_small(self, period, dt):
        parts = refinement(2 * math.pi / period, dt)
        angle = 2 * math.pi / period * dt / parts
        assert angle <= 0.7
        assert parts == 1 or angle > 0.35
