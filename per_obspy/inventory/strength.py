"""
Yield capacity of buildings by structural system, storeys and code level, from HAZUS.

HAZUS gives each class of building a capacity curve: spectral acceleration over spectral
displacement of its equivalent oscillator, linear up to yield and rising from there to an ultimate
point. The values are those of the moderate code level; low and high code have a half and twice of
them. They are medians of a stock designed for the western United States; buildings of other codes
are weaker or stronger, without a sign of it in a pair table.
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

#: System -> yield acceleration, g, of low-, mid- and high-rise buildings; ratio of ultimate to
#: yield capacity: HAZUS-MH classes S1, C1, C2 (also for frames with walls, reasoned) and S2
#: (braced steel, reasoned for ebf_brbf), moderate code (table 5.7 of the technical manual), as in
#: the stored text ``RHazusBuildingModel.cpp`` of github.com/steva44/Rts. The manual itself was not
#: at hand. Masonry and unknown systems have no capacity.
_CAPACITIES = {
    "steel_mrf": ((0.125, 0.078, 0.049), 3.0),
    "concrete_mrf": ((0.125, 0.104, 0.049), 3.0),
    "concrete_frame_wall": ((0.200, 0.167, 0.127), 2.5),
    "concrete_wall": ((0.200, 0.167, 0.127), 2.5),
    "ebf_brbf": ((0.200, 0.167, 0.127), 2.0),
}


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
    names, count = np.broadcast_arrays(np.asarray(system, dtype=str), storeys)
    rise = np.searchsorted([MID_RISE, HIGH_RISE], count, side="right")
    acceleration = np.full(names.shape, np.nan)
    for name, (capacities, _) in _CAPACITIES.items():
        is_system = (names == name) & np.isfinite(count)
        acceleration[is_system] = np.take(capacities, rise[is_system])
    acceleration *= CODE_LEVELS[code_level] * STANDARD_GRAVITY
    displacement: FloatArray = acceleration * (np.asarray(period) / (2.0 * np.pi)) ** 2
    return displacement
