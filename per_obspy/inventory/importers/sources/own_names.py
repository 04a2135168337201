"""Names of the schema; also for layers of which only some columns are known."""

from per_obspy.inventory.importers.importer import Importer

_SCHEMA_NAMES = (
    "building_id",
    "height",
    "height_log_std",
    "storeys",
    "storey_height",
    "period",
    "damping",
    "mass",
    "occupants",
    "importance",
)

OWN = Importer("per_obspy", ((),), {name: name for name in _SCHEMA_NAMES})
