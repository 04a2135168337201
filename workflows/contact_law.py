"""
Measure how far impacts depend on the contact law and the restitution, on real records (3 minutes).

    python workflows/contact_law.py

writes the table below the heading ``Contact law`` of ``docs/reliability.md``. Pairs and rows of
linear buildings hit each other in each record by an instant impact with a restitution of 0.65,
which is what the histories of the package are exact for; then by other restitutions, through a
spring with a dashpot, and by the Hertz law with damping. Compared are the fastest approach and the
largest displacement of either building.
"""

import argparse
from collections.abc import Iterator
from itertools import product
from pathlib import Path

import numpy as np
from paper_records import CHECKOUT, Record, broad_band, data_folder, mexico_city_1985

from per_obspy import (
    Structure,
    hertz_damp_history,
    kelvin_voigt_damping,
    kelvin_voigt_history,
    pounding_history,
    relative_displacement,
)
from per_obspy.checks import FloatArray

#: Restitution of the reference, and others.
REFERENCE, OTHERS = 0.65, (0.4, 0.5, 0.8)

#: Stiffnesses of the spring, N/m: weak infill, and the range of concrete in the literature
#: (unverified); of the Hertz law, N/m^1.5.
SPRINGS, HERTZ = (1e8, 1e9, 4.4e9), 1e10

#: Periods of pairs (s), masses of building 2 over those of 1, gaps over the largest demand.
PERIODS = ((0.3, 0.4), (0.5, 0.52), (0.4, 0.8), (0.7, 1.4), (2.0, 1.5))
MASSES, GAPS, MASS = (1.0, 0.3), (0.01, 0.3), 1e6

#: Damping of buildings, buildings of a row, rows per record, and records of the slow Hertz law.
DAMPING, ROW, ROWS, HERTZ_RECORDS = 0.05, 5, 4, 1

#: Steps into which a sample is divided, and length of the strongest part of a record, s.
STEPS, LENGTH = 4, 20.0

#: Heading below which the page is the script's.
MEASURED = "## Contact law"

#: Fastest approach (m/s) and largest displacement of each building (m).
Outcome = tuple[float, FloatArray]


def strongest(record: Record) -> tuple[FloatArray, float]:
    """Return the strongest part of a record, divided into finer steps: the same ground."""
    peak, half = int(np.argmax(np.abs(record.acceleration))), int(LENGTH / 2 / record.dt)
    part = record.acceleration[max(peak - half, 0) : peak + half]
    samples = np.arange(part.size)
    finer = np.arange(0.0, part.size - 1 + 1e-9, 1.0 / STEPS)
    return np.interp(finer, samples, part), record.dt / STEPS


def instant(
    motion: FloatArray, dt: float, buildings: list[Structure], gaps: list[float], restitution: float
) -> Outcome:
    """Return the outcome of instant impacts."""
    history = pounding_history(motion, dt, tuple(buildings), tuple(gaps), restitution)
    hits = history.impacts
    speed = (hits["velocity_before_1"] - hits["velocity_before_2"]).max() if len(hits) else 0.0
    return float(speed), history.displacement_maxima


def approach_of(displacement: FloatArray, velocity: FloatArray, gap: float) -> float:
    """Return the fastest approach of two buildings where their gap closes, m/s."""
    overlap = displacement[0] - displacement[1] - gap
    speed = velocity[0] - velocity[1]
    closes = np.flatnonzero((overlap[:-1] <= 0.0) & (overlap[1:] > 0.0))
    share = -overlap[closes] / (overlap[closes + 1] - overlap[closes])
    return float((speed[closes] + share * (speed[closes + 1] - speed[closes])).max(initial=0.0))


