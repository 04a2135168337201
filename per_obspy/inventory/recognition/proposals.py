"""Names and units that a table seems to have, for the user to confirm."""

from typing import NamedTuple

import numpy as np
import pandas as pd

from per_obspy.inventory.cells import plain_numbers
from per_obspy.inventory.schema import COLUMNS


class _Rule(NamedTuple):
    """A unit that is proposed where the median of the numbers above 0 exceeds a limit."""

    column: str
    above: float
    unit: str


#: Medians in the unit of the schema that hardly any town has, and the unit that explains them; of
#: each column the last rule that holds.
_RULES = (
    _Rule("gap", 3.0, "cm"),
    _Rule("gap", 100.0, "mm"),
    _Rule("gap_std", 1.0, "cm"),
    _Rule("height", 300.0, "cm"),
    _Rule("height", 2000.0, "mm"),
    _Rule("contact_height", 300.0, "cm"),
    _Rule("period", 20.0, "ms"),
    _Rule("damping", 0.5, "%"),
)

#: Height of a storey in feet that is none in metres: 8 to 20 ft are 2.4 to 6 m.
_STOREY_FEET = (8.0, 20.0)


def proposed_units(table: pd.DataFrame, gaps_are_odd: bool) -> dict[str, str]:
    """
    Return units that would make the numbers of a table plausible.

    Parameters
    ----------
    table : DataFrame
        Before rows are rejected; numbers may be text.
    gaps_are_odd : bool
        Whether the gaps resemble centimetres although each may be in metres.

    Examples
    --------
    >>> proposed_units(pd.DataFrame({"gap": ["5", "12", "0"], "damping_1": [5, 5, 2]}), False)
    {'gap': 'cm', 'damping_1': '%'}
    """
    units = {"gap": "cm"} if gaps_are_odd else {}
    medians = {
        name: _median(table[name])
        for name in table
        if name in COLUMNS and COLUMNS[name].dtype != "str"
    }
    for name, median in medians.items():
        bare = name.removesuffix("_1").removesuffix("_2")
        for rule in _RULES:
            if rule.column == bare and median > rule.above:
                units[name] = rule.unit
    # Heights over storeys
    for index in (1, 2):
        height, storeys = medians.get(f"height_{index}"), medians.get(f"storeys_{index}")
        if height and storeys and _STOREY_FEET[0] < height / storeys < _STOREY_FEET[1]:
            units[f"height_{index}"] = "ft"
    return units


def _median(values: pd.Series) -> float:
    """Return the median of the numbers above 0, 0 if there is none."""
    numbers = plain_numbers(values).to_numpy(dtype=np.float64, na_value=np.nan)
    above = numbers[numbers > 0.0]
    return float(np.median(above)) if above.size else 0.0
