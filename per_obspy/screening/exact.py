"""
Exact demand and history of pairs with a record, and the damping that keeps them apart.

Both buildings are oscillators at contact height, driven along one azimuth; only the oscillators
are estimates.

Supplemental damping is added to both buildings in steps, and refined before the first step that is
enough: more damping does not always help. The demand is the one that decides of such pairs: along
the pair's azimuth, or along the worst one where that is unknown.
"""

from typing import Any

import numpy as np

from per_obspy.checks import FloatArray
from per_obspy.pounding.correlation import worst_azimuth
from per_obspy.pounding.pair_histories import PoundingMaxima, pounding_histories
from per_obspy.pounding.relative import (
    Approach,
    approach,
    directional_relative_displacement,
    yielding_approach,
    yielding_relative_displacement,
)
from per_obspy.screening.flags import period_is_derived
from per_obspy.screening.station_motion import Record, StationMotion, by_record, record_number
from per_obspy.screening.values import (
    BoolArray,
    Both,
    Columns,
    Table,
    at_contact,
    both,
    chosen,
    only,
    oscillators,
    values,
)

#: Columns of :func:`exact_outcome`.
EXACT_COLUMNS = (
    "demand_exact",
    "demand_two_sided",
    "impacts",
    "impact_velocity_exact",
    "amplification_exact_1",
    "amplification_exact_2",
    "residual_1",
    "residual_2",
    "residual_gap",
)

#: Share of the gap below which a demand without contact, known to 1e-9, leaves the pair apart.
CERTAINLY_APART = 1.0 - 1e-6

#: Share of the yield displacement below which an elastic displacement, known to 1e-9, is elastic.
CERTAINLY_ELASTIC = 1.0 - 1e-6

#: Axes of which the worst is that of buildings that yield, degrees: 6 off the worst of all, where a
#: linear demand is 0.5 % less at most.
AXES: FloatArray = np.arange(0.0, 360.0, 12.0)

#: Columns from which the approach of a pair follows.
OSCILLATORS = [
    "station_index",
    *(
        f"{name}_{i}"
        for name in ("period", "damping", "participation", "yield_displacement", "hardening")
        for i in (1, 2)
    ),
]


def furthest_azimuth(station: StationMotion, pairs: Table) -> FloatArray:
    """Return the axis from 1 to 2 along which the record demands the largest gap, degrees."""
    columns = *oscillators(pairs), *both(pairs, "participation")
    azimuth: FloatArray = by_record(station, pairs, _worst_azimuth, columns)[0]
    # one of the axes, of buildings that yield
    weak = np.flatnonzero(can_yield(pairs))
    if weak.size:
        along = np.repeat(AXES, weak.size)
        every = chosen(only(pairs, OSCILLATORS), np.tile(weak, AXES.size))
        approaches = exact_approach(station, every, along).displacement.reshape(AXES.size, -1)
        azimuth[weak] = AXES[approaches.argmax(axis=0)]
    return azimuth


def _worst_azimuth(record: Record, *columns: FloatArray) -> FloatArray:
    azimuth: FloatArray = worst_azimuth(*record.components, *columns)[None]
    return azimuth


def exact_decides(station: StationMotion, pairs: Table) -> BoolArray:
    """
    Return a mask of the completed pairs whose demand is the exact one.

    The record must support the pair, and no period may be derived: the exact demand of two equal
    derived periods is 0.
    """
    return record_supports(station, pairs) & ~period_is_derived(pairs)


def record_supports(station: StationMotion, pairs: Table) -> BoolArray:
    """
    Return a mask of the completed pairs for which the record gives an exact demand.

    It must hold both periods in its usable range and both horizontals.
    """
    periods = np.stack(both(pairs, "period"))
    usable_periods = np.array([record.usable_periods for record in station.records])
    shortest, longest = usable_periods[record_number(station, pairs)].T
    usable = ((periods >= shortest) & (periods <= longest)).all(axis=0)
    return np.asarray(usable & (station.horizontals == 2))


def can_yield(pairs: Table) -> BoolArray:
    """Return a mask of the pairs in which a building has a yield displacement."""
    return np.asarray(np.isfinite(np.stack(both(pairs, "yield_displacement"))).any(axis=0))


