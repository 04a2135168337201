"""Overview of a region: a map of all pairs, maps of the worst places, gaps over demands."""

from collections.abc import Callable, Mapping, Sequence
from pathlib import Path
from string import ascii_uppercase
from typing import Any, NamedTuple

import numpy as np
import pandas as pd
from matplotlib.axes import Axes
from matplotlib.axis import Axis
from matplotlib.collections import LineCollection
from matplotlib.figure import Figure, SubFigure
from matplotlib.lines import Line2D
from matplotlib.patches import Rectangle
from matplotlib.patheffects import withStroke
from matplotlib.ticker import MaxNLocator, SymmetricalLogLocator
from numpy.typing import ArrayLike, NDArray

from per_obspy.checks import FloatArray
from per_obspy.constants import METRES_PER_DEGREE, STANDARD_GRAVITY
from per_obspy.report.page.map_lines import beside, continuous, lines_around, towns_around
from per_obspy.report.results import Region
from per_obspy.report.style import (
    FAINT_COLOUR,
    MOTION_COLOUR,
    class_colours,
    literal,
    save,
    title_name,
)
from per_obspy.report.texts import LANGUAGES, counted, written
from per_obspy.screening.ranking import NO_VERDICT, UNKNOWN_CLASS

IntArray = NDArray[np.int64]

#: Smallest side of a map, m: a street with its buildings.
SMALLEST = 200.0


class Frame(NamedTuple):
    """
    Rectangle on a map.

    Attributes
    ----------
    west, east, south, north : float
        Degrees; east is above 180 where the rectangle crosses the date line.
    """

    west: float
    east: float
    south: float
    north: float

    @property
    def stretch(self) -> float:
        """Length of a degree of longitude over one of latitude, in the middle."""
        return max(float(np.cos(np.radians(0.5 * (self.south + self.north)))), 0.01)

    @property
    def size(self) -> float:
        """Longer side, m."""
        sides = (self.east - self.west) * self.stretch, self.north - self.south
        return METRES_PER_DEGREE * max(sides)

    def padded(self, share: float) -> "Frame":
        """Return a frame that is larger by a share of its longer side, and not too small."""
        room = max(share * self.size, 0.5 * (SMALLEST - self.size)) / METRES_PER_DEGREE
        east = room / self.stretch
        return Frame(self.west - east, self.east + east, self.south - room, self.north + room)


def frame_of(longitude: ArrayLike, latitude: ArrayLike) -> Frame:
    """Return the smallest frame around some points (degrees), at least one."""
    east, north = np.asarray(longitude, dtype=np.float64), np.asarray(latitude, dtype=np.float64)
    return Frame(float(east.min()), float(east.max()), float(north.min()), float(north.max()))


#: Worst places that have a map of their own, and the pairs that each of them has at least.
SHOWN_PLACES, FEWEST = 3, 5

#: Half the side of a place: a share of the map of all pairs, and at least so many m.
SHARE, LEAST = 0.15, 2_000.0

#: A map of at most this size, m, shows every street.
STREETS = 5_000.0

#: Coast lines are right to some hundred m: none on a map below this size, m.
COARSE = 10_000.0
COAST_COLOUR, BORDER_COLOUR = "#51708A", "#8A6F86"

#: Names of towns, or amplitudes of stations, on a map at most; towns of which the names are chosen.
MOST_LABELS, MOST_TOWNS = 12, 100
TOWN_COLOUR = "#1F3A4D"

#: Height of the place of the scale bar, share of the map.
BAR_HEIGHT = 0.1

#: Space around the points of a map, share of its longer side.
MARGIN = 0.06


class _Points(NamedTuple):
    """Pairs as points of a map, worst first, with their colours."""

    longitude: FloatArray
    latitude: FloatArray
    colour: NDArray[np.object_]

    def chosen(self, members: IntArray) -> "_Points":
        """Return some of the points."""
        return _Points(self.longitude[members], self.latitude[members], self.colour[members])


