"""
Time of ``pairs_from_footprints`` for a synthetic town.

Run: ``python tests/benchmarks/footprints.py [buildings]``; prints buildings, pairs, seconds of processor and clock, and
the largest memory.
"""

import resource
import sys
import tempfile
import time
from pathlib import Path

import numpy as np
import pyogrio
import shapely
from pyproj import Transformer

from per_obspy import pairs_from_footprints


def write_town(path: Path, buildings: int) -> None:
    """Write streets of a thousand houses of 10 m; half of them touch the next one, the others stand 0.3 m apart."""
    generator = np.random.default_rng(1)
    column, street = np.arange(buildings) % 1000, np.arange(buildings) // 1000
    wide = 10.0 + 0.3 * (generator.random(buildings) < 0.5)
    metres = shapely.box(column * 10.3, street * 25.0, column * 10.3 + wide, street * 25.0 + 12.0)
    local = "+proj=tmerc +lon_0=-67.95 +lat_0=-20.35 +datum=WGS84"
    to_degrees = Transformer.from_crs(local, "OGC:CRS84", always_xy=True)
    degrees = shapely.transform(metres, lambda xy: np.column_stack(to_degrees.transform(*xy.T)))
    storeys = generator.integers(1, 9, buildings).astype(float)
    pyogrio.raw.write(path, shapely.to_wkb(degrees), [storeys], ["storeys"], geometry_type="Polygon", crs="EPSG:4326")


def main(buildings: int) -> None:
    """Print one line."""
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / "town.gpkg"
        write_town(path, buildings)
        clock, processor = time.perf_counter(), time.process_time()
        pairs = pairs_from_footprints(path)
        clock, processor = time.perf_counter() - clock, time.process_time() - processor
    memory = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 1e6
    print(f"{buildings} buildings, {len(pairs)} pairs: {processor:.1f} s processor, {clock:.1f} s, {memory:.2f} GB")


if __name__ == "__main__":
    main(int(sys.argv[1]) if len(sys.argv) > 1 else 100_000)
