"""Figures on axes: they show the numbers of their tables, and refuse what has none."""

import matplotlib

matplotlib.use("Agg")
import matplotlib.pyplot as plt
import numpy as np
import pandas as pd
import pytest
import xarray as xr
from numpy.testing import assert_allclose
from obspy import Trace

import per_obspy

PAIR = {"pair_id": "a$b_$", "gap": 0.05, "demand": 0.08, "flags": "touching simulated"}
PAIR |= {"per_1": 0.04, "per_2": 0.06, "participation_1": 1.5, "participation_2": 0.5}


@pytest.fixture
def axes():
    figure, axes = plt.subplots()
    yield axes
    plt.close(figure)


@pytest.fixture(scope="module")
def station():
    header = {"network": "XX", "station": "A", "channel": "HNE", "units": "m/s2", "delta": 0.005}
    return per_obspy.station_spectra(Trace(np.sin(np.arange(2000) / 20), header))


def test_every_figure_is_drawn_on_the_given_axes_and_returned(axes, station):
    table = pd.DataFrame({"longitude": [0.0], "latitude": [0.0], "risk_class": ["low"]})
    assert per_obspy.plot_risk(table, axes) is axes
    assert per_obspy.plot_pair(pd.Series(PAIR), axes) is axes
    assert per_obspy.plot_spectra(station, axes=axes) is axes


def test_spectra_are_those_of_the_dataset(axes, station):
    per_obspy.plot_spectra(station, 0.05, axes)
    radius, displacement = axes.get_lines()
    at = station.sel(damping=0.05).isel(component=0)
    usable = at["usable"].to_numpy() == 1
    assert usable.any()
    assert_allclose(radius.get_ydata()[usable], at["per"].to_numpy()[usable])
    assert_allclose(displacement.get_ydata()[usable], at["sd"].to_numpy()[usable])
    assert [line.get_label() for line in axes.get_lines()] == ["HNE PER", "HNE SD"]
    # what the filter took is no line
    assert np.isnan(radius.get_ydata()[~usable]).all()


def test_circles_have_the_radii_at_contact_height_and_the_gap_between_their_centres(axes):
    per_obspy.plot_pair(pd.Series(PAIR), axes)
    first, second = axes.patches
    assert_allclose([first.radius, second.radius], [0.06, 0.03])
    assert_allclose(second.center[0] - first.center[0], 0.05)
    assert "SIMULATED" in axes.get_title()
    # without a mathematical text of the name
    assert r"a\$b_\$" in axes.get_title()


def test_an_unknown_gap_is_drawn_at_the_gap_needed(axes):
    per_obspy.plot_pair(pd.Series(PAIR | {"gap": np.nan}), axes)
    assert_allclose(axes.patches[1].center[0], 0.08)
    assert "gap unknown" in axes.get_title()


def test_every_pair_is_on_the_map_and_the_worst_on_top(axes):
    classes = ["severe", "low", "low", "gap unknown", "of another configuration"]
    table = pd.DataFrame({"longitude": range(5), "latitude": range(5), "risk_class": classes})
    per_obspy.plot_risk(table, axes)
    assert sum(len(points.get_offsets()) for points in axes.collections) == 5
    texts = [text.get_text() for text in axes.get_legend().get_texts()]
    assert texts[:2] == ["severe: 1", "low: 2"]
    heights = [points.get_zorder() for points in axes.collections]
    assert heights == sorted(heights, reverse=True)


@pytest.mark.parametrize(
    ("name", "argument", "error", "expected"),
    [
        ("plot_spectra", "spectra.nc", TypeError, "must be a Dataset, got str"),
        ("plot_spectra", xr.Dataset(), ValueError, "variable per or per_rotd50"),
        ("plot_pair", PAIR, TypeError, "must be a row of a risk table, got dict"),
        ("plot_pair", pd.Series({"gap": 0.1}), ValueError, "must have demand"),
        ("plot_risk", [PAIR], TypeError, "must be a DataFrame, got list"),
        ("plot_risk", pd.DataFrame({"longitude": []}), ValueError, "latitude, risk_class"),
    ],
)
def test_wrong_arguments_are_named_and_leave_no_figure(name, argument, error, expected):
    before = plt.get_fignums()
    with pytest.raises(error, match=expected):
        getattr(per_obspy, name)(argument)
    assert plt.get_fignums() == before


def test_a_table_without_pairs_is_an_empty_map(axes):
    table = pd.DataFrame({"longitude": [], "latitude": [], "risk_class": []}, dtype=float)
    assert per_obspy.plot_risk(table, axes).get_title() == "0 pairs"
