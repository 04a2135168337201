"""
Microsoft building footprints: GeoJSON features, one per line, with ``height`` and ``confidence``.

Both are -1 where they are unknown. Files named ``.csv.gz`` hold such lines, not CSV.

Source: repository microsoft/GlobalMLBuildingFootprints, README.
"""

import pandas as pd

from per_obspy.inventory.checking import plain_numbers
from per_obspy.inventory.importers.importer import Importer

#: Height and confidence that mean unknown.
UNKNOWN = -1.0


def adapted(attributes: pd.DataFrame) -> pd.DataFrame:
    """Return the attributes with empty cells for unknown heights."""
    unknown = plain_numbers(attributes["height"]) == UNKNOWN
    return attributes.assign(height=attributes["height"].mask(unknown))


MICROSOFT = Importer(
    name="Microsoft building footprints",
    needed=(("height", "confidence"),),
    columns={"height": "height"},
    carried=("confidence",),
    class_column="",
    adapted=adapted,
)
