"""Samples: a small ShakeMap."""

import numpy as np
import xarray as xr

PERIODS = np.array([0.3, 1.0, 3.0])


def make_map(longitudes=(19.5, 20.0, 20.5), log_std=None, **attributes):
    """
    Return a map of PSA that rises to the east.

    PSA is 4, 2, 0.5 m/s2 at the three periods in the south-west, and three times that in the north.
    """
    latitude, longitude = np.array([9.5, 10.5]), np.array(longitudes)
    # factor by place: 1, 2, 3, ... to the east and 1, 3 to the north
    place = np.array([[1.0], [3.0]]) * (1.0 + np.arange(longitude.size))
    psa = np.array([4.0, 2.0, 0.5])[:, None, None] * place
    axes = ("period", "latitude", "longitude")
    grid = xr.Dataset(
        {"psa": (axes, psa)},
        coords={"period": PERIODS, "latitude": latitude, "longitude": longitude},
        attrs={"source": "grid.xml", **attributes},
    )
    if log_std is not None:
        grid["psa_log_std"] = (axes, np.full(psa.shape, log_std))
    return grid
