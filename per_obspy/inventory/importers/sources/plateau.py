"""
PLATEAU and other city models in CityGML 1.0 and 2.0, as :mod:`..citygml` reads them.

PLATEAU writes -9999 for an unknown height and 9999 for an unknown number of storeys.

Source: Handbook of the 3D city model of PLATEAU, standard data product specification; OGC 12-019.
"""

import pandas as pd

from per_obspy.inventory.checking import plain_numbers
from per_obspy.inventory.importers.importer import Importer

#: Values that mean unknown, in either column.
UNKNOWN = (-9999.0, 9999.0)


def adapted(attributes: pd.DataFrame) -> pd.DataFrame:
    """Return the attributes with empty cells for values that mean unknown."""
    table = attributes.copy()
    for name in ("measuredHeight", "storeysAboveGround"):
        table[name] = table[name].mask(plain_numbers(table[name]).isin(UNKNOWN))
    return table


CITYGML = Importer(
    name="CityGML",
    needed=(("measuredHeight", "storeysAboveGround"),),
    columns={"building_id": "id", "height": "measuredHeight", "storeys": "storeysAboveGround"},
    carried=("usage", "address", "structure_type", "outline"),
    class_column="usage",
    adapted=adapted,
)
