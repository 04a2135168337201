"""A building as the single-degree-of-freedom structure that pounding sees: at its contact level."""

from collections.abc import Iterable
from dataclasses import dataclass
from math import inf, pi

from per_obspy import checks
from per_obspy.checks import ArrayLike, FloatArray


@dataclass(frozen=True)
class Structure:
    """
    Single-degree-of-freedom structure at its contact level, linear or bilinear.

    Parameters
    ----------
    period : float
        Undamped natural period (of the elastic branch), s.
    damping : float
        Viscous damping as a fraction of critical of the elastic branch, at least 0 and below 1.
    mass : float
        Generalised mass at the contact level, kg; infinite for a wall.
    yield_displacement : float
        Displacement at first yield, m; infinite for a linear structure.
    hardening : float
        Stiffness after yielding over elastic stiffness, at least 0 and below 1.
    participation : float
        The contact level is driven by ``participation`` times the ground acceleration,
        dimensionless; 0 for a wall that moves with the ground.

    Raises
    ------
    ValueError
        If a number is outside its range.

    Examples
    --------
    >>> tower = Structure(period=2.0, damping=0.05, mass=4e5)
    >>> round(tower.frequency, 6)
    3.141593
    """

    period: float
    damping: float
    mass: float
    yield_displacement: float = inf
    hardening: float = 0.0
    participation: float = 1.0

    def __post_init__(self) -> None:
        """Replace each argument by the checked float."""
        for name, check in _CHECKS.items():
            object.__setattr__(self, name, checks.number(name, getattr(self, name), check))

    @property
    def frequency(self) -> float:
        """Undamped circular frequency of the elastic branch, rad/s."""
        return 2.0 * pi / self.period


_CHECKS = {
    "period": checks.positive,
    "damping": checks.fraction_of_critical,
    "mass": checks.positive_or_infinite,
    "yield_displacement": checks.positive_or_infinite,
    "hardening": checks.fraction_of_critical,
    "participation": checks.not_negative,
}


def refuse_bilinear(structures: Iterable[Structure]) -> None:
    """
    Refuse structures that yield.

    Parameters
    ----------
    structures : iterable of Structure
        Arguments of a function for linear structures.

    Raises
    ------
    ValueError
        If a yield displacement is finite.
    """
    for structure in structures:
        if structure.yield_displacement < inf:
            raise ValueError(
                f"yield_displacement must be infinite here, got {structure.yield_displacement}"
            )


def checked_oscillators(
    number: int, period: ArrayLike, damping: ArrayLike, participation: ArrayLike
) -> tuple[FloatArray, FloatArray, FloatArray]:
    """
    Return circular frequency, damping and participation of many structures 1 or 2, checked.

    Parameters
    ----------
    number : int
        1 or 2, by which messages name the arguments.
    period : array_like
        Undamped periods, s.
    damping : array_like
        Fractions of critical, dimensionless.
    participation : array_like
        Contact displacement over oscillator displacement, dimensionless.

    Returns
    -------
    frequency, damping, participation : ndarray
        In rad/s and dimensionless, each in the shape of its argument.

    Raises
    ------
    ValueError
        If an argument is out of range.
    """
    return (
        2.0 * pi / checks.positive(f"period_{number}", period),
        checks.fraction_of_critical(f"damping_{number}", damping),
        checks.not_negative(f"participation_{number}", participation),
    )
