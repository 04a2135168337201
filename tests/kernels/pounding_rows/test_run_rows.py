"""
Rows in lanes, so short that they also run uncompiled.

They run all of per_obspy.kernels.pounding_rows, and per_obspy.kernels.pounding_lanes.run_block for
rows.
"""

import math

import numpy as np
import pytest
from numpy.testing import assert_allclose

from per_obspy.kernels.pounding_lanes.lanes import (
    AXIS_COSINE,
    CONTACT_FUNCTION,
    DISPLACEMENT,
    LANE_ROWS,
    PAIR_LANES,
    ROWS,
    STEP_DISPLACEMENT,
    STEP_VELOCITY,
    TILE_CONTACT,
    TILE_STEPS,
    VELOCITY,
    sweep_tile,
)
from per_obspy.pounding.row_history import pounding_history
from per_obspy.pounding.row_maxima import BuildingRows, row_maxima
from per_obspy.pounding.structure import Structure

PULSE = -4.0 * np.sin(2 * np.pi * np.arange(40) * 0.02 / 0.8)


def row_of(structures, gap, restitution):
    """Return structures as one row along the north."""
    count = len(structures)
    fields = [[getattr(s, name) for s in structures] for name in
              ("period", "damping", "mass", "yield_displacement", "hardening")]  # fmt: skip
    others = np.ones(count), np.ones(count), np.full(count, gap), np.full(count, restitution)
    return BuildingRows(np.array([0, count]), *map(np.array, fields), *others, np.zeros(1))


@pytest.mark.parametrize("restitution", [0.0, 0.5])
@pytest.mark.parametrize("limit", [0.01, math.inf])
@pytest.mark.parametrize("gap", [0.0, 0.005])
def test_lanes_agree_with_the_single_history(restitution, limit, gap):
    # catches: lanes and rows that differ in phase handling, clusters of three
    structures = [
        Structure(0.9, 0.05, 2.0, limit, 0.1),
        Structure(0.4, 0.05, 1.0, limit, 0.1),
        Structure(0.6, 0.02, 3.0, math.inf, 0.1),
    ]
    history = pounding_history(PULSE, 0.02, structures, gap, restitution, free_vibration=False)
    maxima = row_maxima(
        PULSE, 0.0 * PULSE, 0.02, row_of(structures, gap, restitution), free_vibration=False
    )
    assert len(history.impacts) > 0
    # bounces end earlier in the lanes
    assert_allclose(maxima.radius, history.per, rtol=1e-5)
    assert_allclose(maxima.displacement, history.displacement_maxima, rtol=1e-5)


@pytest.mark.parametrize("limit", [0.01, math.inf])
def test_a_row_of_more_buildings_than_one_loop_takes(limit):
    # catches: a ninth building that is left out, or has the interface of the first
    periods = [0.9, 0.4, 0.6, 0.5, 0.8, 0.45, 0.7, 0.55, 0.3, 0.65]
    structures = [Structure(period, 0.05, 1.0, limit, 0.1) for period in periods]
    some = 0.002, 0.3
    history = pounding_history(PULSE[:20], 0.02, structures, *some, free_vibration=False)
    maxima = row_maxima(
        PULSE[:20], 0.0 * PULSE[:20], 0.02, row_of(structures, *some), free_vibration=False
    )
    assert len(history.impacts) > 100
    # bounces end earlier in the lanes
    assert_allclose(maxima.radius, history.per, rtol=1e-5)
    assert_allclose(maxima.displacement, history.displacement_maxima, rtol=1e-5)


def test_free_vibration_is_followed_until_it_is_settled():
    # catches: maxima of the record alone; the pulse ends long before the slow structures turn
    structures = [Structure(4.0, 0.02, 1.0), Structure(0.5, 0.02, 1.0), Structure(3.0, 0.02, 1.0)]
    row = row_of(structures, 10.0, 0.5)
    forced = row_maxima(PULSE[:20], 0.0 * PULSE[:20], 0.02, row, free_vibration=False)
    followed = row_maxima(PULSE[:20], 0.0 * PULSE[:20], 0.02, row)
    assert (followed.displacement[[0, 2]] > 2.0 * forced.displacement[[0, 2]]).all()
    expected = pounding_history(PULSE[:20], 0.02, structures, 10.0, 0.5).displacement_maxima
    assert_allclose(followed.displacement, expected, rtol=1e-9)  # both are exact


@pytest.mark.parametrize("count", [1, 5, 32])
def test_a_sweep_is_the_plain_step_of_every_lane(count):
    # catches: coefficients of another lane, a contact function with the wrong neighbour
    random = np.random.default_rng(0)
    lanes = np.zeros((LANE_ROWS, PAIR_LANES))
    steps = random.uniform(-0.4, 0.4, (2, 5, PAIR_LANES))
    lanes[STEP_DISPLACEMENT : STEP_DISPLACEMENT + 5] = steps[0]
    lanes[STEP_VELOCITY : STEP_VELOCITY + 5] = steps[1]
    lanes[[DISPLACEMENT, VELOCITY]] = random.normal(size=(2, PAIR_LANES))
    contact = random.normal(size=(5, PAIR_LANES))
    contact[1, -1] = 0.0  # nothing is on the right of the last lane
    lanes[CONTACT_FUNCTION : CONTACT_FUNCTION + 5] = contact
    lanes[AXIS_COSINE] = 1.0  # every row points to the north
    ground = random.normal(size=(2, TILE_STEPS + 1))

    # step by step
    u, z, least = lanes[DISPLACEMENT].copy(), lanes[VELOCITY].copy(), np.full(PAIR_LANES, np.inf)
    for k in range(count + 1):
        if k:
            drive = np.array([u, z]), ground[0, k - 1], ground[0, k]
            u, z = ((row[:2] * drive[0]).sum(0) + row[2] * drive[1] + row[3] * drive[2] + row[4]
                    for row in steps)  # fmt: skip
        form = contact[0] * u + contact[1] * np.roll(u, -1) + contact[2] * z
        least = np.minimum(least, form + contact[3] * ground[0, k] + contact[4])
    flat = np.ascontiguousarray(lanes).ravel()
    sweep_tile(ROWS, flat, np.zeros(PAIR_LANES, dtype=np.int64), ground, count)
    found = flat.reshape(LANE_ROWS, PAIR_LANES)
    # rounding of the sums
    assert_allclose(found[DISPLACEMENT], u, rtol=1e-10, atol=1e-12)
    assert_allclose(found[VELOCITY], z, rtol=1e-10, atol=1e-12)
    assert_allclose(found[TILE_CONTACT], least, rtol=1e-10, atol=1e-12)
