"""Shapes of pairs and buildings on a map."""

import numpy as np
import pandas as pd
import shapely
from numpy.typing import NDArray

from per_obspy.checks import FloatArray
from per_obspy.report.layers.pair_places import BOTH_PLACES, has_both_places

Shapes = NDArray[np.object_]


def pair_shapes(table: pd.DataFrame) -> Shapes:
    """
    Return each pair as a line from building 1 to 2, or as a point where only its middle is known.

    Lines across the date line go on beyond 180 degrees, instead of around the Earth.
    """
    if not has_both_places(table.columns):
        return points(table["longitude"].to_numpy(), table["latitude"].to_numpy())
    east_1, north_1, east_2, north_2 = (table[name].to_numpy(float) for name in BOTH_PLACES)
    # Beyond the date line
    east_2 = east_2 - 360.0 * np.round((east_2 - east_1) / 360.0)
    ends = np.stack([np.column_stack([east_1, north_1]), np.column_stack([east_2, north_2])], 1)
    lines: Shapes = shapely.linestrings(ends)
    return lines


def points(longitude: FloatArray, latitude: FloatArray) -> Shapes:
    """Return points; None where a coordinate is unknown."""
    known = np.isfinite(longitude) & np.isfinite(latitude)
    shapes: Shapes = shapely.points(longitude, latitude)
    shapes[~known] = None
    return shapes
