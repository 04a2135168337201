"""Counts of pairs by cell, class and state, for pairs that the page does not list."""

from collections import Counter
from collections.abc import Sequence

import numpy as np
import pandas as pd
from numpy.typing import NDArray

#: Largest number of cells; where there would be more, cells become twice as large.
MOST_CELLS = 10_000

#: Side of the smallest cells, degrees: about 100 m.
SMALLEST_CELL = 0.001


class CellCounts:
    """
    Numbers of pairs in cells of a grid in degrees, by class and state, counted in pieces.

    A class, because cells grow while the pieces of a table arrive.

    Parameters
    ----------
    classes, states : sequence of str
        Risk classes and states that a pair can have; others are counted as the last ones.
    """

    def __init__(self, classes: Sequence[str], states: Sequence[str]) -> None:
        """Begin without a pair."""
        self.classes, self.states = tuple(classes), tuple(states)
        self.size = SMALLEST_CELL
        self._counts: Counter[tuple[int, int, int]] = Counter()

    def add(self, pairs: pd.DataFrame) -> None:
        """Count pairs by place, class and state; those without a place are left out."""
        # Columns and rows of the grid
        placed = pairs[np.isfinite(pairs["longitude"]) & np.isfinite(pairs["latitude"])]
        column = np.floor(placed["longitude"].to_numpy() / self.size).astype(np.int64)
        row = np.floor(placed["latitude"].to_numpy() / self.size).astype(np.int64)
        # A class and a state are one kind
        kind = len(self.states) * _codes(placed["risk_class"], self.classes)
        kind += _codes(placed["state"], self.states)
        # Pairs of one cell and kind together
        keys, counts = np.unique(np.stack([column, row, kind]), axis=1, return_counts=True)
        for key, count in zip(keys.T.tolist(), counts.tolist(), strict=True):
            self._counts[key[0], key[1], key[2]] += count
        while len({key[:2] for key in self._counts}) > MOST_CELLS:
            self._enlarge()

    def _enlarge(self) -> None:
        """Double the size of the cells."""
        self.size *= 2.0
        joined: Counter[tuple[int, int, int]] = Counter()
        for (column, row, kind), count in self._counts.items():
            joined[column // 2, row // 2, kind] += count
        self._counts = joined

    def table(self) -> pd.DataFrame:
        """
        Return one row per cell: ``longitude, latitude`` of its middle, a column per kind that is.

        The name of a kind is the number of its class and the number of its state.
        """
        if not self._counts:
            return pd.DataFrame(columns=["longitude", "latitude"], dtype=float)
        counts = pd.Series(dict(self._counts)).unstack(fill_value=0)
        # Names cannot be those of a hostile class
        kinds = (divmod(int(kind), len(self.states)) for kind in counts.columns)
        counts.columns = pd.Index([f"{code} {state}" for code, state in kinds])
        # Cells are numbered from their south-western corner
        middle = (np.array(counts.index.to_list()) + 0.5) * self.size
        places = pd.DataFrame(middle, columns=["longitude", "latitude"])
        return pd.concat([places, counts.reset_index(drop=True)], axis=1)


def _codes(column: pd.Series, names: Sequence[str]) -> NDArray[np.int64]:
    """Return the code of each row's name; other names have the last code."""
    codes = pd.Index(names).get_indexer(pd.Index(column)).astype(np.int64)
    return np.where(codes < 0, len(names) - 1, codes)
