"""
Spread of PER over the baselines that fit the velocity after the shaking.

A baseline that shifts during the shaking leaves a straight line in the final velocity. The line
does not show when the baseline shifted, and PER at long periods depends on that.
"""

from collections.abc import Iterable
from itertools import combinations
from typing import NamedTuple

import numpy as np
from scipy.fft import irfft
from scipy.ndimage import uniform_filter1d

from per_obspy.checks import FloatArray
from per_obspy.config import Processing
from per_obspy.processing.filter.baseline import final_line, residual_velocity, sample_times
from per_obspy.processing.filter.butterworth import butterworth_amplitude, thin_spectrum
from per_obspy.processing.series import integral, without_line
from per_obspy.spectra.elastic import per_spectrum

#: Periods at which PER is compared, s.
PERIODS: FloatArray = np.geomspace(0.2, 20.0, 13)

#: Longest sampling interval at which that is done, s.
INTERVAL = 0.04

#: Times at which a baseline may shift: they cut the energy of the shaking into equal parts.
TIMES = 11

#: Longest pad over which it is computed, s: two of the longest periods.
LONGEST_PAD = 40.0

#: Largest shift during the shaking, over the peak acceleration: a larger one is no baseline.
LARGEST = 0.5

#: Longest period of the motion whose energy decides when the shaking ends, s.
SLOWEST = 10.0

#: Velocity that stays, over the peak velocity, from which on a shift is suspected: below, known
#: shifts changed PER by less than 5 % (docs/processing.md).
SUSPECTED = 0.1

#: Share of the largest misfit that is added to each, so that every weight is finite.
FLOOR = 1e-12


class Shaking(NamedTuple):
    """Onset and end of the shaking, s from the first sample."""

    onset: float
    end: float


def without_drift(samples: FloatArray, dt: float) -> FloatArray:
    """Return the samples without their running mean over 10 s, which holds a shifted baseline."""
    return samples - uniform_filter1d(samples, max(round(SLOWEST / dt), 1))


def longest_certain_period(
    plain: FloatArray,
    corrected: FloatArray,
    dt: float,
    shaking: Shaking,
    highpass: float,
    settings: Processing,
) -> float:
    r"""
    Return the period up to which PER hardly depends on when the baseline shifted, s.

    It is infinite if no shift is suspected, or if the spread is small at all `PERIODS`. A baseline
    shifts at t1 and t2, which are all pairs out of 11 times that cut the energy of the shaking into
    equal parts. The line through the final velocity gives both shifts, so that every corrected
    velocity ends at zero; those above half the peak acceleration are left out:

    .. math:: v_f(t) = v_0 + a_f t, \quad t \ge t_2, \qquad a_m = (v_0 + a_f t_2) / (t_2 - t_1)

    The spread at a period is the root mean square of ln(PER / PER of the record as it is used),
    with weights 1 / misfit; the misfit is the root mean square displacement during the shaking.

    Parameters
    ----------
    plain, corrected : (n_samples,) ndarray
        Acceleration without the mean of its quiet beginning, and without its baseline as it is
        used, tapered; m/s2.
    dt : float
        Sampling interval, s.
    shaking : Shaking
        The record is quiet before and after it.
    highpass : float
        Corner of the filter, Hz; 0: none.
    settings : Processing
        Order of the filter, taper, and the spread that is allowed (``baseline_spread``).

    References
    ----------
    Boore 2001, Bull. Seism. Soc. Am. 91, 1199-1211: the two shifts, and how strongly displacement
    depends on their times.
    """
    time, interval = sample_times(plain, dt), dt * _thinning(dt)
    # Is the velocity that stays large for the record as it is used?
    (used,) = _filtered(corrected[np.newaxis], dt, highpass, settings.order)
    peak = np.abs(integral(used, interval)).max()
    if _velocity_left(plain, time, shaking) <= SUSPECTED * peak:
        return np.inf
    # Shifts that fit the final velocity
    times, line = _times_of_shifts(plain, time, shaking), final_line(plain, time, shaking.end)
    shifts = _possible_shifts(times, line, LARGEST * float(np.abs(used).max()))
    if not shifts.size:
        return float(PERIODS[0])
    motions = _corrected(plain, time, times, shifts, highpass, settings)
    # Spread of the logarithm of PER about that of the record as it is used
    ratios = _log_per(motions, interval) - _log_per([used], interval)
    spread = np.sqrt(_weights(plain, time, times, shifts) @ np.square(ratios))
    return _last_within(spread, settings.baseline_spread)


