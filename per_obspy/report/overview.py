"""Overview of a region: a map of all pairs, a map of each cluster of them, gaps over demands."""

from collections.abc import Callable, Sequence
from pathlib import Path
from string import ascii_uppercase
from typing import Any, NamedTuple

import numpy as np
import pandas as pd
from matplotlib.axes import Axes
from matplotlib.axis import Axis
from matplotlib.figure import Figure, SubFigure
from matplotlib.lines import Line2D
from matplotlib.patches import Rectangle
from matplotlib.ticker import MaxNLocator, SymmetricalLogLocator
from numpy.typing import ArrayLike, NDArray
from scipy.ndimage import label

from per_obspy.checks import FloatArray
from per_obspy.constants import METRES_PER_DEGREE
from per_obspy.report.results import Region
from per_obspy.report.style import (
    FAINT_COLOUR,
    MOTION_COLOUR,
    class_colours,
    literal,
    save,
    title_name,
)

IntArray = NDArray[np.int64]

#: Cells along the longer side of a region; pairs in cells that touch are one cluster.
CELLS = 24

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


def continuous(longitude: ArrayLike) -> FloatArray:
    """
    Return longitudes (degrees) without a step at the date line.

    Examples
    --------
    >>> print(continuous([179.5, -179.5]), continuous([-71.0, 10.0]))
    [179.5 180.5] [-71.  10.]
    """
    given = np.asarray(longitude, dtype=np.float64)
    if given.size == 0 or np.ptp(given) <= 180.0:
        return given
    return np.where(given < 0.0, given + 360.0, given)


def clusters(longitude: FloatArray, latitude: FloatArray, whole: Frame) -> list[IntArray]:
    """
    Separate points into clusters, in the order of their first points.

    A grid of ``CELLS`` cells covers the frame; points in cells that touch belong together.

    Parameters
    ----------
    longitude, latitude : (n_points,) ndarray
        Degrees, within the frame.
    whole : Frame
        The map.

    Returns
    -------
    members : list of ndarray of int
        Positions of the points of each cluster, ascending; the cluster of point 0 is the first.
    """
    cell = max(whole.size, SMALLEST) / CELLS / METRES_PER_DEGREE
    column = ((longitude - whole.west) * whole.stretch / cell).astype(np.int64)
    row = ((latitude - whole.south) / cell).astype(np.int64)
    occupied = np.zeros((row.max(initial=0) + 1, column.max(initial=0) + 1), dtype=bool)
    occupied[row, column] = True
    # Cells touch by sides and corners
    numbers, _ = label(occupied, structure=np.ones((3, 3)))
    found = numbers[row, column]
    order = list(dict.fromkeys(found.tolist()))
    return [np.flatnonzero(found == number).astype(np.int64) for number in order]


#: Clusters that have a map of their own, the worst ones.
SHOWN_CLUSTERS = 6

#: Pairs of a cluster that are hidden by each other on the map of the whole.
FEWEST = 5

#: A cluster this large relative to the whole map is visible there already.
LARGE = 0.6

#: Maps of clusters are drawn where one of them is smaller than this share of the whole map.
SMALL = 0.15

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


