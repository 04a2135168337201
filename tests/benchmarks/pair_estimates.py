"""
Speed of the estimates of a pair, next to plain NumPy and pandas in one process on one core.

    python tests/benchmarks/pair_estimates.py

Times are processor time of all threads, the best of several. The peers do the three steps of the
single hit for one branch, without status, envelope and energies: less than what they are compared
with.
"""

import time
from collections.abc import Callable

import numpy as np
import pandas as pd
from figures import note
from scipy.signal import lfilter

from per_obspy.pounding.correlation import directional_correlation
from per_obspy.pounding.probability import pounding_probability
from per_obspy.pounding.relative import (
    directional_relative_displacement,
)
from per_obspy.pounding.single_hit import single_hit
from per_obspy.spectra.elastic import azimuth_maxima

PAIRS, SAMPLES, DT = 100_000, 12_000, 0.01


def best(work: Callable[[], object], repeats: int = 5) -> float:
    """Return the shortest processor time of a call, s, after a first one that may compile."""
    work()
    times = []
    for _ in range(repeats):
        start = time.process_time()
        work()
        times.append(time.process_time() - start)
    return min(times)


def random_pairs(count: int) -> dict[str, np.ndarray]:
    """Return pairs whose gaps are below critical."""
    rng = np.random.default_rng(1)
    r1, r2 = rng.uniform(0.1, 1.0, (2, count))
    critical = np.sqrt(r1**2 + r2**2 - 2 * rng.uniform(-0.9, 0.9, count) * r1 * r2)
    t1, t2 = rng.uniform(0.3, 3.0, (2, count))
    m1, m2 = rng.uniform(1.0, 5.0, (2, count))
    e, gap = rng.uniform(0.0, 1.0, count), critical * rng.uniform(0.0, 1.0, count)
    return {
        "r1": r1,
        "r2": r2,
        "t1": t1,
        "t2": t2,
        "m1": m1,
        "m2": m2,
        "e": e,
        "critical": critical,
        "gap": gap,
    }


def numpy_single_hit(r1, r2, t1, t2, m1, m2, e, critical, gap):
    """Return the amplification of structure 1 for one branch by plain NumPy, in twenty steps."""
    w1, w2 = 2 * np.pi / t1, 2 * np.pi / t2
    a, b = w2**2 - w1**2, w2**2 * critical
    c = (w1 * r1) ** 2 - (w2 * r2) ** 2 + (w2 * critical) ** 2
    x = c / (b + np.sqrt(b**2 - a * c))
    v = w1 * np.sqrt(r1**2 - x**2)
    t, bound = np.zeros_like(x), w1**2 * r1 + w2**2 * r2
    for _ in range(20):
        c1, s1, c2, s2 = np.cos(w1 * t), np.sin(w1 * t), np.cos(w2 * t), np.sin(w2 * t)
        u1, u2 = x * c1 - v / w1 * s1, (x - critical) * c2 - v / w2 * s2
        v1, v2 = v * c1 + w1 * x * s1, v * c2 + w2 * (x - critical) * s2
        distance, closing = np.maximum(u1 - u2 - gap, 0), v1 - v2
        root = np.sqrt(closing**2 + 2 * bound * distance)
        t = t + np.where(
            closing > 0, 2 * distance / np.maximum(closing + root, 1e-300), (root - closing) / bound
        )
    return np.hypot(u1, (v1 - (1 + e) * m2 / (m1 + m2) * closing) / w1) / r1


def ground_motion() -> np.ndarray:
    """Return noise under an envelope, m/s²."""
    noise = np.random.default_rng(0).normal(size=SAMPLES)
    return lfilter(np.ones(5) / 5, 1, noise) * np.exp(-(((np.arange(SAMPLES) - 3000) / 1500) ** 2))


def main() -> None:
    """Print the table."""
    pairs = random_pairs(PAIRS)
    ours = best(lambda: single_hit(*pairs.values())) / PAIRS
    plain = best(lambda: numpy_single_hit(*pairs.values()), 2) / PAIRS
    few = pd.DataFrame(pairs).head(300)
    rows = best(lambda: few.apply(lambda row: numpy_single_hit(*row), axis=1), 1) / len(few)
    print(f"single_hit                {1e-6 / ours:8.3f} million pairs/s")
    print(
        f"  plain NumPy, one branch {1e-6 / plain:8.3f} million pairs/s  {plain / ours:8.1f} "
        f"times the time"
    )
    print(
        f"  pandas apply            {1e-6 / rows:8.3f} million pairs/s  {rows / ours:8.0f} "
        f"times the time"
    )
    note("single hit", 1e-6 / ours, "million pairs/s")
    for peer, each in (("numpy", plain), ("pandas", rows)):
        note(f"single hit, {peer}", 1e-6 / each, "million pairs/s", peer=peer, of="single hit")
    motion = ground_motion()
    of_a_record(motion)
    chance = best(
        lambda: pounding_probability(
            pairs["r1"][:5000], pairs["r2"][:5000], 0.3, 0.2, 0.4, 0.4, 0.8, 0.2
        ),
        3,
    )
    print(f"pounding_probability      {5 / chance:8.1f} thousand pairs/s")
    note("probability", 5 / chance, "thousand pairs/s")


def of_a_record(motion: np.ndarray) -> None:
    """Print the cost of a pair that is run through the record."""
    rng = np.random.default_rng(2)
    structures = rng.uniform([0.2, 0.02, 0.2, 0.02, 0.0], [3.0, 0.1, 3.0, 0.1, 360.0], (2000, 5)).T
    alike = structures.copy()
    alike[2:4] = structures[:2] * (1.0 + 1e-9)
    for name, chosen in (
        ("own azimuths", structures),
        ("alike to 1e-9", alike),
        ("a call of 64", structures[:, :64]),
    ):
        each = best(
            lambda c=chosen: directional_relative_displacement(motion, motion[::-1], DT, *c), 3
        )
        rate = 1e-3 * chosen.shape[1] / each
        print(f"relative displacement     {rate:8.1f} thousand pairs/s, {SAMPLES} samples, {name}")
        note(f"relative displacement, {name}", rate, "thousand pairs/s")
    pads = 1e-5 * rng.normal(size=(2, SAMPLES // 2))
    padded = np.concatenate([pads[0], motion, pads[1]])
    few = structures[[0, 1, 4], :800]  # so few that no thread is started
    for record, name in (
        (motion, f"{SAMPLES} samples"),
        (padded, f"{2 * SAMPLES}, half of them pads"),
    ):
        each = best(lambda r=record: azimuth_maxima(r, r[::-1], DT, *few), 9) / 800
        print(f"PER and SD of a building  {1e-3 / each:8.1f} thousand/s, own azimuths, {name}")
        note(f"PER and SD of a building, {name}", 1e-3 / each, "thousand/s")
        pair = *structures[:4], structures[4:].T
        each = best(lambda r=record, p=pair: directional_correlation(r, r[::-1], DT, *p), 5) / 2000
        print(f"correlation               {1e-3 / each:8.1f} thousand pairs/s, {name}")
        note(f"correlation, {name}", 1e-3 / each, "thousand pairs/s")


if __name__ == "__main__":
    main()
