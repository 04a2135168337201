"""Bumpers between structures: the sufficient restitution, and the contact damping that gives it."""

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from per_obspy import checks
from per_obspy.checks import ArrayLike, FloatArray
from per_obspy.pounding.single_hit import amplification_target, mass_shares, single_hit

#: The stereomechanical picture (an instant impact) holds for contacts up to this share of the
#: shortest period
LONGEST_CONTACT = 0.1


class BumperRestitution(NamedTuple):
    """
    Impact on a linear bumper.

    ``restitution`` and ``damping`` (fraction of critical of the contact) are dimensionless,
    ``contact_time`` is in s; ``instant`` is True where the contact is short enough to be treated
    as an instant impact.
    """

    restitution: FloatArray
    damping: FloatArray
    contact_time: FloatArray
    instant: NDArray[np.bool_]


def required_restitution(
    per_1: ArrayLike,
    per_2: ArrayLike,
    period_1: ArrayLike,
    period_2: ArrayLike,
    mass_1: ArrayLike,
    mass_2: ArrayLike,
    critical_gap: ArrayLike,
    gap: ArrayLike,
    target: ArrayLike,
) -> FloatArray:
    """
    Compute the largest restitution for which no structure is amplified beyond a target.

    The amplification is that of the single hit.

    Parameters
    ----------
    per_1, per_2, period_1, period_2, mass_1, mass_2, critical_gap, gap : array_like
        As in :func:`per_obspy.single_hit`.
    target : array_like
        Largest admissible amplification of either structure, at least 1, dimensionless.

    Returns
    -------
    restitution : ndarray
        Broadcast shape, dimensionless: 1 where any restitution is enough (also without pounding),
        NaN where even a plastic impact is too much or the single hit has no grazing state.

    Raises
    ------
    ValueError
        If an argument is out of range.

    Notes
    -----
    The state before the impact does not depend on the restitution. With ``q = 1 + e`` the velocity
    after it is ``v + q κ`` with ``κ1 = -(m2/M) d``, ``κ2 = (m1/M) d``, ``d = v1 - v2``; the radius
    is convex in q and unchanged at q = 0, so the admissible q end at the larger root of ``r'² =
    (target r)²``.

    Examples
    --------
    >>> print(required_restitution(0.3, 0.4, 1.0, 1.3, 1e6, 1e6, 0.5, 0.2, [1.2, 5.0]).round(4))
    [0.7212 1.    ]
    """
    target = amplification_target("target", target)
    gap, _ = np.broadcast_arrays(checks.not_negative("gap", gap), target)

    # State of both branches right before the impact: that of a plastic impact is the same
    radii, periods = (per_1, per_2), (period_1, period_2)
    hit = single_hit(*radii, *periods, mass_1, mass_2, 0.0, critical_gap, gap)
    share_1, share_2, _ = mass_shares(mass_1, mass_2)
    branches = hit.branches
    closing = branches.velocity_1 - branches.velocity_2
    before_1 = branches.displacement_1, branches.velocity_1
    before_2 = branches.displacement_2, branches.velocity_2

    # The worst structure in the worst branch decides
    factor_1 = _largest_factor(*before_1, -share_2 * closing, period_1, target * np.asarray(per_1))
    factor_2 = _largest_factor(*before_2, share_1 * closing, period_2, target * np.asarray(per_2))
    factor = np.min([factor_1, factor_2], axis=(0, 1))

    # Not below a plastic impact; any restitution without pounding
    enough = np.where(factor >= 1.0, np.minimum(factor - 1.0, 1.0), np.nan)
    return np.where(hit.status == "no_pounding", 1.0, enough)


