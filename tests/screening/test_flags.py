"""Flags: raised exactly where their condition is met."""

import numpy as np
import pytest
import xarray as xr
from numpy.testing import assert_array_equal

from per_obspy.config import Screening
from per_obspy.screening.flags import (
    elastic_ratios,
    joined_flags,
    period_is_derived,
    raised_by_pairs,
    raised_by_record,
)
from per_obspy.screening.meanings import FLAGS

#: Two pairs that raise no flag.
PLAIN = {
    "gap": [0.1, 0.1],
    "demand": [0.1, 0.1],
    "demand_ratio": [1.0, 1.0],
    "derived": ["", ""],
    "floors_misaligned": [False, False],
    "soft_ground": [False, False],
    "distance": [1e3, 1e3],
    "period_1": [0.5, 0.5],
    "period_2": [2.0, 2.0],
    "damping_1": [0.05, 0.05],
    "damping_2": [0.05, 0.05],
    "per_1": [0.1, 0.1],
    "per_2": [0.2, 0.2],
    "sd_1": [0.1, 0.1],
    "sd_2": [0.2, 0.2],
    "elastic_ratio_1": [0.5, 0.5],
    "elastic_ratio_2": [1.0, 1.0],
    "yield_displacement_1": [np.inf, np.inf],
    "yield_displacement_2": [np.inf, np.inf],
    "other_site_class": [False, False],
    "linearized_converged": [True, True],
    "supplemental_damping": [0.0, 0.0],
    "bumper_restitution": [1.0, 1.0],
}


def _table(**changes):
    """Return the plain pairs with other values of the second one."""
    table = {name: np.array(column) for name, column in PLAIN.items()}
    for name, value in changes.items():
        table[name] = np.array([PLAIN[name][0], value])
    return table


def _station(horizontals=2, simulated="false", flags=""):
    """Return a station whose record supports 0.1 to 5 s."""
    return xr.Dataset(
        {
            "acceleration": (("horizontal", "time"), np.zeros((horizontals, 3))),
            "shortest_usable_period": 0.1,
            "longest_usable_period": 5.0,
            "record_flags": flags,
        },
        attrs={"simulated": simulated},
    )


def _raised(flags):
    """Return the flags that the first and the second pair raise."""
    first = {name for name, rows in flags.items() if rows[0]}
    second = {name for name, rows in flags.items() if rows[1]}
    return [first, second]


@pytest.mark.parametrize(
    ("changes", "flags"),
    [
        ({"gap": 0.0}, {"touching"}),
        ({"demand_ratio": 0.59}, {"single_hit_unreliable"}),
        ({"demand_ratio": 0.6}, set()),
        ({"demand_ratio": np.nan, "demand": 0.0}, {"no_demand"}),
        ({"derived": "system_1"}, {"derived_inputs"}),
        ({"derived": "mass_2 period_2"}, {"derived_inputs", "derived_period"}),
        # both periods equal and derived, which no record can tell apart
        (
            {"derived": "period_1 period_2", "period_2": 0.5},
            {"derived_inputs", "derived_period", "equal_by_formula"},
        ),
        ({"floors_misaligned": True}, {"floor_to_column"}),
        ({"soft_ground": True}, {"soft_ground"}),
        # either building counts, whether the strength of the other is known or not
        ({"elastic_ratio_1": 1.01}, {"beyond_elastic"}),
        ({"elastic_ratio_2": 1.01}, {"beyond_elastic"}),
        # by an assumed strength it yields; below it nothing is assumed of the results
        ({"elastic_ratio_2": 1.01, "yield_displacement_2": 0.1}, {"assumed_strength"}),
        ({"elastic_ratio_2": 0.99, "yield_displacement_2": 0.1}, set()),
        ({"elastic_ratio_1": 1.01, "yield_displacement_2": 0.1}, {"beyond_elastic"}),
        # of unknown system it is linear, unless its strength is given
        ({"elastic_ratio_1": np.nan}, {"unknown_strength"}),
        ({"elastic_ratio_1": np.nan, "yield_displacement_1": 0.1}, set()),
    ],
)
def test_flags_of_pairs(changes, flags):
    assert _raised(raised_by_pairs(_table(**changes))) == [set(), flags]


def test_a_building_is_compared_with_a_strength_that_nobody_gave():
    pairs = {
        "sd_1": [0.06, 0.06, 0.06, 0.06],
        "hazus_yield_1": [0.03, 0.03, 0.03, np.nan],
        "yield_displacement_1": [np.inf, 0.03, 0.02, np.inf],
    }
    pairs |= {name.replace("_1", "_2"): column for name, column in pairs.items()}
    # twice its yield displacement, linear or by that of HAZUS; given; of unknown system
    assert_array_equal(elastic_ratios(pairs)["elastic_ratio_1"], [2.0, 2.0, np.nan, np.nan])


@pytest.mark.parametrize(
    ("changes", "flags"),
    [
        # either building counts
        ({"period_1": 0.09}, {"outside_usable_periods"}),
        ({"period_2": 5.1}, {"outside_usable_periods"}),
        ({"period_1": 0.1, "period_2": 5.0}, set()),
        ({"per_2": 0.31}, {"per_far_above_sd"}),
        ({"per_1": 0.16}, {"per_far_above_sd"}),
        ({"distance": 5001.0}, {"far_station"}),
        ({"other_site_class": True}, {"record_from_other_site_class"}),
        ({"linearized_converged": False}, {"linearized_not_converged"}),
        ({"supplemental_damping": np.nan}, {"no_damping_suffices"}),
        ({"bumper_restitution": np.nan}, {"no_bumper_suffices"}),
    ],
)
def test_flags_of_the_record(changes, flags):
    raised = raised_by_record(_table(**changes), _station(), Screening())
    assert _raised(raised) == [set(), flags]


def test_flags_of_the_station_hold_for_all_its_pairs():
    raised = raised_by_record(_table(), _station(1, "true"), Screening())
    assert _raised(raised) == [{"one_horizontal", "simulated"}] * 2


def test_motion_of_other_classes_is_flagged_where_the_column_is_known():
    table = _table() | {"motion_from_other_site_class": np.array([False, True])}
    raised = raised_by_record(table, _station(), Screening())
    assert _raised(raised) == [set(), {"motion_from_other_site_class"}]


def test_every_flag_has_a_meaning():
    # would catch a flag that is raised and then dropped, because its name is not in the table
    raised = raised_by_pairs(_table()) | raised_by_record(_table(), _station(), Screening())
    assert set(raised) <= set(FLAGS)


def test_names_are_joined_in_one_order():
    raised = {"simulated": np.array([True, True]), "touching": np.array([False, True])}
    assert joined_flags(raised).tolist() == ["simulated", "touching simulated"]


def test_a_period_is_derived_only_if_it_is_named():
    derived = np.array(["", "period_1", "damping_1 period_2", "mass_1"], dtype=object)
    assert period_is_derived({"derived": derived}).tolist() == [False, True, True, False]


def test_every_pair_has_the_flags_of_its_record():
    raised = raised_by_record(_table(), _station(flags="second_event unknown"), Screening())
    assert _raised(raised) == [{"second_event"}, {"second_event"}]
    # rows of several stations are joined: a flag that is not raised is False, not missing
    assert not raised["baseline_shift"].any()
