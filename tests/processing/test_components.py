"""Components of a station: structures, instruments, directions, pairs of horizontals."""

import numpy as np
import pytest
from numpy.testing import assert_allclose, assert_array_equal
from obspy import Stream, Trace, UTCDateTime, read

from per_obspy.config import Processing
from per_obspy.processing.chain import process_instruments, process_station
from per_obspy.processing.components import (
    at_one_interval,
    in_structure,
    instruments,
    is_horizontal,
    orient,
    paired,
    split_structures,
    tell_apart,
)

OVERLAP = 0.8  # of the longer horizontal


def trace(channel="HNE", count=1000, start=0.0, location="", **stats):
    header = {
        "network": "XX",
        "station": "STA",
        "location": location,
        "channel": channel,
        "sampling_rate": 100.0,
    }
    header |= {"starttime": UTCDateTime(2020, 1, 1) + start} | stats
    return Trace(np.sin(np.arange(count) + 100 * start), header)


@pytest.mark.parametrize(
    ("channel", "azimuth", "horizontal"),
    [
        ("HNN", 0.0, True),
        ("HNE", 90.0, True),
        ("HNZ", None, False),
        ("HN1", None, True),
        ("HNX", None, True),
        ("NS", 0.0, True),
        ("EW2", 90.0, True),
        ("UD1", None, False),
        ("090", 90.0, True),
        ("360", 0.0, True),
        ("H1", None, True),
        ("L", None, True),
        ("TRAN", None, True),
        ("VERT", None, False),
        ("Up", None, False),
        ("north", 0.0, True),
        ("HHW", None, True),
    ],
)
def test_the_code_gives_the_direction_without_metadata(channel, azimuth, horizontal):
    out = orient(trace(channel))
    assert out.stats.get("sensor_azimuth") == azimuth
    assert is_horizontal(out) is horizontal
    assert out.stats.per_obspy.azimuth_source == ("unknown" if azimuth is None else "channel code")


def test_metadata_go_before_the_code():
    out = orient(trace("HNE", sensor_azimuth=27.0, sensor_dip=0.0))
    assert out.stats.sensor_azimuth == 27.0
    assert out.stats.per_obspy.azimuth_source == "metadata"


def name(component):
    return f"{component.stats.location}.{component.stats.channel}"


def names(stream):
    """Return location and channel of the traces of each instrument."""
    return [list(map(name, group)) for group in instruments(stream)]


def test_instruments_are_separate_and_accelerometers_go_first():
    codes = ["BHE", "HHE", "BNE", "HNE", "HNN"]
    stream = Stream([trace(code) for code in codes] + [trace("HNE", location="10")])
    expected = [[".HNE", ".HNN"], ["10.HNE"], [".BNE"], [".HHE"], [".BHE"]]
    assert names(stream) == expected


def test_surface_and_borehole_are_separate_and_the_surface_goes_first():
    stream = Stream([trace(code) for code in ("EW1", "NS1", "EW2", "NS2")])
    assert names(stream) == [[".EW2", ".NS2"], [".EW1", ".NS1"]]


def test_horizontals_come_out_with_the_same_times():
    # mutation: trimming by time alone leaves the fraction of a sample
    early, late = trace("HNE", 1000), trace("HNN", 1000, start=0.504)
    accepted, rejected = paired(map(orient, Stream([early, late, trace("HNZ")])), OVERLAP)
    codes = ("HNE", "HNN", "HNZ")
    east, north, vertical = (accepted.select(channel=code)[0] for code in codes)
    assert rejected == ()
    assert east.stats.starttime == north.stats.starttime == late.stats.starttime
    assert_array_equal(east.data, early.data[50:])
    assert_array_equal(north.data, late.data[:950])
    assert east.stats.per_obspy.clock_shift == pytest.approx(0.004)
    assert vertical.stats.npts == 1000