def _largest_factor(
    displacement: FloatArray,
    velocity: FloatArray,
    change: FloatArray,
    period: ArrayLike,
    largest_radius: FloatArray,
) -> FloatArray:
    """
    Return the largest admissible q = 1 + e of one structure in both branches.

    Of its state before the impact (m, m/s) and ``change``, κ of the notes; infinite where no impact
    changes the velocity.
    """
    # Velocity on the circle of the largest radius, in the direction of the change
    room = np.maximum(largest_radius**2 - displacement**2, 0.0)
    speed = 2.0 * np.pi / np.asarray(period, dtype=np.float64) * np.sqrt(room)
    still = change == 0.0
    factor = (np.copysign(speed, change) - velocity) / np.where(still, 1.0, change)
    return np.where(still, np.inf, factor)


def kelvin_voigt_restitution(damping: ArrayLike, tension: bool = True) -> FloatArray:
    """
    Compute the restitution of a contact by a spring and a parallel dashpot.

    Parameters
    ----------
    damping : array_like
        Of the contact, fraction of critical, at least 0 and below 1, dimensionless.
    tension : bool, optional
        True: contact lasts until the penetration is zero, the dashpot pulls at the end. False:
        until the force is zero.

    Returns
    -------
    restitution : ndarray
        From 0 to 1, dimensionless.

    Raises
    ------
    ValueError
        If the damping is outside [0, 1).

    Notes
    -----
    ``e = exp(-π ξ/q)`` with ``q = sqrt(1 - ξ²)``; without tension
    ``e = exp(-(ξ/q) atan2(2 ξ q, 2 ξ² - 1))``.

    References
    ----------
    Anagnostopoulos (1988), Earthquake Engineering and Structural Dynamics 16, for contact with
    tension.

    Examples
    --------
    >>> print(kelvin_voigt_restitution(0.1).round(4))
    0.7292
    >>> print(kelvin_voigt_restitution(0.1, tension=False).round(4))
    0.7441
    """
    damping = checks.fraction_of_critical("damping", damping)
    root = np.sqrt((1.0 - damping) * (1.0 + damping))
    restitution: FloatArray = np.exp(-damping / root * _contact_phase(damping, root, tension))
    return restitution


def _contact_phase(damping: FloatArray, root: FloatArray, tension: bool) -> FloatArray:
    """Return the duration of contact times the damped frequency."""
    phase: FloatArray = np.arctan2(2.0 * damping * root, 2.0 * damping**2 - 1.0)
    return np.full_like(phase, np.pi) if tension else phase


def kelvin_voigt_damping(restitution: ArrayLike) -> FloatArray:
    """
    Compute the damping of a Kelvin-Voigt contact (with tension) that has a restitution.

    Parameters
    ----------
    restitution : array_like
        From 0 to 1, dimensionless.

    Returns
    -------
    damping : ndarray
        Fraction of critical, dimensionless; 1 for a restitution of 0.

    Raises
    ------
    ValueError
        If the restitution is outside [0, 1].

    Notes
    -----
    ``ξ = -ln e/sqrt(π² + ln² e)``, the inverse of :func:`kelvin_voigt_restitution`.

    Examples
    --------
    >>> print(kelvin_voigt_damping([0.0, 0.65, 1.0]).round(4))
    [1.     0.1359 0.    ]
    """
    restitution = checks.between("restitution", restitution, 0.0, 1.0)
    plastic = restitution == 0.0
    decrement = np.abs(np.log(np.where(plastic, 1.0, restitution)))
    damping: FloatArray = np.where(plastic, 1.0, decrement / np.hypot(np.pi, decrement))
    return damping


def mahmoud_jankowski_damping(restitution: ArrayLike) -> FloatArray:
    """
    Compute the damping of a linear viscoelastic contact that is damped while approaching only.

    Parameters
    ----------
    restitution : array_like
        Above 0, up to 1, dimensionless.

    Returns
    -------
    damping : ndarray
        Fraction of critical, dimensionless; above 1 for small restitutions.

    Raises
    ------
    ValueError
        If the restitution is outside (0, 1].

    Notes
    -----
    ``ξ = (1 - e²)/(e (e (π - 2) + 2))``, quoted from the literature, not checked against its text.

    References
    ----------
    Mahmoud & Jankowski (2011), Nonlinear Dynamics.

    Examples
    --------
    >>> print(mahmoud_jankowski_damping(0.65).round(4))
    0.324
    """
    e = _above_zero(restitution)
    damping: FloatArray = (1.0 - e**2) / (e * (e * (np.pi - 2.0) + 2.0))
    return damping


