"""Coefficients of the linear rate equation (Gauss-3) against a least-squares fit by quadrature."""

import numpy as np
import pytest
from scipy.stats import multivariate_normal

from per_obspy.pounding.linearization import slip


def trapezoid_weights(axis):
    """Return the weights of the trapezoidal rule on an even grid."""
    return np.gradient(axis) * np.where((axis == axis[0]) | (axis == axis[-1]), 0.5, 1.0)


@pytest.mark.parametrize(("limit", "coherence"), [(0.5, 0.6), (1.5, 0.3), (1.0, -0.2), (0.2, 0.9)])
def test_gauss_3_coefficients(limit, coherence):
    # mutation: a sign of the coherence, Owen's T, a factor 2. Least squares of y' - v
    # = -p v - q y with jointly normal v, y
    density = multivariate_normal(cov=[[1.0, coherence], [coherence, 1.0]])
    p, q = slip(limit, 1.0, 1.0, coherence)
    velocities, forces = np.linspace(0.0, 8.0, 401), np.linspace(limit, limit + 8.0, 401)
    v, y = np.meshgrid(velocities, forces, indexing="ij")
    weight = density.pdf(np.stack([v, y], axis=-1))
    weight = weight * trapezoid_weights(velocities)[:, None] * trapezoid_weights(forces)

    # both directions of slip contribute alike: E[slip v], E[slip y] with slip = v where v > 0 and y
    # > limit
    moments = 2 * np.array([np.sum(weight * v * v), np.sum(weight * v * y)])

    # normal equations of the fit
    fitted = np.linalg.solve([[1.0, coherence], [coherence, 1.0]], moments)
    np.testing.assert_allclose([p, q], fitted, atol=2e-4)  # trapezoid of 0.02
