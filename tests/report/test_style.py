"""Figures are written as PNG, and simulated motion cannot pass for a record."""

import pytest
from matplotlib.figure import Figure
from matplotlib.image import imread

from per_obspy.errors import printable
from per_obspy.report.style import DOTS_PER_INCH, STATE_COLOURS, literal, save


def _figure():
    figure = Figure(figsize=(5.0, 4.0), layout="constrained")
    figure.subplots().plot([0.0, 1.0], [0.0, 2.0])
    return figure


@pytest.mark.parametrize("simulated", [True, False])
def test_simulated_motion_is_written_on_the_figure(tmp_path, simulated):
    figure = _figure()
    save(figure, tmp_path / "figure.png", simulated)
    assert [text.get_text() for text in figure.texts] == ["simulated ground motion"] * simulated
    assert imread(tmp_path / "figure.png").shape[:2] == (4 * DOTS_PER_INCH, 5 * DOTS_PER_INCH)


def test_the_note_lies_below_the_axes(tmp_path):
    # the lowest figure is 4 inches high; would catch a note over the labels of the axis
    figure = _figure()
    save(figure, tmp_path / "figure.png", simulated=True)
    lowest = figure.axes[0].get_tightbbox().y0
    assert figure.texts[0].get_window_extent().y1 <= lowest


def test_a_figure_that_cannot_be_drawn_leaves_the_old_one(tmp_path):
    # would catch a file that is written in place
    path = tmp_path / "figure.png"
    path.write_bytes(b"old")
    broken = _figure()
    broken.savefig = lambda *_, **__: pytest.fail("power cut")
    with pytest.raises(pytest.fail.Exception, match="power cut"):
        save(broken, path, simulated=False)
    assert path.read_bytes() == b"old"
    assert list(tmp_path.iterdir()) == [path]


def test_every_state_has_a_colour_of_its_own():
    assert list(STATE_COLOURS) == ["yes", "likely", "possible", "unlikely", "no"]
    assert len(set(STATE_COLOURS.values())) == len(STATE_COLOURS)


@pytest.mark.parametrize("text", ["$x_$", "$", r"\$x_$", "a$b$c", "x\u202ey\n"])
def test_names_of_data_are_literal(tmp_path, text):
    # would catch text that is read as a formula, which fails when the figure is drawn
    figure = Figure()
    axes = figure.subplots()
    axes.plot([0.0, 1.0], label=literal(text))
    axes.legend()
    figure.suptitle(literal(text))
    save(figure, tmp_path / "figure.png", simulated=False)
    assert literal(text).replace(r"\$", "$") == printable(text)
