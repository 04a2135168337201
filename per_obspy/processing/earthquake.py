"""
What an earthquake decides about a record: the first wave, and the corner of one without noise.

The computed P wave chooses among the picks of an instrument, and the magnitude gives the corner of
a record without noise. A station keeps each decision with its causes. An earthquake of another
place, time or magnitude that leads to the same decisions leads to the same motion to the last bit,
so that the station is not processed again.
"""

from collections.abc import Callable, Iterable, Mapping, Sequence
from functools import lru_cache
from statistics import median
from typing import TYPE_CHECKING, Any, NamedTuple

from obspy import Trace, UTCDateTime
from obspy.core.event import Event
from obspy.geodetics import locations2degrees

from per_obspy.config import Processing
from per_obspy.processing.account import FROM_CONSTANT, FROM_TABLE

if TYPE_CHECKING:
    from obspy.taup.seismic_phase import SeismicPhase

#: Velocity model of the Earth for travel times.
MODEL = "iasp91"

METRES_PER_KILOMETRE = 1000.0

#: Depth of a hypocentre whose depth is unknown, km.
UNKNOWN_DEPTH = 10

#: Digits after the point of a computed P time, s: its error is that of the origin and the model.
P_DIGITS = 1

#: Largest difference between a pick and the computed travel time of P, s.
PICK_TOLERANCE = 10.0

#: Traces whose picks are tried in turn.
DIRECTIONS = ("vertical", "horizontal")


class Source(NamedTuple):
    """Origin and magnitude of an event."""

    #: of the origin
    time: UTCDateTime
    #: degrees
    latitude: float
    longitude: float
    #: m
    depth: float
    #: the preferred one, or the first
    magnitude: float | None
    #: every decision of the processing that depends on the event, with its causes, as plain values
    decisions: list[dict[str, Any]] | None = None

    def note(self, **decision: object) -> None:
        """Collect a decision, each once."""
        if self.decisions is not None and decision not in self.decisions:
            self.decisions.append(decision)


class Corner(NamedTuple):
    """A corner, Hz, and the reason for it."""

    frequency: float
    reason: str


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
    return _p_arrival_at(place.latitude, place.longitude, source) if place else None


def _p_arrival_at(latitude: float, longitude: float, source: Source) -> UTCDateTime | None:
    """Compute the arrival time of the first P wave at a place."""
    degrees = locations2degrees(source.latitude, source.longitude, latitude, longitude)
    phases = _phases_from(source.depth / METRES_PER_KILOMETRE)
    times = [arrival.time for phase in phases for arrival in phase.calc_time(degrees)]
    return source.time + min(times) if times else None


@lru_cache(maxsize=4)
def _phases_from(kilometres: float) -> "list[SeismicPhase]":
    """Return the phases of P from a depth: the model is split there once for all stations."""
    # ObsPy's travel times load Matplotlib too: a quarter of the time in which a worker begins
    from obspy.taup import TauPyModel
    from obspy.taup.taup_time import TauPTime

    work = TauPTime(TauPyModel(MODEL).model, ["ttp"], kilometres, 0.0)
    work.depth_correct(kilometres)
    work.recalc_phases()
    return list(work.phases)


def first_wave(
    picked: Callable[[str], Sequence[UTCDateTime]],
    computed: UTCDateTime | None,
    end: UTCDateTime,
) -> tuple[UTCDateTime | None, str]:
    """
    Return the time of the first wave, None if there is no clear one, and the method.

    ``picked`` returns the picks of the traces of a direction, one of `DIRECTIONS`. The computed P
    wave is rounded, so that a negligible change of origin changes nothing; picks farther from it
    than `PICK_TOLERANCE` do not count. A P wave after the end of the record contradicts every
    pick: the station is in a wrong place, or its clock is wrong, and the picks count.
    """
    if computed is not None:
        computed = UTCDateTime(round(computed.timestamp, P_DIGITS))
    # The vertical first: P moves it most
    for direction in DIRECTIONS:
        times = picked(direction)
        if computed is not None and computed <= end:
            times = [time for time in times if abs(time - computed) <= PICK_TOLERANCE]
        if times:
            middle = median(time.timestamp for time in times)
            return UTCDateTime(middle), f"median of {len(times)} picked {direction}"
    if computed is not None:
        return computed, f"travel time of P, {MODEL}"
    return None, "no clear onset"


def fallback_highpass(
    magnitude: float | None, by_magnitude: dict[float, float], unknown: float
) -> Corner:
    """
    Return the high-pass corner, Hz, of a record without measurable noise.

    It is that of the largest magnitude of the table that is reached, or the unknown one.

    Examples
    --------
    >>> fallback_highpass(6.1, {-10.0: 0.5, 3.5: 0.3, 5.5: 0.1}, 0.08).frequency
    0.1
    """
    if magnitude is None:
        return Corner(unknown, f"{FROM_CONSTANT}neither noise nor magnitude known")
    reached = [size for size in by_magnitude if magnitude >= size]
    if not reached:
        return Corner(unknown, f"{FROM_CONSTANT}the magnitude is below the table")
    # The row, not the magnitude: an update within the row changes no record
    reason = f"{FROM_TABLE} recorded, magnitude from {max(reached):g}"
    return Corner(by_magnitude[max(reached)], reason)


def same_decisions(
    decisions: Iterable[Mapping[str, Any]], source: Source, settings: Processing
) -> bool:
    """
    Return whether an earthquake leads to the decisions of an earlier processing.

    The decisions were collected by a `Source` and perhaps read from a file; the settings are those
    of that processing. False as well if a decision is damaged, or would depend on traces that were
    not picked.
    """
    try:
        return all(_is_same(decision, source, settings) for decision in decisions)
    except (AttributeError, KeyError, TypeError, ValueError, OverflowError):
        return False


def _is_same(decision: Mapping[str, Any], source: Source, settings: Processing) -> bool:
    """Return whether an earthquake leads to one earlier decision; `KeyError` without its picks."""
    if "onset" not in decision:
        table, unknown = settings.fallback_highpass, settings.unknown_highpass
        corner = fallback_highpass(source.magnitude, table, unknown)
        return list(corner) == list(decision["highpass"])
    # The same picks, with the P of the event now
    picks = {
        name: [UTCDateTime(ns=ns) for ns in times] for name, times in decision["picks"].items()
    }
    latitude, longitude = decision["place"]
    computed = _p_arrival_at(latitude, longitude, source)
    end = UTCDateTime(ns=decision["end"])
    onset, method = first_wave(picks.__getitem__, computed, end)
    return onset is not None and (onset.ns, method) == (decision["onset"], decision["method"])
