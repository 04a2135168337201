"""Motion to the north and east from two horizontal sensors of any azimuths."""

import numpy as np

from per_obspy.checks import FloatArray

#: Sensors closer than this to the same line do not resolve the plane; degrees. A choice: the error
#: of the resolved motion grows like 1/sin of the angle between them, here by a factor of 3.
SMALLEST_RESOLVED_ANGLE = 20.0


def north_and_east(
    first: FloatArray, second: FloatArray, azimuth_1: float, azimuth_2: float
) -> tuple[FloatArray, FloatArray]:
    """
    Resolve the motion of two horizontal sensors into north and east components.

    A sensor at azimuth θ records a_N cos θ + a_E sin θ; two of them are solved for a_N and a_E. The
    sensors need not be orthogonal.

    Parameters
    ----------
    first, second : (n_samples,) ndarray
        Motion along each sensor, any unit.
    azimuth_1, azimuth_2 : float
        Sensor azimuths, degrees clockwise from north.

    Returns
    -------
    north, east : (n_samples,) ndarray
        In the unit of the input.

    Raises
    ------
    ValueError
        If the sensors are within 20 degrees of the same line.

    Examples
    --------
    >>> north, east = north_and_east(np.array([0.0, 2.0]), np.array([1.0, 0.0]), 90.0, 180.0)
    >>> north.round(12).tolist(), east.round(12).tolist()
    ([-1.0, 0.0], [0.0, 2.0])
    """
    cosine_1, sine_1 = _direction(azimuth_1)
    cosine_2, sine_2 = _direction(azimuth_2)
    # Two equations for a_N and a_E; the determinant is the sine of the angle between the sensors
    determinant = cosine_1 * sine_2 - cosine_2 * sine_1
    if abs(determinant) < np.sin(np.radians(SMALLEST_RESOLVED_ANGLE)):
        raise ValueError(
            f"sensor azimuths {azimuth_1:g} and {azimuth_2:g} degrees "
            "are too close to the same line"
        )
    north = (sine_2 * first - sine_1 * second) / determinant
    east = (cosine_1 * second - cosine_2 * first) / determinant
    return north, east


def _direction(azimuth: float) -> tuple[float, float]:
    """Return cosine and sine of an azimuth in degrees."""
    # Exact at multiples of 90 degrees, so that north and east sensors pass unchanged
    quarter, rest = divmod(azimuth % 360.0, 90.0)
    if rest == 0.0:
        return ((1.0, 0.0), (0.0, 1.0), (-1.0, 0.0), (0.0, -1.0))[int(quarter)]
    return float(np.cos(np.radians(azimuth))), float(np.sin(np.radians(azimuth)))
