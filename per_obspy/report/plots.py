"""
Figures on matplotlib axes, for scripts and notebooks: spectra, one pair, a table of pairs.

Each function draws on the given axes, or on those of a new figure of pyplot, and returns them.
"""

from collections.abc import Iterator, Sequence
from typing import Any

import numpy as np
import pandas as pd
import xarray as xr
from matplotlib.axes import Axes
from matplotlib.patches import Circle

from per_obspy.config import Screening
from per_obspy.report.style import BUILDING_COLOURS, FAINT_COLOUR, class_colours, literal
from per_obspy.report.words import number

#: End of the title of a figure of simulated ground motion.
SIMULATED = "\nSIMULATED ground motion"


def plot_spectra(spectra: xr.Dataset, damping: float = 0.05, axes: Axes | None = None) -> Axes:
    """
    Plot the pseudo energy radius against the natural period.

    Parameters
    ----------
    spectra : Dataset
        Of one station, from :func:`per_obspy.station_spectra`: PER and SD of each component. Of
        several, from :func:`per_obspy.stream_spectra` or ``spectra.nc``: RotD50 of PER.
    damping : float
        Fraction of critical; the nearest stored damping is plotted.
    axes : Axes, optional
        Axes to draw on; if not given, those of a new figure.

    Returns
    -------
    Axes
        With periods in s and radii in m on logarithmic axes. Periods that the filter of a record
        leaves unusable are left out.

    Raises
    ------
    TypeError
        If the spectra are no Dataset.
    ValueError
        If the Dataset has neither PER by component nor RotD50.

    Examples
    --------
    >>> import numpy as np, per_obspy
    >>> from obspy import Trace
    >>> header = {"network": "XX", "station": "A", "channel": "HNE", "units": "m/s2"}
    >>> trace = Trace(np.sin(np.arange(2000) / 20), {**header, "delta": 0.005})
    >>> axes = per_obspy.plot_spectra(per_obspy.station_spectra(trace))
    >>> axes.get_ylabel()
    'radius, displacement (m)'
    """
    if not isinstance(spectra, xr.Dataset):
        raise TypeError(f"spectra must be a Dataset, got {type(spectra).__name__}")
    if not {"per", "per_rotd50"} & set(spectra):
        raise ValueError("spectra must have the variable per or per_rotd50, as of station_spectra")
    axes = axes or _new_axes()
    chosen = spectra.sel(damping=damping, method="nearest")
    # Unusable periods are NaN, which breaks the lines
    for label, curve in _curves(chosen):
        line = "--" if label.endswith("SD") else "-"
        axes.loglog(chosen["period"], curve, line, label=literal(label))
    axes.set(xlabel="natural period (s)", ylabel="radius, displacement (m)")
    # What is simulated says so
    note = SIMULATED * (spectra.attrs.get("simulated") == "true")
    axes.set_title(f"damping {float(chosen['damping']):.0%}{note}")
    axes.grid(which="both", alpha=0.25)
    axes.legend()
    return axes


def _curves(spectra: xr.Dataset) -> Iterator[tuple[str, xr.DataArray]]:
    """Yield label and values of each curve of spectra at one damping, m; NaN if unusable."""
    # Of several stations one curve each
    usable = spectra["usable"] == 1
    if "station" in spectra.dims:
        for name in spectra["station"].values:
            yield str(name), spectra["per_rotd50"].where(usable).sel(station=name)
        return
    for index, channel in enumerate(spectra["channel"].values):
        for name in ("per", "sd"):
            yield f"{channel} {name.upper()}", spectra[name].where(usable).isel(component=index)


def plot_pair(pair: "pd.Series[Any]", axes: Axes | None = None) -> Axes:
    """
    Plot the largest energy circles of both buildings of a pair, as far apart as the buildings are.

    Circles that overlap mean that both buildings could be in one place at some time; the pair hits
    where phases allow it.

    Parameters
    ----------
    pair : Series
        A row of a risk table, from :func:`per_obspy.risk_table` or :func:`per_obspy.screen`.
    axes : Axes, optional
        Axes to draw on; if not given, those of a new figure.

    Returns
    -------
    Axes
        With displacement at contact height and velocity over frequency, both in m. A dotted line
        is the gap that the pair needs; it is the only one where the gap is unknown.

    Raises
    ------
    TypeError
        If the pair is no row of a table.
    ValueError
        If the row has no radius or no demand, as that of an ensemble.

    Examples
    --------
    >>> import pandas as pd, per_obspy
    >>> row = {"pair_id": "a", "gap": 0.05, "demand": 0.08, "per_1": 0.04, "per_2": 0.06}
    >>> axes = per_obspy.plot_pair(pd.Series(row | {"participation_1": 1.4, "participation_2": 1}))
    >>> len(axes.patches)
    2
    """
    if not isinstance(pair, pd.Series):
        raise TypeError(f"pair must be a row of a risk table, got {type(pair).__name__}")
    radii = [_radius(pair, i) for i in (1, 2)]
    gap, needed = number(pair, "gap"), number(pair, "demand")
    if not np.isfinite([*radii, needed]).all():
        raise ValueError("pair must have demand, and participation and per or sd of both buildings")
    # Circles and faces, and where the second face would have to be
    axes = axes or _new_axes()
    _draw_circles(axes, radii, needed if np.isnan(gap) else gap)
    axes.axvline(needed, color="#444444", linestyle=":", label=f"gap needed, {needed:.3g} m")
    axes.set_title(_title(pair))
    # Both directions in the same length
    axes.set(xlabel="displacement at contact height (m)", ylabel="velocity / frequency (m)")
    axes.set_aspect("equal", adjustable="datalim")
    axes.autoscale_view()
    axes.legend(loc="upper right")
    return axes


