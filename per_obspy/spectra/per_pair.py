"""Largest radius and displacement of many oscillators under one record, each with its own period and damping."""

from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike, NDArray

from per_obspy import checks
from per_obspy.checks import FloatArray
from per_obspy.kernels.maxima.oscillator_maxima import largest_responses
from per_obspy.spectra.elastic import row_of, two_components
from per_obspy.spectra.oscillator_blocks import (
    Ground,
    Oscillators,
    in_threads,
    prepare_ground,
    prepare_oscillators,
)

#: Longest phase, in radians, after which an undamped oscillator is looked at again, and how damping
#: shortens it: the radius bends the more. Results do not depend on it but by rounding; fastest in
#: trials.
STRIDE_PHASE, SHORTER_BY_DAMPING = 1.1, 8.0
#: Steps from one look to the next.
STRIDES = (1, 2, 4)
#: Groups of tiles that the window of an oscillator is told in, at most.
GROUPS = 128
#: Oscillators that a thread takes at a time.
PART = 1024


class OscillatorMaxima(NamedTuple):
    """Largest radius and largest displacement of each oscillator, (n,), m."""

    per: FloatArray
    sd: FloatArray


def oscillator_maxima(
    acceleration: ArrayLike, dt: float, periods: ArrayLike, dampings: ArrayLike
) -> OscillatorMaxima:
    """
    Largest radius and displacement of many oscillators, each with its own period and damping.

    Parameters
    ----------
    acceleration : (n_samples,) array_like
        Ground acceleration, m/s², as for `per_spectrum`.
    dt : float
        Time between samples, s.
    periods, dampings : array_like
        Undamped periods, s, and fractions of critical, broadcast to the shape (n,).

    Returns
    -------
    OscillatorMaxima
        Two arrays (n,), m, exact between samples, with the free vibration after the record.

    Raises
    ------
    ValueError
        If an argument is not finite, out of range or of the wrong shape.
    """
    record = checks.record("acceleration", acceleration)
    return _maxima(prepare_ground(record), _paired(dt, periods, dampings, 0.0))


def azimuth_maxima(
    north: ArrayLike,
    east: ArrayLike,
    dt: float,
    periods: ArrayLike,
    dampings: ArrayLike,
    azimuths: ArrayLike,
) -> OscillatorMaxima:
    """
    Largest radius and displacement of many oscillators, each with its own period, damping and azimuth.

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
    Bounds of the energy tell which part of the record can hold the largest response of an
    oscillator: what comes before is left out where less than 1e-12 of it remains by then, what
    comes after altogether.
    """
    return _maxima(
        prepare_ground(*two_components(north, east)), _paired(dt, periods, dampings, azimuths)
    )


def _paired(dt: float, periods: ArrayLike, dampings: ArrayLike, azimuths: ArrayLike) -> Oscillators:
    dt = checks.number("dt", dt, checks.positive)
    period, damping, azimuth = np.broadcast_arrays(
        checks.positive("periods", np.atleast_1d(checks.numbers("periods", periods))),
        checks.fraction_of_critical("dampings", dampings),
        checks.finite("azimuths", azimuths),
    )
    return prepare_oscillators(dt, row_of("periods", period), damping, azimuth)


def _maxima(ground: Ground, oscillators: Oscillators) -> OscillatorMaxima:
    """Return both lengths of each oscillator; those of a part are looked at equally often."""
    width = -(-ground.peaks.shape[1] // GROUPS)
    groups = np.maximum.reduceat(ground.peaks, np.arange(0, ground.peaks.shape[1], width), axis=1)
    limits = np.concatenate([ground.peaks, ground.jumps])
    rows = np.stack([oscillators.phases, oscillators.dampings, *oscillators.weights])
    largest = np.empty((2, oscillators.wanted))

    def work(part: tuple[int, NDArray[np.int64]]) -> None:
        largest_responses(
            part[0], ground.north, ground.east, limits, groups, width, rows, part[1], largest
        )

    in_threads(work, _parts(oscillators), oscillators.wanted * ground.north.size)
    largest[0] = np.sqrt(largest[0])
    return OscillatorMaxima(*(largest / oscillators.omegas**2 * ground.scale))


def _parts(oscillators: Oscillators) -> list[tuple[int, NDArray[np.int64]]]:
    """Return strides and the oscillators that take them, those together that forget equally fast."""
    longest = np.floor(
        STRIDE_PHASE / (1.0 + SHORTER_BY_DAMPING * oscillators.dampings) / oscillators.phases
    )
    strides = np.array(STRIDES)[
        np.clip(np.searchsorted(STRIDES, longest, side="right") - 1, 0, None)
    ]
    order = np.argsort(oscillators.phases * oscillators.dampings, kind="stable")
    taking = [(stride, order[strides[order] == stride]) for stride in STRIDES]
    return [
        (stride, some[first : first + PART])
        for stride, some in taking
        for first in range(0, some.size, PART)
    ]
