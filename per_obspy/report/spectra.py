"""Figures of one station: its spectra, and the state-space trace of one oscillator."""

from collections.abc import Sequence
from pathlib import Path

import numpy as np
import xarray as xr
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from per_obspy.checks import FloatArray
from per_obspy.constants import STANDARD_GRAVITY, UNSET_DAYS
from per_obspy.report.style import MOTION_COLOUR, literal, save, title_name
from per_obspy.spectra.bilinear import bilinear_response

#: Colours of components, in their order (Okabe & Ito 2008).
COMPONENT_COLOURS = ("#0072B2", "#D55E00", "#009E73")


def draw_spectra(station: xr.Dataset, damping: float, path: Path) -> None:
    """
    Draw PER and SD, SA, pseudo-velocity and PER/SD of every component of a station at one damping.

    Parameters
    ----------
    station : Dataset
        From :func:`per_obspy.station_spectra`.
    damping : float
        Fraction of critical; the nearest that is stored is drawn.
    path : Path
        PNG file.
    """
    chosen = station.sel(damping=damping, method="nearest")
    figure = Figure(figsize=(11.0, 8.0), layout="constrained")
    panels = radius, acceleration, velocity, ratio = figure.subplots(2, 2).ravel()
    # More components than colours begin again
    for index, channel in enumerate(station["channel"].to_numpy()):
        name = literal(str(channel))
        colour = COMPONENT_COLOURS[index % len(COMPONENT_COLOURS)]
        _draw_component(panels, chosen, index, name, colour)

    # SA is absolute, the pseudo-velocity is that of SD
    radius.set(ylabel="radius, displacement (m)")
    acceleration.set(ylabel="absolute acceleration SA (g)")
    velocity.set(ylabel="pseudo-velocity (m/s)")
    ratio.set(ylabel="PER / SD (1)")
    for axes in panels:
        axes.set_xlabel("natural period (s)")
        axes.grid(which="both", alpha=0.25)
        axes.legend(fontsize=8)

    _write_title(figure, station, chosen)
    save(figure, path, station.attrs["simulated"] == "true")


def _write_title(figure: Figure, station: xr.Dataset, chosen: xr.Dataset) -> None:
    """Write station, date and the damping of the stored spectra above a figure."""
    facts = f"damping {float(chosen['damping']):.0%}, usable periods only"
    name = title_name(str(station["station"].item()))
    figure.suptitle(f"{name}, {record_date(station)}\n{facts}", parse_math=False)


def record_date(station: xr.Dataset) -> str:
    """Return day and time of the start of a station's record, as far as known."""
    start = str(station.attrs.get("time_coverage_start", ""))[:16]
    # Clocks that were never set stand at one of these days
    unset = {f"{year:04}-{month:02}-{day:02}" for year, month, day in UNSET_DAYS}
    is_known = start and start[:10] not in unset
    return f"{start.replace('T', ' ')} UTC" if is_known else "date unknown"


def _draw_component(
    panels: Sequence[Axes], spectra: xr.Dataset, index: int, name: str, colour: str
) -> None:
    """Draw PER and SD, SA, pseudo-velocity and PER/SD of one component at usable periods."""
    radius, acceleration, velocity, ratio = panels
    period = spectra["period"].to_numpy()
    usable = np.where(spectra["usable"] == 1, 1.0, np.nan)
    per, sd = spectra["per"][index].to_numpy(), spectra["sd"][index].to_numpy()
    # Unusable periods are NaN, which breaks the lines
    radius.loglog(period, per * usable, color=colour, label=f"{name} PER")
    radius.loglog(period, sd * usable, color=colour, linestyle="--", label=f"{name} SD")
    # SA in g, as hazard maps have it
    in_g = spectra["sa"][index].to_numpy() / STANDARD_GRAVITY
    acceleration.loglog(period, in_g * usable, color=colour, label=name)
    velocity.loglog(period, 2.0 * np.pi / period * sd * usable, color=colour, label=name)
    ratio.semilogx(period, per / sd * usable, color=colour, label=name)


def draw_state_space(station: xr.Dataset, period: float, damping: float, path: Path) -> None:
    """
    Draw the motion of one oscillator in its state space, and its PER circle.

    The state space is the plane of displacement and velocity over frequency. The motion is that of
    the component with the largest peak acceleration.

    Parameters
    ----------
    station : Dataset
        From :func:`per_obspy.station_spectra`, with its motion.
    period, damping : float
        Undamped period of the oscillator, s, and its damping, fraction of critical.
    path : Path
        PNG file.

    References
    ----------
    Valles-Mattox & Reinhorn (1996), 11WCEE, Fig. 2a.
    """
    # An infinite yield displacement leaves the oscillator linear
    motions = station["acceleration"].to_numpy()
    strongest = int(np.abs(motions).max(axis=1).argmax())
    dt = float(station["sampling_interval"])
    motion = bilinear_response(motions[strongest], dt, period, damping, np.inf, 0.0)
    figure = Figure(figsize=(5.5, 5.5), layout="constrained")
    axes = figure.subplots()
    add_state_space(axes, motion.displacement, motion.velocity, period)
    # A record is named by its station, channel and day
    name = f"{station['station'].item()} {station['channel'].values[strongest]}"
    title = f"{title_name(name)}, {record_date(station)}\nT = {period:g} s, ξ = {damping:g}"
    axes.set_title(title, fontsize=11, parse_math=False)
    axes.legend(fontsize=9, loc="upper right")
    save(figure, path, station.attrs["simulated"] == "true")


def add_state_space(
    axes: Axes, displacement: FloatArray, velocity: FloatArray, period: float
) -> None:
    """
    Add the motion of one oscillator in the state space, and its PER circle.

    Parameters
    ----------
    axes : Axes
        Axes to draw on.
    displacement, velocity : (n_time,) ndarray
        Relative to the ground, m and m/s.
    period : float
        Undamped, s.
    """
    # PER is the largest distance from the origin
    scaled_velocity = velocity * period / (2.0 * np.pi)
    radius = float(np.max(np.hypot(displacement, scaled_velocity)))
    axes.plot(displacement, scaled_velocity, color=MOTION_COLOUR, linewidth=0.6)
    add_circle(axes, radius, COMPONENT_COLOURS[1], f"PER = {radius:.3g} m")
    axes.set_aspect("equal", adjustable="datalim")
    axes.set(xlabel="displacement (m)", ylabel="velocity / frequency (m)")


def add_circle(
    axes: Axes, radius: float, colour: str, label: str, centre: float = 0.0, style: str = "-"
) -> None:
    """
    Add a circle of constant energy to a state space.

    Parameters
    ----------
    axes : Axes
        Axes to draw on.
    radius, centre : float
        Radius of the circle and its centre along the displacement, m.
    colour, label, style : str
        Colour, label and style of its line.
    """
    angle = np.linspace(0.0, 2.0 * np.pi, 361)
    x, y = centre + radius * np.cos(angle), radius * np.sin(angle)
    axes.plot(x, y, color=colour, linestyle=style, label=label)
