"""Numbers of a whole table, and its worst rows, noted while it is read in pieces."""

from collections import Counter
from collections.abc import Sequence

import pandas as pd

from per_obspy.report.layers.spreadsheet import ROWS
from per_obspy.report.summary.statements import Counts

#: Columns that notes need; those that a table lacks are left out.
COLUMNS = (
    "rank", "pair_id", "risk_class", "state", "probability", "expected_impact_velocity",
    "impact_velocity_84", "expected_amplification", "gap", "demand", "demand_rule", "station",
    "distance", "flags", "derived", "missing_gap", "longitude", "latitude", "longitude_1",
    "latitude_1", "longitude_2", "latitude_2",
)  # fmt: skip


class Notes:
    """Counts of a table that is read in pieces, worst first, and its worst rows."""

    def __init__(self) -> None:
        self.states, self.classes = Counter[str](), Counter[str]()
        self.expected, self.derived, self.far = 0.0, 0, 0
        self._worst, self._rows = list[pd.DataFrame](), 0

    def add(self, piece: pd.DataFrame) -> None:
        """Take the next rows."""
        self.states.update(piece["state"].tolist())
        self.classes.update(piece["risk_class"].tolist())
        self.expected += float(piece["probability"].sum())
        self.derived += int((_texts(piece, "derived") != "").sum())
        self.far += int(_texts(piece, "flags").str.contains(r"\bfar_station\b").sum())
        # The first rows are the worst
        if self._rows < ROWS:
            self._worst.append(piece.head(ROWS - self._rows).copy())
            self._rows += len(self._worst[-1])

    @property
    def counts(self) -> Counts:
        """Return the numbers of the table."""
        return Counts(self.states, self.classes, self.expected, self.derived, self.far)

    @property
    def worst(self) -> pd.DataFrame:
        """Return the worst rows, as many as a workbook has."""
        return pd.concat(self._worst, ignore_index=True) if self._worst else pd.DataFrame()


def _texts(piece: pd.DataFrame, name: str) -> "pd.Series[str]":
    """Return a column of texts, empty where the table has none."""
    if name not in piece:
        return pd.Series("", index=piece.index, dtype=str)
    return piece[name].fillna("").astype(str)


def needed_columns(more: Sequence[str]) -> list[str]:
    """Return the columns that notes and others need, each once."""
    return list(dict.fromkeys([*COLUMNS, *more]))
