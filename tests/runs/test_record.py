"""Stations in ``run.json``: expected, received, late, rejected, and shares of pairs."""

import json

import pytest

from per_obspy.runs.record import (
    KnownStations,
    Served,
    earlier_facts,
    station_facts,
)


@pytest.fixture
def known():
    """Four expected stations, of which three have records; one file waits."""
    return KnownStations.of(["N.A", "N.D"], ["N.A", "N.B", "N.C"], ())


def test_every_station_is_in_one_list_beyond_the_expected_ones(known):
    counts = {"pairs": 8, "rejected_pair": 2, "buildings": 4}
    facts = station_facts(known, ["N.A", "N.B"], Served({"N.A": 6, "N.B": 2}, {"N.A": 3}), counts)
    assert facts["expected"] == ["N.A", "N.B", "N.C", "N.D"]
    assert facts["received"] == ["N.A", "N.B", "N.C"]
    assert (facts["late"], facts["rejected"]) == (["N.D"], ["N.C"])
    # of all ten pairs, two of which no station serves
    assert facts["share_of_pairs"] == 0.8
    assert facts["serves"]["N.A"] == {
        "pairs": 6,
        "buildings": 3,
        "share_of_pairs": 0.6,
        "share_of_buildings": 0.75,
    }
    assert facts["serves"]["N.B"]["buildings"] == 0


def test_unknown_buildings_and_empty_inventories_have_no_share(known):
    facts = station_facts(known, ["N.A"], Served({}, {}), {"pairs": 0, "rejected_pair": 0})
    assert facts["serves"] == {"N.A": {"pairs": 0, "share_of_pairs": 0.0}}
    assert facts["share_of_pairs"] == 0.0


@pytest.mark.parametrize("damage", [None, "", "[]", {"stations": 3}, {"stations": {"expected": 1}}])
def test_a_damaged_record_knows_no_station(tmp_path, damage):
    file = tmp_path / "run.json"
    if damage is not None:
        content = {"key": "", "outputs": {}, **damage} if isinstance(damage, dict) else None
        file.write_text(json.dumps(content) if content else str(damage))
    assert earlier_facts(file) == ([], KnownStations())


def test_a_screening_again_keeps_what_was_expected(tmp_path, known):
    file = tmp_path / "run.json"
    facts = station_facts(known, ["N.A"], Served({}, {}), {"pairs": 1, "rejected_pair": 0})
    file.write_text(json.dumps({"key": "", "outputs": {}, "stations": facts, "earthquakes": [1]}))
    assert earlier_facts(file) == ([1], known)
