"""GeoPackage of a plan: visits as points, and the route of each team as a line."""

from collections.abc import Mapping
from pathlib import Path

import numpy as np
import pandas as pd
import shapely

from per_obspy.files import written_whole
from per_obspy.inventory.footprints.gdal_paths import literal_path
from per_obspy.report.layers.geopackage import Layer, append_layer


def write_plan_layers(table: pd.DataFrame, path: Path, facts: Mapping[str, str]) -> None:
    """
    Write the layers ``visits`` and ``routes``, whole or not at all.

    Parameters
    ----------
    table : DataFrame
        From :func:`per_obspy.report.plan.plan_files.visit_table`.
    path : Path
        ``.gpkg``.
    facts : mapping of str to str
        Facts of the run that hold for all rows.
    """
    places = table[["longitude", "latitude"]].to_numpy(np.float64)
    rows, lines = [], []
    for team, visits in table.groupby("team"):
        # A line has two places at least
        corners = places[visits.index[[0, *range(len(visits))]]]
        lines.append(shapely.LineString(corners))
        rows.append({"team": team, "visits": len(visits), "way": float(visits["way"].sum())})
    with written_whole(path) as whole, literal_path(whole) as part:
        append_layer(part, Layer("visits", table, shapely.points(places)), True, facts)
        routes = Layer("routes", pd.DataFrame(rows), np.array(lines, dtype=object))
        append_layer(part, routes, True, facts)
