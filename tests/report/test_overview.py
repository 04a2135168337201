"""Overview: pairs are seen at any scale, and neither legend nor title covers anything."""

from contextlib import nullcontext
from itertools import combinations

import numpy as np
import pandas as pd
import pytest
from matplotlib.colors import to_hex
from matplotlib.figure import Figure
from matplotlib.image import imread
from numpy.testing import assert_allclose

from per_obspy.report.overview import (
    SHOWN_PLACES,
    SMALLEST,
    Region,
    draw_map,
    draw_overview,
    frame_of,
    worst_places,
)
from per_obspy.report.style import SEVERITY_COLOURS

CLASSES = ("severe", "high", "moderate", "low")
TABLE = pd.DataFrame(
    {
        "pair_id": ["a", "b", "c", "d"],
        "risk_class": ["severe", "high", "low", "low"],
        "longitude": [20.0, 20.3, 20.1, 20.2],
        "latitude": [60.0, 60.0, 60.1, 59.9],
        "demand": [0.3, 0.2, 0.1, 0.0],
        "gap": [0.1, 0.25, 0.2, 0.4],
    }
)
STATIONS = pd.DataFrame({"longitude": [20.05], "latitude": [60.02]})
REGION = Region("old town", CLASSES, True, STATIONS, (20.15, 60.05))
ALONE = REGION._replace(stations=STATIONS[:0], epicentre=None)


