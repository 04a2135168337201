"""
Impact of two masses, and the single-hit estimate of pounding.

The estimate goes from the grazing state to the earlier contact, the impact, and the radii after it.
"""

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from per_obspy import checks
from per_obspy.checks import ArrayLike, FloatArray
from per_obspy.kernels.pairs.single_hit import NO_POUNDING, PAIRS, estimate
from per_obspy.threads import map_in_threads


class ImpactVelocities(NamedTuple):
    """Velocities right after an impact, m/s."""

    velocity_1: FloatArray
    velocity_2: FloatArray


class TransferEnergies(NamedTuple):
    """Energy that leaves each structure in an impact, J; negative where a structure gains."""

    transfer_energy_1: FloatArray
    transfer_energy_2: FloatArray


def post_impact_velocities(
    velocity_1: ArrayLike,
    velocity_2: ArrayLike,
    mass_1: ArrayLike,
    mass_2: ArrayLike,
    restitution: ArrayLike,
) -> ImpactVelocities:
    """
    Compute the velocities after a stereomechanical impact.

    Parameters
    ----------
    velocity_1, velocity_2 : array_like
        Velocities before the impact, m/s; an impact needs ``velocity_1 > velocity_2`` (structure 1
        is left of 2).
    mass_1, mass_2 : array_like
        Impact masses, kg; one of the two may be infinite (a wall).
    restitution : array_like
        Coefficient of restitution e, from 0 (plastic) to 1 (elastic), dimensionless.

    Returns
    -------
    ImpactVelocities
        ``velocity_1``, ``velocity_2``: broadcast shape, m/s.

    Raises
    ------
    ValueError
        If a mass is not positive, both are infinite, or the restitution is outside [0, 1].

    Notes
    -----
    ``v1' = v1 - (1 + e) m2/(m1 + m2) (v1 - v2)`` and ``v2' = v2 + (1 + e) m1/(m1 + m2) (v1 - v2)``.

    References
    ----------
    Valles-Mattox & Reinhorn (1996), 11WCEE, equations (7) and (8).

    Examples
    --------
    >>> velocity_1, velocity_2 = post_impact_velocities(1.0, 0.0, 2.0, 2.0, 0.5)
    >>> print(velocity_1, velocity_2)
    0.25 0.75
    """
    velocity_1 = checks.finite("velocity_1", velocity_1)
    velocity_2 = checks.finite("velocity_2", velocity_2)
    share_1, share_2, _ = mass_shares(mass_1, mass_2)

    # Equations (7) and (8)
    factor = 1.0 + checks.between("restitution", restitution, 0.0, 1.0)
    change = factor * (velocity_1 - velocity_2)
    return ImpactVelocities(velocity_1 - share_2 * change, velocity_2 + share_1 * change)


def transfer_energies(
    velocity_1: ArrayLike,
    velocity_2: ArrayLike,
    mass_1: ArrayLike,
    mass_2: ArrayLike,
    restitution: ArrayLike,
) -> TransferEnergies:
    """
    Compute the energy that leaves each structure in one impact.

    Parameters
    ----------
    velocity_1, velocity_2 : array_like
        Velocities before the impact, m/s.
    mass_1, mass_2 : array_like
        Impact masses, kg; one of the two may be infinite.
    restitution : array_like
        Coefficient of restitution, from 0 to 1, dimensionless.

    Returns
    -------
    TransferEnergies
        ``transfer_energy_1`` (the paper's E_Tr12) and ``transfer_energy_2`` (E_Tr21): broadcast
        shape, J. Positive energy leaves the structure; their sum is the loss
        ``½ (1 - e²) m1 m2/(m1 + m2) (v1 - v2)²``.

    Raises
    ------
    ValueError
        If a mass is not positive, both are infinite, or the restitution is outside [0, 1].

    Notes
    -----
    With the impulse ``J = (1 + e) m1 m2/(m1 + m2) (v1 - v2)``: ``E_Tr12 = J (v1 + v1')/2`` and
    ``E_Tr21 = -J (v2 + v2')/2``. The printed (9) and (10) have the opposite sign: they are the
    kinetic energies that the structures gain, which contradicts the energy balance (3) of the
    paper, (4).

    References
    ----------
    Valles-Mattox & Reinhorn (1996), 11WCEE, equations (9) and (10), signs corrected.

    Examples
    --------
    >>> print(*transfer_energies(1.0, 0.0, 2.0, 2.0, 1.0))
    1.0 -1.0
    """
    after_1, after_2 = post_impact_velocities(velocity_1, velocity_2, mass_1, mass_2, restitution)
    velocity_1 = np.asarray(velocity_1, dtype=np.float64)
    velocity_2 = np.asarray(velocity_2, dtype=np.float64)

    # Impulse J = (1 + e) m1 m2/(m1 + m2) (v1 - v2)
    reduced_mass = mass_shares(mass_1, mass_2)[2]
    factor = 1.0 + np.asarray(restitution, dtype=np.float64)
    impulse = factor * reduced_mass * (velocity_1 - velocity_2)

    # Equations (9) and (10) with the signs of the notes
    leaving_1 = impulse * (velocity_1 + after_1) / 2.0
    leaving_2 = -impulse * (velocity_2 + after_2) / 2.0
    return TransferEnergies(leaving_1, leaving_2)


