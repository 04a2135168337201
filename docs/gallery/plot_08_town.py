"""
Risk table of a town
====================

Simulate an earthquake at six stations, process the records, and rank 200 pairs of buildings.
"""

import matplotlib.pyplot as plt

import per_obspy
from per_obspy.config.pairs import Scenario
from per_obspy.simulation.buildings import simulated_pairs
from per_obspy.simulation.earthquake import simulate

scenario = Scenario(magnitude=7.3, stations=6, city_radius=6_000.0)
simulation = simulate(scenario)
for trace in simulation.stream:
    trace.stats.response = simulation.inventory.get_response(trace.id, trace.stats.starttime)
processed = per_obspy.process(simulation.stream, event=simulation.event)

# %%
# Spectra of all stations; then one row per pair, worst first. Of records in a folder and a table of
# pairs in a file, ``per_obspy.screen("records", "pairs.csv")`` returns the same, and
# ``per_obspy.read_records("records")`` the Stream.

codes = sorted({trace.stats.station for trace in processed})
stations = [per_obspy.station_spectra(processed.select(station=code)) for code in codes]
longitudes = [float(station["longitude"]) for station in stations]
latitudes = [float(station["latitude"]) for station in stations]
pairs = simulated_pairs(longitudes, latitudes, count=200, seed=1, radius=1_500.0, touching=0.5)
table = per_obspy.risk_table(stations, pairs)
print(table[["pair_id", "risk_class", "state", "probability", "gap", "demand"]].head())

# %%
# Figures are matplotlib axes.

figure, (left, right) = plt.subplots(1, 2, figsize=(9.0, 4.0), layout="constrained")
per_obspy.plot_risk(table, left)
left.plot(longitudes, latitudes, "k^", markerfacecolor="none")
# The worst pair that does not touch
apart = table[table["gap"] > 0].iloc[0]
per_obspy.plot_pair(apart, right)
plt.show()
