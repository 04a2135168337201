"""Bilinear oscillators: histories, and inelastic PER spectra of given strength."""

import math
from operator import attrgetter
from typing import NamedTuple

import numpy as np

from per_obspy import checks
from per_obspy.checks import ArrayLike, FloatArray
from per_obspy.constants import STANDARD_GRAVITY
from per_obspy.kernels.pounding_events import motion as columns
from per_obspy.kernels.pounding_events.contact import LOG_COLUMNS
from per_obspy.kernels.pounding_events.row_history import WORK_HYSTERETIC, run_history
from per_obspy.spectra.elastic import row_of
from per_obspy.spectra.trace_arguments import takes_trace

#: Free vibration after the record is followed until no result changes, for so many periods at most.
PERIODS_AFTER_RECORD = 200
#: Half the changes of stiffness in a step above which a history is given up.
MOST_EVENTS = 1000


class BilinearResponse(NamedTuple):
    """
    Response of one bilinear oscillator.

    Attributes
    ----------
    displacement, velocity, plastic_displacement : (n_time,) ndarray
        At the samples of the record, relative to the ground, m, m/s, m.
    ductility : float
        Largest displacement over yield displacement (0 for an infinite one), dimensionless.
    hysteretic_energy : float
        Dissipated by yielding, per unit mass, m²/s².
    displacement_maximum : float
        Largest displacement, between samples and in the free vibration after the record too, m.
    residual : float
        Displacement at which the oscillator comes to rest, m.
    displacement_radius : float
        Largest ``sqrt(u² + (v / omega0)²)`` with the total displacement; it bounds the
        displacement, m.
    energy_radius : float
        Largest ``sqrt(alpha u² + (1 - alpha) y² + (v / omega0)²)`` with the elastic part ``y`` of
        the displacement: the radius of the recoverable energy, m.
    """

    displacement: FloatArray
    velocity: FloatArray
    plastic_displacement: FloatArray
    ductility: float
    hysteretic_energy: float
    displacement_maximum: float
    residual: float
    displacement_radius: float
    energy_radius: float


class InelasticSpectra(NamedTuple):
    """
    Largest responses of bilinear oscillators, each (n_periods,).

    Attributes
    ----------
    displacement_radius, energy_radius : ndarray
        Inelastic PER of the total displacement and of the recoverable energy, as in
        `BilinearResponse`, m.
    sd : ndarray
        Largest displacement, m.
    ductility : ndarray
        Largest displacement over yield displacement, dimensionless.
    yield_coefficient : ndarray
        Yield force over weight, dimensionless.
    residual : ndarray
        Displacement at rest, m.
    hysteretic_energy : ndarray
        Per unit mass, m²/s².
    """

    displacement_radius: FloatArray
    energy_radius: FloatArray
    sd: FloatArray
    ductility: FloatArray
    yield_coefficient: FloatArray
    residual: FloatArray
    hysteretic_energy: FloatArray


#: The largest values of a response that are stored by period.
LARGEST = attrgetter(
    "displacement_radius",
    "energy_radius",
    "displacement_maximum",
    "ductility",
    "residual",
    "hysteretic_energy",
)


@takes_trace
def bilinear_response(
    acceleration: ArrayLike,
    dt: float,
    period: float,
    damping: float,
    yield_displacement: float,
    hardening: float,
) -> BilinearResponse:
    """
    Compute the response of a bilinear oscillator, exact between samples and at its events.

    Parameters
    ----------
    acceleration : (n_samples,) array_like or obspy Trace
        Ground acceleration, m/s², as for `per_spectrum`.
    dt : float
        Time between samples, s; not given with a Trace.
    period : float
        Undamped elastic period, s.
    damping : float
        Fraction of critical of the elastic oscillator; the damping coefficient stays the same while
        yielding.
    yield_displacement : float
        Displacement at which it yields, m; infinity for a linear oscillator.
    hardening : float
        Stiffness after yielding over elastic stiffness, 0 to 1.

    Returns
    -------
    BilinearResponse
        Histories at the samples and largest values, between samples and after the record too.

    Raises
    ------
    ValueError
        If an argument is not finite, out of range or of the wrong shape.

    Notes
    -----
    ``u'' + 2 xi omega0 u' + omega0² [alpha u + (1 - alpha) y] = -a`` with ``y`` the elastic part of
    the displacement, never beyond the yield displacement; the hardening is kinematic.

    Examples
    --------
    >>> response = bilinear_response([0.0, 20.0, 0.0], 0.5, 1.0, 0.05, 0.1, 0.1)
    >>> round(response.ductility, 2), round(response.residual, 3)
    (26.46, 0.103)
    """
    record = checks.record("acceleration", acceleration)
    dt = checks.number("dt", dt, checks.positive)
    omega = 2.0 * np.pi / checks.number("period", period, checks.positive)
    # An infinite yield displacement is a linear oscillator
    ratio = checks.number("damping", damping, checks.fraction_of_critical)
    limit = checks.number("yield_displacement", yield_displacement, checks.positive_or_infinite)
    return _response(record, dt, omega, ratio, limit, _hardening(hardening))


