"""Least added damping, or least gap, that is enough for a pair."""

from collections.abc import Callable
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray
from scipy.optimize import brentq

from per_obspy import checks
from per_obspy.checks import ArrayLike, FloatArray
from per_obspy.pounding.correlation import ddc_correlation
from per_obspy.pounding.critical_gap import critical_gap
from per_obspy.pounding.single_hit import amplification_target, single_hit
from per_obspy.spectra.elastic import per_spectrum
from per_obspy.spectra.trace_arguments import takes_trace

STEP = 0.01  # largest step of added damping in the scan: one-sided damping is not monotone
GAPS = 2001  # scanned below the critical gap


class SupplementalDamping(NamedTuple):
    """
    Least damping to add.

    ``damping`` is the fraction of critical to add (times each structure's share), NaN if none up to
    the largest is enough; ``smallest_gap`` the least critical gap reached by any, m; ``robust`` is
    False where more damping than ``damping`` makes the critical gap larger than the gap again, or
    where none is enough.
    """

    damping: float
    smallest_gap: float
    robust: bool


@takes_trace
def supplemental_damping(
    acceleration: ArrayLike,
    dt: float,
    period_1: float,
    damping_1: float,
    period_2: float,
    damping_2: float,
    gap: float,
    share_1: float = 1.0,
    share_2: float = 1.0,
    largest: float = 0.4,
) -> SupplementalDamping:
    """
    Find the least damping to add to a pair so that its critical gap fits into the gap.

    The critical gap is that of equations (15) and (16). Damping one structure only can make things
    worse, because the radii drift apart and the correlation falls. So the added damping is scanned
    up to the largest in steps of at most 0.01, and refined before the first that is enough.

    Parameters
    ----------
    acceleration : (n_samples,) array_like or obspy Trace
        Ground acceleration, m/s².
    dt : float
        Sampling interval, s; not given with a Trace.
    period_1, period_2 : float
        Undamped periods, s.
    damping_1, damping_2 : float
        Dampings now, fractions of critical, dimensionless.
    gap : float
        Actual gap, m.
    share_1, share_2 : float, optional
        Part of the added damping that each structure receives, dimensionless: 1 and 1 for both, 1
        and 0 for one.
    largest : float, optional
        Largest damping to add, dimensionless.

    Returns
    -------
    SupplementalDamping
        ``damping`` is 0 if the gap is enough already.

    Raises
    ------
    ValueError
        If an argument is out of range, or a structure would become critically damped.

    References
    ----------
    Valles-Mattox & Reinhorn (1996), 11WCEE, figure 8.

    Examples
    --------
    >>> pulse = np.sin(np.linspace(0.0, 6.0 * np.pi, 301))
    >>> found = supplemental_damping(pulse, 0.01, 0.9, 0.05, 1.2, 0.05, 0.1)
    >>> 0.0 < found.damping < 0.4, found.robust
    (True, True)
    """
    acceleration = checks.record("acceleration", acceleration)
    gap = checks.number("gap", gap, checks.not_negative)
    largest = checks.number("largest", largest, checks.positive)
    period_1, damping_1, share_1 = _checked(1, period_1, damping_1, share_1)
    period_2, damping_2, share_2 = _checked(2, period_2, damping_2, share_2)
    _refuse_critical("damping_1", damping_1 + share_1 * largest)
    _refuse_critical("damping_2", damping_2 + share_2 * largest)

    def critical_gaps(added: FloatArray) -> FloatArray:
        """Return the critical gap for each added damping, m."""
        xi_1, xi_2 = damping_1 + share_1 * added, damping_2 + share_2 * added

        # Equation (16) for the correlation, equation (15) with the radii
        correlation = ddc_correlation(period_1, xi_1, period_2, xi_2)
        per_1 = per_spectrum(acceleration, dt, [period_1], xi_1)[:, 0]
        per_2 = per_spectrum(acceleration, dt, [period_2], xi_2)[:, 0]
        return critical_gap(per_1, per_2, correlation)

    # Scan the added damping, and refine before the first that is enough
    return _least(critical_gaps, gap, largest)


