"""From the pieces of a station to instruments: channels made whole, components of one sensor together."""

import re
from collections import defaultdict
from collections.abc import Callable, Iterable

import numpy as np
from obspy import Stream, Trace

from per_obspy.errors import RecordRejected, Rejection
from per_obspy.processing.provenance import rejection, remembered
from per_obspy.processing.splicing import spliced

PREFERENCE = ("HN", "BN", "HH", "BH")  # accelerometers before velocity sensors, fast before slow
STEEPEST_HORIZONTAL = 45.0  # degrees of dip
SMALLEST_ANGLE = 30.0  # degrees between two horizontals that can stand for the plane
SEED_CODE = re.compile(r"[A-Z][GHLMN][A-Z0-9]")
AZIMUTH_CODE = re.compile(r"[0-3]?\d\d")
NAMED_AZIMUTHS = {"N": 0.0, "NS": 0.0, "E": 90.0, "EW": 90.0}
VERTICAL_CODES = ("Z", "U", "UD", "UP", "V", "DN")


def surviving(step: Callable[[Stream], Stream], stream: Stream) -> tuple[Stream, tuple[Rejection, ...]]:
    """
    Apply a step trace by trace, so that one bad trace never loses the others.

    Parameters
    ----------
    step : callable
        From Stream to new Stream; raises `RecordRejected`.
    stream : obspy Stream

    Returns
    -------
    kept : obspy Stream
        What the step returned for the traces that it accepted.
    lost : tuple of Rejection
        One row for each of the others.
    """
    kept, lost = Stream(), []
    for trace in stream:
        try:
            kept += step(Stream([trace]))
        except RecordRejected as fault:
            lost.append(rejection(trace, *fault.reasons))
    return kept, tuple(lost)


def merged(stream: Stream) -> tuple[Stream, tuple[Rejection, ...]]:
    """
    Join the pieces of each channel; gaps, masked samples and samples that are not finite are reasons, never zeros.

    Parameters
    ----------
    stream : obspy Stream
        Any number of pieces of any number of channels.

    Returns
    -------
    whole : obspy Stream
        One new float64 trace a channel.
    rejected : tuple of Rejection
        The channels that cannot be joined.
    """
    pieces: dict[tuple[str, bool], Stream] = defaultdict(Stream)
    for trace in stream:
        pieces[_channel(trace)] += trace
    firsts = Stream([parts[0] for parts in pieces.values()])
    return surviving(lambda first: _joined(first[0].id, pieces[_channel(first[0])]), firsts)


def is_processed(trace: Trace) -> bool:
    """Tell whether others have processed a trace."""
    return bool(trace.stats.get("processing_level") == "processed")


def _channel(trace: Trace) -> tuple[str, bool]:
    return trace.id, is_processed(trace)


def _joined(name: str, pieces: Stream) -> Stream:
    copies = Stream([_in_float64(piece) for piece in pieces if piece.stats.npts])
    reasons = [f"pieces differ in {field}: {values}" for field, values in _differences(copies)]
    if not copies:
        reasons = ["no samples"]
    if reasons:
        raise RecordRejected(name, *reasons)
    whole = copies.copy().merge(method=0)  # samples that overlap and disagree are masked
    reasons = _holes(whole[0])
    if reasons:
        joined = None if any(seconds > 0 for *_, seconds, _ in copies.get_gaps()) else spliced(copies)
        if joined is None or len(copies) == 1:
            raise RecordRejected(name, *reasons)
        whole = Stream([joined])
    whole[0].data = np.ascontiguousarray(np.ma.getdata(whole[0].data))
    return whole


def _in_float64(trace: Trace) -> Trace:
    out = trace.copy()
    out.data = np.ma.asarray(out.data, dtype=np.float64) if np.ma.isMA(out.data) else out.data.astype(np.float64)
    return out


def _differences(pieces: Iterable[Trace]) -> list[tuple[str, str]]:
    found = []
    for field in ("sampling_rate", "calib", "units"):
        values = {piece.stats.get(field) for piece in pieces}
        if len(values) > 1:
            found.append((field, ", ".join(sorted(map(str, values)))))
    return found


def _holes(trace: Trace) -> list[str]:
    missing = np.ma.getmaskarray(trace.data)
    wrong = ~np.isfinite(np.ma.getdata(trace.data)) & ~missing
    texts = ((missing, "samples are missing (gap or contradicting overlap)"), (wrong, "samples are not finite"))
    times = trace.stats.starttime, trace.stats.delta
    return [
        f"{np.count_nonzero(bad)} of {bad.size} {text}, the first at {times[0] + int(bad.argmax()) * times[1]}"
        for bad, text in texts
        if bad.any()
    ]


def oriented(stream: Stream) -> Stream:
    """
    Return a copy whose traces say how their sensors point, from metadata or else from the channel's code.

    Codes N, E, Z, NS, EW, UD and three digits (azimuth in degrees) tell; 1, 2, X, Y, H1, H2 do not, and such a trace
    without metadata stays without an azimuth. ``stats.per_obspy.azimuth_source`` says which it was.
    """
    out = stream.copy()
    for trace in out:
        source = "metadata" if "sensor_azimuth" in trace.stats else "unknown"
        direction = _direction(trace.stats.channel)
        if "sensor_dip" not in trace.stats:
            trace.stats.sensor_dip = -90.0 if direction in VERTICAL_CODES else 0.0
        if source == "unknown" and direction in NAMED_AZIMUTHS:
            trace.stats.sensor_azimuth, source = NAMED_AZIMUTHS[direction], "channel code"
        elif source == "unknown" and AZIMUTH_CODE.fullmatch(direction):
            trace.stats.sensor_azimuth, source = float(direction) % 360, "channel code"
        remembered(trace, azimuth_source=source)
    return out


