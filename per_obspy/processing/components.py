"""Components of a station: structures, instruments, directions of sensors, pairs of horizontals."""

import re
from collections import defaultdict
from collections.abc import Iterable
from functools import partial
from itertools import filterfalse

import numpy as np
from obspy import Stream, Trace

from per_obspy.constants import (
    COMPASS_AZIMUTHS,
    HORIZONTAL_LETTERS,
    SEED_CODE,
    VERTICAL_DIP,
    VERTICAL_DIPS,
)
from per_obspy.errors import RecordRejected, Rejection
from per_obspy.processing.account import is_processed, rejection, survivors, with_note, with_numbers

#: Words of a sensor's place that mean a structure, in the singular, in capitals.
STRUCTURE_WORDS = (
    "ABUTMENT", "ATTIC", "BASEMENT", "BENT", "BLDG", "BSMT", "BUILDING", "CABLE", "COLUMN", "CREST",
    "DAM", "DECK", "FLOOR", "FLR", "FOOTING", "FOUNDATION", "GALLERY", "GIRDER", "PENTHOUSE",
    "PIER", "PILE", "PYLON", "ROOF", "STORY", "TOWER", "WALL",
)  # fmt: skip
STRUCTURE = re.compile(rf"\b({'|'.join(STRUCTURE_WORDS)})S?\b")
FREE_FIELD = re.compile(r"\bFREE[ -]?FIELD\b")

#: Band and instrument codes in order: accelerometers before velocity sensors, fast before slow.
PREFERENCE = ("HN", "BN", "HH", "BH")

#: Smallest angle between two horizontals that span the horizontal plane, degrees.
SMALLEST_PAIR_ANGLE = 30.0

#: Relative difference of equal sampling rates: headers round to float32 or six digits. Reasoned;
#: libmseed joins records up to 1e-4.
SAMPLING_TOLERANCE = 1e-5

#: Largest relative difference of equal numbers of samples of components, and smallest of durations
#: that cannot both be right (reasoned).
SAME_LENGTH, OTHER_DURATION = 0.01, 0.05

AZIMUTH_CODE = re.compile(r"[0-3]?\d\d")


def in_structure(trace: Trace) -> bool:
    """
    Return whether the header puts the sensor, by its ``sensor_location``, into a structure.

    The station's name does not count: a free-field sensor near a bridge has the bridge's name.

    Examples
    --------
    >>> places = ("Roof: Center", "Freefield", "Ground")
    >>> [in_structure(Trace(header={"sensor_location": place})) for place in places]
    [True, False, False]
    """
    place = str(trace.stats.get("sensor_location", "")).upper()
    return bool(STRUCTURE.search(place)) and not FREE_FIELD.search(place)


def split_structures(stream: Iterable[Trace]) -> tuple[Stream, Stream]:
    """Separate the traces of a station that recorded the ground from those in a structure."""
    ground, structure = Stream(), Stream()
    for trace in stream:
        place = structure if in_structure(trace) else ground
        place.append(trace)
    return ground, structure


def instruments(stream: Iterable[Trace]) -> list[Stream]:
    """
    Return the traces of each instrument of a station, the preferred instrument first.

    An instrument is a location code with a band and instrument code (SEED), or with the number at
    the end of other codes (KiK-net: EW1 in the borehole, EW2 at the surface). Order: HN, BN, HH,
    BH, then the rest by name; of numbered instruments the highest, which is the surface. A record
    that exists raw and processed by others counts as two instruments, the raw one first: its
    corners will be known.
    """
    # By the order of the instruments
    groups: dict[tuple[bool, int, int, str, str], Stream] = defaultdict(Stream)
    for trace in stream:
        family = _family(trace.stats.channel)
        order = PREFERENCE.index(family) if family in PREFERENCE else len(PREFERENCE)
        number = int(family) if family.isdigit() else 0
        groups[is_processed(trace), order, -number, family, trace.stats.location] += trace
    return [groups[key] for key in sorted(groups)]


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


