"""Counts and worst rows of a table, collected while it is read in pieces."""

from collections.abc import Sequence

import pandas as pd

from per_obspy.report.layers.spreadsheet import ROWS
from per_obspy.report.page.tally import PairTally
from per_obspy.report.summary.statements import Counts

#: Columns that notes need; those that a table lacks are left out.
COLUMNS = (
    "rank", "pair_id", "risk_class", "state", "probability", "expected_impact_velocity",
    "impact_velocity_84", "expected_amplification", "gap", "demand", "demand_rule", "station",
    "distance", "flags", "derived", "missing_gap", "longitude", "latitude", "longitude_1",
    "latitude_1", "longitude_2", "latitude_2",
)  # fmt: skip


class Notes:
    """
    Counts of a table that is read in pieces, worst first, and its worst rows.

    Parameters
    ----------
    classes : sequence of str
        Names of the risk classes, worst first.
    """

    def __init__(self, classes: Sequence[str]) -> None:
        self.tally = PairTally(classes)
        self._worst, self._rows = list[pd.DataFrame](), 0

    def add(self, piece: pd.DataFrame) -> None:
        """Take the next rows."""
        self.tally.add(piece)
        # The first rows are the worst
        if self._rows < ROWS:
            self._worst.append(piece.head(ROWS - self._rows).copy())
            self._rows += len(self._worst[-1])

    @property
    def counts(self) -> Counts:
        """Return the numbers of the table."""
        found = self.tally
        far = found.flags["far_station"]
        return Counts(found.states, found.classes, found.expected, found.derived, far)

    @property
    def worst(self) -> pd.DataFrame:
        """Return the worst rows, as many as a workbook has."""
        return pd.concat(self._worst, ignore_index=True) if self._worst else pd.DataFrame()


def needed_columns(more: Sequence[str]) -> list[str]:
    """Return the columns for the notes and some more, without repetition."""
    return list(dict.fromkeys([*COLUMNS, *more]))
