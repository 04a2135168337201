"""Figures of records: raw and processed motion, amplitudes and processing parameters."""

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
from per_obspy.processing.signal_to_noise import noise_spectra
from per_obspy.report.style import (
    BUILDING_COLOURS,
    CORNER_COLOUR,
    DOTS_PER_INCH,
    FAINT_COLOUR,
    MOTION_COLOUR,
    NOISE_COLOUR,
    USABLE_COLOUR,
    literal,
)
from per_obspy.results.station_summary import RECORD_COLUMNS

SMOOTHING = Processing().smoothing  # b of the Konno-Ohmachi window
PAGE = (11.7, 8.3)  # inches: A4, landscape

#: Limit of a vertical axis over the largest processed value: a drift beyond is cut.
AXIS_LIMIT = 1.3

#: Quantities of a page, with units; each is the integral of the one before.
QUANTITIES = {"acceleration": "m/s²", "velocity": "m/s", "displacement": "m"}

#: Numbers and texts of the processing that a page lists, as far as the record has them.
LISTED = (
    "onset", "onset_source", "noise", "signal_to_noise", "baseline", "residual_velocity",
    "certain_period", "highpass", "highpass_source", "lowpass", "lowpass_source", "shortest_period",
    "longest_period", "azimuth_source", "warnings", "notes",
)  # fmt: skip


def draw_records(pages: Iterable[tuple[Any, Any]], path: Path) -> None:
    """
    Draw one page per record: motion in time, and Fourier amplitudes with noise and corners.

    Parameters
    ----------
    pages : iterable of (Trace, Trace or None)
        A processed record with its numbers in ``stats.per_obspy``, and the record before baseline
        and filter.
    path : Path
        PDF file, written whole or not at all.
    """
    with written_whole(path) as part, PdfPages(part) as book:
        for processed, unfiltered in pages:
            book.savefig(record_page(processed, unfiltered), dpi=DOTS_PER_INCH)


def record_page(processed: Any, unfiltered: Any) -> Figure:
    """Return the page of one record; see :func:`draw_records`."""
    figure = Figure(figsize=PAGE, layout="constrained")
    left, right = np.asarray(figure.subfigures(1, 2, width_ratios=(1.3, 1.0)))
    # Motion on the left, amplitudes and numbers on the right
    _draw_motion(left, processed, unfiltered)
    amplitudes, numbers = right.subplots(2, 1, height_ratios=(1.6, 1.0))
    _draw_amplitudes(amplitudes, processed, unfiltered)
    _write_numbers(numbers, processed)
    start = processed.stats.starttime + _pads(processed)[0]
    figure.suptitle(f"{literal(processed.id)}   {start.strftime('%Y-%m-%d %H:%M:%S')} UTC")
    return figure


def _pads(trace: Any) -> tuple[float, float]:
    """Return the length of the zeros before and after the record, s."""
    chosen = trace.stats.per_obspy
    return float(chosen.get("pad_before", 0.0)), float(chosen.get("pad_after", 0.0))


def _without_pads(trace: Any, samples: FloatArray) -> FloatArray:
    """Return the samples of the record itself."""
    first, last = (round(pad / trace.stats.delta) for pad in _pads(trace))
    return samples[first : samples.size - last]


def _draw_motion(figure: Any, processed: Any, unfiltered: Any) -> None:
    """Draw acceleration, velocity and displacement, processed and before baseline and filter."""
    # The noise window starts with the record, after the pads
    dt, noise = processed.stats.delta, float(processed.stats.per_obspy.get("noise", 0.0))
    panels = figure.subplots(3, 1, sharex=True)
    samples, raw = processed.data, None if unfiltered is None else unfiltered.data
    for axes, (name, unit) in zip(panels, QUANTITIES.items(), strict=True):
        _draw_quantity(axes, dt, _without_pads(processed, samples), raw, unit)
        axes.set_ylabel(f"{name} ({unit})")
        axes.axvspan(0.0, noise, color=NOISE_COLOUR, alpha=0.15, linewidth=0)
        axes.grid(alpha=0.25)
        # The next panel is the integral, which begins in the pads
        samples = cumulative_trapezoid(samples, dx=dt, initial=0)
        raw = None if raw is None else cumulative_trapezoid(raw, dx=dt, initial=0)
    panels[-1].set_xlabel("time (s); noise window shaded, grey: before baseline and filter")


