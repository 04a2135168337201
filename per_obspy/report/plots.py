"""
Figures on matplotlib axes, for scripts and notebooks: spectra, one pair, a table of pairs.

Each function draws on the given axes, or on those of a new figure of pyplot, and returns them.
"""

import numpy as np
import pandas as pd
import xarray as xr
from matplotlib.axes import Axes
from matplotlib.patches import Circle

from per_obspy.config import Screening
from per_obspy.report.style import BUILDING_COLOURS, FAINT_COLOUR, class_colours, literal
from per_obspy.report.words import number
from per_obspy.screening.unknown_gaps import UNKNOWN_CLASS

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
    axes = _new_axes() if axes is None else axes
    chosen = spectra.sel(damping=damping, method="nearest")
    usable = chosen["usable"] == 1
    if "station" in chosen.dims:
        radius = chosen["per_rotd50"].where(usable)
        curves = [(name, "-", radius.sel(station=name)) for name in chosen["station"].values]
    else:
        curves = [
            (f"{channel} {name.upper()}", line, chosen[name].where(usable).isel(component=index))
            for index, channel in enumerate(chosen["channel"].values)
            for name, line in (("per", "-"), ("sd", "--"))
        ]
    for label, line, curve in curves:
        axes.loglog(chosen["period"], curve, line, label=literal(str(label)))
    axes.set(xlabel="natural period (s)", ylabel="radius, displacement (m)")
    is_simulated = str(spectra.attrs.get("simulated", "")) == "true"
    axes.set_title(f"damping {float(chosen['damping']):.0%}{SIMULATED * is_simulated}")
    axes.grid(which="both", alpha=0.25)
    axes.legend()
    return axes


def plot_pair(pair: "pd.Series[object]", axes: Axes | None = None) -> Axes:
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
    # SD where no record gives PER
    radii = list[float]()
    for i in (1, 2):
        per, sd = number(pair, f"per_{i}"), number(pair, f"sd_{i}")
        radii.append(number(pair, f"participation_{i}") * (per if np.isfinite(per) else sd))
    gap, needed = number(pair, "gap"), number(pair, "demand")
    if not np.isfinite([*radii, needed]).all():
        raise ValueError(
            "pair must have demand, participation_1 and _2, per_1 and _2 or sd_1 and _2"
        )
    axes = _new_axes() if axes is None else axes
    centres = (0.0, needed if np.isnan(gap) else gap)
    for i, (centre, radius, colour) in enumerate(
        zip(centres, radii, BUILDING_COLOURS, strict=True), start=1
    ):
        label = f"building {i}"
        circle = Circle((centre, 0.0), radius, facecolor=(colour, 0.18), edgecolor=colour)
        circle.set_label(label)
        axes.add_patch(circle)
        axes.axvline(centre, color=colour, linewidth=0.8)
    axes.axvline(needed, color="#444444", linestyle=":", label=f"gap needed, {needed:.3g} m")
    known = "gap unknown" if np.isnan(gap) else f"gap {gap:.3g} m"
    note = SIMULATED * ("simulated" in str(pair.get("flags", "")).split())
    axes.set_title(f"{literal(str(pair.get('pair_id', 'pair')))[:80]}: {known}{note}")
    axes.set(xlabel="displacement at contact height (m)", ylabel="velocity / frequency (m)")
    axes.set_aspect("equal", adjustable="datalim")
    axes.autoscale_view()
    axes.legend(loc="upper right")
    return axes


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
    axes = _new_axes() if axes is None else axes
    known = [name for name in Screening().classes if (table["risk_class"] == name).any()]
    others = [name for name in table["risk_class"].unique() if name not in known]
    colours = class_colours(list(Screening().classes))
    # Worst classes first in the legend, last on the map
    names = [*known, *sorted(others, key=lambda name: name == UNKNOWN_CLASS)]
    for order, name in enumerate(names):
        pairs = table[table["risk_class"] == name]
        axes.scatter(
            pairs["longitude"],
            pairs["latitude"],
            s=16,
            color=colours.get(name, FAINT_COLOUR),
            label=f"{literal(str(name))}: {len(pairs)}",
            zorder=3.0 - order / 100.0,
        )
    flags = table["flags"].astype(str) if "flags" in table else pd.Series(dtype=str)
    note = SIMULATED * bool(flags.str.contains(r"\bsimulated\b").any())
    axes.set(xlabel="longitude (°E)", ylabel="latitude (°N)", title=f"{len(table)} pairs{note}")
    # A degree of longitude is shorter by the cosine of the latitude
    middle = float(np.clip(table["latitude"].mean(), -85.0, 85.0)) if len(table) else 0.0
    axes.set_aspect(1.0 / np.cos(np.radians(middle)), adjustable="datalim")
    axes.ticklabel_format(useOffset=False)
    if names:
        axes.legend()
    return axes


def _new_axes() -> Axes:
    """Return the axes of a new figure of pyplot, which notebooks show by themselves."""
    import matplotlib.pyplot as plt

    _, axes = plt.subplots(figsize=(6.4, 4.8), layout="constrained")
    return axes
