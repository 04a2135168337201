"""What the histories of pairs and rows have in common: tables for the kernels, and the record's end."""

import math
from collections.abc import Sequence

import numpy as np

from per_obspy.checks import FloatArray
from per_obspy.kernels.pounding_events import motion
from per_obspy.kernels.pounding_lanes.run_block import SETTLING_STEPS
from per_obspy.pounding.structure import Structure

#: Free vibration after the record is followed for this many of the longest period at most.
FREE_PERIODS = 20.0


def structure_table(structures: Sequence[Structure]) -> FloatArray:
    """
    Return the kernels' table of structures.

    Parameters
    ----------
    structures : sequence of Structure
        From left to right.

    Returns
    -------
    (n_structures, 6) ndarray
        Half damping rate ``xi omega`` (1/s), squared frequency (rad²/s²), hardening, yield
        displacement (m), participation, mass (kg).
    """
    return np.array(
        [
            (
                s.damping * s.frequency,
                s.frequency**2,
                s.hardening,
                s.yield_displacement,
                s.participation,
                s.mass,
            )
            for s in structures
        ]
    )


def row_at_rest(table: FloatArray, gaps: FloatArray, restitution: FloatArray) -> FloatArray:
    """
    Return rows of structures at rest, as the kernels' tables; structures without a gap start in contact.

    Parameters
    ----------
    table : (..., n_structures, 6) ndarray
        As from `structure_table`.
    gaps : (..., n_structures - 1) ndarray
        In m.
    restitution : (..., n_structures - 1) ndarray
        Dimensionless.

    Returns
    -------
    (..., n_structures, ROW_COLUMNS) ndarray
        For the kernels; when bounces end is still to be set.
    """
    row = np.zeros((*table.shape[:-1], motion.ROW_COLUMNS))
    row[..., :6] = table
    row[..., :-1, motion.GAP] = gaps
    row[..., :-1, motion.RESTITUTION] = restitution
    row[..., :-1, motion.IN_CONTACT] = gaps <= 0.0
    return row


def refinement(largest_frequency: float, dt: float) -> int:
    """
    Return into how many equal segments each sampling interval is cut, so that Taylor series are short.

    Parameters
    ----------
    largest_frequency : float
        Undamped circular frequency, rad/s.
    dt : float
        Sampling interval, s.

    Returns
    -------
    int
        A power of two; 1 where the shortest period is above about 9 dt.
    """
    doublings = max(0, math.ceil(math.log2(largest_frequency * dt / motion.LARGEST_ANGLE)))
    return 1 << doublings


def free_samples(longest_period: float, dt: float) -> int:
    """
    Return for how many sampling intervals free vibration after the record is followed at most.

    Parameters
    ----------
    longest_period : float
        Of the structures, s.
    dt : float
        Sampling interval, s.

    Returns
    -------
    int
        A multiple of the steps between two looks at whether a pair is settled; at least one such
        round.
    """
    return SETTLING_STEPS * max(1, int(FREE_PERIODS * longest_period / (SETTLING_STEPS * dt)))


def closed_record(acceleration: FloatArray) -> FloatArray:
    """
    Return a record that ends at zero: unless it does, one sample of zero is appended (a ramp of length dt).

    Parameters
    ----------
    acceleration : (..., n_samples) ndarray
        In m/s².

    Returns
    -------
    (..., n_samples or n_samples + 1) ndarray
        In m/s².
    """
    if not acceleration[..., -1].any():
        return acceleration
    return np.concatenate([acceleration, np.zeros((*acceleration.shape[:-1], 1))], axis=-1)


def largest_ground_velocity(acceleration: FloatArray, dt: float) -> float:
    """
    Return the largest velocity of the ground, as the scale against which speeds are small.

    Parameters
    ----------
    acceleration : (n_samples,) ndarray
        In m/s².
    dt : float
        Sampling interval, s.

    Returns
    -------
    float
        In m/s; the ground starts at rest.
    """
    steps = 0.5 * dt * (acceleration[1:] + acceleration[:-1])
    return float(np.abs(np.cumsum(steps)).max(initial=0.0))
