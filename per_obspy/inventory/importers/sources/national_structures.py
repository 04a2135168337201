"""
National Structure Inventory of the United States: points with storeys, use and material.

``found_ht`` is the height of the first floor above ground in feet, not that of the building.
``bldgtype`` names a material (wood, masonry, concrete, steel, manufactured), no structural system.

Source: U.S. Army Corps of Engineers, National Structure Inventory, technical documentation.
"""

import pandas as pd

from per_obspy.inventory.cells import plain_numbers
from per_obspy.inventory.importers.importer import Importer

#: People at night, by age.
_NIGHT = ("pop2amu65", "pop2amo65")


def adapted(attributes: pd.DataFrame) -> pd.DataFrame:
    """Return the attributes with the people at night."""
    if not set(_NIGHT) <= set(attributes.columns):
        return attributes
    under, over = (plain_numbers(attributes[name]) for name in _NIGHT)
    return attributes.assign(pop2am=under + over)


NATIONAL_STRUCTURES = Importer(
    name="National Structure Inventory",
    needed=(("fd_id", "occtype", "num_story"),),
    columns={"building_id": "fd_id", "storeys": "num_story", "occupants": "pop2am"},
    carried=("occtype", "bldgtype", "sqft", "found_ht"),
    class_column="occtype",
    adapted=adapted,
)
