"""
Microsoft building footprints: GeoJSON features, one per line, with ``height`` and ``confidence``.

Both are -1 where they are unknown. Files named ``.csv.gz`` hold such lines, not CSV.

Source: repository microsoft/GlobalMLBuildingFootprints, README.
"""

from per_obspy.inventory.importers.importer import Importer

MICROSOFT = Importer(
    name="Microsoft building footprints",
    needed=(("height", "confidence"),),
    columns={"height": "height"},
    carried=("confidence",),
    class_column="",
)
