"""
Yield capacity of buildings by structural system, storeys and code level, from HAZUS.

HAZUS gives each class of building a capacity curve: spectral acceleration over spectral
displacement of its equivalent oscillator, linear up to yield and rising from there to an ultimate
point. The values are those of the moderate code level; low and high code have a half and twice of
them, but for unreinforced masonry. They are medians of a stock designed for the western United
States; buildings of other codes are weaker or stronger, without a sign of it in a pair table.
"""

from typing import Literal

import numpy as np

from per_obspy.checks import ArrayLike, FloatArray
from per_obspy.constants import STANDARD_GRAVITY

#: Code level -> capacity over that of moderate code.
CODE_LEVELS: dict[str, float] = {"low": 0.5, "moderate": 1.0, "high": 2.0}
CodeLevel = Literal["low", "moderate", "high"]

#: First storeys of mid-rise and of high-rise buildings.
MID_RISE, HIGH_RISE = 4.0, 8.0

#: System -> yield acceleration, g, of low-, mid- and high-rise buildings; stiffness from yield to
#: the ultimate point over that before, ``(A_u / A_y - 1) / (D_u / D_y - 1)``: HAZUS-MH classes S1,
#: C1, C2 (reasoned for frames with walls), S2 (braced steel, reasoned for ebf_brbf) and RM1, RM2
#: (reinforced masonry, reasoned for confined one), moderate code, and URM, which has the same
#: values without and with the low code and none above (also for high-rise and for adobe and earth,
#: of which HAZUS has no class). Table 5.7 of the technical manual, as in
#: ``RHazusBuildingModel.cpp`` of github.com/steva44/Rts; the manual itself was not at hand. Other
#: systems have none.
_CAPACITIES = {
    "steel_mrf": ((0.125, 0.078, 0.049), (0.12, 0.18, 0.25)),
    "concrete_mrf": ((0.125, 0.104, 0.049), (0.12, 0.18, 0.25)),
    "concrete_frame_wall": ((0.200, 0.167, 0.127), (0.11, 0.17, 0.23)),
    "concrete_wall": ((0.200, 0.167, 0.127), (0.11, 0.17, 0.23)),
    "ebf_brbf": ((0.200, 0.167, 0.127), (0.09, 0.14, 0.20)),
    "reinforced_masonry": ((0.267, 0.222, 0.169), (0.09, 0.14, 0.20)),
    "masonry": ((0.200, 0.111, 0.111), (0.11, 0.18, 0.18)),
}

#: Systems whose capacity is that of every code level.
_WITHOUT_CODE = ("masonry",)

#: Log-standard deviation of an assumed yield capacity: reasoned, one code level on either side
#: being a factor of two.
CAPACITY_LOG_STD = 0.4


def hazus_yield_displacement(
    period: ArrayLike, system: ArrayLike, storeys: ArrayLike, code_level: CodeLevel
) -> FloatArray:
    """
    Compute the yield displacement of an equivalent oscillator by HAZUS: ``A_y (T / 2 pi)**2``.

    Parameters
    ----------
    period : array_like
        First natural period, s.
    system : array_like of str
        One of ``SYSTEMS``.
    storeys : array_like
        Number of storeys.
    code_level : str
        ``low``, ``moderate`` or ``high``.

    Returns
    -------
    displacement : ndarray
        Median, m; NaN where system or storeys are unknown.

    References
    ----------
    FEMA, HAZUS-MH technical manual, table 5.7; see the source of the values above.

    Examples
    --------
    >>> hazus_yield_displacement(0.75, ["concrete_mrf", "other"], 5, "moderate").round(4)
    array([0.0145,    nan])
    """
    level = np.where(np.isin(system, _WITHOUT_CODE), 1.0, CODE_LEVELS[code_level])
    acceleration = level * STANDARD_GRAVITY * _of_class(system, storeys, 0)
    return np.asarray(acceleration * (np.asarray(period) / (2.0 * np.pi)) ** 2)


def least_yield_displacement(
    period: ArrayLike, storeys: ArrayLike, code_level: CodeLevel
) -> FloatArray:
    """Return the least yield displacement, m, of any system by HAZUS; of any height if unknown."""
    accelerations = np.array([capacities[0] for capacities in _CAPACITIES.values()])
    # Low-, mid- or high-rise, and any of them for storeys that are NaN
    least = np.append(accelerations.min(axis=0), accelerations.min())
    count = np.asarray(storeys, dtype=np.float64)
    rise = np.searchsorted([MID_RISE, HIGH_RISE], count, side="right")
    lowest = CODE_LEVELS[code_level] * STANDARD_GRAVITY * least[np.where(np.isnan(count), 3, rise)]
    return np.asarray(lowest * (np.asarray(period) / (2.0 * np.pi)) ** 2)


def hazus_hardening(system: ArrayLike, storeys: ArrayLike) -> FloatArray:
    """Return the stiffness after yield over that before by HAZUS; NaN as the displacement."""
    return _of_class(system, storeys, 1)


def _of_class(system: ArrayLike, storeys: ArrayLike, quantity: int) -> FloatArray:
    """Return a quantity of ``_CAPACITIES``; NaN where system or storeys are unknown."""
    names, count = np.broadcast_arrays(np.asarray(system, dtype=str), storeys)
    # Low-, mid- or high-rise
    rise = np.searchsorted([MID_RISE, HIGH_RISE], count, side="right")
    result = np.full(names.shape, np.nan)
    for name, quantities in _CAPACITIES.items():
        is_system = (names == name) & np.isfinite(count)
        result[is_system] = np.take(quantities[quantity], rise[is_system])
    return result
