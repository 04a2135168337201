"""Columns of the risk table in their order, with units and meanings; flags and their meanings."""

from collections.abc import Iterable
from functools import cache

import pandas as pd

from per_obspy.inventory.schema import COLUMNS, COMPLETED, Column
from per_obspy.inventory.suspicions import ROW_SUSPICIONS
from per_obspy.screening.codes import rule_columns


def _number(name: str, unit: str, meaning: str) -> Column:
    """Return a column of numbers."""
    return Column(name, "float64", unit, meaning)


def _whole_number(name: str, unit: str, meaning: str) -> Column:
    """Return a column of whole numbers."""
    return Column(name, "int64", unit, meaning)


def _text(name: str, meaning: str) -> Column:
    """Return a column of text."""
    return Column(name, "str", "", meaning)


def _per_building(name: str, unit: str, meaning: str) -> tuple[Column, Column]:
    """Return a column of numbers for each of the two buildings."""
    first = _number(f"{name}_1", unit, f"building 1: {meaning}")
    second = _number(f"{name}_2", unit, f"building 2: {meaning}")
    return first, second


#: Columns that the risk table adds to the completed pair table.
RESULTS: dict[str, Column] = {
    column.name: column
    for column in (
        _whole_number(
            "rank",
            "",
            "order of severity, 1 is the worst: by weighted_velocity, then "
            "amplification, probability, importance",
        ),
        _text(
            "risk_class",
            'class of the weighted_velocity by configured thresholds; "gap unknown" without a gap',
        ),
        _text(
            "configuration",
            "what makes a hit more harmful: floor_to_column, tall_beside_low (two storeys and "
            "more), light_beside_heavy (twice the mass and more), end_of_row",
        ),
        _number(
            "weighted_velocity",
            "m/s",
            "expected_impact_velocity times the factor of the configuration: 2 for floor_to_column,"
            " else 1.5 for tall_beside_low, else 1; class and rank follow it",
        ),
        _text(
            "state",
            "state by probability: yes, likely, possible, unlikely or no; unknown if "
            "the gap is unknown",
        ),
        _number(
            "probability",
            "1",
            "probability of pounding in this event, over all uncertain values of the pair",
        ),
        _number(
            "expected_impact_velocity",
            "m/s",
            "mean impact velocity over all uncertain values of the pair; 0 for outcomes "
            "without contact",
        ),
        _number(
            "impact_velocity_84",
            "m/s",
            "impact velocity that 84 of 100 outcomes do not exceed; 0 without contact",
        ),
        _number(
            "expected_amplification",
            "1",
            "mean ratio of the largest radius with pounding to that without, of the "
            "more amplified building; 1 without contact",
        ),
        _number(
            "demand",
            "m",
            "gap needed to prevent pounding, at contact height, by the rule in demand_rule",
        ),
        _text(
            "demand_rule",
            "rule of the demand: exact, per_white_noise, per_record, linearized, srss or shakemap",
        ),
        _number(
            "demand_estimated",
            "m",
            "largest estimate of the demand; it is the demand where demand_exact is empty",
        ),
        _text(
            "estimate_rule",
            "rule of demand_estimated: per_white_noise, per_record, linearized or srss",
        ),
        _number(
            "estimate_over_exact",
            "1",
            "demand_estimated / demand_exact; empty where demand_exact is empty",
        ),
        _number(
            "demand_ratio",
            "1",
            "gap / demand; 0 for touching buildings, empty where the demand is 0",
        ),
        _number(
            "impact_velocity",
            "m/s",
            "approach velocity of the single hit with the estimated demand",
        ),
        _text(
            "single_hit_status",
            "status of the single-hit estimate: ok, no_pounding, no_grazing_state or "
            "inconsistent_critical_gap",
        ),
        *_per_building(
            "amplification",
            "1",
            "ratio of PER after a single hit to PER before, at least 1; empty without a "
            "grazing state",
        ),
        _text(
            "flags",
            "names of flags separated by spaces; each is explained in a row flag_... of this table",
        ),
        _text(
            "station",
            "station of the record: the nearest in reach on the same site class, or else of all",
        ),
        _number(
            "distance",
            "m",
            "distance from the station to the middle of the pair, along the great circle",
        ),
        _number(
            "azimuth_used",
            "degrees",
            "azimuth of the ground motion, clockwise from north, the same for both buildings",
        ),
        _text(
            "azimuth_rule",
            "rule of azimuth_used: given; worst: azimuth of the largest demand; "
            "station: azimuth of its only horizontal",
        ),
        *_per_building(
            "per",
            "m",
            "pseudo energy radius of the oscillator; multiply it by participation for "
            "contact height",
        ),
        *_per_building(
            "sd",
            "m",
            "spectral displacement of the oscillator; multiply it by participation for "
            "contact height",
        ),
        _number("correlation", "1", "correlation of the two responses to white noise, eq. (16)"),
        _number(
            "correlation_record",
            "1",
            "correlation of the two responses to this record, over its whole duration",
        ),
        _number(
            "critical_gap_per",
            "m",
            "critical gap by eq. (15) from PER and eq. (16), at contact height",
        ),
        _number(
            "critical_gap_record",
            "m",
            "critical gap by eq. (15) from PER and correlation_record, at contact height",
        ),
        _number(
            "critical_gap_sd",
            "m",
            "critical gap by eq. (15) from SD and eq. (16), at contact height",
        ),
        _number("srss_gap", "m", "root of the sum of the squared PER, at contact height"),
        _number(
            "demand_exact",
            "m",
            "exact largest relative displacement of building 1 towards building 2; the "
            "worse direction if the azimuth is unknown",
        ),
        _number(
            "demand_two_sided",
            "m",
            "exact largest relative displacement in either direction, as design needs it",
        ),
        _whole_number(
            "impacts",
            "1",
            "number of impacts in the exact history that are faster than 1 mm/s and "
            "than 1 % of the fastest one",
        ),
        _number(
            "impact_velocity_exact",
            "m/s",
            "largest approach velocity in the exact history, also of slow impacts; 0 "
            "without an impact",
        ),
        *_per_building(
            "amplification_exact",
            "1",
            "ratio of the largest radius with pounding to that without, in the exact history",
        ),
        _number("absolute_gap", "m", "sum of the PER of both buildings, at contact height"),
        *_per_building(
            "ln_per_ratio", "1", "ln(PER at the site / PER of the record), at 5 % damping, RotD50"
        ),
        *_per_building(
            "ln_per_std",
            "1",
            "log-standard deviation of PER at the site; its spatial correlation was "
            "published for SA",
        ),
        _number(
            "critical_gap_linearized",
            "m",
            "critical gap by eq. (15) of equivalent linear buildings, at contact height",
        ),
        _number(
            "correlation_linearized",
            "1",
            "correlation by eq. (16) of equivalent linear buildings; not above "
            "correlation in narrow motion",
        ),
        *_per_building(
            "ductility",
            "1",
            "estimated displacement / yield displacement; the building stays elastic up to 1",
        ),
        *_per_building(
            "elastic_ratio",
            "1",
            "elastic displacement / yield displacement by HAZUS; above 1 the building would yield, "
            "which is not modelled; empty where its system is unknown or a yield value is given",
        ),
        _number("missing_gap", "m", "demand minus gap; 0 where the gap is enough"),
        _number(
            "supplemental_damping",
            "1",
            "least damping to add to both buildings so that the demand fits into the "
            "gap, fraction of critical: by exact displacements where demand_rule is "
            "exact, else an estimate; empty where 0.4 is too little",
        ),
        _number(
            "bumper_restitution",
            "1",
            "estimated largest restitution of a bumper that keeps the amplification "
            "within target_amplification; empty where none does",
        ),
    )
}

