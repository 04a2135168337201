"""
What is possible but odd in a pair table: every kind of mistake is suspected, good tables are not.

Also of per_obspy.inventory.earlier_rows.
"""

import sys
from pathlib import Path

import numpy as np
import pandas as pd
import pytest

from per_obspy import read_pairs
from per_obspy.inventory.earlier_rows import FirstValues
from per_obspy.inventory.files.reading import PairInventory, checked_chunk
from per_obspy.inventory.footprints.footprint_pairs import find_footprint_pairs
from per_obspy.inventory.schema import ROW_SUSPICIONS
from per_obspy.inventory.suspicions import ODD

FOOT = 0.3048
EARTH = 111_195.0


def town(count=40, **changes):
    """
    Return a made-up town of pairs in metres: half the gaps 0, heights of 1 to 12 storeys.

    Changes are values, or functions of the table.
    """
    random = np.random.default_rng(7)
    storeys = random.integers(1, 13, (2, count)).astype(float)
    heights = np.round(storeys * random.uniform(2.7, 3.4, (2, count)), 1)
    azimuth = np.round(random.uniform(0.0, 360.0, count), 1)
    metres = random.uniform(9.0, 25.0, count)
    latitude = -20.3 + random.uniform(-0.05, 0.05, count)
    longitude = -67.9 + random.uniform(-0.05, 0.05, count)
    north = metres * np.cos(np.radians(azimuth)) / EARTH
    east = metres * np.sin(np.radians(azimuth)) / EARTH / np.cos(np.radians(latitude))
    touching = random.random(count) < 0.5
    table = pd.DataFrame({
        "pair_id": [f"p{i}" for i in range(count)],
        "gap": np.where(touching, 0.0, np.round(random.lognormal(-2.3, 1.0, count), 3)),
        "azimuth": azimuth,
        "longitude_1": longitude, "latitude_1": latitude,
        "height_1": heights[0], "storeys_1": storeys[0],
        "longitude_2": longitude + east, "latitude_2": latitude + north,
        "height_2": heights[1], "storeys_2": storeys[1],
    })  # fmt: skip
    for name, change in changes.items():
        table[name] = change(table) if callable(change) else change
    return table


def in_one(value, column, row=3):
    """Return a change of one row."""
    return {column: lambda table: np.where(np.arange(len(table)) == row, value, table.get(column))}


def periods(table, i=1):
    return np.round(0.0466 * table[f"height_{i}"] ** 0.9, 3)


def masses(table):
    return table["storeys_1"] * 250_000.0


def without(table, *names):
    return table.drop(columns=[f"{name}_{i}" for name in names for i in (1, 2)])


def suspected(table):
    """Return the sentences and the names of each row's suspicions."""
    pairs = read_pairs(table)
    names = pairs[ODD].tolist() if ODD in pairs else [""] * len(pairs)
    return pairs.attrs["suspicions"], names


