"""
Duties of every format plugin: right numbers, right words, and a clear refusal of damaged files.

Covers, on one made-up file of each format or more,

* ``per_obspy.formats.afad``, ``per_obspy.formats.bhrc``, ``per_obspy.formats.cosmos``,
  ``per_obspy.formats.csmip``, ``per_obspy.formats.cwb``, ``per_obspy.formats.dyna``,
  ``per_obspy.formats.geonet``, ``per_obspy.formats.itaca``, ``per_obspy.formats.nsmn``,
  ``per_obspy.formats.renadic``, ``per_obspy.formats.smc``, ``per_obspy.formats.unam`` and
  ``per_obspy.formats.usc``;
* the headers that several of them share: ``per_obspy.formats.csmip`` and
  ``per_obspy.formats.dyna``.
"""

import io
from importlib.metadata import EntryPoint, entry_points
from pathlib import Path

import numpy as np
import obspy
import pytest
from format_samples import SAMPLES, Sample
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st
from numpy.testing import assert_allclose, assert_array_equal
from obspy import Stream, UTCDateTime

from per_obspy.errors import RecordRejected

#: files of several channels, which a cut between whole channels leaves valid
SEVERAL_CHANNELS = {
    "csmip_v1",
    "geonet_v1a",
    "geonet_v2a",
    "bhrc",
    "cosmos_v0c",
    "cosmos_v2c",
}


def plugins() -> dict[str, dict[str, EntryPoint]]:
    """Return the formats of this package: name -> isFormat, readFormat."""
    formats = {}
    for point in entry_points(group="obspy.plugin.waveform"):
        if point.value.startswith("per_obspy."):
            parts = entry_points(group=f"obspy.plugin.waveform.{point.name}")
            formats[point.name] = {part.name: part.load() for part in parts}
    return formats


PLUGINS = plugins()
every_sample = pytest.mark.parametrize("sample", SAMPLES.values(), ids=SAMPLES)


def read(sample: Sample, text: str) -> Stream:
    return PLUGINS[sample.name]["readFormat"](io.BytesIO(text.encode("latin-1")))


@every_sample
def test_obspy_reads_path_and_open_file(sample: Sample, tmp_path: Path):
    path = tmp_path / "record"
    path.write_text(sample.text)
    for stream in (obspy.read(str(path)), obspy.read(io.BytesIO(sample.text.encode()))):
        assert {trace.stats._format for trace in stream} == {sample.name}
        assert tuple(trace.id for trace in stream) == sample.ids


@every_sample
def test_samples_interval_and_direction(sample: Sample):
    stream = read(sample, sample.text)
    assert [trace.id for trace in stream] == list(sample.ids)
    for trace, values, azimuth, dip in zip(
        stream, sample.values, sample.azimuths, sample.dips, strict=True
    ):
        # written exactly; a product of a few rounded factors
        assert_allclose(trace.data, values, rtol=1e-14)
        assert trace.data.dtype == np.float64
        assert trace.stats.delta == pytest.approx(sample.dt, rel=1e-12)
        assert trace.stats.get("sensor_azimuth") == azimuth
        assert trace.stats.get("sensor_dip") == dip


@every_sample
def test_words_of_the_vocabulary(sample: Sample):
    for trace in read(sample, sample.text):
        assert trace.stats.units == sample.units
        assert trace.stats.quantity == "acceleration"
        assert trace.stats.processing_level == sample.level
        assert trace.stats.starttime == UTCDateTime(sample.start or 0)
        if sample.coordinates is None:
            assert "coordinates" not in trace.stats
        else:
            place = (trace.stats.coordinates.latitude, trace.stats.coordinates.longitude)
            # degrees, minutes and seconds are added in floating point
            assert place == pytest.approx(sample.coordinates, abs=1e-9)


