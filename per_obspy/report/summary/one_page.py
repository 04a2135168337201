"""``summary.pdf``: one A4 page with a small map, made without a browser."""

import math
from collections.abc import Hashable, Iterable
from pathlib import Path
from textwrap import wrap
from typing import Any

from matplotlib.figure import Figure
from matplotlib.patches import Rectangle
from matplotlib.text import Text

from per_obspy.errors import shortened
from per_obspy.files import written_whole
from per_obspy.report.coverage import coverage_sentences
from per_obspy.report.overview import draw_map
from per_obspy.report.results import Results
from per_obspy.report.statements import (
    LISTED,
    Alert,
    alert,
    class_text,
    first_steps,
    made_sentence,
    revision_line,
    station_sentences,
    sureness,
)
from per_obspy.report.style import MOTION_COLOUR, class_colours, literal
from per_obspy.report.texts import LANGUAGES, written
from per_obspy.report.words import chance_text, number, speed_text

#: A4, inches; margins and lines as shares of the page.
PAGE = (8.27, 11.69)
LEFT, RIGHT = 0.07, 0.93
LINE, LEGEND_LINE = 0.0148, 0.013

#: Pairs of a map whose marks are shapes; those of more are one picture of so many dots per inch.
MOST_SHAPES, PICTURE_DOTS = 3_000, 200

#: Left edge of the map and its legend.
MAP_LEFT = 0.56

#: Characters of a line of text of size 9 across half a page, and across the page.
HALF, WHOLE = 52, 108

#: Characters of the longest sentence of the head; summary.txt has all of it.
LONGEST_ACCOUNT = 450

#: Colour of the warning that motion is simulated.
WARNING_COLOUR = "#AA0000"

#: Columns of the list of pairs: key of the title, place from the left.
COLUMNS = {
    "": 0.07, "pair": 0.10, "class": 0.31, "impact": 0.40, "contact": 0.485, "gap": 0.61,
    "needed": 0.675, "place": 0.93,
}  # fmt: skip


def write_page(results: Results, path: Path) -> None:
    """
    Write the summary as one page of PDF, whole or not at all.

    Parameters
    ----------
    results : Results
        Of the screening.
    path : Path
        ``.pdf``.
    """
    figure = Figure(figsize=PAGE)
    at = _write_head(figure, results)
    bottom = at - 0.30
    _draw_map(figure, results, bottom)
    texts = results.texts
    lowest = _write_section(figure, texts["do_first"], first_steps(results), at, HALF)
    lowest = _write_section(figure, texts["how_sure"], sureness(results), lowest, HALF)
    _write_pairs(figure, results, min(lowest, bottom))
    # Where the numbers are from
    figure.text(
        LEFT, 0.03, literal(shortened(made_sentence(results), 150)), fontsize=7, color=MOTION_COLOUR
    )
    # The same page has the same bytes
    with written_whole(path) as part:
        figure.savefig(part, metadata={"CreationDate": None}, dpi=PICTURE_DOTS)


def _draw_map(figure: Figure, results: Results, bottom: float) -> None:
    """Draw the map of the pairs on the right, with its legend."""
    legend = _write_legend(figure, results, bottom + 0.005)
    box = (MAP_LEFT, bottom + 0.05 + legend, RIGHT - MAP_LEFT, 0.225 - legend)
    axes, texts = figure.add_axes(box), results.texts
    draw_map(axes, results.shown, results.region, results.language, around_pairs=True)
    # Marks of many pairs as one picture: each of them as a shape takes longer than all the rest
    for marks in axes.collections if len(results.shown) > MOST_SHAPES else ():
        marks.set_rasterized(True)
    # Labels in the language of the summary, none on the left, where its sentences end
    axes.set_title(results.counted("map_title", len(results.shown)))
    axes.set(xlabel=f"{texts['map_east']}, {texts['map_north']}", ylabel="")
    axes.tick_params(labelsize=7)
    for text in (axes.xaxis.label, axes.yaxis.label, axes.title):
        text.set_fontsize(8)


def _write_head(figure: Figure, results: Results) -> float:
    """Write title, warning, alert, earthquake and stations; return how far the page is filled."""
    at = 0.955
    for line in wrap(shortened(results.region.title, 140), 70):
        figure.text(LEFT, at, literal(line), fontsize=14, fontweight="bold")
        at -= 0.024
    if results.region.simulated:
        at = _write_lines(figure, [results.texts["simulated"]], at, WARNING_COLOUR, 13.0) - 0.004
    at = _write_alert(figure, alert(results), at)
    # Whatever has no verdict comes first, then the earthquake
    # The warning of a table of which much is left out is red
    account = coverage_sentences(results.coverage, results.language)
    warning = account[: results.coverage.lacks_many]
    texts = [
        *account[len(warning) :],
        revision_line(results.revision, results.language),
        " ".join(results.source),
        *station_sentences(results.stations, results.language),
    ]
    for colour, chosen in ((WARNING_COLOUR, warning), ("black", texts)):
        for text in chosen:
            lines = wrap(shortened(text, LONGEST_ACCOUNT), WHOLE)
            at = _write_lines(figure, lines, at, colour)
    return at - 0.01


def _write_alert(figure: Figure, alert: Alert, at: float) -> float:
    """Write the alert beside a band of its colour; return how far the page is filled."""
    # The sentence, its band, and what the level means
    lines, top = wrap(f"{alert.level.upper()}. {alert.sentence}", 72), at + 0.01
    for line in lines:
        figure.text(LEFT + 0.025, at, literal(line), fontsize=11.5, fontweight="bold")
        at -= 0.018
    band = Rectangle((LEFT, at + 0.008), 0.014, top - at, transform=figure.transFigure)
    band.set(facecolor=alert.colour, edgecolor="none")
    figure.add_artist(band)
    small = wrap(f"{alert.status} {alert.levels}", 125)
    return _write_lines(figure, small, at, MOTION_COLOUR, 7.5) - 0.004


