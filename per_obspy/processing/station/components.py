"""The instruments of a station: how their sensors point, which components belong together."""

import re
from collections import defaultdict

import numpy as np
from obspy import Stream, Trace

from per_obspy.constants import VERTICAL_DIP
from per_obspy.errors import Rejection
from per_obspy.processing.copying import copied
from per_obspy.processing.notes import is_processed, rejection, remembered
from per_obspy.processing.station.film_interval import at_one_interval

PREFERENCE = ("HN", "BN", "HH", "BH")  # accelerometers before velocity sensors, fast before slow

SMALLEST_ANGLE = 30.0  # degrees between two horizontals that can stand for the plane
SEED_CODE = re.compile(r"[A-Z][GHLMN][A-Z0-9]")
AZIMUTH_CODE = re.compile(r"[0-3]?\d\d")
NAMED_AZIMUTHS = {"N": 0.0, "NS": 0.0, "E": 90.0, "EW": 90.0}
VERTICAL_CODES = ("Z", "U", "UD", "UP", "V", "DN")


def oriented(stream: Stream) -> Stream:
    """
    Return a copy whose traces say how their sensors point, from metadata or else from the channel's code.

    Codes N, E, Z, NS, EW, UD and three digits (azimuth in degrees) tell; 1, 2, X, Y, H1, H2 do not,
    and such a trace without metadata stays without an azimuth. ``stats.per_obspy.azimuth_source``
    says which it was.
    """
    out = copied(stream)
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
    return bool(abs(trace.stats.sensor_dip) < VERTICAL_DIP)


def instruments(stream: Stream) -> list[Stream]:
    """
    Return the traces of each instrument of a station apart, the preferred instrument first.

    An instrument is a location code with a band and instrument code (SEED), or with the number at
    the end of other codes (KiK-net: EW1 in the borehole, EW2 at the surface). Order: HN, BN, HH,
    BH, then the rest by name; of the numbered ones the highest, which is the surface. Where a
    record is there raw and processed by others, these are two, the raw one first: its corners will
    be known.
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

    The samples of the two horizontals share their times; where the clocks differ by less than a
    sample, the later one is moved and ``stats.per_obspy.clock_shift`` says by how much.

    Parameters
    ----------
    instrument : obspy Stream
        Oriented traces of one instrument.
    overlap : float
        Smallest part of the longer horizontal that both must cover, dimensionless; else the shorter
        one is rejected.

    Returns
    -------
    kept : obspy Stream
    rejected : tuple of Rejection
        Components that are parallel to another, sampled otherwise, too short for their partner, or
        one too many.
    """
    horizontals = sorted(
        filter(is_horizontal, at_one_interval(instrument)), key=lambda trace: (-_seconds(trace), trace.id)
    )
    verticals = sorted(
        (trace for trace in instrument if not is_horizontal(trace)), key=lambda trace: trace.id
    )
    kept = Stream(horizontals[:1])
    rejected = [
        rejection(trace, f"a second vertical beside {verticals[0].id}") for trace in verticals[1:]
    ]
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
    count = min(
        (trace.stats.npts - skip for trace, skip in zip(stream, skips, strict=True)), default=0
    )
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
    common = min(trace.stats.endtime, partner.stats.endtime) - max(
        trace.stats.starttime, partner.stats.starttime
    )
    if common < overlap * (_seconds(partner) - partner.stats.delta):
        reasons.append(
            f"shares {max(common, 0):.1f} s of the {_seconds(partner):.1f} s of {partner.id}"
        )
    return reasons


def _angle(one: Trace, other: Trace) -> float:
    """Return the acute angle between two horizontals, degrees; 90 where an azimuth is unknown."""
    if "sensor_azimuth" not in one.stats or "sensor_azimuth" not in other.stats:
        return 90.0
    difference = abs(one.stats.sensor_azimuth - other.stats.sensor_azimuth) % 180.0
    return float(min(difference, 180.0 - difference))