def _checked(
    number: int, period: float, damping: float, share: float
) -> tuple[float, float, float]:
    return (
        checks.number(f"period_{number}", period, checks.positive),
        checks.number(f"damping_{number}", damping, checks.fraction_of_critical),
        checks.number(f"share_{number}", share, checks.not_negative),
    )


def _refuse_critical(name: str, damping: float) -> None:
    if damping >= 1.0:
        raise ValueError(f"largest adds up to a {name} of {damping:.3g}, not below critical")


def _least(
    critical_gaps: Callable[[FloatArray], FloatArray], gap: float, largest: float
) -> SupplementalDamping:
    """Scan the critical gap over the added damping and refine before the first that is enough."""
    grid = np.linspace(0.0, largest, int(np.ceil(largest / STEP)) + 1)
    gaps = critical_gaps(grid)
    smallest_gap, enough = float(gaps.min()), gaps <= gap
    if not enough.any():
        return SupplementalDamping(float("nan"), smallest_gap, robust=False)
    first = int(np.argmax(enough))

    # More damping than the first that is enough can be too much
    robust = bool(enough[first:].all())
    if first == 0:
        return SupplementalDamping(0.0, smallest_gap, robust)

    def excess(added: float) -> float:
        """Return the critical gap beyond the gap, m."""
        return float(critical_gaps(np.array([added]))[0]) - gap

    # Refine in the step before
    damping = brentq(excess, grid[first - 1], grid[first], xtol=1e-12, rtol=1e-12)
    return SupplementalDamping(float(damping), smallest_gap, robust)


def required_gap(
    per_1: float,
    per_2: float,
    period_1: float,
    period_2: float,
    mass_1: float,
    mass_2: float,
    restitution: float,
    critical_gap: float,
    target: float,
) -> float:
    """
    Find the least gap from which on the single hit amplifies no structure beyond a target.

    Parameters
    ----------
    per_1, per_2 : float
        Pseudo Energy Radius of each structure at contact level, m.
    period_1, period_2 : float
        Undamped periods, s.
    mass_1, mass_2 : float
        Impact masses, kg; one of the two may be infinite.
    restitution : float
        Coefficient of restitution, from 0 to 1, dimensionless.
    critical_gap : float
        Gap at which the pair would only just touch, m.
    target : float
        Largest admissible amplification of either structure, at least 1, dimensionless.

    Returns
    -------
    gap : float
        In m; every gap from here to the critical one meets the target (smaller gaps may do so
        again: the amplification is not monotone). The critical gap if the target is 1 and any
        impact amplifies; NaN without a grazing state.

    Raises
    ------
    ValueError
        If an argument is out of range.

    Notes
    -----
    2001 gaps up to the critical one are tried; the end of the admissible stretch is then bisected.

    References
    ----------
    Valles-Mattox & Reinhorn (1996), 11WCEE, section "Estimating pounding effects", for the single
    hit.

    Examples
    --------
    >>> gap = required_gap(0.3, 0.4, 1.0, 1.3, 1e6, 1e6, 0.65, 0.5, target=1.2)
    >>> print(f"{gap:.3f} m")
    0.479 m
    """
    target = checks.number("target", target, amplification_target)
    pair = per_1, per_2, period_1, period_2, mass_1, mass_2, restitution, critical_gap

    def exceeds(gaps: FloatArray) -> NDArray[np.bool_]:
        """Return True for each gap at which a structure is amplified beyond the target."""
        hit = single_hit(*pair, gaps)
        amplification = np.maximum(hit.amplification_1, hit.amplification_2)
        # NaN, no grazing state, must not pass
        return ~(amplification <= target)

    # Scan gaps up to the critical one
    gaps = np.linspace(0.0, checks.number("critical_gap", critical_gap, checks.not_negative), GAPS)
    failing = np.flatnonzero(exceeds(gaps))
    if failing.size == 0:
        return 0.0
    if single_hit(*pair, gaps[0]).status not in ("ok", "no_pounding"):
        return float("nan")

    # Bisect to neighbouring numbers between the largest gap that fails and the next one
    low, high = gaps[failing[-1]], gaps[failing[-1] + 1]
    while (middle := 0.5 * (low + high)) not in (low, high):
        low, high = (middle, high) if exceeds(middle) else (low, middle)
    return float(high)