def tell_apart(instrument: Stream) -> tuple[Stream, tuple[Rejection, ...]]:
    """
    Return the components of an instrument whose directions can be told apart, not yet oriented.

    Components that share an identity are refused. Without a vertical among them, so are those
    whose header, metadata and code are no direction: each may be the vertical. Of 1, 2 and 3, or
    U, V and W, none is known without metadata. A single component counts as horizontal.
    """
    # Words of the header where it has any, else of the channel
    words = list(map(_word, instrument))
    dips = _dips(instrument, set(map(direction_of, words)))
    may_be_vertical = len(instrument) > 1 and not any(
        abs(dip or 0.0) >= VERTICAL_DIP for dip in dips
    )
    apart, rejected = Stream(), []
    for trace, word, dip in zip(instrument, words, dips, strict=True):
        # Identities of two, then directions that may be vertical
        same = [name for name, other in zip(words, instrument, strict=True) if other.id == trace.id]
        if len(same) > 1:
            reason = f"directions {', '.join(map(repr, sorted(same)))} cannot be told apart"
            rejected.append(rejection(trace, reason))
        elif dip is None and may_be_vertical:
            reason = f"direction {word!r} is unknown and no component is vertical: it may be that"
            rejected.append(rejection(trace, reason))
        else:
            apart += trace
    return apart, tuple(rejected)


def _word(trace: Trace) -> str:
    """Return the direction in the header, else the channel: its letter may be a number of both."""
    return str(trace.stats.get("direction", trace.stats.channel))


def _dips(instrument: Stream, codes: set[str]) -> list[float | None]:
    """Return the dips by header, metadata or code, degrees; None where none of them has it."""
    unclear = {"1", "2", "3"} if codes & {"0", "3"} else set[str]()
    if any(len(code) == 3 and code.endswith("W") for code in codes):
        unclear |= {"U", "V"}
    dips = list[float | None]()
    for trace in instrument:
        direction = direction_of(_word(trace))
        is_level = direction in HORIZONTAL_LETTERS or AZIMUTH_CODE.fullmatch(direction)
        # Metadata before the compass, and that before words that may mean either
        if "sensor_dip" in trace.stats:
            dips.append(float(trace.stats.sensor_dip))
        elif "sensor_azimuth" in trace.stats or direction in COMPASS_AZIMUTHS:
            dips.append(0.0)
        elif direction in unclear:
            dips.append(None)
        else:
            dips.append(VERTICAL_DIPS.get(direction, 0.0 if is_level else None))
    return dips


def orient(trace: Trace) -> Trace:
    """
    Return a copy with the direction of its sensor, from metadata or else from the channel code.

    Codes N, E, Z, NS, EW, UD and three digits (azimuth in degrees) give a direction; 1, 2, X, Y,
    L, T, H1, H2 do not, and such a trace without metadata stays without an azimuth. Unknown codes
    count as horizontal: `tell_apart` refuses those that may be vertical.
    ``stats.per_obspy.azimuth_source`` is the source.
    """
    direction, azimuth = direction_of(trace.stats.channel), None
    if "sensor_azimuth" not in trace.stats:
        azimuth = COMPASS_AZIMUTHS.get(direction)
        if azimuth is None and AZIMUTH_CODE.fullmatch(direction):
            azimuth = float(direction) % 360
    source = "channel code" if azimuth is not None else "unknown"
    out = with_numbers(
        trace, azimuth_source="metadata" if "sensor_azimuth" in trace.stats else source
    )
    # Dip of -90 degrees: the vertical points upwards
    out.stats.setdefault("sensor_dip", VERTICAL_DIPS.get(direction, 0.0))
    if azimuth is not None:
        out.stats.sensor_azimuth = azimuth
    return out


def is_horizontal(trace: Trace) -> bool:
    """Return whether an oriented trace is a horizontal component."""
    return bool(abs(trace.stats.sensor_dip) < VERTICAL_DIP)