def _direction(channel: str) -> str:
    if SEED_CODE.fullmatch(channel):
        return channel[-1] if channel[-1].isalpha() else "unknown"
    return channel if AZIMUTH_CODE.fullmatch(channel) else channel.rstrip("0123456789")


def is_horizontal(trace: Trace) -> bool:
    """Tell whether an oriented trace is a horizontal component."""
    return bool(abs(trace.stats.sensor_dip) < STEEPEST_HORIZONTAL)


def instruments(stream: Stream) -> list[Stream]:
    """
    Return the traces of each instrument of a station apart, the preferred instrument first.

    An instrument is a location code with a band and instrument code (SEED), or with the number at the end of other
    codes (KiK-net: EW1 in the borehole, EW2 at the surface). Order: HN, BN, HH, BH, then the rest by name; of the
    numbered ones the highest, which is the surface. Where a record is there raw and processed by others, these are
    two, the raw one first: its corners will be known.
    """
    groups: dict[tuple[bool, str, str], Stream] = defaultdict(Stream)
    for trace in stream:
        groups[is_processed(trace), trace.stats.location, _family(trace.stats.channel)] += trace
    return [groups[key] for key in sorted(groups, key=_rank)]


def _family(channel: str) -> str:
    if SEED_CODE.fullmatch(channel):
        return channel[:2]
    return "" if AZIMUTH_CODE.fullmatch(channel) else channel[len(channel.rstrip("0123456789")) :]


def _rank(key: tuple[bool, str, str]) -> tuple[bool, int, int, str, str]:
    processed, location, family = key
    order = PREFERENCE.index(family) if family in PREFERENCE else len(PREFERENCE)
    return processed, order, -int(family) if family.isdigit() else 0, family, location


def paired(instrument: Stream, overlap: float = 0.8) -> tuple[Stream, tuple[Rejection, ...]]:
    """
    Return at most two horizontals of an instrument over their common time, and one vertical as it is.

    The samples of the two horizontals share their times; where the clocks differ by less than a sample, the later one
    is moved and ``stats.per_obspy.clock_shift`` says by how much.

    Parameters
    ----------
    instrument : obspy Stream
        Oriented traces of one instrument.
    overlap : float
        Smallest part of the longer horizontal that both must cover, dimensionless; else the shorter one is rejected.

    Returns
    -------
    kept : obspy Stream
    rejected : tuple of Rejection
        Components that are parallel to another, sampled otherwise, too short for their partner, or one too many.
    """
    horizontals = sorted(filter(is_horizontal, instrument), key=lambda trace: (-_seconds(trace), trace.id))
    verticals = sorted((trace for trace in instrument if not is_horizontal(trace)), key=lambda trace: trace.id)
    kept = Stream(horizontals[:1])
    rejected = [rejection(trace, f"a second vertical beside {verticals[0].id}") for trace in verticals[1:]]
    for trace in horizontals[1:]:
        reasons = _conflicts(kept, trace, overlap)
        if reasons:
            rejected.append(rejection(trace, *reasons))
        else:
            kept += trace
    return _aligned(kept).sort() + Stream(verticals[:1]), tuple(rejected)


def _aligned(stream: Stream) -> Stream:
    """Return the common time of traces with equal sampling, all with the samples' times of the one that starts last."""
    latest = max((trace.stats.starttime for trace in stream), default=None)
    skips = [round((latest - trace.stats.starttime) / trace.stats.delta) for trace in stream]
    count = min((trace.stats.npts - skip for trace, skip in zip(stream, skips, strict=True)), default=0)
    out = Stream()
    for trace, skip in zip(stream, skips, strict=True):
        part = trace.copy()
        part.data = part.data[skip : skip + count].copy()
        shift = latest - (trace.stats.starttime + skip * trace.stats.delta)
        part.stats.starttime = latest
        remembered(part, clock_shift=float(shift))
        out += part
    return out


def _seconds(trace: Trace) -> float:
    return float(trace.stats.npts * trace.stats.delta)


def _conflicts(kept: Stream, trace: Trace, overlap: float) -> list[str]:
    partner = kept[0]
    if len(kept) > 1:
        return [f"a third horizontal beside {kept[0].id} and {kept[1].id}"]
    reasons = []
    if not np.isclose(trace.stats.delta, partner.stats.delta, rtol=1e-6):
        reasons.append(
            f"sampled every {trace.stats.delta:g} s, its partner {partner.id} every {partner.stats.delta:g} s"
        )
    angle = _angle(partner, trace)
    if angle < SMALLEST_ANGLE:
        reasons.append(f"{angle:g} degrees from its partner {partner.id}, needs {SMALLEST_ANGLE:g}")
    common = min(trace.stats.endtime, partner.stats.endtime) - max(trace.stats.starttime, partner.stats.starttime)
    if common < overlap * (_seconds(partner) - partner.stats.delta):
        reasons.append(f"shares {max(common, 0):.1f} s of the {_seconds(partner):.1f} s of {partner.id}")
    return reasons


def _angle(one: Trace, other: Trace) -> float:
    """Return the acute angle between two horizontals, degrees; 90 where an azimuth is unknown."""
    if "sensor_azimuth" not in one.stats or "sensor_azimuth" not in other.stats:
        return 90.0
    difference = abs(one.stats.sensor_azimuth - other.stats.sensor_azimuth) % 180.0
    return float(min(difference, 180.0 - difference))