def draw_overview(table: pd.DataFrame, region: Region, path: Path, language: str = "en") -> None:
    """
    Draw maps of the pairs and stations of a region, and gaps over demands where there are any.

    The worst places of a large region are drawn at a scale of their own.

    Parameters
    ----------
    table : DataFrame
        ``risk_class, longitude, latitude`` of pairs, worst first, and ``pair_id``; ``demand`` and
        ``gap`` (m) where there are any.
    region : Region
        Title, classes, stations and epicentre; stations with a ``pga`` (m/s2) are as large as the
        ground shook there.
    path : Path
        PNG file.
    language : str
        Of the texts.
    """
    places = worst_places(table, region)
    # Their maps have a row of their own
    heights = [5.7, 3.8] if places else [5.7]
    figure = Figure(figsize=(13.0, 0.5 + sum(heights)), layout="constrained")
    parts = np.array(figure.subfigures(len(heights), 1, height_ratios=heights)).ravel().tolist()
    whole = _draw_top(parts[0], table, region, language)
    if places:
        _mark(whole, [frame for frame, _ in places])
        _draw_places(parts[1], table, region, places, language)
    # One legend and one title for everything
    _add_legend(figure, whole, table, region, language)
    figure.suptitle(title_name(region.title), parse_math=False)
    save(figure, path, region.simulated, LANGUAGES[language]["overview_simulated"])


def _draw_top(figure: SubFigure, table: pd.DataFrame, region: Region, language: str) -> Axes:
    """Draw the map of the region, and gaps over demands where there are any; return the map."""
    has_gaps = "demand" in table
    panels = figure.subplots(1, 1 + has_gaps, squeeze=False).ravel()
    whole: Axes = panels[0]
    draw_map(whole, table, region, language)
    if has_gaps:
        _draw_gaps(panels[1], table, region.classes, LANGUAGES[language])
    return whole


def draw_map(
    axes: Axes,
    table: pd.DataFrame,
    region: Region,
    language: str = "en",
    around_pairs: bool = False,
) -> None:
    """
    Draw pairs in the colours of their classes, stations and the epicentre on axes of any shape.

    Parameters
    ----------
    axes : Axes
        The map fills them.
    table : DataFrame
        As for :func:`draw_overview`.
    region : Region
        As for :func:`draw_overview`.
    language : str
        Of the texts.
    around_pairs : bool
        Show the surroundings of the pairs only, without stations and an epicentre that are further
        away: a small map of a large region would hide all pairs behind one mark.
    """
    points = _points(table, region)
    seen = region._replace(stations=region.stations[:0], epicentre=None) if around_pairs else region
    frame = _whole_frame(points, seen)
    _draw_points(axes, points, frame)
    # Texts beside them, as far as there is room
    at_right = _is_at_bar(region, frame)
    labels = _Labels(axes, frame, at_right)
    _draw_stations(axes, region, frame)
    _write_amplitudes(labels, region, language)
    _draw_coasts(axes, points, frame)
    _write_towns(labels, points)
    _add_scale_bar(axes, frame, 0.03, at_right)
    axes.set_title(counted(language, "overview_pairs", len(table)), fontsize=11)
    texts = LANGUAGES[language]
    axes.set(xlabel=texts["map_east"], ylabel=texts["map_north"])
    # Few ticks, so that their labels never touch
    for axis in (axes.xaxis, axes.yaxis):
        axis.set_major_locator(MaxNLocator(nbins=4))
    axes.ticklabel_format(useOffset=False)


def _points(table: pd.DataFrame, region: Region) -> _Points:
    """Return the pairs of known place as points."""
    colours = class_colours(region.classes)
    # Classes of an earlier configuration are grey
    colour = table["risk_class"].map(lambda name: colours.get(name, FAINT_COLOUR))
    latitude = table["latitude"].to_numpy(np.float64)
    return _Points(continuous(table["longitude"]), latitude, colour.to_numpy(dtype=object))


