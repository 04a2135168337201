"""One series of each channel: without integrals and doubles of what is read already."""

from obspy import Stream

from per_obspy.errors import Rejection

_INTEGRALS = {"m/s": "velocity", "m": "displacement"}


def without_integrals(stream: Stream) -> tuple[Stream, list[Rejection]]:
    """
    Return a stream without series of velocity and displacement whose acceleration it holds too.

    Agencies write the integrals of a record beside it, under the same codes.
    """
    accelerations = {trace.id for trace in stream if trace.stats.get("units") == "m/s2"}
    # Integrals without their acceleration stay
    kept, rejected = Stream(), []
    for trace in stream:
        quantity = _INTEGRALS.get(trace.stats.get("units"))
        if quantity is None or trace.id not in accelerations:
            kept += trace
            continue
        reason = f"{quantity} series, acceleration is read instead"
        rejected.append(Rejection("record", trace.id, trace.stats.source, None, (reason,)))
    return kept, rejected


