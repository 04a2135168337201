"""
SimCenter: assets of R2D and BRAILS, as GeoJSON, JSON of single assets, or CSV.

``Height`` is in the file's unit of length; where the file names none, it is not used.
``StructureType`` has the building types of HAZUS, with or without the letter of the height class.
An ordinary braced frame, an infilled frame and a wall of masonry have periods of ``other``.

Source: R2D documentation, "ASD: Asset Definition"; BRAILS, inventories in GeoJSON; HAZUS 5.1
Earthquake Model Technical Manual, table 5-1.
"""

import pandas as pd

from per_obspy.inventory.cells import read_numbers
from per_obspy.inventory.importers.importer import Importer

#: Units of length in m.
METRES = {"m": 1.0, "meter": 1.0, "metre": 1.0, "cm": 0.01, "ft": 0.3048, "in": 0.0254}

#: Column with the unit of length of the file.
LENGTH_UNIT = "length_unit"

_TYPES = {
    "S1": "steel_mrf",
    "C1": "concrete_mrf",
    "C2": "concrete_wall",
    "PC1": "concrete_wall",
} | dict.fromkeys(
    ("W1", "W1A", "W2", "S2", "S3", "S4", "S5", "C3", "PC2", "RM1", "RM2", "URM", "MH"), "other"
)

#: HAZUS building types of one class of heights: low, mid and high rise.
SYSTEMS = _TYPES | {f"{name}{rise}": system for name, system in _TYPES.items() for rise in "LMH"}


def adapted(attributes: pd.DataFrame) -> pd.DataFrame:
    """Return the attributes with heights in m, empty where the unit is unknown."""
    name = next((name for name in ("Height", "height") if name in attributes), None)
    if name is None:
        return attributes
    # Each building in the unit of its file
    unknown = pd.Series("", attributes.index)
    units = attributes.get(LENGTH_UNIT, unknown).astype(str).str.strip().str.lower()
    heights = read_numbers("height", attributes[name]).values
    return attributes.assign(height_m=heights * units.map(METRES))


SIMCENTER = Importer(
    name="SimCenter",
    needed=(("NumberOfStories", LENGTH_UNIT), ("NumberOfStories",)),
    columns={"building_id": "id", "height": "height_m", "storeys": "NumberOfStories"},
    systems=SYSTEMS,
    system_columns=("StructureType",),
    carried=("StructureType", "OccupancyClass", "YearBuilt"),
    class_column="OccupancyClass",
    adapted=adapted,
)
