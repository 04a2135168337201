"""Counts of pairs by cell and class, for the pairs that a page does not show one by one."""

from collections import Counter
from collections.abc import Sequence

import numpy as np
import pandas as pd

#: Largest number of cells; where there would be more, cells become twice as large.
MOST_CELLS = 10_000

#: Side of the smallest cells, degrees: about 100 m.
SMALLEST_CELL = 0.001


class CellCounts:
    """
    Numbers of pairs in cells of a grid in degrees, by class, taken in pieces.

    A class, because cells grow while the pieces of a table arrive.

    Parameters
    ----------
    kinds : sequence of str
        Risk classes that a pair can have; others are counted as the last one.
    """

    def __init__(self, kinds: Sequence[str]) -> None:
        """Begin without a pair."""
        self.kinds = tuple(kinds)
        self.size = SMALLEST_CELL
        self._counts: Counter[tuple[int, int, int]] = Counter()

    def add(self, pairs: pd.DataFrame) -> None:
        """Count pairs by place and class; those without a place are left out."""
        # Columns and rows of the grid
        placed = pairs[np.isfinite(pairs["longitude"]) & np.isfinite(pairs["latitude"])]
        column = np.floor(placed["longitude"].to_numpy() / self.size).astype(np.int64)
        row = np.floor(placed["latitude"].to_numpy() / self.size).astype(np.int64)
        codes = pd.Index(self.kinds).get_indexer(placed["risk_class"])
        kind = np.where(codes < 0, len(self.kinds) - 1, codes)
        # Pairs of one cell and class together
        keys, counts = np.unique(np.stack([column, row, kind]), axis=1, return_counts=True)
        for key, count in zip(keys.T.tolist(), counts.tolist(), strict=True):
            self._counts[key[0], key[1], key[2]] += count
        while len({key[:2] for key in self._counts}) > MOST_CELLS:
            self._enlarge()

    def _enlarge(self) -> None:
        """Join four cells to one."""
        self.size *= 2.0
        joined: Counter[tuple[int, int, int]] = Counter()
        for (column, row, kind), count in self._counts.items():
            joined[column // 2, row // 2, kind] += count
        self._counts = joined

    def table(self) -> pd.DataFrame:
        """Return one row per cell: ``longitude, latitude`` of its middle, a column per class."""
        if not self._counts:
            return pd.DataFrame(columns=["longitude", "latitude", *self.kinds], dtype=float)
        counts = pd.Series(dict(self._counts)).unstack(fill_value=0)
        counts = counts.reindex(columns=range(len(self.kinds)), fill_value=0)
        counts.columns = pd.Index(self.kinds)
        # Cells are numbered from their south-western corner
        middle = (np.array(counts.index.to_list()) + 0.5) * self.size
        places = pd.DataFrame(middle, columns=["longitude", "latitude"])
        return pd.concat([places, counts.reset_index(drop=True)], axis=1)
