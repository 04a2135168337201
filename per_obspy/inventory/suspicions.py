"""
Values of a pair table that are possible but odd: in one row, in a whole column, in several rows.

One account of the rows, :class:`Suspicions`, decides for every command. It reads raw rows, before
any is rejected, in chunks of any size; its sentences do not depend on the size.
"""

from collections import Counter, defaultdict
from collections.abc import Iterator
from typing import NamedTuple

import numpy as np
import pyarrow as pa
import pyarrow.compute as pc
from numpy.typing import NDArray

from per_obspy.checks import FloatArray
from per_obspy.constants import METRES_PER_DEGREE
from per_obspy.inventory.checking import LARGEST_SEPARATION
from per_obspy.inventory.earlier_rows import EarlierRows
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

#: Neighbours are sought within about this gap, m: if most gaps are wider, the unit is another one.
WIDE_GAP = 3.0

#: Fewest values that suggest another unit by being round, or by none of them being small.
FEWEST = 5

#: Centres of neighbours lie closer than this, m, unless areas show larger buildings; and equal
#: positions, m. In San José and Guatemala City centres of pairs are 3.6 to 94 m apart, and less
#: than 1.2 times the sum of the roots of both areas within a gap of 3 m.
FAR_APART, PER_ROOT_AREA, SMALLEST_FAR = 150.0, 2.0, 60.0
SAME_PLACE = 0.5

#: Angle between azimuth and the line between the positions, degrees: of 2 839 pairs of San José and
#: Guatemala City 0.2 % exceed 75, the largest is 82. Below 2 m the line is not reliable.
ACROSS, FITS, LINE = 85.0, 45.0, 2.0

#: Heights, m: only a few towers are higher; and one storey is never as high in buildings of two
#: and more, but 10 ft are.
TOWER, HIGH_STOREY = 300.0, 6.5

#: Heights of a table in feet: hardly any below this, most above that, m, and slender ones: height
#: over distance of the centres. Reasoned: 8 ft are the least of a house, 25 m are 8 storeys.
LOWEST_FEET, HIGH_FEET, SLENDER = 7.5, 25.0, 1.5

#: Period of frames, s: 0.0466 h**0.9 (ASCE 7-16, table 12.8-2, concrete frames, h in m), and
#: factors beyond which a row and a table are odd: stiff masonry has 0.3, base isolation 6 times it.
FRAME_PERIOD, FRAME_EXPONENT = 0.0466, 0.9
ODD_PERIOD, SHORT_PERIOD = 6.0, 0.3

#: Height of a storey, m, where either height or storeys are unknown.
STOREY = 3.0

#: Mass of a storey, kg: one of 30 m2 and 300 kg/m2 has 9 t, one of 10 000 m2 and 2 t/m2 2e7 kg.
STOREY_MASS = (1e4, 2e7)

#: Centres of squares of equal area are 0.5 of the sum of the roots of their areas apart, in
#: San José 0.23 or more; areas in square feet, or of all storeys, make less.
CLOSE_FOR_AREA = 0.17

#: Pairs on the other side of the Earth's axes: their share of those at the mirrored place at most,
#: and the distance at least, degrees.
FEW_MIRRORED, MIRROR = 0.25, 3


class _Limit(NamedTuple):
    """A unit that is suspected where more than half of the numbers above 0 exceed a limit."""

    column: str
    above: float
    unit: str


#: Of each column the last one that holds.
_LIMITS = (
    _Limit("gap", WIDE_GAP, "cm"), _Limit("gap", 100.0, "mm"), _Limit("gap_std", 0.5, "cm"),
    _Limit("height", TOWER, "cm"), _Limit("height", 2000.0, "mm"),
    _Limit("contact_height", TOWER, "cm"), _Limit("period", 20.0, "ms"),
    _Limit("damping", 0.3, "%"), _Limit("restitution", 1.0, "%"),
    _Limit("participation", 3.0, "%"), _Limit("yield_coefficient", 1.0, "%"),
    _Limit("yield_displacement", 2.0, "cm"), _Limit("facing_length", TOWER, "cm"),
    _Limit("floor_offset", 12.0, "cm"),
)  # fmt: skip

