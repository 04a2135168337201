"""Largest responses and impacts of every building of many rows, by the exact history of each."""

from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike, NDArray

from per_obspy import checks
from per_obspy.checks import FloatArray
from per_obspy.kernels.pounding_events import motion as columns
from per_obspy.kernels.pounding_events.contact import LOG_COLUMNS
from per_obspy.kernels.pounding_rows.row_by_events import count_row_impacts, run_row_by_events
from per_obspy.pounding.history.pair_blocks import FIRST_ROOM
from per_obspy.pounding.history.pair_histories import BOUNCES_OF_PAIRS, SHORTEST_BOUNCE
from per_obspy.pounding.history.row_history import SPEED_SHARE
from per_obspy.pounding.history.row_tables import (
    BUILDING_FIELDS,
    RowScales,
    building_table,
    checked_rows,
    row_scales,
)
from per_obspy.pounding.history.row_tables import (
    BuildingRows as BuildingRows,
)
from per_obspy.pounding.history.tables import (
    closed_record,
    free_samples,
    largest_ground_velocity,
    refinement,
    row_at_rest,
)
from per_obspy.spectra.per_pair import azimuth_maxima
from per_obspy.threads import map_in_threads

#: Rows that a thread takes at a time.
BLOCK = 32


class RowMaxima(NamedTuple):
    """
    Largest responses of each building of the rows, and the impacts of each interface.

    Attributes
    ----------
    radius : (n_buildings,) ndarray
        Largest radius ``sqrt(D² + (D' / w)²)`` of the modal coordinate in the row, exact between
        samples, m.
    free_radius : (n_buildings,) ndarray
        The same of the building alone, without contact, m.
    displacement : (n_buildings,) ndarray
        Largest ``|D|`` in the row, exact between samples, m.
    impacts : (n_buildings,) ndarray of int
        Number of impacts between the building and the next one of its row that are faster than 1
        mm/s and than 1 % of the fastest of this interface; 0 for the last building of a row.
    impact_velocity : (n_buildings,) ndarray
        Largest approach speed at the contact height of this interface, m/s; 0 without impact.
    """

    radius: FloatArray
    free_radius: FloatArray
    displacement: FloatArray
    impacts: NDArray[np.int64]
    impact_velocity: FloatArray


def row_maxima(
    north: ArrayLike,
    east: ArrayLike,
    dt: float,
    rows: BuildingRows,
    *,
    free_vibration: bool = True,
) -> RowMaxima:
    """
    Compute the maxima of the exact pounding histories of rows of buildings.

    The physics is that of `pounding_history`, with a contact height of its own for every interface:
    an impulse ``J`` at the interface after building k changes its modal velocity by ``-a J / m``
    and that of its neighbour by ``b J / m``, with the participations ``a`` (right) and ``b``
    (left). Bouncing ends in contact when a bounce would last less than a thousandth of a sampling
    interval, or after 25 impacts per interface in one. The result of a row does not depend on the
    other rows, nor on the number of threads.

    Parameters
    ----------
    north, east : (n_samples,) array_like
        Components of the ground acceleration, m/s².
    dt : float
        Sampling interval, s.
    rows : BuildingRows
        Rows of one building or more each.
    free_vibration : bool
        As in `pounding_history`.

    Returns
    -------
    RowMaxima
        One entry per building, in the order of the rows.

    Raises
    ------
    ValueError
        If an argument is outside its range.
    RuntimeError
        If a step has more events than any record causes.

    References
    ----------
    Valles-Mattox & Reinhorn (1996), An energy approach to pounding of structures, 11WCEE, eq. (7),
    (8).
    """
    step = checks.number("dt", dt, checks.positive)
    checked = checked_rows(rows)
    ground = np.stack([checks.record("north", north), checks.record("east", east)])
    if free_vibration:
        ground = closed_record(ground)
    scales = row_scales(checked)
    table, impacts = _run(ground, step, checked, scales, free_vibration)
    return RowMaxima(
        radius=np.sqrt(table[:, columns.LARGEST_RADIUS_SQUARED]) / scales.displacement,
        free_radius=_free_radius(ground, step, checked, free_vibration),
        displacement=table[:, columns.LARGEST_DISPLACEMENT] / scales.displacement,
        impacts=impacts,
        impact_velocity=table[:, columns.APPROACH] / scales.clearance,
    )


