"""
Values of a pair table that are possible but odd: in one row, in a whole column, in several rows.

One account of the rows, :class:`Suspicions`, decides for every command. It reads raw rows, before
any is rejected, in chunks of any size; its sentences do not depend on the size. What is suspected
is in tables: ``GAP_RULES``, ``LIMITS`` and ``COLUMN_RULES`` for columns, ``ROW_RULES`` for rows.
"""

from collections import Counter
from collections.abc import Callable, Iterable, Iterator
from functools import partial
from itertools import chain, product
from typing import Any, NamedTuple

import numpy as np
import pyarrow as pa
from numpy.typing import NDArray

from per_obspy.checks import FloatArray
from per_obspy.inventory.earlier_rows import EarlierRows, Identities, identities
from per_obspy.inventory.quantities import (
    FRAME_EXPONENT,
    LINE,
    STOREY,
    TOWER,
    BuildingRows,
    PairRows,
)
from per_obspy.inventory.schema import COLUMNS
from per_obspy.inventory.table_columns import joined_names

#: Column of the names of a row's suspicions, which become flags of the risk table.
ODD = "odd_values"

#: Suspicions of single rows and the meaning of each; chosen limits are in the rules below.
ROW_SUSPICIONS: dict[str, str] = {
    "odd_gap": (
        "the gap is above 3 m, wider than the distance between the positions, or less than its "
        "own standard deviation: see pair_tables in run.json"
    ),
    "odd_positions": (
        "both buildings have one position, or positions too far apart for neighbours"
    ),
    "odd_azimuth": "the azimuth is at right angles or opposite to the line between the positions",
    "odd_height": (
        "height, storeys, contact height or floor offset are possible but odd, as in feet or "
        "centimetres, or storeys with decimals"
    ),
    "odd_period": "a period is far from what the height suggests, as a frequency is",
    "odd_building": (
        "damping, mass, strength or participation are possible but odd, as in per cent or tonnes"
    ),
    "repeated_pair": "an earlier row of the pair table has the same two buildings",
    "contradicting_building": (
        "an earlier row gives a building of the same building_id other values or another place"
    ),
}

#: Rows that are looked at together: their numbers stay in the processor's cache.
BLOCK = 1 << 14

#: Neighbours are sought within about this gap, m: if most gaps are wider, the unit is another one.
WIDE_GAP = 3.0

#: No number of another unit, as infinite strength is none.
LARGEST = 1e9

#: Fewest values that suggest another unit by being round, or by none of them being small.
FEWEST = 5

#: Centres of neighbours lie closer than this, m, unless areas show larger buildings; and equal
#: positions, m. In San José and Guatemala City centres of pairs are 3.6 to 94 m apart, and less
#: than 1.2 times the sum of the roots of both areas within a gap of 3 m.
FAR_APART, PER_ROOT_AREA, SMALLEST_FAR = 150.0, 2.0, 60.0
SAME_PLACE = 0.5

#: Angle between azimuth and the line between the positions, degrees: of 2 839 pairs of San José and
#: Guatemala City 0.2 % exceed 75, the largest is 82.
ACROSS, FITS = 85.0, 45.0

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

_CORNERS = "longitude_1 latitude_1 longitude_2 latitude_2"
_INT_MAX = np.iinfo(np.int64).max
_Mask = NDArray[np.bool_]


def _is_whole(numbers: FloatArray) -> _Mask:
    """Return where numbers have no decimals."""
    return np.asarray(numbers == np.floor(numbers))


class Limit(NamedTuple):
    """A unit that is suspected where more than half of the numbers above 0 exceed a limit."""

    column: str
    above: float
    unit: str


#: Of each column the last one that holds.
LIMITS = (
    Limit("gap", WIDE_GAP, "cm"), Limit("gap", 100.0, "mm"), Limit("gap_std", 0.5, "cm"),
    Limit("height", TOWER, "cm"), Limit("height", 5000.0, "mm"),
    Limit("contact_height", TOWER, "cm"), Limit("period", 20.0, "ms"),
    Limit("damping", 0.3, "%"), Limit("restitution", 1.0, "%"),
    Limit("participation", 3.0, "%"), Limit("yield_coefficient", 1.0, "%"),
    Limit("yield_displacement", 2.0, "cm"), Limit("facing_length", TOWER, "cm"),
    Limit("floor_offset", 12.0, "cm"),
)  # fmt: skip

