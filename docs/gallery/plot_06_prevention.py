"""
Damping, link and bumper
========================

Three ways to keep a pair from harming each other, where the gap is 85 % of that needed.
"""

import matplotlib.pyplot as plt
import numpy as np

import per_obspy
from per_obspy.config.pairs import Scenario
from per_obspy.simulation.earthquake import rock_acceleration

scenario = Scenario(magnitude=6.8)
motion, dt = rock_acceleration(scenario, hypocentral=20_000.0)[0], scenario.dt
left = per_obspy.Structure(period=1.2, damping=0.05, mass=4e5)
right = per_obspy.Structure(period=0.6, damping=0.05, mass=3e5)
needed = per_obspy.relative_displacement(motion, dt, 1.2, 0.05, 0.6, 0.05).one_before_two
gap = 0.85 * float(needed)

# %%
# **Damping** added to both buildings (an estimate by PER), and the softest of 60 **links** between
# them with which the gap never closes (exact). A link changes both periods, so that a stiffer one
# need not be better: all are tried.

damping = per_obspy.supplemental_damping(motion, dt, 1.2, 0.05, 0.6, 0.05, gap)
print(f"damping: {damping.damping:.3f} of critical, added to both buildings")
for stiffness in np.geomspace(1e5, 1e9, 60):
    link = per_obspy.linked_history(motion, dt, left, right, stiffness)
    if link.closing <= gap:
        print(f"link: {stiffness / 1e6:.1f} MN/m, which carries {link.force_maximum / 1e3:.0f} kN")
        break

# %%
# A **bumper** lowers the restitution. It does not prevent the impact, but limits what the impact
# does: the largest radius after the single hit over the radius before.

per = per_obspy.per_spectrum(motion, dt, [1.2, 0.6])
critical = per_obspy.critical_gap(*per, per_obspy.ddc_correlation(1.2, 0.05, 0.6, 0.05))
restitution = np.linspace(0.0, 1.0, 50)
hit = per_obspy.single_hit(*per, 1.2, 0.6, left.mass, right.mass, restitution, critical, gap)

figure, axes = plt.subplots(figsize=(5.5, 3.4), layout="constrained")
axes.plot(restitution, hit.amplification_1, label="left, 1.2 s")
axes.plot(restitution, hit.amplification_2, label="right, 0.6 s")
axes.set(xlabel="coefficient of restitution", ylabel="amplification of the radius")
axes.legend()
plt.show()
