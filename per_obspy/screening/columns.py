"""Columns of the risk table in their order, with units and meanings; flags and their meanings."""

from collections.abc import Iterable, Mapping
from functools import cache
from types import MappingProxyType

import pandas as pd

from per_obspy.inventory.schema import COLUMNS, COMPLETED, Column
from per_obspy.screening.codes import rule_columns
from per_obspy.screening.meanings import FLAGS


def _number(name: str, unit: str, meaning: str) -> Column:
    return Column(name, "float64", unit, meaning)


def _whole_number(name: str, unit: str, meaning: str) -> Column:
    return Column(name, "int64", unit, meaning)


def _text(name: str, meaning: str) -> Column:
    return Column(name, "str", "", meaning)


def _per_building(name: str, unit: str, meaning: str) -> tuple[Column, Column]:
    first = _number(f"{name}_1", unit, f"building 1: {meaning}")
    second = _number(f"{name}_2", unit, f"building 2: {meaning}")
    return first, second


#: Columns of quantiles of the demand, and the share of outcomes that does not exceed each. The gap
#: with a chance of contact from 0.9 to 0.02 follows from them: against all nodes of 600 pairs its
#: error is 4 % (root mean square), in 99 of 100 at most 16 %.
DEMAND_SHARES = {f"demand_{share:02d}": share / 100.0 for share in (2, 10, 25, 50, 75, 90, 98)}

