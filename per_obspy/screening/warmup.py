"""
Compilation of kernels ahead of use: of all in parts, or of screening during a run.

The parts share few kernels, so that processes can compile them next to each other.
"""

import sys
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from threading import Thread

import numpy as np
import pandas as pd
import xarray as xr

from per_obspy.garbage import keep_all, no_search
from per_obspy.inventory.checking import checked_pairs
from per_obspy.kernels._jit import are_stored
from per_obspy.kernels.pairs.single_hit import estimate
from per_obspy.kernels.pounding_lanes.run_block import run_lanes
from per_obspy.kernels.relative.relative_maxima import relative_maxima
from per_obspy.pounding.correlation import worst_azimuth
from per_obspy.pounding.pair_histories import pounding_histories
from per_obspy.pounding.relative import (
    directional_relative_displacement,
    yielding_relative_displacement,
)
from per_obspy.pounding.row_history import pounding_history
from per_obspy.pounding.row_maxima import BuildingRows, row_maxima
from per_obspy.pounding.structure import Structure
from per_obspy.progress import Progress
from per_obspy.screening.risk import risk_table
from per_obspy.spectra.azimuthal import azimuthal_per_spectrum, azimuthal_sd_spectrum
from per_obspy.spectra.elastic import azimuth_maxima, per_spectrum, response_spectra

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


#: Ground motion of two seconds, m/s², along one and both components, and its sampling interval, s.
PULSE, INTERVAL = np.sin(np.linspace(0.0, 4.0 * np.pi, 201)), 0.01
BOTH = np.stack([PULSE, PULSE])


def _histories() -> None:
    oscillators = [0.5], 0.05, 1.0, [0.7], 0.05, 1.0
    pounding_histories(BOTH, INTERVAL, *oscillators, 0.001, 0.65, azimuth=[0.0])
    structures = [Structure(0.5, 0.05, 1.0), Structure(0.7, 0.05, 1.0)]
    pounding_history(PULSE, INTERVAL, structures, 0.001, 0.65, free_vibration=False)
    # Yielding pairs that never touch
    pair = [0.5], 0.05, [0.7], 0.05, [0.0]
    yielding_relative_displacement(BOTH, INTERVAL, *pair, yield_displacement_1=0.02)
    # Three buildings in touch that yield
    ones = np.ones(3)
    period = np.array([0.5, 0.7, 0.6])
    stiffness = 0.02 * ones, 0.05 * ones
    sides = ones, ones, 0.0 * ones, 0.65 * ones
    row = BuildingRows(np.array([0, 3]), period, 0.05 * ones, ones, *stiffness, *sides, np.zeros(1))
    row_maxima(PULSE, PULSE, INTERVAL, row)


def _relative() -> None:
    """Compile the kernels of relative displacements, correlations and maxima along azimuths."""
    motion, pair = (PULSE, PULSE, INTERVAL), ([0.5], [0.05], [0.7], [0.05], [0.0])
    directional_relative_displacement(*motion, *pair)
    worst_azimuth(*motion, *pair[:4], [1.0], [1.0])
    azimuth_maxima(*motion, [0.5], [0.05], [0.0])


def _spectra() -> None:
    """Compile the kernels of station spectra, by component and by azimuth, and of PER alone."""
    per_spectrum(PULSE, INTERVAL, [0.5], [0.05])
    response_spectra(PULSE, INTERVAL, [0.5], [0.05])
    azimuthal_per_spectrum(PULSE, PULSE, INTERVAL, [0.5], [0.05])
    azimuthal_sd_spectrum(PULSE, PULSE, INTERVAL, [0.5], [0.05])


#: Kernels of screening that take longest to compile, one of each part.
LONGEST = run_lanes, relative_maxima, estimate


@contextmanager
def compiling(progress: Progress) -> Iterator[None]:
    """Compile the kernels of screening in a thread, while other processes do the stations."""
    # Workers load what is stored
    if are_stored(*LONGEST):
        yield
        return
    # Where Dask is installed, xarray imports it with the first Dataset: two threads that both make
    # their first one would break this import
    _station()
    thread = Thread(target=compile_screening)
    thread.start()
    try:
        yield
        progress(COMPILING, 0, 1)
    finally:
        # A thread that is alive when the interpreter ends can abort it; an interrupt does not wait
        if not isinstance(sys.exception(), KeyboardInterrupt | SystemExit):
            thread.join()
    progress(COMPILING, 1, 1)


def compile_screening() -> None:
    """Screen three pairs against a short pulse, only to compile the kernels."""
    risk_table(_station(), checked_pairs(PAIRS, "none"))


#: Parts in the order in which two processes take them: the first one is busy with histories, which
#: screening calls, until the other has done what else screening calls.
PARTS: dict[str, Callable[[], None]] = {
    "histories": _histories,
    "relative": _relative,
    "spectra": _spectra,
    "screening": compile_screening,
}


def compile_part(name: str) -> str:
    """Compile one of `PARTS` and return its name."""
    with no_search():
        PARTS[name]()
    keep_all()
    return name


def _station() -> xr.Dataset:
    """Return a station with a pulse on both horizontals and constant spectra."""
    grid = {"period": [0.1, 1.0], "damping": [0.02, 0.05], "azimuth": [0.0, 90.0]}
    spectra = ("azimuth", "damping", "period"), np.ones((2, 2, 2), dtype=np.float32)
    # The variables of a station that screening reads
    variables = {
        "acceleration": (("horizontal", "time"), BOTH),
        "per_azimuthal": spectra,
        "sd_azimuthal": spectra,
        "per_rotd50": (("damping", "period"), np.ones((2, 2), dtype=np.float32)),
        "sampling_interval": INTERVAL,
        "shortest_usable_period": 0.01,
        "longest_usable_period": 9.0,
    }
    place = {"station": "none", "latitude": 1.0, "longitude": 1.0}
    return xr.Dataset(variables, coords={**grid, **place}, attrs={"simulated": "true"})
