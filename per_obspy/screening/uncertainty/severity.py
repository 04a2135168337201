"""
Severity of contact from the motion without contact: impact velocity and amplification.

Two oscillators whose relative displacement would reach D and whose relative velocity V hit at a gap
g with ``V sqrt(1 - (g/D)²)`` if their relative motion were harmonic. Earlier impacts keep nearly
equal oscillators from building up a relative motion at all: the velocity is less by the factor
``exp(-1.1 sqrt(rho) (1 - g/D))`` with rho of eq. (16). It was fitted to exact histories in 5 events
of real records; ``workflows/population_accuracy.py`` has its accuracy in others.
"""

from typing import NamedTuple

import numpy as np

from per_obspy.checks import FloatArray

#: Loss of impact velocity by earlier impacts, per root of the correlation: fitted to 1 680 exact
#: histories in Mexico 1985, Maule 2010 and Aomori 2018; its ratio to 3 120 others in Kaikoura 2016
#: and Ridgecrest 2019 has a median of 1.01 and a log-standard deviation of 0.25, whatever gap,
#: restitution and masses.
LOSS = 1.1

#: Share of the change of velocity that adds to the radius, as of a random phase (same histories).
RADIUS_SHARE = 0.7


class RelativeMotion(NamedTuple):
    """
    Motion without contact of pairs at nodes, (n_pairs, n_nodes); all of it grows with the ground.

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
    demand = scale * motion.demand
    moving = demand > gap
    # share of the way that the gap leaves free; 1 without contact
    share = np.divide(gap, demand, out=np.ones(moving.shape), where=moving)
    loss = np.exp(-LOSS * np.sqrt(np.maximum(motion.correlation, 0.0)) * (1.0 - share))
    velocity: FloatArray = scale * motion.velocity * np.sqrt(1.0 - share**2) * loss
    return velocity


def amplification(
    motion: RelativeMotion, velocity: FloatArray, received: tuple[FloatArray, FloatArray]
) -> FloatArray:
    """
    Return the larger ratio of both buildings' radii with and without impact, at least 1.

    Parameters
    ----------
    motion : RelativeMotion
        Without contact.
    velocity : (n_pairs, n_nodes) ndarray
        Impact velocity over the factor of the motion, m/s.
    received : pair of (n_pairs, 1) ndarray
        Change of velocity of building 1 and of 2 over the impact velocity: eq. (7), (8).
    """
    # the larger change of velocity over the speed of its building
    largest = np.zeros_like(velocity)
    for share, speed in zip(received, (motion.speed_1, motion.speed_2), strict=True):
        change = np.broadcast_to(RADIUS_SHARE * share * velocity, velocity.shape)
        moving = np.broadcast_to(speed > 0.0, velocity.shape)
        largest = np.maximum(
            largest, np.divide(change, speed, out=np.zeros_like(velocity), where=moving)
        )
    return np.asarray(np.sqrt(1.0 + largest**2))
