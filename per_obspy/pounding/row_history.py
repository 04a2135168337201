"""Exact pounding history of two adjacent structures, or of a row of them, with its energies."""

import math
from collections.abc import Sequence
from typing import NamedTuple

import numpy as np
import pandas as pd

from per_obspy import checks
from per_obspy.checks import ArrayLike, FloatArray
from per_obspy.kernels.pounding_events import motion as columns
from per_obspy.kernels.pounding_events.contact import (
    COUNTED_SHARE,
    LOG_COLUMNS,
    SLOWEST_COUNTED,
)
from per_obspy.kernels.pounding_events.row_history import run_history
from per_obspy.pounding.kernel_tables import (
    SPEED_SHARE,
    closed_record,
    free_samples,
    largest_ground_velocity,
    refinement,
    refuse_pressed_walls,
    row_at_rest,
    structure_table,
)
from per_obspy.pounding.structure import Structure
from per_obspy.spectra.trace_arguments import takes_trace


class Energies(NamedTuple):
    """
    Energies of each structure over time, each (n_structures, n_time), J.

    NaN where the mass is infinite. By eq. (3) and (4), ``kinetic + damping + elastic + hysteretic +
    transfer = input``.

    Attributes
    ----------
    input : ndarray
        Work of the ground, relative formulation, ``-m ∫ a v dt``.
    kinetic : ndarray
        ``m v² / 2``.
    damping : ndarray
        Dissipated by viscous damping, ``∫ c v² dt``.
    elastic : ndarray
        Recoverable deformation energy; ``k u² / 2`` if linear.
    hysteretic : ndarray
        Dissipated by yielding; 0 if linear.
    transfer : ndarray
        Given to the neighbours by impacts and contact forces, ``∫ f v dt``; negative if received.
    """

    input: FloatArray
    kinetic: FloatArray
    damping: FloatArray
    elastic: FloatArray
    hysteretic: FloatArray
    transfer: FloatArray


def energies_of(table: FloatArray, motion: FloatArray, work: FloatArray) -> Energies:
    """
    Return the energies of a motion and of the work done along it.

    ``table`` is that of the kernels; ``motion`` (n_time, n_structures, 3) holds displacement (m),
    velocity (m/s) and plastic displacement (m), ``work`` (n_time, n_structures, 4) input, damping,
    hysteretic and transferred energy (J).
    """
    _, stiffness, hardening, limit, _, mass = table.T
    mass = np.where(np.isinf(mass), np.nan, mass)
    displacement, velocity, plastic = np.moveaxis(motion, 2, 0)
    kinetic = 0.5 * mass * velocity**2

    # Recoverable energy: a spring of the hardened stiffness, and one that slips
    stretch = np.where(np.isinf(limit), displacement, displacement - plastic)
    squares = hardening * displacement**2 + (1.0 - hardening) * stretch**2
    elastic = 0.5 * mass * stiffness * squares

    # Work done along the motion, NaN for structures of infinite mass
    done, damping, hysteretic, transfer = (work + 0.0 * mass[:, np.newaxis]).T
    return Energies(done, kinetic.T, damping, elastic.T, hysteretic, transfer)


def closure_of(energies: Energies) -> float:
    """
    Return the largest imbalance of (3), (4) over the largest input or transferred energy.

    Structures of infinite mass are left out, and one that never moves counts as balanced.
    """
    gained, *spent = (part[~np.isnan(energies.input[:, 0])] for part in energies)
    imbalance = np.abs(sum(spent) - gained).max(axis=1, initial=0.0)

    # Relative to the larger of input and transfer of each structure
    scale = np.maximum(np.abs(gained), np.abs(spent[-1])).max(axis=1, initial=0.0)
    return float((imbalance / np.where(scale > 0, scale, np.inf)).max(initial=0.0))


#: Impacts within one sampling interval after which structures that are pressed together stay in
#: contact.
BOUNCES_OF_ROWS = 100_000
#: Impacts for which there is room at first: touching pairs have some thousands, and room that is
#: not used costs no memory.
FIRST_ROOM = 8192
#: Columns of the kernels' log of impacts.
LOGGED = [
    "time",
    "left",
    "velocity_before_1",
    "velocity_after_1",
    "velocity_before_2",
    "velocity_after_2",
    "impulse",
    "displacement_1",
    "displacement_2",
]