def paired(instrument: Iterable[Trace], overlap: float) -> tuple[Stream, tuple[Rejection, ...]]:
    """
    Return at most two horizontals of an instrument over their common time, and one vertical.

    The samples of the two horizontals share their times; clocks that differ by less than a sample
    are set to the later one, by ``stats.per_obspy.clock_shift``. The vertical stays as it is. Both
    horizontals must cover a share of the longer one, ``overlap``. Rejected are components parallel
    to another, with another sampling or a wrong one, too short for their partner, or one too many.
    """
    components = list(instrument)
    sampled, wrong = survivors(partial(_require_rate, instrument=components), components)
    # The longest horizontal of the rate that most share first, verticals by name
    horizontals = list(filter(is_horizontal, at_one_interval(sampled)))
    horizontals.sort(key=lambda one: (-_sharing(one, sampled), -_seconds(one), one.id))
    verticals = list(filterfalse(is_horizontal, sampled))
    verticals.sort(key=lambda trace: trace.id)
    reason = f"a second vertical besides {verticals[0].id}" if verticals else ""
    rejected = [*wrong, *(rejection(trace, reason) for trace in verticals[1:])]
    # The first horizontal that fits the longest one joins it
    pair = horizontals[:1]
    for trace in horizontals[1:]:
        reasons = _conflicts(pair, trace, overlap)
        if reasons:
            rejected.append(rejection(trace, *reasons))
        else:
            pair.append(trace)
    return align(pair).sort() + Stream(verticals[:1]), tuple(rejected)


def at_one_interval(components: Iterable[Trace]) -> Stream:
    """
    Return traces of an instrument whose digitised ones share the smallest of their intervals.

    Every component of a film is digitised separately, so that mean intervals differ by some parts
    in a hundred thousand, or more where operators chose the points. Those with a longer interval
    are interpolated linearly, with a note; all else stays as it is.

    Examples
    --------
    >>> film = {"digitised": True}
    >>> fine, coarse = Trace(np.arange(5.0), film | {"delta": 0.01}), Trace(np.arange(3.0), film)
    >>> coarse.stats.delta = 0.02
    >>> at_one_interval([fine, coarse])[1].data
    array([0. , 0.5, 1. , 1.5, 2. ])
    """
    # Film of a longer interval than the shortest
    out = Stream(list(components))
    film = [trace.stats.delta for trace in out if trace.stats.get("digitised")]
    for place, trace in enumerate(out):
        if not trace.stats.get("digitised") or trace.stats.delta == min(film):
            continue
        # Times from the first sample, s, old and new
        dt, old = min(film), trace.stats.delta * np.arange(trace.stats.npts)
        new = dt * np.arange(int(old[-1] / dt + 1e-6) + 1)
        step = f"film interpolated from {trace.stats.delta:.9g} s to {dt:.9g} s, its partner's"
        out[place] = with_note(trace, step, np.interp(new, old, trace.data))
        out[place].stats.delta = dt
    return out


def same_rate(first: Trace, second: Trace) -> bool:
    """Return whether two traces have the same sampling rate but for the rounding of headers."""
    rates = first.stats.sampling_rate, second.stats.sampling_rate
    return bool(np.isclose(*rates, rtol=SAMPLING_TOLERANCE, atol=0))


def _seconds(trace: Trace) -> float:
    """Return the duration of a trace, s."""
    return float(trace.stats.npts * trace.stats.delta)


def _sharing(trace: Trace, components: Iterable[Trace]) -> int:
    """Return the number of components with the rate of one of them, itself included."""
    return sum(same_rate(trace, other) for other in components)


