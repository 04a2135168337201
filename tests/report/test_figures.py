"""Figures of a run: the data that they show and the labels that they carry."""

from contextlib import nullcontext
from itertools import pairwise

import numpy as np
import pandas as pd
import pytest
from matplotlib.colors import to_hex
from matplotlib.figure import Figure
from matplotlib.image import imread
from numpy.testing import assert_allclose
from per_obspy.report.figures import draw_overview, draw_record_to_pair, motion_along
from screening_samples import make_station

from per_obspy.report.style import STATE_COLOURS
from per_obspy.spectra.storage import region

PAIR = {
    "pair_id": "P7",
    "azimuth_used": 30.0,
    "damping_1": 0.05,
    "period_1": 1.0,
    "period_2": 0.6,
    "per_1": 0.2,
    "per_2": 0.1,
    "participation_1": 1.2,
    "participation_2": 0.9,
    "gap": 0.05,
    "demand": 0.123,
}
TABLE = pd.DataFrame(
    {
        "state": ["yes", "no", "no", "likely"],
        "longitude": [20.0, 20.1, 20.2, 20.3],
        "latitude": [60.0, 60.1, 59.9, 60.0],
        "demand": [0.3, 0.1, 0.0, 0.2],
        "gap": [0.1, 0.2, 0.4, 0.25],
    }
)


@pytest.fixture(scope="module")
def station():
    return make_station()


def _panels(station, drawn, **changes):
    figures = drawn("figures")
    draw_record_to_pair(station, pd.Series(PAIR | changes), "walk.png")
    ((figure, path, simulated),) = figures
    assert (path, simulated) == ("walk.png", False)
    return figure.axes


def test_the_motion_is_that_along_the_azimuth_of_the_pair(station, drawn):
    motion, *_ = _panels(station, drawn)
    north, east = station["acceleration"].to_numpy()
    expected = north * np.sqrt(0.75) + east * 0.5
    assert_allclose(motion.lines[0].get_xdata(), station["time"])
    assert_allclose(motion.lines[0].get_ydata(), expected, rtol=1e-12, atol=1e-14)
    assert motion.get_xlabel() == "time (s)"
    assert motion.get_ylabel() == "ground acceleration (m/s²)"
    assert motion.get_title() == "1  record XX.ONE, along 30°"
    # the burst of 40 s is silent at its ends, but 5 s of margin are shown
    start, end = motion.get_xlim()
    assert -5.0 < start < 10.0
    assert 30.0 < end < 45.0


def test_the_spectrum_is_the_stored_one_and_the_points_are_the_pairs(station, drawn):
    _, spectrum, _ = _panels(station, drawn, damping_1=0.06)
    # The nearest stored damping; only usable periods are drawn in full
    everywhere, usable, *points = spectrum.lines
    assert_allclose(everywhere.get_ydata(), station["per_rotd100"].sel(damping=0.05))
    assert usable.get_xdata().max() <= 9.0 < everywhere.get_xdata().max()
    assert [point.get_xydata().tolist() for point in points] == [[[1.0, 0.2]], [[0.6, 0.1]]]
    labels = [text.get_text() for text in spectrum.get_legend().get_texts()]
    assert labels == [
        "PER, largest over azimuth",
        "building 1: T = 1.00 s",
        "building 2: T = 0.60 s",
    ]
    assert (spectrum.get_xscale(), spectrum.get_yscale()) == ("log", "log")
    assert spectrum.get_xlabel() == "natural period (s)"
    assert spectrum.get_ylabel() == "pseudo energy radius (m)"


def test_the_circles_are_the_radii_at_contact_height_a_gap_from_each_other(station, drawn):
    # would catch a radius without its participation, and a centre on the wrong side
    *_, circles = _panels(station, drawn)
    first, second, *_ = circles.lines
    for line, radius, centre in ((first, 1.2 * 0.2, 0.0), (second, 0.9 * 0.1, 0.05)):
        x, y = line.get_xydata().T
        assert_allclose(np.hypot(x - centre, y), radius, rtol=1e-12)
    assert circles.get_title() == "3  pair P7\ngap 5 cm, needed 12 cm"
    assert circles.get_aspect() == 1.0
    assert circles.get_xlabel() == "displacement at contact height (m)"


def test_one_horizontal_has_its_own_motion_and_spectrum(drawn):
    station = make_station(channels=("HNN",))
    motion, spectrum, _ = _panels(station, drawn, azimuth_used=np.nan)
    # along its sensor, whose azimuth may be unknown
    assert_allclose(motion.lines[0].get_ydata(), station["acceleration"][0])
    assert motion.get_title() == "1  record XX.ONE"
    assert spectrum.get_legend().get_texts()[0].get_text() == "PER"
    assert_allclose(spectrum.lines[0].get_ydata(), station["per"][0].sel(damping=0.05))