def mass_shares(mass_1: ArrayLike, mass_2: ArrayLike) -> tuple[FloatArray, FloatArray, FloatArray]:
    """
    Return ``m1/(m1 + m2)``, ``m2/(m1 + m2)`` and the reduced mass ``m1 m2/(m1 + m2)`` (kg).

    Masses are checked: above zero, and one of the two may be infinite.
    """
    mass_1 = checks.positive_or_infinite("mass_1", mass_1)
    mass_2 = checks.positive_or_infinite("mass_2", mass_2)
    if np.any(np.isinf(mass_1) & np.isinf(mass_2)):
        raise ValueError("mass_1 and mass_2 are both infinite: two walls do not collide")
    inverse_1, inverse_2 = 1.0 / mass_1, 1.0 / mass_2
    total = inverse_1 + inverse_2
    return inverse_2 / total, inverse_1 / total, 1.0 / total


#: Pairs that a thread takes at a time; a whole number of the kernel's blocks.
SHARE = 512 * PAIRS

STATUS = np.array(["ok", "no_pounding", "no_grazing_state", "inconsistent_critical_gap"])


class SingleHitBranches(NamedTuple):
    """
    Both possible impacts of each pair.

    First axis: both structures move towards 2 at the grazing state (+), then towards 1 (-).
    ``time_before`` is the time from the actual contact to the grazing state, s. Displacements and
    radii are in m, velocities in m/s, transfer energies in J (positive leaves the structure),
    amplifications dimensionless.
    """

    time_before: FloatArray
    displacement_1: FloatArray
    velocity_1: FloatArray
    velocity_after_1: FloatArray
    per_after_1: FloatArray
    amplification_1: FloatArray
    transfer_energy_1: FloatArray
    displacement_2: FloatArray
    velocity_2: FloatArray
    velocity_after_2: FloatArray
    per_after_2: FloatArray
    amplification_2: FloatArray
    transfer_energy_2: FloatArray


class SingleHit(NamedTuple):
    """
    Single-hit estimate of each pair.

    ``status`` is ``"ok"``, ``"no_pounding"`` (gap at least critical), ``"no_grazing_state"`` (this
    critical gap is no distance at which the two radii only just touch) or
    ``"inconsistent_critical_gap"`` (larger than the sum of the radii). ``amplification_i`` is the
    radius after impact over the radius before, never below 1 because the radius before was reached
    anyway; ``per_after_i`` (m) and ``impact_velocity`` (v1 - v2, m/s) are the largest of the two
    branches. They are NaN unless the status is ``ok``, and 1, the radius before, and 0 for
    ``no_pounding``. ``envelope_i`` (m) bounds the radius after impact over all phases of both
    structures and is never NaN.
    """

    status: NDArray[np.str_]
    amplification_1: FloatArray
    amplification_2: FloatArray
    per_after_1: FloatArray
    per_after_2: FloatArray
    impact_velocity: FloatArray
    branches: SingleHitBranches
    envelope_1: FloatArray
    envelope_2: FloatArray