def draw_overview(table: pd.DataFrame, region: Region, path: Path) -> None:
    """
    Draw maps of the pairs and stations of a region, and gaps over demands where there are any.

    Towns that the map of a large region shows as dots are drawn at a scale of their own.

    Parameters
    ----------
    table : DataFrame
        ``risk_class, longitude, latitude`` of pairs, worst first, and ``pair_id``; ``demand`` and
        ``gap`` (m) where there are any.
    region : Region
        Title, classes, stations and epicentre.
    path : Path
        PNG file.
    """
    points = _points(table, region)
    found = _own_maps(points, _whole_frame(points, region))
    rows = -(-min(len(found), SHOWN_CLUSTERS) // 3)
    # Maps of clusters have rows of their own
    figure = Figure(figsize=(13.0, 6.2 + 3.8 * rows), layout="constrained")
    heights = [5.7, 3.8 * rows] if rows else [5.7]
    parts = np.array(figure.subfigures(len(heights), 1, height_ratios=heights)).ravel().tolist()
    whole = _draw_top(parts[0], table, region)
    if rows:
        _mark(whole, [frame for frame, _ in found])
        _draw_clusters(parts[1], table, region, points, found)
    # One legend and one title for everything
    _add_legend(figure, whole, table, region)
    figure.suptitle(title_name(region.title), parse_math=False)
    save(figure, path, region.simulated)


def _draw_top(figure: SubFigure, table: pd.DataFrame, region: Region) -> Axes:
    """Draw the map of the region, and gaps over demands where there are any; return the map."""
    has_gaps = "demand" in table
    panels = figure.subplots(1, 1 + has_gaps, squeeze=False).ravel()
    whole: Axes = panels[0]
    draw_map(whole, table, region)
    if has_gaps:
        _draw_gaps(panels[1], table, region.classes)
    return whole


def draw_map(axes: Axes, table: pd.DataFrame, region: Region, around_pairs: bool = False) -> None:
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
    around_pairs : bool
        Show the surroundings of the pairs only, without stations and an epicentre that are further
        away: a small map of a large region would hide all pairs behind one mark.
    """
    points = _points(table, region)
    seen = region._replace(stations=region.stations[:0], epicentre=None) if around_pairs else region
    frame = _whole_frame(points, seen)
    _draw_points(axes, points, frame)
    _draw_stations(axes, region, frame)
    axes.set_title(f"{len(table)} pairs shown", fontsize=11)
    axes.set(xlabel="longitude (°E)", ylabel="latitude (°N)")
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


def _own_maps(points: _Points, whole: Frame) -> list[tuple[Frame, IntArray]]:
    """Return frames and members of clusters too small on the whole map, worst first."""
    if not points.longitude.size:
        return []
    # Stations and epicentre may be far away: then one town has a map of its own too
    pairs_frame = frame_of(points.longitude, points.latitude)
    seen, first = whole, list[tuple[Frame, IntArray]]()
    if pairs_frame.size < SMALL * whole.size and points.longitude.size >= FEWEST:
        seen = pairs_frame.padded(MARGIN)
        first = [(seen, np.arange(points.longitude.size))]
    return _cluster_maps(points, pairs_frame, seen) or first


def _cluster_maps(points: _Points, pairs_frame: Frame, seen: Frame) -> list[tuple[Frame, IntArray]]:
    """Return frames and members of clusters too small on a map of all pairs, worst first."""
    # A few pairs do not hide each other
    every = clusters(points.longitude, points.latitude, pairs_frame)
    found = [members for members in every if members.size >= FEWEST]
    frames = [
        frame_of(points.longitude[members], points.latitude[members]).padded(MARGIN)
        for members in found
    ]
    pairs = list(zip(frames, found, strict=True))
    if not any(frame.size < SMALL * seen.size for frame in frames):
        return []
    return [pair for pair in pairs if pair[0].size < LARGE * seen.size]


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
    """Draw stations as small open triangles below the pairs, and the epicentre as a star."""
    outline: dict[str, Any] = {"facecolors": "none", "edgecolors": "black"}
    outline |= {"linewidths": 0.8, "zorder": 2}
    places = region.stations[["longitude", "latitude"]].to_numpy(dtype=np.float64)
    for marker, size, marks in (("^", 30.0, places), ("*", 130.0, _epicentre(region))):
        # Only those within the map, which they would widen otherwise
        east, north = _beside(marks[:, 0], 0.5 * (frame.west + frame.east)), marks[:, 1]
        inside = (east >= frame.west) & (east <= frame.east)
        inside &= (north >= frame.south) & (north <= frame.north)
        axes.scatter(east[inside], north[inside], marker=marker, s=size, **outline)


def _epicentre(region: Region) -> FloatArray:
    """Return the place of the epicentre, (1, 2) or (0, 2), degrees."""
    return np.array([region.epicentre] if region.epicentre else []).reshape(-1, 2)


def _beside(longitude: FloatArray, middle: float) -> FloatArray:
    """Return longitudes within 180 degrees of the middle of a map."""
    return np.asarray(middle + (longitude - middle + 180.0) % 360.0 - 180.0)


def _mark(axes: Axes, frames: Sequence[Frame]) -> None:
    """Outline the clusters with separate maps, and write their letters."""
    for letter, frame in zip(ascii_uppercase, frames[:SHOWN_CLUSTERS], strict=False):
        width, height = frame.east - frame.west, frame.north - frame.south
        corner = frame.west, frame.south
        axes.add_patch(Rectangle(corner, width, height, fill=False, linewidth=0.8, zorder=4))
        # Next to its corner, whatever the scale
        place: dict[str, Any] = {"xytext": (3.0, 3.0), "textcoords": "offset points"}
        axes.annotate(letter, (frame.east, frame.north), fontweight="bold", zorder=5, **place)


def _draw_clusters(
    figure: SubFigure,
    table: pd.DataFrame,
    region: Region,
    points: _Points,
    found: Sequence[tuple[Frame, IntArray]],
) -> None:
    """Draw the worst clusters, each with its number of pairs, its worst pair and a scale bar."""
    shown = found[:SHOWN_CLUSTERS]
    columns = min(len(shown), 3)
    panels = figure.subplots(-(-len(shown) // columns), columns, squeeze=False).ravel()
    # Places without a cluster stay empty
    for panel in panels[len(shown) :]:
        panel.set_axis_off()
    for letter, panel, (frame, members) in zip(ascii_uppercase, panels, shown, strict=False):
        _draw_points(panel, points.chosen(members), frame)
        _draw_stations(panel, region, frame)
        # Without coordinates, which the whole map has
        _add_scale_bar(panel, frame)
        worst = literal(str(table["pair_id"].iloc[int(members[0])]))[:30]
        panel.set_title(f"{letter}: {members.size} pairs, worst {worst}", fontsize=10)
        panel.set(xticks=[], yticks=[])
    if len(found) > len(shown):
        figure.suptitle(f"the worst {len(shown)} of {len(found)} places", fontsize=11)


def _add_scale_bar(axes: Axes, frame: Frame) -> None:
    """Add a bar of a round length, about a quarter of the map, below its lower edge."""
    quarter = 0.25 * frame.size
    unit = 10.0 ** np.floor(np.log10(quarter))
    length = unit * max(step for step in (1.0, 2.0, 5.0) if step * unit <= quarter)
    text = f"{length / 1000:g} km" if length >= 1000.0 else f"{length:g} m"
    # In the coordinates of the data, below the axes: it covers no pair
    degrees = length / METRES_PER_DEGREE / frame.stretch
    place = axes.get_xaxis_transform()
    line = [frame.west, frame.west + degrees], [-0.03, -0.03]
    axes.plot(*line, color="black", linewidth=2.0, transform=place, clip_on=False)
    axes.text(frame.west + 1.1 * degrees, -0.03, text, transform=place, va="center", fontsize=8)


def _add_legend(figure: Figure, axes: Axes, table: pd.DataFrame, region: Region) -> None:
    """Add one legend below all panels, where it covers neither data nor labels."""
    handles, counts = list[Line2D](), table["risk_class"].value_counts()
    # Classes that a pair has
    for name, colour in class_colours(region.classes).items():
        if count := int(counts.get(name, 0)):
            text = f"{literal(name)}: {count} pairs"
            style: dict[str, Any] = {"marker": "o", "linestyle": "", "color": colour}
            style |= {"markeredgecolor": "black", "markeredgewidth": 0.3}
            handles += axes.plot([], [], label=text, **style)
    # Stations and epicentre, where they are known
    marks = {"^": ("station", len(region.stations)), "*": ("epicentre", region.epicentre)}
    for marker, (name, present) in marks.items():
        if present:
            style = {"marker": marker, "linestyle": "", "color": "black"}
            handles += axes.plot([], [], markerfacecolor="none", label=name, **style)
    figure.legend(handles=handles, loc="outside lower left", ncols=4, fontsize=9, frameon=False)


def _draw_gaps(axes: Axes, table: pd.DataFrame, classes: Sequence[str]) -> None:
    """Draw gaps over demands, cm, in the colours of the classes, the worst on top."""
    colours = class_colours(classes)
    for name in reversed(colours):
        chosen = table[table["risk_class"] == name]
        axes.scatter(100 * chosen["demand"], 100 * chosen["gap"], s=6, color=colours[name])
    # The demand of the medians; the class is that of the whole population
    demand, gap = (100 * float(table[name].max()) for name in ("demand", "gap"))
    demand, gap = (value if np.isfinite(value) else 0.0 for value in (demand, gap))
    # Scales of both axes differ: equal values lie on a curve
    equal = np.linspace(0.0, demand, 500)
    axes.plot(equal, equal, color=MOTION_COLOUR, linewidth=0.8)
    # Next to its end, where no mark is hidden
    axes.annotate("gap = demand", (demand, demand), ha="right", va="bottom", fontsize=8)
    axes.set(xlabel="demand (cm)", ylabel="gap (cm)")
    axes.set_title("gap against demand; below the line it is too small", fontsize=11)
    _from_zero(axes.set_xscale, axes.set_xlim, axes.xaxis, demand)
    _from_zero(axes.set_yscale, axes.set_ylim, axes.yaxis, max(demand, gap))


def _from_zero(
    set_scale: Callable[..., object], set_limits: Callable[..., object], axis: Axis, largest: float
) -> None:
    """Make an axis linear up to 1, or to a tenth of a smaller largest value; logarithmic beyond."""
    linear = min(1.0, 0.1 * largest) if largest > 0 else 1.0
    set_scale("symlog", linthresh=linear)
    axis.set_major_locator(SymmetricalLogLocator(base=10.0, linthresh=linear, subs=(1.0, 2.0, 5.0)))
    set_limits(-0.1 * linear, 1.5 * max(largest, linear))
    axis.set_major_formatter("{x:g}")
