"""Figures are written as PNG, and simulated motion cannot pass for a record."""

from itertools import combinations

import numpy as np
import pytest
from matplotlib.figure import Figure
from matplotlib.image import imread

from per_obspy.errors import printable
from per_obspy.report.style import DOTS_PER_INCH, class_colours, literal, save


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


#: Vision without one kind of cones, as matrices of linear sRGB (Machado et al. 2009, table 1).
VISION = {
    "normal": np.eye(3),
    "protanopia": [[0.152286, 1.052583, -0.204868], [0.114503, 0.786281, 0.099216],
                   [-0.003882, -0.048116, 1.051998]],
    "deuteranopia": [[0.367322, 0.860646, -0.227968], [0.280085, 0.672501, 0.047413],
                     [-0.011820, 0.042940, 0.968881]],
    "tritanopia": [[1.255528, -0.076749, -0.178779], [-0.078411, 0.930809, 0.147602],
                   [0.004733, 0.691367, 0.303900]],
}  # fmt: skip


def lab(colour, vision):
    """Return CIE L*a*b* (D65) of a colour as a kind of vision sees it."""
    encoded = np.array([int(colour[start : start + 2], 16) for start in (1, 3, 5)]) / 255
    linear = np.where(encoded <= 0.04045, encoded / 12.92, ((encoded + 0.055) / 1.055) ** 2.4)
    seen = np.clip(np.array(vision) @ linear, 0.0, 1.0)
    to_xyz = [[0.4124, 0.3576, 0.1805], [0.2126, 0.7152, 0.0722], [0.0193, 0.1192, 0.9505]]
    xyz = np.array(to_xyz) @ seen / [0.9505, 1.0, 1.089]
    root = np.where(xyz > 0.008856, np.cbrt(xyz), 7.787 * xyz + 16 / 116)
    return np.array([116 * root[1] - 16, 500 * (root[0] - root[1]), 200 * (root[1] - root[2])])


@pytest.mark.parametrize("vision", VISION)
@pytest.mark.parametrize("count", [2, 3, 4, 5])
def test_classes_differ_for_everybody(vision, count):
    colours = class_colours([f"class {number}" for number in range(count)]).values()
    seen = [lab(colour, VISION[vision]) for colour in colours]
    apart = [float(np.linalg.norm(a - b)) for a, b in combinations(seen, 2)]
    # A difference of 2.3 is just noticeable side by side; marks lie apart and are small. Green and
    # grey of the palette for categories that was used before differ by 12.
    assert min(apart) > 15.0


@pytest.mark.parametrize("count", [1, 2, 3, 4, 5, 9])
def test_no_class_is_green_and_the_worst_is_the_darkest(count):
    """Green would promise safety, which no class does."""
    classes = [f"class {number}" for number in range(count)]
    colours = class_colours(classes)
    lightness = [lab(colours[name], VISION["normal"])[0] for name in classes]
    assert lightness[0] == min(lightness)
    for colour in colours.values():
        red, green, blue = (int(colour[start : start + 2], 16) for start in (1, 3, 5))
        assert green <= max(red, blue)
    assert len(set(colours.values())) == count + 1


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
