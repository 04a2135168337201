"""
Compare PER of real records with PER of the same records after a known shift of their baseline.

Run: ``python workflows/known_shifts.py PEAK FOLDER [FOLDER ...]`` with folders of raw records;
prints the tables of which docs/processing.md has rows. A record is a truth where the processing
finds no fault of its baseline and its peak is at least PEAK, m/s². Shifts start at 10, 30 and 50 %
of the energy in turn.
"""

import logging
import sys
from collections.abc import Iterator
from itertools import cycle, product
from pathlib import Path
from typing import NamedTuple

import numpy as np
from baseline_repairs import REPAIRS, Array
from obspy import Stream, Trace

from per_obspy import per_spectrum
from per_obspy.config import Processing
from per_obspy.errors import RecordRejected
from per_obspy.processing.account import is_processed
from per_obspy.processing.chain import process
from per_obspy.processing.components import is_horizontal, orient
from per_obspy.processing.filter.baseline_spread import Shaking, without_drift
from per_obspy.processing.instrument_response import in_acceleration
from per_obspy.processing.series import significant_samples
from per_obspy.records.folder import find_stations, read_station

#: Periods at which PER is compared, s.
PERIODS = np.geomspace(0.2, 10.0, 30)

#: Kinds of shifts: how long they last, s; sizes, m/s²; shares of the energy at which they start.
DURATIONS = {"step": np.inf, "15 s": 15.0, "3 s": 3.0}
SIZES = (0.002, 0.005, 0.02, 0.05, 0.2)
STARTS = (0.1, 0.3, 0.5)

#: As in the command, but for the limit of usable periods that is measured.
SETTINGS = Processing()


class Result(NamedTuple):
    """PER, m, and limits of the usable periods, s: by the corner alone, and with the spread."""

    radii: Array
    by_corner: float
    longest: float
    is_flagged: bool


class Case(NamedTuple):
    """Shift of a record as the processing finds it, and after each repair."""

    kind: str
    size: float
    truth: Result
    found: Result
    repaired: dict[str, Result]


def result_of(samples: Array, dt: float) -> tuple[Result, Trace]:
    """Return PER and usable periods of one component, and the processed trace."""
    header = {"delta": dt, "units": "m/s2", "channel": "HNE"}
    done = process(Stream([Trace(samples, header)]), SETTINGS)[0]
    chosen = done.stats.per_obspy
    # Limits of the usable periods without and with the spread of baselines
    is_flagged = "baseline_shift" in chosen.get("record_flags", "").split()
    by_corner = SETTINGS.usable / chosen.highpass
    radii = per_spectrum(done.data, dt, PERIODS)
    return Result(radii, by_corner, chosen.longest_period, is_flagged), done


def horizontals(folder: Path) -> Iterator[Trace]:
    """Yield the raw horizontals of a folder in m/s²."""
    found = find_stations(folder)
    for name, files in found.stations.items():
        stream, _ = read_station(files, found.inventory, name)
        raw = Stream([trace for trace in stream if not is_processed(trace)])
        for trace in map(orient, raw):
            if is_horizontal(trace):
                yield in_acceleration(trace, SETTINGS.gain_tolerance)


def cases(trace: Trace, smallest: float, starts: Iterator[float]) -> Iterator[Case]:
    """Yield every shift of a record, none if the record is no truth."""
    samples, dt = np.asarray(trace.data, dtype=float), float(trace.stats.delta)
    try:
        truth, done = result_of(samples, dt)
    except RecordRejected:
        return
    # A clean baseline is seen only between quiet ends
    is_clean = "residual_velocity" in done.stats.per_obspy and not truth.is_flagged
    if not is_clean or np.abs(done.data).max() < smallest:
        return
    # Every shift in turn
    print(trace.id, file=sys.stderr)
    noise = float(done.stats.per_obspy.noise)
    for kind, size in product(DURATIONS, SIZES):
        shifted = samples + size * shift(samples, dt, kind, next(starts))
        try:
            found = result_of(shifted, dt)[0]
            yield Case(kind, size, truth, found, repairs_of(shifted, dt, noise))
        except RecordRejected as fault:
            print(f"{trace.id}, {kind} of {size}: rejected, {fault}", file=sys.stderr)


def shift(samples: Array, dt: float, kind: str, share: float) -> Array:
    """Return 1 from a share of the energy on, as long as the kind of shift lasts, else 0."""
    energy = np.cumsum(without_drift(samples, dt) ** 2)
    since = dt * (np.arange(samples.size) - np.searchsorted(energy, share * energy[-1]))
    return np.where((since > 0) & (since < DURATIONS[kind]), 1.0, 0.0)


def repairs_of(samples: Array, dt: float, noise: float) -> dict[str, Result]:
    """Return the shifts that the processing finds after each repair."""
    first = round(noise / dt)
    plain = samples - samples[:first].mean()
    end = noise + significant_samples(without_drift(plain, dt)[first:]) * dt
    shaking = Shaking(noise, end)
    return {name: result_of(repair(plain, dt, shaking), dt)[0] for name, repair in REPAIRS.items()}


def errors(truth: Result, found: Result, longest: float) -> Array:
    """Return |ln PER / true PER| at the usable periods, 0 where there is none."""
    inside = min(truth.by_corner, longest) >= PERIODS
    error = np.abs(np.log(found.radii / truth.radii))[inside]
    return error if error.size else np.zeros(1)


def figures(cases: list[Case], repair: str | None = None) -> str:
    """Return the cells of some cases: by the corner alone, and with the spread of baselines."""
    cells = []
    for limit in ("corner", "spread"):
        found = [with_limit(case, limit, repair) for case in cases]
        largest = [float(error.max()) for error, _ in found]
        median = np.median(np.concatenate([error for error, _ in found]))
        # Geometric mean of the longest usable periods of the table
        longest = [min(period, PERIODS[-1]) for _, period in found]
        period = np.exp(np.mean(np.log(longest)))
        cells += [f"{median:.1%}", f"{np.quantile(largest, 0.84):.1%}", f"{max(largest):.1%}"]
        cells.append(f"{period:.1f}")
    return " | ".join(cells)


def main(smallest: float, folders: list[Path]) -> None:
    """Print both tables."""
    starts, every = cycle(STARTS), list[Case]()
    for folder in folders:
        for trace in horizontals(folder):
            every += cases(trace, smallest, starts)
    # By kind and size
    head = "median | 84 % | largest | to, s"
    print(f"| shift, m/s² | {head} | {head} | flagged |\n|{'---|' * 10}")
    for kind, size in product(DURATIONS, SIZES):
        these = [case for case in every if (case.kind, case.size) == (kind, size)]
        flagged = sum(case.found.is_flagged for case in these)
        print(f"| {kind} of {size:g} | {figures(these)} | {flagged} of {len(these)} |")
    # Repairs: all cases together
    print(f"\n| baseline | {head} | {head} |\n|{'---|' * 9}")
    for repair in (None, *REPAIRS):
        print(f"| {repair or 'this package'} | {figures(every, repair)} |")


def with_limit(case: Case, name: str, repair: str | None = None) -> tuple[Array, float]:
    """Return the errors of a case up to a limit, and the limit, s."""
    found = case.found if repair is None else case.repaired[repair]
    # A repair hides the shift from the processing: its limit is that of the record before
    longest = found.by_corner if name == "corner" else min(found.by_corner, case.found.longest)
    return errors(case.truth, found, longest), longest


if __name__ == "__main__":
    logging.disable()
    main(float(sys.argv[1]), [Path(name) for name in sys.argv[2:]])
