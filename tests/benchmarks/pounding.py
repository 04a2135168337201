"""
Pairs per second of ``pounding_histories`` on one core, next to OpenSeesPy on the same pairs.

Run as ``python tests/benchmarks/pounding.py``. OpenSees integrates with the record's own step,
contact by a stiff no-tension gap; its cost is compared, not its accuracy. On a busy machine
compare the ratios and the yardstick.
"""

import importlib
import time

import numpy as np
from figures import note

from per_obspy.pounding.pair_histories import pounding_histories
from per_obspy.spectra.elastic import per_spectrum

DT, SAMPLES, PAIRS, PEER_PAIRS = 0.01, 12_000, 1024, 4
#: Figure with which OpenSees is compared.
LINEAR = "histories, linear"
YIELDING = {
    "yield_displacement_1": 0.03,
    "hardening_1": 0.05,
    "yield_displacement_2": 0.03,
    "hardening_2": 0.05,
}


def record():
    """Two minutes of smoothed noise that rise and fall like an earthquake."""
    noise = np.convolve(np.random.default_rng(0).normal(size=SAMPLES), np.ones(5) / 5, mode="same")
    seconds = DT * np.arange(SAMPLES)
    return 5.0 * noise * (seconds / 10.0) * np.exp(1.0 - seconds / 10.0)


def random_pairs(count):
    """Periods of 0.2 to 3 s, 5 % damping, mass ratios up to 15, gaps of 2 to 20 cm."""
    random = np.random.default_rng(1)
    draw = {
        "period_1": (0.2, 3.0),
        "mass_1": (0.2, 3.0),
        "period_2": (0.2, 3.0),
        "mass_2": (0.2, 3.0),
        "gap": (0.02, 0.2),
    }
    pairs = {name: random.uniform(*limits, count) for name, limits in draw.items()}
    return {**pairs, "damping_1": 0.05, "damping_2": 0.05, "restitution": 0.65}


def rate(acceleration, pairs):
    """Return pairs a second of processor time, best of three, and the mean number of impacts."""
    best = np.inf
    for _ in range(3):
        start = time.process_time()
        maxima = pounding_histories(acceleration, DT, **pairs)
        best = min(best, time.process_time() - start)
    return maxima.impacts.size / best, maxima.impacts.mean()


def opensees():
    """Return OpenSeesPy, or None where it or its BLAS is missing."""
    try:
        return importlib.import_module("openseespy.opensees")
    except (ImportError, RuntimeError) as problem:
        print(
            f"OpenSeesPy cannot be imported, no comparison: {problem}; it is part of the extra "
            "benchmark and needs Debian's libblas3 and liblapack3"
        )
        return None


def opensees_rate(ops, acceleration, pairs, count):
    """Return pairs a second of OpenSees, Newmark with the record's step."""
    start = time.process_time()
    for i in range(count):
        ops.wipe()
        ops.model("basic", "-ndm", 1, "-ndf", 1)
        stiffest = 0.0
        for k in (1, 2):
            mass, omega = pairs[f"mass_{k}"][i], 2 * np.pi / pairs[f"period_{k}"][i]
            stiffest = max(stiffest, mass * omega**2)
            ops.node(10 * k, 0.0)
            ops.node(10 * k + 1, 0.0, "-mass", mass)
            ops.fix(10 * k, 1)
            ops.uniaxialMaterial("Elastic", k, mass * omega**2, 2 * 0.05 * mass * omega)
            ops.element("zeroLength", k, 10 * k, 10 * k + 1, "-mat", k, "-dir", 1)
        ops.uniaxialMaterial("ElasticPPGap", 3, 1e3 * stiffest, -1e12, -pairs["gap"][i])
        ops.element("zeroLength", 3, 11, 21, "-mat", 3, "-dir", 1)
        ops.timeSeries("Path", 1, "-dt", DT, "-values", *acceleration)
        ops.pattern("UniformExcitation", 1, 1, "-accel", 1)
        ops.constraints("Plain")
        ops.numberer("Plain")
        ops.system("BandGeneral")
        ops.test("NormDispIncr", 1e-10, 50)
        ops.algorithm("Newton")
        ops.integrator("Newmark", 0.5, 0.25)
        ops.analysis("Transient")
        if ops.analyze(SAMPLES, DT) != 0:
            raise RuntimeError(f"OpenSees did not converge for pair {i}")
    return count / (time.process_time() - start)


def yardstick(acceleration):
    """Return the present speed of ``per_spectrum``, oscillator-steps per second on one core."""
    periods = np.geomspace(0.5, 5.0, 1024)
    best = np.inf
    for _ in range(3):
        start = time.process_time()
        per_spectrum(acceleration, DT, periods)
        best = min(best, time.process_time() - start)
    return periods.size * acceleration.size / best


def main():
    """Print the table."""
    acceleration, pairs = record(), random_pairs(PAIRS)
    pounding_histories(acceleration[:100], DT, **random_pairs(2))  # compiles
    cases = {
        "no contact": {**pairs, "gap": 100.0},
        "linear": pairs,
        "touching": {**pairs, "gap": 0.0},
        "bilinear": {**pairs, **YIELDING},
    }
    peer, ops = None, opensees()
    if ops is not None:
        peer = opensees_rate(ops, acceleration, pairs, PEER_PAIRS)
        note("histories, linear, OpenSees", peer, "pairs/s", peer="openseespy", of=LINEAR)
        print(
            f"OpenSeesPy, linear, {SAMPLES} samples, record's step: {peer:.1f} pairs/s on one core"
        )
    steps = yardstick(acceleration) / 1e9
    note("per_spectrum, the yardstick", steps, "billion steps/s")
    print(f"per_spectrum, the yardstick: {steps:.2f} billion oscillator-steps/s on one core")
    print(f"{'case':>12} {'pairs/s core':>13} {'impacts':>8} {'x OpenSees':>11}")
    for name, fields in cases.items():
        speed, impacts = rate(acceleration, fields)
        print(
            f"{name:>12} {speed:13.0f} {impacts:8.1f} "
            f"{speed / peer if peer else float('nan'):11.0f}"
        )
        note(f"histories, {name}", speed, "pairs/s", remark=f"{impacts:.0f} impacts per pair")


if __name__ == "__main__":
    main()