def _whole_frame(points: _Points, region: Region) -> Frame:
    """Return the frame around all pairs, and stations and epicentre that are not far away."""
    if not points.longitude.size:
        return Frame(-180.0, 180.0, -90.0, 90.0)
    east, north = points.longitude, points.latitude
    stations = region.stations.dropna(subset=["longitude", "latitude"])
    longitude = np.concatenate([east, stations["longitude"]])
    latitude = np.concatenate([north, stations["latitude"]])
    # The epicentre is part of every region
    if region.epicentre is not None:
        longitude = np.append(longitude, region.epicentre[0])
        latitude = np.append(latitude, region.epicentre[1])
    return frame_of(continuous(longitude), latitude).padded(MARGIN)


def worst_places(table: pd.DataFrame, region: Region) -> list[tuple[Frame, IntArray]]:
    """
    Return the surroundings of the worst pairs that are too small on the map of a region.

    Parameters
    ----------
    table, region
        As for :func:`draw_overview`.

    Returns
    -------
    list of (Frame, ndarray of int)
        Frame and positions of the pairs in each place, that of the worst pair first. Places of the
        mildest class alone are none.
    """
    points, places = _points(table, region), list[tuple[Frame, IntArray]]()
    east, north = points.longitude, points.latitude
    if east.size < FEWEST or _whole_frame(points, region).size < STREETS:
        return []
    # Pairs that are not yet in a place
    without = [UNKNOWN_CLASS, NO_VERDICT]
    mildest = [*[name for name in region.classes if name not in without][-1:], *without]
    rest = ~table["risk_class"].isin(mildest).to_numpy()
    while rest.any() and len(places) < SHOWN_PLACES:
        worst = int(np.argmax(rest))
        near = _near(points, worst)
        # Its place may be unknown
        rest &= ~near
        rest[worst] = False
        members = np.flatnonzero(near).astype(np.int64)
        if members.size >= FEWEST:
            places.append((frame_of(east[members], north[members]).padded(MARGIN), members))
    return places


def _near(points: _Points, worst: int) -> NDArray[np.bool_]:
    """Return which pairs are in the square around one of them."""
    # A share of the map of all pairs
    pairs = frame_of(points.longitude, points.latitude)
    half = max(SHARE * pairs.size, LEAST) / METRES_PER_DEGREE
    east = np.abs(points.longitude - points.longitude[worst]) * pairs.stretch
    north = np.abs(points.latitude - points.latitude[worst])
    near: NDArray[np.bool_] = (east <= half) & (north <= half)
    return near


def _draw_points(axes: Axes, points: _Points, frame: Frame) -> None:
    """Draw pairs, the worst on top, larger where there are few, within a frame."""
    size = float(np.clip(6000.0 / max(points.longitude.size, 1), 5.0, 36.0))
    chosen = points.chosen(np.arange(points.longitude.size)[::-1])
    style: dict[str, Any] = {"s": size, "linewidths": 0.3, "edgecolors": "black", "zorder": 3}
    axes.scatter(chosen.longitude, chosen.latitude, c=list(chosen.colour), **style)
    # A degree of longitude is shorter by the cosine of the latitude; the map fills its axes
    axes.update_datalim([(frame.west, frame.south), (frame.east, frame.north)])
    axes.margins(0.0)
    axes.set_aspect(1.0 / frame.stretch, adjustable="datalim")


def _draw_stations(axes: Axes, region: Region, frame: Frame) -> None:
    """Draw stations as open triangles below the pairs, and the epicentre as a star."""
    outline: dict[str, Any] = {"facecolors": "none", "edgecolors": "black"}
    outline |= {"linewidths": 0.8, "zorder": 2}
    places = region.stations[["longitude", "latitude"]].to_numpy(dtype=np.float64)
    # As large as on the page; without amplitudes all are alike
    peaks = _amplitudes(region)
    sizes = np.where(np.isnan(peaks), 30.0, 30.0 * (0.6 + np.minimum(1.4, 1.6 * peaks**0.5)) ** 2)
    epicentre = _epicentre(region)
    large = np.full(len(epicentre), 130.0)
    for marker, size, marks in (("^", sizes, places), ("*", large, epicentre)):
        # Only those within the map, which they would widen otherwise
        east, north, inside = _inside(marks, frame)
        axes.scatter(east[inside], north[inside], marker=marker, s=size[inside], **outline)


