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
    _Limit("height", TOWER, "cm"), _Limit("height", 5000.0, "mm"),
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

#: Columns of what another row may describe otherwise.
_SEEN_IN = {
    "height": ("height",),
    "number of storeys": ("storeys",),
    "period": ("period",),
    "system": ("system",),
    "place": ("longitude", "latitude"),
}

_INT_MAX = np.iinfo(np.int64).max


class _Odd(NamedTuple):
    """Rows that are odd for one reason: flag, subject, reason, rows, quoted cells or example."""

    flag: str
    subject: str
    reason: str
    rows: NDArray[np.bool_]
    columns: tuple[str, ...]
    example: str = ""


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

    def height(self, i: int) -> FloatArray:
        """Return heights of building i, m, from storeys where they are not given."""
        height = self[f"height_{i}"]
        if not self.has(f"storeys_{i}"):
            return height
        return np.where(np.isnan(height), STOREY * self[f"storeys_{i}"], height)

    def period_ratio(self, i: int) -> FloatArray:
        """Return periods of building i over those of frames of its height, if both are possible."""
        name = f"ratio_{i}"
        if name in self._columns or not self.has(f"period_{i}"):
            return self._columns.get(name, self._missing)
        height, period = self.height(i), self[f"period_{i}"]
        possible = (height > 0.0) & (height <= TOWER) & (period > 0.0)
        possible &= period <= COLUMNS[f"period_{i}"].high
        # Few rows of most tables give periods
        ratio = self._missing.copy()
        ratio[possible] = period[possible] / (FRAME_PERIOD * height[possible] ** FRAME_EXPONENT)
        self._columns[name] = ratio
        return ratio

    def storey_mass(self, i: int) -> FloatArray:
        """Return masses of building i per storey, kg, NaN where they are not above 0."""
        storeys = np.fmax(np.where(self.height(i) > 0.0, self.height(i) / STOREY, 1.0), 1.0)
        counted = np.fmax(np.where(self[f"storeys_{i}"] > 0.0, self[f"storeys_{i}"], storeys), 1.0)
        # Nothing else tells how many storeys there are: one
        mass = self[f"mass_{i}"]
        return np.where(mass > 0.0, mass, np.nan) / counted


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
    # Truth values and dates are no numbers
    elif not (pa.types.is_floating(cells.type) or pa.types.is_integer(cells.type)):
        return np.full(len(cells), np.nan)
    numbers: FloatArray = pc.cast(cells, pa.float64(), safe=False).to_numpy()
    return numbers


class _Places:
    """Positions of the pairs of some rows: distance, m, and direction, degrees from north."""

    def __init__(self, numbers: _Numbers) -> None:
        self.longitude = (numbers["longitude_1"], numbers["longitude_2"])
        self.latitude = (numbers["latitude_1"], numbers["latitude_2"])
        with np.errstate(invalid="ignore", over="ignore"):
            in_range = [np.abs(degrees) <= 180.0 for degrees in self.longitude]
            in_range += [np.abs(degrees) <= 90.0 for degrees in self.latitude]
            # On a sphere taken as flat, across the date line too
            north = self.latitude[1] - self.latitude[0]
            east = _turned(self.longitude[1] - self.longitude[0])
            east *= np.cos(np.deg2rad(self.latitude[0]))
            distance = METRES_PER_DEGREE * np.hypot(north, east)
        # Pairs that are too far apart are rejected
        in_range.append(distance <= LARGEST_SEPARATION)
        self.is_valid: NDArray[np.bool_] = np.logical_and.reduce(in_range)
        self.distance = np.where(self.is_valid, distance, np.nan)
        self.direction = np.rad2deg(np.arctan2(east, north))

    def beyond(self, numbers: _Numbers, per_root: float) -> FloatArray:
        """Return the distance beyond the gap and so many times the roots of the areas, m."""
        with np.errstate(invalid="ignore"):
            roots = np.sqrt(numbers["area_1"]) + np.sqrt(numbers["area_2"])
        return self.distance - np.nan_to_num(np.clip(numbers["gap"], 0.0, 10.0)) - per_root * roots

    def angle_to(self, azimuth: FloatArray) -> FloatArray:
        """Return the angle between azimuths and the lines between positions, 0 to 180 degrees."""
        with np.errstate(invalid="ignore"):
            angle = np.abs(_turned(azimuth - self.direction))
            return np.where(self.distance >= LINE, angle, np.nan)


