"""The last ductility that a scan finds, next to every ductility by interpolation of SciPy."""

import numpy as np
import pytest
from scipy.interpolate import RegularGridInterpolator

from per_obspy.kernels.pairs.last_ductility import last_intervals


@pytest.mark.parametrize("count", [1, 4])
def test_the_last_interval_is_that_of_a_scan_of_every_ductility(count):
    # would miss a building that resonates again beyond its first crossing, and the ends of grids
    rng = np.random.default_rng(0)
    periods, dampings = np.log(np.geomspace(0.1, 4.0, 30)), np.log(np.geomspace(0.02, 0.3, count))
    radii = rng.normal(0.0, 0.5, (3, count, 30)) + 0.8 * periods
    rows, size = rng.integers(3, size=400), 400
    period, damping = rng.uniform(0.05, 5.0, size), rng.uniform(0.0, 0.2, size)
    buildings = np.stack([np.log(period), damping, rng.uniform(-1.0, 3.0, size)])
    ductility = np.geomspace(1.0, 40.0, 50)
    scan = np.stack([np.log(ductility), 0.4 * np.log(ductility), 0.05 * (ductility - 1.0) ** 0.3])
    last = np.full(size, -1)
    last_intervals(periods, dampings, radii, rows, buildings, scan, last)

    # a grid of one damping counts at any
    grid = np.log([0.001, 1.0]) if count == 1 else dampings
    for index in range(size):
        stored = np.broadcast_to(radii[rows[index]], (grid.size, 30))
        place = (
            np.clip(np.log(damping[index] + scan[2, 1:-1]), grid[0], grid[-1]),
            np.clip(buildings[0, index] + scan[1, 1:-1], periods[0], periods[-1]),
        )
        displacement = RegularGridInterpolator((grid, periods), stored)(np.transpose(place))
        beyond = np.flatnonzero(buildings[2, index] + displacement > scan[0, 1:-1])
        assert last[index] == (beyond[-1] + 1 if beyond.size else 0)
    assert np.unique(last).size > 10