def _draw_quantity(
    axes: Axes, dt: float, samples: FloatArray, raw: FloatArray | None, unit: str
) -> None:
    """Draw one quantity over time, with its peak, over that before baseline and filter."""
    # Pixels instead of lines: pages of long records would be large
    style: dict[str, Any] = {"linewidth": 0.7, "rasterized": True}
    if raw is not None:
        axes.plot(np.arange(raw.size) * dt, raw, color=FAINT_COLOUR, label="before", **style)
    axes.plot(np.arange(samples.size) * dt, samples, color=BUILDING_COLOURS[0], **style)
    # The axis fits the processed motion
    peak = float(np.abs(samples).max())
    axes.set_ylim(-AXIS_LIMIT * peak, AXIS_LIMIT * peak)
    axes.set_title(f"peak {peak:.3g} {unit}")


def _draw_amplitudes(axes: Axes, processed: Any, unfiltered: Any) -> None:
    """Draw Fourier amplitudes, noise, corner frequencies and the usable band."""
    chosen, dt = processed.stats.per_obspy, processed.stats.delta
    record = _without_pads(processed, processed.data)
    lowest = 1 / (record.size * dt)
    _draw_fourier(axes, record, dt)
    if unfiltered is not None and chosen.get("noise"):
        _draw_noise(axes, unfiltered.data, dt, float(chosen.noise), lowest)

    # Corners of the filter, and the band whose periods are usable
    for name in ("highpass", "lowpass"):
        label = f"{name} {chosen[name]:.3g} Hz"
        axes.axvline(chosen[name], color=CORNER_COLOUR, linestyle="--", label=label)
    usable = 1 / chosen.longest_period, 1 / chosen.shortest_period
    axes.axvspan(*usable, color=USABLE_COLOUR, alpha=0.1, linewidth=0, label="usable")

    # From one period in the record to the Nyquist frequency
    axes.set(xlabel="frequency (Hz)", ylabel="Fourier amplitude (m/s)", xlim=(lowest, 0.5 / dt))
    axes.grid(which="both", alpha=0.2)
    axes.legend(fontsize=7, loc="lower center")


def _draw_fourier(axes: Axes, record: FloatArray, dt: float) -> None:
    """Draw the Fourier amplitudes of the processed record."""
    length = next_fast_len(record.size, real=True)
    frequency = rfftfreq(length, dt)[1:]
    amplitude = dt * np.abs(rfft(record, length))[1:]
    axes.loglog(frequency, amplitude, color=FAINT_COLOUR, linewidth=0.4, rasterized=True)


def _draw_noise(axes: Axes, unfiltered: FloatArray, dt: float, noise: float, lowest: float) -> None:
    """Draw the smoothed amplitudes of signal and noise from the lowest frequency on."""
    spectra = noise_spectra(unfiltered, dt, noise, SMOOTHING)
    known = spectra.frequencies >= lowest
    frequency, signal = spectra.frequencies[known], spectra.signal[known]
    # In the colours of the record and of the noise window
    axes.loglog(frequency, signal, color=BUILDING_COLOURS[0], label="signal before the filter")
    axes.loglog(frequency, spectra.noise[known], color=NOISE_COLOUR, label="noise")


def _write_numbers(axes: Axes, processed: Any) -> None:
    """Write the parameters of the processing as a list."""
    chosen = processed.stats.per_obspy
    lines = []
    for name in LISTED:
        if name not in chosen:
            continue
        # Numbers with their units, texts as they are
        value, unit = chosen[name], RECORD_COLUMNS[name][0].strip("1")
        text = f"{value:.4g} {unit}" if isinstance(value, float) else literal(str(value))
        lines += textwrap.wrap(f"{name.replace('_', ' ')}: {text}", 68, subsequent_indent="    ")
    axes.set_axis_off()
    style: dict[str, Any] = {"va": "top", "fontsize": 8, "family": "monospace"}
    axes.text(0.0, 1.0, "\n".join(lines), color=MOTION_COLOUR, **style)
