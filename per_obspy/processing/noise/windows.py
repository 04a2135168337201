"""Noise windows: end of the noise by picks and, for a known event, by the travel time of P."""

from collections.abc import Callable, Mapping, Sequence
from functools import lru_cache
from statistics import median
from typing import TYPE_CHECKING, Any, NamedTuple

from obspy import Stream, Trace, UTCDateTime
from obspy.core.event import Event
from obspy.geodetics import locations2degrees

from per_obspy.processing.noise.onset import picked_onset
from per_obspy.processing.notes import copied, noted
from per_obspy.processing.station.components import is_horizontal

if TYPE_CHECKING:
    from obspy.taup import TauPyModel

#: Velocity model of the Earth for travel times.
MODEL = "iasp91"

METRES_PER_KILOMETRE = 1000.0

#: Depth of a hypocentre whose depth is unknown, km.
UNKNOWN_DEPTH = 10

#: Digits after the point of a computed P time, s: its error is that of the origin and the model.
P_DIGITS = 1

#: Traces whose picks are tried in turn.
DIRECTIONS = ("vertical", "horizontal")


class Source(NamedTuple):
    """
    Origin and magnitude of an event.

    Attributes
    ----------
    time : UTCDateTime
        Of the origin.
    latitude, longitude : float
        Degrees.
    depth : float
        m.
    magnitude : float or None
        The preferred one, or the first.
    decisions : list of dict or None
        Collects every decision of the processing that depends on the event, with its causes: see
        :mod:`per_obspy.processing.decisions`.
    """

    time: UTCDateTime
    latitude: float
    longitude: float
    depth: float
    magnitude: float | None
    decisions: list[dict[str, Any]] | None = None

    def note(self, **decision: object) -> None:
        """Collect a decision, each once."""
        if self.decisions is not None and decision not in self.decisions:
            self.decisions.append(decision)


def source_of(event: Event, decisions: list[dict[str, Any]] | None = None) -> Source:
    """Return the preferred origin and magnitude of an event with at least one origin."""
    origin = event.preferred_origin() or event.origins[0]
    magnitude = event.preferred_magnitude() or next(iter(event.magnitudes), None)
    # Depths above the reference surface count as 0
    unknown = UNKNOWN_DEPTH * METRES_PER_KILOMETRE
    depth = unknown if origin.depth is None else max(origin.depth, 0.0)
    size = None if magnitude is None else float(magnitude.mag)
    return Source(origin.time, origin.latitude, origin.longitude, depth, size, decisions)


def p_arrival(trace: Trace, source: Source) -> UTCDateTime | None:
    """
    Compute the arrival time of the first P wave, None if the trace has no coordinates.

    References
    ----------
    Kennett & Engdahl 1991, Geophys. J. Int. 105, 429-465 (iasp91), as in ObsPy.
    """
    place = trace.stats.get("coordinates")
    return p_arrival_at(place.latitude, place.longitude, source) if place else None


def p_arrival_at(latitude: float, longitude: float, source: Source) -> UTCDateTime | None:
    """Compute the arrival time of the first P wave at a place; see `p_arrival`."""
    degrees = locations2degrees(source.latitude, source.longitude, latitude, longitude)
    kilometres = source.depth / METRES_PER_KILOMETRE
    arrivals = _model().get_travel_times(kilometres, degrees, phase_list=["ttp"])
    return source.time + arrivals[0].time if arrivals else None


def _rounded(time: UTCDateTime | None) -> UTCDateTime | None:
    """Return a time rounded to `P_DIGITS`, so that a negligible change of origin changes none."""
    return None if time is None else UTCDateTime(round(time.timestamp, P_DIGITS))


@lru_cache(maxsize=1)
def _model() -> "TauPyModel":
    """Return the velocity model, loaded once."""
    # ObsPy's travel times load Matplotlib too: a quarter of the time in which a worker begins
    from obspy.taup import TauPyModel

    return TauPyModel(MODEL)


def noise_window_noted(
    stream: Stream,
    margin: float,
    shortest: float,
    tolerance: float,
    source: Source | None,
    pre_event: float | None,
) -> Stream:
    """
    Return a copy of the components of one instrument with the length of their leading noise.

    The pick is that of the vertical, on which P is largest, or else the median of the horizontals.
    With a known event a pick farther from the computed P than the tolerance is discarded, and the
    computed P is used if no pick is left.

    Parameters
    ----------
    stream : obspy Stream
        Raw or physical, not padded.
    margin : float
        s before the first wave at which the noise ends.
    shortest : float
        Shorter noise counts as none, s.
    tolerance : float
        Between a pick and the computed P, s.
    source : Source or None
        The event, if known.
    pre_event : float or None
        s of noise at the beginning, if known: no wave is picked.

    Returns
    -------
    obspy Stream
        With ``noise`` (s from the first sample, 0 for none), ``onset_source`` and, where there is
        one, ``onset`` (UTC) in ``stats.per_obspy``.
    """
    out = copied(stream)
    if pre_event is not None:
        step = f"noise: first {pre_event:g} s"
        for trace in out:
            noted(trace, step, noise=pre_event, onset_source="configuration")
        return out
    onset, method = _onset(stream, tolerance, source)
    for trace in out:
        # Seconds from the first sample of this component
        quiet = _noise_before(trace, onset, margin)
        noise = quiet if quiet >= shortest else 0.0
        step = f"noise: first {noise:.2f} s ({method})"
        noted(trace, step, noise=float(noise), onset_source=method)
        if onset is not None:
            trace.stats.per_obspy.onset = str(onset)
    return out