def _turned(angle: FloatArray) -> FloatArray:
    """Return an angle in degrees as -180 to 180."""
    return angle - 360.0 * np.rint(angle / 360.0)


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
        odd = [*_odd_gaps(numbers, place), *_odd_places(numbers, place)]
        for i in (1, 2):
            odd += [*_odd_sizes(numbers, i), *_odd_oscillators(numbers, i)]
            odd += _odd_masses(numbers, i)
        odd += [*_odd_contacts(numbers), *self._repeated(table, numbers, place, lines, repeated)]
        # Count the odd rows, then whole columns
        found = [one for one in odd if one.rows.any()]
        account.add_rows(found, table, lines)
        account.add_columns(numbers, place, lines)
        if not found:
            return np.full(len(table), "", dtype=object)
        # Flags of a row in the order of their meanings
        flags = {name: np.zeros(len(table), dtype=bool) for name in ROW_SUSPICIONS}
        for one in found:
            flags[one.flag] |= one.rows
        return joined_names(flags)

    def _repeated(
        self,
        table: pa.Table,
        numbers: _Numbers,
        place: _Places,
        lines: NDArray[np.int64],
        repeated: NDArray[np.bool_],
    ) -> Iterator[_Odd]:
        """Yield rows with a pair or a building that an earlier row has."""
        comparable = place.is_valid & ~repeated
        again, earlier, contradicting = self._earlier.compare(table, numbers, comparable, lines)
        reason = "the same two buildings as in an earlier row"
        # Its line in the file of the earlier row
        first = int(earlier[np.argmax(again)]) if again.any() else 0
        yield _Odd("repeated_pair", "", reason, again, (), f"as line {first}")
        # Each difference of either building
        for name, buildings in contradicting.items():
            rows: NDArray[np.bool_] = np.logical_or(buildings[:, 0], buildings[:, 1])
            i = int(np.argmax(buildings[np.argmax(rows)])) + 1
            reason = f"a building_id with another {name} than in an earlier row"
            columns = tuple(f"{column}_{i}" for column in ("building_id", *_SEEN_IN[name]))
            yield _Odd("contradicting_building", "", reason, rows, columns)

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
    equal = place.distance < SAME_PLACE
    yield _Odd("odd_positions", "", "both buildings at one position", equal, corners[:2])
    # By the areas where both are known
    far = place.distance - np.nan_to_num(np.clip(numbers["gap"], 0.0, 10.0)) > FAR_APART
    if numbers.has("area_1", "area_2"):
        beyond = place.beyond(numbers, PER_ROOT_AREA)
        far = np.where(np.isnan(beyond), far, (beyond > 0.0) & (place.distance > SMALLEST_FAR))
    columns = (*corners, "gap")
    yield _Odd("odd_positions", "", "positions too far apart for the gap", far, columns)
    # A contact may lie aside of the centres, but hardly across
    if numbers.has("azimuth"):
        across = place.angle_to(numbers["azimuth"]) > ACROSS
        reason = "the azimuth is across or against the line between the positions"
        yield _Odd("odd_azimuth", "azimuths", reason, across, ("azimuth", *corners))


def _odd_sizes(numbers: _Numbers, i: int) -> Iterator[_Odd]:
    """Yield rows with an odd height or number of storeys of building i."""
    names = height_name, storeys_name = f"height_{i}", f"storeys_{i}"
    height, storeys = numbers[height_name], numbers[storeys_name]
    # Higher ones are rejected
    tower = (height > TOWER) & (height <= COLUMNS[height_name].high)
    yield _Odd("odd_height", height_name, f"{height_name} above {TOWER:g} m", tower, names[:1])
    if not numbers.has(storeys_name):
        return
    # Halves are usual for attics
    decimals = (storeys >= 1.0) & (2.0 * storeys != np.floor(2.0 * storeys))
    yield _Odd("odd_height", "", f"{storeys_name} with decimals", decimals, names[1:])
    high = (height > HIGH_STOREY * storeys) & (storeys >= 2.0)
    reason = f"{height_name} makes floors above {HIGH_STOREY:g} m, in feet?"
    yield _Odd("odd_height", "heights", reason, high, names)


