"""Counts of all pairs for page and summary: by state, class and flag, and by cell of a map."""

from collections import Counter
from collections.abc import Sequence

import numpy as np
import pandas as pd
from numpy.typing import NDArray

from per_obspy.screening.ranking import EVERY_STATE, UNKNOWN_CLASS

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
        # Column, row and kind, in their order, and the pairs of each
        self._keys = np.empty((0, 3), dtype=np.int64)
        self._counts = np.empty(0, dtype=np.int64)

    def add(self, pairs: pd.DataFrame) -> None:
        """Count pairs by place, class and state; those without a place are left out."""
        # Columns and rows of the grid
        placed = pairs[np.isfinite(pairs["longitude"]) & np.isfinite(pairs["latitude"])]
        column = np.floor(placed["longitude"].to_numpy() / self.size).astype(np.int64)
        row = np.floor(placed["latitude"].to_numpy() / self.size).astype(np.int64)
        # A class and a state are one kind
        kind = len(self.states) * _codes(placed["risk_class"], self.classes)
        kind += _codes(placed["state"], self.states)
        keys = np.concatenate([self._keys, np.stack([column, row, kind], axis=1)])
        self._join(keys, np.append(self._counts, np.ones(len(placed), np.int64)))
        while len(self._keys) and self._cells() > MOST_CELLS:
            # Twice the size
            self.size *= 2.0
            self._join(self._keys // np.array([2, 2, 1]), self._counts)

    def _join(self, keys: NDArray[np.int64], counts: NDArray[np.int64]) -> None:
        """Take numbers of pairs, those of one cell and kind together."""
        # Ordered by column, row and kind
        order = np.lexsort(keys.T[::-1])
        keys = keys[order]
        first = np.flatnonzero(np.append(True, (keys[1:] != keys[:-1]).any(axis=1))[: order.size])
        self._keys, self._counts = keys[first], np.add.reduceat(counts[order], first)

    def _cells(self) -> int:
        """Return the number of cells that hold a pair."""
        places = self._keys[:, :2]
        return 1 + int((places[1:] != places[:-1]).any(axis=1).sum())

    def table(self) -> pd.DataFrame:
        """
        Return one row per cell: ``longitude, latitude`` of its middle, a column per kind that is.

        The name of a kind is the number of its class and the number of its state.
        """
        if not len(self._keys):
            return pd.DataFrame(columns=["longitude", "latitude"], dtype=float)
        index = pd.MultiIndex.from_arrays(list(self._keys.T))
        counts = pd.Series(self._counts, index).unstack(fill_value=0)
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


#: Pairs that the page holds one by one, the worst; the others are counted in cells.
PAGE_PAIRS = 20_000

#: Expected impact velocity from which a pair counts as hit hard, m/s. Reasoned, not verified: a
#: plane wave of two concrete slabs has 0.8 MPa, see docs/population.md.
HARD = 0.2

#: Columns of the risk table that are counted; a table may lack some.
COUNTED = (
    "rank", "state", "risk_class", "probability", "expected_impact_velocity", "flags", "derived",
    "distance", "longitude", "latitude", "yield_displacement_1", "yield_displacement_2",
)  # fmt: skip


#: Yield displacements of both buildings, infinite where they are elastic.
YIELDS = ("yield_displacement_1", "yield_displacement_2")


class PairTally:
    """
    Counts of pairs by state, class and flag, and of those beyond the worst by cell.

    A class, because the pieces of a table arrive one by one.

    Parameters
    ----------
    classes : sequence of str
        Names of the risk classes, worst first.

    Attributes
    ----------
    expected, hard, columns : float
        Expected numbers of pairs that hit each other, of those that hit hard, and of those among
        them whose floors meet columns: sums of probabilities.
    yielding : int
        Pairs of which a building yields in the model.
    """

    def __init__(self, classes: Sequence[str]) -> None:
        """Begin without a pair."""
        # Sums of probabilities, then counts
        self.pairs = 0
        self.expected = self.hard = self.columns = 0.0
        self.yielding = 0
        self.expected_by_class: Counter[str] = Counter()
        self.derived = 0
        self.states: Counter[str] = Counter()
        self.classes: Counter[str] = Counter()
        self.flags: Counter[str] = Counter()
        self.cells = CellCounts([*classes, UNKNOWN_CLASS], EVERY_STATE)
        self._distances: list[pd.Series] = []

    def add(self, piece: pd.DataFrame) -> None:
        """Count a piece of the risk table; the pieces come in any order."""
        self.pairs += len(piece)
        # Counts add up, whatever the pieces
        self.states.update(_counts(piece, "state"))
        self.classes.update(_counts(piece, "risk_class"))
        for names, count in _counts(piece, "flags").items():
            self.flags.update(dict.fromkeys(names.split(), count))
        # Rows with a name of a derived column
        derived = _counts(piece, "derived")
        self.derived += sum(derived.values()) - derived.get("", 0)
        if "probability" in piece:
            self._add_expected(piece)
        limits = [name for name in YIELDS if name in piece]
        self.yielding += int(np.isfinite(piece[limits].astype(float)).any(axis=1).sum())
        if "distance" in piece:
            self._distances.append(piece["distance"].dropna().copy())
        others = piece[piece["rank"] > PAGE_PAIRS]
        if len(others) and {"longitude", "latitude", "risk_class", "state"} <= set(piece):
            self.cells.add(others)

    def _add_expected(self, piece: pd.DataFrame) -> None:
        """Add the probabilities of a piece: of all, by class, and of hard impacts."""
        chance = piece["probability"].fillna(0.0)
        self.expected += float(chance.sum())
        if "risk_class" in piece:
            sums = chance.groupby(piece["risk_class"].to_numpy(), observed=True).sum()
            self.expected_by_class.update(dict(sums))
        # Of those that are hit hard, some at columns
        if "expected_impact_velocity" in piece:
            chance = chance[piece["expected_impact_velocity"] >= HARD]
            self.hard += float(chance.sum())
            flags = piece.get("flags", pd.Series("", piece.index)).loc[chance.index]
            self.columns += float(chance[flags.str.contains("floor_to_column", na=False)].sum())

    def median_distance(self) -> float:
        """Return the median distance between pair and station, m; NaN if no pair has one."""
        return float(pd.concat(self._distances).median()) if self._distances else float("nan")


def _counts(piece: pd.DataFrame, column: str) -> dict[str, int]:
    """Return the number of rows of each text of a column, empty if the table lacks it."""
    if column not in piece:
        return {}
    return {str(text): int(count) for text, count in piece[column].value_counts().items()}
