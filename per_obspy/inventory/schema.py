"""
The one schema of the pair table: every column with its type, unit, meaning and allowed range.

Readers check against it, writers order by it, simulated inventories obey it and the documentation
prints it. One row is one pair of neighbouring buildings; ``_1`` and ``_2`` mark the two buildings,
and the axis points from 1 to 2.
"""

from collections.abc import Collection
from math import inf
from typing import NamedTuple

#: Structural systems: walls of masonry without reinforcement (adobe and earth too) and with it
#: (confined too); timber, infilled frames and anything unknown are ``other``.
SYSTEMS = (
    "steel_mrf",
    "concrete_mrf",
    "concrete_frame_wall",
    "concrete_wall",
    "ebf_brbf",
    "masonry",
    "reinforced_masonry",
    "other",
)

#: Words for an empty cell, in lower case.
EMPTY = frozenset({"", "na", "n/a", "nan", "none", "null", "<na>", "-"})

#: Place of the pair in its row of houses: ``end`` if either building has no further neighbour.
POSITIONS = ("end", "inside")

#: Source of a gap's standard deviation: a known value or an assumed default; or, whatever it is, a
#: gap between outlines that were learned from images.
DEVIATION_SOURCES = ("given", "assumed", "learned")

#: What an earlier earthquake did to a pair: its gap is what the history left, or nobody knows.
AFTER_DAMAGE = ("residual", "unknown")

#: Whether both buildings are within one property.
ONE_PROPERTY = ("yes", "no")


class Column(NamedTuple):
    """
    One column of the pair table.

    Attributes
    ----------
    name : str
        Name in the file.
    dtype : str
        ``"float64"``, or ``"str"`` for text.
    unit : str
        SI unit, ``"1"`` if dimensionless, empty for text.
    meaning : str
        One line for the user.
    required : bool
        Whether every file must have the column and every row a value in it.
    may_be_empty : bool
        Whether rows of a required column may be empty.
    low, high : float
        Closed range of numbers, in the column's unit.
    choices : tuple of str
        The texts allowed; empty if any text is.
    hint : str
        Usual mistake behind a value above the range.
    hint_below : str
        Usual mistake behind a value below the range.
    """

    name: str
    dtype: str
    unit: str
    meaning: str
    required: bool = False
    low: float = -inf
    high: float = inf
    choices: tuple[str, ...] = ()
    hint: str = ""
    may_be_empty: bool = False
    hint_below: str = ""


#: Smallest quantity that counts as above zero: a tenth of a millimetre, a tenth of a millisecond.
TINY = 1e-4

_PAIR = (
    Column("pair_id", "str", "",
           "identifier of the pair, unique in its file; the number of its row where there is none"),
    Column("gap", "float64", "m",
           "clear distance between the buildings at the contact height, 0 if they touch; empty if "
           "unknown",
           required=True, may_be_empty=True, low=0.0, high=10.0,
           hint="given in millimetres or centimetres by mistake?"),
    Column("gap_std", "float64", "m", "standard deviation of the measured gap",
           low=0.0, high=3.0, hint="in centimetres or millimetres?"),
    Column("gap_std_source", "str", "",
           "whether gap_std is given, assumed, or that of outlines learned from images",
           choices=DEVIATION_SOURCES),
    Column("gap_before", "float64", "m",
           "gap before an earlier earthquake, whose history left the gap of the row",
           low=0.0, high=10.0),
    Column("after_damage", "str", "",
           "residual: the gap is what the history of an earlier earthquake left; unknown: an "
           "earlier earthquake may have damaged the pair in a way that no history followed",
           choices=AFTER_DAMAGE),
    Column("azimuth", "float64", "degrees",
           "direction from building 1 to building 2, clockwise from north", low=0.0, high=360.0),
    Column("contact_height", "float64", "m", "height at which the buildings meet first",
           low=TINY, high=1000.0),
    Column("floor_offset", "float64", "m",
           "height between a floor of one building and the nearest floor of the other",
           low=-12.0, high=12.0, hint="in centimetres?", hint_below="in centimetres?"),
    Column("facing_length", "float64", "m", "length over which the walls face each other",
           low=0.0, high=1000.0),
    Column("position", "str", "", "whether the pair is at the end of its row of buildings",
           choices=POSITIONS),
    Column("same_property", "str", "",
           "whether both buildings are within one property; code rules take the larger gap where "
           "it is empty", choices=ONE_PROPERTY),
    Column("period_correlation", "float64", "1",
           "correlation of the uncertainties of both periods; alike neighbours miss a period "
           "formula alike", low=0.0, high=1.0, hint="a fraction is expected, not per cent"),
    Column("restitution", "float64", "1", "coefficient of restitution of impact",
           low=0.0, high=1.0, hint="a fraction is expected, not per cent"),
    Column("contact_log_std", "float64", "1",
           "log-standard deviation of impact velocities by the contact law and the restitution",
           low=0.0, high=2.0),
    Column("vs30", "float64", "m/s", "mean shear-wave velocity of the upper 30 m of ground",
           low=30.0, high=4000.0, hint="in cm/s?", hint_below="in km/s?"),
    Column("site_class", "str", "",
           "site class of the ground, compared with that of the station"),
    Column("observed", "float64", "1",
           "1 if pounding was seen in the event, 0 if looked for and not seen",
           low=0.0, high=1.0),
    Column("cell_notes", "str", "",
           "cells of the row that were not understood and are left empty, and gaps that are read "
           "from a range, an estimate or a limit"),
)  # fmt: skip

