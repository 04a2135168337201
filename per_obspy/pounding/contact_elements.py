"""Histories of two structures joined by a link, or separated by a Kelvin-Voigt or Hertz contact."""

import math
from collections.abc import Sequence
from itertools import repeat
from typing import Any, NamedTuple

import numpy as np
from scipy.integrate import solve_ivp

from per_obspy import checks
from per_obspy.checks import ArrayLike, FloatArray
from per_obspy.kernels.pounding_events.links import ELASTIC, OPEN, Element, run_linked
from per_obspy.kernels.pounding_events.motion import MOST_TERMS
from per_obspy.pounding.kernel_tables import (
    closed_record,
    free_samples,
    refinement,
    row_at_rest,
    structure_table,
)
from per_obspy.pounding.structure import Structure, refuse_bilinear
from per_obspy.spectra.trace_arguments import takes_trace


class LinkedHistory(NamedTuple):
    """
    Motion of two structures with an element between them.

    Attributes
    ----------
    time : (n_time,) ndarray
        Since the first sample, s.
    displacement, velocity : (2, n_time) ndarray
        At contact level, relative to the ground, positive from structure 1 to 2, m and m/s.
    force : (n_time,) ndarray
        Of the element, positive in compression, N.
    displacement_maxima : (2,) ndarray
        Largest displacement to either side, exact between samples, m.
    closing, parting : float
        Largest ``u1 - u2`` and ``u2 - u1``, exact between samples, m.
    force_maximum : float
        Largest force of the element in compression or tension, exact between samples, N.
    """

    time: FloatArray
    displacement: FloatArray
    velocity: FloatArray
    force: FloatArray
    displacement_maxima: FloatArray
    closing: float
    parting: float
    force_maximum: float


@takes_trace
def linked_history(
    acceleration: ArrayLike,
    dt: float,
    structure_1: Structure,
    structure_2: Structure,
    stiffness: float,
    damping: float = 0.0,
    yield_force: float = math.inf,
    hardening: float = 0.0,
    free_vibration: bool = True,
) -> LinkedHistory:
    """
    Compute the history of two structures joined by an elastic, viscous or bilinear link.

    The coupled equations are solved exactly for ground acceleration that is linear between samples;
    a bilinear link changes its stiffness at the exact instant. The structures would hit each other
    if ``closing`` exceeds their gap.

    Parameters
    ----------
    acceleration : (n_samples,) array_like or obspy Trace
        Ground acceleration, positive from structure 1 to 2, m/s². If it does not end at zero, it is
        closed by one ramp.
    dt : float
        Sampling interval, s; not given with a Trace.
    structure_1, structure_2 : Structure
        Linear; 1 is left of 2.
    stiffness : float
        Of the link, N/m; 0 for a damper.
    damping : float
        Viscous coefficient of the link, N s/m.
    yield_force : float
        Of its spring, N; infinite for an elastic link.
    hardening : float
        Stiffness of its spring after yielding over that before, at least 0 and below 1.
    free_vibration : bool
        Follow 20 of the longest period after the record; else the history ends with the record's
        last sample.

    Returns
    -------
    LinkedHistory
        Motion, link force and maxima.

    Raises
    ------
    ValueError
        If an argument is outside its range, or a structure is bilinear.

    Examples
    --------
    >>> import numpy as np
    >>> pulse = np.sin(np.linspace(0.0, 6.0 * np.pi, 301))
    >>> tower, annex = Structure(1.5, 0.05, 4e5), Structure(0.4, 0.05, 2e5)
    >>> free = linked_history(pulse, 0.01, tower, annex, stiffness=0.0)
    >>> joined = linked_history(pulse, 0.01, tower, annex, stiffness=1e9)
    >>> bool(joined.closing < 0.01 * free.closing)
    True
    """
    # A link has no gap: it acts from the first displacement on
    element = Element(
        checks.number("stiffness", stiffness, checks.not_negative),
        checks.number("damping", damping, checks.not_negative),
        checks.number("yield_force", yield_force, checks.positive_or_infinite),
        checks.number("hardening", hardening, checks.fraction_of_critical),
        0.0,
    )
    if element.yield_force < math.inf and element.stiffness == 0.0:
        raise ValueError(
            f"stiffness must be positive for a link that yields at {element.yield_force} N, got 0.0"
        )
    return _history(acceleration, dt, structure_1, structure_2, element, ELASTIC, free_vibration)