@pytest.mark.parametrize(
    ("second", "reason"),
    [
        ({"sensor_azimuth": 275.0}, "5 degrees from its partner"),
        ({"sampling_rate": 101.0}, "sampled every 0.00990099"),
        ({"start": 5.0}, "shares 5.0 s of the 10.0 s"),
        ({"count": 300}, "shares 3.0 s of the 10.0 s"),
        ({"start": 50.0}, "shares 0.0 s"),
    ],
)
def test_a_horizontal_that_does_not_fit_is_a_reason(second, reason):
    options = {"sensor_azimuth": 0.0} | second
    stream = Stream([trace("HNE", 1001, sensor_azimuth=90.0), trace("HNN", **options)])
    accepted, rejected = paired(map(orient, stream), OVERLAP)
    assert [component.stats.channel for component in accepted] == ["HNE"]
    assert any(reason in text for text in rejected[0].reasons)


def test_sensors_at_odd_angles_pair():
    stream = Stream([trace("HN1", sensor_azimuth=207.0), trace("HN2", sensor_azimuth=297.0)])
    accepted, rejected = paired(map(orient, stream), OVERLAP)
    assert (len(accepted), rejected) == (2, ())


def test_extra_components_are_reasons():
    # one component of each direction too many
    extra = [trace("HNE"), trace("HNN"), trace("HN3"), trace("HNZ"), trace("HNV", sensor_dip=-90.0)]
    accepted, rejected = paired(map(orient, Stream(extra)), OVERLAP)
    assert len(accepted) == 3
    reasons = " ".join(row.reasons[0] for row in rejected)
    assert reasons.count("a third horizontal") == reasons.count("a second vertical") == 1


@pytest.mark.parametrize(
    ("codes", "refused"),
    [
        (("HNE", "HNN", "HNZ"), ()),
        (("HN1", "HN2", "HNZ"), ()),
        (("HN1", "HN2"), ()),
        (("L", "T", "UP"), ()),
        (("HN",), ()),
        (("A", "B", "UP"), ()),
        # any of them may be the vertical
        (("HN1", "HN2", "HN3"), ("HN1", "HN2", "HN3")),
        (("0", "1", "2"), ("0", "1", "2")),
        (("CH1", "CH2", "CH3"), ("CH1", "CH2", "CH3")),
        (("HHU", "HHV", "HHW"), ("HHU", "HHV", "HHW")),
        (("A", "B", "C"), ("A", "B", "C")),
        (("N", "A"), ("A",)),
    ],
)
def test_what_may_be_the_vertical_is_refused_by_its_name(codes, refused):
    # mutation: the first two codes by name are the horizontals
    stream = Stream([trace(code) for code in codes])
    [instrument] = instruments(stream)
    apart, rejected = tell_apart(instrument)
    assert {part.stats.channel for part in apart} == set(codes) - set(refused)
    assert {row.name.rsplit(".", 1)[1] for row in rejected} == set(refused)
    assert all("it may be that" in row.reasons[0] for row in rejected)


def test_metadata_tell_numbers_apart():
    dips = {"HN1": 0.0, "HN2": 0.0, "HN3": -90.0}
    stream = Stream([trace(code, sensor_dip=dip) for code, dip in dips.items()])
    assert tell_apart(stream)[1] == ()


def test_two_directions_of_one_identity_are_refused_by_both_names():
    stream = Stream([trace("HN", direction=word) for word in ("FOO", "BAR")] + [trace("HNZ")])
    apart, rejected = tell_apart(stream)
    assert [part.stats.channel for part in apart] == ["HNZ"]
    assert all("'BAR', 'FOO' cannot be told apart" in row.reasons[0] for row in rejected)


@pytest.mark.parametrize("codes", [("H1", "H2", "UP"), ("1", "2", "V"), ("090", "360", "UP")])
def test_numbers_of_components_are_no_instruments(codes):
    # mutation: the number at the end makes H1 and H2 two instruments, of which one is lost
    assert len(instruments(Stream([trace(code) for code in codes]))) == 1


