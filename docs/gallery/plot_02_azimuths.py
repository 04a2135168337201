"""
All azimuths
============

A pair of buildings moves along its own axis. Compute PER along every azimuth of a simulated
motion, its median (RotD50) and its largest value (RotD100).
"""

import matplotlib.pyplot as plt
import numpy as np

import per_obspy
from per_obspy.config.pairs import Scenario
from per_obspy.simulation.earthquake import rock_acceleration

scenario = Scenario(magnitude=6.8)
north, east, _ = rock_acceleration(scenario, hypocentral=20_000.0)

azimuths = np.arange(180)
periods = [0.5, 1.0, 2.0]
per = per_obspy.azimuthal_per_spectrum(north, east, scenario.dt, periods, azimuths=azimuths)

figure, axes = plt.subplots(subplot_kw={"projection": "polar"}, figsize=(5.0, 5.0))
axes.set_theta_zero_location("N")
axes.set_theta_direction(-1)
for period, radius in zip(periods, per, strict=True):
    both = np.concatenate([radius, radius])  # the axis has no direction
    axes.plot(np.radians(np.arange(360)), 100.0 * both, label=f"{period} s")
axes.set_title("PER (cm) by azimuth of the axis")
axes.legend(loc="lower left", bbox_to_anchor=(-0.15, -0.15))
plt.show()

# %%
# RotD50 and RotD100 summarise the azimuths; a known azimuth is better than both.

for period, median, largest in zip(
    periods, per_obspy.rotd(per, 50), per_obspy.rotd(per, 100), strict=True
):
    print(f"{period} s: RotD50 {100 * median:.2f} cm, RotD100 {100 * largest:.2f} cm")