def towns(count, pairs, apart):
    """Return towns of so many pairs within a kilometre, so many degrees apart."""
    number = np.arange(count * pairs)
    town, place = number % count, number // count
    return pd.DataFrame(
        {
            "pair_id": [f"P{i}" for i in number],
            "risk_class": np.array(CLASSES)[number % 4],
            "longitude": -100.0 + apart * town + 0.002 * (place % 5),
            "latitude": 19.0 + 0.002 * (place // 5),
            "demand": 0.1,
            "gap": 0.05,
        }
    )


@pytest.fixture
def overview(drawn):
    def overview(table, region=REGION):
        figures = drawn("overview")
        draw_overview(table, region, "overview.png")
        ((figure, _, simulated),) = figures
        assert simulated == region.simulated
        return figure

    return overview


def _points(axes):
    """Return the points of each colour."""
    found = {}
    for points in axes.collections:
        offsets = np.asarray(points.get_offsets()).tolist()
        for colour, place in zip(points.get_facecolor(), offsets, strict=False):
            found.setdefault(to_hex(colour).upper(), []).append(place)
    return found


def test_the_map_has_every_pair_and_station_at_its_place(overview):
    figure = overview(TABLE)
    chart = figure.axes[0]
    found = _points(chart)
    assert found[SEVERITY_COLOURS[0]] == [[20.0, 60.0]]
    assert found[SEVERITY_COLOURS[1]] == [[20.3, 60.0]]
    assert sorted(found[SEVERITY_COLOURS[-1]]) == [[20.1, 60.1], [20.2, 59.9]]
    # stations and epicentre are open, and drawn below the pairs
    pairs, stations, epicentre, *_ = chart.collections
    assert_allclose(stations.get_offsets(), [[20.05, 60.02]])
    assert_allclose(epicentre.get_offsets(), [[20.15, 60.05]])
    assert pairs.get_zorder() > stations.get_zorder()
    assert len(stations.get_facecolor()) == 0
    # a degree of longitude is half as long at 60 degrees north
    assert chart.get_aspect() == pytest.approx(2.0, rel=0.01)
    assert (chart.get_xlabel(), chart.get_ylabel()) == ("longitude (°E)", "latitude (°N)")
    labels = [text.get_text() for text in figure.legends[0].get_texts()]
    assert labels == ["severe: 1 pair", "high: 1 pair", "low: 2 pairs", "station", "epicentre"]


@pytest.mark.parametrize("east", [20.0, 20.15, 20.3])
def test_the_scale_bar_leaves_the_epicentre_free(east):
    """Of a map around the pairs, whose edge may be anywhere near the epicentre."""
    figure = Figure(figsize=(4.0, 4.0))
    chart = figure.add_axes((0.1, 0.1, 0.8, 0.8))
    epicentre = (east, 59.9 - 0.007)
    draw_map(chart, TABLE, REGION._replace(epicentre=epicentre), around_pairs=True)
    figure.draw_without_rendering()
    bar = next(line for line in chart.lines if line.get_linewidth() == 2.0)
    text = next(text for text in chart.texts if text.get_text().endswith(" km"))
    # The star has a radius of 6 points
    x, y = chart.transData.transform(epicentre)
    for part in (bar, text):
        box = part.get_window_extent()
        assert not (box.x0 - 8 < x < box.x1 + 8 and box.y0 - 8 < y < box.y1 + 8)


def test_gaps_are_drawn_over_demands_in_centimetres(overview):
    gaps = overview(TABLE).axes[1]
    assert _points(gaps)[SEVERITY_COLOURS[0]] == [[30.0, 10.0]]
    # equal values lie on a line that is straight as it is drawn: both axes have one scale
    equal = gaps.lines[0].get_xydata()
    assert equal[[0, -1]].tolist() == [[0.0, 0.0], [30.0, 30.0]]
    steps = np.diff(gaps.transData.transform([[x, x] for x in (0.0, 0.5, 3.0, 30.0)]), axis=0)
    assert_allclose(steps[:, 1] / steps[:, 0], steps[0, 1] / steps[0, 0])
    assert (gaps.get_xlabel(), gaps.get_ylabel()) == ("demand (cm)", "gap (cm)")
    # zero demands and gaps are inside, and so is the largest of both
    assert gaps.get_xlim()[0] < 0.0
    assert gaps.get_ylim()[0] < 0.0
    assert gaps.get_xlim()[1] >= 30.0
    assert gaps.get_ylim()[1] >= 40.0


def test_pairs_of_a_wide_region_are_seen_town_by_town(overview):
    # would catch: towns of a kilometre are dots on a map of 350 km
    table = towns(3, 40, 1.5)
    figure = overview(table, ALONE)
    whole, _, *own = figure.axes
    assert len(own) == 3
    for town, axes in enumerate(own):
        members = table[table["longitude"].round() == table["longitude"].iloc[town].round()]
        assert axes.get_title() == f"{'ABC'[town]}: 40 pairs, worst P{town}"
        places = sorted(map(tuple, np.asarray(axes.collections[0].get_offsets()).tolist()))
        assert places == sorted(zip(members["longitude"], members["latitude"], strict=True))
        # the pairs fill their map: more than a third of its height
        low, high = axes.get_ylim()
        assert np.ptp(members["latitude"]) > (high - low) / 3
    # and their places are marked on the map of the whole
    assert {"A", "B", "C"} <= {text.get_text() for text in whole.texts}


def test_one_town_needs_one_map_and_many_towns_have_the_worst(overview):
    assert len(overview(towns(1, 40, 1.0), ALONE).axes) == 2
    assert len(overview(towns(SHOWN_PLACES + 4, 8, 1.0), ALONE).axes) == 2 + SHOWN_PLACES


def test_places_are_those_of_the_worst_pairs_and_none_is_mild():
    # would catch: a map of a village of mild pairs beside a city of severe ones
    table = towns(4, 20, 1.0)
    town = np.arange(len(table)) % 4
    table["risk_class"] = np.array(["severe", "low", "high", "low"])[town]
    worst = table.sort_values("risk_class", key=lambda name: name.map(CLASSES.index), kind="stable")
    places = worst_places(worst.reset_index(drop=True), ALONE)
    found = [round(worst["longitude"].iloc[members[0]] + 100.0) for _, members in places]
    assert found == [0, 2]
    assert all(members.size == 20 for _, members in places)
    assert worst_places(table.assign(risk_class="low"), ALONE) == []


def test_a_place_that_is_unknown_ends_the_search():
    # would catch: an endless search for what is near an unknown place
    table = towns(3, 20, 1.5)
    table.loc[0, ["longitude", "latitude"]] = np.nan
    assert len(worst_places(table, ALONE)) <= SHOWN_PLACES


@pytest.mark.parametrize("places", [([10.0], [45.0]), ([10.0, 10.0], [45.0, 45.0])])
def test_a_map_of_one_place_is_a_street(places):
    assert frame_of(*places).padded(0.05).size == pytest.approx(SMALLEST)


def test_a_frame_knows_its_size():
    # a degree of latitude is 111.2 km, of longitude half as much at 60 degrees
    assert frame_of([0.0, 0.0], [59.5, 60.5]).size == pytest.approx(111_195.0)
    assert frame_of([0.0, 4.0], [60.0, 60.0]).size == pytest.approx(222_390.0)


def test_a_far_epicentre_hides_no_town(overview):
    # 350 km away: would catch towns that a grid over the whole map joins
    whole, _, *own = overview(towns(2, 40, 0.1), ALONE._replace(epicentre=(-103.0, 18.0))).axes
    assert [axes.get_title()[:1] for axes in own] == ["A", "B"]
    assert whole.get_xlim()[0] < -103.0


def test_pairs_on_both_sides_of_the_date_line_are_neighbours(overview):
    table = towns(1, 10, 1.0).assign(longitude=[179.99] * 5 + [-179.99] * 5)
    west, east = overview(table, ALONE).axes[0].get_xlim()
    # 2 km, not the whole Earth
    assert east - west < 0.2


def test_a_table_without_demands_has_the_map_alone(overview):
    assert len(overview(TABLE.drop(columns=["demand", "gap"])).axes) == 1


@pytest.mark.parametrize("gap", [0.0, np.nan])
def test_a_region_without_demand_or_gap_can_be_drawn(tmp_path, gap):
    # would catch a logarithmic axis of no extent
    draw_overview(TABLE.assign(demand=0.0, gap=gap), REGION, tmp_path / "overview.png")
    assert imread(tmp_path / "overview.png").shape[0] > 500


@pytest.mark.parametrize("table", [TABLE, towns(2, 10, 0.05)])
@pytest.mark.parametrize("name", ["W" * 300, "a $b_{c\n"])
def test_nothing_is_clipped_and_the_legend_covers_nothing(monkeypatch, tmp_path, table, name):
    figures = []
    monkeypatch.setattr(Figure, "savefig", lambda figure, *_, **__: figures.append(figure))
    monkeypatch.setattr("per_obspy.report.style.written_whole", nullcontext)
    hostile = table.assign(pair_id=name)
    draw_overview(hostile, REGION._replace(title=name), tmp_path / "overview.png")
    (figure,) = figures
    figure.draw_without_rendering()
    # one pixel: extents are rounded outwards
    for title in [*(axes.title for axes in figure.axes), *figure.texts]:
        box = title.get_window_extent()
        assert -1.0 <= box.x0 <= box.x1 <= figure.bbox.width + 1.0
        assert -1.0 <= box.y0 <= box.y1 <= figure.bbox.height + 1.0
    legend = figure.legends[0].get_window_extent()
    assert not any(axes.get_tightbbox().overlaps(legend) for axes in figure.axes)
    # labels of ticks stand apart
    for axis in (figure.axes[0].xaxis, figure.axes[0].yaxis):
        texts = [label for label in axis.get_ticklabels() if label.get_text()]
        boxes = [label.get_window_extent() for label in texts]
        assert not any(first.overlaps(second) for first, second in combinations(boxes, 2))


def test_a_far_epicentre_hides_no_single_town(overview):
    # would catch: all pairs are one mark, as the town alone would have no map of its own
    whole, _, own = overview(towns(1, 40, 0.1), ALONE._replace(epicentre=(-103.0, 18.0))).axes
    assert own.get_title().startswith("A: 40 pairs")
    assert [text.get_text() for text in whole.texts if text.get_text().isalpha()] == ["A"]