def _yields(pairs: Table) -> BoolArray:
    """Return a mask of the pairs of which the record makes a building yield without contact."""
    displacement, limit = (np.stack(both(pairs, name)) for name in ("sd", "yield_displacement"))
    return np.asarray((displacement > CERTAINLY_ELASTIC * limit).any(axis=0))


def exact_outcome(
    station: StationMotion, table: Table, azimuth: FloatArray, histories: bool = True
) -> Columns:
    """
    Compute exact relative displacements and pounding histories of a block of pairs.

    Without ``histories`` all columns but the demands are empty.

    ``azimuth`` is that of the axis from 1 to 2, degrees; 0 where the station has one horizontal.
    Pairs whose azimuth is unknown are turned by 180 degrees where the demand is larger there.
    ``table`` holds completed pairs with their radii and spectral displacements along the azimuth,
    and ``azimuth_used``.
    Returns ``EXACT_COLUMNS`` and ``azimuth_used``, (n_pairs,), see ``columns.RESULTS``.
    """
    towards, away, *others = _without_contact(station, table, azimuth, _yields(table))
    # building 2 may be on either side of 1 where the pair's azimuth is unknown: the worse one
    turned = np.isnan(values(table, "azimuth")) & (away > towards)
    demand, axis = np.where(turned, away, towards), values(table, "azimuth_used")
    driven = np.where(turned, azimuth + 180.0, azimuth)
    outcome = {"azimuth_used": np.where(turned, (axis + 180.0) % 360.0, axis)}
    outcome |= {"demand_exact": demand, "demand_two_sided": np.maximum(towards, away)}
    # The demands alone
    if not histories:
        return no_outcome(demand.size) | outcome
    radii, residual = np.stack(others[:2]), np.stack(others[2:])
    outcome |= _pounding_columns(station, table, driven, demand, radii, residual)
    return outcome | _residual_columns(residual, table, record_supports(station, table))


def _pounding_columns(
    station: StationMotion,
    table: Table,
    azimuth: FloatArray,
    demand: FloatArray,
    radii: FloatArray,
    residual: FloatArray,
) -> Columns:
    """
    Return the columns of the pounding histories; ``radii`` are those of the pairs without contact.

    A demand that stays below the gap, or is 0, needs no history: radii are those without contact,
    and so is ``residual``, the displacements at rest afterwards, which receives those of the
    histories.
    """
    meets = ~(demand < CERTAINLY_APART * values(table, "gap")) & (demand > 0.0)
    impacts, velocity = np.zeros(demand.size, dtype=np.int64), np.zeros(demand.size)
    amplification = np.ones((2, demand.size))
    if meets.any():
        history = pounding_maxima(station, chosen(table, meets), azimuth[meets])
        impacts[meets], velocity[meets] = history.impacts, history.impact_velocity
        residual[:, meets] = history.residual
        # impacts amplify the radius that the same oscillator has without contact
        before, ratio = radii[:, meets], np.ones_like(history.per)
        amplification[:, meets] = np.divide(history.per, before, out=ratio, where=before > 0)
    # In the order of their names
    columns = impacts, velocity, *amplification
    return dict(zip(EXACT_COLUMNS[2:6], columns, strict=True))


def _residual_columns(residual: FloatArray, table: Table, supported: BoolArray) -> Columns:
    """Return the displacements at rest and the gap that they leave; NaN without such a history."""
    known = np.where(supported & can_yield(table), residual, np.nan)
    # What would overlap at rest is pressed together
    left = np.maximum(values(table, "gap") + known[1] - known[0], 0.0)
    return dict(zip(EXACT_COLUMNS[6:], (*known, left), strict=True))


def no_outcome(count: int) -> Columns:
    """Return empty ``EXACT_COLUMNS`` for a number of pairs."""
    return {name: np.full(count, np.nan) for name in EXACT_COLUMNS}


def exact_demand(station: StationMotion, table: Table, azimuth: FloatArray) -> FloatArray:
    """Return the largest relative displacement of 1 towards 2, as in :func:`exact_outcome`, m."""
    towards: FloatArray = _without_contact(station, table, azimuth, can_yield(table))[0]
    return towards