def _corrected(
    plain: FloatArray,
    time: FloatArray,
    times: FloatArray,
    shifts: FloatArray,
    highpass: float,
    settings: Processing,
) -> FloatArray:
    """Return the filtered record after each correction: sums of it and of steps at the times."""
    from scipy.signal.windows import tukey  # in workers only, see instrument_response

    parts = np.vstack([plain, time >= times[:, np.newaxis]])
    parts *= tukey(plain.size, 2 * settings.taper)
    filtered = _filtered(parts, float(time[1]), highpass, settings.order)
    return np.asarray(filtered[0] - shifts @ filtered[1:])


def _log_per(motions: Iterable[FloatArray], interval: float) -> FloatArray:
    """Return the logarithms of PER of motions at all periods, (n_motions, n_periods)."""
    return np.log([per_spectrum(motion, interval, PERIODS) for motion in motions])


def _velocity_left(samples: FloatArray, time: FloatArray, shaking: Shaking) -> float:
    """Return the velocity that a shift leaves before and after the shaking, without a line, m/s."""
    left, before = [], time <= shaking.onset
    # The record as it is, or without its straight line: the smaller one
    for straight in (samples, without_line(samples)):
        early = abs(np.trapezoid(straight[before], dx=time[1]))
        left.append(early + residual_velocity(straight, time, shaking.end))
    return float(min(left))


def _thinning(dt: float) -> int:
    """Return how many samples of a record make one of its thinned series."""
    return max(int(INTERVAL / dt), 1)


def _filtered(signals: FloatArray, dt: float, highpass: float, order: int) -> FloatArray:
    """Return signals (n_signals, n_samples) with zero pads, filtered, at a longer interval."""
    thin = _thinning(dt)
    frequencies, spectrum, points, pad = thin_spectrum(signals, dt, highpass, order, thin)
    spectrum *= butterworth_amplitude(frequencies, highpass, np.inf, order)
    # The ends of long pads move none of the oscillators
    unused = max(pad - round(LONGEST_PAD / (thin * dt)), 0)
    return np.asarray(irfft(spectrum, points)[:, unused : points - unused] / thin)


def _times_of_shifts(plain: FloatArray, time: FloatArray, shaking: Shaking) -> FloatArray:
    """Return times that cut the energy of the shaking into equal parts, s."""
    # Slow motion holds the shift itself
    during = (time >= shaking.onset) & (time <= shaking.end)
    energy = np.cumsum(np.where(during, without_drift(plain, time[1]), 0.0) ** 2)
    inner = np.interp(np.linspace(0, energy[-1], TIMES)[1:-1], energy, time)
    return np.array([shaking.onset, *inner, shaking.end])


def _possible_shifts(times: FloatArray, line: tuple[float, float], largest: float) -> FloatArray:
    """
    Return the shifts at each pair of times that turn the final line of the velocity to zero.

    Each row has the steps of the baseline at all times, m/s2: its shift between the two at the
    first, and the difference to that from then on at the second.
    """
    constant, slope = line
    rows = []
    for first, second in combinations(range(times.size), 2):
        # The velocity that stays, over the time of the first shift
        between = (constant + slope * times[second]) / (times[second] - times[first])
        if abs(between) < largest:
            rows.append(np.zeros(times.size))
            rows[-1][[first, second]] = between, slope - between
    return np.array(rows)


def _weights(
    plain: FloatArray, time: FloatArray, times: FloatArray, shifts: FloatArray
) -> FloatArray:
    """Return the weight of each correction, from the displacement that it leaves in the shaking."""
    displacement = integral(integral(plain, time[1]), time[1])
    # Displacement of a step of 1 m/s2 at each time
    during = (time >= times[0]) & (time <= times[-1])
    parabolas = np.maximum(time[during] - times[:, np.newaxis], 0.0) ** 2 / 2
    left = displacement[during] - shifts @ parabolas
    misfits = np.sqrt(np.mean(np.square(left), axis=1))
    weights = 1 / (misfits + FLOOR * misfits.max())
    return np.asarray(weights / weights.sum())


def _last_within(spread: FloatArray, largest: float) -> float:
    """Return the period from which on the spread exceeds its largest value, s."""
    beyond = np.flatnonzero(spread > largest)
    if not beyond.size:
        return np.inf
    last = beyond[0]
    if last == 0:
        return float(PERIODS[0])
    # Between two periods: linear in the logarithm of the period
    pair = slice(last - 1, last + 1)
    return float(np.exp(np.interp(largest, spread[pair], np.log(PERIODS[pair]))))
