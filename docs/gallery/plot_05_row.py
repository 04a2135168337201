"""
A row of five buildings
=======================

Impacts run through a row of houses that nearly touch. Compare the radius of each building in the
row with its radius alone: some gain and others lose.
"""

import matplotlib.pyplot as plt
import numpy as np

import per_obspy
from per_obspy.config.pairs import Scenario
from per_obspy.simulation.earthquake import rock_acceleration

scenario = Scenario(magnitude=6.8)
motion = rock_acceleration(scenario, hypocentral=20_000.0)[0]

periods = [0.9, 0.5, 0.6, 0.45, 0.8]
row = [per_obspy.Structure(period, 0.05, 3e5) for period in periods]
history = per_obspy.pounding_history(motion, scenario.dt, row, gaps=0.005, restitution=0.65)
alone = per_obspy.per_spectrum(motion, scenario.dt, periods)

figure, (radii, impacts) = plt.subplots(1, 2, figsize=(9.0, 3.2), layout="constrained")
place = np.arange(5)
radii.bar(place - 0.2, 100.0 * alone, 0.4, label="alone")
radii.bar(place + 0.2, 100.0 * history.per, 0.4, label="in the row")
radii.set_xticks(place, [f"{period} s" for period in periods])
radii.set(ylabel="PER (cm)", title="five buildings, 5 mm apart")
radii.legend()
counted = history.impacts[history.impacts["counted"]]
speed = counted["velocity_before_1"] - counted["velocity_before_2"]
impacts.scatter(counted["time"], counted["left"] + 0.5, 300.0 * speed, alpha=0.5)
impacts.set_yticks(place, [f"{period} s" for period in periods])
impacts.set(xlabel="time (s)", ylabel="building", title="impacts, area by approach velocity")
plt.show()

# %%
# A **wall** is a structure of infinite mass that is not driven: the moat of a base-isolated
# building, or the abutments of a bridge.

wall = per_obspy.Structure(1.0, 0.0, mass=np.inf, participation=0.0)
isolated = per_obspy.Structure(3.0, 0.1, 1e6)
moat = per_obspy.pounding_history(
    motion, scenario.dt, [wall, isolated, wall], gaps=[0.015, 0.02], restitution=0.4
)
impacts = moat.impacts["counted"].sum()
low, high = moat.displacement[1].min(), moat.displacement[1].max()
print(f"{impacts} impacts on walls 15 mm to the left and 20 mm to the right")
print(f"it moves from {low:.3f} to {high:.3f} m")
