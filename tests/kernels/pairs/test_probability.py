"""The probability kernel without any wrapper, so short that it also runs uncompiled."""

import numpy as np
import pytest

from per_obspy.kernels.pairs.probability import probabilities


def test_a_ratio_that_does_not_matter():
    # correlation 0 and a tiny second radius: the critical gap is the first radius, at its median
    parameters = np.array([[-60.0], [0.1], [0.0], [0.0], [0.3], [0.0]])
    out = np.empty(1)
    probabilities(parameters, out)
    assert out[0] == pytest.approx(0.5, abs=1e-12)
