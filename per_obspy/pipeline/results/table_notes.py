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
    Counts of a ranked table that is read in pieces, in any order, and its worst rows.

    Parameters
    ----------
    classes : sequence of str
        Names of the risk classes, worst first.
    """

    def __init__(self, classes: Sequence[str]) -> None:
        self.tally = PairTally(classes)
        self._worst = list[pd.DataFrame]()

    def add(self, piece: pd.DataFrame) -> None:
        """Take some rows."""
        self.tally.add(piece)
        self._worst.append(piece[piece["rank"] <= ROWS])

    @property
    def counts(self) -> Counts:
        """Return the numbers of the table."""
        found = self.tally
        far = found.flags["far_station"]
        return Counts(found.states, found.classes, found.expected, found.derived, far)

    @property
    def worst(self) -> pd.DataFrame:
        """Return the worst rows, as many as a workbook has."""
        if not self._worst:
            return pd.DataFrame()
        return pd.concat(self._worst).sort_values("rank", ignore_index=True)


def needed_columns(more: Sequence[str]) -> list[str]:
    """Return the columns for the notes and some more, without repetition."""
    return list(dict.fromkeys([*COLUMNS, *more]))
