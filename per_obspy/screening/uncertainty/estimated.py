"""
Population of pairs whose demand is an estimate: radii of a spectrum, eq. (15) and (16).

The motion is given by what it does to the pairs (:class:`UncertainMotion`), whether it comes from a
record, a ShakeMap or a design spectrum. Periods and dampings are resampled, both buildings on their
own, with radii from spectra scaled to the median radius. So two buildings of equal height are never
certain to move as one.
"""

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from per_obspy.checks import FloatArray
from per_obspy.pounding.correlation.white_noise import ddc_correlation
from per_obspy.screening.by_record.stored_spectra import (
    LogSpectra,
    log_period_and_damping,
    stored_log,
)
from per_obspy.screening.uncertainty.nodes import NODES, damping_at_nodes, period_at_nodes
from per_obspy.screening.uncertainty.population import COLUMNS, Uncertain, population
from per_obspy.screening.uncertainty.severity import RelativeMotion
from per_obspy.screening.values import Columns, Table, chosen

#: Median and log-standard deviation of the gap from SD and eq. (16) over the exact one: 91 pairs of
#: periods from 0.3 to 4 s at 5 % damping under 14 broad-band records.
SD_MEDIAN, SD_DISPERSION = 0.97, 0.14

#: Pairs times nodes that are computed together: every array stays below 256 kB.
SAMPLES = 32_768

#: Gap / sum of the radii that the rounding of a correlation of 1 leaves in eq. (15).
ROUND_OFF = 1e-7


class UncertainRadius(NamedTuple):
    """
    Radius of one building of every pair under an uncertain motion, each (n_pairs,).

    Attributes
    ----------
    radius : ndarray
        Median at contact height, of which the critical gap is right in the median, m.
    ln_ratio : ndarray
        Logarithm of the radius at the site over ``radius``.
    period, damping : ndarray
        Medians of the oscillator that has this radius, s and fraction of critical.
    """

    radius: FloatArray
    ln_ratio: FloatArray
    period: FloatArray
    damping: FloatArray


class UncertainMotion(NamedTuple):
    """
    Response of pairs to an uncertain motion, each (n_pairs,).

    Attributes
    ----------
    first, second : UncertainRadius
        Buildings 1 and buildings 2.
    correlation : ndarray
        Of both responses at the medians, dimensionless; where it is not that of eq. (16), that of
        the nodes differs from theirs by as much.
    log_std : ndarray
        Log-standard deviation of the critical gap for given buildings: by the motion, and of the
        estimate over the exact demand.
    row : ndarray of int
        Of the spectra by which the radii change.
    """

    first: UncertainRadius
    second: UncertainRadius
    correlation: FloatArray
    log_std: FloatArray
    row: NDArray[np.intp]

    def rows(self, chosen_rows: NDArray[np.generic]) -> "UncertainMotion":
        """Return the motion of some pairs, by their numbers or a mask."""
        return UncertainMotion(
            UncertainRadius(*(column[chosen_rows] for column in self.first)),
            UncertainRadius(*(column[chosen_rows] for column in self.second)),
            self.correlation[chosen_rows],
            self.log_std[chosen_rows],
            self.row[chosen_rows],
        )


def estimated_population(
    motion: UncertainMotion,
    spectra: LogSpectra,
    pairs: Table,
    velocity_factor: FloatArray | None = None,
) -> Columns:
    """
    Compute the population of pairs under an uncertain motion.

    Parameters
    ----------
    motion : UncertainMotion
        Of the pairs.
    spectra : LogSpectra
        By which the radii of resampled oscillators change; at the edge beyond the grid.
    pairs : Table
        Completed pairs with their log-standard deviations.
    velocity_factor : (n_pairs,) ndarray, optional
        By which impact velocities are known to differ; 1 if not given.

    Returns
    -------
    dict of (n_pairs,) ndarray
        ``population.COLUMNS``.
    """
    factor = np.ones(motion.row.size) if velocity_factor is None else velocity_factor
    count = motion.row.size
    result: Columns = {name: np.empty(count) for name in COLUMNS}
    size = SAMPLES // len(NODES)
    # blocks bound the memory; a pair does not depend on its block
    for first in range(0, count, size):
        rows = np.arange(first, min(first + size, count))
        block, table = motion.rows(rows), chosen(pairs, rows)
        relative = estimated_motion(block, spectra, table, NODES)
        uncertain = Uncertain(relative, block.log_std, factor[rows])
        for name, column in population(uncertain, table, NODES).items():
            result[name][rows] = column
    return result


def estimated_motion(
    motion: UncertainMotion, spectra: LogSpectra, pairs: Table, nodes: FloatArray
) -> RelativeMotion:
    """
    Estimate the motion of pairs without contact at nodes of their buildings.

    Parameters
    ----------
    motion, spectra, pairs : UncertainMotion, LogSpectra, Table
        See :func:`estimated_population`.
    nodes : (n_nodes, 6) ndarray
        As ``nodes.NODES``.
    """
    period_1, damping_1, radius_1 = _at_nodes(motion.first, motion.row, spectra, pairs, 1, nodes)
    period_2, damping_2, radius_2 = _at_nodes(motion.second, motion.row, spectra, pairs, 2, nodes)
    # eq. (16), shifted as that which governs at the medians
    by_noise = ddc_correlation(period_1, damping_1, period_2, damping_2)
    first, second = motion.first, motion.second
    at_medians = ddc_correlation(first.period, first.damping, second.period, second.damping)
    differs = (motion.correlation - at_medians)[:, None]
    correlation = np.clip(by_noise + differs, -1.0, 1.0)
    # critical gap, and the relative velocity as the gap of the velocities
    speed_1 = 2.0 * np.pi / period_1 * radius_1
    speed_2 = 2.0 * np.pi / period_2 * radius_2
    demand = _difference(radius_1, radius_2, correlation)
    velocity = _difference(speed_1, speed_2, correlation)
    return RelativeMotion(demand, velocity, speed_1, speed_2, by_noise)


def _at_nodes(
    building: UncertainRadius,
    row: NDArray[np.intp],
    spectra: LogSpectra,
    pairs: Table,
    i: int,
    nodes: FloatArray,
) -> tuple[FloatArray, FloatArray, FloatArray]:
    """Return period (s), damping and radius at the site (m) of building i at the nodes."""
    period = period_at_nodes(building.period, pairs, i, nodes)
    damping = damping_at_nodes(building.damping, pairs, i, nodes)
    # the radius changes as the stored spectrum does from the medians to the node
    stored = stored_log(spectra, row[:, None], *log_period_and_damping(period, damping))
    median = stored_log(spectra, row, *log_period_and_damping(building.period, building.damping))
    known = building.radius * np.exp(building.ln_ratio - median)
    return period, damping, known[:, None] * np.exp(stored)


def _difference(first: FloatArray, second: FloatArray, correlation: FloatArray) -> FloatArray:
    """Return eq. (15), 0 where two equal motions leave the round-off of their difference."""
    square = (first - second) ** 2 + 2.0 * (1.0 - correlation) * first * second
    difference: FloatArray = np.sqrt(square)
    return np.where(difference > ROUND_OFF * (first + second), difference, 0.0)
