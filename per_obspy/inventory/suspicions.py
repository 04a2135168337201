"""
Values of a pair table that are possible but odd: in one row, in a whole column, in several rows.

One account of the rows, :class:`Suspicions`, decides for every command. It reads raw rows, before
any is rejected, in chunks of any size; its sentences do not depend on the size.
"""

from collections import Counter
from collections.abc import Callable, Iterable, Iterator
from functools import partial
from itertools import chain, product
from typing import NamedTuple

import numpy as np
import pyarrow as pa
from numpy.typing import NDArray

from per_obspy.checks import FloatArray
from per_obspy.inventory.earlier_rows import EarlierRows
from per_obspy.inventory.quantities import PairRows, Rows
from per_obspy.inventory.schema import COLUMNS, ROW_SUSPICIONS
from per_obspy.inventory.table_columns import joined_names

#: Column of the names of a row's suspicions, which become flags of the risk table.
ODD = "odd_values"

#: Rows that are looked at together: their numbers stay in the processor's cache.
BLOCK = 1 << 14

#: Neighbours are sought within about this gap, m: if most gaps are wider, the unit is another one.
WIDE_GAP = 3.0

#: No number of another unit, as infinite strength is none.
LARGEST = 1e9

#: Fewest values that suggest another unit by being round, or by none of them being small.
FEWEST = 5

#: Positions closer than this give no reliable direction, m.
LINE = 2.0

#: Height of a storey, m, where either height or storeys are unknown; only few towers are higher.
STOREY, TOWER = 3.0, 300.0

#: Period of frames, s: 0.0466 h**0.9 (ASCE 7-16, table 12.8-2, concrete frames, h in m).
FRAME_PERIOD, FRAME_EXPONENT = 0.0466, 0.9

#: Centres of neighbours lie closer than this, m, unless areas show larger buildings; and equal
#: positions, m. In San José and Guatemala City centres of pairs are 3.6 to 94 m apart, and less
#: than 1.2 times the sum of the roots of both areas within a gap of 3 m.
FAR_APART, PER_ROOT_AREA, SMALLEST_FAR = 150.0, 2.0, 60.0
SAME_PLACE = 0.5

#: Angle between azimuth and the line between the positions, degrees: of 2 839 pairs of San José and
#: Guatemala City 0.2 % exceed 75, the largest is 82.
ACROSS, FITS = 85.0, 45.0

#: Azimuths that are at most a circle in radians, to two decimals.
CIRCLE = 2.0 * np.pi + 0.01

#: A storey is never as high in buildings of two and more, m, but 10 ft are.
HIGH_STOREY = 6.5

#: Heights of a table in feet: hardly any below this, most above that, m, and slender ones: height
#: over distance of the centres. Reasoned: 8 ft are the least of a house, 25 m are 8 storeys.
LOWEST_FEET, HIGH_FEET, SLENDER = 7.5, 25.0, 1.5

#: Factors of the period of frames beyond which a row and a table are odd: stiff masonry has 0.3,
#: base isolation 6 times it.
ODD_PERIOD, SHORT_PERIOD = 6.0, 0.3

#: Mass of a storey, kg: one of 30 m2 and 300 kg/m2 has 9 t, one of 10 000 m2 and 2 t/m2 2e7 kg.
STOREY_MASS = (1e4, 2e7)

#: Centres of squares of equal area are 0.5 of the sum of the roots of their areas apart, in
#: San José 0.23 or more; areas in square feet, or of all storeys, make less.
CLOSE_FOR_AREA = 0.17

#: Pairs on the other side of the Earth's axes: their share of those at the mirrored place at most,
#: and the distance at least, degrees.
FEW_MIRRORED, MIRROR = 0.25, 3

#: Quantities of a building that are possible but odd above a limit.
HIGH = (("damping", 0.3), ("yield_coefficient", 1.0), ("participation", 2.0))

#: Column, limit and unit: that unit is suspected where more than half of the numbers above 0 exceed
#: the limit. Of each column the last one that holds.
LIMITS = (
    ("gap", WIDE_GAP, "cm"), ("gap", 100.0, "mm"), ("gap_std", 0.5, "cm"),
    ("height", TOWER, "cm"), ("height", 5000.0, "mm"), ("contact_height", TOWER, "cm"),
    ("period", 20.0, "ms"), ("damping", 0.3, "%"), ("restitution", 1.0, "%"),
    ("participation", 3.0, "%"), ("yield_coefficient", 1.0, "%"),
    ("yield_displacement", 2.0, "cm"), ("facing_length", TOWER, "cm"),
    ("floor_offset", 12.0, "cm"),
)  # fmt: skip

