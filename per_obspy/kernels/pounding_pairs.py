"""The scalar half of ``pounding_lanes``: coefficients of a lane's phase, and what happens to a pair inside a step."""

import math

from ._jit import kernel
from .polynomial_roots import value_and_slope
from .pounding_contact import IMPACTS, IN_SEGMENT
from .pounding_events import DISPLACEMENT, ENERGY_RADIUS, RADIUS, find_event, finish_piece, raise_peaks
from .pounding_lanes import (
    ACTIVE,
    CENTRE,
    COSINE,
    FLEXIBILITY,
    FORCE_FLOOR,
    GUARD,
    LARGEST_PLACE,
    LARGEST_RADIUS,
    LIMIT,
    MARGIN_SHARE,
    NEXT_PLACE,
    NEXT_SPEED,
    PLACE,
    PLACE_MARGIN,
    PULL,
    SIDE,
    SINE,
    SPEED,
    SPEED_MARGIN,
    STEP_PLACE,
    STEP_SPEED,
    STIFF,
    STRUCTURE_ROWS,
    at,
)
from .pounding_motion import (
    MASS,
    PARTICIPATION,
    PLASTIC,
    RATE,
    STIFFNESS,
    YIELD,
    U,
    V,
    cluster_equation,
    fill_taylor,
    restoring,
)


@kernel
def write_step(lanes, row, lane, i, equation, duration, terms):
    """Write the coefficients of one step of structure i, whose displacement obeys the equation (see below)."""
    damping, stiffness, drive, constant = equation
    first, curve = i * STRUCTURE_ROWS, row.guard
    curve[0] = 0.0
    fill_taylor(curve, terms, 1.0, damping, stiffness, 0.0, 0.0)
    by_speed = value_and_slope(curve, terms, duration)
    fill_taylor(curve, terms, 0.0, damping, stiffness, 1.0, 0.0)
    by_force = value_and_slope(curve, terms, duration)
    fill_taylor(curve, terms, 0.0, damping, stiffness, 0.0, 1.0 / duration)
    by_ramp = value_and_slope(curve, terms, duration)
    for k in range(2):
        to = first + (STEP_PLACE if k == 0 else STEP_SPEED)
        lanes[at(to, lane)] = (1.0 - k) - stiffness * by_force[k]
        lanes[at(to + 1, lane)] = by_speed[k]
        lanes[at(to + 2, lane)] = -drive * (by_force[k] - by_ramp[k])
        lanes[at(to + 3, lane)] = -drive * by_ramp[k]
        lanes[at(to + 4, lane)] = constant * by_force[k]
    lanes[at(first + PULL, lane)] = -stiffness
    lanes[at(first + PULL + 1, lane)] = -damping
    lanes[at(first + PULL + 2, lane)] = -drive
    lanes[at(first + PULL + 3, lane)] = constant


@kernel
def equation_of(row, i):
    """Return damping, stiffness, drive and constant of ``u'' + damping u' + stiffness u = constant - drive a``."""
    first, last = (0, 1) if row.stuck[0] else (i, i)
    _, damping, stiffness, force, force_rate = cluster_equation(row, first, last, 0.0, 1.0)
    return damping, stiffness, -force_rate, force + stiffness * row.state[i, U]


@kernel
def write_guard(lanes, row, lane, equation):
    """Write the clearance, or in contact the force on the structure of finite mass over its mass."""
    if not row.stuck[0]:
        form, share, floor = (-1.0, 1.0, 0.0, 0.0, row.gaps[0]), 1.0, 0.0
    else:
        damping, stiffness, drive, constant = equation
        i = 0 if row.structures[0, MASS] < math.inf else 1
        sign = -1.0 if i == 0 else 1.0
        own, own_constant = restoring(row.structures, row.state, row.phase, i)
        by_place = sign * (own - stiffness)
        by_speed = sign * (2.0 * row.structures[i, RATE] - damping)
        by_ground = sign * (row.structures[i, PARTICIPATION] - drive)
        rest = sign * (constant - own_constant)
        form = (by_place, 0.0, by_speed, by_ground, rest) if i == 0 else (0.0, by_place, by_speed, by_ground, rest)
        share, floor = 0.0, 1e-12 * max(row.structures[0, STIFFNESS], row.structures[1, STIFFNESS])
    for k in range(5):
        lanes[at(GUARD + k, lane)] = form[k]
    lanes[at(MARGIN_SHARE, lane)], lanes[at(FORCE_FLOOR, lane)] = share, floor


