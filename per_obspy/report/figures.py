"""Figures of a run: from one record to one pair at risk, and an overview of the region."""

from collections.abc import Callable
from pathlib import Path

import numpy as np
import pandas as pd
import xarray as xr
from matplotlib.axes import Axes
from matplotlib.axis import Axis
from matplotlib.figure import Figure

from per_obspy.checks import FloatArray
from per_obspy.report.spectra import add_circle
from per_obspy.report.style import (
    BUILDING_COLOURS,
    FAINT_COLOUR,
    MOTION_COLOUR,
    STATE_COLOURS,
    UNKNOWN_COLOUR,
    fit_titles,
    save,
    title_name,
)
from per_obspy.screening.ranking import STATES, UNKNOWN_STATE
from per_obspy.screening.values import components

#: States in the order in which they are drawn: the likeliest on top.
DRAWN_STATES = (UNKNOWN_STATE, *reversed(STATES))

#: Colour of every state.
COLOURS = STATE_COLOURS | {UNKNOWN_STATE: UNKNOWN_COLOUR}


def draw_record_to_pair(station: xr.Dataset, pair: pd.Series, path: Path) -> None:
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
    """
    figure = Figure(figsize=(13.0, 4.0), layout="constrained")
    motion, spectrum, circles = figure.subplots(1, 3, width_ratios=(1.15, 1.0, 1.15))
    _draw_motion(motion, station, float(pair["azimuth_used"]))
    _draw_spectrum(spectrum, station, pair)
    _draw_circles(circles, pair)
    # Long names make titles wide
    fit_titles(figure)
    save(figure, path, station.attrs["simulated"] == "true")


def motion_along(station: xr.Dataset, azimuth: float) -> FloatArray:
    """Return the acceleration along an azimuth (degrees), or that of the only sensor, m/s²."""
    north, east, _ = components(station)
    angle = np.radians(azimuth) if station.sizes["horizontal"] == 2 else 0.0
    along: FloatArray = north * np.cos(angle) + east * np.sin(angle)
    return along


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
    axes.set_title(f"1  record {name}{along}", fontsize=11, parse_math=False)


def _draw_spectrum(axes: Axes, station: xr.Dataset, pair: pd.Series) -> None:
    """Draw the stored spectrum at the damping nearest to the pair's, and the pair's own radii."""
    by_azimuth = "per_rotd100" in station
    stored = station["per_rotd100"] if by_azimuth else station["per"].isel(component=0)
    spectrum = stored.sel(damping=pair["damping_1"], method="nearest")

    # Periods outside the usable ones are dotted
    period, usable = station["period"], station["usable"].to_numpy() == 1
    label = "PER, largest over azimuth" if by_azimuth else "PER"
    axes.loglog(period, spectrum, color=FAINT_COLOUR, linestyle=":")
    axes.loglog(period[usable], spectrum[usable], color=MOTION_COLOUR, label=label)

    # The pair is computed at its own periods and dampings
    for i, colour in enumerate(BUILDING_COLOURS, start=1):
        text = f"building {i}: T = {pair[f'period_{i}']:.2f} s"
        axes.plot(pair[f"period_{i}"], pair[f"per_{i}"], "o", color=colour, label=text)
    axes.set(xlabel="natural period (s)", ylabel="pseudo energy radius (m)")
    axes.set_title("2  PER spectrum", fontsize=11)
    axes.legend(fontsize=8, loc="lower right")


def _draw_circles(axes: Axes, pair: pd.Series) -> None:
    """Draw the largest energy circle of each building, a gap apart (the paper's Fig. 4)."""
    # Dashes for the second building, as equal circles touch all around
    _draw_circle(axes, pair, 1, centre=0.0, line="-")
    # where the gap is unknown, as far apart as is needed
    known = not np.isnan(pair["gap"])
    apart = pair["gap"] if known else pair["demand"]
    _draw_circle(axes, pair, 2, centre=apart, line="--")

    # The faces of both buildings at rest
    axes.axvline(0.0, color=BUILDING_COLOURS[0], linewidth=0.8)
    axes.axvline(apart, color=BUILDING_COLOURS[1], linewidth=0.8)
    axes.set_aspect("equal", adjustable="datalim")
    axes.set(xlabel="displacement at contact height (m)", ylabel="velocity / frequency (m)")
    gap = f"gap {100 * pair['gap']:.0f} cm" if known else "gap unknown"
    verdict = f"{gap}, needed {100 * pair['demand']:.0f} cm"
    name = title_name(str(pair["pair_id"]))
    axes.set_title(f"3  pair {name}\n{verdict}", fontsize=11, parse_math=False)
    axes.legend(fontsize=8, loc="upper right")


def _draw_circle(axes: Axes, pair: pd.Series, i: int, centre: float, line: str) -> None:
    """Draw the largest energy circle of building i, filled."""
    colour = BUILDING_COLOURS[i - 1]
    radius = pair[f"participation_{i}"] * pair[f"per_{i}"]
    angle = np.linspace(0.0, 2.0 * np.pi, 361)
    # The outline is a separate line, so that it is opaque
    x, y = centre + radius * np.cos(angle), radius * np.sin(angle)
    axes.fill(x, y, color=colour, alpha=0.18)
    add_circle(axes, radius, colour, f"building {i}", centre, line)


def draw_overview(table: pd.DataFrame, spectra: xr.Dataset, title: str, path: Path) -> None:
    """
    Draw a map of the pairs and stations of a region, and gaps over demands.

    Parameters
    ----------
    table : DataFrame
        From :func:`per_obspy.risk_table`.
    spectra : Dataset
        From :func:`per_obspy.spectra.storage.region`.
    title : str
        Name of the run.
    path : Path
        PNG file.
    """
    figure = Figure(figsize=(13.0, 5.5), layout="constrained")
    place, gaps = figure.subplots(1, 2)
    _draw_map(place, table, spectra)
    _draw_gaps(gaps, table)
    figure.suptitle(title_name(title), parse_math=False)
    fit_titles(figure)
    save(figure, path, spectra.attrs.get("simulated") == "true")


def _draw_map(axes: Axes, table: pd.DataFrame, spectra: xr.Dataset) -> None:
    """Draw pairs in the colours of their states, and stations."""
    # states that a pair has
    drawn = [state for state in DRAWN_STATES if state in set(table["state"])]
    for state in drawn:
        chosen = table[table["state"] == state]
        colour, label = COLOURS[state], f"{len(chosen)} pairs: {state}"
        axes.scatter(chosen["longitude"], chosen["latitude"], s=5, color=colour, label=label)
    axes.scatter(
        spectra["longitude"], spectra["latitude"], marker="^", s=45, color="black", label="stations"
    )
    # A degree of longitude is shorter by the cosine of the latitude
    axes.set_aspect(1.0 / np.cos(np.radians(float(table["latitude"].mean()))))
    axes.set(xlabel="longitude (°E)", ylabel="latitude (°N)", title="pounding")
    axes.locator_params(nbins=6)
    axes.ticklabel_format(useOffset=False)
    axes.legend(fontsize=8)


def _draw_gaps(axes: Axes, table: pd.DataFrame) -> None:
    """Draw gaps over demands, cm, in the colours of the states."""
    for state in DRAWN_STATES:
        chosen = table[table["state"] == state]
        axes.scatter(100 * chosen["demand"], 100 * chosen["gap"], s=6, color=COLOURS[state])
    # The demand of the medians; the state is that of the whole population
    demand, gap = 100 * float(table["demand"].max()), 100 * float(table["gap"].max())
    axes.plot([0.0, demand], [0.0, demand], color="black", linewidth=0.8, label="gap = demand")
    axes.set(xlabel="demand (cm)", ylabel="gap (cm)", title="gap against demand")
    _from_zero(axes.set_xscale, axes.set_xlim, axes.xaxis, demand)
    _from_zero(axes.set_yscale, axes.set_ylim, axes.yaxis, max(demand, gap))
    axes.legend(fontsize=8)


def _from_zero(
    set_scale: Callable[..., object], set_limits: Callable[..., object], axis: Axis, largest: float
) -> None:
    """Make an axis linear up to 1, or to a tenth of a smaller largest value; logarithmic beyond."""
    linear = min(1.0, 0.1 * largest) if largest > 0 else 1.0
    set_scale("symlog", linthresh=linear)
    set_limits(-0.1 * linear, 1.5 * max(largest, linear))
    axis.set_major_formatter("{x:g}")
