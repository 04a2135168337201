"""Largest responses and impacts of many pairs against one record, by the exact history of each."""

import math
import os
from concurrent.futures import ThreadPoolExecutor
from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike, NDArray

from per_obspy import checks
from per_obspy.checks import FloatArray
from per_obspy.kernels.pounding_block import Pairs, run_block
from per_obspy.kernels.pounding_contact import Rules
from per_obspy.kernels.pounding_lanes import LANES, LARGEST_PLACE, LARGEST_RADIUS, ROWS, STRUCTURE_ROWS
from per_obspy.pounding.history import FREE_PERIODS, SPEED_SHARE
from per_obspy.pounding.rows import closed_record, largest_ground_velocity, new_tally, refinement, row_at_rest

#: A bounce that lasts less than this share of a sampling interval ends in contact, and so does the 25th within one.
SHORTEST_BOUNCE = 1e-3
MOST_BOUNCES = 25


class PoundingMaxima(NamedTuple):
    """
    What pounding does to each pair.

    Attributes
    ----------
    per : (2, n_pairs) ndarray
        Largest radius ``sqrt(u² + (v / omega)²)`` of both structures with pounding, exact between samples, m.
    displacement_maxima : (2, n_pairs) ndarray
        Largest displacement to either side of both structures, exact between samples, m.
    impacts : (n_pairs,) ndarray of int
        Number of impacts; the last bounces of a chatter are not counted.
    impact_velocity : (n_pairs,) ndarray
        Largest approach speed of an impact, m/s; 0 without impact.
    """

    per: FloatArray
    displacement_maxima: FloatArray
    impacts: NDArray[np.int64]
    impact_velocity: FloatArray


def pounding_histories(
    acceleration: ArrayLike,
    dt: float,
    period_1: ArrayLike,
    damping_1: ArrayLike,
    mass_1: ArrayLike,
    period_2: ArrayLike,
    damping_2: ArrayLike,
    mass_2: ArrayLike,
    gap: ArrayLike,
    restitution: ArrayLike,
    participation_1: ArrayLike = 1.0,
    participation_2: ArrayLike = 1.0,
    azimuth: ArrayLike | None = None,
    yield_displacement_1: ArrayLike = math.inf,
    hardening_1: ArrayLike = 0.0,
    yield_displacement_2: ArrayLike = math.inf,
    hardening_2: ArrayLike = 0.0,
    free_vibration: bool = True,
) -> PoundingMaxima:
    """
    Maxima of the exact pounding histories of many pairs.

    The same physics as `pounding_history`, many pairs at once on all processors; the result of a pair does not depend
    on the others. Bouncing ends in contact a little earlier: when a bounce would last less than a thousandth of a
    sampling interval, or after 25 impacts in one.

    Parameters
    ----------
    acceleration : (n_samples,) or (2, n_samples) array_like
        Ground acceleration along the pairs, positive from structure 1 to 2; or its north and east components, m/s².
    dt : float
        Sampling interval, s.
    period_1, period_2 : (n_pairs,) array_like
        Undamped natural periods, s.
    damping_1, damping_2 : (n_pairs,) array_like
        Fractions of critical.
    mass_1, mass_2 : (n_pairs,) array_like
        Generalised masses at the contact level, kg; one of the two may be infinite.
    gap : (n_pairs,) array_like
        Clear distance at rest, m; 0 starts in contact.
    restitution : (n_pairs,) array_like
        Coefficient of restitution, between 0 and 1.
    participation_1, participation_2 : (n_pairs,) array_like
        Contact displacement over that of the plain oscillator, dimensionless.
    azimuth : (n_pairs,) array_like, optional
        Of the axis from structure 1 to 2, degrees clockwise from north; required for two components.
    yield_displacement_1, yield_displacement_2 : (n_pairs,) array_like
        At contact level, m; infinite for linear structures.
    hardening_1, hardening_2 : (n_pairs,) array_like
        Stiffness after yielding over elastic stiffness, at least 0 and below 1.
    free_vibration : bool
        As in `pounding_history`.

    Returns
    -------
    PoundingMaxima
        One entry a pair, in the shape to which the arguments broadcast.

    Raises
    ------
    ValueError
        If an argument is outside its range, or the azimuth does not go with the number of components.

    References
    ----------
    Valles-Mattox & Reinhorn (1996), An energy approach to pounding of structures, 11WCEE, eq. (7), (8).

    Examples
    --------
    >>> pulse = np.sin(np.linspace(0.0, 6.0 * np.pi, 301))
    >>> maxima = pounding_histories(pulse, 0.01, 1.5, 0.05, 4e5, 0.4, 0.05, 2e5, [0.02, 5.0], 0.6)
    >>> maxima.impacts[1], bool(maxima.impacts[0] > 0)
    (0, True)
    """
    step = checks.number("dt", dt, checks.positive)
    fields = {
        "period_1": checks.positive("period_1", period_1),
        "damping_1": checks.fraction_of_critical("damping_1", damping_1),
        "mass_1": checks.positive_or_infinite("mass_1", mass_1),
        "period_2": checks.positive("period_2", period_2),
        "damping_2": checks.fraction_of_critical("damping_2", damping_2),
        "mass_2": checks.positive_or_infinite("mass_2", mass_2),
        "gap": checks.not_negative("gap", gap),
        "restitution": checks.between("restitution", restitution, 0.0, 1.0),
        "participation_1": checks.not_negative("participation_1", participation_1),
        "participation_2": checks.not_negative("participation_2", participation_2),
        "azimuth": checks.finite("azimuth", 0.0 if azimuth is None else azimuth),
        "yield_displacement_1": checks.positive_or_infinite("yield_displacement_1", yield_displacement_1),
        "hardening_1": checks.fraction_of_critical("hardening_1", hardening_1),
        "yield_displacement_2": checks.positive_or_infinite("yield_displacement_2", yield_displacement_2),
        "hardening_2": checks.fraction_of_critical("hardening_2", hardening_2),
    }
    components = _components(acceleration, azimuth is not None)
    if free_vibration:
        components = closed_record(components)
    shape = np.broadcast_shapes(*(values.shape for values in fields.values()))
    flat = {name: np.broadcast_to(values, shape).ravel() for name, values in fields.items()}
    return _maxima(components, step, flat, free_vibration, shape)


