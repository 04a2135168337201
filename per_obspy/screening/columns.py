"""The columns of the risk table in their order; units and meanings stand here or in the schema of the pair table."""

from collections.abc import Iterable
from functools import cache

import pandas as pd

from per_obspy.inventory.schema import COLUMNS, COMPLETED, Column
from per_obspy.screening.codes import rule_columns


def _both(name: str, unit: str, meaning: str) -> tuple[Column, Column]:
    first, second = (
        Column(f"{name}_{i}", "float64", unit, f"building {i}: {meaning}") for i in (1, 2)
    )
    return first, second


#: What the risk table adds to the completed pair table.
RESULTS: dict[str, Column] = {
    column.name: column
    for column in (
        Column("rank", "int64", "", "1 is the worst: by state, probability, impact velocity, ratio, importance"),
        Column("risk_class", "str", "", "by demand ratio; names and thresholds are in the configuration"),
        Column("state", "str", "", "yes: gap < demand; possible: likely enough, or a derived input decides; no"),
        Column("probability", "float64", "1", "of pounding in this event, with what is uncertain of the pair"),
        Column("demand", "float64", "m", "gap needed at contact height, by the rule in demand_rule"),
        Column("demand_rule", "str", "", "exact, per_white_noise, per_record, linearized, srss or shakemap"),
        Column("demand_estimated", "float64", "m", "the largest estimate, which is the demand where none is exact"),
        Column("estimate_rule", "str", "", "which estimate that is: per_white_noise, per_record, linearized or srss"),
        Column("estimate_over_exact", "float64", "1", "demand_estimated / demand_exact; empty where there is none"),
        Column("demand_ratio", "float64", "1", "gap / demand; 0 when touching, empty where the demand is 0"),
        Column("impact_velocity", "float64", "m/s", "approach velocity of the single hit with the estimated demand"),
        Column("single_hit_status", "str", "", "ok, no_pounding, no_grazing_state or inconsistent_critical_gap"),
        *_both("amplification", "1", "PER after a single hit / before, at least 1; empty without a grazing state"),
        Column("flags", "str", "", "names separated by spaces, each explained in a row flag_..."),
        Column("station", "str", "", "whose record is used: the nearest in reach on the same site class, or of all"),
        Column("distance", "float64", "m", "from the station to the middle of the pair, along the great circle"),
        Column("azimuth_used", "float64", "degrees", "of the ground motion, the same for both buildings"),
        Column("azimuth_rule", "str", "", "given; worst: of all for this demand; station: its only horizontal"),
        *_both("per", "m", "pseudo energy radius of the oscillator, to be multiplied by its participation"),
        *_both("sd", "m", "spectral displacement of the oscillator, to be multiplied by its participation"),
        Column("correlation", "float64", "1", "of the two responses to white noise, eq. (16)"),
        Column("correlation_record", "float64", "1", "of the two responses to this record, over all time"),
        Column("critical_gap_per", "float64", "m", "eq. (15) from PER and eq. (16), at contact height"),
        Column("critical_gap_record", "float64", "m", "eq. (15) from PER and correlation_record, at contact height"),
        Column("critical_gap_sd", "float64", "m", "eq. (15) from SD and eq. (16), at contact height"),
        Column("srss_gap", "float64", "m", "root of the sum of the squared PER, at contact height"),
        Column("demand_exact", "float64", "m", "exact largest relative displacement of 1 towards 2"),
        Column("demand_two_sided", "float64", "m", "the same in either order of the buildings, for design"),
        Column("impacts", "int64", "1", "in the exact history with this record and gap"),
        Column("impact_velocity_exact", "float64", "m/s", "largest approach velocity in that history"),
        *_both("amplification_exact", "1", "largest radius with pounding / without, in that history"),
        Column("absolute_gap", "float64", "m", "sum of the PER, at contact height"),
        *_both("ln_per_ratio", "1", "ln(PER at the site / PER of the record), at 5 % damping, RotD50"),
        *_both("ln_per_std", "1", "log-standard deviation of that; its spatial correlation was published for SA"),
        Column("critical_gap_linearized", "float64", "m", "eq. (15) of equivalent linear buildings, at contact height"),
        Column("correlation_linearized", "float64", "1", "eq. (16) of them; in narrow motion not above correlation"),
        *_both("ductility", "1", "estimated displacement / yield displacement; up to 1 it stays elastic"),
        Column("missing_gap", "float64", "m", "by which the gap is below the demand; 0 where it is enough"),
        Column("supplemental_damping", "float64", "1", "estimate: least to add to both; empty: 0.4 is too little"),
        Column("bumper_restitution", "float64", "1", "estimate: largest for target_amplification; empty: none helps"),
    )
}  # fmt: skip