def _write_lines(
    figure: Figure, lines: list[str], at: float, colour: str = "black", size: float = 9.0
) -> float:
    """Write lines of text and return how far the page is filled."""
    for line in lines:
        figure.text(LEFT, at, literal(line), fontsize=size, color=colour)
        at -= LINE * size / 9.0
    return at


def _write_section(
    figure: Figure, title: str, sentences: list[str], at: float, width: int
) -> float:
    """Write a titled list of sentences and return how far the page is filled."""
    figure.text(LEFT, at, title, fontsize=11, fontweight="bold")
    at -= 0.02
    for sentence in sentences:
        lines = wrap(sentence, width)
        at = _write_lines(figure, [f"- {lines[0]}", *(f"  {line}" for line in lines[1:])], at)
    return at - 0.012


def _write_legend(figure: Figure, results: Results, at: float) -> float:
    """Write the number of pairs of each class in its colour, and return the height of the lines."""
    left, line, entries = MAP_LEFT, 0, list[tuple[Text, Text, int]]()
    counts = results.tally.classes
    # Entries as wide as they are drawn, on as many lines as they need between map and margin
    for name, colour in class_colours(results.region.classes).items():
        if not counts[name]:
            continue
        label = shortened(class_text(name, results.texts), 24)
        mark = figure.text(left, 0.0, "●", size=9, color=colour)
        text = figure.text(0.0, 0.0, literal(f"{label} {results.written(counts[name])}"), size=7.5)
        width = 0.016 + text.get_window_extent().width / figure.bbox.width
        if left > MAP_LEFT and left + width > RIGHT:
            left, line = MAP_LEFT, line + 1
        # A mark, its words, and room to the next one
        mark.set_x(left)
        text.set_x(left + 0.016)
        entries.append((mark, text, line))
        left += width + 0.018
    _lift(entries, at, line)
    return LEGEND_LINE * line


def _lift(entries: Iterable[tuple[Text, Text, int]], at: float, last: int) -> None:
    """Move the entries of a legend to their lines, of which the last is the lowest."""
    for mark, text, line in entries:
        for part in (mark, text):
            part.set_y(at + LEGEND_LINE * (last - line))


def _write_pairs(figure: Figure, results: Results, at: float) -> None:
    """Write the worst pairs, and the worst buildings where there are any."""
    figure.text(LEFT, at, results.texts["worst_pairs"], fontsize=11, fontweight="bold")
    at -= 0.02
    # An ensemble lacks the needed gap
    hidden = {""} if "demand" in results.listed else {"", "needed"}
    titles = ["" if key in hidden else results.texts[f"head_{key}"] for key in COLUMNS]
    _write_row(figure, titles, at, MOTION_COLOUR)
    # One per line
    for position, (_, pair) in enumerate(results.listed.head(LISTED).iterrows(), start=1):
        # As many as the summary lists
        at -= LINE
        cells = (
            str(position),
            shortened(str(pair["pair_id"]), 26),
            shortened(class_text(str(pair["risk_class"]), results.texts), 12),
            *_number_cells(dict(pair), results.language),
            f"{pair['latitude']:.5f}, {pair['longitude']:.5f}",
        )
        _write_row(figure, cells, at, "black")
    if not results.buildings.empty:
        _write_buildings(figure, results, at - 2.5 * LINE)


def _number_cells(pair: dict[Hashable, Any], language: str) -> list[str]:
    """Return velocity, probability, gap and demand of a pair in words."""
    return [
        speed_text(number(pair, "expected_impact_velocity"), language),
        chance_text(number(pair, "probability"), language),
        _centimetres(number(pair, "gap"), language),
        _centimetres(number(pair, "demand"), language) if "demand" in pair else "",
    ]


def _centimetres(metres: float, language: str) -> str:
    """Return a length in the unit of the whole column; in words if it is unknown."""
    if not math.isfinite(metres):
        return LANGUAGES[language]["unknown"]
    return f"{written(100.0 * metres, 1, language)} cm"


def _write_row(figure: Figure, cells: Iterable[str], at: float, colour: str) -> None:
    """Write the cells of a row; the last one ends at the margin."""
    for cell, place in zip(cells, COLUMNS.values(), strict=True):
        align = "right" if place == RIGHT else "left"
        text = figure.text(place, at, literal(cell), fontsize=8, color=colour, ha=align)
        if place == COLUMNS["pair"]:
            _fit(text, (COLUMNS["class"] - place - 0.01) * figure.bbox.width)


def _fit(text: Text, room: float) -> None:
    """Shrink a text to a width in pixels."""
    width = text.get_window_extent().width
    if width > room:
        text.set_fontsize(8.0 * room / width)


def _write_buildings(figure: Figure, results: Results, at: float) -> None:
    """Write the worst buildings in two columns."""
    figure.text(LEFT, at, results.texts["worst_buildings"], fontsize=11, fontweight="bold")
    for position, building in enumerate(results.buildings.head(LISTED).to_dict("records")):
        # Five below each other
        left = LEFT if position < 5 else 0.52
        row = at - 0.02 - LINE * (position % 5)
        place = f"{building['latitude']:.5f}, {building['longitude']:.5f}"
        # In the words of the language
        name = shortened(str(building["building_id"]), 24)
        severity = shortened(class_text(str(building["risk_class"]), results.texts), 12)
        words = f"{position + 1}  {name}, {severity}, {place}"
        text = figure.text(left, row, literal(words), fontsize=8)
        _fit(text, 0.42 * figure.bbox.width)
