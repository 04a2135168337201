"""
Google Open Buildings: CSV with outlines as WKT, confidence and plus code, without heights.

The temporal data set of the same project has heights, but as a raster; a column ``building_height``
(m) that was drawn from it is used.

Source: Open Buildings, "Data format"; Earth Engine catalogue, GOOGLE/Research/open-buildings.
"""

from per_obspy.inventory.importers.importer import Importer

GOOGLE = Importer(
    name="Google Open Buildings",
    needed=(("area_in_meters", "confidence", "full_plus_code"),),
    columns={
        "building_id": "full_plus_code",
        "height": "building_height",
        "storeys": "storeys",
    },
    carried=("confidence",),
    class_column="",
)
