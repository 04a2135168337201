"""Compile what screening needs before it is needed: on small pairs, while stations are still at work."""

import numpy as np
import pandas as pd
import xarray as xr

from per_obspy.inventory.checking import checked_pairs
from per_obspy.screening.risk import risk_table

#: Two oscillators that touch, two whose periods nobody gave, and one that could yield: together
#: they call every kernel.
PAIRS = pd.DataFrame(
    {
        "pair_id": ["given", "derived", "yielding"],
        **{f"{name}_{i}": 1.0 for name in ("longitude", "latitude") for i in (1, 2)},
        "height_1": 9.0,
        "height_2": [9.0, 15.0, 9.0],
        "period_1": [0.5, np.nan, 0.5],
        "period_2": [0.7, np.nan, 0.7],
        "gap": 0.001,
        "azimuth": 0.0,
        "yield_displacement_1": [np.nan, np.nan, 0.02],
    }
)


AZIMUTHAL = ("per_azimuthal", "sd_azimuthal")


def compile_screening() -> None:
    """Screen three pairs against a short pulse; the result is of no use."""
    pulse = np.sin(np.linspace(0.0, 4.0 * np.pi, 201))
    grid = {"period": [0.1, 1.0], "damping": [0.02, 0.05], "azimuth": [0.0, 90.0]}
    station = xr.Dataset(
        {
            "acceleration": (("horizontal", "time"), np.stack([pulse, pulse])),
            **{
                name: (tuple(reversed(grid)), np.ones((2, 2, 2), dtype=np.float32))
                for name in AZIMUTHAL
            },
            "per_rotd50": (("damping", "period"), np.ones((2, 2), dtype=np.float32)),
            "sampling_interval": 0.01,
            "shortest_usable_period": 0.01,
            "longest_usable_period": 9.0,
        },
        coords={**grid, "station": "none", "latitude": 1.0, "longitude": 1.0},
        attrs={"simulated": "true"},
    )
    risk_table(station, checked_pairs(PAIRS, "none"))