def _amplitudes(region: Region) -> FloatArray:
    """Return the largest acceleration of each station, g; NaN where it is unknown."""
    peaks = region.stations.get("pga", pd.Series(np.nan, region.stations.index))
    return np.asarray(peaks, dtype=np.float64) / STANDARD_GRAVITY


def _inside(places: FloatArray, frame: Frame) -> tuple[FloatArray, FloatArray, NDArray[np.bool_]]:
    """Return longitudes beside the middle of a frame, latitudes, and which places are in it."""
    east, north = beside(places[:, 0], 0.5 * (frame.west + frame.east)), places[:, 1]
    inside: NDArray[np.bool_] = (east >= frame.west) & (east <= frame.east)
    return east, north, inside & (north >= frame.south) & (north <= frame.north)


class _Labels:
    """Texts beside places of a map, of which none touches an earlier one."""

    def __init__(self, axes: Axes, frame: Frame, bar_at_right: bool) -> None:
        self.axes = axes
        box, tall = axes.get_window_extent(), frame.north - frame.south
        # The map fills its axes: degrees of latitude across, a little less as titles need room
        across = max((frame.east - frame.west) * frame.stretch, tall * box.width / box.height)
        side = 0.5 * (0.9 * across / frame.stretch - (frame.east - frame.west))
        self.frame = frame._replace(west=frame.west - side, east=frame.east + side)
        # A letter of size 8 is 0.075 inches wide; the scale bar has its place
        letter = 0.075 * across / (box.width / Figure().dpi)
        self.letter = letter / frame.stretch, 1.8 * letter
        middle, top = 0.5 * (frame.west + frame.east), frame.south + BAR_HEIGHT * tall
        sides = (middle, frame.east) if bar_at_right else (frame.west, middle)
        self.boxes = [(sides[0], frame.south, sides[1], top)]

    def write(self, text: str, east: float, north: float, **style: Any) -> bool:
        """Write a text to the right of a place if it has room there."""
        # The box of the text, in degrees
        width, height = self.letter
        left, right = east + 0.5 * width, east + (1.5 + len(text)) * width
        box = (left, north - 0.5 * height, right, north + 0.5 * height)
        touches = any(
            box[0] < other[2] and other[0] < box[2] and box[1] < other[3] and other[1] < box[3]
            for other in self.boxes
        )
        if touches or right > self.frame.east:
            return False
        self.boxes.append(box)
        offset: dict[str, Any] = {"xytext": (5.0, 0.0), "textcoords": "offset points"}
        drawn = self.axes.annotate(
            literal(text), (east, north), va="center", fontsize=8, **offset, **style
        )
        # White around the letters
        drawn.set_path_effects([withStroke(linewidth=2.0, foreground="white")])
        return True


def _write_amplitudes(labels: _Labels, region: Region, language: str) -> None:
    """Write the largest acceleration beside the stations, where they are few."""
    places = region.stations[["longitude", "latitude"]].to_numpy(dtype=np.float64)
    peaks = _amplitudes(region)
    east, north, inside = _inside(places, labels.frame)
    # Texts of many would hide the pairs
    chosen = np.flatnonzero(inside & np.isfinite(peaks))
    if len(chosen) <= MOST_LABELS:
        for i in chosen.tolist():
            labels.write(f"{written(float(peaks[i]), 2, language)} g", east[i], north[i], zorder=4)


