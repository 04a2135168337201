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
# One Dataset per station, one row per pair, worst first.

codes = sorted({trace.stats.station for trace in processed})
stations = [per_obspy.station_spectra(processed.select(station=code)) for code in codes]
longitudes = [float(station["longitude"]) for station in stations]
latitudes = [float(station["latitude"]) for station in stations]
pairs = simulated_pairs(longitudes, latitudes, count=200, seed=1, radius=1_500.0, touching=0.5)
table = per_obspy.risk_table(stations, pairs)
print(table[["pair_id", "risk_class", "state", "probability", "gap", "demand"]].head())

# %%
figure, axes = plt.subplots(figsize=(6.0, 4.6), layout="constrained")
points = axes.scatter(
    table["longitude"],
    table["latitude"],
    c=table["expected_impact_velocity"],
    cmap="viridis_r",
    s=25,
)
axes.plot(longitudes, latitudes, "k^", markerfacecolor="none", label="stations")
axes.set(xlabel="longitude (°)", ylabel="latitude (°)", title="200 pairs of buildings")
figure.colorbar(points, label="expected impact velocity (m/s)")
axes.legend()
plt.show()
