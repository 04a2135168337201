"""Where the noise ends: before the first wave, by picks and, for a known event, by the travel time of P."""

from functools import lru_cache
from statistics import median
from typing import NamedTuple

from obspy import Stream, Trace, UTCDateTime
from obspy.core.event import Event
from obspy.geodetics import locations2degrees
from obspy.taup import TauPyModel

from per_obspy.processing.noise.onset import picked_onset
from per_obspy.processing.notes import noted
from per_obspy.processing.station.components import is_horizontal

MODEL = "iasp91"
METRES_A_KILOMETRE = 1000.0


class Source(NamedTuple):
    """
    What the chain needs of an event.

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
    """

    time: UTCDateTime
    latitude: float
    longitude: float
    depth: float
    magnitude: float | None


def source_of(event: Event) -> Source:
    """Return the preferred origin and magnitude of an event that has an origin; an unknown depth counts as 10 km."""
    origin = event.preferred_origin() or event.origins[0]
    magnitude = event.preferred_magnitude() or next(iter(event.magnitudes), None)
    depth = 10 * METRES_A_KILOMETRE if origin.depth is None else max(origin.depth, 0.0)
    size = None if magnitude is None else float(magnitude.mag)
    return Source(origin.time, origin.latitude, origin.longitude, depth, size)


def p_arrival(trace: Trace, source: Source) -> UTCDateTime | None:
    """
    Return when the first P wave is computed to arrive, or None where the trace has no coordinates.

    References
    ----------
    Kennett & Engdahl 1991, Geophys. J. Int. 105, 429-465 (iasp91), as in ObsPy.
    """
    place = trace.stats.get("coordinates")
    if not place:
        return None
    degrees = locations2degrees(source.latitude, source.longitude, place.latitude, place.longitude)
    arrivals = _model().get_travel_times(
        source.depth / METRES_A_KILOMETRE, degrees, phase_list=["ttp"]
    )
    return source.time + arrivals[0].time if arrivals else None


@lru_cache(maxsize=1)
def _model() -> TauPyModel:
    return TauPyModel(MODEL)


def noise_window_noted(
    stream: Stream,
    margin: float = 0.5,
    shortest: float = 2.0,
    tolerance: float = 10.0,
    source: Source | None = None,
    pre_event: float | None = None,
) -> Stream:
    """
    Return a copy of the components of one instrument that know how much noise precedes the first wave.

    The pick is the vertical's, which P moves most, or else the median of the horizontals'. With a
    known event a pick farther from the computed P than the tolerance is discarded, and the computed
    P is used if no pick is left.

    Parameters
    ----------
    stream : obspy Stream
        Raw or physical, not padded.
    margin : float
        s before the first wave where the noise ends.
    shortest : float
        Shorter noise counts as none, s.
    tolerance : float
        Between a pick and the computed P, s.
    source : Source, optional
        The event, if known.
    pre_event : float, optional
        s of noise at the beginning, where that is known: nothing is picked.

    Returns
    -------
    obspy Stream
        With ``noise`` (s from the first sample, 0 for none), ``onset_source`` and, where there is
        one, ``onset`` (UTC) in ``stats.per_obspy``.
    """
    out = stream.copy()
    if pre_event is not None:
        for trace in out:
            noted(
                trace,
                f"noise: first {pre_event:g} s",
                noise=pre_event,
                onset_source="configuration",
            )
        return out
    onset, how = _onset(stream, tolerance, source)
    for trace in out:
        quiet = (
            -1.0
            if onset is None
            else min(onset, trace.stats.endtime) - margin - trace.stats.starttime
        )
        noise = quiet if quiet >= shortest else 0.0
        noted(trace, f"noise: first {noise:.2f} s ({how})", noise=float(noise), onset_source=how)
        if onset is not None:
            trace.stats.per_obspy.onset = str(onset)
    return out


def _onset(
    stream: Stream, tolerance: float, source: Source | None
) -> tuple[UTCDateTime | None, str]:
    computed = p_arrival(stream[0], source) if source and stream else None
    verticals = [trace for trace in stream if not is_horizontal(trace)]
    for group in (verticals, [trace for trace in stream if is_horizontal(trace)]):
        picks = [(trace.stats.starttime, picked_onset(trace)) for trace in group]
        times = [start + pick[0] for start, pick in picks if pick is not None]
        near = [time for time in times if computed is None or abs(time - computed) <= tolerance]
        if near:
            middle = median(time.timestamp for time in near)
            return UTCDateTime(
                middle
            ), f"median of {len(near)} picked {'vertical' if group is verticals else 'horizontal'}"
    if computed is not None:
        return computed, f"travel time of P, {MODEL}"
    return None, "no clear onset"


def trimmed(stream: Stream, before: float = 120.0, after: float = 600.0) -> Stream:
    """
    Return a copy without what lies far from the first wave: the hours of a continuous record.

    Parameters
    ----------
    stream : obspy Stream
        From `noise_window_noted`; traces without an onset stay whole.
    before, after : float
        What is kept before and after the first wave, s.

    Returns
    -------
    obspy Stream
    """
    out = stream.copy()
    for trace in out:
        start, end = trace.stats.starttime, trace.stats.endtime
        onset = UTCDateTime(trace.stats.per_obspy.get("onset", start))
        if "onset" in trace.stats.per_obspy and (start < onset - before or end > onset + after):
            trace.trim(onset - before, onset + after)
            cut = trace.stats.starttime - start
            noise = max(float(trace.stats.per_obspy.noise) - cut, 0.0)
            noted(
                trace,
                f"{cut:.2f} s cut before and {end - trace.stats.endtime:.2f} s after",
                noise=noise,
            )
    return out
