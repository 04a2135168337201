"""Noise before the first wave: picks of the onset, the noise window, hours of quiet cut away."""

from collections.abc import Iterable
from statistics import median

import numpy as np
from obspy import Stream, Trace, UTCDateTime

from per_obspy.checks import FloatArray
from per_obspy.config import Processing
from per_obspy.processing import components
from per_obspy.processing.account import copy_header, with_note
from per_obspy.processing.earthquake import Source, first_wave, p_arrival
from per_obspy.processing.series import first_least, without_line

TINY = np.finfo(float).tiny

#: Shortest noise window that is used, and time between its end and the first wave, s.
SHORTEST_NOISE, ONSET_MARGIN = 2.0, 0.5

#: Fewest samples, and shortest time in s, up to the peak of a record that can be picked.
FEWEST, SHORTEST = 20, 0.5

#: Windows before and after a pick whose root mean squares are compared, s.
CLEAR_WINDOW = 2.0

#: Variances of fewer samples at the ends of a record are not reliable.
EDGE = 10


def noise_windows(
    instrument: Iterable[Trace], settings: Processing, source: Source | None
) -> Stream:
    """
    Return a copy of the components of one instrument with the length of their leading noise.

    The pick is that of the vertical, on which P is largest, or else the median of the horizontals.
    With a known event a pick farther from the computed P than the tolerance is discarded, and the
    computed P is used if no pick is left. Without a clear wave there is no noise, and none where it
    is shorter than `SHORTEST_NOISE`; ``pre_event`` of the settings is the noise without a pick.
    Samples far from the first wave are cut: the hours of a continuous record.

    ``stats.per_obspy`` gets ``noise`` (s from the first sample, 0 for none), ``onset_source`` and,
    where there is one, ``onset`` (UTC).
    """
    traces, given = list(instrument), settings.pre_event
    if given is not None:
        note: dict[str, str | float] = {"noise": given, "onset_source": "configuration"}
        return Stream([with_note(trace, f"noise: first {given:g} s", **note) for trace in traces])
    onset, method = _onset(traces, source)
    # The first wave of all components
    out = Stream()
    for trace in traces:
        # Seconds from the first sample of this component
        noise, when = 0.0, {}
        if onset is not None:
            end = min(onset, trace.stats.endtime) - ONSET_MARGIN
            quiet, when = float(end - trace.stats.starttime), {"onset": str(onset)}
            noise = quiet if quiet >= SHORTEST_NOISE else 0.0
        step = f"noise: first {noise:.2f} s ({method})"
        noted = with_note(trace, step, noise=noise, onset_source=method, **when)
        out += _trim(noted, onset, settings) if onset is not None else noted
    return out


def _onset(traces: list[Trace], source: Source | None) -> tuple[UTCDateTime | None, str]:
    """Return the time of the first wave, None if there is no clear one, and the method."""
    computed = p_arrival(traces[0], source) if source and traces else None
    picks = dict[str, list[UTCDateTime]]()

    # Horizontals are picked only where the vertical does not decide
    def pick(direction: str) -> list[UTCDateTime]:
        picks[direction] = _picked_times(traces, is_horizontal=direction == "horizontal")
        return picks[direction]

    end = max((trace.stats.endtime for trace in traces), default=UTCDateTime(0))
    onset, method = first_wave(pick, computed, end)
    # With its causes, from which an update of the event is judged
    if source is not None and computed is not None and onset is not None:
        place = traces[0].stats.coordinates
        where = [float(place.latitude), float(place.longitude)]
        known = {
            direction: [time.ns for time in times]
            for direction, times in picks.items()
        }  # fmt: skip
        source.note(place=where, picks=known, end=int(end.ns), onset=onset.ns, method=method)
    return onset, method


def _picked_times(traces: list[Trace], is_horizontal: bool) -> list[UTCDateTime]:
    """Return the times of the first wave of horizontals, or verticals, that have a clear one."""
    times = []
    for trace in traces:
        pick = picked_onset(trace) if components.is_horizontal(trace) == is_horizontal else None
        times += [trace.stats.starttime + pick[0]] if pick is not None else []
    return times


def _trim(trace: Trace, onset: UTCDateTime, settings: Processing) -> Trace:
    """Return a trace with ``noise`` without the samples far from the first wave, if any are."""
    start, end = trace.stats.starttime, trace.stats.endtime
    first, last = onset - settings.longest_noise, onset + settings.longest_signal
    if (first <= start and end <= last) or end <= first or last <= start:
        return trace
    part = copy_header(trace)
    part.trim(first, last)
    # The noise is shorter by the time that was cut before it
    cut = part.stats.starttime - start
    step = f"{cut:.2f} s cut before and {end - part.stats.endtime:.2f} s after"
    noise = max(float(trace.stats.per_obspy.noise) - cut, 0.0)
    return with_note(part, step, part.data.copy(), noise=noise)  # a view would hold the whole day