def single_hit(
    per_1: ArrayLike,
    per_2: ArrayLike,
    period_1: ArrayLike,
    period_2: ArrayLike,
    mass_1: ArrayLike,
    mass_2: ArrayLike,
    restitution: ArrayLike,
    critical_gap: ArrayLike,
    gap: ArrayLike,
) -> SingleHit:
    """
    Estimate the amplification of both structures of a pair by one impact at full energy.

    Parameters
    ----------
    per_1, per_2 : array_like
        Pseudo Energy Radius of each structure at contact level, m; 0 is a wall or a structure at
        rest.
    period_1, period_2 : array_like
        Undamped periods, s.
    mass_1, mass_2 : array_like
        Impact masses, kg; one of the two may be infinite.
    restitution : array_like
        Coefficient of restitution, from 0 to 1, dimensionless.
    critical_gap : array_like
        Gap at which the pair would only just touch, m.
    gap : array_like
        Actual gap, m.

    Returns
    -------
    SingleHit
        Arrays of the broadcast shape; those of ``branches`` have the branch as an additional first
        axis.

    Raises
    ------
    ValueError
        If a radius or gap is negative, a period or mass is not positive, or the restitution is
        outside [0, 1].

    Notes
    -----
    At the grazing state both structures have the same velocity v and lie on their energy circles,
    at the displacements x and x - g_cr. With ``A = w2² - w1²``, ``B = w2² g_cr`` and
    ``C = w1² r1² - w2² r2² + w2² g_cr²`` the only root at which the gap is smallest is
    ``x = C/(B + sqrt(B² - A C))``. The sign of v is not determined, so both branches are followed
    back along their circles to the first contact at the actual gap, where the impact takes place.

    Largest amplification of either structure, predicted over actual: median, standard deviation of
    the logarithm, share of cases under-predicted by more than 1 %. Measured on 16 broad-band
    components and the 2 of SCT 1985, 91 pairs from 0.3 s to 4 s either way round, damping 5 %,
    restitution 0.65, exact critical gap (``docs/reliability.md``, repeated by
    ``workflows/reliability_tables.py``); cases without a grazing state, 10 % and 39 %, are left
    out:

    ========  ====================  ====================  ===================  ===================
    g/g_cr    broad band, m2 = m1   Mexico City, m2 = m1  broad, m2 = 5 m1     broad, m2 = 0.2 m1
    ========  ====================  ====================  ===================  ===================
    0.95      1.26, 0.12, 0.01      1.35, 0.15, 0.01      1.31, 0.15, 0.00     1.22, 0.19, 0.09
    0.80      1.31, 0.18, 0.06      1.34, 0.17, 0.04      1.44, 0.16, 0.00     1.17, 0.23, 0.17
    0.50      1.15, 0.24, 0.24      1.37, 0.20, 0.08      1.39, 0.17, 0.02     1.07, 0.23, 0.33
    0.05      1.03, 0.26, 0.44      1.24, 0.31, 0.13      1.23, 0.20, 0.15     1.16, 0.21, 0.18
    ========  ====================  ====================  ===================  ===================

    Near the critical gap the estimate is conservative, not accurate; below 0.6 of it several
    impacts make it unreliable, and a small change of the gap can change it by a jump. A light
    structure 2 is the least favourable.

    References
    ----------
    Valles-Mattox & Reinhorn (1996), 11WCEE, section "Estimating pounding effects" and figure 5.

    Examples
    --------
    Equal periods: the impact takes place where the relative motion has left ``w sqrt(g_cr² - g²)``.

    >>> hit = single_hit(0.3, 0.4, 1.0, 1.0, 1e6, 1e6, 0.65, 0.5, 0.4)
    >>> print(hit.status, round(float(hit.impact_velocity / (2 * np.pi)), 6))
    ok 0.3
    """
    radii = checks.not_negative("per_1", per_1), checks.not_negative("per_2", per_2)
    frequency_1 = 2 * np.pi / checks.positive("period_1", period_1)
    frequency_2 = 2 * np.pi / checks.positive("period_2", period_2)

    # Parts of the velocity difference that both structures receive, and the impulse per velocity
    share_1, share_2, reduced_mass = mass_shares(mass_1, mass_2)
    factor = 1.0 + checks.between("restitution", restitution, 0.0, 1.0)
    impact = factor * share_2, factor * share_1, factor * reduced_mass
    gaps = checks.not_negative("critical_gap", critical_gap), checks.not_negative("gap", gap)

    # Prepare arrays to be passed to the jitted function
    broadcast = np.broadcast_arrays(*radii, frequency_1, frequency_2, *impact, *gaps)
    return _estimate(np.stack([array.ravel() for array in broadcast]), broadcast[0].shape)


def _estimate(arguments: FloatArray, shape: tuple[int, ...]) -> SingleHit:
    status, fields, envelope = _run(arguments)
    status = status.reshape(shape)
    branches = SingleHitBranches(*(field.reshape(2, *shape) for field in np.moveaxis(fields, 1, 0)))

    # The larger of both branches; the radius before impact is reached anyway
    velocity = np.max(branches.velocity_1 - branches.velocity_2, axis=0)
    return SingleHit(
        status=STATUS[status],
        amplification_1=np.maximum(np.max(branches.amplification_1, axis=0), 1.0),
        amplification_2=np.maximum(np.max(branches.amplification_2, axis=0), 1.0),
        per_after_1=np.max(branches.per_after_1, axis=0),
        per_after_2=np.max(branches.per_after_2, axis=0),
        impact_velocity=np.where(status == NO_POUNDING, 0.0, velocity),
        branches=branches,
        envelope_1=envelope[0].reshape(shape),
        envelope_2=envelope[1].reshape(shape),
    )


def _run(arguments: FloatArray) -> tuple[NDArray[np.int8], FloatArray, FloatArray]:
    """
    Return status (n,), fields of both branches (2, 13, n) and bounds (2, n) of the kernel.

    The kernel gets whole blocks, so that the rounding of a pair does not depend on other pairs.
    """
    count = arguments.shape[1]
    whole = np.pad(arguments, ((0, 0), (0, -count % PAIRS)), mode="edge") if count else arguments
    status = np.empty(whole.shape[1], dtype=np.int8)
    fields = np.empty((2, len(SingleHitBranches._fields), status.size))
    envelope = np.empty((2, status.size))

    def fill(begin: int) -> None:
        """Fill in the estimates of one share of the pairs."""
        end = min(begin + SHARE, status.size)
        estimate(whole, begin, end, status, fields, envelope)

    # Threads take large shares of the pairs
    map_in_threads(fill, range(0, status.size, SHARE))
    return status[:count], fields[..., :count], envelope[:, :count]


def amplification_target(name: str, values: ArrayLike) -> FloatArray:
    """Return checked amplifications of at least 1."""
    target = checks.finite(name, values)
    if np.any(target < 1.0):
        raise ValueError(
            f"{name} must be at least 1 (the radius before impact is reached anyway), "
            f"got {target.min()}"
        )
    return target
