"""
Speed and agreement of the spectra next to other programs, in one process and on one core.

    OPENBLAS_NUM_THREADS=1 python tests/benchmarks/spectra.py

Every time is the best of several: processor time, on which ratios rest, and time by the clock.
"exact" finds peaks between the samples too, "at samples" takes them at samples only, as all peers
do. Peers that are not installed are named and left out (``pip install per_obspy[benchmark]`` brings
them).
"""

import importlib
import os
import time
from collections.abc import Callable
from concurrent.futures import ThreadPoolExecutor
from typing import Any, NamedTuple

import numpy as np
from figures import note
from obspy.signal.freqattributes import peak_ground_motion
from scipy.signal import lsim

from per_obspy.kernels._jit import kernel
from per_obspy.spectra.azimuthal import (
    azimuthal_per_spectrum,
    azimuthal_sd_spectrum,
    rotd,
    sampled_azimuthal_per_spectrum,
    sampled_azimuthal_sd_spectrum,
)
from per_obspy.spectra.bilinear import bilinear_response
from per_obspy.spectra.elastic import (
    per_spectrum,
    response_spectra,
    sampled_per_spectrum,
    sampled_response_spectra,
)

DT, SAMPLES, DAMPING = 0.005, 12_000, 0.05
PERIODS = np.geomspace(0.05, 10.0, 100)
#: Multiply-adds of one step of the PER kernel.
PER_STEP = 8
#: Distributions of the peers by the first word of their rows, and the figures of the same job.
PEERS = {"pyrotd": "pyrotd", "esi-core": "esi-core", "eqsig": "eqsig", "SciPy": "scipy"}
PEERS["ObsPy"] = "obspy"
SAMPLED_PER, SAMPLED_SD = "PER at samples", "SD along every azimuth, at samples"
PEAK_LANES, PEAK_ROUNDS, PEAK_CHAIN = 128, 20_000, 16


def ground_motion(samples: int, seed: int = 0) -> np.ndarray:
    """Low-passed noise under an envelope, m/s²: 0 to 20 Hz at 200 Hz."""
    noise = np.random.default_rng(seed).normal(size=samples + 9)
    smooth = np.convolve(noise, np.hanning(12)[1:-1], "valid")
    return smooth * np.exp(-(((np.arange(samples) / samples - 0.3) / 0.2) ** 2))


@kernel
def multiply_add(rounds):
    """Run chains of multiply-adds that stay in registers: the peak rate of the machine."""
    values = np.ones(PEAK_LANES)
    for _ in range(rounds):
        for lane in range(PEAK_LANES):
            value = values[lane]
            for _ in range(PEAK_CHAIN):
                value = value * 0.999 + 0.001
            values[lane] = value
    return values.sum()


class Seconds(NamedTuple):
    """Processor time of all threads, and time by the clock."""

    processor: float
    clock: float


def best(work: Callable[[], Any], seconds: float = 1.0) -> tuple[Seconds, Any]:
    """Return the shortest times of a call, and its result; at least 2 calls after a first one."""
    result, shortest, begun, calls = work(), Seconds(np.inf, np.inf), time.perf_counter(), 0
    while calls < 2 or time.perf_counter() - begun < seconds:
        processor, clock = time.process_time(), time.perf_counter()
        result = work()
        processor, clock = time.process_time() - processor, time.perf_counter() - clock
        shortest = Seconds(min(shortest.processor, processor), min(shortest.clock, clock))
        calls += 1
    return shortest, result


def row(what: str, seconds: Seconds, *others: str) -> None:
    """Print one line of a table."""
    times = f"{1e3 * seconds.processor:>11.3f} ms {1e3 * seconds.clock:>11.3f} ms"
    print(f"{what:<56}{times}  {'  '.join(others)}", flush=True)
    peer, of = PEERS.get(what.partition(":")[0].partition(" ")[0], ""), ""
    if peer:
        of = SAMPLED_SD if "Rot" in what or "optimized" in what else SAMPLED_PER
    note(what, 1e3 * seconds.processor, "ms", peer=peer, of=of, remark="; ".join(others))


def ratio(seconds: Seconds, ours: Seconds) -> str:
    """Return how many times ours, by processor time."""
    return f"{seconds.processor / ours.processor:.3g} times ours"


