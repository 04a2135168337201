"""All that a job needs, loaded as this is imported: by the server of which workers are copies."""

from importlib import import_module

from per_obspy.garbage import keep_all, no_search
from per_obspy.kernels._jit import load_stored

with no_search():
    for name in (
        "per_obspy.runs.tasks.station",
        "per_obspy.runs.tasks.chunk",
        "per_obspy.runs.tasks.building_rows",
        "obspy.taup",
        "obspy.signal.invsim",
        "obspy.signal.trigger",
    ):
        import_module(name)
    load_stored()
keep_all()
