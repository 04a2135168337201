"""Components of a station: directions of sensors, instruments, pairs of horizontals."""

import re
from collections import defaultdict
from collections.abc import Iterable

import numpy as np
from obspy import Stream, Trace

from per_obspy.constants import VERTICAL_DIP
from per_obspy.errors import Rejection
from per_obspy.processing.notes import copied, copied_trace, is_processed, rejection, remembered
from per_obspy.processing.station.film_interval import at_one_interval

#: Band and instrument codes in order: accelerometers before velocity sensors, fast before slow.
PREFERENCE = ("HN", "BN", "HH", "BH")

#: Smallest angle between two horizontals that span the horizontal plane, degrees.
SMALLEST_PAIR_ANGLE = 30.0

#: Angle between two horizontals of which an azimuth is unknown, degrees.
UNKNOWN_ANGLE = 90.0

#: Relative difference of equal sampling intervals.
SAMPLING_TOLERANCE = 1e-6

#: Channel codes: SEED, an azimuth in degrees, names of azimuths, names of the vertical.
SEED_CODE = re.compile(r"[A-Z][GHLMN][A-Z0-9]")
AZIMUTH_CODE = re.compile(r"[0-3]?\d\d")
NAMED_AZIMUTHS = {"N": 0.0, "NS": 0.0, "E": 90.0, "EW": 90.0}
VERTICAL_CODES = ("Z", "U", "UD", "UP", "V", "DN")


def oriented(stream: Iterable[Trace]) -> Stream:
    """
    Return a copy with the directions of sensors, from metadata or else from the channel code.

    Codes N, E, Z, NS, EW, UD and three digits (azimuth in degrees) give a direction; 1, 2, X, Y,
    H1, H2 do not, and such a trace without metadata stays without an azimuth.
    ``stats.per_obspy.azimuth_source`` is the source.
    """
    out = copied(stream)
    for trace in out:
        source = "metadata" if "sensor_azimuth" in trace.stats else "unknown"
        direction = _direction(trace.stats.channel)
        # Dip of -90 degrees: the vertical points upwards
        if "sensor_dip" not in trace.stats:
            trace.stats.sensor_dip = -90.0 if direction in VERTICAL_CODES else 0.0
        if source == "unknown" and direction in NAMED_AZIMUTHS:
            trace.stats.sensor_azimuth, source = NAMED_AZIMUTHS[direction], "channel code"
        elif source == "unknown" and AZIMUTH_CODE.fullmatch(direction):
            trace.stats.sensor_azimuth, source = float(direction) % 360, "channel code"
        remembered(trace, azimuth_source=source)
    return out


def _direction(channel: str) -> str:
    """Return the part of a channel code that is a direction."""
    if SEED_CODE.fullmatch(channel):
        return channel[-1] if channel[-1].isalpha() else "unknown"
    return channel if AZIMUTH_CODE.fullmatch(channel) else channel.rstrip("0123456789")


def is_horizontal(trace: Trace) -> bool:
    """Return whether an oriented trace is a horizontal component."""
    return bool(abs(trace.stats.sensor_dip) < VERTICAL_DIP)


def instruments(stream: Stream) -> list[Stream]:
    """
    Return the traces of each instrument of a station, the preferred instrument first.

    An instrument is a location code with a band and instrument code (SEED), or with the number at
    the end of other codes (KiK-net: EW1 in the borehole, EW2 at the surface). Order: HN, BN, HH,
    BH, then the rest by name; of numbered instruments the highest, which is the surface. A record
    that exists raw and processed by others counts as two instruments, the raw one first: its
    corners will be known.
    """
    groups: dict[tuple[bool, str, str], Stream] = defaultdict(Stream)
    for trace in stream:
        groups[is_processed(trace), trace.stats.location, _family(trace.stats.channel)] += trace
    return [groups[key] for key in sorted(groups, key=_rank)]


def _family(channel: str) -> str:
    """Return band and instrument of a SEED code, or the number at the end of another code."""
    if SEED_CODE.fullmatch(channel):
        return channel[:2]
    if AZIMUTH_CODE.fullmatch(channel):
        return ""
    return channel[len(channel.rstrip("0123456789")) :]


def _rank(key: tuple[bool, str, str]) -> tuple[bool, int, int, str, str]:
    """Return the sorting key of an instrument: raw first, then preference, number and name."""
    processed, location, family = key
    order = PREFERENCE.index(family) if family in PREFERENCE else len(PREFERENCE)
    return processed, order, -int(family) if family.isdigit() else 0, family, location