def _odd_contacts(numbers: _Numbers) -> Iterator[_Odd]:
    """Yield rows with an odd contact height or floor offset."""
    if numbers.has("contact_height"):
        # One storey more, as some count them above the ground floor
        storeys = np.fmin(numbers["storeys_1"], numbers["storeys_2"])
        unknown = np.isnan(np.fmin(numbers["height_1"], numbers["height_2"]))
        above = unknown & (numbers["contact_height"] > 5.0 * (storeys + 1.0))
        columns = ("contact_height", "storeys_1", "storeys_2")
        reason = "contact_height above the lower roof"
        yield _Odd("odd_height", "contact_height", reason, above, columns)
    if numbers.has(name := "floor_offset"):
        # The nearest floor is at most half a storey away
        with np.errstate(divide="ignore", invalid="ignore"):
            storey = np.fmax(*(numbers[f"height_{i}"] / numbers[f"storeys_{i}"] for i in (1, 2)))
        half = np.where(np.isnan(storey), STOREY, storey / 2.0 + 0.1)
        large = np.abs(numbers[name]) > half
        yield _Odd("odd_height", name, f"{name} above half a storey", large, (name,))


def _odd_oscillators(numbers: _Numbers, i: int) -> Iterator[_Odd]:
    """Yield rows with an odd period, damping, strength or participation of building i."""
    # Stiffer or softer than any building but an isolated one
    ratio = numbers.period_ratio(i)
    odd = (ratio > ODD_PERIOD) | (ratio < 1.0 / ODD_PERIOD)
    sizes = [name for name in (f"height_{i}", f"storeys_{i}") if numbers.has(name)]
    reason = f"period_{i} does not fit the height"
    yield _Odd("odd_period", "periods", reason, odd, (f"period_{i}", *sizes))
    # Limits of single values
    for name, limit in {"damping": 0.3, "yield_coefficient": 1.0, "participation": 2.0}.items():
        if numbers.has(column := f"{name}_{i}"):
            above = (numbers[column] > limit) & (numbers[column] <= COLUMNS[column].high)
            yield _Odd("odd_building", column, f"{column} above {limit:g}", above, (column,))