_UNIT_WORDS = {"cm": "centimetres", "mm": "millimetres", "ms": "milliseconds", "%": "per cent"}

#: What another row may say otherwise of a building, and the columns that say it.
_SEEN_IN = {
    "height": ("height",),
    "number of storeys": ("storeys",),
    "period": ("period",),
    "system": ("system",),
    "place": ("longitude", "latitude"),
}

#: Rows that are odd by themselves, in the order of :func:`_odd_rows`: the flag; the subject of a
#: sentence on a column that explains them, so that they have none of their own; the reason; columns
#: to quote of the first one. # is the number of the building.
_CORNERS = "longitude_1 latitude_1 longitude_2 latitude_2"
_OF_PAIRS = (
    ("odd_gap", "gaps", f"a gap above {WIDE_GAP:g} m, in another unit?", "gap"),
    ("odd_gap", "gap_std", "gap_std is larger than gap", "gap gap_std"),
    ("odd_gap", "gaps", "the gap is wider than the positions are apart", "gap"),
    ("odd_positions", "", "both buildings at one position", "longitude_1 latitude_1"),
    ("odd_positions", "", "positions too far apart for the gap", f"{_CORNERS} gap"),
    ("odd_azimuth", "azimuths", "the azimuth is across or against the line between the positions",
     f"azimuth {_CORNERS}"),
)  # fmt: skip
_OF_BUILDINGS = (
    ("odd_height", "height_#", f"height_# above {TOWER:g} m", "height_#"),
    ("odd_height", "", "storeys_# with decimals", "storeys_#"),
    ("odd_height", "heights", f"height_# makes floors above {HIGH_STOREY:g} m, in feet?",
     "height_# storeys_#"),
    ("odd_period", "periods", "period_# does not fit the height", "period_# height_# storeys_#"),
    *(("odd_building", f"{name}_#", f"{name}_# above {limit:g}", f"{name}_#")
      for name, limit in HIGH),
    ("odd_building", "masses", "mass_# is odd for its storeys", "mass_#"),
    ("odd_building", "yield_displacement_#", "yield_displacement_# above 5 % of the height",
     "yield_displacement_#"),
)  # fmt: skip
_OF_CONTACTS = (
    ("odd_height", "contact_height", "contact_height above the lower roof",
     "contact_height storeys_1 storeys_2"),
    ("odd_height", "floor_offset", "floor_offset above half a storey", "floor_offset"),
)  # fmt: skip
_ROW_RULES = (
    *_OF_PAIRS,
    *(
        (flag, subject.replace("#", i), reason.replace("#", i), columns.replace("#", i))
        for i, (flag, subject, reason, columns) in product("12", _OF_BUILDINGS)
    ),
    *_OF_CONTACTS,
)

_INT_MAX = np.iinfo(np.int64).max
_Mask = NDArray[np.bool_]


class _Finding(NamedTuple):
    """A suspicion of a column: what it is about, and units that would make it plausible."""

    subject: str
    #: Empty where another finding says it.
    sentence: str
    units: tuple[tuple[str, str], ...] = ()


