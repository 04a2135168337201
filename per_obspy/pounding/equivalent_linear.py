"""Equivalent linear period and damping of a bilinear structure, by formulas of several authors."""

import math
from collections.abc import Callable
from typing import NamedTuple, TypeVar

from per_obspy import checks
from per_obspy.checks import FloatArray

Ductility = TypeVar("Ductility", float, FloatArray)


class EquivalentLinear(NamedTuple):
    """``period`` (s) and ``damping`` (fraction of critical) of the equivalent linear structure."""

    period: float
    damping: float


class UnverifiedEquivalentLinear(EquivalentLinear):
    """:class:`EquivalentLinear` from unverified coefficients: the source text was not at hand."""


def _secant(ductility: float, hardening: float) -> float:
    """Return the period of the secant stiffness at the peak over the elastic one."""
    return math.sqrt(ductility / (1.0 - hardening + hardening * ductility))


def _rosenblueth_herrera(ductility: float, hardening: float) -> tuple[float, float]:
    """Return the period factor of the secant stiffness, and the damping of the loop's area."""
    above = (1.0 - hardening) * (ductility - 1.0)
    loop = above / (ductility - hardening * ductility + hardening * ductility**2)
    return _secant(ductility, hardening), 2.0 / math.pi * loop


def _gulkan_sozen(ductility: float, hardening: float) -> tuple[float, float]:
    """Return period factor and damping fitted to tests of reinforced concrete."""
    return _secant(ductility, hardening), 0.2 * (1.0 - 1.0 / math.sqrt(ductility))


def _kowalsky(ductility: float, hardening: float) -> tuple[float, float]:
    """Return period factor and damping of Takeda's loops (Kowalsky 1994)."""
    root = math.sqrt(ductility)
    loop = 1.0 - (1.0 - hardening) / root - hardening * root
    return _secant(ductility, hardening), loop / math.pi


def _fema_440(ductility: float, _: float) -> tuple[float, float]:
    """Return period factor and damping of FEMA 440 for any hysteresis, in three ranges."""
    # Ductilities below 4, up to 6.5, and above
    over = ductility - 1.0
    if ductility < 4.0:
        return 1.0 + 0.20 * over**2 - 0.038 * over**3, (4.9 * over**2 - 1.1 * over**3) / 100.0
    if ductility <= 6.5:
        return 1.28 + 0.13 * over, (14.0 + 0.32 * over) / 100.0
    factor = 1.0 + 0.89 * (math.sqrt(over / (1.0 + 0.05 * (ductility - 2.0))) - 1.0)
    return factor, 19.0 * (0.64 * over - 1.0) / (0.64 * over) ** 2 * factor**2 / 100.0


def _powers(
    longer: float, exponent: float, damping: float, damping_exponent: float
) -> Callable[[Ductility, float], tuple[Ductility, Ductility]]:
    """Return a formula by powers of the ductility above 1, fitted for one hardening."""

    def formula(ductility: Ductility, _: float) -> tuple[Ductility, Ductility]:
        over = ductility - 1.0
        return 1.0 + longer * over**exponent, damping * over**damping_exponent

    return formula


#: Period factor and damping to add (Iwan 1980), of arrays of ductilities from 1 too
iwan = _powers(0.121, 0.939, 0.0587, 0.371)

#: Formulas by their authors: of ductility and hardening, the factor of the period and the damping
#: to add. ``gulkan_sozen`` includes 2 % of viscous damping, so the structure's is not added.
METHODS: dict[str, Callable[[float, float], tuple[float, float]]] = {
    "rosenblueth_herrera": _rosenblueth_herrera,
    "gulkan_sozen": _gulkan_sozen,
    "iwan": iwan,
    "kowalsky": _kowalsky,
    "fema_440": _fema_440,
    "jeng_unverified": _powers(0.09, 1.0, 0.084, 1.3),
    "kasai_unverified": _powers(0.18, 1.0, 0.16, 0.9),
}
OWN_DAMPING = {"gulkan_sozen": 0.02}


def equivalent_linear(
    method: str, ductility: float, period: float, damping: float, hardening: float
) -> EquivalentLinear | UnverifiedEquivalentLinear:
    """
    Compute period and damping of the linear structure equivalent to a bilinear one.

    Parameters
    ----------
    method : str
        ``rosenblueth_herrera`` (secant stiffness and loop area), ``gulkan_sozen``, ``iwan`` (1980),
        ``kowalsky``, ``fema_440``, and, with coefficients unverified, ``jeng_unverified`` (1992),
        ``kasai_unverified`` (1996).
    ductility : float
        Peak over yield displacement, dimensionless; up to 1 the structure is linear and returned as
        it is.
    period : float
        Elastic period, s.
    damping : float
        Elastic damping, fraction of critical, dimensionless.
    hardening : float
        Stiffness after yielding over elastic stiffness, at least 0 and below 1, dimensionless.

    Returns
    -------
    EquivalentLinear or UnverifiedEquivalentLinear
        ``period`` (s) and ``damping`` (fraction of critical).

    Raises
    ------
    ValueError
        If the method is unknown, an argument is out of range, or the equivalent damping is not
        below critical.

    References
    ----------
    Rosenblueth & Herrera (1964); Gulkan & Sozen (1974); Iwan (1980), EESD 8; Kowalsky (1994); FEMA
    440 (2005), which is discontinuous at a ductility of 4. Unverified: Jeng, Kasai & Maison (1992);
    Kasai, Jagiasi & Jeng (1996).

    Examples
    --------
    >>> print("%.1f s, %.4f" % equivalent_linear("rosenblueth_herrera", 4.0, 1.0, 0.05, 0.0))
    2.0 s, 0.5275
    """
    if method not in METHODS:
        raise ValueError(f"method must be one of {', '.join(METHODS)}, got {method!r}")
    ductility = checks.number("ductility", ductility, checks.positive)
    period = checks.number("period", period, checks.positive)
    damping = checks.number("damping", damping, checks.fraction_of_critical)
    hardening = checks.number("hardening", hardening, checks.fraction_of_critical)

    # The type of the result shows whether its coefficients are verified
    result = UnverifiedEquivalentLinear if method.endswith("unverified") else EquivalentLinear
    if ductility <= 1.0:
        return result(period, damping)

    # Longer period and added damping of the yielding structure
    factor, added = METHODS[method](ductility, hardening)
    total = OWN_DAMPING.get(method, damping) + added
    if not 0.0 <= total < 1.0:
        raise ValueError(
            f"ductility {ductility:g} gives {method} a damping of {total:.3g}, outside [0, 1)"
        )
    return result(period * factor, total)
