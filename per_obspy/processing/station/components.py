"""Components of a station: directions of sensors, instruments, pairs of horizontals."""

import re
from collections import defaultdict
from collections.abc import Iterable

import numpy as np
from obspy import Stream, Trace

from per_obspy.constants import (
    COMPASS_AZIMUTHS,
    HORIZONTAL_LETTERS,
    SEED_CODE,
    VERTICAL_DIP,
    VERTICAL_DIPS,
)
from per_obspy.errors import Rejection
from per_obspy.processing.notes import copied, copied_trace, is_processed, rejection, remembered
from per_obspy.processing.station.film_interval import at_one_interval

#: Band and instrument codes in order: accelerometers before velocity sensors, fast before slow.
PREFERENCE = ("HN", "BN", "HH", "BH")

#: Smallest angle between two horizontals that span the horizontal plane, degrees.
SMALLEST_PAIR_ANGLE = 30.0

#: Angle between two horizontals of which an azimuth is unknown, degrees.
UNKNOWN_ANGLE = 90.0

#: Relative difference of equal sampling rates: headers round to float32 or six digits. Reasoned;
#: libmseed joins records up to 1e-4.
SAMPLING_TOLERANCE = 1e-5

#: Largest relative difference of equal numbers of samples of components, and smallest of durations
#: that cannot both be right (reasoned).
SAME_LENGTH, OTHER_DURATION = 0.01, 0.05

AZIMUTH_CODE = re.compile(r"[0-3]?\d\d")


def oriented(stream: Iterable[Trace]) -> Stream:
    """
    Return a copy with the directions of sensors, from metadata or else from the channel code.

    Codes N, E, Z, NS, EW, UD and three digits (azimuth in degrees) give a direction; 1, 2, X, Y,
    L, T, H1, H2 do not, and such a trace without metadata stays without an azimuth. Unknown codes
    count as horizontal: `told_apart` refuses those that may be vertical.
    ``stats.per_obspy.azimuth_source`` is the source.
    """
    out = copied(stream)
    for trace in out:
        source = "metadata" if "sensor_azimuth" in trace.stats else "unknown"
        direction = direction_of(trace.stats.channel)
        # Dip of -90 degrees: the vertical points upwards
        trace.stats.setdefault("sensor_dip", VERTICAL_DIPS.get(direction, 0.0))
        if source == "unknown" and direction in COMPASS_AZIMUTHS:
            trace.stats.sensor_azimuth, source = COMPASS_AZIMUTHS[direction], "channel code"
        elif source == "unknown" and AZIMUTH_CODE.fullmatch(direction):
            trace.stats.sensor_azimuth, source = float(direction) % 360, "channel code"
        remembered(trace, azimuth_source=source)
    return out


def direction_of(channel: str) -> str:
    """
    Return the part of a channel code that is a direction, in capitals.

    U, V and W of SEED may be three inclined sensors, so that W is no west.

    >>> [direction_of(code) for code in ("HNE", "EW2", "H1", "090", "Tran", "HHW")]
    ['E', 'EW', 'H1', '090', 'TRAN', 'HHW']
    """
    code = channel.upper()
    if code in HORIZONTAL_LETTERS or code in VERTICAL_DIPS or AZIMUTH_CODE.fullmatch(code):
        return code
    if re.fullmatch(SEED_CODE, code):
        return code if code[-1] in "SW" else code[-1]
    return code.rstrip("0123456789") or code


def told_apart(instrument: Stream) -> tuple[Stream, tuple[Rejection, ...]]:
    """
    Return the components of an instrument whose directions can be told apart.

    Components that share an identity are refused. Without a vertical among them, so are those
    whose header, metadata and code are no direction: each may be the vertical. Of 1, 2 and 3, or
    U, V and W, none is known without metadata. A single component counts as horizontal.

    Parameters
    ----------
    instrument : obspy Stream
        Traces of one instrument, one for each component, not yet oriented.

    Returns
    -------
    components : obspy Stream
    rejected : tuple of Rejection
    """
    # Words of the header where it has any
    words = [str(trace.stats.get("direction", trace.stats.channel)) for trace in instrument]
    dips = _dips(instrument, words)
    has_vertical = any(dip is not None and abs(dip) >= VERTICAL_DIP for dip in dips)
    is_alone = len(instrument) == 1
    apart, rejected = Stream(), []
    for trace, word, dip in zip(instrument, words, dips, strict=True):
        # Identities of two, then directions that may be vertical
        same = [name for name, other in zip(words, instrument, strict=True) if other.id == trace.id]
        if len(same) > 1:
            reason = f"directions {', '.join(map(repr, sorted(same)))} cannot be told apart"
            rejected.append(rejection(trace, reason))
        elif dip is None and not has_vertical and not is_alone:
            reason = f"direction {word!r} is unknown and no component is vertical: it may be that"
            rejected.append(rejection(trace, reason))
        else:
            apart += trace
    return apart, tuple(rejected)