@takes_trace
def constant_yield_spectra(
    acceleration: ArrayLike,
    dt: float,
    periods: ArrayLike,
    damping: float,
    yield_coefficients: ArrayLike,
    hardening: float,
) -> InelasticSpectra:
    """
    Compute inelastic spectra of oscillators of given strength.

    Parameters
    ----------
    acceleration : (n_samples,) array_like or obspy Trace
        Ground acceleration, m/s², as for `per_spectrum`.
    dt : float
        Time between samples, s; not given with a Trace.
    periods : (n_periods,) array_like
        Undamped elastic periods, s.
    damping, hardening : float
        As for `bilinear_response`.
    yield_coefficients : float or (n_periods,) array_like
        Yield force over weight, dimensionless.

    Returns
    -------
    InelasticSpectra
        Arrays (n_periods,).

    Raises
    ------
    ValueError
        If an argument is not finite, out of range or of the wrong shape.

    See Also
    --------
    bilinear_response : History of one oscillator.

    References
    ----------
    Newmark & Hall (1982), Earthquake spectra and design, for inelastic spectra.

    Examples
    --------
    >>> pulse = np.sin(np.linspace(0.0, 6.0 * np.pi, 301))
    >>> spectra = constant_yield_spectra(pulse, 0.01, [0.5, 1.0, 2.0], 0.05, 0.1, 0.05)
    >>> print(spectra.ductility.round(2), spectra.sd.round(3))
    [3.07 2.53 1.02] [0.019 0.063 0.102]
    """
    record = checks.record("acceleration", acceleration)
    omegas = 2.0 * np.pi / row_of("periods", periods)
    ratio = checks.number("damping", damping, checks.fraction_of_critical)
    dt, alpha = checks.number("dt", dt, checks.positive), _hardening(hardening)
    # Yield displacement from the yield force over the weight: C g / omega²
    coefficients = np.broadcast_to(
        checks.positive("yield_coefficients", yield_coefficients), omegas.shape
    )
    limits = coefficients * STANDARD_GRAVITY / omegas**2
    rows = [
        LARGEST(_response(record, dt, omega, ratio, limit, alpha))
        for omega, limit in zip(omegas, limits, strict=True)
    ]
    # Histories are left out
    total, elastic, sd, ductility, residual, energy = np.array(rows).T.copy()
    return InelasticSpectra(total, elastic, sd, ductility, coefficients.copy(), residual, energy)


def _hardening(hardening: float) -> float:
    """Check the stiffness after yielding over the elastic one."""
    return checks.number(
        "hardening", hardening, lambda name, value: checks.between(name, value, 0.0, 1.0)
    )


def _response(
    record: FloatArray, dt: float, omega: float, damping: float, limit: float, hardening: float
) -> BilinearResponse:
    """Return the response of one oscillator with a yield displacement ``limit``, m."""
    row, history, work = _run(record, dt, omega, damping, limit, hardening)

    # At the samples of the record, then between them and after it too
    return BilinearResponse(
        displacement=history[:, 0],
        velocity=history[:, 1],
        plastic_displacement=history[:, 2],
        ductility=float(row[columns.LARGEST_DISPLACEMENT] / limit),
        hysteretic_energy=float(work[WORK_HYSTERETIC]),
        displacement_maximum=float(row[columns.LARGEST_DISPLACEMENT]),
        residual=float((1.0 - hardening) * row[columns.PLASTIC]),
        displacement_radius=float(np.sqrt(row[columns.LARGEST_RADIUS_SQUARED])),
        energy_radius=float(np.sqrt(row[columns.LARGEST_ENERGY_RADIUS_SQUARED])),
    )


def _run(
    record: FloatArray, dt: float, omega: float, damping: float, limit: float, hardening: float
) -> tuple[FloatArray, FloatArray, FloatArray]:
    """Return the kernel's row at the end, its motion at the samples, and the work done on it."""
    # A row of one structure of unit mass, in steps that are short enough for the kernel
    row = np.zeros((1, columns.ROW_COLUMNS))
    row[0, :6] = damping * omega, omega**2, hardening, limit, 1.0, 1.0
    row[0, columns.BOUNCE_LIMIT] = MOST_EVENTS
    refinement = max(1, math.ceil(omega * dt / columns.LARGEST_ANGLE))

    # The ground returns to rest by a ramp of one interval
    closed, log = np.append(record, 0.0), np.empty((0, LOG_COLUMNS))
    samples = closed.size + math.ceil(PERIODS_AFTER_RECORD * 2.0 * np.pi / (omega * dt))
    motion, work = np.zeros((samples, 1, 3)), np.zeros((samples, 1, 4))
    used = run_history(closed, dt, refinement, row, log, motion, work)
    if used < 0:
        raise RuntimeError(f"no end of yielding and unloading at {-used * dt:g} s")
    return row[0], motion[: record.size, 0], work[used - 1, 0]