def _write_towns(labels: _Labels, points: _Points) -> None:
    """Write the names of the largest towns, and a dot for each."""
    # The largest take their room first
    frame, count = labels.frame, 0
    for name, longitude, latitude in towns_around(points.longitude, points.latitude, MOST_TOWNS):
        east, north, inside = _inside(np.array([[longitude, latitude]]), frame)
        style: dict[str, Any] = {"style": "italic", "color": TOWN_COLOUR, "zorder": 4}
        if inside[0] and labels.write(name, float(east[0]), float(north[0]), **style):
            labels.axes.scatter(east, north, s=5, color=TOWN_COLOUR, zorder=3.5)
            count += 1
        if count == MOST_LABELS:
            return


def _epicentre(region: Region) -> FloatArray:
    """Return the place of the epicentre, (1, 2) or (0, 2), degrees."""
    return np.array([region.epicentre] if region.epicentre else []).reshape(-1, 2)


def _mark(axes: Axes, frames: Sequence[Frame]) -> None:
    """Outline the places with separate maps, and write their letters."""
    for letter, frame in zip(ascii_uppercase, frames, strict=False):
        width, height = frame.east - frame.west, frame.north - frame.south
        corner = frame.west, frame.south
        axes.add_patch(Rectangle(corner, width, height, fill=False, linewidth=0.8, zorder=4))
        # Inside of its corner, whatever the scale, on white: places may touch
        place: dict[str, Any] = {"xytext": (3.0, -3.0), "textcoords": "offset points"}
        place["bbox"] = {"facecolor": "white", "edgecolor": "none", "pad": 1.0}
        at = frame.west, frame.north
        axes.annotate(letter, at, fontweight="bold", zorder=5, va="top", **place)


def _draw_places(
    figure: SubFigure,
    table: pd.DataFrame,
    region: Region,
    places: Sequence[tuple[Frame, IntArray]],
    language: str,
) -> None:
    """Draw the worst places, each with its number of pairs, its worst pair and a scale bar."""
    points = _points(table, region)
    panels = figure.subplots(1, len(places), squeeze=False).ravel()
    for letter, panel, (frame, members) in zip(ascii_uppercase, panels, places, strict=False):
        _draw_points(panel, points.chosen(members), frame)
        _draw_stations(panel, region, frame)
        # As wide as its place
        panel.set_aspect(1.0 / frame.stretch, adjustable="box")
        # Without coordinates, which the whole map has
        _add_scale_bar(panel, frame, -0.03)
        worst = literal(str(table["pair_id"].iloc[int(members[0])]))[:30]
        name = counted(language, "overview_place", members.size, letter=letter, pair=worst)
        panel.set_title(name, fontsize=10)
        panel.set(xticks=[], yticks=[])


def _draw_coasts(axes: Axes, points: _Points, frame: Frame) -> None:
    """Draw coast lines and borders around the pairs of a large map."""
    if frame.size < COARSE:
        return
    lines = lines_around(points.longitude, points.latitude)
    for name, colour in (("coast", COAST_COLOUR), ("borders", BORDER_COLOUR)):
        shapes = [np.reshape(line, (-1, 2)) for line in lines[name]]
        drawn = LineCollection(shapes, colors=colour, linewidths=0.8, zorder=1)
        axes.add_collection(drawn, autolim=False)


def _is_at_bar(region: Region, frame: Frame) -> bool:
    """Return whether the epicentre lies in the left half of the map at the height of its bar."""
    east, north, inside = _inside(_epicentre(region), frame)
    at_left = 2.0 * east < frame.west + frame.east
    top = frame.south + BAR_HEIGHT * (frame.north - frame.south)
    return bool((inside & at_left & (north < top)).any())