@every_sample
def test_predicates_claim_their_own_format_only(sample: Sample):
    start = sample.text.encode("latin-1")
    claims = [name for name, plugin in PLUGINS.items() if plugin["isFormat"](io.BytesIO(start))]
    assert claims == [sample.name]


@pytest.mark.parametrize("name", sorted(PLUGINS))
@pytest.mark.parametrize("file", ["no such file", "", ".", "\0", None, io.StringIO("PEER")])
def test_predicates_never_raise(name: str, file: object):
    assert PLUGINS[name]["isFormat"](file) is False


@every_sample
@pytest.mark.parametrize("ending", ["\r\n", "\r\r\n", "\r"])
def test_line_ends_and_padding_change_nothing(sample: Sample, ending: str):
    stream = read(sample, sample.text.replace("\n", ending) + ending + "\x1a")
    for trace, again in zip(read(sample, sample.text), stream, strict=True):
        assert_array_equal(trace.data, again.data)
        assert trace.stats == again.stats


@every_sample
def test_latin_1_text_is_no_obstacle(sample: Sample):
    changed = sample.text
    for name in ("Some", "SOME", "Town", "Aquila", "Willow", "free"):
        changed = changed.replace(name, "S\xe4\xf1o")
    assert len(read(sample, changed)) == len(sample.ids)


@every_sample
def test_every_cut_is_refused(sample: Sample, request: pytest.FixtureRequest):
    """A cut file is refused, unless it is cut between whole channels, which no header counts."""
    text = sample.text.rstrip()
    whole = [trace.data for trace in read(sample, text)]
    for stop in range(0, len(text) - 1, 7):
        try:
            stream = read(sample, text[:stop])
        except RecordRejected:
            continue
        for trace, values in zip(stream, whole, strict=False):
            assert_array_equal(trace.data, values)
        assert len(stream) == len(whole) or request.node.callspec.id in SEVERAL_CHANNELS


@every_sample
@pytest.mark.parametrize("ending", ["\n", "\r\n"])
def test_no_cut_inside_the_last_number_is_read(sample: Sample, ending: str):
    """A file cut by 1 to 15 bytes is refused, or holds its last number whole."""
    text = sample.text.rstrip().replace("\n", ending) + ending
    whole = read(sample, text)
    for cut in range(1, 16):
        # Some systems fill the lost end with zeros, others end the line
        for filling in ("", "\0" * cut, "\n", "\r\n"):
            try:
                stream = read(sample, text[:-cut] + filling)
            except RecordRejected:
                continue
            for trace, values in zip(stream, whole, strict=False):
                assert_array_equal(trace.data, values.data)


def test_a_line_that_is_lost_before_the_peak_is_missed():
    # older files of UNAM repeat their last line: the count of lines is right without one of them
    motion = SAMPLES["unam"]
    lines = motion.text.rstrip().split("\n")
    peak = int(np.argmax(np.abs(motion.values[0]))) + 1
    line = next(index for index, text in enumerate(lines) if text.startswith("ACEL. MAX."))
    name = "ACEL. MAX., C1-C6, EN LA MUESTRA"
    lines.insert(line, f"{name:39}:" + f"/{peak}" * len(motion.ids))
    filled = "\n".join([*lines, lines[-1], lines[-1]])
    for trace, values in zip(read(motion, filled), motion.values, strict=True):
        assert_allclose(trace.data, values, rtol=1e-14)
    # The first line of samples is lost
    first = len(lines) - len(motion.values[0])
    assert read(motion, "\n".join([*lines, lines[-1]]))[0].stats.npts == len(motion.values[0])
    shorter = "\n".join([*lines[:first], *lines[first + 1 :], lines[-1]])
    with pytest.raises(RecordRejected, match=r"EN LA MUESTRA: .*lines before are missing"):
        read(motion, shorter)


