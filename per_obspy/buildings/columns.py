"""Columns of ``rows.parquet`` and ``buildings.parquet``, with units, meanings and flags."""

from per_obspy.buildings.chains import ROW_FLAGS
from per_obspy.inventory.schema import Column

#: Flags of the history of a row, and the meaning of each.
HISTORY_FLAGS: dict[str, str] = {
    "several_stations": "the nearest stations of its pairs differ: the one of most pairs serves",
    "no_record": "no record serves it (a map does): there is no history",
    "no_history": "its history could not be computed: see rejected.csv",
    "one_horizontal": "the station has one horizontal: it shakes the row whatever its axis",
    "values_reconciled": "two pairs differ about a building: a given value, else the mean is used",
}

#: All flags of a row.
FLAGS: dict[str, str] = {**ROW_FLAGS, **HISTORY_FLAGS}

#: Flags of a building in addition to those of its rows, and the meaning of each.
BUILDING_FLAGS: dict[str, str] = {
    "hit_only_in_row": "it is hit in its row at a gap that its pair alone does not close",
    "floor_to_column": "floors of a neighbour may hit its columns: outside the method",
}


def _number(name: str, unit: str, meaning: str) -> Column:
    return Column(name, "float64", unit, meaning)


def _count(name: str, meaning: str) -> Column:
    return Column(name, "int64", "1", meaning)


def _text(name: str, meaning: str) -> Column:
    return Column(name, "str", "", meaning)


def _truth(name: str, meaning: str) -> Column:
    return Column(name, "bool", "", meaning)


_SIDES = tuple(
    column
    for side in ("left", "right")
    for column in (
        _text(f"building_id_{side}", f"building on the {side}; PAIR#1 if the table has no name"),
        _count(f"building_number_{side}", "number of the building; names need not be unique"),
        _number(f"amplification_{side}", "1", "largest radius in the row / without contact"),
        _number(f"displacement_{side}", "m", "largest displacement of the oscillator in the row"),
        _number(
            f"amplification_alone_{side}", "1", "largest radius in the pair alone / without contact"
        ),
    )
)

#: One row per interface of a row of buildings.
ROWS: tuple[Column, ...] = (
    _text("row_id", "identifier of the row: R- and the first of the names of its pairs"),
    _count("buildings", "number of buildings of the row"),
    _count(
        "interface",
        "number of the interface; 1 is between the first and the second building of the row",
    ),
    _text("pair_id", "pair of this interface in the risk table"),
    _truth("turned", "whether building 1 of the pair is the one on the right"),
    *_SIDES,
    _number(
        "azimuth", "degrees", "azimuth of the axis of the row, from its first to its last building"
    ),
    _text("station", "station of the record that drives the row; empty without one"),
    _number("gap", "m", "clear distance at this interface"),
    _count("impacts", "impacts above 1 mm/s and 1 % of the fastest; empty without a history"),
    _number("impact_velocity", "m/s", "largest approach velocity in the row; 0 without impact"),
    _number("impact_velocity_84", "m/s", "impact_velocity that 84 in 100 contacts do not exceed"),
    _count(
        "impacts_alone",
        "impacts of the pair alone; as in risk.parquet where it meets others in the row",
    ),
    _number("impact_velocity_alone", "m/s", "largest approach velocity of that pair, 0 if none"),
    _number("longitude", "degrees", "longitude of the middle of the pair or of the building, east"),
    _number("latitude", "degrees", "latitude of the middle of the pair or of the building, north"),
    _text("flags", "flags of the row, separated by spaces, each explained in a row flag_..."),
)

#: Compass sides of a building: names of their columns, and the azimuth of the middle of each.
COMPASS = {"north": 0.0, "east": 90.0, "south": 180.0, "west": 270.0}

#: Places of a building among its neighbours.
POSITIONS = ("inside", "end", "corner", "single")

#: One row per building, worst first.
BUILDINGS: tuple[Column, ...] = (
    _count(
        "rank",
        "order of inspection, by severity (of an unknown gap what its demand stands for), "
        "amplification, probability, importance",
    ),
    _text("building_id", "identifier in the pair table; PAIR#1 or PAIR#2 without one"),
    _number(
        "severity",
        "m/s",
        "largest over the pairs of the building of weighted_velocity plus "
        "the increase of the impact velocity in the exact history of the row",
    ),
    _text("risk_class", "class of the severity, by the names and thresholds of the pairs"),
    _number(
        "probability_independent",
        "1",
        "probability that any neighbour hits the building, if pairs are independent",
    ),
    _number(
        "probability_common",
        "1",
        "probability that any neighbour hits the building, if one cause decides all "
        "pairs: the largest of them",
    ),
    _text(
        "position",
        "place of the building: inside its row; end of it; corner of two rows; "
        "single: it has one pair",
    ),
    _count("neighbours", "number of neighbouring buildings across a gap"),
    _count(
        "neighbours_that_can_hit",
        "number of neighbours whose pair has a state other than no, or an impact in the row",
    ),
    _count("impacts", "hits in all rows of the building; empty without a history"),
    *(
        _count(f"impacts_{side}", f"hits in all rows of the building from the {side}")
        for side in COMPASS
    ),
    _number("impact_velocity", "m/s", "largest approach velocity in the rows of the building"),
    _number("impact_velocity_84", "m/s", "impact_velocity that 84 in 100 contacts do not exceed"),
    _number("amplification_row", "1", "largest radius in a row / largest radius without contact"),
    _number(
        "amplification_pair",
        "1",
        "largest radius in the worst of its pairs, each alone / largest radius without contact",
    ),
    _text("worst_neighbour", "neighbour of the largest severity"),
    _text("worst_pair", "pair_id of the pair with worst_neighbour"),
    _number("worst_azimuth", "degrees", "azimuth towards worst_neighbour; empty if unknown"),
    _text(
        "prevention", "measures that would have prevented or else softened the hits of the building"
    ),
    _number(
        "missing_gap",
        "m",
        "largest missing gap of its pairs; enough only if all of its row are widened together",
    ),
    _number(
        "supplemental_damping",
        "1",
        "largest supplemental damping of its pairs; empty if 0.4 is too little for one",
    ),
    _number(
        "bumper_restitution",
        "1",
        "smallest bumper restitution of its pairs; empty if none helps at one",
    ),
    _truth("floors_misaligned", "whether floors of a neighbour may hit its columns"),
    _text("rows", "row_id of its rows, separated by spaces"),
    _count("longest_row", "number of buildings of the longest row of the building"),
    _text("area", "area or cell of its worst pair, as in totals.csv"),
    _number("longitude", "degrees", "longitude of the middle of the pair or of the building, east"),
    _number("latitude", "degrees", "latitude of the middle of the pair or of the building, north"),
    _number("importance", "1", "importance factor; empty if unknown"),
    _number("occupants", "1", "people in the building; empty if unknown"),
    _text("flags", "of its rows and of itself, separated by spaces; each explained in flag_..."),
)
