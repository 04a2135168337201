"""Bridge decks in series: pounding at the joints, and unseating where a joint opens further than its seat is long."""

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike, NDArray

from per_obspy import checks
from per_obspy.checks import FloatArray
from per_obspy.pounding.history.row_history import PoundingHistory, pounding_history
from per_obspy.pounding.structure import Structure


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
    Exact history of bridge decks in series, with unseating.

    Parameters
    ----------
    acceleration : (n_samples,) array_like
        Ground acceleration along the bridge, m/s².
    dt : float
        Sampling interval, s.
    decks : sequence of Structure
        From left to right; abutments are walls (infinite mass, participation 0).
    gaps, restitution : float or (n_decks - 1,) array_like
        Of the joints, m and dimensionless.
    seat_lengths : float or (n_decks - 1,) array_like
        Opening that a joint bears, m.
    free_vibration : bool
        As in `pounding_history`.

    Returns
    -------
    BridgeHistory
        The history goes on as if an unseated deck stayed in place.

    Raises
    ------
    ValueError
        As `pounding_history`, or if a seat length is not positive.
    """
    seats = checks.positive("seat_lengths", seat_lengths)
    history = pounding_history(acceleration, dt, decks, gaps, restitution, free_vibration)
    if seats.shape not in {(), (1,), history.opening_maxima.shape}:
        raise ValueError(
            f"seat_lengths must be one number or one a joint, got the shape {seats.shape}"
        )
    return BridgeHistory(history, history.opening_maxima, history.opening_maxima > seats)
