"""
Spectra with xarray
===================

``spectra.nc``, which every run writes, is a file that xarray opens. Here the same Dataset is made
from a Stream of two stations, stored and read again.
"""

import tempfile
from pathlib import Path

import matplotlib.pyplot as plt
import xarray as xr

import per_obspy
from per_obspy.config.pairs import Scenario
from per_obspy.simulation.earthquake import simulate

simulation = simulate(Scenario(magnitude=6.8, stations=2))
for trace in simulation.stream:
    trace.stats.response = simulation.inventory.get_response(trace.id, trace.stats.starttime)
spectra = per_obspy.stream_spectra(per_obspy.process(simulation.stream, event=simulation.event))
file = Path(tempfile.mkdtemp()) / "spectra.nc"
spectra.to_netcdf(file)

# %%
# Select by name and value: units and meanings are attributes.

stored = xr.open_dataset(file)
print(stored["per_rotd50"].dims, stored["per_rotd50"].attrs)

per_obspy.plot_spectra(stored, damping=0.05)
plt.show()
stored.close()
