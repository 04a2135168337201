"""A page a record: what it was, what became of it, and every number that was chosen for it."""

import textwrap
from collections.abc import Iterable
from pathlib import Path
from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.backends.backend_pdf import PdfPages
from matplotlib.figure import Figure
from scipy.fft import next_fast_len, rfft, rfftfreq
from scipy.integrate import cumulative_trapezoid

from per_obspy.checks import FloatArray
from per_obspy.config import Processing
from per_obspy.files import written_whole
from per_obspy.processing.noise.signal_to_noise import noise_spectra
from per_obspy.report.style import BUILDING_COLOURS, DOTS_PER_INCH, MOTION_COLOUR, STATE_COLOURS
from per_obspy.tables.processed import COLUMNS

SMOOTHING = Processing().smoothing  # b of the Konno-Ohmachi window
BEFORE_COLOUR = "#BBBBBB"
PAGE = (11.7, 8.3)  # inches: A4, landscape
ROOM = 1.3  # of a vertical axis over the largest processed value: what drifts beyond is cut

#: quantities of a page, with units; each is the integral of the one before
QUANTITIES = {"acceleration": "m/s²", "velocity": "m/s", "displacement": "m"}

#: what the page says in words, as far as the record has it
TOLD = (
    "onset", "onset_source", "noise", "signal_to_noise", "baseline", "residual_velocity", "highpass",
    "highpass_source", "lowpass", "lowpass_source", "shortest_period", "longest_period", "azimuth_source",
    "warnings", "notes",
)  # fmt: skip


def draw_records(pages: Iterable[tuple[Any, Any]], path: Path) -> None:
    """
    Draw one page a record: acceleration, velocity, displacement, Fourier amplitudes with noise and corners.

    Parameters
    ----------
    pages : iterable of (Trace, Trace or None)
        A processed record with its numbers in ``stats.per_obspy``, and what it was before.
    path : Path
        PDF file, written whole or not at all.
    """
    with written_whole(path) as part, PdfPages(part) as book:
        for processed, before in pages:
            book.savefig(record_page(processed, before), dpi=DOTS_PER_INCH)


def record_page(processed: Any, before: Any) -> Figure:
    """Return the page of one record; see :func:`draw_records`."""
    figure = Figure(figsize=PAGE, layout="constrained")
    left, right = np.asarray(figure.subfigures(1, 2, width_ratios=(1.3, 1.0)))
    _draw_motion(left, processed, before)
    amplitudes, words = right.subplots(2, 1, height_ratios=(1.6, 1.0))
    _draw_amplitudes(amplitudes, processed, before)
    _write_numbers(words, processed)
    start = processed.stats.starttime + _pads(processed)[0]
    figure.suptitle(f"{processed.id}   {start.strftime('%Y-%m-%d %H:%M:%S')} UTC")
    return figure


def _pads(trace: Any) -> tuple[float, float]:
    """Return the length of the zeros before and after the record, s."""
    chosen = trace.stats.per_obspy
    return float(chosen.get("pad_before", 0.0)), float(chosen.get("pad_after", 0.0))


def _without_pads(trace: Any, samples: FloatArray) -> FloatArray:
    first, last = (round(pad / trace.stats.delta) for pad in _pads(trace))
    return samples[first : samples.size - last]


def _draw_motion(figure: Any, processed: Any, before: Any) -> None:
    dt, onset = processed.stats.delta, float(processed.stats.per_obspy.get("noise", 0.0))
    after, was = processed.data, None if before is None else before.data
    panels = figure.subplots(3, 1, sharex=True)
    for axes, (name, unit) in zip(panels, QUANTITIES.items(), strict=True):
        shown = _without_pads(processed, after)
        if was is not None:
            axes.plot(
                np.arange(was.size) * dt,
                was,
                color=BEFORE_COLOUR,
                label="before",
                linewidth=0.7,
                rasterized=True,
            )
        axes.plot(
            np.arange(shown.size) * dt,
            shown,
            color=BUILDING_COLOURS[0],
            linewidth=0.7,
            rasterized=True,
        )
        peak = float(np.abs(shown).max())
        axes.set(
            ylim=(-ROOM * peak, ROOM * peak),
            ylabel=f"{name} ({unit})",
            title=f"peak {peak:.3g} {unit}",
        )
        axes.axvspan(0.0, onset, color=STATE_COLOURS["possible"], alpha=0.15, linewidth=0)
        axes.grid(alpha=0.25)
        after = cumulative_trapezoid(after, dx=dt, initial=0)
        was = None if was is None else cumulative_trapezoid(was, dx=dt, initial=0)
    panels[-1].set_xlabel("time (s); noise window shaded, grey: before baseline and filter")


def _draw_amplitudes(axes: Axes, processed: Any, before: Any) -> None:
    chosen, dt = processed.stats.per_obspy, processed.stats.delta
    record = _without_pads(processed, processed.data)
    length = next_fast_len(record.size, real=True)
    lines = rfftfreq(length, dt)[1:]
    axes.loglog(
        lines,
        dt * np.abs(rfft(record, length))[1:],
        color=BEFORE_COLOUR,
        linewidth=0.4,
        rasterized=True,
    )
    if before is not None and chosen.get("noise"):
        spectra = noise_spectra(before.data, dt, float(chosen.noise), SMOOTHING)
        known = spectra.frequencies >= 1 / (record.size * dt)
        frequencies = spectra.frequencies[known]
        axes.loglog(
            frequencies,
            spectra.signal[known],
            color=BUILDING_COLOURS[0],
            label="signal before the filter",
        )
        axes.loglog(
            frequencies, spectra.noise[known], color=STATE_COLOURS["possible"], label="noise"
        )
    for name in ("highpass", "lowpass"):
        axes.axvline(
            chosen[name],
            color=STATE_COLOURS["yes"],
            linestyle="--",
            label=f"{name} {chosen[name]:.3g} Hz",
        )
    usable = 1 / chosen.longest_period, 1 / chosen.shortest_period
    axes.axvspan(*usable, color=STATE_COLOURS["no"], alpha=0.1, linewidth=0, label="usable")
    axes.set(
        xlabel="frequency (Hz)",
        ylabel="Fourier amplitude (m/s)",
        xlim=(1 / (record.size * dt), 0.5 / dt),
    )
    axes.grid(which="both", alpha=0.2)
    axes.legend(fontsize=7, loc="lower center")


def _write_numbers(axes: Axes, processed: Any) -> None:
    chosen = processed.stats.per_obspy
    lines = []
    for name in (name for name in TOLD if name in chosen):
        value, unit = chosen[name], COLUMNS[name][0].strip("1")
        text = f"{value:.4g} {unit}" if isinstance(value, float) else str(value)
        lines += textwrap.wrap(f"{name.replace('_', ' ')}: {text}", 68, subsequent_indent="    ")
    axes.set_axis_off()
    axes.text(
        0.0, 1.0, "\n".join(lines), va="top", fontsize=8, family="monospace", color=MOTION_COLOUR
    )
