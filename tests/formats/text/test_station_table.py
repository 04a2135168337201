"""Coordinates of stations from plain text."""

import pytest

from per_obspy.errors import RecordRejected
from per_obspy.formats.text.station_table import (
    StationRow,
    is_station_table,
    located_stations,
    read_station_table,
)

TABLE = "Network,Station,LATITUDE,Longitude,Elevation\nxx,Some Town,-33.5,-71.25,12\n"


def test_code_and_name_and_separators():
    table = b"\xef\xbb\xbfCode; Name; Lat; Lon\n\nab1; Vi\xc3\xb1a; 1; +2.5\n"
    assert is_station_table(table)
    assert read_station_table("t", table) == (
        StationRow("", ("AB1", "VI\xd1A"), 1.0, 2.5, None, source="t"),
    )


@pytest.mark.parametrize(
    ("row", "message"),
    [
        pytest.param(
            f"x,{'A' * 200_000},1,2,3", "line 2: field larger than field limit", id="long field"
        ),
        ("x,A,1", "line 2: 3 columns, no longitude"),
        ("x,,1,2,3", "line 2, station: empty"),
        ("x,A,nan,2,3", "line 2, latitude: 'nan' is not a number from -90 to 90"),
        ("x,A,1,181,3", "line 2, longitude: '181' is not a number from -180 to 180"),
        ("x,A,1,2,high", "line 2, elevation: 'high' is not a number"),
    ],
)
def test_faults_of_a_table_name_line_and_column(row: str, message: str):
    content = TABLE.split("\n")[0] + "\n" + row
    with pytest.raises(RecordRejected, match=f"t: {message}"):
        read_station_table("t", content.encode())


def test_a_table_serves_its_networks_only():
    rows = [StationRow("XX", ("A",), 1.0, 2.0, 3.0)]
    found = located_stations(rows, ["XX.A", ".A", "YY.A", "XX.B"])
    assert [network.code for network in found] == ["XX", ""]
