"""Figures of spectra and of the state space: drawn values equal computed ones."""

from contextlib import nullcontext

import numpy as np
import pytest
from matplotlib.figure import Figure
from matplotlib.image import imread
from numpy.testing import assert_allclose, assert_array_equal
from screening_samples import make_station

from per_obspy.report.spectra import (
    add_circle,
    add_state_space,
    draw_spectra,
    draw_state_space,
    record_date,
)
from per_obspy.spectra.bilinear import bilinear_response


@pytest.fixture(scope="module")
def station():
    return make_station(longest=3.0)


@pytest.fixture
def panels(station, drawn):
    figures = drawn("spectra")
    draw_spectra(station, 0.06, "spectra.png")
    ((figure, _, simulated),) = figures
    assert not simulated
    assert figure.get_suptitle() == ("XX.ONE, date unknown\ndamping 5%, usable periods only")
    return figure.axes


def test_every_component_is_drawn_where_its_periods_are_usable(station, panels):
    # would catch another damping, and spectra beyond the record's own periods
    chosen, usable = station.sel(damping=0.05), station["usable"].to_numpy() == 1
    for index in range(2):
        per, sd = panels[0].lines[2 * index : 2 * index + 2]
        for line, name in ((per, "per"), (sd, "sd")):
            assert_allclose(line.get_ydata()[usable], chosen[name][index][usable])
            assert np.isnan(line.get_ydata()[~usable]).all()
    labels = [text.get_text() for text in panels[0].get_legend().get_texts()]
    assert labels == ["HNN PER", "HNN SD", "HNE PER", "HNE SD"]


def test_pseudo_velocity_and_ratio_follow_from_the_spectra(station, panels):
    chosen, usable = station.sel(damping=0.05), station["usable"].to_numpy() == 1
    period, sd = station["period"].to_numpy(), chosen["sd"][1].to_numpy()
    assert_allclose(panels[2].lines[1].get_ydata()[usable], (2 * np.pi / period * sd)[usable])
    ratio = panels[3].lines[1].get_ydata()[usable]
    assert_allclose(ratio, (chosen["per"][1] / chosen["sd"][1])[usable], rtol=1e-6)
    # the radius contains the displacement
    assert (ratio >= 1.0).all()


def test_accelerations_are_in_units_of_gravity(station, panels):
    # would catch m/s²: by definition 9.80665 m/s² are 1 g
    chosen, usable = station.sel(damping=0.05), station["usable"].to_numpy() == 1
    drawn_in_g = panels[1].lines[0].get_ydata()[usable]
    assert_allclose(drawn_in_g * 9.80665, chosen["sa"][0][usable], rtol=1e-6)


def test_axes_have_units_and_scales(panels):
    assert [axes.get_ylabel() for axes in panels] == [
        "radius, displacement (m)",
        "absolute acceleration SA (g)",
        "pseudo-velocity (m/s)",
        "PER / SD (1)",
    ]
    assert [axes.get_yscale() for axes in panels] == ["log", "log", "log", "linear"]
    assert {axes.get_xlabel() for axes in panels} == {"natural period (s)"}
    assert {axes.get_xscale() for axes in panels} == {"log"}


def test_a_title_has_the_day_of_the_record(station):
    dated = station.assign_attrs(time_coverage_start="1985-09-19T13:19:46.5Z")
    assert record_date(dated) == "1985-09-19 13:19 UTC"
    # a clock that was never set
    assert record_date(station) == "date unknown"


def test_simulated_motion_is_passed_on(station, drawn):
    figures = drawn("spectra")
    draw_spectra(station.assign_attrs(simulated="true"), 0.05, "spectra.png")
    assert figures[0][2]


def test_the_trace_stays_in_its_circle_and_touches_it(station, drawn):
    figures = drawn("spectra")
    draw_state_space(station, 0.5, 0.05, "state.png")
    # the stronger component
    motions = station["acceleration"].to_numpy()
    motion = max(motions, key=lambda samples: np.abs(samples).max())
    dt = float(station["sampling_interval"])
    (axes,) = figures[0][0].axes
    trace, circle = axes.lines
    # An elastic oscillator at the samples
    response = bilinear_response(motion, dt, 0.5, 0.05, np.inf, 0.0)
    assert_array_equal(trace.get_xdata(), response.displacement)
    assert_allclose(trace.get_ydata(), response.velocity / (4 * np.pi), rtol=1e-12)
    radius = np.hypot(*trace.get_xydata().T)
    assert_allclose(np.hypot(*circle.get_xydata().T), radius.max(), rtol=1e-12)
    name, oscillator = axes.get_title().splitlines()
    assert name.startswith("XX.ONE HN")
    assert name.endswith(", date unknown")
    assert oscillator == "T = 0.5 s, ξ = 0.05"
    assert circle.get_label() == f"PER = {radius.max():.3g} m"


def test_a_circle_closes_around_its_centre():
    axes = Figure().subplots()
    add_circle(axes, 2.0, "black", "circle", centre=3.0, style=":")
    # Every point at one distance, and no gap at the end
    x, y = axes.lines[0].get_xydata().T
    assert_allclose(np.hypot(x - 3.0, y), 2.0)
    assert_allclose([x[0], y[0]], [x[-1], y[-1]], atol=1e-12)
    assert axes.lines[0].get_linestyle() == ":"


@pytest.mark.parametrize("name", ["XX.ONE", "Ministry of the interior, basement of the tower " * 2])
@pytest.mark.parametrize("draw", [draw_spectra, draw_state_space])
def test_no_title_leaves_its_figure(station, tmp_path, monkeypatch, draw, name):
    figures = []
    monkeypatch.setattr(Figure, "savefig", lambda figure, *_, **__: figures.append(figure))
    monkeypatch.setattr("per_obspy.report.style.written_whole", nullcontext)
    named = station.assign_coords(station=name).assign_attrs(simulated="true")
    named.attrs["time_coverage_start"] = "1985-09-19T13:17:47"
    arguments = (0.05,) if draw is draw_spectra else (1.0, 0.05)
    draw(named, *arguments, tmp_path / "figure.png")
    (figure,) = figures
    figure.draw_without_rendering()
    texts = [*figure.texts, *(axes.title for axes in figure.axes)]
    for text in texts:
        box = text.get_window_extent()
        # one pixel: extents are rounded outwards
        assert -1.0 <= box.x0 <= box.x1 <= figure.bbox.width + 1.0, text
        assert -1.0 <= box.y0 <= box.y1 <= figure.bbox.height + 1.0, text
    title = " ".join(text.get_text() for text in texts)
    assert "1985-09-19 13:17 UTC" in title


def test_the_state_space_has_one_scale():
    axes = Figure().subplots()
    add_state_space(axes, np.array([0.0, 1.0]), np.array([2.0 * np.pi, 0.0]), 1.0)
    # velocity over frequency is 1 as well
    assert_allclose(axes.lines[0].get_xydata(), [[0.0, 1.0], [1.0, 0.0]])
    assert axes.get_aspect() == 1.0
    assert (axes.get_xlabel(), axes.get_ylabel()) == (
        "displacement (m)",
        "velocity / frequency (m)",
    )


def test_the_file_is_a_picture(station, tmp_path):
    draw_spectra(station, 0.05, tmp_path / "spectra.png")
    assert imread(tmp_path / "spectra.png").shape[1] > 1300
