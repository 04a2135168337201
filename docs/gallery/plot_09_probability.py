"""
Probability of contact
======================

Radii and gap of a pair are uncertain. The probability that the pair needs more than its gap falls
with the gap; how steeply depends on the uncertainty.
"""

import matplotlib.pyplot as plt
import numpy as np

import per_obspy

gap = np.linspace(0.0, 0.3, 200)
correlation = per_obspy.ddc_correlation(1.0, 0.05, 0.7, 0.05)
radii = 0.10, 0.07  # m, medians

figure, axes = plt.subplots(figsize=(6.0, 3.6), layout="constrained")
for dispersion in (0.1, 0.3, 0.6):
    probability = per_obspy.pounding_probability(
        *radii, correlation, gap, dispersion, dispersion, dispersion_correlation=0.8
    )
    axes.plot(100.0 * gap, probability, label=f"dispersion of each radius {dispersion}")
median = per_obspy.critical_gap(*radii, correlation)
axes.axvline(100.0 * median, color="black", linewidth=0.8, linestyle=":")
axes.annotate(" critical gap of the medians", (100.0 * median, 0.95))
axes.set(xlabel="gap (cm)", ylabel="probability of contact")
axes.legend()
plt.show()
