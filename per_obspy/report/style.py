"""Colours of all figures, and writing them as PNG."""

from pathlib import Path

from matplotlib.figure import Figure

from per_obspy.files import written_whole

#: State of a pair -> colour (Okabe & Ito 2008, distinct for colour-blind readers too).
STATE_COLOURS = {"yes": "#D55E00", "possible": "#E69F00", "no": "#009E73"}

#: Buildings 1 and 2, the ground motion, and whatever is only for comparison.
BUILDING_COLOURS = ("#0072B2", "#CC79A7")
MOTION_COLOUR = "#444444"
FAINT_COLOUR = "#BBBBBB"

DOTS_PER_INCH = 130


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
