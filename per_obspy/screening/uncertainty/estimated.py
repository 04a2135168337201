"""
Population of pairs whose demand is an estimate: radii of a spectrum, eq. (15) and (16).

The motion is given by its effect on the pairs (:class:`UncertainMotion`), whether it comes from a
record, a ShakeMap or a design spectrum. Periods and dampings are resampled for each building
separately, with radii from spectra scaled to the median radius. So two buildings of equal height
are never certain to move as one.
"""

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from per_obspy.checks import FloatArray
from per_obspy.kernels.pairs.node_motion import MOTION_ROWS, estimate_motion
from per_obspy.pounding.correlation import ddc_correlation
from per_obspy.screening.by_record.station_motion import (
    LogSpectra,
    log_period_and_damping,
    stored_log,
)
from per_obspy.screening.uncertainty.population import (
    BUILDINGS,
    COLUMNS,
    LARGEST_DAMPING,
    NODES,
    RelativeMotion,
    Uncertain,
    population,
)
from per_obspy.screening.values import Columns, IndexArray, Table, chosen, values

#: Median and log-standard deviation of the gap from SD and eq. (16) over the exact one: 91 pairs of
#: periods from 0.3 to 4 s at 5 % damping under 14 broad-band records.
SD_MEDIAN, SD_DISPERSION = 0.97, 0.14

#: Pairs times nodes that are computed together: every array stays below 256 kB.
SAMPLES = 32_768


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
    row: IndexArray

    def rows(self, chosen_rows: NDArray[np.generic]) -> "UncertainMotion":
        """Return the motion of some pairs, by their numbers or a mask."""
        return UncertainMotion(
            UncertainRadius(*(column[chosen_rows] for column in self.first)),
            UncertainRadius(*(column[chosen_rows] for column in self.second)),
            self.correlation[chosen_rows],
            self.log_std[chosen_rows],
            self.row[chosen_rows],
        )


def estimated_population(motion: UncertainMotion, spectra: LogSpectra, pairs: Table) -> Columns:
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

    Returns
    -------
    dict of (n_pairs,) ndarray
        ``population.COLUMNS``.
    """
    count = motion.row.size
    result: Columns = {name: np.empty(count) for name in COLUMNS}
    size = SAMPLES // len(NODES)
    # blocks bound the memory; a pair does not depend on its block
    for first in range(0, count, size):
        rows = np.arange(first, min(first + size, count))
        block, table = motion.rows(rows), chosen(pairs, rows)
        relative = estimated_motion(block, spectra, table, NODES)
        uncertain = Uncertain(relative, block.log_std, np.ones(rows.size))
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
    first = _oscillators(motion.first, motion.row, spectra, pairs, 1)
    second = _oscillators(motion.second, motion.row, spectra, pairs, 2)
    # eq. (16), shifted as that which governs at the medians
    shift = motion.correlation - ddc_correlation(
        *(motion.first.period, motion.first.damping),
        *(motion.second.period, motion.second.damping),
    )
    relative = np.empty((MOTION_ROWS, motion.row.size, len(nodes)))
    deviates = np.ascontiguousarray(nodes[:, BUILDINGS].T)
    estimate_motion(
        *spectra, motion.row, np.stack([*first, *second]), np.atleast_1d(shift), deviates, relative
    )
    return RelativeMotion(*relative)


def _oscillators(
    building: UncertainRadius, row: IndexArray, spectra: LogSpectra, pairs: Table, i: int
) -> tuple[FloatArray, ...]:
    """Return the oscillators of building i in the rows of the kernel."""
    # the radius changes as the stored spectrum does from the medians to the node
    at_medians = log_period_and_damping(building.period, building.damping)
    where_stored_is_one = building.radius * np.exp(
        building.ln_ratio - stored_log(spectra, row, *at_medians)
    )
    return (
        *(building.period, values(pairs, f"period_log_std_{i}")),
        *(building.damping, values(pairs, f"damping_log_std_{i}")),
        *(np.maximum(building.damping, LARGEST_DAMPING), where_stored_is_one),
    )
