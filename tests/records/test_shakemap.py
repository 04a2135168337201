"""ShakeMap grids that the test writes: values by hand, and every way a file can be wrong."""

import gzip

import numpy as np
import pytest
from numpy.testing import assert_allclose

from per_obspy.errors import CatalogError
from per_obspy.records.shakemap import map_event, read_shakemap

UNITS = {"LON": "dd", "LAT": "dd", "MMI": "intensity", "PGV": "cms", "SVEL": "ms"}


def grid_xml(fields, rows, shape, head=""):
    """Return a grid as the USGS writes it, from the names of its fields and its rows."""
    lines = [f'<?xml version="1.0" encoding="US-ASCII" standalone="yes"?>{head}']
    # Root element, size and fields, then one row per node
    lines += ['<shakemap_grid xmlns="http://earthquake.usgs.gov/eqcenter/shakemap"']
    lines += ['event_id="xx1" shakemap_event_type="ACTUAL">']
    lines += ['<event event_id="xx1" magnitude="6.1" lat="1" lon="2" />']
    size = f'nlon="{shape[1]}" nlat="{shape[0]}"'
    lines += [f'<grid_specification {size} nominal_lon_spacing="0.5" />']
    for index, name in enumerate(fields, start=1):
        unit = UNITS.get(name, "ln(pctg)" if name.startswith("STD") else "pctg")
        lines += [f'<grid_field index="{index}" name="{name}" units="{unit}" />']
    lines += ["<grid_data>", *table_lines(rows), "</grid_data>", "</shakemap_grid>", ""]
    return "\n".join(lines)


def table_lines(rows):
    """Return one line per row."""
    return [" ".join(map("{:g}".format, row)) for row in rows]


FIELDS = ("LON", "LAT", "PGA", "PGV", "MMI", "PSA03", "PSA10", "PSA30", "SVEL")


def make_rows(longitudes=(10.0, 10.5, 11.0), latitudes=(46.0, 45.5)):
    """Return rows from north to south and west to east; PSA at 0.3 s is 10, 20, 30, ... % g."""
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


DEVIATIONS = ("STDPSA03", "STDPSA10", "STDPSA30")


def make_deviations(shift=0.0):
    """Return rows of place and deviations at the nodes of ``make_rows``, moved to the east."""
    rows = enumerate(make_rows(), start=70)
    return [(east + shift, north, 0.5, 0.6, 0.01 * i) for i, (east, north, *_) in rows]


@pytest.fixture
def grid(tmp_path):
    return write(tmp_path / "grid.xml", grid_xml(FIELDS, make_rows(), (2, 3)))


def write_uncertainty(folder, rows):
    return write(folder / "uncertainty.xml", grid_xml(("LON", "LAT", *DEVIATIONS), rows, (2, 3)))


def test_uncertainty_has_a_file_of_its_own(tmp_path, grid):
    both = read_shakemap(grid, write_uncertainty(tmp_path, make_deviations()))
    southwest = both["psa_log_std"].sel(latitude=45.5, longitude=10.0)
    assert_allclose(southwest, [0.5, 0.6, 0.73], rtol=1e-12)


def test_uncertainty_may_be_in_the_grid(tmp_path, grid):
    both = read_shakemap(grid, write_uncertainty(tmp_path, make_deviations()))
    pairs = zip(make_rows(), make_deviations(), strict=True)
    rows = [(*row, *deviations[2:]) for row, deviations in pairs]
    joined = write(tmp_path / "one.xml", grid_xml((*FIELDS, *DEVIATIONS), rows, (2, 3)))
    # Paths differ: attributes are not compared
    assert read_shakemap(joined).equals(both)


def test_uncertainty_of_another_grid_is_refused(tmp_path, grid):
    elsewhere = write_uncertainty(tmp_path, make_deviations(shift=1.0))
    with pytest.raises(CatalogError, match="its longitudes are not those of"):
        read_shakemap(grid, elsewhere)
    with pytest.raises(CatalogError, match="has no field STDPSA03"):
        read_shakemap(grid, grid)


def test_more_periods(tmp_path):
    rows = [(*row, 7 * i) for i, row in enumerate(make_rows(), start=1)]
    grid = read_shakemap(write(tmp_path / "grid.xml", grid_xml((*FIELDS, "PSA06"), rows, (2, 3))))
    assert grid["period"].values.tolist() == [0.3, 0.6, 1.0, 3.0]


def test_the_date_line(tmp_path):
    rows = make_rows((179.5, 180.0, 180.5))
    grid = read_shakemap(write(tmp_path / "grid.xml", grid_xml(FIELDS, rows, (2, 3))))
    assert grid["longitude"].values.tolist() == [179.5, 180.0, 180.5]


@pytest.mark.parametrize(
    ("longitudes", "axis"),
    [
        ((179.5, 180.0, -179.5), [179.5, 180.0, 180.5]),
        ((179.0, -179.0, -178.5), [179.0, 181.0, 181.5]),
        ((179.5, -180.0, -179.5), [179.5, 180.0, 180.5]),
        ((359.5, 0.0, 0.5), [359.5, 360.0, 360.5]),
        ((-120.0, -119.5, -119.0), [-120.0, -119.5, -119.0]),
    ],
)
def test_a_map_across_the_date_line_is_one_piece(tmp_path, longitudes, axis):
    grid = read_shakemap(
        write(tmp_path / "grid.xml", grid_xml(FIELDS, make_rows(longitudes), (2, 3)))
    )
    assert grid["longitude"].values.tolist() == axis
    # the values stay with their nodes: 10, 20, 30 % g from west to east in the northern row
    assert_allclose(grid["psa"].sel(period=0.3, latitude=46.0) / 0.0980665, [10, 20, 30])


