"""
Screening by a design or user spectrum: demands and code rules without a record.

There is neither a record's correlation nor an exact history, and no PER: the radius is the spectral displacement. On
broad-band records the gap from SD and eq. (16) has a median of 0.97 of the exact one, a log-standard deviation of 0.14,
and is too small in two of three cases. A gap below it is a yes; the probability, which knows of that error, makes
others possible, and derived periods ask for SRSS at least.
"""

from typing import NamedTuple

import numpy as np
import pandas as pd
from numpy.typing import NDArray

from per_obspy.checks import FloatArray
from per_obspy.config import Building, Screening
from per_obspy.errors import Rejection
from per_obspy.inventory.completion import completed_pairs
from per_obspy.inventory.schema import Column
from per_obspy.pounding.correlation import ddc_correlation
from per_obspy.pounding.gap import absolute_gap, critical_gap, srss_gap
from per_obspy.pounding.single_hit import single_hit
from per_obspy.screening.codes import code_columns
from per_obspy.screening.demand import demand_ratio, pounding_state
from per_obspy.screening.design_probability import design_probability
from per_obspy.screening.design_spectrum import DesignSpectrum, displacement_at, within
from per_obspy.screening.flags import period_is_derived
from per_obspy.screening.ranking import risk_class, worst_first

#: What this table adds to the columns that a risk table has as well.
DESIGN: dict[str, Column] = {
    column.name: column
    for column in (
        Column("spectrum", "str", "", "file of the spectrum that was used instead of a record"),
        Column("srss_gap_sd", "float64", "m", "root of the sum of the squared SD, at contact height"),
        Column("absolute_gap_sd", "float64", "m", "sum of the SD, at contact height"),
        Column("demand_rule", "str", "", "what the demand is: sd_white_noise, or sd_srss for derived periods"),
        Column("probability", "float64", "1", "of pounding under the spectrum, with what is uncertain of the pair"),
    )
}

LEADING = (
    "rank", "pair_id", "risk_class", "state", "probability", "gap", "demand", "demand_rule", "demand_ratio",
    "impact_velocity", "single_hit_status", "amplification_1", "amplification_2", "spectrum", "sd_1", "sd_2",
    "correlation", "critical_gap_sd", "srss_gap_sd", "absolute_gap_sd",
)  # fmt: skip


#: Building 1 and building 2.
Both = tuple[FloatArray, FloatArray]


class _Pairs(NamedTuple):
    """What the physics takes of completed pairs."""

    period: Both
    damping: Both
    participation: Both
    mass: Both


def design_table(
    spectrum: DesignSpectrum, pairs: pd.DataFrame, building: Building, screening: Screening
) -> pd.DataFrame:
    """
    Return one row a pair, worst first, for a design or user spectrum.

    Parameters
    ----------
    spectrum : DesignSpectrum
        From :func:`~per_obspy.screening.design_spectrum.read_design_spectrum`.
    pairs : DataFrame
        From :func:`per_obspy.read_pairs`.
    building : Building
        What is assumed where the inventory is silent.
    screening : Screening
        Risk classes and the region's values for code rules.

    Returns
    -------
    DataFrame
        ``LEADING``, the rules of :func:`~per_obspy.screening.codes.code_columns`, then the completed pair table;
        ``attrs["rejected"]`` holds the pairs outside the periods or dampings of the spectrum, with both.
    """
    complete = completed_pairs(pairs, building)
    values = _values(complete)
    inside = np.all([within(spectrum, *one) for one in zip(values.period, values.damping, strict=True)], axis=0)
    rejected = _outside(spectrum, complete[~inside])
    table = _judged(spectrum, complete[inside].reset_index(drop=True), screening)
    ranked = worst_first(table, table["impact_velocity"])
    others = [name for name in ranked if name not in LEADING]
    ranked = ranked[[*LEADING, *others]]
    ranked.attrs["rejected"] = (*pairs.attrs.get("rejected", ()), *rejected)
    return ranked


def _values(pairs: pd.DataFrame) -> _Pairs:
    def both(name: str) -> Both:
        return pairs[f"{name}_1"].to_numpy(np.float64), pairs[f"{name}_2"].to_numpy(np.float64)

    return _Pairs(both("period"), both("damping"), both("participation"), both("contact_mass"))


def _outside(spectrum: DesignSpectrum, pairs: pd.DataFrame) -> tuple[Rejection, ...]:
    """Return why pairs cannot be judged by the spectrum."""
    ranges = {"period": (spectrum.periods, " s"), "damping": (spectrum.dampings, "")}
    reasons: list[list[str]] = [[] for _ in range(len(pairs))]
    for name in ("period_1", "period_2", "damping_1", "damping_2"):
        known, unit = ranges[name[:-2]]
        for row, value in enumerate(pairs[name].to_numpy(np.float64)):
            if not known[0] <= value <= known[-1]:
                span = f"{known[0]:g} to {known[-1]:g}{unit}"
                reasons[row].append(f"{name} = {value:g}{unit} is outside the spectrum's {span}")
    named = zip(pairs["pair_id"], reasons, strict=True)
    return tuple(Rejection("pair", name, spectrum.name, None, tuple(why)) for name, why in named)


def _judged(spectrum: DesignSpectrum, pairs: pd.DataFrame, screening: Screening) -> pd.DataFrame:
    values, gap = _values(pairs), pairs["gap"].to_numpy(np.float64)
    sd_1, sd_2 = (displacement_at(spectrum, *one) for one in zip(values.period, values.damping, strict=True))
    radius = values.participation[0] * sd_1, values.participation[1] * sd_2
    correlation = ddc_correlation(values.period[0], values.damping[0], values.period[1], values.damping[1])
    by_correlation, by_squares = critical_gap(*radius, correlation), srss_gap(*radius)
    derived = period_is_derived(pairs)
    squares_decide = derived & (by_squares > by_correlation)
    demand = np.where(squares_decide, by_squares, by_correlation)
    ratio, probability = demand_ratio(gap, demand), design_probability(spectrum, pairs)
    columns: dict[str, str | NDArray[np.generic]] = {
        "spectrum": spectrum.name,
        "sd_1": sd_1,
        "sd_2": sd_2,
        "correlation": correlation,
        "critical_gap_sd": by_correlation,
        "srss_gap_sd": by_squares,
        "absolute_gap_sd": absolute_gap(*radius),
        "demand": demand,
        "demand_rule": np.where(squares_decide, "sd_srss", "sd_white_noise").astype(object),
        "demand_ratio": ratio,
        "probability": probability,
        "state": pounding_state(gap, demand, derived | (probability >= screening.possible_from)),
        "risk_class": risk_class(ratio, screening.classes),
        **_hits(radius, values, demand, pairs),
    }
    return pairs.assign(**columns).join(code_columns(pairs, *radius, screening.codes))


def _hits(radius: Both, values: _Pairs, demand: FloatArray, pairs: pd.DataFrame) -> dict[str, NDArray[np.generic]]:
    """Return the single hit of every pair, its critical gap being the demand."""
    restitution, gap = (pairs[name].to_numpy(np.float64) for name in ("restitution", "gap"))
    hit = single_hit(*radius, *values.period, *values.mass, restitution, demand, gap)
    return {
        "single_hit_status": hit.status,
        "impact_velocity": hit.impact_velocity,
        "amplification_1": hit.amplification_1,
        "amplification_2": hit.amplification_2,
    }
