"""Figure of one pair: its record, the PER spectrum, and its energy circles at two gaps."""

from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd
import xarray as xr
from matplotlib.axes import Axes
from matplotlib.figure import Figure, SubFigure

from per_obspy.report.spectra import add_circle, record_date
from per_obspy.report.style import (
    BUILDING_COLOURS,
    FAINT_COLOUR,
    MOTION_COLOUR,
    save,
    title_name,
)
from per_obspy.report.words import length_text, number
from per_obspy.screening.values import motion_along

#: Why a pair is drawn that need not be the first.
DIFFERING = "the worst pair with a record whose two circles differ"

#: Circles of which one is larger than the other by less than this share look alike.
ALIKE = 0.05


def differing_pair(worst: pd.DataFrame) -> "pd.Series[Any] | None":
    """
    Return the worst pair with a record whose energy circles differ: equal ones explain nothing.

    Parameters
    ----------
    worst : DataFrame
        Rows of a risk table, worst first.

    Returns
    -------
    pair : Series or None
        The worst pair with a record where all circles are alike; None where no pair has a record.
    """
    if "station" not in worst:
        return None
    recorded = worst[worst["station"] != ""]
    if recorded.empty:
        return None
    # Circles at contact height, as the figure draws them
    one, two = (recorded[f"participation_{i}"] * recorded[f"per_{i}"] for i in (1, 2))
    differ = (one / two - 1.0).abs() > ALIKE
    pair: pd.Series[Any] = (recorded[differ] if differ.any() else recorded).iloc[0]
    return pair


def draw_record_to_pair(
    station: xr.Dataset, pair: pd.Series, path: Path, *, note: str = ""
) -> None:
    """
    Draw a record, its PER spectrum, and the energy circles of a pair in the state space.

    Parameters
    ----------
    station : Dataset
        From :func:`per_obspy.station_spectra`.
    pair : Series
        A row of the risk table that used this station.
    path : Path
        PNG file.
    note : str
        Why this pair is drawn, below the figure.
    """
    figure = Figure(figsize=(13.0, 5.0), layout="constrained")
    # Record and spectrum, then the circles
    left, right = np.array(figure.subfigures(1, 2, width_ratios=(2.1, 1.0))).tolist()
    motion, spectrum = left.subplots(1, 2, width_ratios=(1.15, 1.0))
    _draw_motion(motion, station, float(pair["azimuth_used"]))
    _draw_spectrum(spectrum, station, pair)
    _draw_two_gaps(right, pair, "3  ")
    if note:
        figure.supxlabel(note, x=0.01, ha="left", fontsize=8, color=MOTION_COLOUR)
    save(figure, path, station.attrs["simulated"] == "true")


def draw_pair_alone(pair: pd.Series, simulated: bool, path: Path) -> None:
    """
    Draw the circles of a pair without a record: by a design spectrum or a ShakeMap.

    Parameters
    ----------
    pair : Series
        A row of the table.
    simulated : bool
        Whether the ground motion is simulated.
    path : Path
        PNG file.
    """
    figure = Figure(figsize=(5.5, 5.5), layout="constrained")
    (part,) = np.array(figure.subfigures(1, 1)).ravel().tolist()
    _draw_two_gaps(part, pair, "")
    save(figure, path, simulated)


def _draw_motion(axes: Axes, station: xr.Dataset, azimuth: float) -> None:
    """Draw the acceleration along an azimuth during the strong motion."""
    motion, time = motion_along(station, azimuth), station["time"].to_numpy()
    axes.plot(time, motion, color=MOTION_COLOUR, linewidth=0.5)
    # Pads and quiet ends are left out: 0.1 to 99.9 % of the squared acceleration
    energy = np.cumsum(motion**2)
    start, end = np.interp([0.001, 0.999], energy / energy[-1], time)
    axes.set_xlim(start - 5.0, end + 5.0)
    along = "" if np.isnan(azimuth) else f", along {azimuth:.0f}°"
    axes.set(xlabel="time (s)", ylabel="ground acceleration (m/s²)")
    name = title_name(station["station"].item())
    title = f"1  record {name}\n{record_date(station)}{along}"
    axes.set_title(title, fontsize=11, parse_math=False)


