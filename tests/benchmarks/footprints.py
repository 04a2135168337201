"""
Time and memory of ``pairs_from_footprints`` for a simulated city.

Run: ``python tests/benchmarks/footprints.py [houses]``; prints features, pairs, rejections by kind,
seconds of processor and clock, and the largest memory (of the whole process, and before the call).
"""

import resource
import sys
import tempfile
import time
from collections import Counter
from pathlib import Path

import pyogrio
import shapely
from city import city

from per_obspy import pairs_from_footprints


def memory() -> float:
    """Return the largest memory so far, GB."""
    return resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 1e6


def main(houses: int) -> None:
    """Print one line."""
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / "city.gpkg"
        made = city(houses)
        pyogrio.raw.write(
            path,
            shapely.to_wkb(made.outlines),
            [made.storeys],
            ["storeys"],
            geometry_type="Polygon",
            crs="EPSG:4326",
        )
        features = len(made.outlines)
        del made
        before, clock, processor = memory(), time.perf_counter(), time.process_time()
        pairs = pairs_from_footprints(path)
        clock, processor = time.perf_counter() - clock, time.process_time() - processor
    lost = Counter(one.kind for one in pairs.attrs["rejected"])
    print(
        f"{features} features: {len(pairs)} pairs; {lost['building']} buildings and "
        f"{lost['pair']} pairs rejected; "
        f"{processor:.1f} s processor, {clock:.1f} s, {memory():.2f} GB ({before:.2f} GB before)"
    )


if __name__ == "__main__":
    main(int(sys.argv[1]) if len(sys.argv) > 1 else 100_000)
