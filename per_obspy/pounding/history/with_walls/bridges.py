"""Bridge decks in series: pounding at the joints, and unseating where a joint opens too far."""

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from per_obspy import checks
from per_obspy.checks import ArrayLike, FloatArray
from per_obspy.pounding.history.row_history import PoundingHistory, pounding_history
from per_obspy.pounding.structure import Structure
from per_obspy.spectra.trace_arguments import takes_trace


class BridgeHistory(NamedTuple):
    """
    Pounding and opening of the joints of a bridge.

    Attributes
    ----------
    history : PoundingHistory
        Of the decks, from left to right.
    opening : (n_decks - 1,) ndarray
        Largest opening of each joint beyond its gap, m.
    unseated : (n_decks - 1,) ndarray of bool
        Whether a joint opened further than its seat is long.
    """

    history: PoundingHistory
    opening: FloatArray
    unseated: NDArray[np.bool_]


@takes_trace
def bridge_history(
    acceleration: ArrayLike,
    dt: float,
    decks: Sequence[Structure],
    gaps: ArrayLike,
    restitution: ArrayLike,
    seat_lengths: ArrayLike,
    free_vibration: bool = True,
) -> BridgeHistory:
    """
    Compute the exact history of bridge decks in series, with unseating.

    Parameters
    ----------
    acceleration : (n_samples,) array_like or obspy Trace
        Ground acceleration along the bridge, m/s².
    dt : float
        Sampling interval, s; not given with a Trace.
    decks : sequence of Structure
        From left to right; abutments are walls (infinite mass, participation 0).
    gaps : float or (n_decks - 1,) array_like
        Clear distances of the joints at rest, m.
    restitution : float or (n_decks - 1,) array_like
        Coefficient of each joint, between 0 and 1, dimensionless.
    seat_lengths : float or (n_decks - 1,) array_like
        Largest opening beyond the gap that a joint bears, m.
    free_vibration : bool, optional
        Go on after the record, as in `pounding_history`.

    Returns
    -------
    BridgeHistory
        Motion, impacts, joint openings (m) and unseating; the history goes on as if an unseated
        deck stayed in place.

    Raises
    ------
    ValueError
        If an argument is out of range, a seat length is not positive, or the gaps, restitutions or
        seat lengths do not fit the number of joints.

    See Also
    --------
    per_obspy.pounding_history : Rows of any structures.

    References
    ----------
    Valles-Mattox & Reinhorn (1996), An energy approach to pounding of structures, 11WCEE, eq. (7),
    (8), for the impacts at the joints.

    Examples
    --------
    Two decks between abutments that move with the ground:

    >>> pulse = np.sin(np.linspace(0.0, 6.0 * np.pi, 301))
    >>> abutment = Structure(1.0, 0.0, np.inf, participation=0.0)
    >>> decks = [abutment, Structure(0.8, 0.05, 1e6), Structure(1.6, 0.05, 8e5), abutment]
    >>> bridge = bridge_history(pulse, 0.01, decks, 0.05, 0.6, seat_lengths=0.08)
    >>> print(bridge.opening.round(3), bridge.unseated)
    [0.06  0.069 0.095] [False False  True]
    """
    seats = checks.positive("seat_lengths", seat_lengths)
    history = pounding_history(acceleration, dt, decks, gaps, restitution, free_vibration)
    if seats.shape not in {(), (1,), history.opening_maxima.shape}:
        raise ValueError(
            f"seat_lengths must be one number or one a joint, got the shape {seats.shape}"
        )
    return BridgeHistory(history, history.opening_maxima, history.opening_maxima > seats)
