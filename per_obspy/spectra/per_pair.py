"""Largest radius and displacement of many oscillators of different periods and dampings."""

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from per_obspy import checks
from per_obspy.checks import ArrayLike, FloatArray
from per_obspy.kernels.maxima.oscillator_maxima import largest_responses
from per_obspy.spectra.elastic import (
    Oscillators,
    in_threads,
    prepare_oscillators,
    row_of,
    tiled_record,
    two_components,
)

#: Longest phase of a stride, rad, for an undamped oscillator, and by how much damping shortens it,
#: which bends the radius. Results depend on it by rounding alone; fastest in trials.
STRIDE_PHASE, SHORTER_BY_DAMPING = 1.1, 8.0
#: Steps in a stride: only the samples at its ends are evaluated at first.
STRIDES = (1, 2, 4)
#: Groups of tiles, at most, in which the window of an oscillator is searched for.
GROUPS = 128
#: Oscillators that a thread takes at a time.
PART = 1024


class OscillatorMaxima(NamedTuple):
    """Largest radius and largest displacement of each oscillator, (n,), m."""

    per: FloatArray
    sd: FloatArray


def azimuth_maxima(
    north: ArrayLike,
    east: ArrayLike,
    dt: float,
    periods: ArrayLike,
    dampings: ArrayLike,
    azimuths: ArrayLike,
) -> OscillatorMaxima:
    """
    Compute largest radius and displacement of oscillators, each along a separate azimuth.

    Parameters
    ----------
    north, east : (n_samples,) array_like
        Components of the ground acceleration, m/s², as for `per_spectrum`.
    dt : float
        Time between samples, s.
    periods, dampings, azimuths : array_like
        Undamped periods, s, fractions of critical, and degrees clockwise from north, broadcast to
        the shape (n,).

    Returns
    -------
    OscillatorMaxima
        Two arrays (n,), m, exact between samples, with the free vibration after the record.

    Raises
    ------
    ValueError
        If an argument is not finite, out of range or of the wrong shape.

    Notes
    -----
    Bounds of the energy limit the part of the record that can hold the largest response of an
    oscillator: the motion before is left out where less than 1e-12 of it remains by then, the
    motion after it altogether.
    """
    record = tiled_record(*two_components(north, east))
    oscillators = _paired(dt, periods, dampings, azimuths)
    # Peak acceleration of groups of tiles, for the search of an oscillator's window
    width = -(-record.peaks.shape[1] // GROUPS)
    firsts = np.arange(0, record.peaks.shape[1], width)
    groups = np.maximum.reduceat(record.peaks, firsts, axis=1)
    limits = np.concatenate([record.peaks, record.jumps])

    rows = np.stack([oscillators.phases, oscillators.dampings, *oscillators.weights])
    largest = np.empty((2, oscillators.size))

    def work(part: tuple[int, NDArray[np.int64]]) -> None:
        stride, members = part
        largest_responses(
            stride, record.north, record.east, limits, groups, width, rows, members, largest
        )

    # The kernel gives the squared radius and the displacement, scaled acceleration / omega²
    in_threads(work, _parts(oscillators), oscillators.size * record.north.size)
    largest[0] = np.sqrt(largest[0])
    return OscillatorMaxima(*(largest / oscillators.omegas**2 * record.scale))


def _paired(dt: float, periods: ArrayLike, dampings: ArrayLike, azimuths: ArrayLike) -> Oscillators:
    """Return checked oscillators, (n,)."""
    dt = checks.number("dt", dt, checks.positive)
    period, damping, azimuth = np.broadcast_arrays(
        np.atleast_1d(checks.positive("periods", periods)),
        checks.fraction_of_critical("dampings", dampings),
        checks.finite("azimuths", azimuths),
    )
    return prepare_oscillators(dt, row_of("periods", period), damping, azimuth)


def _parts(oscillators: Oscillators) -> list[tuple[int, NDArray[np.int64]]]:
    """Return parts of oscillators with their stride; those of equal decay are together."""
    phase = STRIDE_PHASE / (1.0 + SHORTER_BY_DAMPING * oscillators.dampings)
    longest = np.floor(phase / oscillators.phases)
    index = np.clip(np.searchsorted(STRIDES, longest, side="right") - 1, 0, None)
    strides = np.array(STRIDES)[index]

    # Sorted by decay per step, so that the windows of a part are about equally long
    order = np.argsort(oscillators.phases * oscillators.dampings, kind="stable")
    parts = []
    for stride in STRIDES:
        members = order[strides[order] == stride]
        firsts = range(0, members.size, PART)
        parts += [(stride, members[first : first + PART]) for first in firsts]
    return parts
