"""Least stiffness or damping of a link that keeps two structures apart, found by histories."""

from collections.abc import Callable
from typing import NamedTuple

import numpy as np
from scipy.optimize import brentq

from per_obspy import checks
from per_obspy.checks import ArrayLike, FloatArray
from per_obspy.pounding.history.links import LinkedHistory, linked_history
from per_obspy.pounding.structure import Structure
from per_obspy.spectra.trace_arguments import takes_trace

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


@takes_trace
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
    Find the least stiffness of an elastic link with which two linear structures stay apart.

    Parameters
    ----------
    acceleration : (n_samples,) array_like or obspy Trace
        Ground acceleration from structure 1 to 2, m/s².
    dt : float
        Sampling interval, s; not given with a Trace.
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
        If an argument is out of range, or a structure is bilinear.

    See Also
    --------
    per_obspy.linked_history : History of both structures with a link.

    Notes
    -----
    There is no shortcut: a link changes both periods and the correlation, so that the closing
    ``max(u1 - u2)`` need not fall steadily with its stiffness. 26 exact histories are computed for
    the scan.

    References
    ----------
    Westermo (1989), The dynamics of interstructural connection to prevent pounding, EESD 18, for
    links as a measure.

    Examples
    --------
    >>> pulse = np.sin(np.linspace(0.0, 6.0 * np.pi, 301))
    >>> tower, annex = Structure(1.5, 0.05, 4e5), Structure(0.4, 0.05, 2e5)
    >>> link = required_link_stiffness(pulse, 0.01, tower, annex, 0.02, 1e5, 1e9)
    >>> print(f"{link.value:.3g} N/m, {link.force_maximum:.3g} N", link.robust)
    5.14e+07 N/m, 1.07e+06 N True
    """
    return _required(
        lambda value: linked_history(acceleration, dt, structure_1, structure_2, value),
        gap,
        smallest,
        largest,
    )


@takes_trace
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
    Find the least damping of a viscous link with which two linear structures stay apart.

    Parameters
    ----------
    acceleration : (n_samples,) array_like or obspy Trace
        Ground acceleration from structure 1 to 2, m/s².
    dt : float
        Sampling interval, s; not given with a Trace.
    structure_1, structure_2 : Structure
        Left and right, linear.
    gap : float
        Clear distance at rest, m.
    smallest, largest : float
        Range of viscous coefficients, N s/m.
    stiffness : float, optional
        Of a spring parallel to the dashpot, N/m.

    Returns
    -------
    RequiredLink
        The first value of a scan that suffices, refined in the interval before it.

    Raises
    ------
    ValueError
        If an argument is out of range, or a structure is bilinear.

    See Also
    --------
    per_obspy.required_link_stiffness : Elastic links, and notes.

    References
    ----------
    Westermo (1989), The dynamics of interstructural connection to prevent pounding, EESD 18, for
    links as a measure.

    Examples
    --------
    >>> pulse = np.sin(np.linspace(0.0, 6.0 * np.pi, 301))
    >>> tower, annex = Structure(1.5, 0.05, 4e5), Structure(0.4, 0.05, 2e5)
    >>> link = required_link_damping(pulse, 0.01, tower, annex, 0.02, 1e4, 1e8)
    >>> print(f"{link.value:.3g} N s/m, {link.force_maximum:.3g} N", link.robust)
    3.79e+06 N s/m, 5.23e+05 N True
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
    """Scan, and refine before the first sufficient value: the closing need not fall steadily."""
    gap = checks.number("gap", gap, checks.not_negative)
    values = _trial_values(smallest, largest)
    closing = np.array([history(value).closing for value in values.tolist()])
    smallest_closing, enough = float(closing.min()), closing <= gap
    if not enough.any():
        return RequiredLink(np.nan, smallest_closing, robust=False, force_maximum=np.nan)

    # Refine between the first sufficient value and the one before it
    first = int(np.argmax(enough))
    value = float(values[first])
    if first > 0:
        value = _root(lambda trial: history(trial).closing - gap, values[first - 1], value)
    robust = bool(enough[first:].all())
    return RequiredLink(value, smallest_closing, robust, history(value).force_maximum)


def _trial_values(smallest: float, largest: float) -> FloatArray:
    """Return 0 (no link), then values evenly spaced in their logarithm."""
    low = checks.number("smallest", smallest, checks.positive)
    high = checks.number("largest", largest, checks.positive)
    if low >= high:
        raise ValueError(f"largest must be above smallest, got {high} and {low}")
    return np.concatenate([[0.0], np.geomspace(low, high, TRIALS)])


def _root(excess: Callable[[float], float], low: float, high: float) -> float:
    """Return the value between low and high at which the excess is 0."""
    return float(brentq(excess, low, high, rtol=CLOSE))
