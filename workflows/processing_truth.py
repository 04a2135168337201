"""
Compare processed motion with the known truth after noise, drifts and baseline shifts were added.

Run: ``python workflows/processing_truth.py docs/figures/processing_truth.png``; prints what
docs/processing.md sums up, and draws the figure.
"""

import sys
from collections.abc import Callable
from pathlib import Path
from typing import NamedTuple

import numpy as np
from matplotlib.figure import Figure
from numpy.typing import NDArray
from obspy import Stream, Trace

from per_obspy import per_spectrum
from per_obspy.processing.chain import process

RATE, COUNT, SEEDS = 100.0, 12000, 4
TIME = np.arange(COUNT) / RATE
PERIODS = np.geomspace(0.06, 60.0, 90)
Array = NDArray[np.float64]


def box(shift: float, start: float, end: float) -> Callable[[np.random.Generator], Array]:
    """Return a baseline with a shift (m/s2) between two times (s); the shaking lasts 20-40 s."""
    return lambda _: np.where((start < TIME) & (end > TIME), shift, 0.0)


#: what is added to the ground motion, m/s2
ADDED: dict[str, Callable[[np.random.Generator], Array]] = {
    "nothing": lambda _: np.zeros(COUNT),
    "white noise 2e-3": lambda rng: 2e-3 * rng.normal(size=COUNT),
    "random walk": lambda rng: 2e-5 * np.cumsum(rng.normal(size=COUNT)),
    "offset and trend": lambda _: 0.05 + 2e-4 * TIME,
    "parabola": lambda _: 1e-3 * (TIME / 60) ** 2,
    "slow wave": lambda _: 1e-3 * np.sin(2 * np.pi * TIME / 40),
    "step 0.002": box(0.002, 24, 200),
    "two steps 0.005": lambda _: np.where(TIME > 50, 5e-4, np.where(TIME > 21, -5e-3, 0.0)),
    "step 0.02": box(0.02, 24, 200),
    "step 0.2": box(0.2, 24, 200),
    "15 s of 0.05": box(0.05, 22, 37),
    "3 s of 0.01": box(0.01, 23, 26),
    "3 s of 0.05": box(0.05, 23, 26),
    "3 s of 0.2": box(0.2, 23, 26),
}


class Outcome(NamedTuple):
    """PER over the true PER by period, usable periods (s), and whether a shift was flagged."""

    ratio: Array
    shortest: float
    longest: float
    flagged: bool

    @property
    def usable(self) -> NDArray[np.bool_]:
        """Mask of the usable periods."""
        return (self.shortest <= PERIODS) & (self.longest >= PERIODS)


def ground(seed: int) -> Array:
    """Return acceleration, m/s2: silence for 20 s, shaking from 0.1 to 20 Hz, rest."""
    scaled = np.maximum(TIME - 20.0, 0) / 3.0
    white = np.random.default_rng(seed).normal(size=COUNT)
    frequencies = np.fft.rfftfreq(COUNT, 1 / RATE)
    band = frequencies**2 / (frequencies**2 + 0.3**2) / (1 + (frequencies / 20) ** 4)
    envelope = scaled**0.5 * np.exp(-scaled / 2)
    motion = 3 * np.fft.irfft(np.fft.rfft(white) * band, COUNT) * envelope
    return np.asarray(motion - motion.sum() / envelope.sum() * envelope)


def outcome(kind: str, seed: int) -> Outcome:
    """Return the motion that the processing recovers."""
    rng, truth = np.random.default_rng(100 + seed), ground(seed)
    recorded = truth + 1e-5 * rng.normal(size=COUNT) + ADDED[kind](rng)
    done = process(
        Stream([Trace(recorded, {"sampling_rate": RATE, "units": "m/s2", "channel": "HNE"})])
    )[0]
    ratio = per_spectrum(done.data, 1 / RATE, PERIODS) / per_spectrum(truth, 1 / RATE, PERIODS)
    chosen = done.stats.per_obspy
    flagged = "baseline_shift" in chosen.get("record_flags", "").split()
    return Outcome(ratio, chosen.shortest_period, chosen.longest_period, flagged)


def row(kind: str, outcomes: list[Outcome]) -> str:
    """Return one row of the table."""
    errors = [np.abs(np.log(one.ratio)) for one in outcomes]
    inside = [error[one.usable] for error, one in zip(errors, outcomes, strict=True)]
    outside = [
        error[2 * one.longest < PERIODS].max() for error, one in zip(errors, outcomes, strict=True)
    ]
    early = [
        error[one.usable & (PERIODS <= 1.6)].max()
        for error, one in zip(errors, outcomes, strict=True)
    ]
    longest = [one.longest for one in outcomes]
    cells = [
        f"{np.median(np.concatenate(inside)):.1%}",
        f"{max(early):.1%}",
        f"{max(map(np.max, inside)):.1%}",
    ]
    cells += [f"{max(outside):.0%}", f"{min(longest):.0f} to {max(longest):.0f}"]
    cells += [f"{sum(one.flagged for one in outcomes)} of {len(outcomes)}"]
    return f"| {kind} | {' | '.join(cells)} |"


def draw(table: dict[str, list[Outcome]], path: Path) -> None:
    """Draw PER over the true one against period; green is usable, red curves are flagged."""
    figure = Figure(figsize=(13, 7.5), layout="constrained")
    panels = figure.subplots(3, 5, sharex=True, sharey=True)
    for axes, (kind, outcomes) in zip(panels.flat, table.items(), strict=False):
        for one in outcomes:
            axes.semilogx(
                PERIODS, one.ratio, color="#D55E00" if one.flagged else "#0072B2", linewidth=1
            )
            axes.axvspan(one.shortest, one.longest, color="#009E73", alpha=0.06, linewidth=0)
        axes.set(title=kind, ylim=(0.5, 1.5))
        axes.grid(alpha=0.3)
    panels.flat[-1].set_axis_off()
    panels.flat[-1].text(
        0, 0.5, "blue: no warning\nred: flagged\ngreen: usable periods", fontsize=11
    )
    figure.supxlabel("natural period (s)")
    figure.supylabel("PER of the processed record / PER of the ground")
    figure.savefig(path, dpi=90)


def main(path: Path) -> None:
    """Print the table and draw the figure."""
    table = {kind: [outcome(kind, seed) for seed in range(SEEDS)] for kind in ADDED}
    print(
        "| added, m/s² | median error | largest to 1.6 s | largest usable | largest beyond | "
        "usable to, s | flagged |"
    )
    print("|---|---|---|---|---|---|---|")
    for kind, outcomes in table.items():
        print(row(kind, outcomes))
    draw(table, path)


if __name__ == "__main__":
    main(Path(sys.argv[1]))
