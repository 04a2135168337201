"""Order of pairs: worst first by each criterion in turn; states and classes."""

import numpy as np
import pandas as pd
from hypothesis import given
from hypothesis import strategies as st
from numpy.testing import assert_array_equal
from screening_samples import make_pairs

import per_obspy
from per_obspy.config import Screening, States
from per_obspy.screening.ranking import (
    KEYS,
    STATES,
    configurations,
    in_order,
    pounding_state,
    risk_class,
    state_columns,
    worst_first,
)

#: From worst to best; each row is better than the one before by the criterion in its name. The
#: state has no say: a possible pair that hits hard outranks a yes.
TABLE = pd.DataFrame(
    [
        ("velocity", "possible", 0.2, 0.9, 1.0, 1.0, 1.0),
        ("amplification", "likely", 0.5, 0.5, 1.8, 1.0, 1.0),
        ("probability", "yes", 0.95, 0.5, 1.2, 1.0, 1.0),
        ("importance", "likely", 0.5, 0.5, 1.2, 1.5, 1.0),
        ("occupants", "likely", 0.5, 0.5, 1.2, 1.0, 90.0),
        ("x name", "likely", 0.5, 0.5, 1.2, 1.0, 1.0),
        ("y name", "likely", 0.5, 0.5, 1.2, 1.0, 1.0),
        ("z touching in step", "yes", 1.0, 0.0, 1.0, 9.0, 9.0),
    ],
    columns=[
        "pair_id",
        "state",
        "probability",
        "weighted_velocity",
        "expected_amplification",
        "importance_2",
        "occupants_1",
    ],
)


@given(st.permutations(range(len(TABLE))))
def test_the_worst_is_first_however_the_pairs_came(order):
    # would catch a criterion that is missing, turned round, or in the wrong place
    ranked = worst_first(TABLE.iloc[list(order)])
    assert ranked["pair_id"].tolist() == TABLE["pair_id"].tolist()
    assert ranked["rank"].tolist() == list(range(1, len(TABLE) + 1))


def test_importance_and_occupants_may_be_unknown_and_a_missing_velocity_is_none():
    bare = TABLE[["pair_id", "weighted_velocity"]].copy()
    bare.loc[0, "weighted_velocity"] = np.nan
    ranked = worst_first(bare)
    assert set(ranked["pair_id"].iloc[-2:]) == {"velocity", "z touching in step"}
    assert list(bare) == ["pair_id", "weighted_velocity"]  # the caller's table is as it was
    assert np.isfinite(in_order(bare)[[*KEYS]].to_numpy()).all()


def test_keys_rise_from_the_worst_pair_on():
    # pieces of a table are merged by these columns
    keys = in_order(TABLE)[[*KEYS]].to_numpy().tolist()
    assert keys == sorted(keys)


def test_no_pairs_have_an_order():
    empty = worst_first(TABLE.iloc[:0])
    assert empty.empty
    assert "rank" in empty


def test_a_class_includes_its_threshold():
    classes = {"severe": 0.5, "high": 0.2, "low": 0.0}
    velocity = np.array([9.0, 0.5, np.nextafter(0.5, 0.0), 0.2, 0.1, 0.0])
    expected = ["severe", "severe", "high", "high", "low", "low"]
    assert risk_class(velocity, classes).tolist() == expected


def test_a_state_includes_its_threshold():
    thresholds = States(yes=0.8, likely=0.6, possible=0.3, unlikely=0.1)
    reached = np.array([0.8, 0.6, 0.3, 0.1, 0.0])
    assert pounding_state(reached, thresholds).tolist() == list(STATES)
    below = np.nextafter(reached[:-1], 0.0)
    assert pounding_state(below, thresholds).tolist() == list(STATES[1:])


@given(st.lists(st.floats(0.0, 1.0), min_size=2, max_size=20))
def test_a_likelier_pair_never_has_a_less_likely_state(chances):
    states = pounding_state(np.sort(np.array(chances)), Screening().states)
    order = [STATES.index(state) for state in states]
    assert_array_equal(order, sorted(order, reverse=True))


def test_no_gap_between_learned_outlines_is_a_no(station):
    # would catch: a state by the probability alone, a flag without the state
    wide = {"gap": 3.0, "gap_std": 0.1}
    learned = {"gap_std_source": "learned", "height_source_2": "raster"}
    rows = [wide, {**wide, **learned}, {**learned, "gap": 0.0, "height_source_2": ""}]
    table = per_obspy.risk_table(station, make_pairs(rows)).set_index("pair_id").sort_index()
    assert table["state"].tolist() == ["no", "unlikely", "yes"]
    flagged = table["flags"].str.split().map(lambda names: "learned_outlines" in names)
    assert flagged.tolist() == [False, True, True]
    # the source of a height is a column that is only carried
    assert table["flags"].str.contains("raster_height").tolist() == [False, True, False]
    # nothing else is changed
    assert table["probability"].iloc[0] == table["probability"].iloc[1]


#: Two equal buildings that meet floor to floor, inside of a row.
PLAIN = {
    "gap": 0.0, "demand": 0.1, "probability": 1.0, "expected_impact_velocity": 0.15,
    "storeys_1": 4.0, "storeys_2": 4.0, "mass_1": 1e6, "mass_2": 1e6, "floors_misaligned": False,
    "position": "inside", "yield_displacement_1": np.inf, "yield_displacement_2": np.inf,
    "hazus_yield_1": np.nan, "hazus_yield_2": np.nan, "sd_1": 0.1, "sd_2": 0.1,
}  # fmt: skip


def _states(*rows):
    return pd.DataFrame(state_columns(pd.DataFrame([PLAIN | row for row in rows]), Screening()))


def test_configurations_are_named_and_weigh_the_velocity():
    rows = [
        {},
        {"floors_misaligned": True},
        {"storeys_2": 6.0},
        {"storeys_2": 5.0, "mass_2": 1.99e6},
        {"mass_1": 2e6},
        {"position": "end"},
        {"floors_misaligned": True, "storeys_1": 1.0, "mass_2": 1e7, "position": "end"},
    ]
    table = _states(*rows)
    every = "floor_to_column tall_beside_low light_beside_heavy end_of_row"
    assert table["configuration"].tolist() == [
        "", "floor_to_column", "tall_beside_low", "", "light_beside_heavy", "end_of_row", every
    ]  # fmt: skip
    # the largest factor; masses and ends are in the histories already
    expected = [0.15, 0.3, 0.225, 0.15, 0.15, 0.15, 0.3]
    np.testing.assert_allclose(table["weighted_velocity"], expected, rtol=1e-14)
    assert table["risk_class"].tolist() == [
        "moderate", "high", "high", "moderate", "moderate", "moderate", "high"
    ]  # fmt: skip


def test_a_configuration_without_contact_is_not_raised():
    table = _states({"floors_misaligned": True, "expected_impact_velocity": 0.0})
    assert table["risk_class"].tolist() == ["low"]


def test_unknown_storeys_and_positions_have_no_configuration():
    rows = pd.DataFrame([PLAIN | {"storeys_1": np.nan}]).drop(columns="position")
    assert not any(mask.any() for mask in configurations(rows).values())