#: Kind of mistake -> table with it, words of the one sentence, suspicions of how many rows.
COLUMNS = {
    "heights in feet": (
        town(height_1=lambda t: t.height_1 / FOOT, height_2=lambda t: t.height_2 / FOOT),
        "given in feet?",
    ),
    "heights in feet without storeys": (
        without(
            town(
                height_1=lambda t: (t.height_1 / FOOT).round(),
                height_2=lambda t: (t.height_2 / FOOT).round(),
            ),
            "storeys",
        ),
        "given in feet?",
    ),
    "heights in feet with periods": (
        without(
            town(
                period_1=periods,
                height_1=lambda t: t.height_1 / FOOT,
                period_2=lambda t: periods(t, 2) * 0.8,
                height_2=lambda t: t.height_2 / FOOT,
            ),
            "storeys",
        ).assign(period_1=lambda t: t.period_1 * 0.8),
        "heights given in feet?",
    ),
    "heights in centimetres": (
        without(town(height_1=lambda t: t.height_1 * 100.0), "storeys"),
        "height_1: 39 of 40 above 300 m: given in centimetres?",
    ),
    "numbers of storeys as heights": (
        without(town(height_1=lambda t: t.storeys_1, height_2=lambda t: t.storeys_2), "storeys"),
        "numbers of storeys?",
    ),
    "gaps in centimetres": (town(gap=lambda t: (100.0 * t.gap).round()), "given in centimetres"),
    "gaps in millimetres": (town(gap=lambda t: (1e3 * t.gap).round()), "given in centimetres"),
    "gaps in inches": (town(gap=lambda t: (t.gap / 0.0254).round(1)), "gaps above 0"),
    "gaps in quarters of an inch": (
        town(gap=np.tile([0.0, 1.0, 0.75, 2.5, 1.25, 2.0, 0.5, 1.5], 5)),
        "given in inches?",
    ),
    "inches as feet": (
        town(gap=np.tile([0.0, 0.08, 0.17, 0.25, 0.33, 0.42, 0.5, 0.08], 5)),
        "given in feet?",
    ),
    "azimuths in radians": (
        town(azimuth=lambda t: np.radians(t.azimuth).round(2)),
        "30 would if given in radians",
    ),
    "azimuths along the wall": (
        town(azimuth=lambda t: (t.azimuth + 90.0) % 360.0),
        "40 would if given along the wall",
    ),
    "azimuths backwards": (
        town(azimuth=lambda t: (t.azimuth + 180.0) % 360.0),
        "40 would if given backwards",
    ),
    "azimuths from east": (
        town(azimuth=lambda t: (90.0 - t.azimuth) % 360.0),
        "if given from east counter-clockwise",
    ),
    "azimuths of an axis": (town(azimuth=lambda t: t.azimuth % 180.0), "do not follow"),
    "frequencies": (
        town(period_1=lambda t: 1 / periods(t), period_2=lambda t: 1 / periods(t, 2)),
        "frequencies: given in Hz?",
    ),
    "periods in ms": (town(period_1=lambda t: 1e3 * periods(t)), "given in milliseconds?"),
    "dampings in per cent": (town(damping_1=np.tile([0.5, 2.0], 20)), "given in per cent?"),
    "masses in t": (town(mass_1=lambda t: masses(t) / 1e3), "given in tonnes or kN?"),
    "masses in kN": (town(mass_1=lambda t: masses(t) * 9.81e-3), "given in tonnes or kN?"),
    "yield coefficients in per cent": (town(yield_coefficient_1=10.0), "given in per cent?"),
    "restitution in per cent": (town(restitution=65.0), "given in per cent?"),
    "participation in per cent": (town(participation_1=100.0), "given in per cent?"),
    "areas in square feet": (town(area_1=3300.0, area_2=4400.0), "in square feet"),
}


@pytest.mark.parametrize("kind", COLUMNS)
def test_a_column_in_another_form_is_one_sentence(kind):
    table, words = COLUMNS[kind]
    sentences, _ = suspected(table)
    assert len(sentences) == 1, sentences
    assert words in sentences[0]


def swapped_sides(table, row=3):
    other = {"1": "2", "2": "1"}
    names = {name: name[:-1] + other[name[-1]] for name in table if name[-2:] in ("_1", "_2")}
    again = table.iloc[[row]].rename(columns=names).assign(pair_id="again")
    return again.assign(azimuth=(again["azimuth"] + 180.0) % 360.0)


def again(table, row=3):
    return table.iloc[[row]].assign(pair_id="again")


def moved(table, row=3, **factors):
    for name, factor in factors.items():
        for i in (1, 2):
            table.loc[row, f"{name}_{i}"] *= factor
    return table


def row_of(street):
    """Return a street: building i next to building i + 1, by their identifiers."""
    table = town(count=len(street) - 1)
    for i in (1, 2):
        table[f"building_id_{i}"] = street[i - 1 :][: len(table)]
        for name in ("height", "storeys"):
            table[f"{name}_{i}"] = {"height": 9.0, "storeys": 3.0}[name]
        table[f"latitude_{i}"] = -20.3 + 1e-4 * np.arange(i - 1, len(table) + i - 1)
        table[f"longitude_{i}"] = -67.9
    table["azimuth"] = 0.0
    return table


