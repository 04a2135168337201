"""A base-isolated building in its moat: pounding against walls that move with the ground."""

import math

from per_obspy.checks import ArrayLike
from per_obspy.pounding.history.row_history import PoundingHistory, pounding_history
from per_obspy.pounding.structure import Structure
from per_obspy.spectra.trace_arguments import takes_trace


@takes_trace
def moat_history(
    acceleration: ArrayLike,
    dt: float,
    building: Structure,
    gap_left: float,
    gap_right: float,
    restitution: float,
    free_vibration: bool = True,
) -> PoundingHistory:
    """
    Compute the exact history of a building between two moat walls.

    Parameters
    ----------
    acceleration : (n_samples,) array_like or obspy Trace
        Ground acceleration, positive from the left wall to the right one, m/s².
    dt : float
        Sampling interval, s; not given with a Trace.
    building : Structure
        The isolated building; bilinear for lead-rubber or friction isolators.
    gap_left, gap_right : float
        Clear distances to the walls at rest, m; at least one above zero.
    restitution : float
        Coefficient of restitution against the walls, between 0 and 1, dimensionless.
    free_vibration : bool, optional
        Go on after the record, as in `pounding_history`.

    Returns
    -------
    PoundingHistory
        Of left wall, building and right wall, in this order; the walls do not move.

    Raises
    ------
    ValueError
        If an argument is out of range, or there is no room between the walls.

    See Also
    --------
    per_obspy.pounding_history : Rows of any structures.

    Notes
    -----
    With the walls' infinite mass (7) reduces to ``v' = -e v``, so that an impact never lengthens
    the radius of a linear building.

    References
    ----------
    Valles-Mattox & Reinhorn (1996), An energy approach to pounding of structures, 11WCEE, eq. (7).

    Examples
    --------
    >>> import numpy as np
    >>> pulse = 2.0 * np.sin(np.linspace(0.0, 4.0 * np.pi, 301))
    >>> history = moat_history(pulse, 0.01, Structure(3.0, 0.1, 1e6), 0.2, 0.25, 0.5)
    >>> bool(abs(history.displacement[1]).max() <= 0.25)
    True
    """
    wall = Structure(building.period, 0.0, math.inf, participation=0.0)
    row = (wall, building, wall)
    return pounding_history(
        acceleration, dt, row, [gap_left, gap_right], restitution, free_vibration
    )