def exact_approach(station: StationMotion, table: Table, azimuth: FloatArray) -> Approach:
    """
    Return the largest relative motion of buildings without contact, 1 towards 2.

    For the nodes of a population: that of buildings that yield is not exact.
    """
    relative, yields = np.empty((2, azimuth.size)), can_yield(table)
    # linear pairs take the shorter computation
    if not yields.all():
        pairs = chosen(table, ~yields)
        columns = _arguments(pairs, azimuth[~yields])
        relative[:, ~yields] = by_record(station, pairs, _linear_approach, columns)
    if yields.any():
        pairs = chosen(table, yields)
        columns = *_arguments(pairs, azimuth[yields]), *_strengths(pairs)
        relative[:, yields] = by_record(station, pairs, _yielding_approach, columns)
    return Approach(*relative)


def _linear_approach(record: Record, *columns: FloatArray) -> FloatArray:
    return np.stack(approach(*record.components, *columns))


def _yielding_approach(record: Record, *columns: FloatArray) -> FloatArray:
    return np.stack(yielding_approach(record.horizontal, record.dt, *columns))


def pounding_maxima(station: StationMotion, table: Table, azimuth: FloatArray) -> PoundingMaxima:
    """Return the maxima of the pounding histories, at contact level."""
    (mass_1, mass_2), shares = both(table, "contact_mass"), both(table, "participation")
    period_1, damping_1, period_2, damping_2 = oscillators(table)
    # bilinear oscillators in order 1, 2; an infinite yield displacement is a linear one
    columns = (
        *(period_1, damping_1, mass_1, period_2, damping_2, mass_2),
        *(values(table, "gap"), values(table, "restitution"), *shares, azimuth),
        *_strengths(table),
    )
    found = by_record(station, table, _histories, columns)
    return PoundingMaxima(
        per=found[:2],
        displacement_maxima=found[2:4],
        impacts=found[4].astype(np.int64),
        impact_velocity=found[5],
        residual=found[6:],
    )


def _histories(record: Record, *columns: Any) -> FloatArray:
    """Return the fields of the maxima as rows, (8, n_pairs)."""
    return np.vstack(pounding_histories(record.horizontal, record.dt, *columns))


def _without_contact(
    station: StationMotion, table: Table, azimuth: FloatArray, yields: BoolArray
) -> FloatArray:
    """
    Return the response at contact level of pairs that do not touch, (6, n_pairs), m.

    Largest relative displacement of 1 towards 2, and with the buildings in the other order; PER of
    both buildings; their displacements at rest afterwards. Pairs that do not yield take the
    shorter computation, and their PER from the table.
    """
    # Linear buildings rest where they were
    free = np.zeros((6, azimuth.size))
    free[2:4] = at_contact(table, "per")
    if not yields.all():
        pairs = chosen(table, ~yields)
        columns = _arguments(pairs, azimuth[~yields])
        free[:2, ~yields] = by_record(station, pairs, _linear_demands, columns)
    if yields.any():
        # PER of the yielding oscillators
        pairs = chosen(table, yields)
        columns = *_arguments(pairs, azimuth[yields]), *_strengths(pairs)
        free[:, yields] = by_record(station, pairs, _yielding_response, columns)
    return free


def _linear_demands(record: Record, *columns: FloatArray) -> FloatArray:
    linear = directional_relative_displacement(*record.components, *columns)
    return np.stack([linear.one_before_two, linear.two_before_one])


def _yielding_response(record: Record, *columns: FloatArray) -> FloatArray:
    found = yielding_relative_displacement(record.horizontal, record.dt, *columns)
    return np.stack([found.one_before_two, found.two_before_one, *found.per, *found.residual])


def _arguments(pairs: Table, azimuth: FloatArray) -> tuple[FloatArray, ...]:
    """Return the arguments of relative displacements: oscillators, azimuth and participations."""
    return *oscillators(pairs), azimuth, *both(pairs, "participation")


def _strengths(pairs: Table) -> tuple[FloatArray, ...]:
    """Return yield displacement, m, and hardening of building 1, then of 2."""
    yields_1, yields_2 = at_contact(pairs, "yield_displacement")
    hardening_1, hardening_2 = both(pairs, "hardening")
    return yields_1, hardening_1, yields_2, hardening_2


#: Step of the scan over the added damping, fraction of critical.
SCAN_STEP = 0.04

#: The step before the first damping that is enough is halved so many times: to 4e-5.
HALVINGS = 10

#: Exact demands at one station that take about as long as one: the kernels run as many together.
TOGETHER = 32