STREET = [f"b{i}" for i in range(9)]

#: Kind of mistake in row 3 or in a further last row -> table, words of the sentence, suspicion.
ROWS = {
    "300 m apart": (
        town(**in_one(-20.3, "latitude_2")).assign(
            latitude_1=lambda t: np.where(t.index == 3, -20.3 - 300.0 / EARTH, t.latitude_1),
            longitude_1=lambda t: np.where(t.index == 3, t.longitude_2, t.longitude_1),
            azimuth=lambda t: np.where(t.index == 3, 0.0, t.azimuth),
        ),
        "positions too far apart",
        "odd_positions",
    ),
    "one position": (
        town().assign(
            latitude_2=lambda t: np.where(t.index == 3, t.latitude_1, t.latitude_2),
            longitude_2=lambda t: np.where(t.index == 3, t.longitude_1, t.longitude_2),
        ),
        "both buildings at one position",
        "odd_positions",
    ),
    "azimuth across": (
        town(azimuth=lambda t: np.where(t.index == 3, (t.azimuth + 90) % 360, t.azimuth)),
        "across or against",
        "odd_azimuth",
    ),
    "one gap in cm": (town(**in_one(5.0, "gap")), "a gap above 3 m", "odd_gap"),
    "deviation above gap": (
        town(gap_std=np.nan, **in_one(0.05, "gap")).assign(
            gap_std=lambda t: np.where(t.index == 3, 0.1, np.nan)
        ),
        "gap_std is larger than gap: 1 of 40 rows, first in line 5: gap = 0.05 m, gap_std = 0.1 m",
        "odd_gap",
    ),
    "storeys 3.7": (
        town(**in_one(3.7, "storeys_1")).assign(height_1=np.nan),
        "storeys_1 with decimals: 1 of 40 rows, first in line 5: storeys_1 = 3.7",
        "odd_height",
    ),
    "a height in cm": (
        without(town(**in_one(930.0, "height_1")), "storeys"),
        "height_1 above 300 m: 1 of 40 rows, first in line 5: height_1 = 930 m",
        "odd_height",
    ),
    "contact above the roof": (
        without(town(contact_height=np.nan, **in_one(2.0, "storeys_1")), "height").assign(
            contact_height=lambda t: np.where(t.index == 3, 20.0, np.nan)
        ),
        "contact_height above the lower roof",
        "odd_height",
    ),
    "floor offset of a storey": (
        without(town(floor_offset=np.nan), "height").assign(
            floor_offset=lambda t: np.where(t.index == 3, 4.0, np.nan)
        ),
        "floor_offset above half a storey",
        "odd_height",
    ),
    "a frequency": (
        town(period_1=periods).assign(
            height_1=lambda t: np.where(t.index == 3, 3.0, t.height_1),
            storeys_1=lambda t: np.where(t.index == 3, 1.0, t.storeys_1),
            period_1=lambda t: np.where(t.index == 3, 8.0, t.period_1),
        ),
        "period_1 does not fit the height",
        "odd_period",
    ),
    "one damping in per cent": (
        town(damping_1=lambda t: np.where(t.index == 3, 0.5, 0.05)),
        "damping_1 above 0.3",
        "odd_building",
    ),
    "one mass in t": (
        town(mass_1=lambda t: np.where(t.index == 3, 900.0, masses(t))),
        "mass_1 is odd",
        "odd_building",
    ),
    "a yield displacement in cm": (
        town(yield_displacement_1=lambda t: np.where(t.index == 3, 5.0, 0.05)),
        "yield_displacement_1 above 5 % of the height",
        "odd_building",
    ),
    "a pair twice": (
        pd.concat([town(), again(town())]),
        "the same two buildings as in an earlier row: 1 of 41 rows, first in line 42: as line 5",
        "repeated_pair",
    ),
    "a pair twice with exchanged sides": (
        pd.concat([town(), swapped_sides(town())]),
        "first in line 42: as line 5",
        "repeated_pair",
    ),
    "a pair of names twice, measured anew": (
        pd.concat([row_of(STREET), swapped_sides(row_of(STREET)).assign(gap=0.31)]),
        "the same two buildings",
        "repeated_pair",
    ),
    "one building with two heights": (
        row_of(STREET).assign(height_1=lambda t: np.where(t.index == 3, 10.0, t.height_1)),
        "a building_id with another height than in an earlier row: 1 of 8 rows, first in line 5: "
        "building_id_1 = 'b3', height_1 = 10 m",
        "contradicting_building",
    ),
    "one building at two places": (
        row_of([*STREET, "b0"]),
        "a building_id with another place",
        "contradicting_building",
    ),
    "one building of two systems": (
        row_of(STREET).assign(
            system_1=lambda t: np.where(t.index == 3, "concrete_wall", "concrete_mrf"),
            system_2="concrete_mrf",
        ),
        "a building_id with another system",
        "contradicting_building",
    ),
    "one building of two periods": (
        row_of(STREET).assign(period_1=lambda t: np.where(t.index == 3, 0.7, 0.4), period_2=0.4),
        "a building_id with another period",
        "contradicting_building",
    ),
}


