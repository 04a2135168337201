"""
Simulated ground motion against published ground-motion models: medians and deviations on rock.

    python workflows/simulated_ground_motion.py [REPETITIONS]

prints the table of which docs/simulation.md has rows. It needs pygmm (extra ``benchmark``).
Response spectra of simulated earthquakes, one place of each, stand against the mean of four models
of NGA-West2 (Abrahamson and others, Boore and others, Campbell & Bozorgnia, Chiou & Youngs; all
2014): vertical strike-slip fault, generic rock of Vs30 620 m/s. The distance of the models is
that to the rupture, the one of the simulation that to the point source.
"""

import sys
import warnings

import numpy as np
import pygmm
from numpy.typing import NDArray

from per_obspy import response_spectra
from per_obspy.config import Scenario
from per_obspy.simulation.earthquake import rock_acceleration

PERIODS = np.array([0.1, 0.2, 0.5, 1.0, 2.0, 3.0, 5.0])
MAGNITUDES = (5.5, 6.0, 6.5, 7.0, 7.5)
DISTANCES = (5.0, 15.0, 30.0, 60.0, 100.0, 150.0)  # km

#: Generic rock of Boore & Joyner (1997), m/s.
VS30 = 620.0

MODELS = (
    pygmm.AbrahamsonSilvaKamai2014,
    pygmm.BooreStewartSeyhanAtkinson2014,
    pygmm.CampbellBozorgnia2014,
    pygmm.ChiouYoungs2014,
)

Spectrum = NDArray[np.float64]


def published(magnitude: float, distance: float) -> tuple[Spectrum, Spectrum]:
    """Return mean ln SA (g) and mean deviation of the models."""
    scenario = pygmm.Scenario(
        mag=magnitude,
        dist_rup=distance,
        dist_jb=distance,
        dist_x=distance,
        v_s30=VS30,
        mechanism="SS",
        dip=90,
        depth_tor=0,
        width=15,
        on_hanging_wall=False,
        region="california",
    )
    models = [model(scenario) for model in MODELS]
    medians = [np.log(model.interp_spec_accels(PERIODS)) for model in models]
    deviations = [model.interp_ln_stds(PERIODS) for model in models]
    return np.mean(medians, axis=0), np.mean(deviations, axis=0)


def simulated(magnitude: float, distance: float, repetitions: int) -> Spectrum:
    """Return ln SA (g) of the geometric mean of both horizontals, (repetitions, n_periods)."""
    logs = []
    for seed in range(repetitions):
        scenario = Scenario(magnitude=magnitude, seed=seed)
        north, east, _ = rock_acceleration(scenario, 1000.0 * distance)
        spectra = [response_spectra(motion, scenario.dt, PERIODS).psa for motion in (north, east)]
        logs.append(np.log(np.array(spectra) / 9.80665).mean(axis=0))
    return np.array(logs)


def main(repetitions: int) -> None:
    """Print one line per magnitude and distance."""
    print("| M, km |", " | ".join(f"{period:g} s" for period in PERIODS), "|")
    print("|---|" + "---|" * PERIODS.size)
    deviations, expected, correlations = [], [], []
    for magnitude in MAGNITUDES:
        for distance in DISTANCES:
            median, deviation = published(magnitude, distance)
            logs = simulated(magnitude, distance, repetitions)
            ratio = np.exp(logs.mean(axis=0) - median)
            cells = " | ".join(f"{value:.2f}" for value in ratio)
            print(f"| {magnitude:g}, {distance:g} | {cells} |")
            deviations.append(logs.std(axis=0, ddof=1))
            expected.append(deviation)
            correlations.append(np.corrcoef(logs.T))
    # Deviations and correlations hardly depend on magnitude and distance
    for name, values in (("simulated deviation", deviations), ("published deviation", expected)):
        print(f"| {name} |", " | ".join(f"{value:.2f}" for value in np.mean(values, axis=0)), "|")
    with_one_second = np.mean(correlations, axis=0)[:, 3]
    cells = " | ".join(f"{value:.2f}" for value in with_one_second)
    print(f"| correlation with 1 s | {cells} |")


if __name__ == "__main__":
    warnings.simplefilter("ignore")  # distances outside the range of a model
    main(int((sys.argv[1:] or ["40"])[0]))
