"""
A run on a Dask cluster
=======================

``per_obspy.run`` hands stations and chunks of pairs to any executor. On a cluster that is the one
of a Dask client; here the cluster is two threads of this machine.
"""

import tempfile
from pathlib import Path

import matplotlib.pyplot as plt
import pandas as pd
from distributed import Client, LocalCluster

import per_obspy
from per_obspy.config import Run

folder = Path(tempfile.mkdtemp())
scenario = folder / "scenario.toml"
scenario.write_text("[scenario]\nstations = 2\nmagnitude = 6.5\n[pairs]\ncount = 40\n")
settings = Run(name="On a cluster", output=folder / "results", simulation=scenario)

# %%
# A real cluster has an address: ``Client("tcp://scheduler:8786")``. Its workers need the same
# version of per_obspy and the same folders.

with (
    LocalCluster(
        n_workers=1, threads_per_worker=2, processes=False, dashboard_address=None
    ) as cluster,
    Client(cluster) as client,
):
    result = per_obspy.run(settings, executor=client.get_executor())

table = pd.read_parquet(result.folder / "risk.parquet")
table.plot.scatter("gap", "demand", figsize=(5.0, 3.6), grid=True)
plt.title(f"{len(table)} pairs: gap and demand (m)")
plt.tight_layout()
plt.show()