@pytest.mark.parametrize("kind", ROWS)
def test_an_odd_row_is_one_sentence_and_one_flag(kind):
    table, words, flag = ROWS[kind]
    sentences, names = suspected(table)
    assert len(sentences) == 1, sentences
    assert words in sentences[0]
    row = len(table) - 1 if len(table) == 41 or "measured" in kind or "places" in kind else 3
    assert [(i, name) for i, name in enumerate(names) if name] == [(row, flag)]
    assert flag in ROW_SUSPICIONS


@pytest.mark.parametrize(
    ("factors", "words"),
    [
        ({"longitude": -1.0}, "as if longitude has lost its sign"),
        ({"latitude": -1.0}, "as if latitude has lost its sign"),
        ({"longitude": -1.0, "latitude": -1.0}, "as if both have lost their sign"),
    ],
)
def test_a_pair_on_the_other_side_of_the_earth(factors, words):
    (sentence,) = suspected(moved(town().drop(columns="azimuth"), **factors))[0]
    assert sentence.startswith("positions: 1 of 40 pairs, first in line 5, far from the others")
    assert words in sentence


def test_exchanged_coordinates_of_some_rows():
    table = town().drop(columns="azimuth")
    names = ["longitude_1", "longitude_2", "latitude_1", "latitude_2"]
    table.loc[3, names] = table.loc[3, [*names[2:], *names[:2]]].to_numpy()
    (sentence,) = suspected(table)[0]
    assert "longitude and latitude are exchanged" in sentence


def test_a_town_on_both_sides_of_greenwich_and_two_towns_are_no_mistakes():
    shifted = town().drop(columns="azimuth")
    for name in ("longitude_1", "longitude_2"):
        shifted[name] += 67.9
    assert suspected(shifted)[0] == []
    other = shifted.assign(pair_id=lambda t: "q" + t.pair_id)
    for name in ("longitude_1", "longitude_2"):
        other[name] += 12.0
    assert suspected(pd.concat([shifted, other]))[0] == []


@pytest.mark.parametrize(
    ("change", "reason"),
    [
        ({"yield_coefficient_1": 10.0}, "not per cent"),
        ({"participation_2": 100.0}, "not per cent"),
        ({"restitution": 65.0}, "not per cent"),
        ({"vs30": 0.3}, "in km/s?"),
        ({"floor_offset": 50.0}, "in centimetres?"),
        ({"floor_offset": 5.0}, "larger than a storey"),
        ({"contact_height": 200.0, "height_1": np.nan, "height_2": np.nan}, "lower building"),
        ({"longitude_2": 67.9}, "a longitude without its sign?"),
        ({"latitude_1": 20.3}, "a latitude without its sign?"),
    ],
)
def test_what_is_impossible_is_refused_with_its_usual_reason(change, reason):
    table = row_of(STREET)
    for name, value in change.items():
        table[name] = np.where(table.index == 3, value, table.get(name, np.nan))
    pairs = read_pairs(table)
    (rejection,) = pairs.attrs["rejected"]
    assert (rejection.name, len(pairs)) == ("p3", 7)
    assert reason in "; ".join(rejection.reasons)