_UNIT_WORDS = {
    "cm": "centimetres", "mm": "millimetres", "ms": "milliseconds", "%": "per cent",
    "ft": "feet", "t": "tonnes or kN", "km/s": "km/s", "in": "inches",
}  # fmt: skip

_INT_MAX = np.iinfo(np.int64).max


class _Odd(NamedTuple):
    """Rows that are odd for one reason: flag, subject, reason, rows, and columns to quote."""

    flag: str
    subject: str
    reason: str
    rows: NDArray[np.bool_]
    columns: tuple[str, ...]


class _Numbers:
    """Columns of numbers of some rows, NaN where a cell is none."""

    def __init__(self, table: pa.Table) -> None:
        self._table = table
        self._missing = np.full(len(table), np.nan)
        self._columns: dict[str, FloatArray] = {}

    def has(self, *names: str) -> bool:
        """Return whether the table has all these columns."""
        return all(name in self._table.column_names for name in names)

    def __getitem__(self, name: str) -> FloatArray:
        if name not in self._columns:
            known = numbers_of(self._table[name]) if self.has(name) else self._missing
            self._columns[name] = known
        return self._columns[name]


def numbers_of(cells: pa.ChunkedArray) -> FloatArray:
    """
    Return cells as numbers, NaN where a cell is none; text is one where it looks like one.

    Examples
    --------
    >>> numbers_of(pa.chunked_array([["0", "0.05", "five", "", None]])).tolist()
    [0.0, 0.05, nan, nan, nan]
    """
    if pa.types.is_string(cells.type) or pa.types.is_large_string(cells.type):
        number = r"^\s*[+-]?(\d{1,300}(\.\d{0,300})?|\.\d{1,300})([eE][+-]?\d{1,3})?\s*$"
        is_number = pc.match_substring_regex(cells, number)
        cells = pc.utf8_trim_whitespace(pc.if_else(is_number, cells, None))
    elif not (pa.types.is_floating(cells.type) or pa.types.is_integer(cells.type)):
        return np.full(len(cells), np.nan)
    numbers: FloatArray = pc.cast(cells, pa.float64(), safe=False).to_numpy()
    return numbers


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
            Raw rows in the units of the schema; numbers may be text.
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
        numbers = _Numbers(table)
        place = _Places(numbers)
        odd = [*_odd_gaps(numbers, place), *_odd_places(numbers, place), *_odd_sizes(numbers)]
        odd += [*_odd_oscillators(numbers)]
        # Pairs and buildings of earlier rows
        comparable = place.is_valid & ~repeated
        again, contradicting = self._earlier.compare(table, numbers, comparable, lines)
        odd += [
            _Odd(
                "repeated_pair", "", "the same two buildings as in an earlier row", again.rows, ()
            ),
            *(
                _Odd(
                    "contradicting_building",
                    "",
                    f"building_id_{i} has another {name} than in an earlier row",
                    rows,
                    (f"building_id_{i}", *columns),
                )
                for i, name, rows, columns in contradicting
            ),
        ]
        found = [one for one in odd if one.rows.any()]
        account.add_rows(found, table, lines, again.earlier_line)
        account.add_columns(numbers, place, lines)
        if not found:
            return np.full(len(table), "", dtype=object)
        flags = {name: np.zeros(len(table), dtype=bool) for name in ROW_SUSPICIONS}
        for one in found:
            flags[one.flag] |= one.rows
        return joined_names(flags)

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


class _Places:
    """Positions of the pairs of some rows: distance, m, and direction, degrees from north."""

    def __init__(self, numbers: _Numbers) -> None:
        self.longitude = (numbers["longitude_1"], numbers["longitude_2"])
        self.latitude = (numbers["latitude_1"], numbers["latitude_2"])
        with np.errstate(invalid="ignore", over="ignore"):
            in_range = [np.abs(degrees) <= 180.0 for degrees in self.longitude]
            in_range += [np.abs(degrees) <= 90.0 for degrees in self.latitude]
            self.is_valid = np.logical_and.reduce(in_range)
            # Distance on a sphere taken as flat, across the date line too
            north = self.latitude[1] - self.latitude[0]
            east = (self.longitude[1] - self.longitude[0] + 180.0) % 360.0 - 180.0
            east *= np.cos(np.deg2rad(self.latitude[0]))
            distance = METRES_PER_DEGREE * np.hypot(north, east)
            self.is_valid &= distance <= LARGEST_SEPARATION
        self.distance = np.where(self.is_valid, distance, np.nan)
        self.direction = np.rad2deg(np.arctan2(east, north))

    def angle_to(self, azimuth: FloatArray) -> FloatArray:
        """Return the angle between azimuths and the lines between positions, 0 to 180 degrees."""
        with np.errstate(invalid="ignore"):
            angle = np.abs((azimuth - self.direction + 180.0) % 360.0 - 180.0)
            return np.where(self.distance >= LINE, angle, np.nan)


