"""Numbers of a pair in words."""

import numpy as np
import pandas as pd
import pytest

from per_obspy.report.words import (
    RANKED_BY_NEED,
    chance_text,
    length_text,
    pair_lines,
    speed_text,
)
from per_obspy.screening.ranking import NO_VERDICT

PAIR = {
    "pair_id": "P7",
    "rank": 3,
    "state": "likely",
    "risk_class": "high",
    "probability": 0.52,
    "gap": 0.05,
    "demand": 0.123,
    "demand_rule": "exact",
    "expected_impact_velocity": 0.215,
    "impact_velocity_84": 0.31,
    "impacts": np.int64(4),
    "impact_velocity_exact": 0.4,
    "period_1": 0.23,
    "building_id_1": "tower",
    "station": "XX.ONE",
    "distance": 1234.0,
    "missing_gap": 0.073,
    "supplemental_damping": 0.12,
    "bumper_restitution": 0.4,
    "flags": "touching simulated",
    "derived": "mass_1",
}


def test_every_number_of_a_pair_is_said():
    lines = pair_lines(PAIR)
    for expected in (
        "Pair P7 likely pounds.",
        "Probability of contact: 52 of 100.",
        "Gap: 5 cm.",
        "Gap needed: 12.3 cm (exact for the record).",
        "Expected impact velocity: 0.21 m/s; in 84 of 100 cases not above 0.31 m/s.",
        "In this record: 4 impacts, the fastest 0.4 m/s.",
        "Building 1 (tower): period 0.23 s.",
        "Record: station XX.ONE, 1.2 km away.",
        "A gap wider by 7.3 cm would have kept them apart.",
        "So would 12 percent more damping in both.",
        "A bumper of restitution 0.4 or less would soften it.",
        "Flag simulated: the ground motion is simulated.",
        "Derived, not given: mass 1.",
    ):
        assert expected in lines


def test_a_row_of_pandas_says_the_same():
    assert pair_lines(dict(pd.Series(PAIR).items())) == pair_lines(PAIR)


def test_an_unknown_gap_is_no_promise():
    # would catch a pair that looks safe because nothing is said
    lines = pair_lines(PAIR | {"state": "unknown", "gap": np.nan, "probability": np.nan})
    assert lines[0] == "Pair P7 may pound: its gap is unknown."
    assert "Gap: unknown." in lines
    assert not any(line.startswith("Probability") for line in lines)


def test_a_rank_is_explained_where_the_record_shows_no_impact():
    # would catch "rank 1, severe" beside "0 impacts" without a reason
    lines = pair_lines(PAIR | {"impacts": 0, "impact_velocity_exact": 0.0, "rank": 1})
    assert "In this record: 0 impacts, the fastest 0 m/s." in lines
    reason = lines[lines.index("In this record: 0 impacts, the fastest 0 m/s.") + 1]
    assert "count every outcome" in reason
    assert "52 of 100" in reason
    # Nothing to explain where no outcome hits, or where the gap is unknown
    quiet = {"impacts": 0, "expected_impact_velocity": 0.0, "probability": 0.0, "state": "no"}
    assert not any("outcome" in line for line in pair_lines(PAIR | quiet))
    unknown = {"state": "unknown", "gap": np.nan, "probability": np.nan, "impacts": np.nan}
    needed = "It is ranked by the gap that it needs, as if the buildings touched."
    assert needed in pair_lines(PAIR | unknown | {"expected_impact_velocity": np.nan})
    # An ensemble has no state, but a probability in each scenario
    joined = {"pair_id": "P7", "rank": 3, "worst_scenario": "near", "probability": np.nan}
    joined |= {"probability_near": 0.4, "probability_far, far": np.nan}
    assert needed in pair_lines(joined | {"gap": np.nan})
    lines = pair_lines(joined | {"gap": 0.1})
    assert "It has no result in far, far, and is ranked by the other scenarios." in lines
    assert needed not in lines


BARE = {"pair_id": "P7", "rank": 1, "gap": 0.3, "demand": 0.1, "state": "no"}


@pytest.mark.parametrize(
    ("pair", "expected"),
    [
        (
            BARE | {"station": "XX.ONE", "missing_gap": 0.0},
            "Prevention: none needed in this event.",
        ),
        (BARE | {"spectrum": "code.csv"}, "Prevention: none needed under this spectrum."),
        (BARE | {"state": "possible"}, "Prevention: the gap is enough for the likeliest inputs;"),
        (BARE | {"gap": np.nan, "state": "unknown"}, "Prevention: the gap is unknown"),
        # The configuration assumes the gap
        (BARE | {"risk_class": "gap unknown"}, "Prevention: the gap is unknown"),
        ({"pair_id": "P7", "gap": 0.3, "worst_scenario": "near"}, "Prevention: not computed in"),
        (BARE | {"spectrum": "code.csv", "gap": 0.01}, "A gap wider by 9 cm would keep them"),
        (BARE | {"station": "", "gap": 0.01}, "A gap wider by 9 cm would have kept them apart."),
    ],
)
def test_none_needed_is_said_only_of_what_was_computed_and_stays_apart(pair, expected):
    (line,) = (line for line in pair_lines(pair) if line.startswith(expected.split()[0] + " "))
    assert line.startswith(expected)
    # Neither of these pairs that need a gap has a record
    without_record = "Damping and bumpers: not computed without a record." in pair_lines(pair)
    assert without_record == expected.startswith("A gap")


@pytest.mark.parametrize("name", ["<script>alert(1)</script>", "\u202eevil\n", "x" * 10_000])
def test_hostile_names_are_short_and_on_one_line(name):
    lines = pair_lines(PAIR | {"pair_id": name, "flags": name, "building_id_1": name})
    assert all(len(line) < 500 and line.isprintable() for line in lines)


def test_a_pair_that_a_scenario_lacks_has_a_gap_and_no_verdict():
    pair = {"pair_id": "P7", "gap": 0.04, "rank": 3, "state": "unknown", "worst_scenario": "near"}
    lines = pair_lines(pair | {"risk_class": NO_VERDICT, "probability_far": np.nan})
    # would catch a known gap that is called unknown, and a rank with two reasons
    assert lines[:2] == ["Pair P7 has no verdict.", "Class no verdict, rank 3."]
    assert "It has no result in far, and is ranked by the other scenarios." in lines
    assert not any("unknown" in line or RANKED_BY_NEED in line for line in lines[:5])


def test_certainty_is_not_rounded_up():
    assert chance_text(0.9999) == "over 99 of 100"
    assert chance_text(1e-6) == "under 1 of 100"
    assert [length_text(value) for value in (np.nan, 0.00004)] == ["unknown", "0.04 mm"]
    assert speed_text(np.nan) == "unknown"