def paired(instrument: Stream, overlap: float) -> tuple[Stream, tuple[Rejection, ...]]:
    """
    Return at most two horizontals of an instrument over their common time, and one vertical.

    The samples of the two horizontals share their times; clocks that differ by less than a sample
    are set to the later one, by ``stats.per_obspy.clock_shift``. The vertical stays as it is.

    Parameters
    ----------
    instrument : obspy Stream
        Oriented traces of one instrument.
    overlap : float
        Smallest part of the longer horizontal that both must cover, dimensionless; else the shorter
        one is rejected.

    Returns
    -------
    components : obspy Stream
    rejected : tuple of Rejection
        Components parallel to another, with another sampling, too short for their partner, or one
        too many.
    """
    # The longest horizontal first, verticals by name
    horizontals = [trace for trace in at_one_interval(instrument) if is_horizontal(trace)]
    horizontals.sort(key=lambda trace: (-_seconds(trace), trace.id))
    verticals = [trace for trace in instrument if not is_horizontal(trace)]
    verticals.sort(key=lambda trace: trace.id)
    rejected = [
        rejection(trace, f"a second vertical besides {verticals[0].id}") for trace in verticals[1:]
    ]
    # The first horizontal that fits the longest one joins it
    pair = Stream(horizontals[:1])
    for trace in horizontals[1:]:
        reasons = _conflicts(pair, trace, overlap)
        if reasons:
            rejected.append(rejection(trace, *reasons))
        else:
            pair += trace
    return _aligned(pair).sort() + Stream(verticals[:1]), tuple(rejected)


def _aligned(stream: Stream) -> Stream:
    """Return the common time of traces with equal sampling, at the times of the latest start."""
    latest = max((trace.stats.starttime for trace in stream), default=None)
    # Whole samples before the common time, and samples in it
    skips = [round((latest - trace.stats.starttime) / trace.stats.delta) for trace in stream]
    counts = [trace.stats.npts - skip for trace, skip in zip(stream, skips, strict=True)]
    count = min(counts, default=0)
    out = Stream()
    for trace, skip in zip(stream, skips, strict=True):
        part = copied_trace(trace)
        part.data = part.data[skip : skip + count]
        # A fraction of a sample remains between the clocks
        shift = latest - (trace.stats.starttime + skip * trace.stats.delta)
        part.stats.starttime = latest
        remembered(part, clock_shift=float(shift))
        out += part
    return out


def _seconds(trace: Trace) -> float:
    """Return the duration of a trace, s."""
    return float(trace.stats.npts * trace.stats.delta)


def _conflicts(pair: Stream, trace: Trace, overlap: float) -> list[str]:
    """Return the reasons for which a horizontal cannot join the first one."""
    partner = pair[0]
    if len(pair) > 1:
        return [f"a third horizontal besides {pair[0].id} and {pair[1].id}"]
    reasons = []
    own, other = trace.stats.delta, partner.stats.delta
    if not np.isclose(own, other, rtol=SAMPLING_TOLERANCE):
        reasons.append(f"sampled every {own:g} s, its partner {partner.id} every {other:g} s")
    # Two horizontals that are nearly parallel leave a direction unknown
    angle = _angle(partner, trace)
    if angle < SMALLEST_PAIR_ANGLE:
        needed = f"needs {SMALLEST_PAIR_ANGLE:g}"
        reasons.append(f"{angle:g} degrees from its partner {partner.id}, {needed}")
    # Common time against the duration of the partner, which is the longer one
    common, duration = _common_time(partner, trace), _seconds(partner)
    if common < overlap * (duration - other):
        shared = max(common, 0)
        reasons.append(f"shares {shared:.1f} s of the {duration:.1f} s of {partner.id}")
    return reasons


def _common_time(first: Trace, second: Trace) -> float:
    """Return the time that two traces share, s; negative if there is a gap between them."""
    start = max(first.stats.starttime, second.stats.starttime)
    return float(min(first.stats.endtime, second.stats.endtime) - start)


def _angle(first: Trace, second: Trace) -> float:
    """Return the acute angle between two horizontals, degrees; 90 if an azimuth is unknown."""
    if "sensor_azimuth" not in first.stats or "sensor_azimuth" not in second.stats:
        return UNKNOWN_ANGLE
    difference = abs(first.stats.sensor_azimuth - second.stats.sensor_azimuth) % 180.0
    return float(min(difference, 180.0 - difference))
