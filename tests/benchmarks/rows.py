"""
Rows of five buildings per second of ``row_maxima`` on one core, against other programs.

Run as ``python tests/benchmarks/rows.py``. The yardsticks are taken in turn with it in the same
process: oscillator-steps a second of ``per_spectrum``, and `pounding_history` of the same rows one
by one. All in processor time, the best of three; on a busy machine compare the ratios.
"""

import time

import numpy as np
from figures import note
from pounding import DT, SAMPLES, record, yardstick

from per_obspy.pounding.row_history import pounding_history
from per_obspy.pounding.row_maxima import BuildingRows, row_maxima
from per_obspy.pounding.structure import Structure

MEMBERS, PEERS = 5, 4
#: Oscillator-steps a second of ``per_spectrum`` for which the speed of rows is required.
REFERENCE = 5e9


def random_rows(count, gap, limit=np.inf, similar=False):
    """Rows of periods of 0.2 to 3 s, or all within a tenth of 0.6 s; mass ratios up to 15."""
    random, buildings = np.random.default_rng(1), MEMBERS * count
    period = random.uniform(0.2, 3.0, buildings)
    if similar:
        period = random.uniform(0.54, 0.66, buildings)
    same = {name: np.ones(buildings) for name in ("participation_left", "participation_right")}
    return BuildingRows(
        first=np.arange(0, buildings + 1, MEMBERS),
        period=period,
        damping=np.full(buildings, 0.05),
        mass=random.uniform(0.2, 3.0, buildings),
        yield_displacement=np.full(buildings, limit),
        hardening=np.full(buildings, 0.05),
        **same,
        gap=random.uniform(*gap, buildings),
        restitution=np.full(buildings, 0.65),
        azimuth=np.zeros(count),
    )


def seconds(work):
    """Return the processor time of a call, and its result."""
    start = time.process_time()
    result = work()
    return time.process_time() - start, result


def single_histories(motion, rows):
    """Run the first rows one by one."""
    for first in range(0, MEMBERS * PEERS, MEMBERS):
        part = slice(first, first + MEMBERS)
        columns = rows.period, rows.damping, rows.mass, rows.yield_displacement, rows.hardening
        structures = [Structure(*own) for own in zip(*(c[part] for c in columns), strict=True)]
        pounding_history(motion, DT, structures, rows.gap[part][:-1], 0.65)


def main():
    """Print the table."""
    motion = record()
    still = np.zeros(SAMPLES)
    start = time.process_time()
    row_maxima(motion[:100], still[:100], DT, random_rows(2, (0.0, 0.0), 0.03))
    print(f"kernels loaded or compiled in {time.process_time() - start:.1f} s")
    cases = {
        "no contact": random_rows(240, (100.0, 100.0)),
        "gaps of 2 to 20 cm": random_rows(240, (0.02, 0.2)),
        "touching, alike": random_rows(48, (0.0, 0.0), similar=True),
        "touching, 0.2 to 3 s": random_rows(48, (0.0, 0.0)),
        "gaps, yielding": random_rows(48, (0.02, 0.2), 0.03),
    }
    print(f"{'case':>22} {'rows/s':>7} {'at 5e9':>7} {'hits/gap':>8} {'x one by one':>12}")
    for name, rows in cases.items():
        # in turn, so that a slow moment of the machine meets all of them
        count, best, fastest, alone = rows.azimuth.size, np.inf, 0.0, np.inf
        for _ in range(3):
            taken, maxima = seconds(lambda own=rows: row_maxima(motion, still, DT, own))
            best = min(best, taken)
            fastest = max(fastest, yardstick(motion))
        alone, _ = seconds(lambda own=rows: single_histories(motion, own))
        speed = count / best
        hits = maxima.impacts.sum() / (count * (MEMBERS - 1))
        print(
            f"{name:>22} {speed:7.0f} {speed * REFERENCE / fastest:7.0f} {hits:8.1f} "
            f"{speed * alone / PEERS:12.0f}"
        )
        remark = f"{speed * REFERENCE / fastest:.0f} at 5 billion steps/s; {hits:.0f} impacts each"
        note(f"rows of five, {name}", speed, "rows/s", remark=remark)
    print(f"per_spectrum: {fastest / 1e9:.2f} billion oscillator-steps/s")


if __name__ == "__main__":
    main()
