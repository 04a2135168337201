"""
Exact history and its impacts
=============================

Follow two buildings through a record at half of the gap that they need: displacements, impacts,
and the energy that each impact moves from one building to the other.
"""

import matplotlib.pyplot as plt

import per_obspy
from per_obspy.config.pairs import Scenario
from per_obspy.simulation.earthquake import rock_acceleration

scenario = Scenario(magnitude=6.8)
motion = rock_acceleration(scenario, hypocentral=20_000.0)[0]

left = per_obspy.Structure(period=1.2, damping=0.05, mass=4e5)
right = per_obspy.Structure(period=0.6, damping=0.05, mass=3e5)
needed = per_obspy.relative_displacement(motion, scenario.dt, 1.2, 0.05, 0.6, 0.05)
gap = 0.5 * float(needed.one_before_two)
history = per_obspy.pounding_history(motion, scenario.dt, [left, right], gap, restitution=0.65)

# %%
# The building on the right is drawn at its distance, so that curves that touch are an impact.

impacts = history.impacts
figure, (motions, energy) = plt.subplots(
    2, 1, figsize=(8.0, 5.0), sharex=True, layout="constrained"
)
motions.plot(history.time, 100.0 * history.displacement[0], label="left, 1.2 s")
motions.plot(history.time, 100.0 * (history.displacement[1] + gap), label="right, 0.6 s")
motions.plot(impacts["time"], 100.0 * impacts["displacement_1"], "k.", label="impacts")
motions.set(ylabel="place (cm)")
motions.legend(loc="upper right", ncols=3)
transferred = impacts["transfer_energy_1"].cumsum()
energy.step(impacts["time"], transferred / 1000.0, where="post", label="from left to right")
energy.step(impacts["time"], impacts["energy_loss"].cumsum() / 1000.0, where="post", label="lost")
energy.set(xlabel="time (s)", ylabel="energy (kJ)")
energy.legend(loc="upper right")
plt.show()

print(f"{len(impacts)} impacts, energy balance closes to {history.closure:.1e}")