class PoundingHistory(NamedTuple):
    """
    Motion, impacts and energies of a row of structures.

    Attributes
    ----------
    time : (n_time,) ndarray
        Since the first sample of the record, s.
    displacement, velocity, plastic_displacement : (n_structures, n_time) ndarray
        At contact level, relative to the ground, positive towards the last structure, m and m/s; at
        the instant of an impact the velocity after it.
    impacts : DataFrame
        One row per impact: ``time`` (s), ``left`` (index of the structure left of the gap),
        ``velocity_before_i``, ``velocity_after_i`` (m/s), ``displacement_i`` (m),
        ``transfer_energy_i`` (J) for the left (1) and right (2) structure, ``impulse`` (N s),
        ``energy_loss`` (J), and ``counted``: whether it is faster than 1 mm/s and than 1 % of the
        fastest of its gap, as the impacts of `PoundingMaxima` are.
    per : (n_structures,) ndarray
        Largest radius ``sqrt(u² + (v / omega)²)`` with pounding, exact between samples, m.
    displacement_maxima : (n_structures,) ndarray
        Largest displacement to either side, exact between samples, m.
    energy_radius : (n_structures,) ndarray
        Largest radius of the recoverable energy, ``sqrt(2 E / (m omega²))``, m; equal to ``per`` if
        linear.
    opening_maxima : (n_structures - 1,) ndarray
        Largest opening of each gap beyond its width at rest, ``max(u_right - u_left)``, exact
        between samples, m.
    energies : Energies
        Of each structure over time, J.
    closure : float
        Largest imbalance of (3), (4) over the largest input (or transferred) energy of the
        structure, dimensionless.
    """

    time: FloatArray
    displacement: FloatArray
    velocity: FloatArray
    plastic_displacement: FloatArray
    impacts: pd.DataFrame
    per: FloatArray
    displacement_maxima: FloatArray
    energy_radius: FloatArray
    opening_maxima: FloatArray
    energies: Energies
    closure: float


@takes_trace
def pounding_history(
    acceleration: ArrayLike,
    dt: float,
    structures: Sequence[Structure],
    gaps: ArrayLike,
    restitution: ArrayLike,
    free_vibration: bool = True,
) -> PoundingHistory:
    """
    Compute the exact history of structures that hit each other, with impacts (7), (8).

    Between events every structure follows the exact solution for ground acceleration that is linear
    between samples; contacts are the first roots of the clearance on that solution. Structures that
    touch without bouncing (restitution 0, the end of a chatter, no gap) move together until the
    contact force would turn into tension. In a row, impacts at one instant are taken pair by pair
    from left to right until no touching pair approaches, so that the result of simultaneous hits
    depends on the order of the row.

    Parameters
    ----------
    acceleration : (n_samples,) array_like or obspy Trace
        Ground acceleration, positive from the first structure towards the last, m/s². If it does
        not end at zero, it is closed by one ramp of length dt.
    dt : float
        Sampling interval, s; not given with a Trace.
    structures : sequence of Structure
        From left to right, two or more.
    gaps : float or (n_structures - 1,) array_like
        Clear distances at rest, m; 0 starts in contact.
    restitution : float or (n_structures - 1,) array_like
        Coefficient of each gap, between 0 and 1.
    free_vibration : bool
        Go on after the record as long as a gap can close or a displacement grow, at most 20 of the
        longest period; else the history ends with the record's last sample.

    Returns
    -------
    PoundingHistory
        Motion at the samples, impacts, maxima and energies.

    Raises
    ------
    ValueError
        If an argument is outside its range, or there are not N - 1 gaps for N structures.

    Notes
    -----
    Impact sequences are chaotic: after some ten impacts two correct programs may differ.

    References
    ----------
    Valles-Mattox & Reinhorn (1996), An energy approach to pounding of structures, 11WCEE, eq.
    (1)-(8).

    Examples
    --------
    >>> pulse = np.sin(np.linspace(0.0, 6.0 * np.pi, 301))
    >>> tower, annex = Structure(1.5, 0.05, 4e5), Structure(0.4, 0.05, 2e5)
    >>> history = pounding_history(pulse, 0.01, [tower, annex], 0.02, 0.6)
    >>> bool(history.closure < 1e-10), bool((history.impacts["energy_loss"] > 0).all())
    (True, True)
    """
    record = checks.record("acceleration", acceleration)
    step = checks.number("dt", dt, checks.positive)
    gap, bounce = _checked_gaps(gaps, restitution, len(structures))
    table = structure_table(structures)
    refuse_pressed_walls(table[:, 5], gap, np.zeros(len(table), dtype=np.int64), "structures")

    # Follow the free vibration after the record
    samples = record.size
    if free_vibration:
        record = closed_record(record)
        samples = record.size + int(free_samples(max(one.period for one in structures), step))

    # Limits at which bouncing ends in contact
    start = row_at_rest(table, gap, bounce)
    velocity = SPEED_SHARE * largest_ground_velocity(record, step)
    start[0, columns.STICKING_SPEED] = velocity * table[:, 4].max()
    start[0, columns.BOUNCE_LIMIT] = BOUNCES_OF_ROWS
    return _history(step, table, *_run(record, step, start, samples))