#: The leading columns; the rest of the completed pair table follows them.
ORDER = (
    "rank", "pair_id", "risk_class", "state", "probability", "expected_impact_velocity",
    "impact_velocity_84", "expected_amplification", "configuration", "weighted_velocity", "gap",
    "demand", "demand_rule", "demand_ratio",
    "impact_velocity", "impacts", "impact_velocity_exact",
    "amplification_exact_1", "amplification_exact_2", "single_hit_status", "amplification_1",
    "amplification_2", "flags", "station", "distance", "azimuth_used", "azimuth_rule",
    "period_1", "period_2", "damping_1", "damping_2", "participation_1", "participation_2",
    "per_1", "per_2", "sd_1", "sd_2", "correlation", "correlation_record", "critical_gap_per",
    "critical_gap_record", "critical_gap_linearized", "correlation_linearized", "ductility_1",
    "ductility_2", "elastic_ratio_1", "elastic_ratio_2", "critical_gap_sd", "srss_gap",
    "absolute_gap", "demand_estimated",
    "estimate_rule", "demand_exact", "estimate_over_exact", "demand_two_sided", "missing_gap",
    "supplemental_damping", "bumper_restitution", "ln_per_ratio_1", "ln_per_ratio_2",
    "ln_per_std_1", "ln_per_std_2", "contact_mass_1", "contact_mass_2", "restitution",
    "derived",
)  # fmt: skip