# numpy compares NaN as false, which is meant throughout the rules: a missing value is not odd.


def _odd_gaps(numbers: _Numbers, place: _Places) -> Iterator[_Odd]:
    """Yield rows with a gap that is possible but odd."""
    gap, deviation = numbers["gap"], numbers["gap_std"]
    # Drawn outlines, marked as such, have whatever gap and deviation was asked for
    if not numbers.has("gap_std_source"):
        wide = gap > WIDE_GAP
        yield _Odd(
            "odd_gap", "gaps", f"a gap above {WIDE_GAP:g} m, in another unit?", wide, ("gap",)
        )
        if numbers.has("gap_std"):
            unsure = (gap > 0.0) & (deviation > gap)
            yield _Odd(
                "odd_gap", "gap_std", "gap_std is larger than gap", unsure, ("gap", "gap_std")
            )
    beyond = (gap > place.distance) & (place.distance >= SAME_PLACE)
    yield _Odd("odd_gap", "gaps", "the gap is wider than the positions are apart", beyond, ("gap",))


def _odd_places(numbers: _Numbers, place: _Places) -> Iterator[_Odd]:
    """Yield rows with positions or an azimuth that do not fit neighbours."""
    corners = ("longitude_1", "latitude_1", "longitude_2", "latitude_2")
    yield _Odd(
        "odd_positions",
        "",
        "both buildings at one position",
        place.distance < SAME_PLACE,
        corners[:2],
    )
    limit = np.full(len(place.distance), FAR_APART)
    if numbers.has("area_1", "area_2"):
        with np.errstate(invalid="ignore"):
            roots = np.sqrt(numbers["area_1"]) + np.sqrt(numbers["area_2"])
        by_area = np.maximum(PER_ROOT_AREA * roots, SMALLEST_FAR)
        limit = np.where(np.isnan(by_area), limit, by_area)
    gap = np.nan_to_num(np.clip(numbers["gap"], 0.0, 10.0))
    far = place.distance - gap > limit
    yield _Odd("odd_positions", "", "positions too far apart for the gap", far, (*corners, "gap"))
    if numbers.has("azimuth"):
        across = place.angle_to(numbers["azimuth"]) > ACROSS
        reason = "the azimuth is across or against the line between the positions"
        yield _Odd("odd_azimuth", "azimuths", reason, across, ("azimuth", *corners))


def _odd_sizes(numbers: _Numbers) -> Iterator[_Odd]:
    """Yield rows with an odd height, number of storeys, contact height or floor offset."""
    for i in (1, 2):
        names = height_name, storeys_name = f"height_{i}", f"storeys_{i}"
        height, storeys = numbers[height_name], numbers[storeys_name]
        towers = (height > TOWER) & (height <= COLUMNS[height_name].high)
        yield _Odd(
            "odd_height", height_name, f"{height_name} above {TOWER:g} m", towers, (height_name,)
        )
        if not numbers.has(storeys_name):
            continue
        # Halves are usual for attics
        decimals = (storeys >= 1.0) & (2.0 * storeys % 1.0 != 0.0)
        yield _Odd("odd_height", "", f"{storeys_name} with decimals", decimals, (storeys_name,))
        high = (height > HIGH_STOREY * storeys) & (storeys >= 2.0)
        yield _Odd(
            "odd_height", "heights", f"storeys above {HIGH_STOREY:g} m, in feet?", high, names
        )
    if numbers.has("contact_height"):
        # One storey more, as some count them above the ground floor
        storeys = np.fmin(numbers["storeys_1"], numbers["storeys_2"])
        known = np.fmin(numbers["height_1"], numbers["height_2"])
        above = (numbers["contact_height"] > 5.0 * (storeys + 1.0)) & np.isnan(known)
        columns = ("contact_height", "storeys_1", "storeys_2")
        yield _Odd(
            "odd_height", "contact_height", "contact_height above the lower roof", above, columns
        )
    if numbers.has("floor_offset"):
        # The nearest floor is at most half a storey away
        offset = np.abs(numbers["floor_offset"])
        with np.errstate(divide="ignore", invalid="ignore"):
            storey = np.fmax(*(numbers[f"height_{i}"] / numbers[f"storeys_{i}"] for i in (1, 2)))
        half = np.where(np.isnan(storey), STOREY, storey / 2.0 + 0.1)
        yield _Odd(
            "odd_height",
            "floor_offset",
            "floor_offset above half a storey",
            offset > half,
            ("floor_offset",),
        )