def _history(
    dt: float,
    table: FloatArray,
    row: FloatArray,
    log: FloatArray,
    motion: FloatArray,
    work: FloatArray,
) -> PoundingHistory:
    displacement, velocity, plastic = motion.T.copy()

    # Energy balance (3), (4)
    energies = energies_of(table, motion, work)
    return PoundingHistory(
        time=dt * np.arange(len(motion), dtype=np.float64),
        displacement=displacement,
        velocity=velocity,
        plastic_displacement=plastic,
        impacts=impact_table(log),
        per=np.sqrt(row[:, columns.LARGEST_RADIUS_SQUARED]),
        displacement_maxima=row[:, columns.LARGEST_DISPLACEMENT].copy(),
        energy_radius=np.sqrt(row[:, columns.LARGEST_ENERGY_RADIUS_SQUARED]),
        opening_maxima=row[:-1, columns.OPENING].copy(),
        energies=energies,
        closure=closure_of(energies),
    )


def _run(
    record: FloatArray, step: float, start: FloatArray, samples: int
) -> tuple[FloatArray, FloatArray, FloatArray, FloatArray]:
    """
    Return what the kernel fills from rows at rest: rows at the end, log, motion and work.

    Log of (n_impacts, 9), motion (n_time, n_structures, 3) and work (n_time, n_structures, 4).
    """
    # Memory of the motion and work at every sample
    parts = int(refinement(math.sqrt(start[:, columns.STIFFNESS].max()), step))
    motion, work = np.zeros((samples, len(start), 3)), np.zeros((samples, len(start), 4))
    room, impacts = -1, FIRST_ROOM

    # Grow the log until all impacts have room
    while room < impacts:
        room = impacts
        row, log = start.copy(), np.zeros((room, LOG_COLUMNS))
        used = run_history(record, step, parts, row, log, motion, work)
        if used < 0:
            raise RuntimeError(
                f"no end of contacts at {-used * step:g} s: more than {2 * BOUNCES_OF_ROWS} events"
            )
        impacts = int(row[:, columns.IMPACTS].sum())
    return row, log[:impacts], motion[:used], work[:used]


def impact_table(log: FloatArray) -> pd.DataFrame:
    """Return the table of impacts, as in `PoundingHistory`, from the columns of ``LOGGED``."""
    columns = dict(zip(LOGGED, log.T, strict=True))
    left = columns["left"] = columns["left"].astype(np.int64)

    # Transfer energies (9), (10) in their short form: impulse times mean velocity
    energies = []
    for i, sign in ((1, 1.0), (2, -1.0)):
        mean = 0.5 * (columns[f"velocity_before_{i}"] + columns[f"velocity_after_{i}"])
        energies.append(sign * columns["impulse"] * mean)

    # Chatter of structures that are pressed together does not count
    approach = columns["velocity_before_1"] - columns["velocity_before_2"]
    fastest = np.full(left.max(initial=-1) + 1, -np.inf)
    np.maximum.at(fastest, left, approach)
    counted = approach > np.maximum(SLOWEST_COUNTED, COUNTED_SHARE * fastest[left])
    return pd.DataFrame(
        {
            **columns,
            "transfer_energy_1": energies[0],
            "transfer_energy_2": energies[1],
            "energy_loss": energies[0] + energies[1],
            "counted": counted,
        }
    )


def _checked_gaps(
    gaps: ArrayLike, restitution: ArrayLike, structures: int
) -> tuple[FloatArray, FloatArray]:
    """Return gap and restitution of each gap of a row of structures."""
    gap = checks.not_negative("gaps", gaps)
    bounce = checks.between("restitution", restitution, 0.0, 1.0)
    if structures < 2:
        raise ValueError(f"structures must be two or more, got {structures}")
    # One number for all gaps, or one a gap
    for name, values in (("gaps", gap), ("restitution", bounce)):
        if values.shape not in {(), (1,), (structures - 1,)}:
            raise ValueError(
                f"{name} must be one number or {structures - 1}, one a gap, "
                f"got the shape {values.shape}"
            )
    return np.broadcast_to(gap, structures - 1), np.broadcast_to(bounce, structures - 1)
