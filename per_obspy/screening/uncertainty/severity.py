"""
Severity of contact from the motion without contact: impact velocity and amplification.

Two oscillators whose relative displacement would reach D and whose relative velocity V hit at a gap
g with ``V sqrt(1 - (g/D)²)`` if their relative motion were harmonic. Earlier impacts keep nearly
equal oscillators from building up a relative motion at all: the velocity is less by the factor
``exp(-LOSS sqrt(rho) (1 - g/D))`` with rho of eq. (16). The change of velocity dv of eq. (7) and
(8) amplifies a radius r by ``sqrt(1 + (RADIUS_SHARE dv / (w r))²)``, as of a random phase. The
constants are those of ``kernels/pairs/node_outcomes.py``, fitted to exact histories in 3 events of
real records; ``workflows/population_accuracy.py`` has their accuracy in others.
"""

from typing import NamedTuple

import numpy as np

from per_obspy.checks import FloatArray
from per_obspy.kernels.pairs.node_outcomes import fill_velocities


class RelativeMotion(NamedTuple):
    """
    Motion without contact of pairs at nodes, (n_pairs, n_nodes); proportional to the ground motion.

    Attributes
    ----------
    demand : ndarray
        Largest relative displacement of 1 towards 2 at contact height, m.
    velocity : ndarray
        Largest relative velocity, m/s.
    speed_1, speed_2 : ndarray
        Circular frequency times radius of both oscillators at contact height, m/s.
    correlation : ndarray
        Of both responses by eq. (16), dimensionless.
    """

    demand: FloatArray
    velocity: FloatArray
    speed_1: FloatArray
    speed_2: FloatArray
    correlation: FloatArray

    def rows(self) -> FloatArray:
        """Return the motion as one array, (5, n_pairs, n_nodes), in the order of the kernels."""
        return np.stack(self)


def impact_velocity(motion: RelativeMotion, scale: FloatArray, gap: FloatArray) -> FloatArray:
    """
    Return the largest approach velocity of the impacts, m/s; 0 where the gap is wide enough.

    Parameters
    ----------
    motion : RelativeMotion
        Without contact.
    scale : ndarray
        Factor of the motion, dimensionless; shape (n_pairs, n_nodes) or broadcast to it.
    gap : ndarray
        m, of the same shape.
    """
    shape = motion.demand.shape
    velocity = np.empty(shape)
    scales, gaps = (np.ascontiguousarray(np.broadcast_to(one, shape)) for one in (scale, gap))
    fill_velocities(motion.rows(), scales, gaps, velocity)
    return velocity
