"""
Figures of the paper, redrawn: one function per figure, which draws given values.

References
----------
Valles-Mattox & Reinhorn (1996), An energy approach to pounding of structures, 11WCEE.
"""

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import NamedTuple

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.ticker import ScalarFormatter

from per_obspy.checks import FloatArray
from per_obspy.pounding.reliability import SingleHitComparison, amplifications, summary
from per_obspy.pounding.row_history import PoundingHistory
from per_obspy.pounding.single_hit import SingleHit
from per_obspy.report.spectra import COMPONENT_COLOURS, add_circle, add_state_space
from per_obspy.report.style import BUILDING_COLOURS, MOTION_COLOUR, save


class Sheet(NamedTuple):
    """Common content of the figures of a record: title, PNG file, whether it is simulated."""

    title: str
    path: Path
    simulated: bool


class Pair(NamedTuple):
    """Two linear structures: periods (s), radii without pounding (m), critical gap (m), gap (m)."""

    periods: tuple[float, float]
    per: tuple[float, float]
    critical_gap: float
    gap: float


def draw_energy_exchange(history: PoundingHistory, sheet: Sheet) -> None:
    """
    Draw Fig. 1: input and structural energy of two structures that hit each other.

    Parameters
    ----------
    history : PoundingHistory
        Of two structures.
    sheet : Sheet
        Title and file.
    """
    figure, panels = _figure(sheet, 1, 2, 11.0, 4.0)
    energies = history.energies
    shaking = _shaking(history.time, energies.input[0])
    label = "transfer energy: gained above the input, lost below"
    for i, axes in enumerate(panels):
        structural = energies.kinetic[i] + energies.damping[i] + energies.elastic[i]
        colour = BUILDING_COLOURS[i]
        axes.plot(history.time, energies.input[i] / 1e3, color=MOTION_COLOUR, label="input energy")
        axes.plot(history.time, structural / 1e3, color=colour, label="structural energy")
        axes.fill_between(
            history.time,
            energies.input[i] / 1e3,
            structural / 1e3,
            color=colour,
            alpha=0.2,
            label=label,
        )
        axes.set(xlim=shaking, xlabel="time (s)", ylabel="energy (kJ)", title=f"structure {i + 1}")
        axes.legend(fontsize=8, loc="lower right")
    save(figure, sheet.path, sheet.simulated)


def draw_radius_and_energies(
    history: PoundingHistory, period: float, mass: float, sheet: Sheet
) -> None:
    """
    Draw Fig. 2 for the first structure: (a) state space with PER circle, (b) energies over time.

    Parameters
    ----------
    history : PoundingHistory
        Without impacts.
    period, mass : float
        Of the structure, s and kg.
    sheet : Sheet
        Title and file.
    """
    figure, (states, over_time) = _figure(sheet, 1, 2, 11.5, 5.0)
    add_state_space(states, history.displacement[0], history.velocity[0], period)
    states.set_title("(a) state space")
    states.legend(fontsize=9, loc="upper right")
    energies, level = history.energies, 2.0 * mass * (np.pi * history.per[0] / period) ** 2
    curves = {"input": energies.input[0], "viscous": energies.damping[0]}
    curves["kinetic and potential"] = energies.kinetic[0] + energies.elastic[0]
    for (label, energy), colour in zip(curves.items(), COMPONENT_COLOURS, strict=True):
        over_time.plot(history.time, energy / 1e3, color=colour, label=label)
    over_time.axhline(level / 1e3, color="black", linestyle="--", label="energy of the PER circle")
    over_time.set(
        xlim=_shaking(history.time, energies.input[0]), xlabel="time (s)", ylabel="energy (kJ)"
    )
    over_time.set_title("(b) energies: only the radius is tied to the peaks")
    over_time.legend(fontsize=9)
    save(figure, sheet.path, sheet.simulated)


def draw_per_spectra(
    periods: FloatArray, dampings: Sequence[float], per: FloatArray, sheet: Sheet
) -> None:
    """
    Draw Fig. 3: the PER spectrum of a record at several dampings.

    Parameters
    ----------
    periods : (n_periods,) ndarray
        s.
    dampings : sequence of float
        Fractions of critical.
    per : (n_damping, n_periods) ndarray
        m.
    sheet : Sheet
        Title and file.
    """
    figure, (axes,) = _figure(sheet, 1, 1, 7.0, 4.6)
    for shade, damping, spectrum in zip(_shades(len(dampings)), dampings, per, strict=True):
        axes.plot(periods, spectrum, color=shade, label=f"damping {damping:.0%}")
    axes.set(
        xlim=(0.0, periods[-1]),
        ylim=(0.0, None),
        xlabel="natural period (s)",
        ylabel="pseudo energy radius (m)",
    )
    axes.grid(alpha=0.25)
    axes.legend(fontsize=9)
    save(figure, sheet.path, sheet.simulated)


