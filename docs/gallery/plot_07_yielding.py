"""
A pair that yields
==================

Buildings that yield move more alike than elastic ones of the same periods. Compare the relative
displacement of an elastic and of a bilinear pair in the same record.
"""

import matplotlib.pyplot as plt
import numpy as np

import per_obspy
from per_obspy.config.pairs import Scenario
from per_obspy.simulation.earthquake import rock_acceleration

scenario = Scenario(magnitude=7.2)
motion, dt = rock_acceleration(scenario, hypocentral=15_000.0)[0], scenario.dt
periods = (0.9, 0.6)
time = np.arange(motion.size) * dt

# %%
# Each building yields at a third of its elastic displacement; afterwards it has 5 % of its
# stiffness.

elastic, yielding = [], []
for period in periods:
    largest = float(per_obspy.response_spectra(motion, dt, [period]).sd[0])
    for limit, responses in ((np.inf, elastic), (largest / 3.0, yielding)):
        responses.append(per_obspy.bilinear_response(motion, dt, period, 0.05, limit, 0.05))

figure, axes = plt.subplots(figsize=(8.0, 3.4), layout="constrained")
for name, (first, second) in {"elastic": elastic, "yielding": yielding}.items():
    relative = first.displacement - second.displacement
    axes.plot(
        time, 100.0 * relative[: time.size], label=f"{name}: at most {100 * relative.max():.1f} cm"
    )
axes.set(xlabel="time (s)", ylabel="closing of the gap (cm)")
axes.legend()
plt.show()

print("ductilities", *(round(float(response.ductility), 1) for response in yielding))