def lines_and_last_row(sample: Sample) -> tuple[list[str], int]:
    """Return the lines of a file and the index of the last one with samples."""
    lines = sample.text.rstrip().split("\n")
    has_end_mark = lines[-1].startswith(("/&", "End"))
    return lines, len(lines) - (2 if has_end_mark else 1)


@every_sample
def test_lines_that_are_left_out_or_doubled_are_refused(sample: Sample):
    lines, last = lines_and_last_row(sample)
    shorter = lines[:last] + lines[last + 1 :]
    longer = [*lines[:last], lines[last - 1], *lines[last:]]
    for changed in (shorter, longer):
        with pytest.raises(RecordRejected, match=r"line \d+"):
            read(sample, "\n".join(changed))


@every_sample
@pytest.mark.parametrize("garbage", ["*****", "  nan", "  inf", " 1_00", "1E999", "0x1F ", "x.yz1"])
def test_samples_that_are_no_numbers_are_refused(sample: Sample, garbage: str):
    lines, last = lines_and_last_row(sample)
    lines[last] = (lines[last][:-5] if len(lines[last]) > 9 else "") + garbage
    with pytest.raises(RecordRejected, match=rf"line {last + 1}, "):
        read(sample, "\n".join(lines))


@every_sample
def test_overlong_lines_are_refused(sample: Sample):
    lines, last = lines_and_last_row(sample)
    lines[last - 1] += " 1.000000 2.00000"
    with pytest.raises(RecordRejected, match=r"line \d+, "):
        read(sample, "\n".join(lines))


def refuses_or_reads(name: str, content: bytes) -> None:
    """Any bytes may be refused, but only as a RecordRejected; records read are finite."""
    assert PLUGINS[name]["isFormat"](io.BytesIO(content)) in (True, False)
    try:
        stream = PLUGINS[name]["readFormat"](io.BytesIO(content))
    except RecordRejected:
        return
    for trace in stream:
        assert np.isfinite(trace.data).all()
        assert np.isfinite(trace.stats.delta)
        assert trace.stats.delta > 0


@pytest.mark.parametrize("name", sorted(PLUGINS))
@given(content=st.binary(max_size=300))
@settings(max_examples=30, deadline=None)
def test_any_bytes(name: str, content: bytes):
    refuses_or_reads(name, content)


PIECES = st.one_of(
    st.binary(max_size=12),
    st.sampled_from([b"-999", b"9" * 12, b"0", b" ", b"\n", b"-", b"1E30"]),
)


@every_sample
@given(data=st.data())
@settings(max_examples=60, deadline=None, suppress_health_check=[HealthCheck.too_slow])
def test_damaged_files(sample: Sample, data: st.DataObject):
    """Overwrite, remove or repeat pieces anywhere: every reader survives."""
    content = bytearray(sample.text.encode("latin-1"))
    for _ in range(data.draw(st.integers(1, 4))):
        # Up to twelve bytes become any bytes, or words that headers use
        place = data.draw(st.integers(0, max(len(content) - 1, 0)))
        size = data.draw(st.integers(0, 12))
        content[place : place + size] = data.draw(PIECES)
    refuses_or_reads(sample.name, bytes(content))


def obspy_test_files() -> list[Path]:
    return sorted(
        path for path in Path(obspy.__file__).parent.glob("**/tests/data/**/*") if path.is_file()
    )


def test_no_test_file_of_obspy_is_claimed():
    files = obspy_test_files()
    if not files:
        pytest.skip("this ObsPy is installed without its test files")
    claimed = [
        (path.name, name)
        for path in files
        for name, plugin in PLUGINS.items()
        if plugin["isFormat"](str(path))
    ]
    assert claimed == []


