"""Result of a statistical linearization of a pair."""

from typing import NamedTuple

import numpy as np

from per_obspy.checks import FloatArray


class LinearizedEstimate(NamedTuple):
    """
    One estimate of a pair.

    ``correlation`` of the displacements, dimensionless; for both structures (2,) the equivalent
    ``period`` (s), ``damping`` (fraction of critical) and ``sigma``, the standard deviation of
    displacement (m): right for the correlation, but 17 to 42 % too small as a displacement of
    structures that yield. NaN unless ``converged``.
    """

    correlation: float
    period: FloatArray
    damping: FloatArray
    sigma: FloatArray
    converged: bool


def failed() -> LinearizedEstimate:
    """Return an estimate without numbers."""
    missing = np.full(2, np.nan)
    return LinearizedEstimate(
        float("nan"), missing, missing.copy(), missing.copy(), converged=False
    )