def error(ours: np.ndarray, theirs: np.ndarray) -> str:
    """Return median and largest relative difference in words."""
    differences = np.abs(np.asarray(theirs) / ours - 1)
    return (
        f"differs by {100 * np.median(differences):.2g} %, at most {100 * differences.max():.2g} %"
    )


def module(name: str, install: str) -> Any:
    """Return a peer, or None after saying that it is not here."""
    try:
        return importlib.import_module(name)
    except ImportError as missing:
        print(f"{install}: left out ({missing})")
        return None


def pyrotd_sd_sv(pyrotd: Any, motion: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Displacement and velocity spectra by FFT, in separate passes, padded to twice the length."""
    padded = np.concatenate([motion, np.zeros(motion.size)])
    sd, sv = (
        pyrotd.calc_spec_accels(DT, padded, 1 / PERIODS, DAMPING, osc_type=kind)["spec_accel"]
        for kind in ("sd", "sv")
    )
    return sd, sv


def eqsig_per(eqsig: Any, motion: np.ndarray) -> np.ndarray:
    """PER from the histories of Nigam and Jennings' method."""
    u, v, _ = eqsig.nigam_and_jennings_response(motion, DT, PERIODS, DAMPING)
    return np.sqrt((u**2 + (v * PERIODS[:, None] / (2 * np.pi)) ** 2).max(axis=1))


def esi_per(oscillators: Any, motion: np.ndarray) -> np.ndarray:
    """PER from the histories of gmprocess' C code, one period after the other."""
    per = []
    for period in PERIODS:
        _, v, u, *_ = oscillators.calculate_spectrals(
            motion, motion.size, DT, 1 / DT, period, DAMPING
        )
        per.append(np.sqrt((u**2 + (v * period / (2 * np.pi)) ** 2).max()))
    return np.array(per)


def lsim_per(motion: np.ndarray) -> np.ndarray:
    """PER from SciPy's general linear simulation."""
    per = []
    for omega in 2 * np.pi / PERIODS:
        system = ([[0, 1], [-(omega**2), -2 * DAMPING * omega]], [[0], [-1]], np.eye(2), [[0], [0]])
        _, states, _ = lsim(system, motion, np.arange(motion.size) * DT)
        per.append(np.hypot(states[:, 0], states[:, 1] / omega).max())
    return np.array(per)


def obspy_psa(motion: np.ndarray) -> np.ndarray:
    """PSA from ObsPy, which simulates a seismometer of each frequency on ground displacement."""
    displacement = DT**2 * np.cumsum(np.cumsum(motion))
    return np.array(
        [peak_ground_motion(displacement, DT, 1 / period, DAMPING)[0] for period in PERIODS]
    )


def one_component() -> None:
    """One record, 100 periods."""
    motion = ground_motion(SAMPLES)
    print(
        f"\nOne component, {SAMPLES} samples at {DT} s, {PERIODS.size} periods 0.05-10 s, "
        f"damping {DAMPING}"
    )
    print(f"{'':<56}{'processor':>14} {'clock':>14}")
    for count in (SAMPLES, 4 * SAMPLES):
        share_of_peak(count)
    sampled, sampled_per = best(lambda: sampled_per_spectrum(motion, DT, PERIODS))
    row("PER at samples", sampled)
    seconds, exact_per = best(lambda: per_spectrum(motion, DT, PERIODS))
    row(
        "PER exact",
        seconds,
        ratio(seconds, sampled),
        f"samples alone: {error(exact_per, sampled_per)}",
    )
    several, at_samples = best(lambda: sampled_response_spectra(motion, DT, PERIODS))
    row("PER, SD, SV, SA at samples", several)
    seconds, _ = best(lambda: response_spectra(motion, DT, PERIODS))
    row(
        "PER, SD, SV, SA exact, with free vibration",
        seconds,
        f"{seconds.processor / several.processor:.3g} times",
    )
    peers_of_one_component(motion, sampled, sampled_per, at_samples)


def share_of_peak(samples: int) -> None:
    """Measure the peak of the core, and the share of it that PER of whole blocks reaches."""
    periods, motion = np.geomspace(0.05, 10.0, 128), ground_motion(samples)
    rounds = best(lambda: multiply_add(PEAK_ROUNDS))[0].processor
    seconds, _ = best(lambda: sampled_per_spectrum(motion, DT, periods))
    rounds = min(rounds, best(lambda: multiply_add(PEAK_ROUNDS))[0].processor)
    peak, rate = (
        PEAK_ROUNDS * PEAK_LANES * PEAK_CHAIN / rounds,
        samples * periods.size / seconds.processor,
    )
    percent = 100 * PER_STEP * rate / peak
    share = f"{rate / 1e9:.2f} billion steps/s, {percent:.0f} % of {peak / 1e9:.0f} billion FMA/s"
    row(f"PER at samples, {samples} samples, 128 periods", seconds, share)


def peers_of_one_component(motion, sampled, sampled_per, at_samples) -> None:
    """Compare with whoever is installed; ratios are to our sampled PER, which does the same job."""
    if pyrotd := module("pyrotd", "pyrotd"):
        pyrotd.processes = 1
        seconds, (sd, sv) = best(lambda: pyrotd_sd_sv(pyrotd, motion))
        row("pyrotd: SD and SV", seconds, ratio(seconds, sampled), error(at_samples.sd, sd))
        print(f"{'':>12}SV {error(at_samples.sv, sv)}")
        seconds = best(
            lambda: [
                pyrotd.calc_spec_accels(DT, motion, 1 / PERIODS, DAMPING, osc_type=kind)
                for kind in ("sd", "sv")
            ]
        )[0]
        row("pyrotd: SD and SV, not padded", seconds, ratio(seconds, sampled))
    if oscillators := module("esi_core.gmprocess.metrics.oscillators", "esi-core"):
        seconds, per = best(lambda: esi_per(oscillators, motion))
        row(
            "esi-core (C of gmprocess): PER",
            seconds,
            ratio(seconds, sampled),
            error(sampled_per, per),
        )
    if eqsig := module("eqsig.sdof", "eqsig"):
        seconds, per = best(lambda: eqsig_per(eqsig, motion))
        row("eqsig: PER", seconds, ratio(seconds, sampled), error(sampled_per, per))
    seconds, per = best(lambda: lsim_per(motion))
    row("SciPy lsim: PER", seconds, ratio(seconds, sampled), error(sampled_per, per))
    seconds, psa = best(lambda: obspy_psa(motion))
    row(
        "ObsPy peak_ground_motion: PSA",
        seconds,
        ratio(seconds, sampled),
        error(at_samples.psa, psa),
    )


def azimuths() -> None:
    """180 azimuths of two components."""
    north, east = ground_motion(SAMPLES, 1), ground_motion(SAMPLES, 2)
    print(f"\n180 azimuths, {SAMPLES} samples, {PERIODS.size} periods")
    seconds, per = best(lambda: azimuthal_per_spectrum(north, east, DT, PERIODS))
    row("PER along every azimuth, exact", seconds)
    seconds, _ = best(lambda: sampled_azimuthal_per_spectrum(north, east, DT, PERIODS))
    row("PER along every azimuth, at samples", seconds)
    exact, _ = best(lambda: azimuthal_sd_spectrum(north, east, DT, PERIODS))
    row("SD along every azimuth, exact, with free vibration", exact)
    ours, sd = best(lambda: sampled_azimuthal_sd_spectrum(north, east, DT, PERIODS))
    row("SD along every azimuth, at samples", ours)
    seconds, plain = best(
        lambda: [
            per_spectrum(north * np.cos(angle) + east * np.sin(angle), DT, PERIODS)
            for angle in np.radians(np.arange(180))
        ]
    )
    row("PER of 180 rotated records, exact, one by one", seconds, error(per, np.transpose(plain)))
    if pyrotd := module("pyrotd", "pyrotd"):
        pyrotd.processes = 1
        padded = [np.concatenate([motion, np.zeros(SAMPLES)]) for motion in (north, east)]
        for method in ("optimized", "rigorous"):
            seconds, found = best(
                lambda method=method: pyrotd.calc_rotated_spec_accels(
                    DT, *padded, 1 / PERIODS, DAMPING, [50, 100], method=method
                )
            )
            table = np.sort(found, order=["osc_freq", "percentile"])["spec_accel"].reshape(-1, 2)[
                ::-1
            ]
            pseudo = (2 * np.pi / PERIODS) ** 2
            others = f"{seconds.processor / exact.processor:.3g} times our exact SD"
            row(f"pyrotd {method}: RotD50, RotD100 of SD", seconds, ratio(seconds, ours), others)
            for column, percentile in enumerate((50, 100)):
                print(
                    f"{'':>12}RotD{percentile} "
                    f"{error(rotd(sd, percentile) * pseudo, table[:, column])}"
                )
        seconds, _ = best(
            lambda: pyrotd.calc_rotated_spec_accels(
                DT, north, east, 1 / PERIODS, DAMPING, [50, 100]
            )
        )
        row("pyrotd optimized, not padded", seconds, ratio(seconds, ours))


def scaling() -> None:
    """Measure the growth of times with samples, oscillators, azimuths and threads."""
    print("\nScaling of PER exact between samples")
    for samples in (3_000, 12_000, 48_000, 192_000):
        motion = ground_motion(samples)
        seconds, _ = best(lambda motion=motion: per_spectrum(motion, DT, PERIODS), 0.5)
        row(
            f"{samples} samples, 100 periods",
            seconds,
            f"{1e9 * seconds.processor / samples / 100:.3f} ns a sample and period",
        )
    motion = ground_motion(SAMPLES)
    for count in (1, 64, 256, 1024):
        periods = np.geomspace(0.05, 10, count)
        seconds, _ = best(lambda periods=periods: per_spectrum(motion, DT, periods), 0.5)
        row(
            f"{count} periods, 12000 samples",
            seconds,
            f"{1e9 * seconds.processor / SAMPLES / count:.3f} ns a sample and period",
        )
    east = ground_motion(SAMPLES, 1)
    for count in (4, 36, 180, 720):
        angles = np.arange(count) * 180 / count
        seconds, _ = best(
            lambda angles=angles: azimuthal_per_spectrum(
                motion, east, DT, PERIODS, azimuths=angles
            ),
            0.5,
        )
        row(f"{count} azimuths, 100 periods, 12000 samples", seconds)
    seconds, _ = best(lambda: bilinear_response(motion, DT, 1.0, DAMPING, 0.01, 0.05), 0.5)
    row(
        "bilinear_response, 12000 samples",
        seconds,
        f"{1e9 * seconds.processor / SAMPLES:.0f} ns a sample",
    )


def threads() -> None:
    """The same job on one core and on all, next to a plain multiply-add loop per core."""
    cores = os.sched_getaffinity(0)
    motion, periods = ground_motion(200_000), np.geomspace(0.05, 10, 640)
    print("\nThreads: 200000 samples, 640 periods, PER exact")
    with ThreadPoolExecutor(len(cores)) as pool:
        loops, _ = best(lambda: list(pool.map(multiply_add, [10 * PEAK_ROUNDS] * len(cores))))
    loop, _ = best(lambda: multiply_add(10 * PEAK_ROUNDS))
    every, spectra = best(lambda: per_spectrum(motion, DT, periods), 3.0)
    os.sched_setaffinity(0, {min(cores)})
    one, alone = best(lambda: per_spectrum(motion, DT, periods), 3.0)
    os.sched_setaffinity(0, cores)
    row("1 core", one)
    same = "same bits" if np.array_equal(spectra, alone) else "DIFFERENT"
    row(
        f"{len(cores)} cores",
        every,
        f"{one.clock / every.clock:.2f} times faster by the clock, {same}",
    )
    print(
        f"{'':>12}the machine grants {len(cores) * loop.clock / loops.clock:.2f} times one "
        f"core to multiply-adds"
    )


def long_record() -> None:
    """A day at 200 Hz."""
    motion = ground_motion(17_280_000)
    processor, clock = time.process_time(), time.perf_counter()
    per_spectrum(motion, DT, PERIODS)
    seconds = Seconds(time.process_time() - processor, time.perf_counter() - clock)
    print("\nA day at 200 Hz, 17.28 million samples, 100 periods")
    row("PER exact, all cores", seconds)


if __name__ == "__main__":
    one_component()
    azimuths()
    scaling()
    threads()
    long_record()
