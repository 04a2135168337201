"""What is known of the ground motion of a region: stations, the motion between them, and a map for where they end."""

from typing import NamedTuple

import xarray as xr

from per_obspy.screening.ground_motion.assignment import Stations
from per_obspy.screening.ground_motion.site_motion import StationField


class Ground(NamedTuple):
    """
    The ground motion of a region.

    Attributes
    ----------
    stations : Stations
        Whose records pairs are given.
    field : StationField or None
        The motion between them; None if there are none.
    shakemap : Dataset or None
        For pairs without a station in reach.
    """

    stations: Stations
    field: StationField | None
    shakemap: xr.Dataset | None
