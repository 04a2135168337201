"""
Ratio of the amplification in the row to that in the pair alone, by position.

``python workflows/rows_and_pairs.py [BUILDINGS] [GAP]`` draws rows of three to seven buildings
against a made-up record. For rows of an inventory call `row_over_pair` with them and the motion of
their station.
"""

import sys

import numpy as np
import pandas as pd
from numpy.typing import NDArray

from per_obspy.pounding.row_maxima import BuildingRows, row_maxima

DT, SAMPLES = 0.01, 6_000


def pairs_of(rows: BuildingRows) -> tuple[BuildingRows, NDArray[np.int64]]:
    """
    Return every two neighbours as a row of two, and the numbers of their buildings.

    Parameters
    ----------
    rows : BuildingRows
        Of any lengths.

    Returns
    -------
    pairs : BuildingRows
        In the order of the interfaces.
    members : (2 * n_pairs,) ndarray of int
        Left and right building of each pair, in turn.
    """
    last = np.isin(np.arange(rows.period.size), rows.first[1:] - 1)
    left = np.flatnonzero(~last)
    members = np.stack([left, left + 1], axis=1).ravel()
    fields = {name: getattr(rows, name)[members] for name in rows._fields[1:-1]}
    row = np.searchsorted(rows.first, left, side="right") - 1
    first = np.arange(0, members.size + 1, 2)
    return BuildingRows(first, **fields, azimuth=rows.azimuth[row]), members


def row_over_pair(
    north: NDArray[np.float64], east: NDArray[np.float64], dt: float, rows: BuildingRows
) -> pd.DataFrame:
    """
    Return amplification in the row and in the worst pair, building by building.

    Parameters
    ----------
    north, east : (n_samples,) ndarray
        Ground acceleration, m/s².
    dt : float
        Sampling interval, s.
    rows : BuildingRows
        Of two buildings or more each.

    Returns
    -------
    DataFrame
        ``position`` (``end`` or ``inner``), ``in_row`` and ``in_pair`` (largest radius over that
        without contact, the larger of both pairs), ``ratio`` and ``hit_in_row`` per building.
    """
    whole = row_maxima(north, east, dt, rows)
    pairs, members = pairs_of(rows)
    alone = row_maxima(north, east, dt, pairs)
    in_pair = np.zeros(rows.period.size)
    np.maximum.at(in_pair, members, alone.radius / alone.free_radius)

    # Impacts from either side
    hit = whole.impacts > 0
    hit[1:] |= hit[:-1]
    is_end = np.zeros(hit.size, dtype=bool)
    is_end[rows.first[:-1]] = is_end[rows.first[1:] - 1] = True
    in_row = whole.radius / whole.free_radius
    return pd.DataFrame(
        {
            "position": np.where(is_end, "end", "inner"),
            "in_row": in_row,
            "in_pair": in_pair,
            "ratio": in_row / in_pair,
            "hit_in_row": hit,
        }
    )


def summary(table: pd.DataFrame) -> pd.DataFrame:
    """Return number, and 5, 50 and 95 % of each amplification and of their ratio, by position."""
    by = table[table["hit_in_row"]].groupby("position")
    columns = ["in_row", "in_pair", "ratio"]
    found = by[columns].quantile([0.05, 0.5, 0.95]).unstack()
    found.columns = [f"{name}_{round(100 * share)}" for name, share in found.columns]
    return found.assign(buildings=by.size())


def simulated_rows(buildings: int, gap: float, seed: int = 0) -> BuildingRows:
    """
    Return random rows of three to seven buildings.

    Parameters
    ----------
    buildings : int
        About how many in all.
    gap : float
        Largest clear distance, m; 0 makes all rows touch.
    seed : int
        Of the draws.

    Returns
    -------
    BuildingRows
        Periods around 0.5 s (logarithmic spread 0.5), contact at 0.6 to 1.3 of the modal
        displacement, lower for the building with the longer period.
    """
    random = np.random.default_rng(seed)
    sizes = random.integers(3, 8, buildings // 5)
    count = int(sizes.sum())
    period = 0.5 * np.exp(random.normal(0.0, 0.5, count))
    # the lower building of two is hit at its roof, the higher one below it
    longer_left = np.roll(period, 1) / period
    longer_right = np.roll(period, -1) / period
    return BuildingRows(
        first=np.append(0, np.cumsum(sizes)),
        period=period,
        damping=np.full(count, 0.05),
        mass=2e5 * period**2 * np.exp(random.normal(0.0, 0.3, count)),
        yield_displacement=np.full(count, np.inf),
        hardening=np.zeros(count),
        participation_left=1.3 * np.minimum(1.0, longer_left),
        participation_right=1.3 * np.minimum(1.0, longer_right),
        gap=random.uniform(0.0, gap, count),
        restitution=np.full(count, 0.65),
        azimuth=random.uniform(0.0, 360.0, sizes.size),
    )


def made_up_motion() -> NDArray[np.float64]:
    """Return two components of smoothed noise that rise and fall like an earthquake, m/s²."""
    noise = np.random.default_rng(1).normal(size=(2, SAMPLES))
    smooth = np.array([np.convolve(one, np.ones(5) / 5, mode="same") for one in noise])
    seconds = DT * np.arange(SAMPLES)
    return 4.0 * smooth * (seconds / 8.0) * np.exp(1.0 - seconds / 8.0)


def main() -> None:
    """Print the summary of simulated rows."""
    buildings = int(sys.argv[1]) if len(sys.argv) > 1 else 1000
    gap = float(sys.argv[2]) if len(sys.argv) > 2 else 0.0
    table = row_over_pair(*made_up_motion(), DT, simulated_rows(buildings, gap))
    print(summary(table).T.round(3).to_string())
    print(f"of {len(table)} buildings, {table['hit_in_row'].sum()} are hit in their row")


if __name__ == "__main__":
    main()