def _odd_oscillators(numbers: _Numbers) -> Iterator[_Odd]:
    """Yield rows with an odd period, damping, mass, strength or participation of a building."""
    limits = {"damping": 0.3, "yield_coefficient": 1.0, "participation": 2.0}
    for i in (1, 2):
        if numbers.has(f"period_{i}"):
            ratio = _period_ratio(numbers, i)
            odd = (ratio > ODD_PERIOD) | (ratio < 1.0 / ODD_PERIOD)
            columns = [f"period_{i}", *_given(numbers, f"height_{i}", f"storeys_{i}")]
            yield _Odd(
                "odd_period", "periods", f"period_{i} does not fit the height", odd, tuple(columns)
            )
        for name, limit in limits.items():
            if numbers.has(column := f"{name}_{i}"):
                above = (numbers[column] > limit) & (numbers[column] <= COLUMNS[column].high)
                yield _Odd("odd_building", column, f"{column} above {limit:g}", above, (column,))
        if numbers.has(column := f"mass_{i}"):
            mass, low, high = _storey_mass(numbers, i), *STOREY_MASS
            odd = (mass < low) | (mass > high)
            yield _Odd("odd_building", "masses", f"{column} is odd for its storeys", odd, (column,))
        if numbers.has(column := f"yield_displacement_{i}"):
            # A twentieth of the height is a drift of collapse, not of yield
            limit_height = np.nan_to_num(_height(numbers, i), nan=20.0)
            far = (numbers[column] > 0.05 * limit_height) & np.isfinite(numbers[column])
            yield _Odd("odd_building", column, f"{column} above 5 % of the height", far, (column,))


def _given(numbers: _Numbers, *names: str) -> Iterator[str]:
    """Yield those of some columns that the table has."""
    return (name for name in names if numbers.has(name))


def _height(numbers: _Numbers, i: int) -> FloatArray:
    """Return heights of building i, m, from storeys where they are not given."""
    height = numbers[f"height_{i}"]
    if not numbers.has(f"storeys_{i}"):
        return height
    return np.where(np.isnan(height), STOREY * numbers[f"storeys_{i}"], height)


def _period_ratio(numbers: _Numbers, i: int) -> FloatArray:
    """Return periods of building i over those of frames of its height."""
    with np.errstate(divide="ignore", invalid="ignore"):
        frame = FRAME_PERIOD * np.maximum(_height(numbers, i), 0.0) ** FRAME_EXPONENT
        return numbers[f"period_{i}"] / frame


def _storey_mass(numbers: _Numbers, i: int) -> FloatArray:
    """Return masses of building i per storey, kg."""
    storeys = np.maximum(numbers[f"storeys_{i}"], 1.0)
    counted = np.maximum(numbers[f"height_{i}"] / STOREY, 1.0)
    return numbers[f"mass_{i}"] / np.nan_to_num(
        np.where(np.isnan(storeys), counted, storeys), nan=1
    )


