"""
Demand of pairs by the spectral displacement of both buildings, without a record.

These are rungs 2 and 3 of the ladder of demands. There is no PER in a spectrum: the radius is the
spectral displacement, because the gap from it and eq. (16) is the one that is known to be closest
to the exact one (see ``SD_MEDIAN`` in ``uncertainty/estimated.py``).
"""

from typing import NamedTuple

import numpy as np
import pandas as pd
from numpy.typing import NDArray

from per_obspy.checks import FloatArray
from per_obspy.config import Screening
from per_obspy.pounding.correlation import ddc_correlation
from per_obspy.pounding.critical_gap import absolute_gap, critical_gap, srss_gap
from per_obspy.pounding.single_hit import SingleHit, single_hit
from per_obspy.screening.by_record.estimates import demand_ratio
from per_obspy.screening.codes import code_columns
from per_obspy.screening.flags import period_is_derived
from per_obspy.screening.ranking import pounding_state, risk_class
from per_obspy.screening.uncertainty.estimated import SD_MEDIAN, UncertainRadius
from per_obspy.screening.values import Columns, Table, both, values

#: Building 1 and building 2.
Both = tuple[FloatArray, FloatArray]


class SpectralDemand(NamedTuple):
    """
    Demand of spectral displacements on pairs at contact height, (n_pairs,).

    Attributes
    ----------
    radii : pair of ndarray
        Displacements at contact height, m.
    correlation : ndarray
        By eq. (16), dimensionless.
    by_correlation, by_squares, demand : ndarray
        Critical gap with that correlation, root of the sum of squares, and the one that decides, m.
    squares_decide : ndarray of bool
        Whether the root of the sum of squares does, as derived periods ask for.
    """

    radii: Both
    correlation: FloatArray
    by_correlation: FloatArray
    by_squares: FloatArray
    demand: FloatArray
    squares_decide: NDArray[np.bool_]


def spectral_demand(pairs: pd.DataFrame, displacement: Both) -> SpectralDemand:
    """
    Compute the demand of the displacements of both oscillators on completed pairs.

    Parameters
    ----------
    pairs : DataFrame
        Completed pairs.
    displacement : pair of (n_pairs,) ndarray
        SD of the oscillators, m.
    """
    share_1, share_2 = both(pairs, "participation")
    radii = share_1 * displacement[0], share_2 * displacement[1]
    period_1, period_2 = both(pairs, "period")
    damping_1, damping_2 = both(pairs, "damping")
    # eq. (15) with the correlation of eq. (16), and without correlation
    correlation = ddc_correlation(period_1, damping_1, period_2, damping_2)
    by_correlation, by_squares = critical_gap(*radii, correlation), srss_gap(*radii)
    squares_decide = period_is_derived(pairs) & (by_squares > by_correlation)
    demand = np.where(squares_decide, by_squares, by_correlation)
    return SpectralDemand(radii, correlation, by_correlation, by_squares, demand, squares_decide)


def spectral_radius(pairs: Table, demand: SpectralDemand, i: int) -> UncertainRadius:
    """
    Return the radius of building i at contact height with its oscillator.

    Parameters
    ----------
    pairs : Table
        Completed pairs.
    demand : SpectralDemand
        Of the same pairs.
    i : int
        Building 1 or 2.
    """
    period = values(pairs, f"period_{i}")
    return UncertainRadius(
        radius=demand.radii[i - 1] / SD_MEDIAN,
        ln_ratio=np.zeros_like(period),
        period=period,
        damping=values(pairs, f"damping_{i}"),
    )


def spectral_columns(
    pairs: pd.DataFrame,
    displacement: Both,
    demand: SpectralDemand,
    population: Columns,
    screening: Screening,
) -> pd.DataFrame:
    """
    Return pairs with estimates, single hit, state, class and code rules, not ranked yet.

    Parameters
    ----------
    pairs : DataFrame
        Completed pairs.
    displacement : pair of (n_pairs,) ndarray
        SD of the oscillators, m.
    demand : SpectralDemand
        Of the same pairs.
    population : dict of (n_pairs,) ndarray
        Of the pairs, see :mod:`per_obspy.screening.uncertainty.population`.
    screening : Screening
        Thresholds, risk classes and the region's values for code rules.
    """
    gap = values(pairs, "gap")
    hit = _single_hit(pairs, demand)
    # radii and gaps of SD, then the state
    columns: dict[str, NDArray[np.generic]] = {
        "sd_1": displacement[0],
        "sd_2": displacement[1],
        "correlation": demand.correlation,
        "critical_gap_sd": demand.by_correlation,
        "srss_gap_sd": demand.by_squares,
        "absolute_gap_sd": absolute_gap(*demand.radii),
        "demand": demand.demand,
        "demand_ratio": demand_ratio(gap, demand.demand),
        "missing_gap": np.maximum(demand.demand - gap, 0.0),
        **population,
        "state": pounding_state(population["probability"], screening.states),
        "risk_class": risk_class(population["expected_impact_velocity"], screening.classes),
        "single_hit_status": hit.status,
        "impact_velocity": hit.impact_velocity,
        "amplification_1": hit.amplification_1,
        "amplification_2": hit.amplification_2,
    }
    return pairs.assign(**columns).join(code_columns(pairs, *demand.radii, screening.codes))


def _single_hit(pairs: pd.DataFrame, demand: SpectralDemand) -> SingleHit:
    """Return the single hit at the radii and the critical gap of the demand."""
    periods, masses = both(pairs, "period"), both(pairs, "contact_mass")
    restitution, gap = values(pairs, "restitution"), values(pairs, "gap")
    return single_hit(*demand.radii, *periods, *masses, restitution, demand.demand, gap)
