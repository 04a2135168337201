"""Select one series of each channel: no integrals, no second copies of a series."""

from collections import defaultdict
from collections.abc import Iterable

from obspy import Stream, Trace

from per_obspy.errors import Rejection

#: Difference of durations that decides between two forms of a record, s.
_STEP = 10.0

#: Format and unit of a record -> its series.
Forms = dict[tuple[str, str], list[Trace]]

#: unit of a series -> its quantity, for the integrals of acceleration
_INTEGRALS = {"m/s": "velocity", "m": "displacement"}


def without_integrals(stream: Stream) -> tuple[Stream, list[Rejection]]:
    """
    Return a stream without series of velocity and displacement whose acceleration it holds too.

    Agencies write the integrals of a record to the same folder, under the same codes.
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


def without_doubles(stream: Stream) -> tuple[Stream, list[Rejection]]:
    """
    Return a stream with one form of every record that agencies give in several.

    A folder may hold a record as counts and as acceleration (V0 and V1), or in two formats (SMC
    and RAW). Of the forms of one channel and state (raw or processed) that overlap in time, the
    longest stays (in steps of 10 s), of several one in physical units, of these the first by format
    and file. A form that does not overlap, in time or by its channel code, is another record.
    """
    left_out: dict[int, Rejection] = {}
    for forms in _forms_by_channel(stream):
        best = min(forms, key=lambda form: _rank(form, forms[form]))
        others = [trace for form, traces in forms.items() if form != best for trace in traces]
        for trace in others:
            same = [read for read in forms[best] if _overlap(trace, read)]
            if same:
                left_out[id(trace)] = _double(trace, same[0])
    # The order of the files stays
    kept = Stream([trace for trace in stream if id(trace) not in left_out])
    return kept, list(left_out.values())


def _forms_by_channel(stream: Stream) -> Iterable[Forms]:
    """Return the forms of each channel and state: format and unit -> series."""
    channels: dict[tuple[str, str], Forms] = {}
    # Raw and processed forms are different records
    for trace in stream:
        level = str(trace.stats.get("processing_level", ""))
        form = (str(trace.stats.get("_format", "")), str(trace.stats.get("units", "")))
        forms = channels.setdefault((trace.id, level), defaultdict(list))
        forms[form].append(trace)
    return channels.values()


def _rank(form: tuple[str, str], traces: Iterable[Trace]) -> tuple[int, bool, str, str]:
    """Return the sorting key of a form: duration, physical units, format and file."""
    format_name, units = form
    known = list(traces)
    seconds = sum(float(trace.stats.npts * trace.stats.delta) for trace in known)
    first = min(str(trace.stats.source) for trace in known)
    return -round(seconds / _STEP), units == "counts", format_name, first


def _overlap(first: Trace, second: Trace) -> bool:
    """Return whether two series share time."""
    start = max(first.stats.starttime, second.stats.starttime)
    return bool(min(first.stats.endtime, second.stats.endtime) > start)


def _double(trace: Trace, read: Trace) -> Rejection:
    """Return the row of a record that is read in another form."""
    stats = read.stats
    form = f"{stats.get('_format', '')} in {stats.get('units', '')}".strip()
    reason = f"the same record as {stats.source} ({form}), which is read instead"
    return Rejection("record", trace.id, trace.stats.source, None, (reason,))
