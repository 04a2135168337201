"""Tables of docs/calibration.md: scores per kind, reliability per bin, simple/exact demand."""

from collections.abc import Iterator

import numpy as np
import pandas as pd
from calibration_cases import APART, KINDS, PLACES, YIELDING

from per_obspy.checks import FloatArray
from per_obspy.pounding.reliability import summary
from per_obspy.screening.evaluation import brier_score, reliability

#: A probability is sharp below it and above 1 - it.
SHARP = 0.1

#: Bins of the probability.
BINS = 10

#: Exact demands below it (m) are round-off of buildings that move as one: no ratio is formed with
#: them.
LEAST = 1e-6


def difference(pairs: pd.DataFrame) -> tuple[float, float]:
    """Return mean probability minus share that pounded, and its deviation, dependent per event."""
    excess = pairs["probability"] - pairs["pounded"]
    by_event = (excess - excess.mean()).groupby(pairs["event"]).sum()
    return float(excess.mean()), float(np.sqrt((by_event**2).sum()) / len(excess))


def kind_table(pairs: pd.DataFrame) -> Iterator[str]:
    """Yield one row per kind of pair."""
    yield (
        "| pairs | number | predicted | pounded | difference "
        "| Brier score | if true | of the share | sharp |"
    )
    yield "|---|---|---|---|---|---|---|---|---|"
    for kind in filter(lambda kind: pairs[kind].any(), KINDS):
        some = pairs[pairs[kind]]
        told, pounded = some["probability"], some["pounded"].astype(float)
        share, sharp = pounded.mean(), ((told < SHARP) | (told > 1.0 - SHARP)).mean()
        mean, doubt = difference(some)
        scores = brier_score(pounded, told), (told * (1.0 - told)).mean(), share * (1.0 - share)
        cells = [f"{len(some)}", f"{told.mean():.3f}", f"{share:.3f}", f"{mean:+.3f} ± {doubt:.3f}"]
        cells = [*cells, *(f"{score:.4f}" for score in scores), f"{sharp:.0%}"]
        yield f"| {kind} | {' | '.join(cells)} |"


def bin_table(pairs: pd.DataFrame) -> Iterator[str]:
    """Yield one row per bin of probability and place: mean probability, share, number of pairs."""
    yield "| probability | " + " | ".join(PLACES) + " |"
    yield "|---|" + "---|" * len(PLACES)
    found = [
        reliability(some["pounded"], some["probability"], BINS)
        for _, some in by_place(pairs[pairs[APART]])
    ]
    for low in np.arange(BINS) / BINS:
        rows = [table[table["low"] == low] for table in found]
        cells = [
            "".join(
                f"{row.mean_probability:.2f}: {row.observed_share:.2f} ({row.events})"
                for row in one.itertuples()
            )
            for one in rows
        ]
        yield f"| {low:.1f} to {low + 1 / BINS:.1f} | {' | '.join(cells)} |"


def by_place(pairs: pd.DataFrame) -> Iterator[tuple[str, pd.DataFrame]]:
    """Yield the pairs of each place."""
    yield from ((place, pairs[pairs["place"] == place]) for place in PLACES)


def demands(pairs: pd.DataFrame, exact: str) -> dict[str, tuple[FloatArray, FloatArray]]:
    """Return simple estimates and exact demand for the station's record and tabled buildings."""
    moves = pairs[(pairs[exact] > LEAST) & pairs[APART]]
    linear, weak = moves[~moves[YIELDING]], moves[moves[YIELDING]]
    by_per = ["critical_gap_per", "critical_gap_record"]
    estimates = {
        "PER and eq. (16)": linear["critical_gap_per"],
        "larger of that and PER with the record's correlation": linear[by_per].max(axis=1),
        "SD and eq. (16)": linear["critical_gap_sd"],
        "buildings that yield: largest of both and linearized": weak[
            [*by_per, "critical_gap_linearized"]
        ].max(axis=1),
    }
    some = {name: estimate[estimate > 0] for name, estimate in estimates.items()}
    return {
        name: (simple.to_numpy(), moves.loc[simple.index, exact].to_numpy())
        for name, simple in some.items()
    }


def demand_table(pairs: pd.DataFrame) -> Iterator[str]:
    """Yield one row an estimate of the demand."""
    yield "| estimate / exact | of 1 towards 2 | in either order |"
    yield "|---|---|---|"
    one_way, either = (demands(pairs, name) for name in ("demand_exact", "demand_two_sided"))
    for name in one_way:
        found = [summary(np.divide(*some[name]), (1.0,)) for some in (one_way, either)]
        cells = [f"{one.median:.2f}, {one.log_std:.2f}, {one.below[0]:.2f}" for one in found]
        yield f"| {name} | {' | '.join(cells)} |"


def page(pairs: pd.DataFrame) -> Iterator[str]:
    """Yield the lines below the heading."""
    yield f"{pairs['event'].nunique()} earthquakes, {len(pairs)} pairs."
    for place, some in by_place(pairs):
        yield from ("", f"### Pairs {place}", "")
        yield from kind_table(some)
    yield from (
        "",
        "### Reliability of all that leave a gap",
        "",
        "Mean probability: share that pounded (pairs).",
        "",
    )
    yield from bin_table(pairs)
    yield from ("", "### Simple and exact demand", "", "Median, sigma of ln, share below 1.", "")
    yield from demand_table(pairs)
