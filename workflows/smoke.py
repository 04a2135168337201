"""The installed package at work in an otherwise empty folder."""

import numpy as np

import per_obspy

time = np.arange(4000) * 0.01
acceleration = np.exp(-(((time - 15.0) / 5.0) ** 2)) * np.sin(2.0 * np.pi * time)
per = per_obspy.per_spectrum(acceleration, 0.01, [0.5, 1.0, 2.0])
gap = per_obspy.critical_gap(per[0], per[1], per_obspy.ddc_correlation(0.5, 0.05, 1.0, 0.05))
print(f"PER {per.round(4)} m; critical gap of 0.5 s beside 1 s: {gap:.4f} m")