_UNIT_WORDS = {"cm": "centimetres", "mm": "millimetres", "ms": "milliseconds", "%": "per cent"}


class RowRule(NamedTuple):
    """
    Rows that are odd for one reason.

    A row that a sentence on the column ``subject`` explains has none of its own; ``columns`` are
    quoted of the first row, and the first of them must be in the table. ``#`` is the building.
    """

    flag: str
    subject: str
    reason: str
    columns: str
    is_odd: Callable[[Any], _Mask]
    building: int = 0

    def of(self, building: int) -> "RowRule":
        """Return the rule for building 1 or 2."""
        subject, reason, columns = (text.replace("#", str(building)) for text in self[1:4])
        return RowRule(self.flag, subject, reason, columns, self.is_odd, building)


def _outside(
    quantity: str, low: float = -np.inf, high: float = np.inf, possible: float = np.inf
) -> Callable[[Any], _Mask]:
    """Return the test of a quantity outside a range, but possible."""

    def is_odd(rows: PairRows | BuildingRows) -> _Mask:
        values = getattr(rows, quantity)
        return np.asarray((values < low) | ((values > high) & (values <= possible)))

    return is_odd


def _is_too_far(pair: PairRows) -> _Mask:
    """Return pairs too far apart for neighbours, by the areas where both are known."""
    beyond = pair.apart - PER_ROOT_AREA * pair.roots
    by_area = (beyond > 0.0) & (pair.distance > SMALLEST_FAR)
    return np.where(np.isnan(beyond), pair.apart > FAR_APART, by_area)


def _is_above_roof(pair: PairRows) -> _Mask:
    """Return contacts above the lower roof by the storeys, where no height is known."""
    first, second = pair.buildings
    # One storey more, as some count them above the ground floor
    roof = 5.0 * (np.fmin(first.storeys, second.storeys) + 1.0)
    return np.isnan(np.fmin(first.height, second.height)) & (pair.contact_height > roof)


_PAIR_RULES = (
    # Drawn outlines, marked as such, have whatever gap and deviation was asked for
    RowRule(
        "odd_gap", "gaps", f"a gap above {WIDE_GAP:g} m, in another unit?", "gap",
        lambda pair: (pair.gap > WIDE_GAP) & (not pair.has("gap_std_source")),
    ),
    RowRule(
        "odd_gap", "gap_std", "gap_std is larger than gap", "gap gap_std",
        lambda pair: (
            (pair.gap > 0.0) & (pair.gap_std > pair.gap) & (not pair.has("gap_std_source"))
        ),
    ),
    RowRule(
        "odd_gap", "gaps", "the gap is wider than the positions are apart", "gap",
        lambda pair: (pair.gap > pair.distance) & (pair.distance >= SAME_PLACE),
    ),
    RowRule("odd_positions", "", "both buildings at one position", "longitude_1 latitude_1",
            _outside("distance", low=SAME_PLACE)),
    RowRule("odd_positions", "", "positions too far apart for the gap", f"{_CORNERS} gap",
            _is_too_far),
    # A contact may lie aside of the centres, but hardly across
    RowRule("odd_azimuth", "azimuths",
            "the azimuth is across or against the line between the positions",
            f"azimuth {_CORNERS}", _outside("angle", high=ACROSS)),
)  # fmt: skip

