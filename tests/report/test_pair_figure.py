"""Figure of a pair: the data that it shows and the labels that it carries."""

from contextlib import nullcontext
from itertools import pairwise

import numpy as np
import pandas as pd
import pytest
from matplotlib.figure import Figure
from matplotlib.image import imread
from numpy.testing import assert_allclose
from screening_samples import make_station

from per_obspy.report.pair_figure import (
    differing_pair,
    draw_pair_alone,
    draw_record_to_pair,
    motion_along,
)

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


@pytest.fixture(scope="module")
def station():
    return make_station()


def _panels(station, drawn, **changes):
    figures = drawn("pair_figure")
    draw_record_to_pair(station, pd.Series(PAIR | changes), "walk.png")
    ((figure, path, simulated),) = figures
    assert (path, simulated) == ("walk.png", False)
    left, right = figure.subfigs
    return [*left.axes, *right.axes]


def test_the_motion_is_that_along_the_azimuth_of_the_pair(station, drawn):
    motion, *_ = _panels(station, drawn)
    north, east = station["acceleration"].to_numpy()
    expected = north * np.sqrt(0.75) + east * 0.5
    assert_allclose(motion.lines[0].get_xdata(), station["time"])
    assert_allclose(motion.lines[0].get_ydata(), expected, rtol=1e-12, atol=1e-14)
    assert motion.get_xlabel() == "time (s)"
    assert motion.get_ylabel() == "ground acceleration (m/s²)"
    assert motion.get_title() == "1  record XX.ONE\ndate unknown, along 30°"
    # the burst of 40 s is silent at its ends, but 5 s of margin are shown
    start, end = motion.get_xlim()
    assert -5.0 < start < 10.0
    assert 30.0 < end < 45.0


def test_the_spectrum_is_the_stored_one_and_the_points_are_the_pairs(station, drawn):
    _, spectrum, *_ = _panels(station, drawn, damping_1=0.06)
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


def test_the_circles_are_the_radii_at_contact_height_at_both_gaps(station, drawn):
    # would catch a radius without its participation, and a centre on the wrong side
    *_, has, needs = _panels(station, drawn)
    for circles, gap in ((has, 5.0), (needs, 12.3)):
        outlines = [line for line in circles.lines if len(line.get_xdata()) > 2]
        for line, radius, centre in zip(outlines, (24.0, 9.0), (0.0, gap), strict=True):
            x, y = line.get_xydata().T
            assert_allclose(np.hypot(x - centre, y), radius, rtol=1e-12)
        assert circles.get_aspect() == 1.0
    assert has.get_title() == "at the gap there is: 5 cm"
    assert needs.get_title() == "at the gap needed: 12.3 cm"
    assert needs.get_xlabel() == "displacement at contact height (cm)"


def test_a_pair_of_unknown_gap_has_one_picture_of_circles(station, drawn):
    *_, has, needs = _panels(station, drawn, gap=np.nan)
    assert not has.axison
    assert needs.get_title() == "at the gap needed: 12.3 cm"


def test_a_pair_without_a_record_is_drawn_by_its_displacements(drawn):
    figures = drawn("pair_figure")
    pair = {name: value for name, value in PAIR.items() if not name.startswith("per_")}
    draw_pair_alone(pd.Series(pair | {"sd_1": 0.15, "sd_2": 0.1}), True, "alone.png")
    ((figure, _, simulated),) = figures
    assert simulated
    x, _ = figure.subfigs[0].axes[0].lines[0].get_xydata().T
    # 1.2 times 15 cm
    assert x.max() == pytest.approx(18.0)


def test_one_horizontal_has_its_own_motion_and_spectrum(drawn):
    station = make_station(channels=("HNN",))
    motion, spectrum, *_ = _panels(station, drawn, azimuth_used=np.nan)
    # along its sensor, whose azimuth may be unknown
    assert_allclose(motion.lines[0].get_ydata(), station["acceleration"][0])
    assert motion.get_title() == "1  record XX.ONE\ndate unknown"
    assert spectrum.get_legend().get_texts()[0].get_text() == "PER"
    assert_allclose(spectrum.lines[0].get_ydata(), station["per"][0].sel(damping=0.05))


def test_azimuths_are_counted_from_north_to_east(station):
    north, east = station["acceleration"].to_numpy()
    assert_allclose(motion_along(station, 0.0), north)
    assert_allclose(motion_along(station, 90.0), east, atol=1e-12)


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
    for figure in figures:
        figure.draw_without_rendering()
        titles = [axes.title for axes in figure.axes]
        titles += [text for part in figure.subfigs for text in part.texts]
        # one pixel: extents are rounded outwards
        for title in [*titles, *figure.texts]:
            box = title.get_window_extent()
            assert -1.0 <= box.x0 <= box.x1 <= figure.bbox.width + 1.0
            assert -1.0 <= box.y0 <= box.y1 <= figure.bbox.height + 1.0
    assert len(figures) == 1


def test_neighbouring_titles_do_not_overlap(station, drawn):
    panels = _panels(station, drawn, pair_id="W" * 300)
    boxes = [axes.title.get_window_extent() for axes in panels[:3]]
    assert all(left.x1 < right.x0 for left, right in pairwise(boxes))


def test_two_equal_circles_are_not_drawn_where_other_pairs_differ():
    """A pair of twins comes first in the ranking, and explains nothing."""
    alike = PAIR | {"station": "XX.ONE", "participation_2": 2.4}
    pairs = pd.DataFrame([alike | {"station": ""}, alike, PAIR | {"station": "XX.ONE"}])
    pairs["pair_id"] = ["map", "twins", "different"]
    assert differing_pair(pairs)["pair_id"] == "different"
    assert differing_pair(pairs.iloc[:2])["pair_id"] == "twins"
    assert differing_pair(pairs.iloc[:1]) is None
    assert differing_pair(pd.DataFrame()) is None