_BUILDING = (
    Column("building_id", "str", "", "identifier of the building"),
    Column("longitude", "float64", "degrees", "longitude of the building, east", required=True,
           low=-180.0, high=180.0,
           hint="metres of a projection?"),
    Column("latitude", "float64", "degrees", "latitude of the building, north", required=True,
           low=-90.0, high=90.0,
           hint="longitude and latitude swapped, or metres of a projection?"),
    Column("position", "str", "", "whether the building is at the end of its row of buildings",
           choices=POSITIONS),
    Column("height", "float64", "m", "height of the building from ground to roof",
           low=2.0, high=1000.0,
           hint="metres above ground expected"),
    Column("height_log_std", "float64", "1",
           "logarithmic standard deviation of an estimated height, or of the storeys from which it "
           "follows; above 0 it marks the height as derived", low=0.0, high=2.0),
    Column("storeys", "float64", "1", "number of storeys above ground", low=1.0, high=250.0),
    Column("system", "str", "", "structural system of the building", choices=SYSTEMS),
    Column("period", "float64", "s", "first natural period in the direction of the axis",
           low=0.01, high=20.0, hint="in milliseconds?"),
    Column("period_log_std", "float64", "1", "logarithmic standard deviation of the period",
           low=0.0, high=2.0),
    Column("damping", "float64", "1", "fraction of critical damping", low=0.0, high=1.0 - 1e-9,
           hint="a fraction is expected, not per cent"),
    Column("damping_log_std", "float64", "1", "logarithmic standard deviation of the damping",
           low=0.0, high=2.0),
    Column("mass", "float64", "kg", "total mass", low=1.0, high=1e12),
    Column("area", "float64", "m2", "floor area of one storey", low=1.0, high=1e6),
    Column("participation", "float64", "1",
           "displacement at contact height / displacement of the oscillator",
           low=TINY, high=3.0, hint="a ratio is expected, not per cent"),
    Column("yield_displacement", "float64", "m",
           "yield displacement of the equivalent oscillator; infinite if it stays "
           "linear", low=TINY),
    Column("yield_log_std", "float64", "1",
           "logarithmic standard deviation of the yield displacement", low=0.0, high=2.0),
    Column("yield_coefficient", "float64", "1",
           "base shear at yield / total weight of the building; the oscillator yields at that over "
           "the effective mass ratio 3(N+1)/(2(2N+1)) of N storeys, 1 where they are unknown",
           low=TINY, high=3.0, hint="a fraction is expected, not per cent"),
    Column("hardening", "float64", "1", "stiffness after yield / stiffness before",
           low=0.0, high=1.0 - 1e-9),
    Column("occupants", "float64", "1", "people in the building", low=0.0, high=1e6),
    Column("importance", "float64", "1", "importance factor", low=0.0, high=10.0),
)  # fmt: skip


def _of_building(column: Column, index: int) -> Column:
    """Return the column for building 1 or 2."""
    name, meaning = f"{column.name}_{index}", f"building {index}: {column.meaning}"
    return column._replace(name=name, meaning=meaning)


#: Every column of a pair table with a meaning in the package, by name; others are carried through.
COLUMNS: dict[str, Column] = {
    column.name: column
    for column in (
        *_PAIR,
        *(_of_building(column, 1) for column in _BUILDING),
        *(_of_building(column, 2) for column in _BUILDING),
    )
}  # fmt: skip

#: Groups of which a file must have at least one column, and each row at least one value.
ONE_OF = tuple((f"height_{i}", f"storeys_{i}", f"period_{i}") for i in (1, 2))


def missing_columns(names: Collection[str]) -> list[tuple[str, ...]]:
    """Return the required columns that are not among these, with those that would do instead."""
    required = [(column.name,) for column in COLUMNS.values() if column.required]
    return [group for group in (*required, *ONE_OF) if not set(group) & set(names)]


#: Columns of a search in outlines: where a height is from, and an outline that is not drawn.
OF_OUTLINES = tuple(f"{name}_source_{i}" for name in ("height", "outline") for i in (1, 2))

#: Columns that ``completed_pairs`` adds to those above.
COMPLETED: dict[str, Column] = {
    column.name: column
    for column in (
        Column("place", "str", "",
               "neighbourhood and street by columns of the pair table; risk.csv fills the nearest "
               "town where there is none"),
        *(
            Column(f"name_{i}", "str", "",
                   f"building {i}: name, or street and house number, or address, by columns of the "
                   "pair table")
            for i in (1, 2)
        ),
        Column("longitude", "float64", "degrees", "longitude of the middle of the pair, east"),
        Column("latitude", "float64", "degrees", "latitude of the middle of the pair, north"),
        *(
            Column(f"contact_mass_{i}", "float64", "kg",
                   f"building {i}: generalised first-mode mass at contact height")
            for i in (1, 2)
        ),
        *(
            Column(f"hazus_yield_{i}", "float64", "m",
                   f"building {i}: yield displacement of the oscillator by HAZUS, for its system, "
                   "storeys and the assumed code level; empty where the system is unknown")
            for i in (1, 2)
        ),
        Column(
            "floors_misaligned",
            "bool",
            "",
            "floors of one building may hit columns of the other: outside the method",
        ),
        Column("soft_ground", "bool", "", "Vs30 below 180 m/s, or site class E or F without one"),
        Column("derived", "str", "", "columns of this row that were derived or assumed, not given"),
    )
}  # fmt: skip

#: Suspicions of single rows and the meaning of each; chosen limits are in :mod:`.suspicions`.
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
