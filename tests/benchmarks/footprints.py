"""
Time and memory of ``per-obspy pairs`` for a simulated city.

Run: ``python tests/benchmarks/footprints.py [houses]``; prints features, pairs, seconds of
processor and clock, and the largest memory of the command, from its start to its files.
"""

import resource
import subprocess
import sys
import tempfile
import time
from pathlib import Path

import pyarrow.parquet
import pyogrio
import shapely
from city import city
from figures import note


def write_city(houses: int, path: Path) -> int:
    """Write the footprints of a city and return their number."""
    made = city(houses)
    wkb = shapely.to_wkb(made.outlines)
    pyogrio.raw.write(
        path, wkb, [made.storeys], ["storeys"], geometry_type="Polygon", crs="EPSG:4326"
    )
    return len(made.outlines)


def main(houses: int) -> None:
    """Print one line."""
    with tempfile.TemporaryDirectory() as folder:
        path, pairs = Path(folder) / "city.gpkg", Path(folder) / "pairs.parquet"
        features = write_city(houses, path)
        command = [sys.executable, "-m", "per_obspy", "pairs", str(path), "-o", str(pairs)]
        clock = time.perf_counter()
        subprocess.run(command, check=True)
        clock = time.perf_counter() - clock
        count = pyarrow.parquet.read_metadata(pairs).num_rows
    used = resource.getrusage(resource.RUSAGE_CHILDREN)
    processor = used.ru_utime + used.ru_stime
    print(
        f"{features} features: {count} pairs; {processor:.1f} s processor, {clock:.1f} s, "
        f"{used.ru_maxrss / 1e6:.2f} GB"
    )
    note(f"{features} outlines to pairs, processor time", processor, "s")
    note(f"{features} outlines to pairs, memory", used.ru_maxrss / 1e6, "GB")


if __name__ == "__main__":
    main(int(sys.argv[1]) if len(sys.argv) > 1 else 100_000)