#: Of building #. Halves of storeys are usual for attics; a twentieth of the height is a drift of
#: collapse, not of yield.
_BUILDING_RULES = (
    RowRule("odd_height", "height_#", f"height_# above {TOWER:g} m", "height_#",
            _outside("height", high=TOWER, possible=COLUMNS["height_1"].high)),
    RowRule(
        "odd_height", "", "storeys_# with decimals", "storeys_#",
        lambda one: (one.storeys >= 1.0) & ~_is_whole(2.0 * one.storeys),
    ),
    RowRule(
        "odd_height", "heights", f"height_# makes floors above {HIGH_STOREY:g} m, in feet?",
        "height_# storeys_#",
        lambda one: (one.height > HIGH_STOREY * one.storeys) & (one.storeys >= 2.0),
    ),
    RowRule("odd_period", "periods", "period_# does not fit the height",
            "period_# height_# storeys_#", _outside("period_ratio", 1.0 / ODD_PERIOD, ODD_PERIOD)),
    *(
        RowRule("odd_building", f"{name}_#", f"{name}_# above {limit:g}", f"{name}_#",
                _outside(name, high=limit, possible=COLUMNS[f"{name}_1"].high))
        for name, limit in (("damping", 0.3), ("yield_coefficient", 1.0), ("participation", 2.0))
    ),
    RowRule("odd_building", "masses", "mass_# is odd for its storeys", "mass_#",
            _outside("storey_mass", *STOREY_MASS)),
    RowRule(
        "odd_building", "yield_displacement_#", "yield_displacement_# above 5 % of the height",
        "yield_displacement_#",
        lambda one: (
            (one.yield_displacement > 0.05 * np.nan_to_num(one.size, nan=20.0))
            & np.isfinite(one.yield_displacement)
        ),
    ),
)  # fmt: skip

#: Rules of single rows, in the order of their sentences.
ROW_RULES = (
    *_PAIR_RULES,
    *(rule.of(1) for rule in _BUILDING_RULES),
    *(rule.of(2) for rule in _BUILDING_RULES),
    RowRule("odd_height", "contact_height", "contact_height above the lower roof",
            "contact_height storeys_1 storeys_2", _is_above_roof),
    RowRule(
        "odd_height", "floor_offset", "floor_offset above half a storey", "floor_offset",
        # The nearest floor is at most half a storey away
        lambda pair: np.abs(pair.floor_offset)
        > np.where(np.isnan(pair.storey), STOREY, pair.storey / 2.0 + 0.1),
    ),
)  # fmt: skip

#: Columns of what another row may describe otherwise.
_SEEN_IN = {
    "height": ("height",),
    "number of storeys": ("storeys",),
    "period": ("period",),
    "system": ("system",),
    "place": ("longitude", "latitude"),
}

#: Reasons that need the earlier rows, after the others.
_REPEATED = "the same two buildings as in an earlier row"
_OTHERWISE = {
    name: f"a building_id with another {name} than in an earlier row" for name in _SEEN_IN
}
_SUBJECTS = {rule.reason: rule.subject for rule in ROW_RULES}
_REASONS = (*_SUBJECTS, _REPEATED, *_OTHERWISE.values())


def _decides(one: BuildingRows) -> _Mask:
    """Return periods that are not alike as frequencies, as those near 1 are."""
    return (np.abs(np.log(one.period)) > 0.35) & ~np.isnan(one.period_ratio)


def _fits_as_frequency(one: BuildingRows) -> _Mask:
    """Return periods that would fit the height better as frequencies."""
    period, ratio = np.log(one.period), np.log(one.period_ratio)
    # Heights in feet make periods of frames longer
    in_feet = np.abs(ratio - FRAME_EXPONENT * np.log(0.3048))
    as_frequency = np.abs(2.0 * period - ratio) < np.minimum(np.abs(ratio), in_feet)
    return np.asarray(_decides(one) & as_frequency)


def _inches(pair: PairRows) -> FloatArray:
    """Return gaps that are inches in feet, to two decimals or more, as numbers of inches."""
    inches = np.rint(12.0 * pair.open_gaps)
    return inches[np.abs(12.0 * pair.open_gaps - inches) < 0.0601]


def _fits(pair: PairRows, azimuth: FloatArray) -> _Mask:
    """Return azimuths astray that would follow the positions in another form."""
    return (pair.angle > FITS) & (pair.angle_to(azimuth) <= FITS)


def _beyond_squares(pair: PairRows) -> FloatArray:
    """Return the distance beyond that of two squares of the areas, m, NaN where it is vague."""
    is_vague = (pair.distance < LINE) | (pair.gap > WIDE_GAP)
    return np.where(is_vague, np.nan, pair.apart - CLOSE_FOR_AREA * pair.roots)