def _require_rate(trace: Trace, instrument: list[Trace]) -> Trace:
    """
    Reject a component whose rate contradicts that of others.

    The rate that most components share is right, where one has as many samples as another over
    another duration. Where as many components have another one, none can say which is wrong, and
    all of them are. Film has an interval for each component.
    """
    recorded = [other for other in instrument if not other.stats.get("digitised")]
    contradicting = [other for other in recorded if _contradict(trace, other)]
    votes = {(_sharing(other, recorded), other.id): other for other in contradicting}
    # More agree with the other rate, or as many do
    agreeing = _sharing(trace, recorded)
    most, name = max(votes, default=(0, ""))
    if votes and most >= agreeing:
        interval, which = votes[most, name].stats.delta, "one" if most == agreeing else "this"
        raise RecordRejected(
            trace.id,
            f"sampled every {trace.stats.delta:g} s, {name} every {interval:g} s "
            f"with as many samples: {which} rate is wrong",
        )
    return trace


def _contradict(first: Trace, second: Trace) -> bool:
    """Return whether traces of different rates have as many samples: not both can be right."""
    if first.stats.get("digitised") or same_rate(first, second):
        return False
    counts, seconds = (first.stats.npts, second.stats.npts), (_seconds(first), _seconds(second))
    are_many = np.isclose(*counts, rtol=SAME_LENGTH, atol=0)
    return bool(are_many and not np.isclose(*seconds, rtol=OTHER_DURATION, atol=0))


def _conflicts(pair: list[Trace], trace: Trace, overlap: float) -> list[str]:
    """Return the reasons for which a horizontal cannot join the first one."""
    if len(pair) > 1:
        return [f"a third horizontal besides {pair[0].id} and {pair[1].id}"]
    reasons, partner = [], pair[0]
    own, other = trace.stats, partner.stats
    if not same_rate(partner, trace):
        reasons.append(
            f"sampled every {own.delta:g} s, its partner {partner.id} every {other.delta:g} s"
        )
    # Two horizontals that are nearly parallel leave a direction unknown
    angle = _angle(partner, trace)
    if angle is not None and angle < SMALLEST_PAIR_ANGLE:
        needed = f"needs {SMALLEST_PAIR_ANGLE:g}"
        reasons.append(f"{angle:g} degrees from its partner {partner.id}, {needed}")
    # Common time against the duration of the partner, which is the longer one
    common, duration = _common_time(partner, trace), _seconds(partner)
    if common < overlap * (duration - other.delta):
        reasons.append(f"shares {max(common, 0):.1f} s of the {duration:.1f} s of {partner.id}")
    return reasons


def _common_time(first: Trace, second: Trace) -> float:
    """Return the time that two traces share, s; negative if there is a gap between them."""
    start = max(first.stats.starttime, second.stats.starttime)
    return float(min(first.stats.endtime, second.stats.endtime) - start)


def _angle(first: Trace, second: Trace) -> float | None:
    """Return the acute angle between two horizontals, degrees; None if an azimuth is unknown."""
    azimuths = [trace.stats.get("sensor_azimuth") for trace in (first, second)]
    if None in azimuths:
        return None
    difference = abs(azimuths[0] - azimuths[1]) % 180.0
    return float(min(difference, 180.0 - difference))


def align(components: Iterable[Trace]) -> Stream:
    """Return the common time of traces with equal sampling, at the times of the latest start."""
    traces = list(components)
    latest = max((trace.stats.starttime for trace in traces), default=None)
    # Whole samples before the common time, and samples in it
    skips = [round((latest - trace.stats.starttime) / trace.stats.delta) for trace in traces]
    lengths = [trace.stats.npts - skip for trace, skip in zip(traces, skips, strict=True)]
    count = min(lengths, default=0)
    out = Stream()
    for trace, skip in zip(traces, skips, strict=True):
        # A fraction of a sample remains between the clocks
        shift = latest - (trace.stats.starttime + skip * trace.stats.delta)
        part = with_numbers(trace, clock_shift=float(shift))
        part.data, part.stats.starttime = part.data[skip : skip + count], latest
        out += part
    return out