#: Columns from which the exact demand follows.
NEEDED = (
    *("azimuth", "gap", "station_index"),
    *(
        f"{name}_{i}"
        for name in ("period", "damping", "participation", "per", "yield_displacement", "hardening")
        for i in (1, 2)
    ),
)

#: Largest damping of a building that still vibrates, fraction of critical.
NEARLY_CRITICAL = 0.99


def least_exact_damping(station: StationMotion, table: Table, largest: float) -> FloatArray:
    """
    Find the least added damping of both buildings with which the exact demand fits into the gap.

    ``table`` holds completed pairs whose exact demand decides and exceeds the gap. Returns a
    fraction of critical (n_pairs,), enough itself; NaN where none up to the largest is enough.
    """
    table = only(table, NEEDED)
    # As far as both buildings still vibrate
    most = np.minimum(largest, NEARLY_CRITICAL - np.maximum(*both(table, "damping")))
    low, enough = _scanned(station, table, most, int(np.ceil(largest / SCAN_STEP - 1e-9)))
    _refine(station, table, low, enough)
    return enough


def _scanned(station: StationMotion, table: Table, most: FloatArray, count: int) -> Both:
    """Return the last step that is too little, and the first that is enough; NaN if none is."""
    low, enough = np.full((2, most.size), np.nan)
    scan, waiting = np.arange(1, count + 1), np.arange(most.size)
    # Pairs that are helped or at their limit leave it
    while scan.size and waiting.size:
        # as many steps as take the time of one
        steps = scan[: _together(waiting.size)]
        added = np.minimum(steps * SCAN_STEP, most[waiting, None])
        fits = _fits(station, chosen(table, waiting), added)
        helped, first = fits.any(axis=1), fits.argmax(axis=1)
        enough[waiting[helped]] = added[helped, first[helped]]
        low[waiting[helped]] = (steps[first[helped]] - 1) * SCAN_STEP
        waiting = waiting[~helped & (added[:, -1] < most[waiting])]
        scan = scan[steps.size :]
    return low, enough


def _together(pairs: int) -> int:
    """Return how many dampings of each of some pairs take about as long as one."""
    return max(TOGETHER // pairs, 1)


def _refine(station: StationMotion, table: Table, low: FloatArray, enough: FloatArray) -> None:
    """Refine the least damping by bisection, whose upper end is always enough; NaN stays."""
    # pairs that a damping helps
    helped = np.flatnonzero(np.isfinite(enough))
    pairs, number = chosen(table, helped), np.arange(helped.size)
    left = HALVINGS if helped.size else 0
    while left:
        # every damping that the next halvings may ask for
        halvings = min(int(np.log2(_together(helped.size) + 1)), left)
        grid = _halved(np.stack([low[helped], enough[helped]], axis=1), halvings)
        fits = _fits(station, pairs, grid[:, 1:-1])
        first = np.zeros_like(number)
        for half in 2 ** np.arange(halvings)[::-1]:
            first += np.where(fits[number, first + half - 1], 0, half)
        low[helped], enough[helped] = grid[number, first], grid[number, first + 1]
        left -= halvings


def _halved(grid: FloatArray, times: int) -> FloatArray:
    """Return the points of each row with their middles between them, so many times."""
    for _ in range(times):
        middles = 0.5 * (grid[:, :-1] + grid[:, 1:])
        grid = np.insert(grid, np.arange(1, len(grid.T)), middles, axis=1)
    return grid


def _fits(station: StationMotion, table: Table, added: FloatArray) -> BoolArray:
    """Return where the exact demand with added dampings, (n_pairs, n_added), is at most the gap."""
    pairs = chosen(table, np.repeat(np.arange(len(added)), len(added.T)))
    damping_1, damping_2 = both(pairs, "damping")
    damped = pairs | {
        "damping_1": damping_1 + added.ravel(),
        "damping_2": damping_2 + added.ravel(),
    }
    # The worst azimuth turns as damping is added
    azimuth = values(damped, "azimuth").copy()
    unknown = np.isnan(azimuth)
    if unknown.any():
        azimuth[unknown] = furthest_azimuth(station, chosen(damped, unknown))
    fits = exact_demand(station, damped, azimuth) <= values(damped, "gap")
    return np.asarray(fits.reshape(added.shape))