@takes_trace
def kelvin_voigt_history(
    acceleration: ArrayLike,
    dt: float,
    structure_1: Structure,
    structure_2: Structure,
    gap: float,
    stiffness: float,
    damping: float = 0.0,
    free_vibration: bool = True,
) -> LinkedHistory:
    """
    Compute the history of two structures that hit each other through a spring and a dashpot.

    The contact bears no tension. It is the penalty model of finite-element programs (OpenSees
    `ViscoelasticGap`, `ElasticPPGap`), for comparison with `pounding_history`, to which it
    converges slowly, like the square root of the compliance. Exact between samples.

    Parameters
    ----------
    acceleration : (n_samples,) array_like or obspy Trace
        Ground acceleration, positive from structure 1 to 2, m/s². If it does not end at zero, it is
        closed by one ramp.
    dt : float
        Sampling interval, s; not given with a Trace.
    structure_1, structure_2 : Structure
        Linear; 1 is left of 2.
    gap : float
        Clear distance at rest, m.
    stiffness : float
        Of the contact, N/m.
    damping : float, optional
        Viscous coefficient of the contact, N s/m.
    free_vibration : bool, optional
        Follow 20 of the longest period after the record; else the history ends with the record's
        last sample.

    Returns
    -------
    LinkedHistory
        Motion, contact force and maxima.

    Raises
    ------
    ValueError
        If an argument is outside its range, or a structure is bilinear.

    See Also
    --------
    per_obspy.pounding_history : Exact history with instant impacts.
    per_obspy.kelvin_voigt_damping : Damping ratio of a contact with a restitution.

    References
    ----------
    Anagnostopoulos (1988), Pounding of buildings in series during earthquakes, EESD 16, 443-456.

    Examples
    --------
    The stiffer the contact, the less the structures overlap:

    >>> import numpy as np
    >>> pulse = np.sin(np.linspace(0.0, 6.0 * np.pi, 301))
    >>> tower, annex = Structure(1.5, 0.05, 4e5), Structure(0.4, 0.05, 2e5)
    >>> soft = kelvin_voigt_history(pulse, 0.01, tower, annex, 0.02, stiffness=1e7)
    >>> stiff = kelvin_voigt_history(pulse, 0.01, tower, annex, 0.02, stiffness=1e9)
    >>> print(f"{soft.closing - 0.02:.3f} m, {stiff.closing - 0.02:.3f} m")
    0.062 m, 0.011 m
    """
    element = Element(
        checks.number("stiffness", stiffness, checks.positive),
        checks.number("damping", damping, checks.not_negative),
        math.inf,
        0.0,
        checks.number("gap", gap, checks.not_negative),
    )
    return _history(acceleration, dt, structure_1, structure_2, element, OPEN, free_vibration)


def _history(
    acceleration: ArrayLike,
    dt: float,
    structure_1: Structure,
    structure_2: Structure,
    element: Element,
    phase: int,
    free_vibration: bool,
) -> LinkedHistory:
    """Check the arguments common to all elements, and run the kernel."""
    record = checks.record("acceleration", acceleration)
    step = checks.number("dt", dt, checks.positive)
    refuse_bilinear(structures := (structure_1, structure_2))

    # Follow the free vibration after the record
    samples = record.size
    if free_vibration:
        record = closed_record(record)
        samples = record.size + int(free_samples(max(one.period for one in structures), step))

    # Displacement and velocity of both structures, the force, and five maxima
    row = row_at_rest(structure_table(structures), np.zeros(1), np.zeros(1))
    motion, force, maxima = np.zeros((samples, 2, 2)), np.zeros(samples), np.zeros(5)
    kernel = (
        record,
        step,
        int(refinement(_largest_rate(structures, element), step)),
        row,
        element,
        phase,
        MOST_TERMS,
    )
    if not run_linked(*kernel, motion, force, maxima):
        raise RuntimeError("no end of phase changes of the link or contact within one step")
    return _linked_history(step, motion, force, maxima)


def _linked_history(
    dt: float, motion: FloatArray, force: FloatArray, maxima: FloatArray
) -> LinkedHistory:
    """Return the kernel's motion (n_time, 2, 2), force (n_time,) and maxima (5,) by name."""
    time = dt * np.arange(force.size, dtype=np.float64)
    displacement, velocity = motion.T.copy()
    closing, parting, largest = maxima[2:]
    return LinkedHistory(time, displacement, velocity, force, maxima[:2], closing, parting, largest)


