"""
PLATEAU and other city models in CityGML 1.0 and 2.0, as :mod:`..citygml` reads them.

PLATEAU writes -9999 for an unknown height and 9999 for an unknown number of storeys, as other
placeholders in :mod:`per_obspy.inventory.cells`.

Source: Handbook of the 3D city model of PLATEAU, standard data product specification; OGC 12-019.
"""

from per_obspy.inventory.importers.importer import Importer

CITYGML = Importer(
    name="CityGML",
    needed=(("measuredHeight", "storeysAboveGround"),),
    columns={"building_id": "id", "height": "measuredHeight", "storeys": "storeysAboveGround"},
    carried=("usage", "address", "structure_type", "outline"),
    class_column="usage",
)