def jankowski_damping(restitution: ArrayLike) -> FloatArray:
    """
    Compute the damping of a Hertz contact that is damped while approaching only.

    Parameters
    ----------
    restitution : array_like
        Above 0, up to 1, dimensionless.

    Returns
    -------
    damping : ndarray
        Damping ratio of the nonlinear contact, dimensionless.

    Raises
    ------
    ValueError
        If the restitution is outside (0, 1].

    Notes
    -----
    ``ξ = (9 √5/2) (1 - e²)/(e (e (9 π - 16) + 16))``, quoted from the literature, not checked
    against its text.

    References
    ----------
    Jankowski (2006), Earthquake Engineering and Structural Dynamics 35.

    Examples
    --------
    >>> print(jankowski_damping(0.65).round(4))
    0.3728
    """
    e = _above_zero(restitution)
    above = 4.5 * np.sqrt(5.0) * (1.0 - e**2)
    damping: FloatArray = above / (e * (e * (9.0 * np.pi - 16.0) + 16.0))
    return damping


def _above_zero(restitution: ArrayLike) -> FloatArray:
    """Return restitutions above 0, up to 1."""
    return checks.positive("restitution", checks.between("restitution", restitution, 0.0, 1.0))


def bumper_restitution(
    stiffness: ArrayLike,
    viscosity: ArrayLike,
    mass_1: ArrayLike,
    mass_2: ArrayLike,
    shortest_period: ArrayLike,
    tension: bool = False,
) -> BumperRestitution:
    """
    Compute the restitution of a linear bumper, and check that its contact is short enough.

    A bumper that fills part of the gap also shortens the gap, which raises the demand.

    Parameters
    ----------
    stiffness : array_like
        Of the bumper, N/m.
    viscosity : array_like
        Of its dashpot, N s/m.
    mass_1, mass_2 : array_like
        Impact masses, kg; one of the two may be infinite.
    shortest_period : array_like
        The shorter period of the pair, s.
    tension : bool, optional
        As in :func:`kelvin_voigt_restitution`; a bumper does not pull.

    Returns
    -------
    BumperRestitution
        Arrays of the broadcast shape.

    Raises
    ------
    ValueError
        If an argument is out of range or the contact is damped critically or more.

    Examples
    --------
    >>> bumper = bumper_restitution(4e8, 2e6, 2e5, 2e5, 0.5)
    >>> print(bumper.damping.round(4), bumper.contact_time.round(4), bumper.instant)
    0.1581 0.0452 True
    """
    stiffness = checks.positive("stiffness", stiffness)
    reduced_mass = mass_shares(mass_1, mass_2)[2]
    critical = 2.0 * np.sqrt(stiffness * reduced_mass)
    damping = checks.not_negative("viscosity", viscosity) / critical
    if np.any(damping >= 1.0):
        raise ValueError(
            f"viscosity gives the contact a damping of {damping.max():.3g}, not below critical"
        )

    # Contact lasts for a phase of the damped vibration of the reduced mass on the bumper
    root = np.sqrt((1.0 - damping) * (1.0 + damping))
    damped_frequency = root * np.sqrt(stiffness / reduced_mass)
    contact_time = _contact_phase(damping, root, tension) / damped_frequency
    instant = contact_time <= LONGEST_CONTACT * checks.positive("shortest_period", shortest_period)
    restitution = kelvin_voigt_restitution(damping, tension)
    return BumperRestitution(restitution, damping, contact_time, instant)
