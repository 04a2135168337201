"""
Compare contact elements of OpenSees with the exact history of pounding as their time step falls.

Run: ``python workflows/opensees_convergence.py`` with the extra ``benchmark`` (OpenSeesPy, which
needs Debian's ``libblas3`` and ``liblapack3``); prints a table and draws
docs/figures/opensees_convergence.png. Impacts are elastic, as in a spring without damping.
"""

import importlib
from types import ModuleType

import matplotlib.pyplot as plt
import numpy as np
from paper_records import CHECKOUT

from per_obspy.checks import FloatArray
from per_obspy.pounding.row_history import pounding_history
from per_obspy.pounding.structure import Structure

#: Sampling interval of the record (s), its samples, and number of pairs.
DT, SAMPLES, PAIRS = 0.01, 800, 12

#: Steps per sampling interval.
REFINEMENTS = (1, 2, 5, 10, 20, 50, 100)

#: Stiffness of the contact over that of the stiffer structure; or steps that a contact lasts.
FIXED_STIFFNESS, STEPS_OF_CONTACT = 1e3, 10


def shaking() -> FloatArray:
    """Return eight seconds of a swelling and fading motion that ends at zero, m/s²."""
    noise = np.convolve(np.random.default_rng(3).normal(size=SAMPLES), np.ones(9) / 9, mode="same")
    return 6.0 * noise * np.sin(np.linspace(0.0, np.pi, SAMPLES)) ** 2


def random_pairs() -> list[tuple[list[Structure], float]]:
    """Return pairs of linear structures with 5 % of critical damping, and their gaps (m)."""
    random = np.random.default_rng(7)
    pairs = []
    for _ in range(PAIRS):
        periods, masses = random.uniform(0.3, 1.2, 2), random.uniform(0.5, 2.0, 2)
        members = [Structure(periods[i], 0.05, masses[i]) for i in range(2)]
        pairs.append((members, random.uniform(0.005, 0.02)))
    return pairs


def contact_stiffness(members: list[Structure], refinement: int, fixed: bool) -> float:
    """Return the stiffness of the contact: fixed, or such that a contact lasts ten steps, N/m."""
    if fixed:
        stiffnesses = [one.mass * (2.0 * np.pi / one.period) ** 2 for one in members]
        return FIXED_STIFFNESS * max(stiffnesses)
    reduced = 1.0 / sum(1.0 / one.mass for one in members)
    return float(reduced * (np.pi * refinement / (STEPS_OF_CONTACT * DT)) ** 2)


def build_model(ops: ModuleType, members: list[Structure], gap: float, stiffness: float) -> None:
    """Build two oscillators with a gap element between them."""
    ops.wipe()
    ops.model("basic", "-ndm", 1, "-ndf", 1)
    for k, one in enumerate(members, 1):
        omega = 2.0 * np.pi / one.period
        ops.node(10 * k, 0.0)
        ops.node(10 * k + 1, 0.0, "-mass", one.mass)
        ops.fix(10 * k, 1)
        viscosity = 2.0 * one.damping * one.mass * omega
        ops.uniaxialMaterial("Elastic", k, one.mass * omega**2, viscosity)
        ops.element("zeroLength", k, 10 * k, 10 * k + 1, "-mat", k, "-dir", 1)
    ops.uniaxialMaterial("ElasticPPGap", 3, stiffness, -1e12, -gap)
    ops.element("zeroLength", 3, 11, 21, "-mat", 3, "-dir", 1)


def opensees_motion(ops: ModuleType, acceleration: FloatArray, refinement: int) -> FloatArray:
    """Return the displacements of the model at the samples of the record, (n_samples, 2), m."""
    ops.timeSeries("Path", 1, "-dt", DT, "-values", *acceleration)
    ops.pattern("UniformExcitation", 1, 1, "-accel", 1)
    ops.constraints("Plain")
    ops.numberer("Plain")
    ops.system("BandGeneral")
    ops.test("NormDispIncr", 1e-12, 50)
    ops.algorithm("Newton")
    ops.integrator("Newmark", 0.5, 0.25)
    ops.analysis("Transient")
    motion = np.zeros((acceleration.size, 2))
    for sample in range(1, acceleration.size):
        if ops.analyze(refinement, DT / refinement) != 0:
            raise RuntimeError(f"OpenSees did not converge before sample {sample}")
        motion[sample] = ops.nodeDisp(11, 1), ops.nodeDisp(21, 1)
    return motion


def errors() -> dict[bool, FloatArray]:
    """Return largest differences over the largest displacement, by stiffness; (pairs, steps)."""
    ops, acceleration = importlib.import_module("openseespy.opensees"), shaking()
    found = {fixed: np.empty((PAIRS, len(REFINEMENTS))) for fixed in (True, False)}
    for row, (members, gap) in enumerate(random_pairs()):
        exact = pounding_history(acceleration, DT, members, gap, 1.0, free_vibration=False)
        motion = exact.displacement[:, :SAMPLES].T
        print(f"pair {row}: {len(exact.impacts)} impacts", flush=True)
        for fixed, table in found.items():
            for column, refinement in enumerate(REFINEMENTS):
                stiffness = contact_stiffness(members, refinement, fixed)
                build_model(ops, members, gap, stiffness)
                theirs = opensees_motion(ops, acceleration, refinement)
                table[row, column] = np.abs(theirs - motion).max() / np.abs(motion).max()
    return found


def draw(found: dict[bool, FloatArray]) -> None:
    """Draw errors against the time step, median and range of the pairs."""
    figure, axes = plt.subplots(figsize=(6.4, 4.2), layout="constrained")
    steps = DT / np.array(REFINEMENTS)
    labels = {
        True: "stiffness of the contact fixed: 1000 times the stiffer structure",
        False: "stiffness raised so that a contact lasts ten steps",
    }
    for fixed, table in found.items():
        (line,) = axes.loglog(steps, np.median(table, axis=0), "o-", label=labels[fixed])
        low, high = np.quantile(table, (0.1, 0.9), axis=0)
        axes.fill_between(steps, low, high, color=line.get_color(), alpha=0.15)
    axes.invert_xaxis()
    axes.set_xlabel("time step of OpenSees, s (record: 0.01 s)")
    axes.set_ylabel("largest difference / largest displacement")
    axes.set_title(f"OpenSees gap element against the exact history, {PAIRS} pairs", fontsize=10)
    axes.grid(which="both", alpha=0.3)
    axes.legend(fontsize=8, title="median, and 8 of 10 pairs", title_fontsize=8)
    figure.savefig(CHECKOUT / "docs" / "figures" / "opensees_convergence.png", dpi=130)


def main() -> None:
    """Print the medians, and draw the figure."""
    found = errors()
    print(f"{'step, s':>8} {'fixed':>9} {'raised':>9}   (medians)")
    for column, refinement in enumerate(REFINEMENTS):
        fixed, raised = (np.median(found[kind][:, column]) for kind in (True, False))
        print(f"{DT / refinement:8.4f} {fixed:9.1e} {raised:9.1e}")
    draw(found)


if __name__ == "__main__":
    main()