@pytest.mark.parametrize(
    ("name", "old", "new", "message"),
    [
        (
            "cosmos_v2c",
            "with 13 text lines",
            "with 2 text lines",
            "line 1, text lines: 2, the format has 13",
        ),
        (
            "cosmos_v2c",
            "approx   0 secs",
            "approx  99 secs",
            "line 48, interval: 0.005 s in the header, but 23 samples",
        ),
        ("cosmos_v2c", "units=cm/sec2(04)", "units=furlong(99)", "line 48, units: "),
        (
            "cosmos_v0c",
            "       4.000000",
            "    -999.000000",
            "line 1, gain: unknown: 2.0 microvolts",
        ),
        (
            "csmip_v1",
            "No. of Points =  23",
            "No. of Points =  24",
            "line 28, number of points: 23, but 24 on line 11",
        ),
        ("csmip_v1", "sec and g ", "sec and furlong ", "line 12, unit: .* is neither g nor g/10"),
        ("csmip_v1", "/&", "??", "end of channel: expected '/&' after the samples"),
        ("csmip_v2", "in cm/sec2", "in furlongs", "line 46, unit: "),
        (
            "csmip_v2",
            "points of veloc",
            "points of other",
            "title of veloc: expected points at an interval",
        ),
        (
            "renadic",
            "23  Record",
            "0  Record",
            "line 11, number of points: must be a positive whole number",
        ),
        ("usc_v1", "UNITS ARE SEC AND G/10", "UNITS ARE FURLONGS    ", "line 12, unit: "),
        (
            "geonet_v1a",
            "      23       0       0      23",
            "      23       0       0      22",
            "number of points: 22, but 23 on line 10",
        ),
        ("geonet_v2a", "Component Up", "Component Up\nmore", r"line \d+, "),
        ("itaca", "in m/s/s", "in furlongs", "line 10, unit: "),
        ("dyna", "UNITS: cm/s^2", "UNITS: furlong", "line 21, UNITS: 'furlong' is none of"),
        (
            "dyna",
            "DATA_TYPE: ACCELERATION",
            "DATA_TYPE: SPECTRUM",
            "line 27, DATA_TYPE: 'SPECTRUM' is not a time series",
        ),
        (
            "afad",
            "SAMPLING_INTERVAL_S: 0.005000",
            "SAMPLING_INTERVAL_S:",
            "line 21, SAMPLING_INTERVAL_S: empty",
        ),
        (
            "nsmn",
            "NUMBER OF DATA ",
            "NUMBER OF DATE ",
            "line 1, NUMBER OF DATA: the header has no such field",
        ),
        ("unam", "Gal (cm/s/s)", "Furlongs", "UNIDADES DE LOS DATOS: 'Furlongs' is not gal"),
        ("unam", "/23/23/23", "/23/23/22", "NUM. TOTAL DE MUESTRAS: channels must share length"),
        ("unam", "/23/23/23", "/23/23", "2 values for 3 channels"),
        (
            "cwb",
            "\n    0.0300",
            "\n    0.0390",
            "line 24, time: 0.039 s breaks the spacing of 0.01 s",
        ),
        ("cwb", "gal. DCoffset", "furlong", "AmplitudeUnit: 'furlong.*is not gal"),
        (
            "smc",
            "  2.0000000E+02",
            "  0.0000000E+00",
            "line 18, sampling rate: must be positive and plausible",
        ),
        (
            "bhrc",
            ".200000E+03",
            ".100000E+03",
            "line 22, sampling rate: 100 Hz, but 23 samples last",
        ),
        ("bhrc", "SECONDS AND G/10", "FURLONGS", "line 12, unit: 'UNITS ARE FURLONGS' is not g/10"),
    ],
)
def test_a_header_that_contradicts_itself_is_refused(name: str, old: str, new: str, message: str):
    sample = SAMPLES[name]
    assert old in sample.text
    with pytest.raises(RecordRejected, match=message):
        read(sample, sample.text.replace(old, new, 1))


