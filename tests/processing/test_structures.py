import numpy as np
import pytest
from obspy import Stream, Trace, read

from per_obspy.config import Processing
from per_obspy.processing.chain import process_instruments, process_station
from per_obspy.processing.components import in_structure, split_structures


@pytest.mark.parametrize(
    "place",
    [
        "Roof: Center",
        "1st Floor",
        "Bsmt",
        "ABUTMENT 1",
        "DECK NEAR SOUTH ABUTMENT",
        "Pier 3, pile cap",
    ],
)
def test_words_of_structures_are_recognised(place):
    # would catch a search that minds the case of the letters
    assert in_structure(Trace(header={"sensor_location": place}))


@pytest.mark.parametrize(
    "place", ["FREEFIELD", "Free-field near dam", "Ground", "Benton", "Damascus", ""]
)
def test_the_ground_is_not_a_structure(place):
    # "Benton" would catch a search inside words, "near dam" one that forgets that free field has
    # the last word
    assert not in_structure(Trace(header={"sensor_location": place}))


def test_a_station_named_after_a_bridge_is_not_a_structure():
    assert not in_structure(Trace(header={"station_name": "HAYWARD - BRIDGE DECK"}))


def test_every_trace_is_on_one_side():
    stream = Stream(
        [Trace(np.arange(3.0), {"sensor_location": place}) for place in ("Roof", "Ground", "Deck")]
    )
    ground, structure = split_structures(stream)
    assert [trace.stats.sensor_location for trace in ground] == ["Ground"]
    assert [trace.stats.sensor_location for trace in structure] == ["Roof", "Deck"]


@pytest.mark.real_data
def test_the_free_field_of_a_bridge_is_used_and_the_bridge_kept_separate(real_data):
    folder = real_data / "spectra_v3" / "tomsplace2006"
    stream = Stream()
    for number in range(1, 10):
        stream += read(str(folder / f"CHAN00{number}.V2"))
    # three of nine channels recorded the ground
    best, rejected = process_station(stream, Processing())
    assert [trace.stats.sensor_location for trace in best] == ["FREEFIELD"] * 3
    assert len(rejected) == 6
    assert all("in a structure (" in row.reasons[0] for row in rejected)
    # the others are processed on request
    _, structure = split_structures(stream)
    processed, unfit = process_instruments(structure, Processing())
    assert sum(map(len, processed)) + len(unfit) == 6


@pytest.mark.real_data
def test_a_bridge_without_a_free_field_sensor_gives_no_ground_motion(real_data):
    folder = real_data / "spectra_v3" / "hayward_20210426"
    stream = Stream()
    for path in sorted(folder.iterdir()):
        if path.suffix.lower() == ".v2":
            stream += read(str(path))
    best, rejected = process_station(stream, Processing())
    assert not best
    assert len(rejected) == len(stream) == 5