def _dips(instrument: Stream, words: list[str]) -> list[float | None]:
    """Return the dips by header, metadata or code, degrees; None where none of them has it."""
    codes = set(map(direction_of, words))
    unclear = {"1", "2", "3"} if codes & {"0", "3"} else set[str]()
    if any(len(code) == 3 and code.endswith("W") for code in codes):
        unclear |= {"U", "V"}
    return [_dip(trace, unclear) for trace in instrument]


def _dip(trace: Trace, unclear: set[str]) -> float | None:
    """Return the dip by header, metadata or code, degrees; None where none of them has it."""
    stats = trace.stats
    if "sensor_dip" in stats:
        return float(stats.sensor_dip)
    # Where the header has a word, the letter of the channel may be a number
    direction = direction_of(str(stats.get("direction", stats.channel)))
    if "sensor_azimuth" in stats or direction in COMPASS_AZIMUTHS:
        return 0.0
    if direction in unclear:
        return None
    is_horizontal = direction in HORIZONTAL_LETTERS or AZIMUTH_CODE.fullmatch(direction)
    return VERTICAL_DIPS.get(direction, 0.0 if is_horizontal else None)


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
    """Return band and instrument of a SEED code, or the number at the end of EW1, NS2, UD2."""
    code = channel.upper()
    words = {*COMPASS_AZIMUTHS, *VERTICAL_DIPS, *HORIZONTAL_LETTERS}
    # Readers leave out the letter of an unknown direction
    if re.fullmatch(SEED_CODE, code) or (code not in words and re.fullmatch(SEED_CODE, f"{code}Z")):
        return code[:2]
    # H1 and H2, or 1 and 2, are components, and 090 is an azimuth
    letters = code.rstrip("0123456789")
    is_numbered = letters in COMPASS_AZIMUTHS or letters in VERTICAL_DIPS
    return code[len(letters) :] if is_numbered else ""


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
        Components parallel to another, with another sampling or a wrong one, too short for their
        partner, or one too many.
    """
    rejected = _wrongly_sampled(instrument)
    wrong = {row.name for row in rejected}
    sampled = Stream([trace for trace in instrument if trace.id not in wrong])
    # The longest horizontal of the rate that most share first, verticals by name
    horizontals = [trace for trace in at_one_interval(sampled) if is_horizontal(trace)]
    horizontals.sort(key=lambda one: (-_sharing(one, sampled), -_seconds(one), one.id))
    verticals = [trace for trace in sampled if not is_horizontal(trace)]
    verticals.sort(key=lambda trace: trace.id)
    rejected += [
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


def same_rate(first: Trace, second: Trace) -> bool:
    """Return whether two traces have the same sampling rate but for the rounding of headers."""
    rates = first.stats.sampling_rate, second.stats.sampling_rate
    return bool(np.isclose(*rates, rtol=SAMPLING_TOLERANCE, atol=0))


def _wrongly_sampled(instrument: Stream) -> list[Rejection]:
    """
    Return the rows of components with as many samples as others over another duration.

    The rate that most components share is right. Where as many components have another one, none
    can say which is wrong, and all of them are. Film has an interval for each component.
    """
    # Each against those of another rate
    rejected = []
    recorded = [trace for trace in instrument if not trace.stats.get("digitised")]
    for trace in recorded:
        others = [other for other in recorded if not same_rate(trace, other)]
        contradicting = [other for other in others if _contradicting(trace, other)]
        # More agree with the other rate, or as many do
        agreeing = len(recorded) - len(others)
        decisive = max((_sharing(other, recorded) for other in contradicting), default=0)
        if decisive >= agreeing:
            other = max(contradicting, key=lambda one: (_sharing(one, recorded), one.id))
            reason = (
                f"sampled every {trace.stats.delta:g} s, {other.id} every {other.stats.delta:g} s "
                f"with as many samples: {'one' if decisive == agreeing else 'this'} rate is wrong"
            )
            rejected.append(rejection(trace, reason))
    return rejected


def _sharing(trace: Trace, components: Iterable[Trace]) -> int:
    """Return the number of components with the rate of one of them, itself included."""
    return sum(same_rate(trace, other) for other in components)


def _contradicting(first: Trace, second: Trace) -> bool:
    """Return whether two traces have as many samples over different durations."""
    counts, seconds = (first.stats.npts, second.stats.npts), (_seconds(first), _seconds(second))
    are_many = np.isclose(*counts, rtol=SAME_LENGTH, atol=0)
    return bool(are_many and not np.isclose(*seconds, rtol=OTHER_DURATION, atol=0))


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
    if not same_rate(partner, trace):
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
