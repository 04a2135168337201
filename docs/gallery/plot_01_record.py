"""
A record and its spectra
========================

Read a record that comes with ObsPy and compare its pseudo energy radius (PER) with its spectral
displacement (SD).
"""

import matplotlib.pyplot as plt
import numpy as np
import obspy

import per_obspy

# ObsPy finds files of its own tests below "/path/to"; the counts of K-NET need their scale factor
trace = obspy.read("/path/to/test.knet")[0].detrend("demean")
acceleration = trace.data * trace.stats.calib  # m/s²

# %%
# PER is the largest radius of the motion in the plane of displacement and velocity over frequency.
# It is never below SD, and far above it at periods longer than those of the ground motion.

periods = np.geomspace(0.05, 10.0, 120)
spectra = per_obspy.response_spectra(acceleration, trace.stats.delta, periods, damping=0.05)

figure, (record, spectrum) = plt.subplots(1, 2, figsize=(9.0, 3.2), layout="constrained")
record.plot(trace.times(), acceleration, linewidth=0.7)
record.set(xlabel="time (s)", ylabel="acceleration (m/s²)", title=trace.id)
spectrum.loglog(periods, 1000.0 * spectra.per, label="PER")
spectrum.loglog(periods, 1000.0 * spectra.sd, label="SD", linestyle="--")
spectrum.set(xlabel="period (s)", ylabel="radius, displacement (mm)", title="damping 5 %")
spectrum.legend()
plt.show()
