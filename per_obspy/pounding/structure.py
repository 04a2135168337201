"""Buildings as single-degree-of-freedom structures at their contact level, one or many pairs."""

from collections.abc import Callable, Iterable
from dataclasses import dataclass
from math import inf, pi

import numpy as np
from numpy.typing import NDArray

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
    """Raise ``ValueError`` if a structure yields, in a function for linear ones."""
    for structure in structures:
        if structure.yield_displacement < inf:
            raise ValueError(
                f"yield_displacement must be infinite here, got {structure.yield_displacement}"
            )


@dataclass(frozen=True)
class Pairs:
    """
    Many pairs of structures at their contact level, each number checked once.

    Fields of structures are (2, n_pairs), in the units of `Structure`; ``gap`` (m), ``restitution``
    and ``azimuth`` (of the axis from 1 to 2, degrees clockwise from north) are (n_pairs,).
    ``shape`` is that to which the arguments broadcast, of as many pairs.
    """

    shape: tuple[int, ...]
    period: FloatArray
    damping: FloatArray
    mass: FloatArray
    yield_displacement: FloatArray
    hardening: FloatArray
    participation: FloatArray
    gap: FloatArray
    restitution: FloatArray
    azimuth: FloatArray

    @classmethod
    def of(cls, **arguments: ArrayLike) -> "Pairs":
        """
        Check arguments, named ``period_1``, ``gap`` and the like, and broadcast them.

        Fields without an argument are those of plain linear structures of unit mass.
        """
        # In the order in which they are given
        checked = {}
        for name, values in arguments.items():
            checked[name] = PAIR_CHECKS[name.rstrip("_12")](name, values)
        shape = np.broadcast_shapes(*(values.shape for values in checked.values()))

        # One row per structure, or one number per pair
        fields = {}
        for name in PAIR_CHECKS:
            names = [f"{name}_1", f"{name}_2"] if name in _CHECKS else [name]
            lines = np.empty((len(names), *shape))
            # broadcast by the assignment, which is faster; an absent argument has its default
            for line, one in enumerate(names):
                lines[line, ...] = checked.get(one, _DEFAULTS.get(name, 0.0))
            lines = lines.reshape(len(names), -1)
            fields[name] = lines if name in _CHECKS else lines[0]
        return cls(shape, **fields)

    def chosen(self, numbers: NDArray[np.intp]) -> "Pairs":
        """Return some of the pairs by their numbers."""
        fields = {name: getattr(self, name)[..., numbers] for name in PAIR_CHECKS}
        return Pairs(numbers.shape, **fields)

    @property
    def are_twins(self) -> NDArray[np.bool_]:
        """Mask of the pairs of structures that move as one while they do not touch."""
        motion = "period", "damping", "participation", "yield_displacement", "hardening"
        same = [np.equal(*getattr(self, name)) for name in motion]
        return np.asarray(np.all(same, axis=0))

    @property
    def frequency(self) -> FloatArray:
        """Undamped circular frequencies of the elastic branches, (2, n_pairs), rad/s."""
        return 2.0 * pi / self.period

    @property
    def oscillators(self) -> FloatArray:
        """Circular frequency, damping and participation of 1, then of 2, (6, n_pairs)."""
        rows = np.stack([self.frequency, self.damping, self.participation], axis=1)
        return rows.reshape(6, -1)


_DEFAULTS = {"mass": 1.0, "yield_displacement": inf, "participation": 1.0}

#: Check of each argument of pairs; those of one structure end with its number
PAIR_CHECKS: dict[str, Callable[[str, ArrayLike], FloatArray]] = {
    **_CHECKS,
    "gap": checks.not_negative,
    "restitution": lambda name, values: checks.between(name, values, 0.0, 1.0),
    "azimuth": checks.finite,
}
