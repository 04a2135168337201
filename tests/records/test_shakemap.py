"""ShakeMap grids that the test writes: values by hand, and every way a file can be wrong."""

import gzip

import numpy as np
import pytest
from numpy.testing import assert_allclose

from per_obspy.errors import CatalogError
from per_obspy.records.shakemap import read_shakemap

UNITS = {"LON": "dd", "LAT": "dd", "MMI": "intensity", "PGV": "cms", "SVEL": "ms"}


def grid_xml(fields, rows, shape, head=""):
    """Return a grid as the USGS writes it, from the names of its fields and its rows."""
    units = [UNITS.get(name, "ln(pctg)" if name.startswith("STD") else "pctg") for name in fields]
    named = "\n".join(
        f'<grid_field index="{i}" name="{name}" units="{unit}" />'
        for i, (name, unit) in enumerate(zip(fields, units, strict=True), start=1)
    )
    table = "\n".join(" ".join(f"{value:g}" for value in row) for row in rows)
    return f"""<?xml version="1.0" encoding="US-ASCII" standalone="yes"?>{head}
<shakemap_grid xmlns="http://earthquake.usgs.gov/eqcenter/shakemap" event_id="xx1" shakemap_event_type="ACTUAL">
<event event_id="xx1" magnitude="6.1" lat="1" lon="2" />
<grid_specification nlon="{shape[1]}" nlat="{shape[0]}" nominal_lon_spacing="0.5" />
{named}
<grid_data>
{table}
</grid_data>
</shakemap_grid>
"""


FIELDS = ("LON", "LAT", "PGA", "PGV", "MMI", "PSA03", "PSA10", "PSA30", "SVEL")


def make_rows(longitudes=(10.0, 10.5, 11.0), latitudes=(46.0, 45.5)):
    """Return rows from north to south and west to east: PSA = 10, 20, 30, ... per cent of gravity at 0.3 s."""
    nodes = [(east, north) for north in latitudes for east in longitudes]
    return [(*node, 5, 3, 6, 10 * i, 4 * i, i, 300 + i) for i, node in enumerate(nodes, start=1)]


def write(path, text):
    path.write_text(text, encoding="utf-8")
    return path


def test_values_by_hand(tmp_path):
    grid = read_shakemap(write(tmp_path / "grid.xml", grid_xml(FIELDS, make_rows(), (2, 3))))
    assert grid["latitude"].values.tolist() == [45.5, 46.0]
    assert grid["longitude"].values.tolist() == [10.0, 10.5, 11.0]
    assert grid["period"].values.tolist() == [0.3, 1.0, 3.0]
    # the first row of the file is the north-west corner; a per cent of gravity is 0.0980665 m/s2.
    # Would catch a map upside down or transposed
    northwest = grid.sel(latitude=46.0, longitude=10.0)
    assert_allclose(northwest["psa"], 0.0980665 * np.array([10.0, 4.0, 1.0]), rtol=1e-12)
    southeast = grid.sel(latitude=45.5, longitude=11.0)
    assert_allclose(southeast["psa"], 0.0980665 * np.array([60.0, 24.0, 6.0]), rtol=1e-12)
    assert_allclose([southeast["pga"], southeast["vs30"]], [5 * 0.0980665, 306.0], rtol=1e-12)
    assert "psa_log_std" not in grid
    assert grid.attrs["event_id"] == "xx1"
    assert grid.attrs["shakemap_event_type"] == "ACTUAL"


def test_packed_and_in_any_order_it_is_the_same(tmp_path):
    rows = make_rows()
    plain = read_shakemap(write(tmp_path / "grid.xml", grid_xml(FIELDS, rows, (2, 3))))
    (tmp_path / "grid.xml.gz").write_bytes(
        gzip.compress(grid_xml(FIELDS, rows[::-1], (2, 3)).encode())
    )
    packed = read_shakemap(tmp_path / "grid.xml.gz")
    assert packed.equals(plain)


def test_uncertainty_of_its_own_file_or_of_the_grid(tmp_path):
    names = tuple(f"STD{name}" for name in ("PSA03", "PSA10", "PSA30"))
    rows = make_rows()
    apart = [(*row[:2], 0.5, 0.6, 0.01 * i) for i, row in enumerate(rows, start=70)]
    grid = write(tmp_path / "grid.xml", grid_xml(FIELDS, rows, (2, 3)))
    uncertainty = write(
        tmp_path / "uncertainty.xml", grid_xml(("LON", "LAT", *names), apart, (2, 3))
    )
    both = read_shakemap(grid, uncertainty)
    assert_allclose(
        both["psa_log_std"].sel(latitude=45.5, longitude=10.0), [0.5, 0.6, 0.73], rtol=1e-12
    )
    joined = [(*row, *other[2:]) for row, other in zip(rows, apart, strict=True)]
    one = read_shakemap(write(tmp_path / "one.xml", grid_xml((*FIELDS, *names), joined, (2, 3))))
    assert one.equals(both)
    elsewhere = [(row[0] + 1, *row[1:]) for row in apart]
    write(uncertainty, grid_xml(("LON", "LAT", *names), elsewhere, (2, 3)))
    with pytest.raises(CatalogError, match="its longitudes are not those of"):
        read_shakemap(grid, uncertainty)
    with pytest.raises(CatalogError, match="has no field STDPSA03"):
        read_shakemap(grid, grid)