#: Flags that the processing raises for a record, which every pair of its station has.
RECORD_FLAGS = (
    "baseline_shift",
    "second_event",
    "clipped",
    "wrapped",
    "filled",
    "implausible_record",
    "assumed_corners",
    "digitised",
    "undated",
    "contradicting_coordinates",
    "implausible_amplitude",
    "implausible_place",
    "repeated_record",
    "record_warning",
)

#: Rules of the demand by which ``demand_rule`` names them, in words.
DEMAND_RULES: dict[str, str] = {
    "exact": "exact for the record",
    "per_white_noise": "estimate from PER",
    "per_record": "estimate from PER and the record's correlation",
    "linearized": "estimate for yielding buildings",
    "srss": "SRSS, because a period is derived",
    "shakemap": "from a ShakeMap",
    "sd_white_noise": "estimate from the spectrum",
    "sd_srss": "SRSS of the spectrum, because a period is derived",
}

#: Flags of a pair and the meaning of each.
FLAGS: dict[str, str] = {
    "unknown_gap": (
        "the pair table gives no gap: the demand is the gap needed; probability, state and impacts "
        "are empty, or those of the gap that the configuration assumes"
    ),
    "doubtful_cell": (
        "a cell of the pair table was not understood and is left empty, or a gap is a range, an "
        "estimate or a limit: see cell_notes"
    ),
    "touching": "gap 0: the single hit is outside its reliable range",
    "single_hit_unreliable": (
        "gap below 0.6 of the demand: several impacts are likely, the single hit may be too low"
    ),
    "beyond_elastic": (
        "a building would yield, which is not modelled: its elastic displacement is elastic_ratio "
        "times the yield displacement of HAZUS for its system, storeys and assumed code level"
    ),
    "outside_usable_periods": (
        "a building's period is outside the usable periods of the station's record"
    ),
    "per_far_above_sd": "PER/SD above the configured limit: a gap from PER is far too large",
    "far_station": "the station is further away than the configured distance for this flag",
    "one_horizontal": "the station has one horizontal: its azimuth is used whatever the pair's",
    "unknown_azimuths": (
        "the azimuths of the station's horizontals are unknown: the demand is the largest of all, "
        "and its azimuth is from the first sensor"
    ),
    "derived_inputs": "the row has derived inputs, named in the column derived",
    "derived_period": (
        "a period was derived: the demand is at least SRSS; state and rank follow from resampling"
    ),
    "soft_ground": (
        "the ground is soft: the soil lengthens periods, by which derived ones are less certain"
    ),
    "linearized_not_converged": (
        "no ductility up to 40 was found: the linearized demand is that of 40, often too large"
    ),
    "no_damping_suffices": (
        "it pounds, and no damping added up to 0.4 of critical keeps the buildings apart"
    ),
    "no_bumper_suffices": (
        "it pounds, and no restitution keeps the single hit within target_amplification"
    ),
    "no_demand": (
        "the demand is 0 (the oscillators move as one or not at all): there is no demand ratio"
    ),
    "floor_to_column": "floors do not meet floors: outside the method",
    "record_from_other_site_class": (
        "no station of the pair's site class is in reach: the nearest of another serves"
    ),
    "motion_from_other_site_class": (
        "no station of the site's class contributes to the motion at the site: others do"
    ),
    "shakemap_demand": (
        "no station in reach: demand from the SD of a ShakeMap, "
        "without PER, record and exact history"
    ),
    "shakemap_assumed_deviation": (
        "the ShakeMap contains no deviation: the configured one is assumed"
    ),
    "baseline_shift": (
        "the baseline of the station's record shifted during the shaking: long periods are "
        "doubtful, and not usable where PER depends on when it shifted"
    ),
    "second_event": ("the station's record holds another event: its demand may be that of both"),
    "clipped": (
        "the station's record may have reached the limit of its sensor or recorder: the motion may "
        "have been stronger"
    ),
    "wrapped": ("the counter of the station's record overflowed: peaks continue at its other end"),
    "filled": (
        "a gap of the station's record was filled during the shaking: the motion there is unknown"
    ),
    "implausible_record": (
        "unit, sampling interval or components of the station's record contradict what the ground "
        "can do, or each other: see stations.csv"
    ),
    "assumed_corners": (
        "a filter corner of the station's record is assumed: neither noise nor header gives it"
    ),
    "digitised": (
        "the station's record was digitised from film: short and long periods are less certain"
    ),
    "undated": (
        "the start time of the station's record is unknown: it may be of another earthquake"
    ),
    "contradicting_coordinates": (
        "two sources place the station more than 1 km apart: see stations.csv"
    ),
    "implausible_amplitude": (
        "the station's peaks differ from its neighbours or from a ground-motion model by more than "
        "4 deviations: see stations.csv"
    ),
    "implausible_place": (
        "the station's coordinates are an empty field, exchanged, or lack a sign: see stations.csv"
    ),
    "repeated_record": (
        "the station's record is that of another station, perhaps times a factor: see stations.csv"
    ),
    "record_warning": (
        "the station's record failed another check that only warns: see stations.csv"
    ),
    "simulated": "the ground motion is simulated",
    **ROW_SUSPICIONS,
}


@cache
def _known() -> dict[str, Column]:
    """Return every column that the package defines, by name."""
    return COLUMNS | COMPLETED | RESULTS | rule_columns()


def known_column(name: str) -> Column | None:
    """Return unit and meaning of a column of the risk table; None for columns of the user."""
    return _known().get(name)


def column_table(names: Iterable[str]) -> pd.DataFrame:
    """
    Return unit and meaning of columns, then of every flag, as written to ``risk.columns.csv``.

    Parameters
    ----------
    names : iterable of str
        Columns of a risk table.

    Returns
    -------
    DataFrame
        Columns ``name, unit, meaning``; one row per column and one ``flag_<name>`` per flag.
    """
    rows = []
    # Columns that the user added to the pair table are not in the schema
    carried = _text("", "carried through from the pair table")
    for name in names:
        column = known_column(name) or carried
        rows.append((name, column.unit, column.meaning))
    rows += [(f"flag_{name}", "", meaning) for name, meaning in FLAGS.items()]
    return pd.DataFrame(rows, columns=["name", "unit", "meaning"])