class _FileAccount:
    """Numbers of rows of one file that each rule counts."""

    def __init__(self) -> None:
        self.rows = 0
        # Odd rows: their number, and the first as text, by subject and reason
        self._odd: Counter[tuple[str, str]] = Counter()
        self._first: dict[tuple[str, str], str] = {}
        # Numbers by column and by what is counted
        self._count: defaultdict[str, Counter[str]] = defaultdict(Counter)
        self._twelfths: set[int] = set()
        self._is_drawn = False
        # Pairs by degrees of longitude and latitude, and the first line of each
        self._cells = np.zeros(360 * 180, dtype=np.int64)
        self._cell_line = np.full(360 * 180, _INT_MAX)

    def add_rows(
        self,
        found: list[_Odd],
        table: pa.Table,
        lines: NDArray[np.int64],
        earlier_line: NDArray[np.int64],
    ) -> None:
        """Add rows that are odd by themselves."""
        self.rows += len(table)
        for one in found:
            key = one.subject, one.reason
            self._odd[key] += _number(one.rows)
            if key in self._first:
                continue
            row = int(np.argmax(one.rows))
            cells = [_quoted(table, name, row) for name in one.columns]
            if one.flag == "repeated_pair":
                cells = [f"line {earlier_line[row]}"]
            self._first[key] = f"first in line {lines[row]}: {', '.join(cells)}"

    def add_columns(self, numbers: _Numbers, place: _Places, lines: NDArray[np.int64]) -> None:
        """Add the counts of whole columns."""
        for name in (one for one in COLUMNS if numbers.has(one)):
            bare = name.removesuffix("_1").removesuffix("_2")
            limits = [limit.above for limit in _LIMITS if limit.column == bare]
            if limits:
                # Infinite strength is no number of another unit
                values, count = np.abs(numbers[name]), self._count[name]
                values = np.where(values < 1e9, values, 0.0)
                count["above 0"] += _number(values > 0.0)
                for above in limits:
                    count[f"above {above}"] += _number(values > above)
        self._add_gaps(numbers["gap"])
        self._is_drawn |= numbers.has("gap_std_source")
        for i in (1, 2):
            self._add_building(numbers, place, i)
        self._add_azimuths(numbers, place)
        if numbers.has("area_1", "area_2"):
            with np.errstate(invalid="ignore"):
                roots = np.sqrt(numbers["area_1"]) + np.sqrt(numbers["area_2"])
                clear = place.distance - np.nan_to_num(numbers["gap"])
            apart = (place.distance >= LINE) & np.isfinite(roots)
            self._count["area"]["all"] += _number(apart)
            self._count["area"]["close"] += _number(apart & (clear < CLOSE_FOR_AREA * roots))
        self._add_cells(place, lines)

    def _add_gaps(self, gap: FloatArray) -> None:
        """Add the numbers of gaps that are round in metres, in quarters and in twelfths."""
        gap = gap[gap > 0.0]
        count = self._count["gap"]
        count["all"] += gap.size
        count["whole"] += _number(gap == np.floor(gap))
        count["quarters"] += _number(4.0 * gap == np.floor(4.0 * gap))
        count["metres"] += _number(gap >= 1.0)
        # Inches in feet, to two decimals or more
        twelfths = np.rint(12.0 * gap)
        is_twelfth = np.abs(12.0 * gap - twelfths) < 0.0601
        count["twelfths"] += _number(is_twelfth)
        if is_twelfth.any() and len(self._twelfths) < 6:
            inches = np.unique(twelfths[is_twelfth & (twelfths <= 120.0)])
            self._twelfths |= {int(inch) for inch in inches.tolist() if inch % 3}

    def _add_building(self, numbers: _Numbers, place: _Places, i: int) -> None:
        """Add the numbers of odd storeys, periods, masses, and of heights without either."""
        height, count = numbers[f"height_{i}"], self._count["height"]
        alone = (height > 0.0) & (height < 1e6)
        if numbers.has(name := f"storeys_{i}"):
            storeys = numbers[name]
            alone &= np.isnan(storeys)
            counted = (storeys >= 2.0) & (height > 0.0)
            count["storeys"] += _number(counted)
            count["high storeys"] += _number(counted & (height > HIGH_STOREY * storeys))
        if numbers.has(name := f"period_{i}"):
            alone &= np.isnan(numbers[name])
            self._add_periods(numbers, i)
        if numbers.has(f"mass_{i}"):
            mass = _storey_mass(numbers, i)
            self._count["mass"]["all"] += _number(mass > 0.0)
            self._count["mass"]["light"] += _number(mass < STOREY_MASS[0])
        # Heights without storeys and period: feet, or numbers of storeys
        if not alone.any():
            return
        count["alone"] += _number(alone)
        count["low"] += _number(alone & (height < LOWEST_FEET))
        count["high"] += _number(alone & (height > HIGH_FEET))
        apart = alone & (place.distance >= LINE)
        count["apart"] += _number(apart)
        count["slender"] += _number(apart & (height > SLENDER * place.distance))
        count["whole"] += _number(alone & (height == np.floor(height)) & (height <= 60.0))
        count["one or two"] += _number(alone & (height <= 2.0))

    def _add_periods(self, numbers: _Numbers, i: int) -> None:
        """Add the numbers of periods that are too short, or would fit as frequencies."""
        period, count = numbers[f"period_{i}"], self._count["period"]
        with np.errstate(divide="ignore", invalid="ignore"):
            ratio, logarithm = np.log(_period_ratio(numbers, i)), np.log(period)
        # Period and frequency are alike near 1
        decides = np.isfinite(ratio) & (np.abs(logarithm) > 0.35)
        as_frequency = np.abs(2.0 * logarithm - ratio) < np.abs(ratio)
        count["all"] += _number(np.isfinite(ratio))
        count["decides"] += _number(decides)
        count["frequency"] += _number(decides & as_frequency)
        count["short"] += _number(ratio < np.log(SHORT_PERIOD))

    def _add_azimuths(self, numbers: _Numbers, place: _Places) -> None:
        """Add the numbers of azimuths that fit the positions, or would in another form."""
        if not numbers.has("azimuth"):
            return
        azimuth, count = numbers["azimuth"], self._count["azimuth"]
        turns = {"": azimuth, "backwards": azimuth + 180.0, "from east": 90.0 - azimuth}
        angle = place.angle_to(azimuth)
        count["compared"] += _number(angle >= 0.0)
        for name, turned in turns.items():
            count[f"fits {name}"] += _number(place.angle_to(turned) <= FITS)
        count["fits along the wall"] += _number(np.abs(angle - 90.0) < 90.0 - FITS)
        above = azimuth > 0.0
        small = above & (azimuth <= 2.0 * np.pi + 0.01)
        count["all"] += _number(above)
        count["small"] += _number(small)
        count["decimals"] += _number(small & (azimuth != np.floor(azimuth)))
        radians = np.rad2deg(np.where(small | (azimuth == 0.0), azimuth, np.nan))
        count["fits in radians"] += _number(place.angle_to(radians) <= FITS)

    def _add_cells(self, place: _Places, lines: NDArray[np.int64]) -> None:
        """Add the pairs of each cell of one degree."""
        valid = place.is_valid
        east, north = place.longitude[0][valid], place.latitude[0][valid]
        cell = np.clip(np.floor(east) + 180, 0, 359) * 180 + np.clip(np.floor(north) + 90, 0, 179)
        code = cell.astype(np.int64)
        self._cells += np.bincount(code, minlength=360 * 180)
        # Backwards, so that the first line of a new cell stays
        is_new = self._cell_line[code] == _INT_MAX
        if is_new.any():
            self._cell_line[code[is_new][::-1]] = lines[valid][is_new][::-1]

    def _limits(self) -> Iterator[tuple[str, _Limit, int, int]]:
        """Yield columns with a limit, the numbers above it and those above 0."""
        for limit in _LIMITS:
            for name in (limit.column, f"{limit.column}_1", f"{limit.column}_2"):
                count = self._count.get(name, Counter())
                # Outlines have whatever gap was asked for, with decimals
                drawn = name == "gap" and self._is_drawn and count["whole"] < count["all"]
                if count and not drawn:
                    yield name, limit, count[f"above {limit.above}"], count["above 0"]

    def units(self) -> dict[str, str]:
        """Return the units that the columns may have."""
        units = {
            name: limit.unit for name, limit, above, every in self._limits() if 2 * above > every
        }
        if unit := self._round_gaps()[0]:
            units.setdefault("gap", unit)
        for i in (1, 2):
            if self._feet():
                units.setdefault(f"height_{i}", "ft")
            if self._is_light():
                units.setdefault(f"mass_{i}", "t")
        if self._azimuth_form() == "in radians":
            units["azimuth"] = "rad"
        return units

    def _round_gaps(self) -> tuple[str, str]:
        """Return unit and reason of gaps that are too round for metres, empty if none are."""
        count = self._count["gap"]
        every = count["all"]
        if every < FEWEST:
            return "", ""
        if count["whole"] == every:
            return "cm", "are whole metres: given in centimetres or millimetres"
        if count["quarters"] == every and 2 * count["metres"] > every:
            return "in", "are quarters of a metre, most of them above 1 m: given in inches"
        if count["twelfths"] == every and len(self._twelfths) >= 3:
            return "ft", "are twelfths of a metre, as inches are of a foot: given in feet"
        return "", ""

    def _feet(self) -> str:
        """Return why heights may be in feet, empty if they may not."""
        count, period = self._count["height"], self._count["period"]
        if 2 * count["high storeys"] > count["storeys"]:
            of = f"{count['high storeys']} of {count['storeys']}"
            return f"heights: {of} with two storeys or more make floors above {HIGH_STOREY:g} m"
        alone = count["alone"]
        slender = 2 * count["slender"] > count["apart"] or not count["apart"]
        few_low, mostly_high = 50 * count["low"] <= alone, 2 * count["high"] > alone
        if alone > FEWEST and few_low and mostly_high and slender:
            low = f"{count['low']} of {alone} without storeys are below {LOWEST_FEET:g} m"
            return f"heights: {low} and {count['high']} above {HIGH_FEET:g} m"
        if period["all"] > 3 and 2 * period["short"] > period["all"]:
            of = f"{period['short']} of {period['all']}"
            return f"periods: {of} are below {SHORT_PERIOD:g} of what the heights suggest"
        return ""

    def _is_light(self) -> bool:
        """Return whether most masses are too small for kilograms."""
        return 2 * self._count["mass"]["light"] > self._count["mass"]["all"]

    def _azimuth_form(self) -> str:
        """Return the form in which azimuths fit the positions, empty if it is the right one."""
        count = self._count["azimuth"]
        compared, fitting = count["compared"], count["fits "]
        if compared >= 3:
            forms = ("in radians", "backwards", "from east", "along the wall")
            best = max(forms, key=lambda form: count[f"fits {form}"])
            is_better = 5 * count[f"fits {best}"] >= 4 * compared and 2 * fitting <= compared
            if is_better:
                return best
            # Directions of an axis are 0 to 180: half of them point backwards
            if 4 * count["fits backwards"] > compared and 5 * fitting <= 4 * compared:
                return "partly backwards"
            return "anyhow" if 2 * fitting < compared else ""
        every = count["all"]
        is_small = every >= FEWEST and count["small"] == every and count["decimals"]
        return "in radians" if is_small else ""

    def sentences(self) -> list[str]:
        """Return a sentence per suspicion, of columns first: their rows are not repeated."""
        columns = [*self._gap_sentence(), *self._limit_sentences()]
        columns += [*self._building_sentences(), *self._azimuth_sentence()]
        explained = {subject for subject, _ in columns}
        rows = [
            f"{reason}: {count} of {self.rows} rows, {self._first[subject, reason]}"
            for (subject, reason), count in self._odd.items()
            if subject not in explained
        ]
        return [*(sentence for _, sentence in columns), *self._mirrored(), *rows]

    def _gap_sentence(self) -> Iterator[tuple[str, str]]:
        """Yield a sentence about gaps that are wide or round, with its subject."""
        wide, every = self._count["gap"][f"above {WIDE_GAP}"], self._count["gap"]["all"]
        reason = self._round_gaps()[1]
        if 2 * wide > every and "gap" in self.units():
            mend = "given in centimetres or millimetres?"
            yield "gaps", f"{wide} of {every} gaps above 0 are wider than {WIDE_GAP:g} m: {mend}"
        elif reason:
            yield "gaps", f"all {every} gaps above 0 {reason}?"

    def _limit_sentences(self) -> Iterator[tuple[str, str]]:
        """Yield a sentence per column that mostly exceeds a limit, with its subject."""
        units = self.units()
        for name, limit, above, every in self._limits():
            if 2 * above > every and units[name] == limit.unit and name != "gap":
                unit = COLUMNS[name].unit.replace("1", "")
                of = f"{above} of {every} above {limit.above:g} {unit}".strip()
                yield name, f"{name}: {of}: given in {_UNIT_WORDS[limit.unit]}?"

    def _building_sentences(self) -> Iterator[tuple[str, str]]:
        """Yield sentences about heights, periods, masses and areas together, with the subjects."""
        height, period, mass = (self._count[name] for name in ("height", "period", "mass"))
        feet = self._feet()
        if period["decides"] > 2 and 2 * period["frequency"] > period["decides"]:
            of = f"{period['frequency']} of {period['decides']}"
            yield "periods", f"periods: {of} fit the heights better as frequencies: given in Hz?"
        elif feet:
            yield feet.partition(":")[0], f"{feet}: heights given in feet?"
        alone = height["alone"]
        if alone > FEWEST and height["whole"] == alone and height["one or two"]:
            few = f"{height['one or two']} of them 1 or 2"
            yield "heights", f"heights: all {alone} are whole metres, {few}: numbers of storeys?"
        if self._is_light():
            of = f"{mass['light']} of {mass['all']} below {STOREY_MASS[0]:g} kg per storey"
            yield "masses", f"masses: {of}: given in tonnes or kN?"
        area = self._count["area"]
        if area["all"] >= FEWEST and 2 * area["close"] > area["all"]:
            of = f"{area['close']} of {area['all']} pairs are too close for them"
            yield "areas", f"areas: {of}: in square feet, or of all storeys?"

    def _azimuth_sentence(self) -> Iterator[tuple[str, str]]:
        """Yield a sentence about azimuths that do not follow the positions, with its subject."""
        form, count = self._azimuth_form(), self._count["azimuth"]
        meant = "degrees clockwise from north, from building 1 to building 2, are expected"
        of = f"azimuths: {count['fits ']} of {count['compared']} follow the positions"
        if form == "in radians" and count["compared"] < 3:
            yield "azimuths", f"azimuths: all {count['all']} are at most 2 pi: given in radians?"
        elif form and f"fits {form}" in count:
            east = " counter-clockwise" if form == "from east" else ""
            better = f"{count[f'fits {form}']} would if given {form}{east}"
            yield "azimuths", f"{of}, {better}: {meant}"
        elif form:
            opposite = f"{count['fits backwards']} the opposite direction"
            yield "azimuths", f"{of}, {opposite}: {meant}"

    def _mirrored(self) -> Iterator[str]:
        """Yield a sentence per way in which few pairs mirror the place of many."""
        grid = self._cells.reshape(360, 180)
        ways = {
            "longitude has lost its sign": lambda east, north: (-east - 1, north),
            "latitude has lost its sign": lambda east, north: (east, -north - 1),
            "both signs are lost": lambda east, north: (-east - 1, -north - 1),
            "longitude and latitude are exchanged": lambda east, north: (north, east),
        }
        cells = np.argwhere(grid) - (180, 90)
        for way, mirror in ways.items():
            few, first, many = 0, _INT_MAX, 0
            for east, north in cells.tolist():
                other = mirror(east, north)
                is_near = max(abs(other[0] - east), abs(other[1] - north)) <= MIRROR
                if is_near or abs(other[1]) > 90:
                    continue
                here, there = _pairs_around(grid, east, north), _pairs_around(grid, *other)
                if 0 < here <= FEW_MIRRORED * there:
                    few += int(grid[east + 180, north + 90])
                    many = max(many, there)
                    line = self._cell_line[(east + 180) * 180 + north + 90]
                    first = min(first, int(line))
            if few:
                pairs = f"{few} pairs, the first in line {first}, mirror the place of {many} others"
                yield f"positions: {pairs}, as if {way}"


def _pairs_around(grid: NDArray[np.int64], east: int, north: int) -> int:
    """Return the pairs in a cell and the eight around it."""
    columns = np.arange(east + 179, east + 182) % 360
    rows = slice(max(north + 89, 0), north + 92)
    return int(grid[columns, rows].sum())


def _number(mask: NDArray[np.bool_]) -> int:
    """Return how many are true."""
    return int(np.count_nonzero(mask))


def _quoted(table: pa.Table, name: str, row: int) -> str:
    """Return a cell as it is quoted in a sentence."""
    if name not in table.column_names:
        return f"{name} is empty"
    value = table[name][row].as_py()
    if isinstance(value, float):
        unit = COLUMNS[name].unit.replace("1", "").replace("degrees", "")
        return f"{name} = {value:.9g} {unit}".rstrip()
    return f"{name} = {str(value).strip()!r:.40}"