def _odd_masses(numbers: _Numbers, i: int) -> Iterator[_Odd]:
    """Yield rows with an odd mass or yield displacement of building i."""
    if numbers.has(column := f"mass_{i}"):
        mass = numbers.storey_mass(i)
        odd = (mass < STOREY_MASS[0]) | (mass > STOREY_MASS[1])
        yield _Odd("odd_building", "masses", f"{column} is odd for its storeys", odd, (column,))
    if numbers.has(column := f"yield_displacement_{i}"):
        # A twentieth of the height is a drift of collapse, not of yield
        far = numbers[column] > 0.05 * np.nan_to_num(numbers.height(i), nan=20.0)
        far &= np.isfinite(numbers[column])
        yield _Odd("odd_building", column, f"{column} above 5 % of the height", far, (column,))


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

    def add_rows(self, found: list[_Odd], table: pa.Table, lines: NDArray[np.int64]) -> None:
        """Add rows that are odd by themselves."""
        self.rows += len(table)
        for one in found:
            key = one.subject, one.reason
            self._odd[key] += _number(one.rows)
            if key not in self._first:
                # Later chunks do not change the first one
                row = int(np.argmax(one.rows))
                cells = [_quoted(table, name, row) for name in one.columns]
                quoted = one.example or ", ".join(cells)
                self._first[key] = f"first in line {lines[row]}: {quoted}"

    def add_columns(self, numbers: _Numbers, place: _Places, lines: NDArray[np.int64]) -> None:
        """Add the counts of whole columns."""
        self._add_limits(numbers)
        self._add_gaps(numbers["gap"])
        self._is_drawn |= numbers.has("gap_std_source")
        # Quantities of buildings and of their places
        for i in (1, 2):
            self._add_building(numbers, place, i)
        if numbers.has("azimuth"):
            self._add_azimuths(numbers["azimuth"], place)
        if numbers.has("area_1", "area_2"):
            beyond = place.beyond(numbers, CLOSE_FOR_AREA)
            beyond[(place.distance < LINE) | (numbers["gap"] > WIDE_GAP)] = np.nan
            self._count["area"]["all"] += _number(~np.isnan(beyond))
            self._count["area"]["close"] += _number(beyond < 0.0)
        self._add_cells(place, lines)

    def _add_limits(self, numbers: _Numbers) -> None:
        """Add the numbers above limits."""
        for name in (one for one in COLUMNS if numbers.has(one)):
            bare = name.removesuffix("_1").removesuffix("_2")
            if limits := [limit.above for limit in _LIMITS if limit.column == bare]:
                # Infinite strength is no number of another unit
                values, count = np.abs(numbers[name]), self._count[name]
                values = np.where(values < 1e9, values, 0.0)
                count["above 0"] += _number(values > 0.0)
                for above in limits:
                    count[f"above {above}"] += _number(values > above)

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
        if len(self._twelfths) < 6:
            # Quarters are twelfths too, and no evidence
            inches = np.unique(twelfths[is_twelfth & (twelfths <= 120.0)])
            self._twelfths |= {int(inch) for inch in inches.tolist() if inch % 3}

    def _add_building(self, numbers: _Numbers, place: _Places, i: int) -> None:
        """Add the numbers of odd storeys, periods and masses, and heights without them."""
        # Halls of one storey may have any height
        height, storeys = numbers[f"height_{i}"], numbers[f"storeys_{i}"]
        count, mass_count = self._count["height"], self._count["mass"]
        counted = (storeys >= 2.0) & (height > 0.0)
        count["storeys"] += _number(counted)
        count["high storeys"] += _number(counted & (height > HIGH_STOREY * storeys))
        # Periods and masses by the height
        period = numbers[f"period_{i}"]
        self._add_periods(period, numbers.period_ratio(i))
        if numbers.has(f"mass_{i}"):
            mass = numbers.storey_mass(i)
            mass_count["all"] += _number(mass > 0.0)
            mass_count["light"] += _number(mass < STOREY_MASS[0])
        alone = (height > 0.0) & (height < 1e6) & np.isnan(storeys) & np.isnan(period)
        if alone.any():
            self._add_heights(height[alone], place.distance[alone])

    def _add_heights(self, height: FloatArray, distance: FloatArray) -> None:
        """Add heights without storeys and period, which may be in feet, or numbers of storeys."""
        count = self._count["height"]
        count["alone"] += height.size
        count["low"] += _number(height < LOWEST_FEET)
        count["high"] += _number(height > HIGH_FEET)
        count["apart"] += _number(distance >= LINE)
        count["slender"] += _number((distance >= LINE) & (height > SLENDER * distance))
        # Numbers of storeys are whole, and often 1 or 2
        count["whole"] += _number((height == np.floor(height)) & (height <= 60.0))
        count["one or two"] += _number(height <= 2.0)

    def _add_periods(self, period: FloatArray, ratio: FloatArray) -> None:
        """Add the numbers of periods that are too short, or would fit as frequencies."""
        count = self._count["period"]
        possible = ~np.isnan(ratio)
        period, ratio = np.log(period[possible]), np.log(ratio[possible])
        # Period and frequency are alike near 1; heights in feet make periods of frames longer
        decides = np.abs(period) > 0.35
        in_feet = np.abs(ratio - FRAME_EXPONENT * np.log(0.3048))
        as_frequency = np.abs(2.0 * period - ratio) < np.minimum(np.abs(ratio), in_feet)
        count["all"] += period.size
        count["decides"] += _number(decides)
        count["frequency"] += _number(decides & as_frequency)
        count["short"] += _number(ratio < np.log(SHORT_PERIOD))

    def _add_azimuths(self, azimuth: FloatArray, place: _Places) -> None:
        """Add the numbers of azimuths that do not fit the positions, and of other forms that do."""
        count = self._count["azimuth"]
        angle = place.angle_to(azimuth)
        astray = angle > FITS
        count["compared"] += _number(angle >= 0.0)
        count["astray"] += _number(astray)
        count["along the wall"] += _number(astray & (angle < 180.0 - FITS))
        # A circle has 2 pi radians, to two decimals
        small = azimuth <= 2.0 * np.pi + 0.01
        count["all"] += _number(azimuth > 0.0)
        count["small"] += _number(small & (azimuth > 0.0))
        count["decimals"] += _number(azimuth % 1.0 > 0.0)
        # Other forms of the azimuths that do not fit
        if astray.any():
            east = np.where(astray, 90.0 - azimuth, np.nan)
            radians = np.where(astray & small, np.rad2deg(azimuth), np.nan)
            count["from east"] += _number(place.angle_to(east) <= FITS)
            count["in radians"] += _number(place.angle_to(radians) <= FITS)

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
        columns = self._limits()
        units = {name: limit.unit for name, limit, above, every in columns if 2 * above > every}
        if unit := self._round_gaps()[0]:
            units.setdefault("gap", unit)
        # Of both buildings together
        for i in (1, 2):
            if self._feet()[0]:
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
        # Outlines and tapes do not give round gaps only
        if count["whole"] == every:
            return "cm", "are whole metres: given in centimetres or millimetres"
        if every > FEWEST and count["quarters"] == every and 2 * count["metres"] > every:
            return "in", "are quarters of a metre, most of them above 1 m: given in inches"
        if count["twelfths"] == every and len(self._twelfths) >= 3:
            return "ft", "are twelfths of a metre, as inches are of a foot: given in feet"
        return "", ""

    def _feet(self) -> tuple[str, str]:
        """Return why heights may be in feet, with the subject; empty if they may not."""
        count, period = self._count["height"], self._count["period"]
        if 2 * count["high storeys"] > count["storeys"]:
            of = f"{count['high storeys']} of {count['storeys']} make"
            return "heights", f"{of} floors above {HIGH_STOREY:g} m"
        # Neither storeys nor periods tell it: hardly any is low, most are high and slender
        alone, low, high = count["alone"], count["low"], count["high"]
        if (
            2 * count["slender"] >= count["apart"]
            and alone > FEWEST
            and 50 * low <= alone < 2 * high
        ):
            of = f"{low} of {alone} without storeys below {LOWEST_FEET:g} m"
            return "heights", f"{of}, {high} above {HIGH_FEET:g} m"
        # Periods of lower buildings
        if 3 < period["all"] < 2 * period["short"]:
            short = f"{period['short']} of {period['all']}"
            return "periods", f"{short} are far below what the heights suggest"
        return "", ""

    def _is_light(self) -> bool:
        """Return whether most masses are too small for kilograms."""
        return 2 * self._count["mass"]["light"] > self._count["mass"]["all"]

    def _azimuth_form(self) -> str:
        """Return the form in which azimuths fit the positions, empty if it is the right one."""
        count = self._count["azimuth"]
        compared, astray, every = count["compared"], count["astray"], count["all"]
        if compared >= 3:
            # Where the azimuth of an axis is given, half of them point backwards
            if 4 * astray < compared:
                return ""
            forms = ("in radians", "backwards", "from east", "along the wall")
            count["backwards"] = astray - count["along the wall"]
            best = max(forms, key=lambda form: count[form])
            return best if 10 * count[best] >= 9 * astray else "any way"
        is_small = every >= FEWEST and count["small"] == every and count["decimals"]
        return "in radians" if is_small else ""

    def sentences(self) -> list[str]:
        """Return a sentence per suspicion, of columns first: their rows are not repeated."""
        columns = [*self._gap_sentence(), *self._limit_sentences(), *self._height_sentence()]
        columns += [*self._mass_sentences(), *self._azimuth_sentence()]
        explained = {subject for subject, _ in columns}
        # Odd rows by their reason
        rows = [
            f"{reason}: {count} of {self.rows} rows, {self._first[subject, reason]}"
            for (subject, reason), count in self._odd.items()
            if subject not in explained
        ]
        return [*(sentence for _, sentence in columns), *self._mirrored(), *rows]

    def _gap_sentence(self) -> Iterator[tuple[str, str]]:
        """Yield a sentence about gaps that are wide or round, with its subject."""
        wide, every = self._count["gap"][f"above {WIDE_GAP}"], self._count["gap"]["all"]
        unit, reason = self._round_gaps()
        # Wide ones are more certain
        if 2 * wide > every and "gap" in self.units():
            mend = "given in centimetres or millimetres?"
            yield "gaps", f"{wide} of {every} gaps above 0 are wider than {WIDE_GAP:g} m: {mend}"
        elif unit:
            yield "gaps", f"all {every} gaps above 0 {reason}?"

    def _limit_sentences(self) -> Iterator[tuple[str, str]]:
        """Yield a sentence per column that mostly exceeds a limit, with its subject."""
        units = self.units()
        for name, limit, above, every in self._limits():
            # Of several limits the last one
            if 2 * above > every and units[name] == limit.unit and name != "gap":
                unit = COLUMNS[name].unit.replace("1", "")
                of = f"{above} of {every} above {limit.above:g} {unit}".strip()
                yield name, f"{name}: {of}: given in {_UNIT_WORDS[limit.unit]}?"

    def _height_sentence(self) -> Iterator[tuple[str, str]]:
        """Yield a sentence about heights and periods together, with its subject."""
        height, period = self._count["height"], self._count["period"]
        subject, feet = self._feet()
        whole, few = height["whole"], height["one or two"]
        # Storeys decide before periods do
        if subject == "heights":
            yield subject, f"heights: {feet}: given in feet?"
        elif period["decides"] > 2 and 2 * period["frequency"] > period["decides"]:
            of = f"{period['frequency']} of {period['decides']}"
            yield "periods", f"periods: {of} fit the heights better as frequencies: given in Hz?"
        elif subject:
            yield subject, f"periods: {feet}: heights given in feet?"
        # Heights that are numbers of storeys
        if height["alone"] > FEWEST and whole == height["alone"] and few:
            of = f"all {whole} are whole metres, {few} of them 1 or 2"
            yield "heights", f"heights: {of}: numbers of storeys?"

    def _mass_sentences(self) -> Iterator[tuple[str, str]]:
        """Yield sentences about masses and areas, with the subjects."""
        mass, area = self._count["mass"], self._count["area"]
        if self._is_light():
            of = f"{mass['light']} of {mass['all']} below {STOREY_MASS[0]:g} kg per storey"
            yield "masses", f"masses: {of}: given in tonnes or kN?"
        # Large areas of close centres
        if area["all"] >= FEWEST and 2 * area["close"] > area["all"]:
            of = f"{area['close']} of {area['all']} pairs are too close for them"
            yield "areas", f"areas: {of}: in square feet, or of all storeys?"

    def _azimuth_sentence(self) -> Iterator[tuple[str, str]]:
        """Yield a sentence about azimuths that do not follow the positions, with its subject."""
        form, count = self._azimuth_form(), self._count["azimuth"]
        meant = "degrees clockwise from north, from building 1 to building 2, are expected"
        if form == "in radians" and count["compared"] < 3:
            yield "azimuths", f"azimuths: all {count['all']} are at most 2 pi: given in radians?"
        elif form:
            # How many would follow the positions in another form
            others = f"{count['astray']} of {count['compared']} do not follow the positions"
            east = " counter-clockwise" if form == "from east" else ""
            better = f", {count[form]} would if given {form}{east}" if count[form] else ""
            yield "azimuths", f"azimuths: {others}{better}: {meant}"

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


def _number(mask: NDArray[np.bool_]) -> int:
    """Return how many are true."""
    return int(np.count_nonzero(mask))


def _quoted(table: pa.Table, name: str, row: int) -> str:
    """Return a cell as it is quoted in a sentence."""
    value = table[name][row].as_py() if name in table.column_names else ""
    # Text of a number stays as it is
    if isinstance(value, float):
        unit = COLUMNS[name].unit.replace("1", "").replace("degrees", "")
        return f"{name} = {value:.9g} {unit}".rstrip()
    return f"{name} = {str(value).strip()!r:.40}"
