"""Cases of the paper's figures: pairs, histories, single hits, correlations (paper_figures.py)."""

from collections.abc import Iterator
from itertools import combinations

import numpy as np
from paper_plots import Pair
from paper_records import Record

from per_obspy import (
    CloughPenzien,
    Structure,
    critical_gap,
    ddc_correlation,
    per_spectrum,
    single_hit,
    supplemental_damping,
)
from per_obspy.pounding.linearization import ductility_correlation
from per_obspy.pounding.reliability import (
    SingleHitComparison,
    amplifications,
    compare_single_hit,
    summary,
)
from per_obspy.pounding.row_history import PoundingHistory, pounding_history
from per_obspy.pounding.single_hit import SingleHit

DAMPING, RESTITUTION, MASS = 0.05, 0.65, 1e6  # of every structure and impact; kg
#: Of the figure on yielding pairs: as Taft 1952 has it, and the lakebed of Mexico City
GROUNDS = {
    "Taft-like ground": CloughPenzien(15.6, 0.6, 1.0, 0.6, 1.0),
    "Mexico-like ground": CloughPenzien(2.0 * np.pi * 0.5, 0.1, 0.5, 0.6, 1.0),
}


def pair_of(
    record: Record, periods: tuple[float, float], share: float, damping: float = DAMPING
) -> Pair:
    """Return a pair whose gap is a share of its critical gap by (15) and (16)."""
    per = per_spectrum(record.acceleration, record.dt, periods, damping)
    critical = float(critical_gap(*per, ddc_correlation(periods[0], damping, periods[1], damping)))
    return Pair(periods, tuple(per), critical, share * critical)


def history_of(record: Record, periods: tuple[float, float], gap: float) -> PoundingHistory:
    """Return the exact history of two equally heavy structures."""
    structures = [Structure(period, DAMPING, MASS) for period in periods]
    return pounding_history(record.acceleration, record.dt, structures, gap, RESTITUTION)


def hit_of(pair: Pair, gap: float | np.ndarray, restitution: float = RESTITUTION) -> SingleHit:
    """Return the single hit of two equally heavy structures."""
    return single_hit(*pair.per, *pair.periods, MASS, MASS, restitution, pair.critical_gap, gap)


def critical_cases(
    record: Record, all_periods: list[tuple[float, float]]
) -> Iterator[tuple[Pair, float, PoundingHistory, SingleHit]]:
    """Yield the content of Fig. 4 per pair: circles, correlation, history, onset of pounding."""
    for periods in all_periods:
        pair = pair_of(record, periods, 1.0)
        onset = hit_of(pair, pair.gap * (1.0 - 1e-12))
        correlation = ddc_correlation(periods[0], DAMPING, periods[1], DAMPING)
        yield pair, float(correlation), history_of(record, periods, sum(pair.per)), onset


def comparisons(record: Record, count: int) -> dict[float, SingleHitComparison]:
    """Return Fig. 6: single hits and exact histories of all pairs of ``count`` periods, 0.3-4 s."""
    pairs = np.array(list(combinations(np.geomspace(0.3, 4.0, count), 2))).T
    compared = {
        ratio: compare_single_hit(
            record.acceleration, record.dt, *pairs, ratio, 1.0, RESTITUTION, DAMPING
        )
        for ratio in (0.95, 0.8, 0.5)
    }
    for ratio, cases in compared.items():
        found = summary(np.divide(*amplifications(cases)), (0.99,))
        text = f"bias {found.median:.2f}, scatter {found.log_std:.2f}, "
        text += f"{found.below[0]:.0%} under-predicted by > 1 %"
        print(
            f"{record.name}, gap {ratio:g} of the critical one, {found.cases} of "
            f"{cases.status.size} pairs: {text}"
        )
    return compared


def damping_needs(record: Record, pair: Pair) -> tuple:
    """Return Fig. 8: added damping, its critical gaps, the least sufficient, pounding with less."""
    added, shares = (
        np.linspace(0.0, 0.3, 61),
        {"both": (1.0, 1.0), "only 1": (1.0, 0.0), "only 2": (0.0, 1.0)},
    )
    gaps, least = {}, {}
    for label, (share_1, share_2) in shares.items():
        damping = DAMPING + share_1 * added, DAMPING + share_2 * added
        per = [
            per_spectrum(record.acceleration, record.dt, [t], d)[:, 0]
            for t, d in zip(pair.periods, damping, strict=True)
        ]
        gaps[label] = critical_gap(
            *per, ddc_correlation(pair.periods[0], damping[0], pair.periods[1], damping[1])
        )
        motion = record.acceleration, record.dt
        two = pair.periods[0], DAMPING, pair.periods[1], DAMPING
        least[label] = supplemental_damping(*motion, *two, pair.gap, share_1, share_2, 0.3).damping
    hits = [
        hit_of(pair_of(record, pair.periods, 1.0, float(DAMPING + more)), pair.gap)
        for more in added
    ]
    damped = per_spectrum(record.acceleration, record.dt, pair.periods, DAMPING + added)
    harm = {
        f"structure {i + 1}": [one[i] * getattr(hit, f"amplification_{i + 1}") / pair.per[i]
                               for one, hit in zip(damped, hits, strict=True)]
        for i in (0, 1)
    }  # fmt: skip
    return added, gaps, least, harm, pair.gap


def correlation_panels(ratios: np.ndarray) -> Iterator[tuple[str, dict[str, np.ndarray]]]:
    """Yield a panel per ground and period: correlation over period ratio, per ductility."""
    for name, ground in GROUNDS.items():
        for period in (1.0, 2.0):
            curves = {"(16), elastic": ddc_correlation(period, DAMPING, period * ratios, DAMPING)}
            for ductility in (1.0, 2.0, 4.0, 6.0):
                pairs = [
                    [Structure(t, DAMPING, MASS, hardening=0.05) for t in (period, period * r)]
                    for r in ratios
                ]
                found = [
                    ductility_correlation(*two, ductility, ductility, ground).correlation
                    for two in pairs
                ]
                curves[f"ductility {ductility:g}"] = np.array(found)
            yield f"{name}, T1 = {period:g} s", curves
