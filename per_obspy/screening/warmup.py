"""Compilation of the kernels of screening ahead of use, while stations are still processed."""

from collections.abc import Iterator
from contextlib import contextmanager
from threading import Thread

import numpy as np
import pandas as pd
import xarray as xr

from per_obspy.inventory.checking import checked_pairs
from per_obspy.progress import Progress
from per_obspy.screening.risk import risk_table

#: Stage that the first run waits for.
COMPILING = "loading kernels (the first run compiles them for a minute)"

#: Three pairs that together call every kernel: touching ones with given periods, with derived
#: periods, and with a building that could yield.
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


@contextmanager
def compiling(progress: Progress) -> Iterator[None]:
    """Compile the kernels of screening in a thread, while other processes do the stations."""
    # Where Dask is installed, xarray imports it with the first Dataset: two threads that both make
    # their first one would break this import
    _station()
    thread = Thread(target=compile_screening)
    thread.start()
    try:
        yield
        progress(COMPILING, 0, 1)
    except Exception:
        # A thread that is alive when the interpreter ends can abort it; an interrupt does not wait
        thread.join()
        raise
    thread.join()
    progress(COMPILING, 1, 1)


def compile_screening() -> None:
    """Screen three pairs against a short pulse, only to compile the kernels."""
    risk_table(_station(), checked_pairs(PAIRS, "none"))


def _station() -> xr.Dataset:
    """Return a station with a pulse on both horizontals and constant spectra."""
    pulse = np.sin(np.linspace(0.0, 4.0 * np.pi, 201))
    grid = {"period": [0.1, 1.0], "damping": [0.02, 0.05], "azimuth": [0.0, 90.0]}
    spectra = ("azimuth", "damping", "period"), np.ones((2, 2, 2), dtype=np.float32)
    # The variables of a station that screening reads
    variables = {
        "acceleration": (("horizontal", "time"), np.stack([pulse, pulse])),
        "per_azimuthal": spectra,
        "sd_azimuthal": spectra,
        "per_rotd50": (("damping", "period"), np.ones((2, 2), dtype=np.float32)),
        "sampling_interval": 0.01,
        "shortest_usable_period": 0.01,
        "longest_usable_period": 9.0,
    }
    place = {"station": "none", "latitude": 1.0, "longitude": 1.0}
    return xr.Dataset(variables, coords={**grid, **place}, attrs={"simulated": "true"})