def _free_radius(
    ground: FloatArray, dt: float, rows: BuildingRows, free_vibration: bool
) -> FloatArray:
    """Return the largest radius of every building alone."""
    sizes = np.diff(rows.first)
    azimuth = np.repeat(rows.azimuth, sizes)
    radius = azimuth_maxima(ground[0], ground[1], dt, rows.period, rows.damping, azimuth).per
    # A building that may yield is a row of its own
    yielding = np.flatnonzero(np.isfinite(rows.yield_displacement))
    if yielding.size:
        fields = {
            name: values[yielding] for name, values in zip(BUILDING_FIELDS, rows[1:-1], strict=True)
        }
        alone = BuildingRows(np.arange(yielding.size + 1), **fields, azimuth=azimuth[yielding])
        ones = RowScales(np.ones(yielding.size), np.ones(yielding.size))
        table, _ = _run(ground, dt, alone, ones, free_vibration)
        radius[yielding] = np.sqrt(table[:, columns.LARGEST_RADIUS_SQUARED])
    return radius


def _run(
    ground: FloatArray, dt: float, rows: BuildingRows, scales: RowScales, free_vibration: bool
) -> tuple[FloatArray, NDArray[np.int64]]:
    """Return the table of all buildings at the end, and impacts that count, from all threads."""
    table = building_table(rows, scales)
    counts = np.zeros(len(table), dtype=np.int64)
    lines = np.empty((len(table), columns.ROW_COLUMNS))
    velocity = sum(largest_ground_velocity(component, dt) for component in ground)

    def run(numbers: NDArray[np.int64]) -> None:
        """Run some rows, one after the other."""
        for number in numbers:
            part = slice(rows.first[number], rows.first[number + 1])
            interfaces = slice(part.start, part.stop - 1)
            row = row_at_rest(table[part], rows.gap[interfaces], rows.restitution[interfaces])
            row[0, columns.STICKING_SPEED] = SPEED_SHARE * velocity * table[part, 4].max()
            azimuth = np.radians(rows.azimuth[number])
            free = free_samples(rows.period[part].max(), dt) if free_vibration else 0
            lines[part], counts[part] = _run_row(
                ground, dt, row, azimuth, free, scales.clearance[part]
            )

    size = rows.first.size - 1
    map_in_threads(run, [np.arange(k, min(k + BLOCK, size)) for k in range(0, size, BLOCK)])
    return lines, counts


def _run_row(
    ground: FloatArray, dt: float, start: FloatArray, azimuth: float, free: int, scale: FloatArray
) -> tuple[FloatArray, NDArray[np.int64]]:
    """Return the row at its end and the impacts that count, from a log that holds all impacts."""
    parts = refinement(np.sqrt(start[:, columns.STIFFNESS].max()), dt)
    start[0, columns.STICKING_DELAY] = 0.5 * SHORTEST_BOUNCE * dt / parts
    start[0, columns.BOUNCE_LIMIT] = BOUNCES_OF_PAIRS * max(1, len(start) - 1)
    direction = float(np.cos(azimuth)), float(np.sin(azimuth))
    room, impacts = -1, FIRST_ROOM
    while room < impacts:
        room = impacts
        row, log = start.copy(), np.empty((room, LOG_COLUMNS))
        if not run_row_by_events(*ground, *direction, dt, parts, row, log, free):
            raise RuntimeError("no end of events in a step of a row")
        impacts = int(row[:, columns.IMPACTS].sum())
    return row, count_row_impacts(row, log, scale)