@pytest.mark.parametrize(
    ("rates", "kept"),
    [
        ({"HNE": 100, "HNN": 50, "HNZ": 100}, ["HNE", "HNZ"]),
        ({"HNE": 50, "HNN": 100, "HNZ": 100}, ["HNN", "HNZ"]),
        ({"HNE": 100, "HNN": 100, "HNZ": 50}, ["HNE", "HNN"]),
        ({"HNE": 100, "HNN": 200, "HNZ": 100}, ["HNE", "HNZ"]),
        ({"HNE": 99.9999, "HNN": 50, "HNZ": 100}, ["HNE", "HNZ"]),
        ({"HNE": 99.9999, "HNN": 100, "HNZ": 100}, ["HNE", "HNN", "HNZ"]),
        # none can say which one is right
        ({"HNE": 100, "HNN": 50}, []),
        ({"HNE": 100, "HNN": 50, "HNZ": 200}, []),
    ],
)
def test_a_rate_that_the_other_components_do_not_share_is_wrong(rates, kept):
    # mutation: half the rate makes the record the longest one, which goes first
    stream = Stream([trace(code, sampling_rate=float(rate)) for code, rate in rates.items()])
    accepted, rejected = paired(map(orient, stream), OVERLAP)
    assert [part.stats.channel for part in accepted] == kept
    assert len(rejected) == len(rates) - len(kept)
    assert all("rate is wrong" in row.reasons[0] for row in rejected)


def test_components_of_another_rate_over_the_same_time_are_not_wrong():
    stream = Stream([trace("HNE"), trace("HNZ"), trace("HNN", 500, sampling_rate=50.0)])
    accepted, rejected = paired(map(orient, stream), OVERLAP)
    assert [part.stats.channel for part in accepted] == ["HNE", "HNZ"]
    assert "sampled every 0.02 s, its partner" in rejected[0].reasons[0]


def film(channel, dt, seconds=20.0, digitised=True):
    times = dt * np.arange(round(seconds / dt))
    header = {"channel": channel, "delta": dt, "units": "m/s2"}
    return Trace(np.sin(times), header | ({"digitised": True} if digitised else {}))


def test_horizontals_of_film_whose_intervals_differ_by_parts_in_100_000_are_a_pair():
    stream = map(orient, Stream([film("HNN", 0.01), film("HNE", 0.01 * (1 + 4e-5))]))
    kept, rejected = paired(stream, 0.8)
    assert rejected == ()
    assert [trace.stats.delta for trace in kept] == [0.01, 0.01]
    assert len({trace.stats.npts for trace in kept}) == 1
    # Linear interpolation of sin(t) is at most dt^2 / 8 = 1.25e-5 off
    for trace in kept:
        assert_allclose(trace.data, np.sin(trace.times()), rtol=0, atol=1.3e-5)
    notes = [line for trace in kept for line in trace.stats.get("processing", [])]
    assert len(notes) == 1
    assert "film interpolated from 0.0100004 s to 0.01 s" in notes[0]


def test_other_records_whose_intervals_differ_are_no_pair():
    stream = [film("HNN", 0.01, digitised=False), film("HNE", 0.0100004, digitised=False)]
    _, rejected = paired(map(orient, Stream(stream)), 0.8)
    assert len(rejected) == 1
    assert "sampled every" in rejected[0].reasons[0]


def test_film_that_is_interpolated_stays_unchanged():
    stream = Stream([film("HNN", 0.01), film("HNE", 0.02), film("HNZ", 0.03, digitised=False)])
    before = [trace.copy() for trace in stream]
    result = at_one_interval(stream)
    assert [trace.stats.delta for trace in result] == [0.01, 0.01, 0.03]
    for trace, old in zip(stream, before, strict=True):
        assert_array_equal(trace.data, old.data)
        assert trace.stats == old.stats


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