@kernel
def write_phase(lanes, row, lane, duration, terms):
    """Write what depends on the phase of a pair: coefficients of the step, guards, limits."""
    for i in range(2):
        equation = equation_of(row, i)
        write_step(lanes, row, lane, i, equation, duration, terms)
        first, side = i * STRUCTURE_ROWS, row.phase[i]
        lanes[at(first + LIMIT, lane)] = row.structures[i, YIELD] if side == 0 else math.inf
        lanes[at(first + CENTRE, lane)] = row.state[i, PLASTIC]
        lanes[at(first + SIDE, lane)] = side
    finite = 0 if row.structures[0, MASS] < math.inf else 1
    write_guard(lanes, row, lane, equation_of(row, finite))


@kernel
def write_constants(lanes, row, lane, cosine, sine, duration):
    """Write what stays the same for a pair, and set its state to rest."""
    lanes[at(COSINE, lane)], lanes[at(SINE, lane)], lanes[at(ACTIVE, lane)] = cosine, sine, 1.0
    for i in range(2):
        first, stiffness = i * STRUCTURE_ROWS, row.structures[i, STIFFNESS]
        for k in (PLACE, SPEED, LARGEST_PLACE, LARGEST_RADIUS):
            lanes[at(first + k, lane)] = 0.0
        lanes[at(first + STIFF, lane)], lanes[at(first + FLEXIBILITY, lane)] = stiffness, 1.0 / stiffness
        # four times the error h⁴/384 u'''' of cubic Hermite interpolation, u'''' from the pulls at both ends
        phase = math.sqrt(stiffness) * duration
        share = (phase * phase + 2.0 * row.structures[i, RATE] * duration) / 96.0
        lanes[at(first + PLACE_MARGIN, lane)] = share * duration * duration
        lanes[at(first + SPEED_MARGIN, lane)] = share * duration


@kernel
def load_pair(lanes, row, tally, lane, pairs):
    """Copy a pair, as it was at the start of the step, to the row and the tally that the event code works on."""
    row.structures[:], row.gaps[0], row.restitution[0] = (
        pairs.structures[lane],
        pairs.gaps[lane],
        pairs.restitution[lane],
    )
    row.stuck[0], row.order[0] = pairs.stuck[lane], pairs.order[lane]
    for i in range(2):
        first = i * STRUCTURE_ROWS
        row.state[i, U], row.state[i, V] = lanes[at(first + PLACE, lane)], lanes[at(first + SPEED, lane)]
        row.state[i, PLASTIC] = lanes[at(first + CENTRE, lane)]
        row.phase[i], row.unloading[i] = pairs.phase[lane, i], pairs.unloading[lane, i]
        if row.phase[i] != 0:
            row.state[i, PLASTIC] = row.state[i, U] - row.phase[i] * row.structures[i, YIELD]
        tally.peaks[i, DISPLACEMENT] = lanes[at(first + LARGEST_PLACE, lane)]
        tally.peaks[i, RADIUS] = lanes[at(first + LARGEST_RADIUS, lane)]
        tally.peaks[i, ENERGY_RADIUS] = math.inf  # not asked for
    tally.counts[IMPACTS], tally.approach[0] = pairs.impacts[lane], pairs.approach[lane]


@kernel
def store_pair(lanes, row, tally, lane, pairs):
    """Copy a pair back, as it is at the end of the step; tell whether its phase has changed."""
    changed = row.stuck[0] != pairs.stuck[lane]
    pairs.stuck[lane], pairs.order[lane] = row.stuck[0], row.order[0]
    for i in range(2):
        first = i * STRUCTURE_ROWS
        changed |= row.phase[i] != pairs.phase[lane, i]
        changed |= row.phase[i] == 0 and row.state[i, PLASTIC] != lanes[at(first + CENTRE, lane)]
        lanes[at(first + NEXT_PLACE, lane)], lanes[at(first + NEXT_SPEED, lane)] = row.state[i, U], row.state[i, V]
        pairs.phase[lane, i], pairs.unloading[lane, i] = row.phase[i], row.unloading[i]
        lanes[at(first + LARGEST_PLACE, lane)] = tally.peaks[i, DISPLACEMENT]
        lanes[at(first + LARGEST_RADIUS, lane)] = tally.peaks[i, RADIUS]
    pairs.impacts[lane], pairs.approach[lane] = tally.counts[IMPACTS], tally.approach[0]
    return changed


@kernel
def repeat_step(row, tally, rules, segment):
    """Carry a pair through one step, event by event; tell whether it got through."""
    tally.counts[IN_SEGMENT] = 0
    elapsed = 0.0
    for _ in range(100 * rules.bounces):
        span, kind, place = find_event(row, segment, elapsed)
        raise_peaks(row, tally, span, segment.terms)
        elapsed = elapsed + span if kind else segment.duration
        finish_piece(row, tally, rules, segment, elapsed, span, kind, place)
        if elapsed >= segment.duration:
            return True
    return False
