"""Colours of all figures, texts of their titles, and writing of PNG files."""

from collections.abc import Sequence
from pathlib import Path
from textwrap import wrap
from unicodedata import bidirectional

from matplotlib.colors import LinearSegmentedColormap, to_hex
from matplotlib.figure import Figure, SubFigure

from per_obspy.errors import printable
from per_obspy.files import written_whole
from per_obspy.screening.ranking import NO_VERDICT, UNKNOWN_CLASS

#: Colours of severity, the worst first. Dark red to pale orange for what is to be inspected, blue
#: for the mildest class: no class is green, because none is a promise of safety. Neighbours differ
#: for colour-blind readers too, see the test.
SEVERITY_COLOURS = ("#7F0000", "#D7301F", "#FC8D59", "#FDD08E", "#A6BFD8")

#: Pairs whose gap is unknown, or without a verdict: not a severity.
UNKNOWN_COLOUR = "#7A5FA8"

#: Marks in figures of records, which have no severity (Okabe & Ito 2008).
NOISE_COLOUR, CORNER_COLOUR, USABLE_COLOUR = "#CC79A7", "#0072B2", "#56B4E9"

#: Buildings 1 and 2, the ground motion, and whatever is only for comparison.
BUILDING_COLOURS = ("#0072B2", "#CC79A7")
MOTION_COLOUR = "#444444"
FAINT_COLOUR = "#BBBBBB"

DOTS_PER_INCH = 130


#: Longest name in a title, characters; the middle of a longer one is left out.
LONGEST_NAME = 80

#: Characters per line of a name in a title.
LINE_WIDTH = 40


def class_colours(classes: Sequence[str]) -> dict[str, str]:
    """
    Return the hexadecimal colour of each risk class, the same in figures and layers.

    Parameters
    ----------
    classes : sequence of str
        Names of the risk classes, worst first, and last perhaps that of pairs without a verdict;
        pairs of unknown gap are added as a class.

    Examples
    --------
    >>> class_colours(["severe", "low"])
    {'severe': '#7F0000', 'low': '#A6BFD8', 'gap unknown': '#7A5FA8'}
    """
    without = dict.fromkeys([UNKNOWN_CLASS, *({NO_VERDICT} & {*classes})], UNKNOWN_COLOUR)
    classes = [name for name in classes if name not in without]
    known, last = SEVERITY_COLOURS, max(len(classes) - 1, 1)
    if len(classes) > len(known):
        ramp = LinearSegmentedColormap.from_list("risk", list(known))
        chosen = [to_hex(ramp(number / last)) for number in range(len(classes))]
    else:
        # Mixed colours would not be distinct for colour-blind readers
        steps = (number * (len(known) - 1) // last for number in range(len(classes)))
        chosen = [known[step] for step in steps]
    colours = dict(zip(classes, chosen, strict=True))
    return colours | without


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
    Escape the dollar signs of a text, so that matplotlib draws no formula, and keep its direction.

    Examples
    --------
    >>> print(literal("$x_$"))
    \$x_\$
    """
    plain = printable(text).replace("$", r"\$")
    # A name from right to left at the beginning would turn the whole line
    starts_right = bidirectional(next(filter(str.isalpha, plain), "A")) in ("R", "AL")
    return f"\u200e{plain}" if starts_right else plain


def _fit_titles(figure: Figure) -> None:
    """Shrink the titles that are wider than their axes or figure, so that none is clipped."""
    titles = [(axes.title, axes.bbox.width) for axes in figure.axes]
    # Titles of the whole figure and of its parts
    parts: list[Figure | SubFigure] = [figure, *figure.subfigs]
    for part in parts:
        level = (text for text in part.texts if not text.get_rotation())
        titles += [(heading, part.bbox.width) for heading in level]
    for title, room in titles:
        # Letters are whole pixels wide: a smaller font may need a little more than its share
        width, available = title.get_window_extent().width, 0.95 * room
        if width > available:
            title.set_fontsize(float(title.get_fontsize()) * available / width)


def save(
    figure: Figure, path: Path, simulated: bool, note: str = "simulated ground motion"
) -> None:
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
    note : str
        That it is.
    """
    # Room below the axes for the note
    if simulated:
        figure.set_layout_engine("constrained", rect=(0.0, 0.05, 1.0, 0.95))
        figure.text(0.99, 0.01, note, ha="right", va="bottom", fontsize=9, color="#AA0000")
    # Axes are arranged once, not once for the titles and again for the file
    engine = figure.get_layout_engine()
    if engine is not None:
        engine.execute(figure)
        figure.set_layout_engine("none")
    _fit_titles(figure)
    with written_whole(path) as part:
        figure.savefig(part, dpi=DOTS_PER_INCH)
