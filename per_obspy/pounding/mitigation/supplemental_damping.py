"""How much added damping, or how much gap, is enough for a pair."""

from collections.abc import Callable
from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike
from scipy.optimize import brentq

from per_obspy import checks
from per_obspy.checks import FloatArray
from per_obspy.pounding.correlation.white_noise import ddc_correlation
from per_obspy.pounding.critical_gap import critical_gap
from per_obspy.pounding.single_hit import single_hit
from per_obspy.spectra.elastic import per_spectrum

STEP = 0.01  # largest step of added damping in the scan: one-sided damping is not monotone
SPLITS = 21  # shares between only structure 2 and only structure 1 that are tried
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


class DampingSplit(NamedTuple):
    """Least sum of dampings to add to both structures, and the share of structure 1 in it, dimensionless."""

    share_1: float
    added: SupplementalDamping


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
    Least damping to add to a pair so that its critical gap, equations (15) and (16), fits into the gap.

    Damping one structure only can make things worse, because the radii drift apart and the
    correlation falls. So the added damping is scanned up to the largest in steps of at most 0.01,
    and refined before the first that is enough.

    Parameters
    ----------
    acceleration : (n_samples,) array_like
        Ground acceleration, m/s².
    dt : float
        Sampling interval, s.
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
    shares = (
        checks.number("share_1", share_1, checks.not_negative),
        checks.number("share_2", share_2, checks.not_negative),
    )
    start = (
        checks.number("damping_1", damping_1, checks.fraction_of_critical),
        checks.number("damping_2", damping_2, checks.fraction_of_critical),
    )
    for which, (own, share) in enumerate(zip(start, shares, strict=True), start=1):
        if own + share * largest >= 1.0:
            raise ValueError(
                f"largest adds up to a damping_{which} of {own + share * largest:.3g}, not below critical"
            )

    def needed(added: FloatArray) -> FloatArray:
        dampings = start[0] + shares[0] * added, start[1] + shares[1] * added
        per_1 = per_spectrum(acceleration, dt, [period_1], dampings[0])[:, 0]
        per_2 = per_spectrum(acceleration, dt, [period_2], dampings[1])[:, 0]
        return critical_gap(
            per_1, per_2, ddc_correlation(period_1, dampings[0], period_2, dampings[1])
        )

    return _least(needed, gap, largest)


def _least(
    needed: Callable[[FloatArray], FloatArray], gap: float, largest: float
) -> SupplementalDamping:
    """Scan the needed gap over the added damping and refine before the first that is enough."""
    grid = np.linspace(0.0, largest, int(np.ceil(largest / STEP)) + 1)
    gaps = needed(grid)
    enough = gaps <= gap
    if not enough.any():
        return SupplementalDamping(float("nan"), float(gaps.min()), robust=False)
    first = int(np.argmax(enough))
    robust = bool(enough[first:].all())
    if first == 0:
        return SupplementalDamping(0.0, float(gaps.min()), robust)

    def excess(added: float) -> float:
        return float(needed(np.array([added]))[0]) - gap

    damping = brentq(excess, grid[first - 1], grid[first], xtol=1e-12, rtol=1e-12)
    return SupplementalDamping(float(damping), float(gaps.min()), robust)


def optimal_damping_split(
    acceleration: ArrayLike,
    dt: float,
    period_1: float,
    damping_1: float,
    period_2: float,
    damping_2: float,
    gap: float,
    largest: float = 0.4,
) -> DampingSplit:
    """
    Split of the added damping between both structures that needs the least in sum.

    Parameters
    ----------
    acceleration, dt, period_1, damping_1, period_2, damping_2, gap : array_like and float
        As in :func:`supplemental_damping`.
    largest : float, optional
        Largest sum to add, dimensionless.

    Returns
    -------
    DampingSplit
        Best of 21 shares from 0 to 1; where none is enough, the one with the least critical gap.

    Raises
    ------
    ValueError
        As in :func:`supplemental_damping`.
    """
    pair = acceleration, dt, period_1, damping_1, period_2, damping_2, gap
    splits = [
        DampingSplit(
            float(share), supplemental_damping(*pair, float(share), 1.0 - float(share), largest)
        )
        for share in np.linspace(0.0, 1.0, SPLITS)
    ]
    sufficient = [split for split in splits if not np.isnan(split.added.damping)]
    if sufficient:
        return min(sufficient, key=lambda split: split.added.damping)
    return min(splits, key=lambda split: split.added.smallest_gap)


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
    Smallest gap from which on the single hit amplifies neither structure beyond a target.

    Parameters
    ----------
    per_1, per_2, period_1, period_2, mass_1, mass_2, restitution, critical_gap : float
        As in :func:`per_obspy.single_hit`.
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
    """
    target = checks.number("target", target, checks.positive)
    if target < 1.0:
        raise ValueError(
            f"target must be at least 1 (the radius before impact is reached anyway), got {target}"
        )
    pair = per_1, per_2, period_1, period_2, mass_1, mass_2, restitution, critical_gap

    def too_much(gaps: FloatArray) -> np.ndarray[tuple[int, ...], np.dtype[np.bool_]]:
        hit = single_hit(*pair, gaps)
        amplification = np.maximum(hit.amplification_1, hit.amplification_2)
        # NaN, no grazing state, must not pass
        return ~(amplification <= target)

    gaps = np.linspace(0.0, checks.number("critical_gap", critical_gap, checks.not_negative), GAPS)
    failing = np.flatnonzero(too_much(gaps))
    if failing.size == 0:
        return 0.0
    if single_hit(*pair, gaps[0]).status not in ("ok", "no_pounding"):
        return float("nan")
    low, high = gaps[failing[-1]], gaps[failing[-1] + 1]
    while (middle := 0.5 * (low + high)) not in (low, high):
        if too_much(np.array([middle]))[0]:
            low = middle
        else:
            high = middle
    return float(high)