#: Azimuths that are at most a circle in radians, to two decimals.
_CIRCLE = 2.0 * np.pi + 0.01

#: What is counted of a column: name of a number -> rows that count; of both buildings together.
_COUNTED: dict[str, dict[str, Callable[[Any], _Mask]]] = {
    "gap": {
        "gaps": lambda pair: pair.open_gaps > 0.0,
        "wide": lambda pair: (pair.open_gaps > WIDE_GAP) & (pair.open_gaps < LARGEST),
        "whole": lambda pair: _is_whole(pair.open_gaps),
        "quarters": lambda pair: _is_whole(4.0 * pair.open_gaps),
        "metres": lambda pair: pair.open_gaps >= 1.0,
        "twelfths": lambda pair: _inches(pair) >= 0.0,
    },
    # Halls of one storey may have any height
    "storeys": {
        "storeys": lambda one: (one.storeys >= 2.0) & (one.height > 0.0),
        "high storeys": lambda one: (one.height > HIGH_STOREY * one.storeys) & (one.storeys >= 2.0),
    },
    # Numbers of storeys are whole, and often 1 or 2
    "height": {
        "alone": lambda one: one.alone,
        "low": lambda one: one.lone_heights < LOWEST_FEET,
        "high": lambda one: one.lone_heights > HIGH_FEET,
        "apart": lambda one: one.lone_distances > 0.0,
        "slender": lambda one: one.lone_heights > SLENDER * one.lone_distances,
        "floors": lambda one: _is_whole(one.lone_heights) & (one.lone_heights <= 60.0),
        "one or two": lambda one: one.lone_heights <= 2.0,
    },
    "period": {
        "periods": lambda one: ~np.isnan(one.period_ratio),
        "short": lambda one: one.period_ratio < SHORT_PERIOD,
        "decisive": _decides,
        "frequencies": _fits_as_frequency,
    },
    "mass": {
        "masses": lambda one: one.storey_mass > 0.0,
        "light": lambda one: one.storey_mass < STOREY_MASS[0],
    },
    # Azimuths that do not follow the positions, and other forms of those that do
    "azimuth": {
        "azimuths": lambda pair: pair.azimuth > 0.0,
        "small": lambda pair: (pair.azimuth > 0.0) & (pair.azimuth <= _CIRCLE),
        "decimals": lambda pair: pair.azimuth > np.floor(pair.azimuth),
        "compared": lambda pair: pair.angle >= 0.0,
        "astray": lambda pair: pair.angle > FITS,
        "along the wall": lambda pair: (pair.angle > FITS) & (pair.angle < 180.0 - FITS),
        "backwards": lambda pair: pair.angle >= 180.0 - FITS,
        "from east": lambda pair: _fits(pair, 90.0 - pair.azimuth),
        "in radians": lambda pair: (
            _fits(pair, np.rad2deg(pair.azimuth)) & (pair.azimuth <= _CIRCLE)
        ),
    },
    "area_1": {
        "areas": lambda pair: ~np.isnan(_beyond_squares(pair)),
        "close": lambda pair: _beyond_squares(pair) < 0.0,
    },
}


class ColumnRule(NamedTuple):
    """
    Whole columns that are odd for one reason.

    Of each ``group`` the first rule that holds is said; ``units`` would make the numbers plausible.
    """

    group: str
    subject: str
    holds: Callable[[Counter[str]], bool]
    sentence: str
    units: tuple[tuple[str, str], ...] = ()


_FEET = (("height_1", "ft"), ("height_2", "ft"))

GAP_RULES = (
    ColumnRule(
        "gap", "gaps",
        lambda n: 2 * n["wide"] > n["gaps"] and not n["drawn"],
        f"{{wide}} of {{gaps}} gaps above 0 are wider than {WIDE_GAP:g} m: given in centimetres or "
        "millimetres?",
    ),
    # Outlines and tapes do not give round gaps only
    ColumnRule(
        "gap", "gaps", lambda n: FEWEST <= n["gaps"] == n["whole"],
        "all {gaps} gaps above 0 are whole metres: given in centimetres or millimetres?",
        (("gap", "cm"),),
    ),
    ColumnRule(
        "gap", "gaps", lambda n: FEWEST < n["gaps"] == n["quarters"] < 2 * n["metres"],
        "all {gaps} gaps above 0 are quarters of a metre, most of them above 1 m: given in inches?",
        (("gap", "in"),),
    ),
    # Quarters are twelfths too, and no evidence
    ColumnRule(
        "gap", "gaps", lambda n: FEWEST <= n["gaps"] == n["twelfths"] and n["inches"] >= 3,
        "all {gaps} gaps above 0 are twelfths of a metre, as inches are of a foot: given in feet?",
        (("gap", "ft"),),
    ),
)  # fmt: skip