class Suspicions:
    """
    Account of what is odd in the rows of an inventory.

    Memory: 16 bytes per pair that is not repeated, and 16 per building where buildings have
    identifiers.

    Examples
    --------
    >>> account = Suspicions()
    >>> rows = pa.table({"gap": [5.0, 8.0, 7.0], "pair_id": ["a", "b", "c"]})
    >>> account.add("pairs.csv", rows, np.arange(2, 5), np.zeros(3, bool))[0]
    'odd_gap'
    >>> account.sentences()
    ['3 of 3 gaps above 0 are wider than 3 m: given in centimetres or millimetres?']
    """

    def __init__(self) -> None:
        self._files: dict[str, _FileAccount] = {}
        self._earlier = EarlierRows()

    def add(
        self, source: str, table: pa.Table, lines: NDArray[np.int64], repeated: NDArray[np.bool_]
    ) -> NDArray[np.object_]:
        """
        Add rows to the account and return the names of each row's suspicions.

        Parameters
        ----------
        source : str
            File of the rows.
        table : Table
            Raw rows with numbers in the units of the schema.
        lines : (n_rows,) ndarray of int
            Of the rows in the file.
        repeated : (n_rows,) ndarray of bool
            Rows that are rejected because an earlier row has their ``pair_id``: their buildings are
            not compared.

        Returns
        -------
        names : (n_rows,) ndarray of object
            Names of :data:`ROW_SUSPICIONS`, separated by blanks; empty for most rows.
        """
        account = self._files.setdefault(source, _FileAccount())
        flags = {name: np.zeros(len(table), dtype=bool) for name in ROW_SUSPICIONS}
        comparable = ~repeated
        # Numbers of any size are possible in raw rows
        with np.errstate(all="ignore"):
            for start in range(0, len(table), BLOCK):
                here, pair = slice(start, start + BLOCK), PairRows(table.slice(start, BLOCK))
                account.add(pair, lines[here], {name: flags[name][here] for name in flags})
                comparable[here] &= ~np.isnan(pair.distance)
            if len(table):
                self._compare(account, PairRows(table), comparable, lines, flags)
        return joined_names(flags)

    def _compare(
        self,
        account: "_FileAccount",
        pair: PairRows,
        comparable: _Mask,
        lines: NDArray[np.int64],
        flags: dict[str, _Mask],
    ) -> None:
        """Add rows with a pair or a building that an earlier row has."""
        again, earlier, otherwise = self._earlier.compare(pair, comparable, lines)
        flags["repeated_pair"][again] = True
        # Reasons without rows too, so that sentences have an order
        reason = "the same two buildings as in an earlier row"
        account.add_odd("", reason, again, lines, lambda _: f"as line {earlier[0]}")
        # Each difference of either building, with the columns of the first one
        for name, columns in _SEEN_IN.items():
            places = otherwise.get(name, np.empty(0, dtype=np.intp))
            rows = np.flatnonzero(np.bincount(places // 2))
            flags["contradicting_building"][rows] = True
            side = int(places[0] % 2) + 1 if places.size else 1
            quoted = [f"{column}_{side}" for column in ("building_id", *columns)]
            reason = f"a building_id with another {name} than in an earlier row"
            account.add_odd("", reason, rows, lines, partial(_quoted, pair.table, quoted))

    def sentences(self) -> list[str]:
        """Return a sentence per suspicion, with the file's name where there are several."""
        names = {source: source.replace("\\", "/").rpartition("/")[2] for source in self._files}
        return [
            f"{names[source]}: {sentence}" if len(names) > 1 else sentence
            for source, account in self._files.items()
            for sentence in account.sentences()
        ]

    def units(self) -> dict[str, str]:
        """Return units that would make the numbers plausible, by column."""
        units: dict[str, str] = {}
        for account in self._files.values():
            # Of several units of one file the first one: those by limits are more certain
            own = dict[str, str]()
            for name, unit in chain.from_iterable(one.units for one in account.findings()):
                own.setdefault(name, unit)
            units |= own
        return units


class _FileAccount:
    """What is counted in the rows of one file."""

    def __init__(self) -> None:
        self.rows = 0
        # Odd rows by subject and reason: their number, and the first as text
        self._odd = Counter[tuple[str, str]]()
        self._first: dict[tuple[str, str], str] = {}
        # Numbers of columns by what they are, and those above the limits
        self._count = Counter[str]()
        self._limits = Counter[tuple[str, float, float]]()
        # Kinds of inches that gaps are
        self._inches = np.zeros(121, dtype=bool)
        self._is_drawn = False
        # Pairs by degrees of longitude and latitude, and the first line of each
        self._cells = np.zeros(360 * 180, dtype=np.int64)
        self._cell_line = np.full(360 * 180, _INT_MAX)

    def add(self, pair: PairRows, lines: NDArray[np.int64], flags: dict[str, _Mask]) -> None:
        """Add a block of rows, and set the flags of those that are odd by themselves."""
        self.rows += len(lines)
        # Single rows
        for rule, is_odd in zip(_ROW_RULES, _odd_rows(pair), strict=True):
            flag, subject, reason, columns = rule
            flags[flag] |= is_odd
            example = partial(_quoted, pair.table, [*filter(pair.has, columns.split())])
            self.add_odd(subject, reason, np.flatnonzero(is_odd), lines, example)
        # Whole columns, of both buildings together
        kinds = [_kinds_of_gaps(pair), _kinds_of_places(pair)]
        for one in pair.buildings:
            kinds += [_kinds_of_sizes(one, pair.distance), _kinds_of_periods(one)]
        for name, mask in chain.from_iterable(kind.items() for kind in kinds):
            self._count[name] += int(np.count_nonzero(mask))
        self._add_limits(pair)
        self._add_gaps(pair)
        self._add_cells(pair, lines)

    def add_odd(
        self,
        subject: str,
        reason: str,
        odd: NDArray[np.intp],
        lines: NDArray[np.int64],
        example: Callable[[int], str],
    ) -> None:
        """Add rows that are odd for a reason, or none, with an example of the first."""
        self._odd[subject, reason] += odd.size
        # Later blocks do not change the first one
        if odd.size and (subject, reason) not in self._first:
            first = f"first in line {lines[odd[0]]}: {example(int(odd[0]))}"
            self._first[subject, reason] = first

    def _add_limits(self, pair: PairRows) -> None:
        """Add the numbers above limits, and those above 0."""
        # Of the pair and of both buildings
        for (column, limit, _), rows in product(LIMITS, (pair, *pair.buildings)):
            for least in (limit, 0.0) if rows.has(column) else ():
                number = np.abs(getattr(rows, column))
                above = np.count_nonzero((number < LARGEST) & (number > least))
                self._limits[column + rows.suffix, limit, least] += int(above)

    def _add_gaps(self, pair: PairRows) -> None:
        """Add what kinds of inches the gaps are; quarters are twelfths too, and no evidence."""
        self._is_drawn |= pair.has("gap_std_source")
        inches = _inches(pair.gap[pair.gap > 0.0])
        self._inches[inches[(inches <= 120.0) & (inches % 3.0 > 0.0)].astype(np.intp)] = True

    def _add_cells(self, pair: PairRows, lines: NDArray[np.int64]) -> None:
        """Add the pairs of each cell of one degree."""
        valid, first = ~np.isnan(pair.distance), pair.buildings[0]
        # The last cells have both of their edges
        east = np.minimum(np.floor(first.longitude[valid]) + 180.0, 359.0)
        north = np.minimum(np.floor(first.latitude[valid]) + 90.0, 179.0)
        cell = (east * 180.0 + north).astype(np.intp)
        self._cells += np.bincount(cell, minlength=360 * 180)
        np.minimum.at(self._cell_line, cell, lines[valid])

    def findings(self) -> list[_Finding]:
        """Return the suspicions of columns, in the order of their sentences."""
        n = self._count
        # Outlines have whatever gap was asked for, with decimals
        is_drawn = self._is_drawn and n["whole"] < n["gaps"]
        gaps = _gap_rules(n, is_drawn, int(self._inches.sum()) >= 3)
        rules = [*gaps, *_size_rules(n), *_other_rules(n)]
        # Of each group the first rule that holds
        by_group = dict[str, _Finding]()
        for group, subject, is_odd, sentence, units in rules:
            if is_odd and group not in by_group:
                by_group[group] = _Finding(subject, sentence.format_map(n), units)
        of_gaps = [by_group.pop("gap")] if "gap" in by_group else []
        limits = self._by_limits(is_drawn)
        return [*of_gaps, *limits, *by_group.values(), *_astray_azimuths(n)]

    def _by_limits(self, is_drawn: bool) -> Iterable[_Finding]:
        """Return the columns that mostly exceed a limit; the gaps without a sentence."""
        findings = dict[str, _Finding]()
        # More than half of those above 0; of several limits the last one
        for (column, limit, unit), suffix in product(LIMITS, ("", "_1", "_2")):
            name = column + suffix
            # With the unit of the column
            above, every = (self._limits[name, limit, least] for least in (limit, 0.0))
            if 2 * above > every and not (name == "gap" and is_drawn):
                of = f"{above} of {every} above {limit:g} {COLUMNS[name].unit.replace('1', '')}"
                sentence = f"{name}: {of.strip()}: given in {_UNIT_WORDS[unit]}?"
                said = "" if name == "gap" else sentence
                findings[name] = _Finding(name, said, ((name, unit),))
        return findings.values()

    def sentences(self) -> list[str]:
        """Return a sentence per suspicion, of columns first: their rows are not repeated."""
        findings = self.findings()
        explained = {finding.subject for finding in findings}
        rows = [
            f"{reason}: {count} of {self.rows} rows, {self._first[subject, reason]}"
            for (subject, reason), count in self._odd.items()
            if count and subject not in explained
        ]
        # Gaps above a limit are said by their own rule
        of_columns = [finding.sentence for finding in findings if finding.sentence]
        return [*of_columns, *self._mirrored(), *rows]

    def _mirrored(self) -> Iterator[str]:
        """Yield a sentence per way in which few pairs mirror the place of many."""
        cells = np.flatnonzero(self._cells)
        east, north = cells // 180 - 180, cells % 180 - 90
        here = self._around(east, north)
        # Cells of the other side: from -n to 1 - n, whose lower edge is -n
        ways = {
            "longitude has lost its sign": (-east - 1, north),
            "latitude has lost its sign": (east, -north - 1),
            "both have lost their sign": (-east - 1, -north - 1),
            "longitude and latitude are exchanged": (north, east),
        }
        for way, (to_east, to_north) in ways.items():
            # Next to the Greenwich meridian and the equator both sides may be one town
            is_far = np.maximum(np.abs(to_east - east), np.abs(to_north - north)) > MIRROR
            few = cells[is_far & (here <= FEW_MIRRORED * self._around(to_east, to_north))]
            if few.size:
                of = f"{self._cells[few].sum()} of {self._cells.sum()} pairs"
                first = f"first in line {self._cell_line[few].min()}, far from the others"
                yield f"positions: {of}, {first}, as if {way}"

    def _around(self, east: NDArray[np.int64], north: NDArray[np.int64]) -> NDArray[np.int64]:
        """Return the pairs in cells of one degree and the eight around each."""
        grid = np.pad(self._cells.reshape(360, 180), ((0, 0), (1, 1)))
        # Beyond the poles is no cell, beyond the date line is the first one
        rows = np.clip(north[:, None] + 91 + np.array([-1, 0, 1]), 0, 181)
        rows[np.abs(north) > 90] = 0
        columns = (east[:, None] + 180 + np.array([-1, 0, 1])) % 360
        return np.asarray(grid[columns[:, :, None], rows[:, None, :]].sum(axis=(1, 2)))


def _odd_rows(pair: PairRows) -> Iterator[_Mask]:
    """Yield the rows that are odd by themselves, one mask for each of the rules."""
    gap, distance = pair.gap, pair.distance
    # Drawn outlines, marked as such, have whatever gap and deviation was asked for
    measured = gap * np.nan if pair.has("gap_std_source") else gap
    yield measured > WIDE_GAP
    yield (measured > 0.0) & (pair.gap_std > measured)
    yield (gap > distance) & (distance >= SAME_PLACE)
    yield distance < SAME_PLACE
    yield _too_far(pair)
    # A contact may lie aside of the centres, but hardly across
    yield _angles(pair, pair.azimuth) > ACROSS
    for one in pair.buildings:
        yield from _odd_sizes(one)
        yield from _odd_quantities(one)
    # One storey more, as some count them above the ground floor; the height decides where it is
    first, second = pair.buildings
    roof = 5.0 * (np.fmin(first.storeys, second.storeys) + 1.0)
    yield np.isnan(np.fmin(first.height, second.height)) & (pair.contact_height > roof)
    # The nearest floor is at most half a storey away
    largest = np.where(np.isnan(pair.storey), STOREY, pair.storey / 2.0 + 0.1)
    yield np.abs(pair.floor_offset) > largest


def _odd_sizes(one: Rows) -> Iterator[_Mask]:
    """Yield the rows in which size or period of one building are odd."""
    height, storeys = one.height, one.storeys
    yield (height > TOWER) & (height <= COLUMNS["height_1"].high)
    # Halves are usual for attics
    yield (storeys >= 1.0) & (2.0 * storeys != np.floor(2.0 * storeys))
    yield (height > HIGH_STOREY * storeys) & (storeys >= 2.0)
    ratio = _period_ratio(one)
    yield (ratio < 1.0 / ODD_PERIOD) | (ratio > ODD_PERIOD)


def _odd_quantities(one: Rows) -> Iterator[_Mask]:
    """Yield the rows in which other quantities of one building are odd."""
    for name, limit in HIGH:
        value = getattr(one, name)
        yield (value > limit) & (value <= COLUMNS[f"{name}_1"].high)
    mass = _storey_mass(one)
    yield (mass < STOREY_MASS[0]) | (mass > STOREY_MASS[1])
    # A twentieth of the height is a drift of collapse, not of yield
    largest, strength = 0.05 * np.nan_to_num(_size(one), nan=20.0), one.yield_displacement
    yield (strength > largest) & np.isfinite(strength)


def _too_far(pair: PairRows) -> _Mask:
    """Return pairs too far apart for neighbours, by the areas where both are known."""
    apart = _apart(pair)
    beyond = apart - PER_ROOT_AREA * _roots(pair)
    by_area = (beyond > 0.0) & (pair.distance > SMALLEST_FAR)
    return np.where(np.isnan(beyond), apart > FAR_APART, by_area)


def _apart(pair: PairRows) -> FloatArray:
    """Return the distance of the positions beyond the gap, m."""
    return pair.distance - np.minimum(np.fmax(pair.gap, 0.0), 10.0)


def _roots(pair: PairRows) -> FloatArray:
    """Return the sum of the roots of the areas of both buildings, m."""
    first, second = pair.buildings
    return np.sqrt(first.area) + np.sqrt(second.area)


def _angles(pair: PairRows, azimuth: FloatArray) -> FloatArray:
    """Return the angle between azimuths and the line of the positions, 0 to 180 degrees."""
    direction = np.rad2deg(np.arctan2(*pair.way))
    angle = azimuth - np.where(pair.distance >= LINE, direction, np.nan)
    return np.abs(angle - 360.0 * np.rint(angle / 360.0))


def _size(one: Rows) -> FloatArray:
    """Return the height, m, from storeys where it is not given."""
    return np.where(np.isnan(one.height), STOREY * one.storeys, one.height)


def _period_ratio(one: Rows) -> FloatArray:
    """Return the period over that of frames of the height."""
    size, period = _size(one), one.period
    possible = (size > 0.0) & (size <= TOWER) & (period > 0.0)
    possible &= period <= COLUMNS["period_1"].high
    ratio = np.full(possible.size, np.nan)
    # Few rows of most tables give periods
    ratio[possible] = period[possible] / (FRAME_PERIOD * size[possible] ** FRAME_EXPONENT)
    return ratio


def _storey_mass(one: Rows) -> FloatArray:
    """Return the mass per storey, kg; of one storey where nothing tells how many there are."""
    size = _size(one)
    counted = np.fmax(np.where(size > 0.0, size / STOREY, 1.0), 1.0)
    counted = np.fmax(np.where(one.storeys > 0.0, one.storeys, counted), 1.0)
    return np.where(one.mass > 0.0, one.mass, np.nan) / counted


def _inches(gaps: FloatArray) -> FloatArray:
    """Return gaps that are inches in feet, to two decimals or more, as numbers of inches."""
    inches = np.rint(12.0 * gaps)
    return inches[np.abs(12.0 * gaps - inches) < 0.0601]


def _kinds_of_gaps(pair: PairRows) -> dict[str, _Mask]:
    """Return what the gaps above 0 are, by the names of counted numbers."""
    gaps = pair.gap[pair.gap > 0.0]
    return {
        "gaps": gaps > 0.0,
        "wide": (gaps > WIDE_GAP) & (gaps < LARGEST),
        "whole": gaps == np.floor(gaps),
        "quarters": 4.0 * gaps == np.floor(4.0 * gaps),
        "metres": gaps >= 1.0,
        "twelfths": _inches(gaps) >= 0.0,
    }


def _kinds_of_places(pair: PairRows) -> dict[str, _Mask]:
    """Return what the positions are, compared with areas and azimuths."""
    # Distances beyond those of two squares of the areas
    is_vague = (pair.distance < LINE) | (pair.gap > WIDE_GAP)
    beyond = np.where(is_vague, np.nan, _apart(pair) - CLOSE_FOR_AREA * _roots(pair))
    kinds = {"areas": ~np.isnan(beyond), "close": beyond < 0.0}
    if not pair.has("azimuth"):
        return kinds
    # Azimuths that do not follow the positions, and other forms of those that do
    azimuth, angle = pair.azimuth, _angles(pair, pair.azimuth)
    astray, small = angle > FITS, azimuth <= CIRCLE
    return kinds | {
        "azimuths": azimuth > 0.0,
        "small": (azimuth > 0.0) & small,
        "decimals": azimuth > np.floor(azimuth),
        "compared": angle >= 0.0,
        "astray": astray,
        "along": astray & (angle < 180.0 - FITS),
        "backwards": angle >= 180.0 - FITS,
        "from_east": astray & (_angles(pair, 90.0 - azimuth) <= FITS),
        "in_radians": astray & (_angles(pair, np.rad2deg(azimuth)) <= FITS) & small,
    }


def _kinds_of_sizes(one: Rows, distance: FloatArray) -> dict[str, _Mask]:
    """Return what heights and storeys of one building of each pair are."""
    height, storeys = one.height, one.storeys
    # Heights without storeys and period, which may be in feet, or numbers of storeys
    alone = (height > 0.0) & (height < 1e6) & np.isnan(storeys) & np.isnan(one.period)
    lone, apart = height[alone], distance[alone]
    apart[apart < LINE] = np.nan
    return {
        # Halls of one storey may have any height
        "storeys": (storeys >= 2.0) & (height > 0.0),
        "high_storeys": (height > HIGH_STOREY * storeys) & (storeys >= 2.0),
        "alone": alone,
        "low": lone < LOWEST_FEET,
        "high": lone > HIGH_FEET,
        "apart": apart > 0.0,
        "slender": lone > SLENDER * apart,
        # Numbers of storeys are whole, and often 1 or 2
        "floors": (lone == np.floor(lone)) & (lone <= 60.0),
        "one_or_two": lone <= 2.0,
    }


def _kinds_of_periods(one: Rows) -> dict[str, _Mask]:
    """Return what periods and masses of one building of each pair are."""
    kinds = dict[str, _Mask]()
    if one.has("period"):
        ratio, log_period = _period_ratio(one), np.log(one.period)
        # Periods near 1 are alike as frequencies; heights in feet make periods of frames longer
        decisive, error = (np.abs(log_period) > 0.35) & ~np.isnan(ratio), np.log(ratio)
        in_feet = np.abs(error - FRAME_EXPONENT * np.log(0.3048))
        better = np.abs(2.0 * log_period - error) < np.minimum(np.abs(error), in_feet)
        kinds |= {"periods": ~np.isnan(ratio), "short": ratio < SHORT_PERIOD}
        kinds |= {"decisive": decisive, "frequencies": decisive & better}
    # Nor do most tables give masses
    if one.has("mass"):
        mass = _storey_mass(one)
        kinds |= {"masses": mass > 0.0, "light": mass < STOREY_MASS[0]}
    return kinds


_FEET = (("height_1", "ft"), ("height_2", "ft"))
_Units = tuple[tuple[str, str], ...]

#: Group and subject of a suspicion of a column, whether it holds, its sentence, and units.
_ColumnRule = tuple[str, str, bool, str, _Units]


def _gap_rules(n: Counter[str], is_drawn: bool, are_inches: bool) -> Iterator[_ColumnRule]:
    """Yield the units that all gaps above 0 may be in."""
    gaps, given = n["gaps"], "given in centimetres or millimetres?"
    wide = f"{{wide}} of {{gaps}} gaps above 0 are wider than {WIDE_GAP:g} m: {given}"
    yield "gap", "gaps", 2 * n["wide"] > gaps and not is_drawn, wide, ()
    # Outlines and tapes do not give round gaps only
    whole = f"all {{gaps}} gaps above 0 are whole metres: {given}"
    yield "gap", "gaps", FEWEST <= gaps == n["whole"], whole, (("gap", "cm"),)
    quarters = (
        "all {gaps} gaps above 0 are quarters of a metre, most of them above 1 m: given in inches?"
    )
    is_odd = FEWEST < gaps == n["quarters"] < 2 * n["metres"]
    yield "gap", "gaps", is_odd, quarters, (("gap", "in"),)
    # Quarters are twelfths too, and no evidence
    inches = (
        "all {gaps} gaps above 0 are twelfths of a metre, as inches are of a foot: given in feet?"
    )
    is_odd = FEWEST <= gaps == n["twelfths"] and are_inches
    yield "gap", "gaps", is_odd, inches, (("gap", "ft"),)


def _size_rules(n: Counter[str]) -> Iterator[_ColumnRule]:
    """Yield the units that heights, storeys and periods may be in."""
    storeys = "heights: {high_storeys} of {storeys} make floors above "
    storeys += f"{HIGH_STOREY:g} m: given in feet?"
    yield "size", "heights", 2 * n["high_storeys"] > n["storeys"], storeys, _FEET
    # Neither storeys nor periods tell it: hardly any is low, most are high and slender
    are_feet = 2 * n["slender"] >= n["apart"] and 50 * n["low"] <= n["alone"] < 2 * n["high"]
    alone = f"heights: {{low}} of {{alone}} without storeys below {LOWEST_FEET:g} m, {{high}} above"
    alone += f" {HIGH_FEET:g} m: given in feet?"
    yield "size", "heights", are_feet and n["alone"] > FEWEST, alone, _FEET
    better = "periods: {frequencies} of {decisive} fit the heights better as frequencies: given in"
    yield "size", "periods", 2 < n["decisive"] < 2 * n["frequencies"], f"{better} Hz?", ()
    # Periods of lower buildings
    short = "periods: {short} of {periods} are far below what the heights suggest: heights given in"
    yield "size", "periods", 3 < n["periods"] < 2 * n["short"], f"{short} feet?", _FEET


def _other_rules(n: Counter[str]) -> Iterator[_ColumnRule]:
    """Yield what whole heights, masses, areas, and azimuths without positions may be."""
    floors = "heights: all {floors} are whole metres, {one_or_two} of them 1 or 2: numbers of"
    are_floors = FEWEST < n["alone"] == n["floors"] and n["one_or_two"] > 0
    yield "floors", "heights", are_floors, f"{floors} storeys?", ()
    light = f"masses: {{light}} of {{masses}} below {STOREY_MASS[0]:g} kg per storey: given in "
    light, units = f"{light}tonnes or kN?", (("mass_1", "t"), ("mass_2", "t"))
    yield "mass", "masses", 2 * n["light"] > n["masses"], light, units
    # Large areas of close centres
    close = "areas: {close} of {areas} pairs are too close for them: in square feet, or of all "
    yield "area", "areas", FEWEST <= n["areas"] < 2 * n["close"], f"{close}storeys?", ()
    # Without positions that azimuths could follow
    small = "azimuths: all {azimuths} are at most 2 pi: given in radians?"
    are_small = FEWEST <= n["azimuths"] == n["small"] and n["decimals"] > 0
    yield "azimuth", "azimuths", n["compared"] < 3 and are_small, small, (("azimuth", "rad"),)


def _astray_azimuths(n: Counter[str]) -> Iterator[_Finding]:
    """Yield a suspicion of azimuths that do not follow the positions."""
    # Where the azimuth of an axis is given, half of them point backwards
    if n["compared"] < 3 or 4 * n["astray"] < n["compared"]:
        return
    others, units = f"{n['astray']} of {n['compared']} do not follow the positions", _Units()
    forms = {
        "in_radians": "in radians",
        "backwards": "backwards",
        "from_east": "from east counter-clockwise",
        "along": "along the wall",
    }
    best = max(forms, key=lambda form: n[form])
    # How many would follow the positions in another form
    if 10 * n[best] >= 9 * n["astray"]:
        others += f", {n[best]} would if given {forms[best]}"
        units = (("azimuth", "rad"),) if best == "in_radians" else ()
    meant = "degrees clockwise from north, from building 1 to building 2, are expected"
    yield _Finding("azimuths", f"azimuths: {others}: {meant}", units)


def _quoted(table: pa.Table, columns: Iterable[str], row: int) -> str:
    """Return the cells of a row as they are quoted in a sentence."""
    cells = []
    for name in columns:
        value = table[name][row].as_py()
        text = f"{str(value).strip()!r:.40}"
        # Text of a number stays as it is
        if isinstance(value, float):
            unit = COLUMNS[name].unit.replace("1", "").replace("degrees", "")
            text = f"{value:.9g} {unit}".rstrip()
        cells.append(f"{name} = {text}")
    return ", ".join(cells)