def test_azimuths_are_counted_from_north_to_east(station):
    north, east = station["acceleration"].to_numpy()
    assert_allclose(motion_along(station, 0.0), north)
    assert_allclose(motion_along(station, 90.0), east, atol=1e-12)


@pytest.fixture
def overview(station, drawn):
    figures = drawn("figures")
    spectra = region([station]).assign_attrs(simulated="true")
    draw_overview(TABLE, spectra, "old town", "overview.png")
    ((figure, _, simulated),) = figures
    assert simulated
    assert figure.get_suptitle() == "old town"
    return figure.axes


def _points_of(axes, state):
    """Return the points in the colour of a state."""
    (found,) = [
        points.get_offsets()
        for points in axes.collections
        if to_hex(points.get_facecolor()[0]).upper() == STATE_COLOURS[state]
    ]
    return np.asarray(found).tolist()


def test_the_map_has_every_pair_and_station_at_its_place(overview):
    chart = overview[0]
    assert _points_of(chart, "yes") == [[20.0, 60.0]]
    assert _points_of(chart, "no") == [[20.1, 60.1], [20.2, 59.9]]
    assert _points_of(chart, "likely") == [[20.3, 60.0]]
    assert np.asarray(chart.collections[-1].get_offsets()).tolist() == [[20.0, 10.0]]
    # a degree of longitude is half as long at 60 degrees north
    assert chart.get_aspect() == pytest.approx(2.0)
    labels = [text.get_text() for text in chart.get_legend().get_texts()]
    assert labels == ["2 pairs: no", "1 pairs: likely", "1 pairs: yes", "stations"]
    assert (chart.get_xlabel(), chart.get_ylabel()) == ("longitude (°E)", "latitude (°N)")


def test_gaps_are_drawn_over_demands_in_centimetres(overview):
    gaps = overview[1]
    assert _points_of(gaps, "yes") == [[30.0, 10.0]]
    assert gaps.lines[0].get_xydata().tolist() == [[0.0, 0.0], [30.0, 30.0]]
    assert (gaps.get_xlabel(), gaps.get_ylabel()) == ("demand (cm)", "gap (cm)")
    # zero demands and gaps are inside, and so is the largest of both
    assert gaps.get_xlim()[0] < 0.0
    assert gaps.get_ylim()[0] < 0.0
    assert gaps.get_xlim()[1] >= 30.0
    assert gaps.get_ylim()[1] >= 40.0


def test_a_region_without_demand_can_be_drawn(station, tmp_path):
    # would catch a logarithmic axis of no extent
    still = TABLE.assign(demand=0.0, gap=0.0)
    draw_overview(still, region([station]), "still", tmp_path / "overview.png")
    assert imread(tmp_path / "overview.png").shape[0] > 500


def test_the_file_is_a_picture_of_some_content(station, tmp_path):
    draw_record_to_pair(station, pd.Series(PAIR), tmp_path / "walk.png")
    picture = imread(tmp_path / "walk.png")[..., :3]
    assert picture.shape[1] > 1500
    assert 0.01 < (picture.min(axis=2) < 0.9).mean() < 0.5  # ink on white paper


@pytest.mark.parametrize(
    "name",
    ["P7", "OSM-way-123456789/OSM-way-987654321-facing-street", "W" * 300, "a $b_{c", "x\ny"],
)
@pytest.mark.parametrize("simulated", ["true", "false"])
def test_no_title_is_clipped(station, tmp_path, monkeypatch, name, simulated):
    figures = []
    monkeypatch.setattr(Figure, "savefig", lambda figure, *_, **__: figures.append(figure))
    monkeypatch.setattr("per_obspy.report.style.written_whole", nullcontext)
    marked = station.assign_attrs(simulated=simulated)
    draw_record_to_pair(marked, pd.Series(PAIR | {"pair_id": name}), tmp_path / "walk.png")
    draw_overview(TABLE, region([marked]), name, tmp_path / "overview.png")
    for figure in figures:
        figure.draw_without_rendering()
        titles = [axes.title for axes in figure.axes]
        # one pixel: extents are rounded outwards
        for title in [*titles, *figure.texts]:
            box = title.get_window_extent()
            assert -1.0 <= box.x0 <= box.x1 <= figure.bbox.width + 1.0
            assert -1.0 <= box.y0 <= box.y1 <= figure.bbox.height + 1.0
    assert len(figures) == 2


def test_neighbouring_titles_do_not_overlap(station, drawn):
    panels = _panels(station, drawn, pair_id="W" * 300)
    boxes = [axes.title.get_window_extent() for axes in panels]
    assert all(left.x1 < right.x0 for left, right in pairwise(boxes))