GOOD = {
    "a town": town(),
    "a few": town(3),
    "without storeys": without(town(), "storeys"),
    "without heights": without(town(), "height"),
    "periods": town(period_1=periods, period_2=lambda t: 0.5 * periods(t, 2)),
    "masses": town(mass_1=masses, mass_2=masses),
    "attics": without(town(storeys_1=2.5), "height"),
    "wide and not round": town(gap=lambda t: 1.37 * t.gap.max() + np.arange(40) * 0.013),
    "one joint of 8 cm": town(gap=0.08),
    "towers": without(town(height_1=lambda t: 30.0 + t.height_1), "storeys").assign(
        height_2=lambda t: t.height_2
    ),
    "a street": row_of(STREET),
    "unnamed buildings": row_of(STREET).assign(building_id_1="", building_id_2="-"),
    "half of the heights of a building": row_of(STREET).assign(
        height_1=lambda t: np.where(t.index % 2, t.height_1, np.nan)
    ),
    "an earthquake engineer's table of one site": pd.DataFrame({
        "pair_id": ["a", "b", "c"], "gap": [0.02, 0.1, 0.3], "height_1": [9.0, 12.0, 60.0],
        "height_2": [30.0, 12.0, 50.0], "longitude_1": 0.3, "latitude_1": 0.1,
        "longitude_2": 0.3001, "latitude_2": 0.1, "yield_coefficient_1": [0.1, 0.3, np.nan],
    }),
}  # fmt: skip


@pytest.mark.parametrize("kind", GOOD)
def test_good_tables_raise_no_suspicion(kind):
    sentences, names = suspected(GOOD[kind])
    assert (sentences, set(names)) == ([], {""})


def test_round_gaps_need_evidence():
    assert suspected(town(5, gap=[1.0, 2.0, 2.0, 3.0, 1.5]))[0] == []
    (sentence,) = suspected(town(6, gap=[1.0, 2.0, 2.0, 3.0, 1.0, 0.0]))[0]
    assert sentence.startswith("all 5 gaps above 0 are whole metres")
    (sentence,) = suspected(town(2, gap=[0.0, 8.0]))[0]
    assert sentence.startswith("1 of 1 gaps above 0 are wider than 3 m")


@pytest.mark.parametrize("size", [1, 7, 1000])
def test_chunks_of_any_size_say_what_the_whole_table_says(tmp_path, size):
    # would catch pairs and buildings compared within a chunk only, and first lines of a chunk
    other = swapped_sides(town(), 5).assign(pair_id="other")
    street = row_of(STREET).assign(pair_id=[f"s{i}" for i in range(8)])
    table = pd.concat([town(), again(town()), other, street])
    table["height_1"] = np.where(table["pair_id"] == "s6", 10.0, table["height_1"])
    table["storeys_1"] = np.where(table["pair_id"] == "s2", np.nan, table["storeys_1"])
    table["gap"] = np.where(table["pair_id"] == "p9", 4.0, table["gap"])
    path = tmp_path / "pairs.csv"
    table.to_csv(path, index=False)
    whole = read_pairs(path)
    inventory = PairInventory([path])
    chunks = [checked_chunk(chunk) for chunk in inventory.chunks(size)]
    assert inventory.suspicions.sentences() == whole.attrs["suspicions"]
    assert len(whole.attrs["suspicions"]) == 3
    # a second reading counts anew
    list(inventory.chunks(size))
    assert inventory.suspicions.sentences() == whole.attrs["suspicions"]
    names = [name for chunk in chunks for name in chunk.get(ODD, pd.Series("", chunk.index))]
    assert names == whole[ODD].tolist()