def pairs_of(
    motion: FloatArray, dt: float, with_hertz: bool
) -> Iterator[tuple[str, Outcome, Outcome]]:
    """Yield law, outcome and that of the reference of all pairs in one record."""
    for (period_1, period_2), ratio, share in product(PERIODS, MASSES, GAPS):
        one, two = Structure(period_1, DAMPING, MASS), Structure(period_2, DAMPING, ratio * MASS)
        free = relative_displacement(motion, dt, period_1, DAMPING, period_2, DAMPING)
        gap = share * float(free.one_before_two)
        reference = instant(motion, dt, [one, two], [gap], REFERENCE)
        for restitution in OTHERS:
            found = instant(motion, dt, [one, two], [gap], restitution)
            yield f"instant, e = {restitution:g}", found, reference
        reduced = MASS * ratio / (1.0 + ratio)
        for stiffness in SPRINGS:
            dashpot = 2.0 * kelvin_voigt_damping(REFERENCE) * np.sqrt(stiffness * reduced)
            spring = kelvin_voigt_history(motion, dt, one, two, gap, stiffness, float(dashpot))
            speed = approach_of(spring.displacement, spring.velocity, gap)
            yield f"spring, {stiffness:.2g} N/m", (speed, spring.displacement_maxima), reference
        if with_hertz and ratio == 1.0 and share == GAPS[-1]:
            hertz = hertz_damp_history(motion, dt, one, two, gap, HERTZ, REFERENCE)
            speed = approach_of(hertz.displacement, hertz.velocity, gap)
            largest = np.abs(hertz.displacement).max(axis=1)
            yield f"Hertz with damping, {HERTZ:.2g} N/m^1.5", (speed, largest), reference


def rows_of(
    motion: FloatArray, dt: float, random: np.random.Generator
) -> Iterator[tuple[str, Outcome, Outcome]]:
    """Yield law, outcome and that of the reference of drawn rows in one record."""
    for _ in range(ROWS):
        periods = random.uniform(0.3, 1.2, ROW)
        masses = MASS * np.exp(random.normal(0.0, 0.5, ROW))
        buildings = [
            Structure(float(period), DAMPING, float(mass))
            for period, mass in zip(periods, masses, strict=True)
        ]
        gaps = random.choice([0.0, 0.02], ROW - 1).tolist()
        reference = instant(motion, dt, buildings, gaps, REFERENCE)
        for restitution in OTHERS:
            found = instant(motion, dt, buildings, gaps, restitution)
            yield f"rows of {ROW}, instant, e = {restitution:g}", found, reference


def lines(errors: dict[str, list[tuple[float, FloatArray]]]) -> Iterator[str]:
    """Yield the table: deviations of the logarithm of velocity and of displacement."""
    yield (
        "| contact | cases | velocity: median ratio | median error, 9 in 10 below | ln deviation | "
        "displacement: median error, 9 in 10 below | ln deviation |"
    )
    yield "|---|---|---|---|---|---|---|"
    for law, cases in errors.items():
        speed = np.array([case[0] for case in cases])
        moved = np.concatenate([case[1] for case in cases])
        ratio = np.exp(np.median(speed))
        yield f"| {law} | {len(cases)} | {ratio:.2f} | {_cell(speed)} | {_cell(moved)} |"


def _cell(logs: FloatArray) -> str:
    """Return median and ninetieth percentile of errors in per cent, and the deviation."""
    median, ninety = np.quantile(np.abs(np.expm1(logs)), (0.5, 0.9))
    return f"{median:.0%}, {ninety:.0%} | {logs.std():.2f}"


def main() -> None:
    """Write the table."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--page", type=Path, default=CHECKOUT / "docs" / "reliability.md")
    parser.add_argument("--records", type=int, default=16, help="records at most")
    arguments = parser.parse_args()
    data_folder()
    errors: dict[str, list[tuple[float, FloatArray]]] = {}
    records = [*mexico_city_1985(), *broad_band()][: arguments.records]
    for number, record in enumerate(records):
        motion, dt = strongest(record)
        with_hertz = number < HERTZ_RECORDS
        random = np.random.default_rng(number)
        outcomes = (*pairs_of(motion, dt, with_hertz), *rows_of(motion, dt, random))
        for law, (speed, moved), (speed_before, moved_before) in outcomes:
            if min(speed, speed_before) > 0.0:
                case = float(np.log(speed / speed_before)), np.log(moved / moved_before)
                errors.setdefault(law, []).append(case)
        print(record.name, flush=True)
    page = arguments.page.read_text()
    start = page.index("| contact |")
    end = page.index("\n\n", start)
    arguments.page.write_text(page[:start] + "\n".join(lines(errors)) + page[end:])


if __name__ == "__main__":
    main()
