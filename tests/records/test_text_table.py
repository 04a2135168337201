"""Plain tables of samples."""

from pathlib import Path

import numpy as np
import pytest
from numpy.testing import assert_allclose, assert_array_equal

from per_obspy.errors import CatalogError, RecordRejected
from per_obspy.records.text_table import read_columns

TABLE = """time NS EW V
0.02 0.1 -0.2 0.3
0.04 0.4 0.5 -0.6
0.06 0.7 0.8 0.9

"""
LAYOUT = {
    "station": "SCT",
    "latitude": 19.39,
    "longitude": -99.15,
    "units": "g",
    "channels": {"HNN": 1, "HNE": 2, "HNZ": 3},
    "skip": 1,
    "time_column": 0,
}


@pytest.fixture
def table(tmp_path: Path) -> Path:
    path = tmp_path / "table.txt"
    path.write_text(TABLE)
    return path


def test_columns_become_channels_in_metres_per_second_squared(table: Path):
    stream = read_columns(table, **LAYOUT)
    assert [trace.id for trace in stream] == [".SCT..HNN", ".SCT..HNE", ".SCT..HNZ"]
    # one g is 9.80665 m/s2 by definition
    assert_allclose(stream[1].data, 9.80665 * np.array([-0.2, 0.5, 0.8]), rtol=1e-15)
    assert stream[0].stats.delta == 0.02
    assert stream[0].stats.coordinates == {"latitude": 19.39, "longitude": -99.15}
    assert [trace.stats.get("sensor_azimuth") for trace in stream] == [0, 90, None]
    assert [trace.stats.sensor_dip for trace in stream] == [0, 0, -90]


def test_words_of_directions_are_no_letters(table: Path):
    # mutation: the last letter alone makes TRAN a north, DOWN a north, TRANSVERSE an east component
    words = {"TRAN": 1, "L": 2, "DOWN": 3}
    stream = read_columns(table, **LAYOUT | {"channels": words})
    assert not any("sensor_azimuth" in trace.stats for trace in stream)
    assert [trace.stats.sensor_dip for trace in stream] == [0, 0, 90]


@pytest.mark.parametrize("units", ["m/s2", "cm/s2", "gal", "g", "m/s^2", "cm/sec/sec", "Gal"])
def test_all_units_of_one_motion_agree(tmp_path: Path, units: str):
    in_unit = {"m": 9.80665, "c": 980.665, "gal": 980.665, "g": 1.0}[
        units.lower() if "/" not in units else units[0]
    ]
    (tmp_path / "one.csv").write_text(f"{in_unit}\n{-2 * in_unit}\n")
    layout = {
        "station": "A",
        "latitude": 1,
        "longitude": 1,
        "channels": {"HNN": 0},
        "separator": ",",
        "dt": 0.01,
    }
    # the largest product of two rounded factors
    assert_allclose(
        read_columns(tmp_path / "one.csv", units=units, **layout)[0].data,
        [9.80665, -19.6133],
        rtol=1e-15,
    )


def test_interval_azimuth_start_and_level_as_said(table: Path):
    layout = LAYOUT | {
        "time_column": None,
        "dt": 0.005,
        "channels": {"HN1": 1},
        "azimuths": {"HN1": 390},
    }
    stats = read_columns(table, **layout, start="1985-09-19T13:19:00", raw=True)[0].stats
    assert (stats.delta, stats.sensor_azimuth, stats.processing_level) == (0.005, 30, "raw")
    assert stats.starttime.isoformat() == "1985-09-19T13:19:00"


@pytest.mark.parametrize(
    ("old", "new", "message"),
    [
        ("0.5", "nan", "line 3, HNE: 'nan' is not a finite number"),
        ("0.5", "x", "line 3, HNE: 'x' is not a finite number"),
        ("0.5", "1" * 41, f"line 3, HNE: '{'1' * 40}' is not a finite number"),
        ("0.8 0.9", "0.8", "line 4: 3 values, expected 4 as on line 2"),
        ("0.8 0.9", "0.8 0.9 1", "line 4: 5 values, expected 4 as on line 2"),
        (" 0.3\n", "\n", "line 3: 4 values, expected 3 as on line 2"),
        (
            "0.06",
            "0.07",
            "line 3, time: 0.02 s is followed by 0.04 s, the mean interval is 0.025 s",
        ),
        (
            "0.06 0.7",
            "-0.06 0.7",
            "line 3, time: 0.02 s is followed by 0.04 s, the mean interval is -0.04 s",
        ),
        ("0.04 0.4 0.5 -0.6\n0.06 0.7 0.8 0.9\n", "", "1 rows of samples after 1 lines"),
    ],
)
def test_faults_of_the_file_name_line_and_channel(table: Path, old: str, new: str, message: str):
    table.write_text(TABLE.replace(old, new))
    with pytest.raises(RecordRejected, match=rf"table\.txt: {message}"):
        read_columns(table, **LAYOUT)


