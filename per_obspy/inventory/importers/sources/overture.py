"""
Overture Maps, theme buildings: GeoParquet with nested columns.

``height`` is in m, ``num_floors`` counts storeys above ground. A building under the ground has
``is_underground``; it has no height here, so that its pairs are rejected.

Source: Overture Maps schema reference, "building" and "building_part".
"""

import pandas as pd

from per_obspy.inventory.importers.importer import Importer


def adapted(attributes: pd.DataFrame) -> pd.DataFrame:
    """Return the attributes without the heights of buildings under the ground."""
    if "is_underground" not in attributes:
        return attributes
    table = attributes.copy()
    below = table["is_underground"].astype(str).str.lower() == "true"
    # Text is no number: the pair is rejected with this word
    for name in ("height", "num_floors"):
        given = table[name] if name in table else pd.Series(None, table.index)
        table[name] = given.astype(object).mask(below, "underground")
    return table


OVERTURE = Importer(
    name="Overture Maps",
    needed=(("id", "version", "sources"), ("id", "num_floors"), ("id", "is_underground")),
    columns={"building_id": "id", "height": "height", "storeys": "num_floors"},
    carried=("subtype", "class", "names", "sources"),
    class_column="class",
    adapted=adapted,
)