def _noise_before(trace: Trace, onset: UTCDateTime | None, margin: float) -> float:
    """Return the length of the noise up to a margin before the onset, s; negative without onset."""
    if onset is None:
        return -1.0
    end = min(onset, trace.stats.endtime) - margin
    return float(end - trace.stats.starttime)


def _onset(
    stream: Stream, tolerance: float, source: Source | None
) -> tuple[UTCDateTime | None, str]:
    """Return the time of the first wave, None if there is no clear one, and the method."""
    computed = _rounded(p_arrival(stream[0], source)) if source and stream else None
    picks = dict[str, list[UTCDateTime]]()

    # Horizontals are picked only where the vertical does not decide
    def picked(direction: str) -> list[UTCDateTime]:
        group = [trace for trace in stream if is_horizontal(trace) == (direction == "horizontal")]
        return picks.setdefault(direction, _picked_times(group))

    end = max((trace.stats.endtime for trace in stream), default=UTCDateTime(0))
    onset, method = first_wave(picked, computed, tolerance, end)
    # With its causes, from which an update of the event is judged
    if source is not None and computed is not None and onset is not None:
        place = stream[0].stats.coordinates
        known = {name: list(map(_ns, times)) for name, times in picks.items()}
        where = [float(place.latitude), float(place.longitude)]
        source.note(place=where, picks=known, end=_ns(end), onset=onset.ns, method=method)
    return onset, method


def first_wave(
    picked: Callable[[str], Sequence[UTCDateTime]],
    computed: UTCDateTime | None,
    tolerance: float,
    end: UTCDateTime,
) -> tuple[UTCDateTime | None, str]:
    """
    Return the time of the first wave, None if there is no clear one, and the method.

    Parameters
    ----------
    picked : callable
        Returns the picks of the traces of a direction, one of `DIRECTIONS`.
    computed : UTCDateTime or None
        P wave by the travel time.
    tolerance : float
        Between a pick and the computed P, s.
    end : UTCDateTime
        Of the record. A P wave after it contradicts every pick: the station is in a wrong place, or
        its clock is wrong, and the picks count.
    """
    # The vertical first: P moves it most
    for direction in DIRECTIONS:
        times = picked(direction)
        if computed is not None and computed <= end:
            times = [time for time in times if abs(time - computed) <= tolerance]
        if times:
            middle = median(time.timestamp for time in times)
            return UTCDateTime(middle), f"median of {len(times)} picked {direction}"
    if computed is not None:
        return computed, f"travel time of P, {MODEL}"
    return None, "no clear onset"


def same_onset(decision: Mapping[str, Any], source: Source, tolerance: float) -> bool:
    """
    Return whether an event leads to the same first wave as that of an earlier processing.

    Parameters
    ----------
    decision : mapping
        Collected by a `Source`.
    source : Source
        The event now.
    tolerance : float
        Between a pick and the computed P, s.

    Raises
    ------
    KeyError
        If traces would decide of which there were no picks.
    """
    picks = {name: list(map(_of_ns, times)) for name, times in decision["picks"].items()}
    # The same picks, with the P of the event now
    latitude, longitude = decision["place"]
    computed = _rounded(p_arrival_at(latitude, longitude, source))
    end = _of_ns(decision["end"])
    onset, method = first_wave(picks.__getitem__, computed, tolerance, end)
    return onset is not None and (onset.ns, method) == (decision["onset"], decision["method"])


def _ns(time: UTCDateTime) -> int:
    """Return a time as ns after 1970."""
    return int(time.ns)


def _of_ns(number: int) -> UTCDateTime:
    """Return the time so many ns after 1970."""
    return UTCDateTime(ns=number)


def _picked_times(traces: list[Trace]) -> list[UTCDateTime]:
    """Return the times of the first wave of the traces that have a clear one."""
    picks = [(trace.stats.starttime, picked_onset(trace)) for trace in traces]
    return [start + pick[0] for start, pick in picks if pick is not None]


def trimmed(stream: Stream, before: float, after: float) -> Stream:
    """
    Return a copy without the samples far from the first wave: the hours of a continuous record.

    Parameters
    ----------
    stream : obspy Stream
        From `noise_window_noted`; traces without an onset stay whole.
    before, after : float
        Time kept before and after the first wave, s.

    Returns
    -------
    obspy Stream
    """
    out = copied(stream)
    for trace in out:
        start, end = trace.stats.starttime, trace.stats.endtime
        onset = UTCDateTime(trace.stats.per_obspy.get("onset", start))
        is_longer = start < onset - before or end > onset + after
        is_inside = onset - before < end and onset + after > start
        if "onset" in trace.stats.per_obspy and is_longer and is_inside:
            trace.trim(onset - before, onset + after)
            trace.data = trace.data.copy()  # a view would hold the whole day
            # The noise is shorter by the time that was cut before it
            cut = trace.stats.starttime - start
            noise = max(float(trace.stats.per_obspy.noise) - cut, 0.0)
            step = f"{cut:.2f} s cut before and {end - trace.stats.endtime:.2f} s after"
            noted(trace, step, noise=noise)
    return out