@pytest.mark.parametrize(
    ("name", "old", "new"),
    [
        ("usc_v1", "118 22 48W  ", "118 22 48N  "),
        ("usc_v1", "34 06 36N,", "34 06 36W,"),
        ("csmip_v1", "123.633W", "123.633N"),
        ("unam", "16.84851 LAT. N", "16.84851 LAT. O"),
        ("geonet_v1a", "172 49 48E", "172 49 48S"),
        ("bhrc", "38.474 N 47.059 E", "38.474 N 47.059 S"),
        ("nsmn", "37.87470N-27.59223E", "37.87470E-27.59223E"),
    ],
)
def test_a_wrong_letter_of_a_place_is_mended_by_the_epicentre_and_noted(
    name: str, old: str, new: str
):
    sample = SAMPLES[name]
    assert old in sample.text
    for trace in read(sample, sample.text.replace(old, new)):
        place = trace.stats.coordinates
        assert (place.latitude, place.longitude) == pytest.approx(sample.coordinates, abs=1e-9)
        assert trace.stats.processing[-1].endswith("taken, the epicentre's side")


def test_a_count_of_more_than_six_digits_is_not_rounded():
    sample = SAMPLES["smc"]
    changed = sample.text.replace(f"{len(sample.values[0]):10d}", f"{1_000_001:10d}", 1)
    assert changed != sample.text
    with pytest.raises(RecordRejected, match="the header promises 1000001 on 125001 lines"):
        read(sample, changed)


@pytest.mark.parametrize(
    ("name", "hypocentre", "magnitude"),
    [
        # 42 41 33 S, 173 01 19 E
        ("geonet_v1a", (-42.6925, 173.021944, 15_000.0), 7.82),
        ("geonet_v2a", (-42.6925, 173.021944, 15_000.0), 7.82),
        ("dyna", (38.1, 23.54, 9_000.0), 4.6),
        ("afad", (38.1, 23.54, 9_000.0), 4.6),
    ],
)
def test_headers_give_the_whole_hypocentre(name: str, hypocentre: tuple, magnitude: float):
    # would catch a depth behind words that a pattern skips
    for trace in read(SAMPLES[name], SAMPLES[name].text):
        event = trace.stats.event
        # degrees of the header to six decimals
        assert (event.latitude, event.longitude, event.depth) == pytest.approx(hypocentre, abs=1e-6)
        assert event.magnitude == magnitude


@pytest.mark.parametrize(
    ("lines", "ground"),
    [
        ("VS30_M/S: 387\nSITE_CLASSIFICATION_EC8: B*\n", {"vs30": 387.0, "site_class": "B*"}),
        ("VS30_M/S: None\nSITE_CLASSIFICATION_EC8: unknown\n", {}),
        ("VS30_M/S: \nSITE_CLASSIFICATION_EC8: \n", {}),
        ("VS30_M/S: 0\n", {}),
    ],
)
@pytest.mark.parametrize("name", ["dyna", "afad"])
def test_ground_in_the_header_is_read_and_unknown_words_are_none(name, lines, ground):
    sample = SAMPLES[name]
    (trace,) = read(sample, sample.text.replace("DATE_TIME_FIRST", f"{lines}DATE_TIME_FIRST", 1))
    found = {word: trace.stats[word] for word in ("vs30", "site_class") if word in trace.stats}
    assert found == ground


@pytest.mark.parametrize(
    ("name", "old", "new"),
    [
        ("usc_v1", "34 06 36N, 118 22 48W", "34 06 36N, 118 72 48W"),
        ("dyna", "STATION_LATITUDE_DEGREE: 37.6349", "STATION_LATITUDE_DEGREE: 376349"),
        ("smc", "3.7728000E+01", "3.7728000E+04"),
    ],
)
def test_a_place_out_of_range_is_unknown_and_noted(name: str, old: str, new: str):
    sample = SAMPLES[name]
    assert old in sample.text
    for trace in read(sample, sample.text.replace(old, new)):
        assert "coordinates" not in trace.stats
        assert trace.stats.processing[-1].endswith("out of range, so the place is unknown")
