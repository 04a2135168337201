"""
Critical gap of a pair
======================

The gap that two buildings need, by equations (15) and (16) and exactly. The first building has a
period of 1 s, that of the second varies.
"""

import matplotlib.pyplot as plt
import numpy as np

import per_obspy
from per_obspy.config.pairs import Scenario
from per_obspy.simulation.earthquake import rock_acceleration

scenario = Scenario(magnitude=6.8)
motion = rock_acceleration(scenario, hypocentral=20_000.0)[0]

# %%
# Radii of both oscillators and the correlation of their motions give the estimate.

second = np.geomspace(0.3, 3.0, 60)
per = per_obspy.per_spectrum(motion, scenario.dt, [1.0, *second])
correlation = per_obspy.ddc_correlation(1.0, 0.05, second, 0.05)
estimate = per_obspy.critical_gap(per[0], per[1:], correlation)

# %%
# The record itself gives the exact answer: the largest relative displacement.

exact = per_obspy.relative_displacement(motion, scenario.dt, 1.0, 0.05, second, 0.05).largest

figure, axes = plt.subplots(figsize=(6.0, 3.6), layout="constrained")
axes.semilogx(second, 100.0 * estimate, label="estimate: PER, correlation (16)")
axes.semilogx(second, 100.0 * per_obspy.absolute_gap(per[0], per[1:]), ":", label="absolute sum")
axes.semilogx(second, 100.0 * exact, "k", label="exact")
axes.set(xlabel="period of the second building (s)", ylabel="gap (cm)")
axes.legend()
plt.show()