#: Columns that the risk table adds to the completed pair table.
RESULTS: dict[str, Column] = {
    column.name: column
    for column in (
        _whole_number(
            "rank",
            "",
            "order of severity, 1 is the worst: by weighted_velocity, then amplification, "
            "probability, importance; a pair of unknown gap as if its buildings touched",
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
            "rule of the demand: exact, per_white_noise, per_record, linearized, srss, "
            "shakemap or amplitudes",
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
        *(
            _number(
                name,
                "m",
                f"demand that {share:.0%} of outcomes do not exceed, over all uncertain"
                " values but the gap",
            )
            for name, share in DEMAND_SHARES.items()
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
        *_per_building(
            "residual",
            "m",
            "displacement at contact height at which the exact history leaves it, positive from 1 "
            "to 2; empty where no building can yield, or the record does not support the pair",
        ),
        _number("residual_gap", "m", "gap + residual_2 - residual_1, at least 0"),
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
            "elastic displacement / yield displacement by HAZUS; above 1 the building yields (flag "
            "assumed_strength), or would yield, which is not modelled (flag beyond_elastic); empty "
            "where its system is unknown or a yield value is given",
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
    "demand", "demand_rule", "demand_ratio", "impact_velocity", "impacts", "impact_velocity_exact",
    "amplification_exact_1", "amplification_exact_2", "residual_1", "residual_2", "residual_gap",
    "single_hit_status", "amplification_1",
    "amplification_2", "flags", "station", "distance", "azimuth_used", "azimuth_rule",
    "period_1", "period_2", "damping_1", "damping_2", "participation_1", "participation_2",
    "per_1", "per_2", "sd_1", "sd_2", "correlation", "correlation_record", "critical_gap_per",
    "critical_gap_record", "critical_gap_linearized", "correlation_linearized", "ductility_1",
    "ductility_2", "elastic_ratio_1", "elastic_ratio_2", "critical_gap_sd", "srss_gap",
    "absolute_gap", "demand_estimated",
    "estimate_rule", "demand_exact", "estimate_over_exact", "demand_two_sided", "missing_gap",
    "supplemental_damping", "bumper_restitution", "ln_per_ratio_1", "ln_per_ratio_2",
    "ln_per_std_1", "ln_per_std_2", "contact_mass_1", "contact_mass_2", "restitution",
    "derived", *DEMAND_SHARES,
)  # fmt: skip

#: Columns that a seismic hazard gives beside those of a design spectrum.
HAZARD: dict[str, Column] = {
    column.name: column
    for column in (
        Column(
            "annual_probability",
            "float64",
            "1",
            "of pounding within a year by the hazard, earthquakes coming as a Poisson process",
        ),
        Column(
            "annual_probability_bound",
            "str",
            "",
            "at least: the pair also pounds in motions more frequent than those of the hazard file",
        ),
        Column(
            "gap_for_target",
            "float64",
            "m",
            "gap that contact exceeds with the annual rate of the configuration (target_rate)",
        ),
        Column(
            "missing_gap_for_target",
            "float64",
            "m",
            "widening to the gap_for_target; 0 if the gap of the table, taken as right, has it",
        ),
    )
}

#: Columns of ``risk.csv`` and ``design.csv``, as far as the table has them; the rules of codes that
#: were asked for follow.
CSV_COLUMNS = (
    "rank", "pair_id", "risk_class", "state", "probability", "expected_impact_velocity",
    "configuration", "weighted_velocity", "gap", "demand", "demand_rule", "missing_gap",
    "supplemental_damping", "bumper_restitution", "flags", "place", "name_1", "name_2",
    "building_id_1", "building_id_2", "longitude", "latitude", "station", "distance",
    "storeys_1", "storeys_2", "system_1", "system_2",
)  # fmt: skip

#: Columns of a CSV file at most: a person reads it.
MOST_COLUMNS = 30

#: Columns that depend on the contact law, whose own deviation is 5 to 20 %: texts have two digits.
BY_CONTACT = frozenset(
    {
        *("expected_impact_velocity", "impact_velocity_84", "expected_amplification"),
        "weighted_velocity",
        *("impact_velocity", "impact_velocity_exact", "worst_expected_impact_velocity"),
        *(f"amplification{exact}_{i}" for exact in ("", "_exact") for i in (1, 2)),
    }
)


def csv_columns(names: Iterable[str]) -> list[str]:
    """
    Return the columns of a table that its CSV file has, in their order, at most ``MOST_COLUMNS``.

    Rules of codes that have no room are in the Parquet file, as is everything else.
    """
    known = set(names)
    always = [name for name in (*CSV_COLUMNS, *HAZARD) if name in known]
    *rules, suffices = [name for name in rule_columns() if name in known] or [""]
    return [*always, *rules[: MOST_COLUMNS - len(always) - 1], *filter(None, [suffices])]


@cache
def _known() -> dict[str, Column]:
    """Return every column that the package defines, by name."""
    # probabilities in a year are those of an ensemble too
    gaps = {name: column for name, column in HAZARD.items() if column.unit == "m"}
    return COLUMNS | COMPLETED | RESULTS | rule_columns() | gaps


def known_column(name: str) -> Column | None:
    """Return unit and meaning of a column of the risk table; None for columns of the user."""
    return _known().get(name)


def column_table(
    names: Iterable[str],
    own: Mapping[str, Column] = MappingProxyType({}),
    flags: Mapping[str, str] = MappingProxyType(FLAGS),
) -> pd.DataFrame:
    """
    Return unit and meaning of columns, then of every flag, as written to ``risk.columns.csv``.

    Parameters
    ----------
    names : iterable of str
        Columns of a risk table.
    own : mapping of str to Column
        Columns with another meaning than in a risk table, or none there.
    flags : mapping of str to str
        Flags and their meanings.

    Returns
    -------
    DataFrame
        Columns ``name, unit, in_csv, meaning``; one row per column and one ``flag_<name>`` per
        flag. ``in_csv`` is ``yes`` for the columns of the CSV file, the Parquet file has all.
    """
    names = list(names)
    short = set(csv_columns(names))
    # Columns that the user added to the pair table are not in the schema
    known, carried = {**_known(), **own}, _text("", "carried through from the pair table")
    columns = [known.get(name, carried) for name in names]
    table = {
        "name": [*names, *(f"flag_{name}" for name in flags)],
        "unit": [*(column.unit for column in columns), *([""] * len(flags))],
        "in_csv": [*("yes" if name in short else "no" for name in names), *([""] * len(flags))],
        "meaning": [*(column.meaning for column in columns), *flags.values()],
    }
    return pd.DataFrame(table)
