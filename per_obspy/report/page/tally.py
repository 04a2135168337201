"""Numbers of all pairs for page and summary, counted while the risk table is read in pieces."""

from collections import Counter
from collections.abc import Sequence

import numpy as np
import pandas as pd

from per_obspy.report.page.cells import CellCounts
from per_obspy.screening.ranking import EVERY_STATE
from per_obspy.screening.uncertainty.unknown_gaps import UNKNOWN_CLASS

#: Pairs that the page holds one by one, the worst; the others are counted in cells.
PAGE_PAIRS = 20_000

#: Columns of the risk table that are counted; a table may lack some.
COUNTED = (
    "rank", "state", "risk_class", "probability", "flags", "derived", "distance", "longitude",
    "latitude",
)  # fmt: skip


class PairTally:
    """
    Counts of pairs by state, class and flag, and of those beyond the worst by cell.

    A class, because the pieces of a table arrive one by one.

    Parameters
    ----------
    classes : sequence of str
        Names of the risk classes, worst first.
    """

    def __init__(self, classes: Sequence[str]) -> None:
        """Begin without a pair."""
        self.pairs = 0
        self.expected = 0.0
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
            self.expected += float(np.nansum(piece["probability"]))
        if "distance" in piece:
            self._distances.append(piece["distance"].dropna().copy())
        others = piece[piece["rank"] > PAGE_PAIRS]
        if len(others) and {"longitude", "latitude", "risk_class", "state"} <= set(piece):
            self.cells.add(others)

    def median_distance(self) -> float:
        """Return the median distance between pair and station, m; NaN if no pair has one."""
        return float(pd.concat(self._distances).median()) if self._distances else float("nan")


def _counts(piece: pd.DataFrame, column: str) -> dict[str, int]:
    """Return the number of rows of each text of a column, empty if the table lacks it."""
    if column not in piece:
        return {}
    return {str(text): int(count) for text, count in piece[column].value_counts().items()}
