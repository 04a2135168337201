"""How stiff or how viscous a link must be to keep two structures apart: found by histories; there is no shortcut."""

from collections.abc import Callable
from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike
from scipy.optimize import brentq

from per_obspy import checks
from per_obspy.pounding.history.links import LinkedHistory, linked_history
from per_obspy.pounding.structure import Structure

#: Values tried over the range, evenly spaced in their logarithm.
TRIALS = 25

#: The refined value is this close to the true one, relative.
CLOSE = 1e-6


class RequiredLink(NamedTuple):
    """
    Least link that keeps the gap open.

    Attributes
    ----------
    value : float
        Stiffness, N/m, or damping, N s/m; 0 if no link is needed, NaN if none of the range
        suffices.
    smallest_closing : float
        Least of the largest ``u1 - u2`` over the range, m: the gap that the best link would need.
    robust : bool
        Whether every stiffer or more viscous link of the range suffices as well.
    force_maximum : float
        Of the link at that value, N; NaN if there is none.
    """

    value: float
    smallest_closing: float
    robust: bool
    force_maximum: float


def required_link_stiffness(
    acceleration: ArrayLike,
    dt: float,
    structure_1: Structure,
    structure_2: Structure,
    gap: float,
    smallest: float,
    largest: float,
) -> RequiredLink:
    """
    Least stiffness of an elastic link with which two linear structures stay apart.

    Parameters
    ----------
    acceleration : (n_samples,) array_like
        Ground acceleration from structure 1 to 2, m/s².
    dt : float
        Sampling interval, s.
    structure_1, structure_2 : Structure
        Left and right, linear.
    gap : float
        Clear distance at rest, m.
    smallest, largest : float
        Range of stiffnesses, N/m.

    Returns
    -------
    RequiredLink
        The first value of a scan that suffices, refined in the interval before it.

    Raises
    ------
    ValueError
        If an argument is out of range.
    """
    return _required(
        lambda value: linked_history(acceleration, dt, structure_1, structure_2, value),
        gap,
        smallest,
        largest,
    )


def required_link_damping(
    acceleration: ArrayLike,
    dt: float,
    structure_1: Structure,
    structure_2: Structure,
    gap: float,
    smallest: float,
    largest: float,
    stiffness: float = 0.0,
) -> RequiredLink:
    """
    Least damping of a viscous link (beside a given stiffness) with which two linear structures stay apart.

    Parameters, results and errors as :func:`required_link_stiffness`, with ``smallest`` and
    ``largest`` in N s/m and ``stiffness`` of the link in N/m.
    """
    return _required(
        lambda value: linked_history(acceleration, dt, structure_1, structure_2, stiffness, value),
        gap,
        smallest,
        largest,
    )


def _required(
    history: Callable[[float], LinkedHistory], gap: float, smallest: float, largest: float
) -> RequiredLink:
    """Scan, take the first value that suffices, and refine before it: the closing need not fall steadily."""
    gap = checks.number("gap", gap, checks.not_negative)
    low, high = (
        checks.number(name, value, checks.positive)
        for name, value in (("smallest", smallest), ("largest", largest))
    )
    if low >= high:
        raise ValueError(f"largest must be above smallest, got {high} and {low}")
    values = np.concatenate([[0.0], np.geomspace(low, high, TRIALS)])
    closing = np.array([history(value).closing for value in values.tolist()])
    enough = closing <= gap
    if not enough.any():
        return RequiredLink(np.nan, float(closing.min()), robust=False, force_maximum=np.nan)
    first = int(np.argmax(enough))
    value = float(values[first])
    if first > 0:
        value = brentq(lambda one: history(one).closing - gap, values[first - 1], value, rtol=CLOSE)
    robust = bool(enough[first:].all())
    return RequiredLink(
        float(value), float(closing.min()), robust, history(float(value)).force_maximum
    )
