"""Tables of structures for the kernels, steps per sampling interval, and the end of a record."""

import math
from collections.abc import Sequence

import numpy as np

from per_obspy.checks import FloatArray
from per_obspy.kernels.pounding_events import motion
from per_obspy.kernels.pounding_lanes.run_block import SETTLING_STEPS
from per_obspy.pounding.structure import Structure

#: Free vibration after the record is followed for this many of the longest period at most.
PERIODS_AFTER_RECORD = 20.0


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
    rows = []
    for structure in structures:
        omega = structure.frequency
        spring = structure.damping * omega, omega**2, structure.hardening
        rows.append(
            (*spring, structure.yield_displacement, structure.participation, structure.mass)
        )
    return np.array(rows)


def row_at_rest(table: FloatArray, gaps: FloatArray, restitution: FloatArray) -> FloatArray:
    """
    Return the rows of structures at rest; structures without a gap start in contact.

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
    Return the number of segments per sampling interval for which Taylor series are short.

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
    Return the sampling intervals for which free vibration is followed at most.

    Parameters
    ----------
    longest_period : float
        Of the structures, s.
    dt : float
        Sampling interval, s.

    Returns
    -------
    int
        A multiple of the steps between two checks of whether a pair is settled; at least one such
        round.
    """
    rounds = int(PERIODS_AFTER_RECORD * longest_period / (SETTLING_STEPS * dt))
    return SETTLING_STEPS * max(1, rounds)


def closed_record(acceleration: FloatArray) -> FloatArray:
    """
    Return a record that ends at zero: otherwise a sample of zero is appended (a ramp of dt).

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
