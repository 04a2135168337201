"""Units of ground motion as headers, metadata and people write them, and their factors to SI."""

import re
from typing import NamedTuple

from per_obspy.constants import STANDARD_GRAVITY

_LENGTHS = {"nm": 1e-9, "mm": 1e-3, "cm": 1e-2, "m": 1.0}

#: Accelerations with a name of their own, m/s2.
_ACCELERATIONS = {
    "gal": 1e-2,
    "gals": 1e-2,
    "mgal": 1e-5,
    "g": STANDARD_GRAVITY,
    "gn": STANDARD_GRAVITY,
    "mg": 1e-3 * STANDARD_GRAVITY,
    "%g": 1e-2 * STANDARD_GRAVITY,
    "pctg": 1e-2 * STANDARD_GRAVITY,
}

#: A length over a power of seconds: m/s, cm/sec/sec, m/s**2, M/(S**2), m s-2, m·s^-2.
_SECOND = r"\(?s(?:ec)?"
_MOTION = re.compile(
    rf"(nm|mm|cm|m)(?:(/{_SECOND}|[.·*]?s(?:ec)?(?:\^|\*\*)?-1)|"
    rf"(/{_SECOND}(?:\*\*|\^)?2\)?|/s(?:ec)?/s(?:ec)?|[.·*]?s(?:ec)?(?:\^|\*\*)?-2))?"
)


class MotionUnit(NamedTuple):
    """
    Unit of a time series of ground motion.

    Attributes
    ----------
    name : str
        In SI: ``m/s2``, ``m/s`` or ``m``.
    quantity : str
        ``acceleration``, ``velocity`` or ``displacement``.
    factor : float
        From the unit to that of SI.
    """

    name: str
    quantity: str
    factor: float


def unit_of_si(text: object) -> MotionUnit | None:
    """Return the unit of SI that metadata name, as :func:`motion_unit`; None for any other."""
    unit = motion_unit(str(text))
    return unit if unit and unit.factor == 1.0 else None


def motion_unit(text: str) -> MotionUnit | None:
    """
    Return the unit of ground motion that a text names; None for any other text.

    Capitals, blanks and a full stop at the end do not matter.

    Parameters
    ----------
    text : str
        For example ``cm/s^2``, ``M/S**2``, ``gal``, ``g.``.

    Examples
    --------
    >>> motion_unit("cm/sec/sec")
    MotionUnit(name='m/s2', quantity='acceleration', factor=0.01)
    >>> motion_unit("M/S").quantity, motion_unit("counts")
    ('velocity', None)
    """
    word = re.sub(r"\s", "", text).lower().replace("²", "2").replace("−", "-").rstrip(".")
    if word in _ACCELERATIONS:
        return MotionUnit("m/s2", "acceleration", _ACCELERATIONS[word])
    # A length, over one second or two
    match = _MOTION.fullmatch(word)
    if match is None:
        return None
    length, velocity, acceleration = match.groups()
    if acceleration:
        return MotionUnit("m/s2", "acceleration", _LENGTHS[length])
    if velocity:
        return MotionUnit("m/s", "velocity", _LENGTHS[length])
    return MotionUnit("m", "displacement", _LENGTHS[length])