def _draw_spectrum(axes: Axes, station: xr.Dataset, pair: pd.Series) -> None:
    """Draw the stored spectrum at the damping nearest to the pair's, and the radii of the pair."""
    by_azimuth = "per_rotd100" in station
    stored = station["per_rotd100"] if by_azimuth else station["per"].isel(component=0)
    spectrum = stored.sel(damping=pair["damping_1"], method="nearest")

    # Periods outside the usable ones are dotted
    period, usable = station["period"], station["usable"].to_numpy() == 1
    label = "PER, largest over azimuth" if by_azimuth else "PER"
    axes.loglog(period, spectrum, color=FAINT_COLOUR, linestyle=":")
    axes.loglog(period[usable], spectrum[usable], color=MOTION_COLOUR, label=label)
    axes.set_title(f"2  PER spectrum\ndamping {float(spectrum['damping']):.0%}", fontsize=11)
    _draw_radii(axes, pair)


def _draw_radii(axes: Axes, pair: pd.Series) -> None:
    """Draw the radii of the pair, computed at the periods and dampings of its buildings."""
    for i, colour in enumerate(BUILDING_COLOURS, start=1):
        text = f"building {i}: T = {pair[f'period_{i}']:.2f} s"
        # At contact height a radius is this times its participation
        axes.plot(pair[f"period_{i}"], pair[f"per_{i}"], "o", color=colour, label=text)
    axes.set(xlabel="natural period (s)", ylabel="pseudo energy radius (m)")
    # Numbers as people write them; powers of ten are typeset as formulas, which takes longer
    for axis in (axes.xaxis, axes.yaxis):
        axis.set_major_formatter("{x:g}")
    axes.legend(fontsize=8, loc="lower right")


def _draw_two_gaps(figure: SubFigure, pair: pd.Series, number_text: str) -> None:
    """Draw the circles at the actual gap and at the needed gap (Fig. 4)."""
    needed, gap = number(pair, "demand"), number(pair, "gap")
    has, needs = figure.subplots(2, 1)
    # Where the gap is unknown there is one picture only
    if np.isnan(gap):
        has.set_axis_off()
    else:
        _draw_circles(has, pair, gap, max(gap, needed))
        has.set_title(f"at the gap there is: {length_text(gap)}", fontsize=10)
    _draw_circles(needs, pair, needed, needed if np.isnan(gap) else max(gap, needed))
    needs.set_title(f"at the gap needed: {length_text(needed)}", fontsize=10)
    needs.set_xlabel("displacement at contact height (cm)")
    # One label and one legend for both pictures
    figure.supylabel("velocity / frequency (cm)", fontsize=10)
    handles, labels = needs.get_legend_handles_labels()
    figure.legend(handles, labels, fontsize=8, loc="outside lower center", ncols=2, frameon=False)
    figure.suptitle(f"{number_text}{_pair_title(pair)}", fontsize=11, parse_math=False)


def _pair_title(pair: pd.Series) -> str:
    """Return the name of a pair and its rank, if it has one."""
    rank = f", rank {pair['rank']:.0f}" if "rank" in pair else ""
    return f"pair {title_name(str(pair['pair_id']))}{rank}"


def _draw_circles(axes: Axes, pair: pd.Series, apart: float, widest: float) -> None:
    """Draw the largest energy circle of each building, cm, at centres ``apart`` (m)."""
    # Dashes for the second building, as equal circles touch all around
    for i, (centre, line) in enumerate(((0.0, "-"), (100.0 * apart, "--")), start=1):
        colour = BUILDING_COLOURS[i - 1]
        radius = 100.0 * pair[f"participation_{i}"] * _radius(pair, i)
        angle = np.linspace(0.0, 2.0 * np.pi, 361)
        # The outline is a separate line, so that it is opaque
        x, y = centre + radius * np.cos(angle), radius * np.sin(angle)
        axes.fill(x, y, color=colour, alpha=0.18)
        add_circle(axes, radius, colour, f"building {i}", centre, line)
        # Its face at rest
        axes.axvline(centre, color=colour, linewidth=0.8, linestyle=line)
    # Both pictures have room for the wider gap, and so the same scale
    axes.update_datalim([(100.0 * widest + radius, 0.0)])
    axes.set_aspect("equal", adjustable="datalim")


def _radius(pair: pd.Series, i: int) -> float:
    """Return the PER of building i, or its SD where no record gives PER, m."""
    radius = number(pair, f"per_{i}")
    return radius if np.isfinite(radius) else number(pair, f"sd_{i}")