def _largest_rate(structures: tuple[Structure, Structure], element: Element) -> float:
    """Return a bound on the rates at which the coupled system can change, 1/s."""
    mobility = sum(1.0 / structure.mass for structure in structures)
    own = max(structure.frequency for structure in structures)
    return math.sqrt(own**2 + element.stiffness * mobility) + element.damping * mobility


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
        Number of contacts.
    force_maximum : float
        Largest contact force at the instants that the integration visited, N.
    """

    time: FloatArray
    displacement: FloatArray
    velocity: FloatArray
    contacts: int
    force_maximum: float


@takes_trace
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
    Compute the history of two linear structures with a Hertz-damp contact.

    The contact force is ``F = k d^1.5 (1 + 3 (1 - e²) d' / (4 v))`` with the overlap d and the
    approach speed v at first contact. Integrated numerically (DOP853),
    with every contact located as an event; much slower than `pounding_history`, and meant for
    comparison.

    Parameters
    ----------
    acceleration : (n_samples,) array_like or obspy Trace
        Ground acceleration, positive from structure 1 to 2, m/s².
    dt : float
        Sampling interval, s; not given with a Trace.
    structure_1, structure_2 : Structure
        Linear; 1 is left of 2.
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
        Motion over the record (m, m/s), number of contacts and largest force (N).

    Raises
    ------
    ValueError
        If an argument is outside its range, or a structure is bilinear.

    See Also
    --------
    per_obspy.pounding_history : Exact history with instant impacts.
    per_obspy.kelvin_voigt_history : Contact by a spring and a dashpot.

    References
    ----------
    Muthukumar & DesRoches (2006), A Hertz contact model with non-linear damping for pounding
    simulation, EESD 35.

    Examples
    --------
    >>> pulse = np.sin(np.linspace(0.0, 6.0 * np.pi, 301))
    >>> tower, annex = Structure(1.5, 0.05, 4e5), Structure(0.4, 0.05, 2e5)
    >>> history = hertz_damp_history(pulse, 0.01, tower, annex, 0.02, 1e9, 0.6)
    >>> print(history.contacts, history.displacement.shape)
    3 (2, 301)
    """
    record = checks.record("acceleration", acceleration)
    step = checks.number("dt", dt, checks.positive)
    gap = checks.number("gap", gap, checks.positive)
    stiffness = checks.number("stiffness", stiffness, checks.positive)
    lost = 0.75 * (1.0 - checks.between("restitution", restitution, 0.0, 1.0) ** 2)
    refuse_bilinear(structures := (structure_1, structure_2))
    table = structure_table(structures).tolist()

    # Samples at which the motion is returned
    times = step * np.arange(record.size, dtype=np.float64)
    return _integrate(_HertzPair(table, gap, stiffness, float(lost), step, times, record))


class _HertzPair(NamedTuple):
    """
    Two structures, their contact, and ground acceleration (m/s²) at times of interval dt (s).

    ``table`` is that of the kernels; gap (m), stiffness (N/m^1.5), and ``lost``, the factor 3 (1 -
    e²)/4 of the damping. An approach speed of 0 means that the structures are apart.
    """

    table: list[list[float]]
    gap: float
    stiffness: float
    lost: float
    dt: float
    times: FloatArray
    acceleration: FloatArray

    def force(self, state: Sequence[float], approach: float) -> float:
        """Return the contact force, N."""
        overlap, rate = state[0] - state[2] - self.gap, state[1] - state[3]
        if approach == 0.0 or overlap <= 0.0:
            return 0.0
        return float(self.stiffness * overlap**1.5 * (1.0 + self.lost * rate / approach))

    def rates(self, time: float, state: FloatArray, approach: float) -> list[float]:
        """Return the rates of change of displacement and velocity of both structures."""
        # Numbers of Python: those of NumPy one by one take several times as long
        now = state.tolist()
        force, rates = self.force(now, approach), []
        ground = float(np.interp(time, self.times, self.acceleration))

        # The contact pushes structure 1 back and structure 2 on
        for i, push in ((0, -force), (1, force)):
            displacement, velocity = now[2 * i : 2 * i + 2]
            damping_rate, stiffness, _, _, participation, mass = self.table[i]
            own = 2.0 * damping_rate * velocity + stiffness * displacement
            rates += [velocity, push / mass - own - participation * ground]
        return rates

    def stretch(self, start: float, state: FloatArray, approach: float) -> Any:
        """Integrate until the gap closes or, in contact, opens again; see ``solve_ivp``."""

        def clearance(_: float, state: FloatArray) -> float:
            return float(self.gap - state[0] + state[2])

        # SciPy reads these attributes of a function
        clearance.terminal = True  # type: ignore[attr-defined]
        clearance.direction = 1.0 if approach else -1.0  # type: ignore[attr-defined]
        return solve_ivp(
            lambda time, now: self.rates(time, now, approach),
            (start, self.times[-1]),
            state,
            "DOP853",
            dense_output=True,
            events=clearance,
            rtol=RELATIVE_TOLERANCE,
            atol=ABSOLUTE_TOLERANCE,
            max_step=self.dt,
        )


def _integrate(pair: _HertzPair) -> HertzHistory:
    """Integrate from contact to separation and on to the next contact."""
    times = pair.times
    states = np.zeros((4, times.size))
    contacts, largest, start, approach, state = 0, 0.0, 0.0, 0.0, states[:, 0]
    while start < times[-1]:
        stretch = pair.stretch(start, state, approach)

        # Store the motion at the samples of this stretch, and the force wherever it was evaluated
        reached = (times > start) & (times <= stretch.t[-1])
        if reached.any():
            states[:, reached] = stretch.sol(times[reached])
        largest = max(largest, *map(pair.force, stretch.y.T, repeat(approach)))

        # An event of structures apart is the next contact, one in contact the separation
        start, state = stretch.t[-1], stretch.y[:, -1]
        touch = stretch.status == 1 and approach == 0.0
        contacts += touch
        approach = touch * float(state[1] - state[3])
    return HertzHistory(times, states[[0, 2]], states[[1, 3]], contacts, largest)
