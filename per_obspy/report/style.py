"""Colours of all figures, and writing them as PNG."""

from pathlib import Path
from textwrap import wrap

from matplotlib.figure import Figure

from per_obspy.errors import printable
from per_obspy.files import written_whole

#: State of a pair -> colour (Okabe & Ito 2008, distinct for colour-blind readers too).
STATE_COLOURS = {
    "yes": "#D55E00",
    "likely": "#E69F00",
    "possible": "#F0E442",
    "unlikely": "#56B4E9",
    "no": "#009E73",
}

#: Pairs whose gap is unknown.
UNKNOWN_COLOUR = "#999999"

#: Buildings 1 and 2, the ground motion, and whatever is only for comparison.
BUILDING_COLOURS = ("#0072B2", "#CC79A7")
MOTION_COLOUR = "#444444"
FAINT_COLOUR = "#BBBBBB"

DOTS_PER_INCH = 130


#: Longest name in a title, characters; the middle of a longer one is left out.
LONGEST_NAME = 80

#: Characters per line of a name in a title.
LINE_WIDTH = 40


def title_name(name: str) -> str:
    """
    Return a name for a title: one or two lines, without control characters.

    Examples
    --------
    >>> title_name("P7")
    'P7'
    >>> len(title_name(200 * "A"))
    81
    """
    text = printable(name)
    if len(text) > LONGEST_NAME:
        half = LONGEST_NAME // 2
        text = f"{text[:half]}…{text[1 - half :]}"
    return "\n".join(wrap(text, LINE_WIDTH))


def literal(text: str) -> str:
    r"""
    Return a text that matplotlib draws as it is: dollar signs begin no formula.

    Examples
    --------
    >>> print(literal("$x_$"))
    \$x_\$
    """
    return printable(text).replace("$", r"\$")


def fit_titles(figure: Figure) -> None:
    """Shrink the titles that are wider than their axes or figure, so that none is clipped."""
    figure.draw_without_rendering()
    titles = [(axes.title, axes.bbox.width) for axes in figure.axes]
    # The title of the whole figure
    titles += [(heading, figure.bbox.width) for heading in figure.texts]
    for title, room in titles:
        # Letters are whole pixels wide: a smaller font may need a little more than its share
        width, available = title.get_window_extent().width, 0.95 * room
        if width > available:
            title.set_fontsize(float(title.get_fontsize()) * available / width)


def save(figure: Figure, path: Path, simulated: bool) -> None:
    """
    Write a figure as PNG, whole or not at all.

    Parameters
    ----------
    figure : Figure
        Figure to write.
    path : Path
        PNG file.
    simulated : bool
        Whether the ground motion is simulated, which is then written on the figure.
    """
    # Room below the axes for the note
    if simulated:
        figure.set_layout_engine("constrained", rect=(0.0, 0.05, 1.0, 0.95))
        figure.text(
            0.99,
            0.01,
            "simulated ground motion",
            ha="right",
            va="bottom",
            fontsize=9,
            color="#AA0000",
        )
    with written_whole(path) as part:
        figure.savefig(part, dpi=DOTS_PER_INCH)
