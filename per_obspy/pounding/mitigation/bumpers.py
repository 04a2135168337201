"""Bumpers between structures: the restitution that is enough, and the contact damping that provides it."""

from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike

from per_obspy import checks
from per_obspy.checks import FloatArray
from per_obspy.pounding.impact import mass_shares
from per_obspy.pounding.single_hit import SingleHitBranches, single_hit

#: The stereomechanical picture (an instant impact) holds for contacts up to this share of the
#: shortest period
LONGEST_CONTACT = 0.1


class BumperRestitution(NamedTuple):
    """
    What a linear bumper does in an impact.

    ``restitution`` and ``damping`` (fraction of critical of the contact) are dimensionless,
    ``contact_time`` is in s; ``instant`` tells whether the contact is short enough to be treated as
    an instant impact.
    """

    restitution: FloatArray
    damping: FloatArray
    contact_time: FloatArray
    instant: np.ndarray[tuple[int, ...], np.dtype[np.bool_]]


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
    Largest restitution for which the single hit amplifies neither structure beyond a target.

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
    target = checks.finite("target", target)
    if np.any(target < 1.0):
        raise ValueError(
            f"target must be at least 1 (the radius before impact is reached anyway), got {target.min()}"
        )
    pair = per_1, per_2, period_1, period_2, mass_1, mass_2, critical_gap, gap, target
    per_1, per_2, period_1, period_2, mass_1, mass_2, critical_gap, gap, target = (
        np.broadcast_arrays(*pair)
    )
    hit = single_hit(per_1, per_2, period_1, period_2, mass_1, mass_2, 0.0, critical_gap, gap)
    share_1, share_2, _ = mass_shares(mass_1, mass_2)
    closing = hit.branches.velocity_1 - hit.branches.velocity_2
    ends = [
        _largest_factor(hit.branches, 1, -share_2 * closing, per_1, period_1, target),
        _largest_factor(hit.branches, 2, share_1 * closing, per_2, period_2, target),
    ]
    factor = np.min(np.minimum(*ends), axis=0)
    enough = np.where(factor >= 1.0, np.minimum(factor - 1.0, 1.0), np.nan)
    known: FloatArray = np.where(hit.status == "no_pounding", 1.0, enough)
    return known


def _largest_factor(
    branches: SingleHitBranches,
    which: int,
    change: FloatArray,
    per: ArrayLike,
    period: ArrayLike,
    target: FloatArray,
) -> FloatArray:
    """Return the largest admissible 1 + e of one structure in both branches; infinite where nothing changes it."""
    displacement, velocity = (
        (branches.displacement_1, branches.velocity_1)
        if which == 1
        else (branches.displacement_2, branches.velocity_2)
    )
    omega = 2.0 * np.pi / np.asarray(period, dtype=np.float64)
    room = (target * np.asarray(per, dtype=np.float64)) ** 2 - displacement**2
    speed = omega * np.sqrt(np.maximum(room, 0.0))
    still = change == 0.0
    factor = (np.copysign(speed, change) - velocity) / np.where(still, 1.0, change)
    return np.where(still, np.inf, factor)


def kelvin_voigt_restitution(damping: ArrayLike, tension: bool = True) -> FloatArray:
    """
    Restitution of a contact by a spring and a dashpot side by side.

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
    ``e = exp(-π ξ/sqrt(1 - ξ²))``; without tension ``e = exp(-(ξ/q) atan2(2 ξ q, 2 ξ² - 1))``, ``q
    = sqrt(1 - ξ²)``.

    References
    ----------
    Anagnostopoulos (1988), Earthquake Engineering and Structural Dynamics 16, for contact with
    tension.

    Examples
    --------
    >>> print(kelvin_voigt_restitution(0.1).round(4), kelvin_voigt_restitution(0.1, tension=False).round(4))
    0.7292 0.7441
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
    Damping of a Kelvin-Voigt contact (with tension) that has a restitution.

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
    Damping of a linear viscoelastic contact that is damped while approaching only.

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
    e = _moving_apart(restitution)
    damping: FloatArray = (1.0 - e**2) / (e * (e * (np.pi - 2.0) + 2.0))
    return damping


def jankowski_damping(restitution: ArrayLike) -> FloatArray:
    """
    Damping of a nonlinear viscoelastic (Hertz) contact that is damped while approaching only.

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
    e = _moving_apart(restitution)
    damping: FloatArray = (
        4.5 * np.sqrt(5.0) * (1.0 - e**2) / (e * (e * (9.0 * np.pi - 16.0) + 16.0))
    )
    return damping


def _moving_apart(restitution: ArrayLike) -> FloatArray:
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
    Restitution of a linear bumper, and whether its contact is short enough for an instant impact.

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
    damping = checks.not_negative("viscosity", viscosity) / (
        2.0 * np.sqrt(stiffness * reduced_mass)
    )
    if np.any(damping >= 1.0):
        raise ValueError(
            f"viscosity gives the contact a damping of {damping.max():.3g}, not below critical"
        )
    root = np.sqrt((1.0 - damping) * (1.0 + damping))
    contact_time = _contact_phase(damping, root, tension) / (
        root * np.sqrt(stiffness / reduced_mass)
    )
    instant = contact_time <= LONGEST_CONTACT * checks.positive("shortest_period", shortest_period)
    return BumperRestitution(
        kelvin_voigt_restitution(damping, tension), damping, contact_time, instant
    )
