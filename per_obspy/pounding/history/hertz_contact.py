"""Contact by the Hertz law with damping: a nonlinear alternative to impacts, for comparison."""

from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike
from scipy.integrate import solve_ivp

from per_obspy import checks
from per_obspy.checks import FloatArray
from per_obspy.pounding.history.tables import closed_record
from per_obspy.pounding.structure import Structure

#: Relative and absolute (m, m/s) tolerance of the integration.
RELATIVE_TOLERANCE, ABSOLUTE_TOLERANCE = 1e-9, 1e-12


class HertzHistory(NamedTuple):
    """
    Motion of two structures that meet by the Hertz law.

    Attributes
    ----------
    time : (n_samples,) ndarray
        Since the first sample, s.
    displacement, velocity : (2, n_samples) ndarray
        At contact level, relative to the ground, m and m/s.
    contacts : int
        How often the structures met.
    force_maximum : float
        Largest contact force at the instants that the integration visited, N.
    """

    time: FloatArray
    displacement: FloatArray
    velocity: FloatArray
    contacts: int
    force_maximum: float


def hertz_damp_history(
    acceleration: ArrayLike,
    dt: float,
    structure_1: Structure,
    structure_2: Structure,
    gap: float,
    stiffness: float,
    restitution: float,
) -> HertzHistory:
    """
    History of two linear structures with the Hertz-damp contact ``F = k d^1.5 (1 + 3 (1 - e²) d' / (4 v))``.

    d is the overlap and v the approach speed at first contact. Integrated numerically (DOP853),
    with every contact located as an event; much slower than `pounding_history`, and meant for
    comparison.

    Parameters
    ----------
    acceleration : (n_samples,) array_like
        Ground acceleration, positive from structure 1 to 2, m/s².
    dt : float
        Sampling interval, s.
    structure_1, structure_2 : Structure
        Linear; 1 stands left.
    gap : float
        Clear distance at rest, m, above zero.
    stiffness : float
        Of the contact, N/m^1.5.
    restitution : float
        Coefficient e that sets the damping, dimensionless; reached only near 1, below it less is
        lost.

    Returns
    -------
    HertzHistory
        Over the record.

    Raises
    ------
    ValueError
        If an argument is outside its range, or a structure is bilinear.

    References
    ----------
    Muthukumar & DesRoches (2006), A Hertz contact model with non-linear damping for pounding
    simulation, EESD 35.
    """
    record, step = (
        checks.record("acceleration", acceleration),
        checks.number("dt", dt, checks.positive),
    )
    width = checks.number("gap", gap, checks.positive)
    spring = checks.number("stiffness", stiffness, checks.positive)
    bounce = float(checks.between("restitution", restitution, 0.0, 1.0))
    pair = (structure_1, structure_2)
    for structure in pair:
        if np.isfinite(structure.yield_displacement):
            raise ValueError(
                f"yield_displacement must be infinite here, got {structure.yield_displacement}"
            )
    return _integrate(closed_record(record), step, pair, (width, spring, bounce), record.size)


def _force(state: FloatArray, contact: tuple[float, float, float], approach: float) -> float:
    """Return the contact force, N; an approach speed of 0 means that the structures are apart."""
    gap, stiffness, restitution = contact
    overlap, rate = state[0] - state[2] - gap, state[1] - state[3]
    if approach == 0.0 or overlap <= 0.0:
        return 0.0
    return float(stiffness * overlap**1.5 * (1.0 + 0.75 * (1.0 - restitution**2) * rate / approach))


def _rates(
    state: FloatArray, pair: tuple[Structure, Structure], force: float, ground: float
) -> list[float]:
    """Return the rates of change of displacement and velocity of both structures."""
    rates = []
    for s, u, v, push in (
        (pair[0], state[0], state[1], -force),
        (pair[1], state[2], state[3], force),
    ):
        own = 2.0 * s.damping * s.frequency * v + s.frequency**2 * u
        rates += [v, push / s.mass - own - s.participation * ground]
    return rates


def _integrate(
    record: FloatArray,
    dt: float,
    pair: tuple[Structure, Structure],
    contact: tuple[float, float, float],
    samples: int,
) -> HertzHistory:
    """Integrate from contact to separation and on to the next contact."""
    times = dt * np.arange(record.size, dtype=np.float64)
    states, visited = np.zeros((4, samples)), [0.0]
    start, state, approach, contacts = 0.0, np.zeros(4), 0.0, 0

    def rates(t: float, y: FloatArray) -> list[float]:
        return _rates(y, pair, _force(y, contact, approach), float(np.interp(t, times, record)))

    def clearance(_: float, y: FloatArray) -> float:
        return float(contact[0] - y[0] + y[2])

    clearance.terminal = True  # type: ignore[attr-defined]  # SciPy reads these attributes of a function
    while start < times[samples - 1]:
        clearance.direction = 1.0 if approach else -1.0  # type: ignore[attr-defined]  # as above
        inside = times[:samples] > start
        end = solve_ivp(
            rates, (start, times[samples - 1]), state, "DOP853", dense_output=True, events=clearance,
            rtol=RELATIVE_TOLERANCE, atol=ABSOLUTE_TOLERANCE, max_step=dt,
        )  # fmt: skip
        reached = inside & (times[:samples] <= end.t[-1])
        if reached.any():
            states[:, reached] = end.sol(times[:samples][reached])  # type: ignore[misc]  # dense_output gives it
        visited += [_force(y, contact, approach) for y in end.y.T]
        start, state = float(end.t[-1]), end.y[:, -1]
        meets = end.status == 1 and not approach
        contacts += meets
        approach = float(state[1] - state[3]) if meets else 0.0
    return HertzHistory(times[:samples], states[[0, 2]], states[[1, 3]], contacts, max(visited))