def picked_onset(trace: Trace, clearest: float = 3.0) -> tuple[float, float] | None:
    """
    Pick the first wave of a record, in any unit, as the median of three pickers.

    Return seconds from the first sample, and between the earliest and the latest picker; None if
    no wave is clear: the root mean squares 2 s after and before it have at least some ratio.
    """
    dt = trace.stats.delta
    samples = _between_1_and_20_hertz(trace.data, dt)
    until_peak = samples[: int(np.abs(samples).argmax()) + 1]
    if until_peak.size < max(SHORTEST / dt, FEWEST):
        return None
    # Median of the pickers that find a wave inside the record
    picks = (
        aic_onset(until_peak),
        energy_ratio_onset(until_peak, max(round(1.0 / dt), 2)),
        baer_onset(samples, dt),
    )
    inside = sorted(pick for pick in picks if pick is not None and 0 < pick < samples.size - 1)
    if not inside:
        return None
    # The wave must be larger than the samples before it
    onset, window = int(median(inside)), round(CLEAR_WINDOW / dt)
    before = _root_mean_square(samples[max(onset - window, 0) : onset])
    if _root_mean_square(samples[onset : onset + window]) < clearest * before:
        return None
    return onset * dt, (inside[-1] - inside[0]) * dt


def _root_mean_square(samples: FloatArray) -> float:
    """Return the size of samples."""
    return float(np.sqrt(np.mean(samples**2)))


def _between_1_and_20_hertz(samples: FloatArray, dt: float) -> FloatArray:
    """Return filtered samples: causally, so that no wave arrives early."""
    from scipy.signal import butter, sosfilt  # in workers only, see instrument_response

    corners = [min(1.0, 0.1 / dt), min(20.0, 0.4 / dt)]
    sections = butter(2, corners, "bandpass", fs=1 / dt, output="sos")
    return np.asarray(sosfilt(sections, without_line(samples)))


def aic_onset(samples: FloatArray) -> int:
    r"""
    Return the sample that best divides a record, up to its peak, into two stationary parts.

    .. math:: AIC(k) = k \log \sigma^2(x_1 \ldots x_k)
                       + (N - k - 1) \log \sigma^2(x_{k+1} \ldots x_N)

    References
    ----------
    Maeda 1985, Zisin 38, 365-379.
    """
    sums, squares = np.cumsum(samples), np.cumsum(samples**2)
    # Variances are not below the rounding of the running sums
    floor = 1e-12 * max(squares[-1] / sums.size, TINY)

    def criterion(block: slice) -> FloatArray:
        # Variances of both parts
        count = 1 + np.arange(block.start, block.stop)
        rest = sums.size - count
        part, square = sums[block], squares[block]
        left = square / count - (part / count) ** 2
        right = (squares[-1] - square) / rest - ((sums[-1] - part) / rest) ** 2
        logarithms = np.log(np.maximum([left, right], floor))
        return np.asarray(count * logarithms[0] + (rest - 1) * logarithms[1])

    edge = min(EDGE, (samples.size - 1) // 4)
    return 1 + (first_least(criterion, edge, samples.size - 1 - edge) or 0)


def energy_ratio_onset(samples: FloatArray, window: int) -> int | None:
    """
    Return the sample with the largest ratio of the energies in windows after and before it.

    The record ends at its peak; None if it is shorter than two windows, samples.

    References
    ----------
    Akram & Eaton 2016, Geophysics 81, KS71-KS91: energy ratio.
    """
    # Energies of windows as differences of the running energy
    energy = np.zeros(samples.size + 1)
    np.cumsum(samples**2, out=energy[1:])
    floor = 1e-12 * energy[-1]

    def negative_ratio(block: slice) -> FloatArray:
        middle = energy[block]
        before = middle - energy[block.start - window : block.stop - window]
        after = energy[block.start + window : block.stop + window] - middle
        return np.asarray(-(after / (before + floor + TINY)))

    return first_least(negative_ratio, window, samples.size - window)


def baer_onset(samples: FloatArray, dt: float) -> int | None:
    """
    Return the sample picked by the method of Baer & Kradolfer, or None.

    References
    ----------
    Baer & Kradolfer 1987, Bull. Seism. Soc. Am. 77, 1437-1445 (as in ObsPy).
    """
    from obspy.signal.trigger import pk_baer  # in workers only, see instrument_response

    second = round(1.0 / dt)
    if samples.size < 4 * second or not samples.any():
        return None
    # The picker works in single precision
    scaled = (samples / np.abs(samples).max()).astype(np.float32)
    pick, _ = pk_baer(
        scaled, 1 / dt, round(0.2 * second), round(0.6 * second), 7.0, 12.0, second, second
    )
    return int(pick) or None
