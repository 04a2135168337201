"""Interpolation of motion at every period of the stations, for tests of trend and kriging."""

import numpy as np

from per_obspy.config import Interpolation
from per_obspy.screening.motion_field import InterpolatedMotion, fitted_field, motion_at

SETTINGS = Interpolation()
EVERY_PERIOD = (0.0, np.inf)


def interpolated_motion(stations, ln_per, periods, places, settings=SETTINGS):
    """Return the motion of every place at every period of the stations, one column per period."""
    ln_per, usable = np.asarray(ln_per), np.tile(EVERY_PERIOD, (stations.longitude.size, 1))
    columns = []
    for period, values in zip(periods, ln_per.T, strict=True):
        # A grid whose other end is far away and has other values: the period itself must count
        # alone
        grid, both = [period, 50.0], np.stack([values, values + 9.0], axis=1)
        field = fitted_field(stations, both, usable, grid, settings)
        columns.append(motion_at(field, places, np.full(places.longitude.size, period)))
    median = np.stack([motion.ln_median for motion in columns], axis=1)
    deviation = np.stack([motion.log_std for motion in columns], axis=1)
    return InterpolatedMotion(median, deviation, columns[0].fallback)