COLUMN_RULES = (
    ColumnRule(
        "size", "heights", lambda n: 2 * n["high storeys"] > n["storeys"],
        f"heights: {{high storeys}} of {{storeys}} make floors above {HIGH_STOREY:g} m: given in "
        "feet?",
        _FEET,
    ),
    # Neither storeys nor periods tell it: hardly any is low, most are high and slender
    ColumnRule(
        "size", "heights",
        lambda n: (
            2 * n["slender"] >= n["apart"] and n["alone"] > FEWEST
            and 50 * n["low"] <= n["alone"] < 2 * n["high"]
        ),
        f"heights: {{low}} of {{alone}} without storeys below {LOWEST_FEET:g} m, {{high}} above "
        f"{HIGH_FEET:g} m: given in feet?",
        _FEET,
    ),
    ColumnRule(
        "size", "periods", lambda n: 2 < n["decisive"] < 2 * n["frequencies"],
        "periods: {frequencies} of {decisive} fit the heights better as frequencies: given in Hz?",
    ),
    # Periods of lower buildings
    ColumnRule(
        "size", "periods", lambda n: 3 < n["periods"] < 2 * n["short"],
        "periods: {short} of {periods} are far below what the heights suggest: heights given in "
        "feet?",
        _FEET,
    ),
    ColumnRule(
        "floors", "heights", lambda n: FEWEST < n["alone"] == n["floors"] and n["one or two"] > 0,
        "heights: all {floors} are whole metres, {one or two} of them 1 or 2: numbers of storeys?",
    ),
    ColumnRule(
        "mass", "masses", lambda n: 2 * n["light"] > n["masses"],
        f"masses: {{light}} of {{masses}} below {STOREY_MASS[0]:g} kg per storey: given in tonnes "
        "or kN?",
        (("mass_1", "t"), ("mass_2", "t")),
    ),
    # Large areas of close centres
    ColumnRule(
        "area", "areas", lambda n: FEWEST <= n["areas"] < 2 * n["close"],
        "areas: {close} of {areas} pairs are too close for them: in square feet, or of all "
        "storeys?",
    ),
    ColumnRule(
        "azimuth", "azimuths",
        lambda n: (
            n["compared"] < 3 and FEWEST <= n["azimuths"] == n["small"] and n["decimals"] > 0
        ),
        "azimuths: all {azimuths} are at most 2 pi: given in radians?",
        (("azimuth", "rad"),),
    ),
)  # fmt: skip