def _components(acceleration: ArrayLike, has_azimuth: bool) -> FloatArray:
    """Return north and east component; a single component is the north one, at azimuth 0."""
    record = checks.finite("acceleration", acceleration)
    if has_azimuth and (record.ndim != 2 or record.shape[0] != 2 or record.size == 0):
        raise ValueError(f"acceleration must be north and east (2, n_samples) with azimuth, got {record.shape}")
    if has_azimuth:
        return np.ascontiguousarray(record)
    single = checks.record("acceleration", record)
    return np.stack([single, np.zeros_like(single)])


def _structures(fields: dict[str, FloatArray]) -> FloatArray:
    """Return the kernels' table of structures, (n_pairs, 2, 6)."""
    table = np.empty((fields["gap"].size, 2, 6))
    for i, name in enumerate(("1", "2")):
        frequency = 2.0 * np.pi / fields[f"period_{name}"]
        table[:, i, 0] = fields[f"damping_{name}"] * frequency
        table[:, i, 1] = frequency**2
        table[:, i, 2] = fields[f"hardening_{name}"]
        table[:, i, 3] = fields[f"yield_displacement_{name}"]
        table[:, i, 4] = fields[f"participation_{name}"]
        table[:, i, 5] = fields[f"mass_{name}"]
    walls = np.flatnonzero(np.isinf(table[:, :, 5]).all(axis=1))
    if walls.size:
        raise ValueError(f"mass_1 and mass_2 must not both be infinite, got inf at index {walls[0]}")
    return table


def _pairs(
    fields: dict[str, FloatArray],
    table: FloatArray,
    chosen: NDArray[np.int64],
    dt: float,
    free_vibration: bool,
    ground_velocity: float,
) -> Pairs:
    """Return chosen pairs at rest."""
    count = chosen.size
    longest = np.maximum(fields["period_1"], fields["period_2"])[chosen]
    azimuth = np.radians(fields["azimuth"][chosen])
    return Pairs(
        structures=table[chosen],
        gaps=fields["gap"][chosen],
        restitution=fields["restitution"][chosen],
        cosine=np.cos(azimuth),
        sine=np.sin(azimuth),
        free_steps=np.ceil(FREE_PERIODS * longest / dt).astype(np.int64) * free_vibration,
        still=SPEED_SHARE * ground_velocity * table[chosen, :, 4].max(axis=1),
        stuck=fields["gap"][chosen] <= 0.0,
        order=np.zeros(count, np.int64),
        phase=np.zeros((count, 2), np.int64),
        unloading=np.zeros((count, 2), np.int64),
        impacts=np.zeros(count, np.int64),
        approach=np.zeros(count),
    )


def _maxima(
    components: FloatArray, dt: float, fields: dict[str, FloatArray], free_vibration: bool, shape: tuple[int, ...]
) -> PoundingMaxima:
    """Run the pairs in blocks of equal refinement, a thread a processor."""
    table = _structures(fields)
    frequency = np.sqrt(table[:, :, 1].max(axis=1))
    parts = np.array([refinement(value, dt) for value in frequency], dtype=np.int64)
    ground_velocity = sum(largest_ground_velocity(component, dt) for component in components)
    count = fields["gap"].size
    peaks, impacts, approach = np.zeros((2, 2, count)), np.zeros(count, np.int64), np.zeros(count)

    def run(block: NDArray[np.int64]) -> None:
        filled = np.resize(block, LANES)
        pairs = _pairs(fields, table, filled, dt, free_vibration, ground_velocity)
        part = int(parts[block[0]])
        lanes = np.zeros(ROWS * LANES)
        rules = Rules(0.0, 0.5 * SHORTEST_BOUNCE * dt / part, MOST_BOUNCES)
        row, tally = row_at_rest(np.zeros((2, 6)), np.zeros(1), np.zeros(1)), new_tally(2, 0)
        flags = np.zeros(LANES, np.int64)
        if not run_block(components[0], components[1], dt, part, lanes, flags, row, tally, rules, pairs):
            raise RuntimeError(f"no end of contacts among pairs {block.tolist()}")
        of_lane = lanes.reshape(ROWS, LANES)[:, : block.size]
        for i in range(2):
            peaks[0, i, block] = np.sqrt(of_lane[i * STRUCTURE_ROWS + LARGEST_RADIUS])
            peaks[1, i, block] = of_lane[i * STRUCTURE_ROWS + LARGEST_PLACE]
        impacts[block], approach[block] = pairs.impacts[: block.size], pairs.approach[: block.size]

    blocks = []
    for part in np.unique(parts):
        same = np.flatnonzero(parts == part)
        blocks += [same[start : start + LANES] for start in range(0, same.size, LANES)]
    with ThreadPoolExecutor(os.cpu_count()) as pool:
        list(pool.map(run, blocks))
    return PoundingMaxima(
        peaks[0].reshape(2, *shape), peaks[1].reshape(2, *shape), impacts.reshape(shape), approach.reshape(shape)
    )