def _title(pair: "pd.Series[Any]") -> str:
    """Return the name and the gap of a pair, and whether its motion is simulated."""
    gap, name = number(pair, "gap"), literal(str(pair.get("pair_id", "pair")))[:80]
    known = "gap unknown" if np.isnan(gap) else f"gap {gap:.3g} m"
    return f"{name}: {known}{_note(str(pair.get('flags', '')))}"


def _radius(pair: "pd.Series[Any]", i: int) -> float:
    """Return the PER of building i at contact height, or its SD where no record gives PER, m."""
    per, sd = number(pair, f"per_{i}"), number(pair, f"sd_{i}")
    return number(pair, f"participation_{i}") * (per if np.isfinite(per) else sd)


def _draw_circles(axes: Axes, radii: Sequence[float], apart: float) -> None:
    """Draw a circle of each building, m, and its face at rest; centres are so far apart, m."""
    for i, (centre, radius) in enumerate(zip((0.0, apart), radii, strict=True)):
        colour = BUILDING_COLOURS[i]
        circle = Circle((centre, 0.0), radius, facecolor=(colour, 0.18), edgecolor=colour)
        circle.set_label(f"building {i + 1}")
        axes.add_patch(circle)
        axes.axvline(centre, color=colour, linewidth=0.8)


def plot_risk(table: pd.DataFrame, axes: Axes | None = None) -> Axes:
    """
    Plot the pairs of a risk table on a map, in the colours of their risk classes.

    Parameters
    ----------
    table : DataFrame
        From :func:`per_obspy.risk_table` or :func:`per_obspy.screen`, or ``risk.parquet``, with
        ``longitude, latitude, risk_class``.
    axes : Axes, optional
        Axes to draw on; if not given, those of a new figure.

    Returns
    -------
    Axes
        With degrees east and north at equal scales; the legend counts the pairs of each class, and
        the worst ones are on top.

    Raises
    ------
    TypeError
        If the table is no DataFrame.
    ValueError
        If it lacks one of the columns.

    Examples
    --------
    >>> import pandas as pd, per_obspy
    >>> place = {"longitude": [36.9, 36.91], "latitude": [37.5, 37.5]}
    >>> axes = per_obspy.plot_risk(pd.DataFrame({**place, "risk_class": ["severe", "low"]}))
    >>> [text.get_text() for text in axes.get_legend().get_texts()]
    ['severe: 1', 'low: 1']
    """
    if not isinstance(table, pd.DataFrame):
        raise TypeError(f"table must be a DataFrame, got {type(table).__name__}")
    if absent := {"longitude", "latitude", "risk_class"} - set(table):
        raise ValueError(f"table must have the columns {', '.join(sorted(absent))}")
    axes = axes or _new_axes()
    _draw_classes(axes, table)
    # Flags of all pairs
    note = _note(" ".join(map(str, table.get("flags", []))))
    axes.set(xlabel="longitude (°E)", ylabel="latitude (°N)", title=f"{len(table)} pairs{note}")
    # A degree of longitude is shorter by the cosine of the latitude
    middle = float(np.clip(table["latitude"].mean(), -85.0, 85.0)) if len(table) else 0.0
    axes.set_aspect(1.0 / np.cos(np.radians(middle)), adjustable="datalim")
    axes.ticklabel_format(useOffset=False)
    if len(table):
        axes.legend()
    return axes


def _draw_classes(axes: Axes, table: pd.DataFrame) -> None:
    """Draw the pairs of each risk class at their places, degrees."""
    colours = class_colours(list(Screening().classes))
    # Worst classes first in the legend, last on the map
    groups = {str(name): pairs for name, pairs in table.groupby("risk_class")}
    names = sorted(groups, key=lambda name: ([*colours, name].index(name), name))
    for order, name in enumerate(names):
        axes.scatter(
            groups[name]["longitude"],
            groups[name]["latitude"],
            s=16,
            color=colours.get(name, FAINT_COLOUR),
            label=f"{literal(name)}: {len(groups[name])}",
            zorder=3.0 - order / 100.0,
        )


def _note(flags: str) -> str:
    """Return the end of a title if flags say that the motion is simulated."""
    return SIMULATED * ("simulated" in flags.split())


def _new_axes() -> Axes:
    """Return the axes of a new figure of pyplot, which notebooks show by themselves."""
    import matplotlib.pyplot as plt

    _, axes = plt.subplots(figsize=(6.4, 4.8), layout="constrained")
    return axes