def _add_scale_bar(axes: Axes, frame: Frame, height: float, at_right: bool = False) -> None:
    """Add a bar of a round length, about a quarter of the map, at a height of its axes."""
    quarter = 0.25 * frame.size
    unit = 10.0 ** np.floor(np.log10(quarter))
    length = unit * max(step for step in (1.0, 2.0, 5.0) if step * unit <= quarter)
    text = f"{length / 1000:g} km" if length >= 1000.0 else f"{length:g} m"
    # As long as in the coordinates of the data
    degrees = length / METRES_PER_DEGREE / frame.stretch
    place = axes.get_xaxis_transform()
    # The text is on the side of the middle
    start, inwards = (frame.east, -degrees) if at_right else (frame.west, degrees)
    line = [start, start + inwards], [height, height]
    axes.plot(*line, color="black", linewidth=2.0, transform=place, clip_on=False)
    style: dict[str, Any] = {"ha": "right" if at_right else "left", "va": "center", "fontsize": 8}
    axes.text(start + 1.1 * inwards, height, text, transform=place, **style)


def _add_legend(
    figure: Figure, axes: Axes, table: pd.DataFrame, region: Region, language: str
) -> None:
    """Add one legend below all panels, where it covers neither data nor labels."""
    handles, counts = list[Line2D](), table["risk_class"].value_counts()
    texts = LANGUAGES[language]
    # Classes that a pair has
    for name, colour in class_colours(region.classes).items():
        if count := int(counts.get(name, 0)):
            text = _class_label(name, count, language)
            style: dict[str, Any] = {"marker": "o", "linestyle": "", "color": colour}
            style |= {"markeredgecolor": "black", "markeredgewidth": 0.3}
            handles += axes.plot([], [], label=text, **style)
    # Stations and epicentre, where they are known
    marks = {"^": ("station", len(region.stations)), "*": ("epicentre", region.epicentre)}
    for marker, (name, present) in marks.items():
        if present:
            style = {"marker": marker, "linestyle": "", "color": "black"}
            handles += axes.plot([], [], markerfacecolor="none", label=texts[name], **style)
    figure.legend(handles=handles, loc="outside lower left", ncols=4, fontsize=9, frameon=False)


def _class_label(name: str, count: int, language: str) -> str:
    """Return a class in words, and its number of pairs."""
    words = literal(LANGUAGES[language].get(f"class_{name}", name))
    return counted(language, "overview_class", count, name=words)


def _draw_gaps(
    axes: Axes, table: pd.DataFrame, classes: Sequence[str], texts: Mapping[str, str]
) -> None:
    """Draw gaps over demands, cm, in the colours of the classes, the worst on top."""
    colours = class_colours(classes)
    for name in reversed(colours):
        chosen = table[table["risk_class"] == name]
        axes.scatter(100 * chosen["demand"], 100 * chosen["gap"], s=6, color=colours[name])
    # The demand of the medians; the class is that of the whole population
    largest = 100 * table[["demand", "gap"]].max().to_numpy(np.float64)
    demand, gap = np.where(np.isfinite(largest), largest, 0.0).tolist()
    axes.plot([0.0, demand], [0.0, demand], color=MOTION_COLOUR, linewidth=0.8)
    # Next to its end, where no mark is hidden
    axes.annotate(texts["overview_equal"], (demand, demand), ha="right", va="bottom", fontsize=8)
    axes.set(xlabel=texts["overview_demand"], ylabel=texts["overview_gap"])
    axes.set_title(texts["overview_gaps"], fontsize=11)
    # One scale for both axes: equal values lie on a straight line
    _from_zero(axes.set_xscale, axes.set_xlim, axes.xaxis, demand, demand)
    _from_zero(axes.set_yscale, axes.set_ylim, axes.yaxis, max(demand, gap), demand)


def _from_zero(
    set_scale: Callable[..., object],
    set_limits: Callable[..., object],
    axis: Axis,
    largest: float,
    demand: float,
) -> None:
    """Make an axis linear up to 1, or a tenth of a smaller largest demand; logarithmic beyond."""
    linear = min(1.0, 0.1 * demand) if demand > 0 else 1.0
    set_scale("symlog", linthresh=linear)
    axis.set_major_locator(SymmetricalLogLocator(base=10.0, linthresh=linear, subs=(1.0, 2.0, 5.0)))
    set_limits(-0.1 * linear, 1.5 * max(largest, linear))
    axis.set_major_formatter("{x:g}")