@pytest.mark.parametrize(
    ("change", "message"),
    [
        ({"units": "m"}, "'m' is no unit of acceleration"),
        ({"dt": 0.02}, "exactly one of time_column and dt"),
        ({"time_column": None}, "exactly one of time_column and dt"),
        ({"time_column": None, "dt": -1.0}, r"dt\n.*greater than 0 .*input_value=-1"),
        ({"latitude": 91}, r"latitude\n.*less than or equal to 90 .*input_value=91"),
        ({"channels": {}}, "channels must name at least one column"),
        ({"channels": {"HN3": 1}}, r"azimuths must contain the direction of \['HN3'\]"),
        ({"layout": "packed"}, r"layout\n.*'\^\(columns\|rows\)\$' .*'packed'"),
        ({"layout": "rows", "channels": {"HNN": 0}}, 'layout = "rows" has no time_column'),
        (
            {"layout": "rows", "time_column": None, "dt": 0.01},
            'layout = "rows" holds one channel',
        ),
        ({"azimuths": {"HNX": 1}}, r"azimuths must belong to channels, got \['HNX'\]"),
    ],
)
def test_faults_of_arguments_name_argument_and_value(
    table: Path, change: dict[str, object], message: str
):
    with pytest.raises(ValueError, match=message):
        read_columns(table, **LAYOUT | change)


PACKED = {
    "station": "A",
    "latitude": 1.0,
    "longitude": 1.0,
    "units": "m/s2",
    "channels": {"HNN": 0},
    "dt": 0.01,
}


def test_a_table_without_the_column_of_a_channel_names_it(table: Path):
    with pytest.raises(RecordRejected, match="line 2, HNZ: no column 9, there are 4"):
        read_columns(table, **LAYOUT | {"channels": {"HNZ": 9}})


def test_packed_samples_are_read_one_row_after_the_other(tmp_path: Path):
    motion = np.sin(np.arange(1.0, 19.0))
    path = tmp_path / "packed.txt"
    # Rows of eight, the last one shorter; repr writes every digit
    rows = [" ".join(map(repr, motion[first : first + 8].tolist())) for first in (0, 8, 16)]
    path.write_text("header\n" + "\n".join(rows))
    packed = read_columns(path, **PACKED, skip=1, layout="rows")
    assert_array_equal(packed[0].data, motion)
    assert packed[0].stats.delta == 0.01


@pytest.mark.parametrize("layout", [None, "columns"])
def test_packed_samples_are_not_read_as_one_sample_per_row(tmp_path: Path, layout: str | None):
    path = tmp_path / "packed.txt"
    path.write_text("1 2 3 4\n5 6 7 8\n9 10\n")
    message = 'line 3: 2 values, expected 4 as on line 1.*set layout = "rows"'
    with pytest.raises(RecordRejected, match=message):
        read_columns(path, **PACKED, layout=layout)


def test_rows_of_equal_length_need_a_layout_where_both_would_fit(tmp_path: Path):
    path = tmp_path / "packed.txt"
    path.write_text("1 2 3 4\n5 6 7 8\n")
    with pytest.raises(RecordRejected, match=r"line 1: 4 values per row for one channel.*layout"):
        read_columns(path, **PACKED)
    assert_array_equal(read_columns(path, **PACKED, layout="columns")[0].data, [1, 5])
    assert_array_equal(read_columns(path, **PACKED, layout="rows")[0].data, np.arange(1.0, 9.0))


@pytest.mark.parametrize(
    ("content", "message"),
    [
        ("1 2 3\n4 5\n6 7 8\n", "line 2: 2 values, expected 3 as on line 1$"),
        ("1 2 3\n4 5 6\n6 7 8 9\n", "line 3: 4 values, expected 3 as on line 1$"),
        ("1 2 3\n4 x 6\n", "line 2, HNN: 'x' is not a finite number"),
    ],
)
def test_faults_of_packed_samples_name_their_line(tmp_path: Path, content: str, message: str):
    (tmp_path / "packed.txt").write_text(content)
    with pytest.raises(RecordRejected, match=message):
        read_columns(tmp_path / "packed.txt", **PACKED, layout="rows")


def test_a_missing_table_is_named(tmp_path: Path):
    with pytest.raises(CatalogError, match=r"none\.txt: cannot be read: No such file"):
        read_columns(tmp_path / "none.txt", **LAYOUT)


@pytest.mark.real_data
def test_the_record_of_mexico_city_1985(real_data: Path):
    layout = LAYOUT | {"skip": 0}
    stream = read_columns(real_data / "records" / "mexico1985_sct" / "sct190985.txt", **layout)
    # published peaks: 167.9 (EW) and 97.6 cm/s2 (NS); the file has five decimals of g
    assert_allclose([np.abs(trace.data).max() for trace in stream[:2]], [0.976, 1.679], atol=5e-4)
    assert {trace.stats.delta for trace in stream} == {0.02}
    assert {trace.stats.npts for trace in stream} == {8171}