def _changed(**changes):
    """Return rows with one value of the second row changed."""
    rows = [list(row) for row in make_rows()]
    for name, value in changes.items():
        rows[1][FIELDS.index(name)] = value
    return rows


BOMB = '<!DOCTYPE bomb [<!ENTITY a "aaaa"><!ENTITY b "&a;&a;">]>'

#: fault -> text of the file, message of the error
WRONG = {
    "no XML": ("lon lat 1 2", "cannot be read as XML"),
    "cut": (grid_xml(FIELDS, make_rows(), (2, 3))[:-60], "cannot be read as XML"),
    "another document": ("<quakeml></quakeml>", "its root is quakeml, not shakemap_grid"),
    "a bomb": (grid_xml(FIELDS, make_rows(), (2, 3), BOMB), "DOCTYPE"),
    "fewer rows": (
        grid_xml(FIELDS, make_rows()[:-1], (2, 3)),
        "grid_data has 5 rows of 9, its head has 2 x 3 nodes",
    ),
    "another shape": (grid_xml(FIELDS, make_rows(), (3, 2)), "do not form a grid"),
    "a shorter row": (
        grid_xml(FIELDS, [*make_rows()[:-1], (1, 2)], (2, 3)),
        "grid_data: .*columns changed",
    ),
    "no rows": (grid_xml(FIELDS, [], (2, 3)), "has no grid_data"),
    "no size": (grid_xml(FIELDS, make_rows(), ("two", 3)), "has no nlat and nlon"),
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
        grid_xml(FIELDS, _changed(LON=541), (2, 3)),
        "LON = 541 is not between -540 and 540",
    ),
    "a node twice": (grid_xml(FIELDS, _changed(LON=10.0), (2, 3)), "do not form a grid"),
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


@pytest.mark.parametrize("fault", WRONG)
def test_a_wrong_file_is_named_with_its_fault(tmp_path, fault):
    text, message = WRONG[fault]
    with pytest.raises(CatalogError, match=rf"grid.xml: (?s:.)*{message}"):
        read_shakemap(write(tmp_path / "grid.xml", text))


@pytest.mark.parametrize(
    "content",
    [gzip.compress(b"<shakemap_grid/>", mtime=0)[:-9], "<shakemap_grid/>".encode("utf-16")],
)
def test_files_that_cannot_be_read(tmp_path, content):
    (tmp_path / "grid.xml").write_bytes(content)
    with pytest.raises(CatalogError, match=r"grid\.xml: cannot be read"):
        read_shakemap(tmp_path / "grid.xml")


def test_a_missing_file_cannot_be_read(tmp_path):
    with pytest.raises(CatalogError, match=r"none\.xml: cannot be read"):
        read_shakemap(tmp_path / "none.xml")


def test_a_bomb_of_zeros_is_not_unpacked(tmp_path, monkeypatch):
    monkeypatch.setattr("per_obspy.records.shakemap.LARGEST_FILE", 10_000)
    (tmp_path / "zeros.xml.gz").write_bytes(gzip.compress(b" " * 20_000))
    with pytest.raises(CatalogError, match="has more than 10000 bytes"):
        read_shakemap(tmp_path / "zeros.xml.gz")


#: Head of a grid as the USGS writes it (ShakeMap 4 manual, "grid.xml").
USGS_HEAD = """\
<?xml version="1.0" encoding="US-ASCII" standalone="yes"?>
<shakemap_grid xmlns="http://earthquake.usgs.gov/eqcenter/shakemap" event_id="us7000test"
 shakemap_version="3" shakemap_event_type="ACTUAL">
<event event_id="us7000test" {facts} event_network="us" event_description="near a town"/>
<grid_data>
"""


def test_the_head_of_a_map_names_its_earthquake(tmp_path):
    facts = 'magnitude="6.7" depth="11.2" lat="0.01" lon="-0.02"'
    facts += ' event_timestamp="2026-11-01T11:58:02UTC"'
    # the grid goes on for megabytes, of which only the head is parsed
    text = USGS_HEAD.format(facts=facts) + 5000 * "0.1 0.2 0.3\n"
    (tmp_path / "grid.xml").write_text(text)
    found = map_event(tmp_path / "grid.xml")
    assert found.pop("depth") == pytest.approx(11_200.0)
    assert found == {
        "time": "2026-11-01T11:58:02",
        "magnitude": 6.7,
        "longitude": -0.02,
        "latitude": 0.01,
        "map": "us7000test",
        "version": "3",
    }


@pytest.mark.parametrize(
    "facts",
    [
        "",
        'magnitude="nan" depth="1e9" lat="91" lon="inf" event_timestamp="yesterday"',
        'magnitude="" depth="x" lat="-" lon="1,5" event_timestamp=""',
        'magnitude="6.7" magnitude="7"',
    ],
)
def test_facts_of_a_map_that_are_wrong_are_left_out(tmp_path, facts):
    (tmp_path / "grid.xml").write_text(USGS_HEAD.format(facts=facts))
    # they decide no number: a map without them serves as well
    assert set(map_event(tmp_path / "grid.xml")) <= {"map", "version"}