def draw_critical_gaps(
    cases: Sequence[tuple[Pair, float, PoundingHistory, SingleHit]], sheet: Sheet
) -> None:
    """
    Draw Fig. 4: energy circles of pairs at their critical gaps, with the onset of pounding.

    Parameters
    ----------
    cases : sequence of (Pair, float, PoundingHistory, SingleHit)
        Pair at its critical gap, correlation, history without impacts, and single hit at the
        critical gap but for rounding: its states are the onset.
    sheet : Sheet
        Title and file.
    """
    figure, panels = _figure(sheet, 2, (len(cases) + 1) // 2, 9.5, 8.0)
    for axes, (pair, correlation, history, onset) in zip(panels, cases, strict=True):
        for i, (centre, colour) in enumerate(zip((0.0, pair.gap), BUILDING_COLOURS, strict=True)):
            frequency = 2.0 * np.pi / pair.periods[i]
            across, up = centre + history.displacement[i], history.velocity[i] / frequency
            axes.plot(across, up, color=colour, linewidth=0.35, alpha=0.7)
            add_circle(axes, pair.per[i], colour, "", centre)
            place = getattr(onset.branches, f"displacement_{i + 1}")[0] + centre
            height = getattr(onset.branches, f"velocity_{i + 1}")[0] / frequency
            axes.plot(
                [place, place],
                [-height, height],
                "o",
                color=colour,
                markeredgecolor="black",
                zorder=3,
            )
        periods = "T = {:.2f} s and {:.2f} s".format(*pair.periods)
        axes.set_title(
            f"{periods}: ρ = {correlation:.2f}, critical gap {pair.gap:.3f} m", fontsize=9
        )
        _label_state_space(axes)
    save(figure, sheet.path, sheet.simulated)


def draw_single_hit(hit: SingleHit, pair: Pair, sheet: Sheet) -> None:
    """
    Draw Fig. 5: grazing state, actual contact, impact and radius after it, for both branches.

    Parameters
    ----------
    hit : SingleHit
        Of one pair.
    pair : Pair
        The same pair.
    sheet : Sheet
        Title and file.
    """
    figure, panels = _figure(sheet, 2, 2, 9.0, 9.4)
    for branch, moving in enumerate(("moving towards 2", "moving towards 1")):
        for i in (0, 1):
            radius = _draw_hit(panels[2 * branch + i], hit, pair, i, branch)
            radii = f"{pair.per[i]:.3g} m becomes {radius:.3g} m"
            panels[2 * branch + i].set_title(f"structure {i + 1}, {moving}: {radii}", fontsize=9)
    figure.legend(
        *panels[0].get_legend_handles_labels(), fontsize=9, loc="outside lower center", ncols=3
    )
    save(figure, sheet.path, sheet.simulated)


def _draw_hit(axes: Axes, hit: SingleHit, pair: Pair, i: int, branch: int) -> float:
    """Draw one structure in one branch; return its radius after the impact."""
    names = ("displacement", "velocity", "velocity_after", "per_after")
    place, before, after, radius = (
        float(getattr(hit.branches, f"{name}_{i + 1}")[branch]) for name in names
    )
    frequency, colour = 2.0 * np.pi / pair.periods[i], BUILDING_COLOURS[i]
    angle = frequency * np.linspace(0.0, float(hit.branches.time_before[branch]), 100)
    across = place * np.cos(angle) + before / frequency * np.sin(angle)
    up = before / frequency * np.cos(angle) - place * np.sin(angle)
    add_circle(axes, pair.per[i], colour, "PER circle")
    add_circle(axes, radius, MOTION_COLOUR, "circle after the impact", style="--")
    axes.plot(across, up, color=COMPONENT_COLOURS[1], linewidth=3, label="(ii) way back in time")
    axes.plot(across[-1], up[-1], "s", color="black", label="(i) grazing state at the critical gap")
    axes.plot(place, up[0], "o", color=COMPONENT_COLOURS[1], label="(ii) contact at the gap")
    axes.annotate("", (place, after / frequency), (place, up[0]), arrowprops={"arrowstyle": "->"})
    axes.plot(
        place,
        after / frequency,
        "*",
        color=MOTION_COLOUR,
        markersize=12,
        label="(iii) after the impact",
    )
    _label_state_space(axes)
    return radius


def draw_comparison(compared: Mapping[float, SingleHitComparison], sheet: Sheet) -> None:
    """
    Draw Fig. 6: predicted against actual largest PER with pounding, and the amplifications.

    Parameters
    ----------
    compared : mapping of float to SingleHitComparison
        Gap over critical gap -> single hit and exact histories of many pairs.
    sheet : Sheet
        Title and file.
    """
    figure, (radii, ratios) = _figure(sheet, 1, 2, 10.5, 5.8)
    for colour, (gap_ratio, cases) in zip(COMPONENT_COLOURS, compared.items(), strict=True):
        governing = np.argmax(cases.actual / cases.per, axis=0), np.arange(cases.status.size)
        radii.loglog(
            cases.actual[governing], cases.predicted[governing], ".", color=colour, markersize=4
        )
        predicted, actual = amplifications(cases)
        found = summary(predicted / actual, (0.99,))
        text = f"{gap_ratio:g}: {found.median:.2f}, {found.log_std:.2f}, "
        text += f"{found.below[0]:.0%} of {found.cases}"
        ratios.loglog(actual, predicted, ".", base=2, color=colour, markersize=4, label=text)
    radii.set(xlabel="actual PER with pounding (m)", ylabel="predicted PER with pounding (m)")
    radii.set_title("the structure that is amplified most", fontsize=10)
    ratios.set(xlabel="actual amplification", ylabel="predicted amplification")
    ratios.set_title("largest amplification of the pair", fontsize=10)
    for axes in (radii, ratios):
        low, high = (
            min(axes.get_xlim()[0], axes.get_ylim()[0]),
            max(axes.get_xlim()[1], axes.get_ylim()[1]),
        )
        axes.plot([low, high], [low, high], color="black", linewidth=0.8)
        axes.set(xlim=(low, high), ylim=(low, high), box_aspect=1.0)
    for axis in (ratios.xaxis, ratios.yaxis):
        axis.set_major_formatter(ScalarFormatter())
    title = "gap / critical: bias, scatter, under by > 1 %"
    ratios.legend(title=title, fontsize=8, title_fontsize=8, loc="lower right")
    save(figure, sheet.path, sheet.simulated)


def draw_restitution(
    gap_ratios: FloatArray, restitutions: Sequence[float], hits: Sequence[SingleHit], sheet: Sheet
) -> None:
    """
    Draw Fig. 7: effect of the coefficient of restitution on the amplification of both structures.

    Parameters
    ----------
    gap_ratios : (n_gaps,) ndarray
        Gap over critical gap, dimensionless.
    restitutions : sequence of float
        Coefficients, dimensionless.
    hits : sequence of SingleHit
        For each coefficient, of one pair at these gaps.
    sheet : Sheet
        Title and file.
    """
    figure, panels = _figure(sheet, 1, 2, 11.0, 4.4)
    for i, axes in enumerate(panels, start=1):
        for shade, restitution, hit in zip(_shades(len(hits)), restitutions, hits, strict=True):
            axes.plot(
                gap_ratios,
                getattr(hit, f"amplification_{i}"),
                color=shade,
                label=f"e = {restitution:g}",
            )
        axes.set(
            xlabel="gap / critical gap", ylabel="amplification of the PER", title=f"structure {i}"
        )
        axes.grid(alpha=0.25)
    panels[0].sharey(panels[1])
    panels[1].legend(fontsize=9)
    save(figure, sheet.path, sheet.simulated)


def draw_supplemental_damping(
    added: FloatArray,
    needed: Mapping[str, FloatArray],
    least: Mapping[str, float],
    harm: Mapping[str, FloatArray],
    gap: float,
    sheet: Sheet,
) -> None:
    """
    Draw Fig. 8: the added damping with which a pair fits its gap, and the effect of less of it.

    Parameters
    ----------
    added : (n_added,) ndarray
        Added damping, fraction of critical.
    needed : mapping of str to (n_added,) ndarray
        Which structure is damped -> critical gap, m.
    least : mapping of str to float
        Which structure is damped -> least damping that is enough, NaN if none.
    harm : mapping of str to (n_added,) ndarray
        Structure -> PER with pounding, both damped, over PER without pounding and without added
        damping.
    gap : float
        Of the pair, m.
    sheet : Sheet
        Title and file.
    """
    figure, (prevention, mitigation) = _figure(sheet, 1, 2, 11.0, 4.4)
    for colour, (label, gaps) in zip(COMPONENT_COLOURS, needed.items(), strict=True):
        text = (
            f"{label}: never enough"
            if np.isnan(least[label])
            else f"{label}: {least[label]:.1%} is enough"
        )
        prevention.plot(100.0 * added, gaps, color=colour, label=text)
        prevention.plot(100.0 * least[label], gap, "o", color=colour)
    prevention.axhline(gap, color="black", linestyle="--", label=f"gap {gap:.3f} m")
    prevention.set(ylim=(0.0, None), ylabel="critical gap (m)")
    prevention.set_title("prevention: which structure is damped", fontsize=10)
    for colour, (label, ratio) in zip(BUILDING_COLOURS, harm.items(), strict=True):
        mitigation.plot(100.0 * added, ratio, color=colour, label=label)
    mitigation.axhline(
        1.0, color="black", linestyle="--", label="no worse than without neighbour and damping"
    )
    mitigation.set(ylim=(0.0, None), ylabel="PER with pounding / PER before (1)")
    mitigation.set_title("mitigation: both damped, gap as it is", fontsize=10)
    for axes in (prevention, mitigation):
        axes.set_xlabel("added damping (% of critical)")
        axes.legend(fontsize=8)
    save(figure, sheet.path, sheet.simulated)


def draw_ductility_correlation(
    ratios: FloatArray, curves: Mapping[str, Mapping[str, FloatArray]], sheet: Sheet
) -> None:
    """
    Draw the correlation of yielding pairs against their period ratio, one panel per ground motion.

    Parameters
    ----------
    ratios : (n_ratios,) ndarray
        Period of structure 2 over that of structure 1, dimensionless.
    curves : mapping of str to mapping of str to (n_ratios,) ndarray
        Title of the panel -> label -> correlation, the elastic (16) first.
    sheet : Sheet
        Title and file.
    """
    figure, panels = _figure(sheet, 2, (len(curves) + 1) // 2, 9.0, 6.6)
    for axes, (title, labelled) in zip(panels, curves.items(), strict=True):
        (first, reference), *others = labelled.items()
        axes.plot(ratios, reference, color="black", linestyle="--", label=first)
        for shade, (label, correlation) in zip(_shades(len(others)), others, strict=True):
            axes.plot(ratios, correlation, color=shade, label=label)
        axes.axhline(0.0, color="black", linewidth=0.6)
        axes.set(xlabel="T2 / T1", ylabel="correlation ρ", ylim=(-0.6, 1.05))
        axes.set_title(title, fontsize=10)
        axes.grid(alpha=0.25)
    panels[0].legend(fontsize=9)
    save(figure, sheet.path, sheet.simulated)


def _figure(
    sheet: Sheet, rows: int, columns: int, width: float, height: float
) -> tuple[Figure, list[Axes]]:
    figure = Figure(figsize=(width, height), layout="constrained")
    figure.suptitle(sheet.title, fontsize=11)
    return figure, list(figure.subplots(rows, columns, squeeze=False).flat)


def _shades(count: int) -> list[tuple[float, float, float, float]]:
    """Return colours from dark to light that colour-blind readers can distinguish."""
    return [
        (0.0, 0.2 + 0.6 * share, 0.5 + 0.2 * share, 1.0) for share in np.linspace(0.0, 1.0, count)
    ]


def _shaking(time: FloatArray, energy: FloatArray) -> tuple[float, float]:
    """Return when the input energy grows: quiet ends are left out."""
    path = np.cumsum(np.abs(np.diff(energy, prepend=0.0)))
    start, end = np.interp([0.002, 0.99], path / path[-1], time)
    return float(start), float(end)


def _label_state_space(axes: Axes) -> None:
    axes.set_aspect("equal", adjustable="datalim")
    axes.set(xlabel="displacement (m)", ylabel="velocity / frequency (m)")