class _Finding(NamedTuple):
    """A suspicion of a column: what it is about, and units that would make it plausible."""

    subject: str
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
        blocks = list[Identities]()
        # What a row says by itself, then what earlier ones say
        for start in range(0, len(table), BLOCK):
            here = slice(start, start + BLOCK)
            pair = PairRows(table.slice(start, BLOCK))
            # Numbers of any size are possible in raw rows
            with np.errstate(all="ignore"):
                account.add(pair, lines[here], {name: flags[name][here] for name in flags})
                comparable = ~np.isnan(pair.distance) & ~repeated[here]
                blocks.append(identities(pair, comparable, start))
        if blocks:
            self._compare(account, Identities.joined(blocks), table, lines, flags)
        return joined_names(flags)

    def _compare(
        self,
        account: "_FileAccount",
        found: Identities,
        table: pa.Table,
        lines: NDArray[np.int64],
        flags: dict[str, _Mask],
    ) -> None:
        """Add rows with a pair or a building that an earlier row has."""
        again, earlier = self._earlier.repeated_pairs(found, lines)
        flags["repeated_pair"][again] = True
        if again.size:
            account.add_odd(_REPEATED, again, lines, lambda _: f"as line {earlier[0]}")
        # Each difference of either building
        for name, buildings in self._earlier.contradictions(found).items():
            odd = np.flatnonzero(np.bincount(buildings // 2))
            flags["contradicting_building"][odd] = True
            columns = [f"{column}_{buildings[0] % 2 + 1}" for column in _SEEN_IN[name]]
            columns = [f"building_id_{buildings[0] % 2 + 1}", *columns]
            account.add_odd(_OTHERWISE[name], odd, lines, partial(_quoted, table, columns))

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
            units |= account.units()
        return units


class _FileAccount:
    """Numbers of rows of one file that each rule counts."""

    def __init__(self) -> None:
        self.rows = 0
        # Odd rows: their number, and the first as text, by reason
        self._odd = Counter[str]()
        self._first: dict[str, str] = {}
        # Numbers of what is counted in columns
        self._count = Counter[str]()
        self._inches: set[float] = set()
        self._is_drawn = False
        # Numbers of columns above limits, and those above 0
        self._limits = Counter[tuple[str, Limit, str]]()
        # Pairs by degrees of longitude and latitude, and the first line of each
        self._cells = np.zeros(360 * 180, dtype=np.int64)
        self._cell_line = np.full(360 * 180, _INT_MAX)

    def add(self, pair: PairRows, lines: NDArray[np.int64], flags: dict[str, _Mask]) -> None:
        """Add a block of rows, and set the flags of those that are odd by themselves."""
        self.rows += len(lines)
        # Single rows
        for rule in ROW_RULES:
            columns = [*filter(pair.has, rule.columns.split())]
            if rule.columns.startswith(tuple(columns[:1])):
                is_odd = rule.is_odd(pair.buildings[rule.building - 1] if rule.building else pair)
                if is_odd.any():
                    flags[rule.flag] |= is_odd
                    example = partial(_quoted, pair.table, columns)
                    self.add_odd(rule.reason, np.flatnonzero(is_odd), lines, example)
        # Whole columns, of both buildings together
        for rows in (pair, *pair.buildings):
            self._add_limits(rows)
            for column, tests in _COUNTED.items():
                for number, is_counted in tests.items() if rows.has(column) else ():
                    self._count[number] += int(np.count_nonzero(is_counted(rows)))
        self._add_gaps(pair)
        self._add_cells(pair, lines)

    def add_odd(
        self,
        reason: str,
        odd: NDArray[np.intp],
        lines: NDArray[np.int64],
        example: Callable[[int], str],
    ) -> None:
        """Add rows that are odd for a reason, with an example of the first."""
        self._odd[reason] += odd.size
        # Later blocks do not change the first one
        if reason not in self._first:
            row = int(odd[0])
            self._first[reason] = f"first in line {lines[row]}: {example(row)}"

    def _add_limits(self, rows: PairRows | BuildingRows) -> None:
        """Add the numbers above limits, and those above 0."""
        # A column may have several limits
        for limit in LIMITS:
            if rows.has(limit.column):
                numbers = np.abs(getattr(rows, limit.column))
                is_number, name = numbers < LARGEST, limit.column + rows.suffix
                for number, least in (("above", limit.above), ("positive", 0.0)):
                    self._limits[name, limit, number] += int(
                        np.count_nonzero(is_number & (numbers > least))
                    )

    def _add_gaps(self, pair: PairRows) -> None:
        """Add the kinds of inches that gaps are; quarters are twelfths too, and no evidence."""
        self._is_drawn |= pair.has("gap_std_source")
        inches = _inches(pair) if len(self._inches) < FEWEST else np.empty(0)
        self._inches |= set(inches[(inches <= 120.0) & (inches % 3.0 > 0.0)].tolist())

    def _add_cells(self, pair: PairRows, lines: NDArray[np.int64]) -> None:
        """Add the pairs of each cell of one degree."""
        valid = ~np.isnan(pair.distance)
        east = np.floor(pair.buildings[0].longitude[valid]) + 180.0
        north = np.floor(pair.buildings[0].latitude[valid]) + 90.0
        # The last cells have both of their edges
        cell = (np.minimum(east, 359.0) * 180.0 + np.minimum(north, 179.0)).astype(np.int64)
        self._cells += np.bincount(cell, minlength=360 * 180)
        # Lines come in their order: a cell keeps its first one
        is_new = self._cell_line[cell] == _INT_MAX
        np.minimum.at(self._cell_line, cell[is_new], lines[valid][is_new])

    def _findings(self) -> list[_Finding]:
        """Return the suspicions of columns, in the order of their sentences."""
        n = self._count.copy()
        # Outlines have whatever gap was asked for, with decimals
        n["drawn"] = int(self._is_drawn and n["whole"] < n["gaps"])
        n["inches"] = len(self._inches)
        findings = [*_by_rules(GAP_RULES, n), *self._by_limits(bool(n["drawn"]))]
        return [*findings, *_by_rules(COLUMN_RULES, n), *_astray_azimuths(n)]

    def _by_limits(self, is_drawn: bool) -> list[_Finding]:
        """Return the columns that mostly exceed a limit; the gaps without a sentence."""
        findings = dict[str, _Finding]()
        for limit, suffix in product(LIMITS, ("", "_1", "_2")):
            name = limit.column + suffix
            # More than half of those above 0
            above, every = (self._limits[name, limit, one] for one in ("above", "positive"))
            if 2 * above > every and not (name == "gap" and is_drawn):
                unit = COLUMNS[name].unit.replace("1", "")
                of = f"{above} of {every} above {limit.above:g} {unit}".strip()
                sentence = f"{name}: {of}: given in {_UNIT_WORDS[limit.unit]}?"
                # Of several limits the last one
                said = "" if name == "gap" else sentence
                findings[name] = _Finding(name, said, ((name, limit.unit),))
        return list(findings.values())

    def units(self) -> dict[str, str]:
        """Return the units that the columns may have; those by limits are more certain."""
        units = dict[str, str]()
        for name, unit in chain.from_iterable(finding.units for finding in self._findings()):
            units.setdefault(name, unit)
        return units

    def sentences(self) -> list[str]:
        """Return a sentence per suspicion, of columns first: their rows are not repeated."""
        findings = self._findings()
        explained = {finding.subject for finding in findings}
        rows = [
            f"{reason}: {self._odd[reason]} of {self.rows} rows, {self._first[reason]}"
            for reason in _REASONS
            if reason in self._odd and _SUBJECTS.get(reason, "") not in explained
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
        rows = north[:, None] + 91 + np.array([-1, 0, 1])
        rows = np.where(np.abs(north[:, None]) > 90, 0, np.clip(rows, 0, 181))
        columns = (east[:, None] + 180 + np.array([-1, 0, 1])) % 360
        return np.asarray(grid[columns[:, :, None], rows[:, None, :]].sum(axis=(1, 2)))


def _by_rules(rules: tuple[ColumnRule, ...], n: Counter[str]) -> list[_Finding]:
    """Return what the rules of columns find, at most one of each group."""
    found = dict[str, _Finding]()
    for rule in rules:
        if rule.group not in found and rule.holds(n):
            sentence = rule.sentence.format_map(n)
            found[rule.group] = _Finding(rule.subject, sentence, rule.units)
    return list(found.values())


def _astray_azimuths(n: Counter[str]) -> Iterator[_Finding]:
    """Yield a suspicion of azimuths that do not follow the positions."""
    # Where the azimuth of an axis is given, half of them point backwards
    if n["compared"] < 3 or 4 * n["astray"] < n["compared"]:
        return
    forms = ("in radians", "backwards", "from east", "along the wall")
    best = max(forms, key=lambda form: n[form])
    others = f"{n['astray']} of {n['compared']} do not follow the positions"
    # How many would follow the positions in another form
    if 10 * n[best] >= 9 * n["astray"]:
        east = " counter-clockwise" if best == "from east" else ""
        others += f", {n[best]} would if given {best}{east}"
    meant = "degrees clockwise from north, from building 1 to building 2, are expected"
    units = (("azimuth", "rad"),) if others.endswith("in radians") else ()
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
