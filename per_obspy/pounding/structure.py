"""A structure as a single-degree-of-freedom oscillator, linear or bilinear."""

import math
from dataclasses import dataclass

from per_obspy import checks


@dataclass(frozen=True)
class Structure:
    """
    Oscillator that stands for a building, a bridge deck or an isolated superstructure.

    Parameters
    ----------
    period : float
        Undamped elastic period, s.
    damping : float
        Fraction of critical, at least 0 and below 1, dimensionless.
    mass : float
        Impact mass (generalised mass normalised at the contact level), kg; infinity is a wall.
    yield_displacement : float, optional
        Displacement at first yield, m; infinity is a linear structure.
    hardening : float, optional
        Stiffness after yielding over elastic stiffness, at least 0 and below 1, dimensionless.
    participation : float, optional
        Contact displacement over oscillator displacement, dimensionless.

    Raises
    ------
    ValueError
        If a field is out of range; the message names it.
    """

    period: float
    damping: float
    mass: float
    yield_displacement: float = math.inf
    hardening: float = 0.0
    participation: float = 1.0

    def __post_init__(self) -> None:
        checks.number("period", self.period, checks.positive)
        checks.number("damping", self.damping, checks.fraction_of_critical)
        checks.number("mass", self.mass, checks.positive_or_infinite)
        checks.number("yield_displacement", self.yield_displacement, checks.positive_or_infinite)
        checks.number("hardening", self.hardening, checks.fraction_of_critical)
        checks.number("participation", self.participation, checks.positive)

    @property
    def frequency(self) -> float:
        """Undamped circular frequency, rad/s."""
        return 2.0 * math.pi / self.period