def test_more_periods_and_the_date_line(tmp_path):
    rows = [(*row, 7 * i) for i, row in enumerate(make_rows((179.5, 180.0, 180.5)), start=1)]
    grid = read_shakemap(write(tmp_path / "grid.xml", grid_xml((*FIELDS, "PSA06"), rows, (2, 3))))
    assert grid["period"].values.tolist() == [0.3, 0.6, 1.0, 3.0]
    assert grid["longitude"].values.tolist() == [179.5, 180.0, 180.5]


def _changed(**changes):
    """Return rows with one value of the second row changed."""
    rows = [list(row) for row in make_rows()]
    for name, value in changes.items():
        rows[1][FIELDS.index(name)] = value
    return rows


BOMB = '<!DOCTYPE bomb [<!ENTITY a "aaaa"><!ENTITY b "&a;&a;">]>'

#: what is wrong -> text of the file, what the error says
WRONG = {
    "no XML": ("lon lat 1 2", "cannot be read as XML"),
    "cut": (grid_xml(FIELDS, make_rows(), (2, 3))[:-60], "cannot be read as XML"),
    "another document": ("<quakeml></quakeml>", "its root is quakeml, not shakemap_grid"),
    "a bomb": (grid_xml(FIELDS, make_rows(), (2, 3), BOMB), "DOCTYPE"),
    "fewer rows": (
        grid_xml(FIELDS, make_rows()[:-1], (2, 3)),
        "grid_data has 5 rows of 9, the head tells 2 x 3 nodes",
    ),
    "another shape": (grid_xml(FIELDS, make_rows(), (3, 2)), "not those of a grid"),
    "a shorter row": (
        grid_xml(FIELDS, [*make_rows()[:-1], (1, 2)], (2, 3)),
        "grid_data: .*columns changed",
    ),
    "no rows": (grid_xml(FIELDS, [], (2, 3)), "has no grid_data"),
    "no size": (grid_xml(FIELDS, make_rows(), ("two", 3)), "tells no nlat and nlon"),
    "one latitude": (grid_xml(FIELDS, make_rows()[:3], (1, 3)), "needs two latitudes"),
    "no spectra": (
        grid_xml(FIELDS[:5], [row[:5] for row in make_rows()], (2, 3)),
        "has no field PSA03, PSA10, PSA30",
    ),
    "no place": (grid_xml(("X", *FIELDS[1:]), make_rows(), (2, 3)), "has no field LON"),
    "NaN": (
        grid_xml(FIELDS, _changed(PSA10=np.nan), (2, 3)),
        "PSA10 = nan pctg at longitude 10.5, latitude 46",
    ),
    "below zero": (
        grid_xml(FIELDS, _changed(PSA03=-1), (2, 3)),
        "PSA03 = -1 pctg at longitude 10.5",
    ),
    "cm/s2": (grid_xml(FIELDS, _changed(PSA03=9810), (2, 3)), "PSA03 = 9810 pctg"),
    "far north": (
        grid_xml(FIELDS, _changed(LAT=460), (2, 3)),
        "LAT = 460 is not between -90 and 90",
    ),
    "far east": (
        grid_xml(FIELDS, _changed(LON=361), (2, 3)),
        "LON = 361 is not between -360 and 360",
    ),
    "a node twice": (grid_xml(FIELDS, _changed(LON=10.0), (2, 3)), "not those of a grid"),
    "another unit": (
        grid_xml(FIELDS, make_rows(), (2, 3)).replace("pctg", "gal"),
        "PSA03 is in 'gal'",
    ),
    "not numbered": (
        grid_xml(FIELDS, make_rows(), (2, 3)).replace('index="3"', 'index="4"'),
        "not numbered",
    ),
    "no name": (
        grid_xml(FIELDS, make_rows(), (2, 3)).replace('name="PGV"', ""),
        "grid_field without index or name",
    ),
}


@pytest.mark.parametrize("what", WRONG)
def test_a_wrong_file_is_named_with_its_fault(tmp_path, what):
    text, said = WRONG[what]
    with pytest.raises(CatalogError, match=rf"grid.xml: (?s:.)*{said}"):
        read_shakemap(write(tmp_path / "grid.xml", text))


def test_files_that_cannot_be_read(tmp_path):
    with pytest.raises(CatalogError, match="cannot be read"):
        read_shakemap(tmp_path / "none.xml")
    (tmp_path / "cut.xml.gz").write_bytes(gzip.compress(b"<shakemap_grid/>")[:-9])
    with pytest.raises(CatalogError, match="cannot be read"):
        read_shakemap(tmp_path / "cut.xml.gz")
    (tmp_path / "utf16.xml").write_bytes("<shakemap_grid/>".encode("utf-16"))
    with pytest.raises(CatalogError, match="cannot be read"):
        read_shakemap(tmp_path / "utf16.xml")


def test_a_bomb_of_zeros_is_not_unpacked(tmp_path, monkeypatch):
    monkeypatch.setattr("per_obspy.records.shakemap.LARGEST_FILE", 10_000)
    (tmp_path / "zeros.xml.gz").write_bytes(gzip.compress(b" " * 20_000))
    with pytest.raises(CatalogError, match="has more than 10000 bytes"):
        read_shakemap(tmp_path / "zeros.xml.gz")