#: The leading columns; the rest of the completed pair table follows them.
ORDER = (
    "rank", "pair_id", "risk_class", "state", "probability", "gap", "demand", "demand_rule", "demand_ratio",
    "impact_velocity",
    "impacts", "impact_velocity_exact", "amplification_exact_1", "amplification_exact_2", "single_hit_status",
    "amplification_1", "amplification_2", "flags", "station", "distance", "azimuth_used",
    "azimuth_rule", "period_1", "period_2", "damping_1", "damping_2", "participation_1", "participation_2", "per_1",
    "per_2", "sd_1", "sd_2", "correlation", "correlation_record", "critical_gap_per", "critical_gap_record",
    "critical_gap_linearized", "correlation_linearized", "ductility_1", "ductility_2", "critical_gap_sd", "srss_gap",
    "absolute_gap", "demand_estimated", "estimate_rule", "demand_exact", "estimate_over_exact", "demand_two_sided",
    "missing_gap", "supplemental_damping", "bumper_restitution",
    "ln_per_ratio_1", "ln_per_ratio_2", "ln_per_std_1", "ln_per_std_2", "contact_mass_1", "contact_mass_2",
    "restitution", "derived",
)  # fmt: skip

#: Flags of a pair and what each means.
FLAGS: dict[str, str] = {
    "touching": "gap 0: the single hit is outside its reliable range",
    "single_hit_unreliable": "gap below 0.6 of the demand: several impacts are likely, the single hit may be too low",
    "outside_usable_periods": "a building's period is outside the usable periods of the station's record",
    "per_far_above_sd": "PER/SD above the configured limit: a gap from PER is far too large",
    "far_station": "the station is further away than the configured distance for this flag",
    "one_horizontal": "the station has one horizontal: its azimuth is used whatever the pair's",
    "derived_inputs": "the row has derived inputs, named in the column derived",
    "derived_period": "a period was derived: the demand is at least SRSS and the state is never a plain no",
    "linearized_not_converged": "no ductility up to 40 was found: the linearized demand is that of 40, often too large",
    "no_damping_suffices": "it pounds, and no damping added up to 0.4 of critical keeps the buildings apart",
    "no_bumper_suffices": "it pounds, and no restitution keeps the single hit within target_amplification",
    "no_demand": "the demand is 0 (the oscillators move as one or not at all): there is no demand ratio",
    "floor_to_column": "floors do not meet floors: outside the method",
    "record_from_other_site_class": "no station of the pair's site class is in reach: the nearest of another serves",
    "motion_from_other_site_class": "no station on the site's class told its motion: those of other classes served",
    "shakemap_demand": "no station in reach: demand from the SD of a ShakeMap, without PER, record and exact history",
    "shakemap_assumed_deviation": "the ShakeMap tells no deviation: the configured one is assumed",
    "simulated": "the ground motion is simulated",
}


@cache
def _known() -> dict[str, Column]:
    return COLUMNS | COMPLETED | RESULTS | rule_columns()


def known_column(name: str) -> Column | None:
    """Return what is known of a column of the risk table; None if it is carried through."""
    return _known().get(name)


def column_table(names: Iterable[str]) -> pd.DataFrame:
    """Return unit and meaning of each of these columns, then of every flag, as written to ``risk.columns.csv``."""
    carried = Column("", "", "", "carried through from the pair table")
    columns = [(name, known_column(name) or carried) for name in names]
    rows = [(name, column.unit, column.meaning) for name, column in columns]
    flags = [(f"flag_{name}", "", meaning) for name, meaning in FLAGS.items()]
    return pd.DataFrame(rows + flags, columns=["name", "unit", "meaning"])