def test_names_in_any_letters_are_compared(tmp_path):
    # hashes do not depend on the longest name of a chunk, nor on its letters
    names = ["a", "日本橋", "x" * 70, "Şişli 12", "a b", "12345678", "123456789"]
    table = row_of([*names, *STREET])
    odd = table.iloc[[0]].assign(pair_id="odd", height_1=15.0, storeys_1=5.0, building_id_2="new")
    both = pd.concat([table, odd.assign(latitude_2=odd["latitude_2"])])
    both.to_csv(tmp_path / "pairs.csv", index=False)
    inventory = PairInventory([tmp_path / "pairs.csv"])
    list(inventory.chunks(2))
    sentences = inventory.suspicions.sentences()
    assert any("another height" in one and "building_id_1 = 'a'" in one for one in sentences)
    assert all("1 of 16 rows" in one for one in sentences)


def test_units_are_of_the_file_they_come_from(tmp_path):
    # one of two files in centimetres
    town().to_csv(tmp_path / "metres.csv", index=False)
    other = town(gap=lambda t: (100.0 * t.gap).round(), longitude_1=lambda t: t.longitude_1)
    other["pair_id"] = "q" + other["pair_id"]
    for i in (1, 2):
        other[f"latitude_{i}"] += 0.2
    other.to_csv(tmp_path / "cm.csv", index=False)
    inventory = PairInventory([tmp_path / "metres.csv", tmp_path / "cm.csv"])
    list(inventory.chunks(30))
    (sentence,) = inventory.suspicions.sentences()
    assert sentence.startswith("cm.csv: ")


def test_text_in_a_column_of_numbers_does_not_hide_a_unit(tmp_path):
    table = town(gap=lambda t: (100.0 * t.gap).round()).astype({"gap": object})
    table.loc[0, "gap"] = "five"
    table.to_csv(tmp_path / "pairs.csv", index=False)
    pairs = read_pairs(tmp_path / "pairs.csv")
    assert "centimetres" in pairs.attrs["suspicions"][0]
    assert pairs.attrs["proposed_units"] == {"gap": "cm"}


def test_memory_is_16_bytes_for_a_pair_and_a_building():
    table, random = FirstValues(), np.random.default_rng(1)
    for _ in range(50):
        keys = np.sort(random.integers(1, 1 << 63, 2000).astype(np.uint64))
        table.add(keys, keys)
    sizes = [sys.getsizeof(one.base if one.base is not None else one) for one, _ in table._runs]
    # runs of 8 bytes per key, and no more than a few of them
    assert sum(sizes) < 8.1 * 100_000 + 1000 * len(sizes)
    assert len(sizes) < 20


def test_the_pairs_of_the_demonstration_raise_no_suspicion():
    pairs = read_pairs(Path(__file__).parents[2] / "catalogs/demo/pairs.csv")
    assert (pairs.attrs["suspicions"], ODD in pairs) == ([], False)


@pytest.mark.real_data
@pytest.mark.parametrize("distance", [3.0, 10.0])
@pytest.mark.parametrize("town_name", ["guatemala", "san_jose"])
def test_surveyed_towns_raise_no_suspicion(real_data, town_name, distance, tmp_path):
    layer = real_data / f"inventories/footprints/{town_name}_pilot_region_all_fields.gpkg"
    pairs = find_footprint_pairs(layer, distance).pairs
    pairs.attrs.clear()
    pairs.to_parquet(tmp_path / "pairs.parquet")
    read = read_pairs(tmp_path / "pairs.parquet")
    assert len(read) > 300
    assert (read.attrs["suspicions"], ODD in read) == ([], False)


@pytest.mark.parametrize("gap", [0.0, 0.3])
def test_ordinary_gaps_are_no_other_unit(gap):
    assert suspected(town(3, gap=[gap, 0.05, 0.0]))[0] == []
