"""
Make the golden runs of a state of the package, and compare those of two states.

    python workflows/golden.py make FOLDER [RUN ...]
    python workflows/golden.py compare OLD NEW [--tolerance 1e-12]

``make`` does every run below in a folder outside of the checkout with the installed package, and
writes exit code, processor time and peak memory of each into ``golden.json``. ``compare`` prints
one row per run: the largest relative difference of any number in tables and spectra, texts and
rows that differ, exit codes, and the ratios of time and memory. It ends with 1 where results
differ. Real records are those of ``PER_OBSPY_DATA``, else of ``../shared/data``; a folder that is
absent leaves out its runs by name.
"""

import argparse
import base64
import ctypes
import json
import os
import re
import shutil
import subprocess
import sys
import zlib
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd
import xarray as xr

CHECKOUT = Path(__file__).resolve().parents[1]
DATA = Path(os.environ.get("PER_OBSPY_DATA", CHECKOUT.parent / "shared" / "data"))

#: Run -> arguments of one or several commands, from the folder of the golden runs.
RUNS: dict[str, tuple[str, ...]] = {
    "smoke": ("run workflows/smoke.toml",),
    "demo": ("run workflows/demo.toml",),
    "ensemble": ("screen workflows/ensemble.toml",),
    "san_jose": (
        f"pairs {DATA}/inventories/footprints/san_jose_pilot_region_all_fields.gpkg "
        "-o output/san_jose_pairs.parquet",
        "run workflows/san_jose.toml",
    ),
    "guatemala": (
        f"pairs {DATA}/inventories/footprints/guatemala_pilot_region_all_fields.gpkg "
        "-o output/guatemala_pairs.parquet",
        "run workflows/guatemala.toml",
    ),
    "ridgecrest2019": ("run workflows/ridgecrest2019.toml",),
    "maule2010": ("run workflows/maule2010.toml",),
    "afad2023": ("run workflows/afad2023.toml",),
    "design": ("screen workflows/design.toml",),
    # An earthquake with several revisions and killed processes
    "watch": (f"{CHECKOUT}/workflows/rehearsal.py output/watch",),
    "shakemap": (
        f"run {DATA}/field/shakemap-antimeridian/anti.xml "
        f"{DATA}/field/shakemap-antimeridian/panti.csv -o output/shakemap",
    ),
}

#: Configurations that only the golden runs need.
RECORDS = """name = "{name}"
output = "../output/{name}"
[records]
folder = "{folder}"
[pairs.simulated]
count = 300
seed = 7
"""
DESIGN = """spectrum = "code.csv"
pairs = "../catalogs/demo/pairs.csv"
output = "../output/design"
"""
SPECTRUM = "period,damping,psa\n0.10,0.05,9.8\n0.50,0.05,9.8\n1.00,0.05,4.9\n4.00,0.05,1.2\n"

#: Files of a result that are compared, wherever they are.
TABLES = ("*.parquet", "*.csv")
TEXTS = ("summary.txt", "report.html")

#: Option of Linux by which a process adopts those that its children leave behind.
ADOPTS = 36

#: What a text may have of its own: versions, times, ports, paths, and seconds of work.
VOLATILE = re.compile(
    r"\d{4}-\d\d-\d\d[T ]\d\d:\d\d(:\d\d)?|\d+\.\d+\.\d+\w*|localhost:\d+|:\d{5}\b|/\S+"
)

#: Deflated data of a page.
PACKED = re.compile(r'(?<=id="data">)([\w+/=]{100,})(?=<)')


def prepare(folder: Path) -> None:
    """Copy configurations and catalogues into a folder, with the paths of real data."""
    shutil.copytree(CHECKOUT / "catalogs", folder / "catalogs", dirs_exist_ok=True)
    (folder / "workflows").mkdir(exist_ok=True)
    for path in (CHECKOUT / "workflows").glob("*.toml"):
        text = path.read_text(encoding="utf-8").replace("../../shared/data", str(DATA))
        (folder / "workflows" / path.name).write_text(text, encoding="utf-8")
    for name, records in (("maule2010", "maule2010_renadic"), ("afad2023", "afad2023")):
        text = RECORDS.format(name=name, folder=DATA / "records" / records)
        (folder / "workflows" / f"{name}.toml").write_text(text, encoding="utf-8")
    (folder / "workflows" / "design.toml").write_text(DESIGN, encoding="utf-8")
    (folder / "workflows" / "code.csv").write_text(SPECTRUM, encoding="utf-8")


def make(folder: Path, names: list[str]) -> None:
    """Do the runs, and write what each took."""
    prepare(folder)
    if sys.platform == "linux":
        ctypes.CDLL(None).prctl(ADOPTS, 1)
    file = folder / "golden.json"
    taken = json.loads(file.read_text()) if file.exists() else {}
    for name in names:
        codes, seconds, memory = [], 0.0, 0
        for command in RUNS[name]:
            with (folder / f"{name}.log").open("a", encoding="utf-8") as log:
                script = command.split()[0].endswith(".py")
                process = subprocess.Popen(
                    [sys.executable, *([] if script else ["-m", "per_obspy"]), *command.split()],
                    cwd=folder, stdout=log, stderr=log,
                )  # fmt: skip
                _, status, usage = os.wait4(process.pid, 0)
            process.returncode = os.waitstatus_to_exitcode(status)
            codes.append(process.returncode)
            # With the workers, which belong to a server for which no command waits
            for used in (usage, *_left_behind()):
                seconds += used.ru_utime + used.ru_stime
                memory = max(memory, used.ru_maxrss)
        taken[name] = {"exit": codes, "seconds": round(seconds, 2), "memory": memory}
        file.write_text(json.dumps(taken, indent=1))
        print(f"{name}: exit codes {codes}, {seconds:.1f} s of processor time", flush=True)


def _left_behind() -> Iterator[Any]:
    """Wait for the processes that a command has left, and yield what each has used."""
    while True:
        try:
            yield os.wait4(-1, 0)[2]
        except ChildProcessError:
            return


def compare(old: Path, new: Path, tolerance: float) -> bool:
    """Print one row per run, and return whether all results are equal."""
    before, after = (json.loads((one / "golden.json").read_text()) for one in (old, new))
    print("| run | files | largest relative difference | differs | exit | time | memory |")
    print("|---|---|---|---|---|---|---|")
    equal = True
    for name in before:
        first, second = before[name], after.get(name)
        if second is None:
            print(f"| {name} | | | missing | | | |")
            equal = False
            continue
        count, largest, differences = 0, 0.0, []
        for path in results(old, name):
            error, texts = difference(old / path, new / path)
            count, largest = count + 1, max(largest, error)
            differences += [f"{path.name}: {text}" for text in texts]
            if error > tolerance:
                differences.append(f"{path.name}: {error:.1e}")
        if first["exit"] != second["exit"]:
            differences.append("exit codes")
        equal &= not differences
        time_ratio, memory_ratio = (second[key] / first[key] for key in ("seconds", "memory"))
        print(
            f"| {name} | {count} | {largest:.1e} | {'; '.join(differences[:5])} | "
            f"{second['exit']} | {time_ratio:.2f} | {memory_ratio:.2f} |"
        )
    return equal


def results(folder: Path, name: str) -> Iterator[Path]:
    """Yield the compared files of a run, relative to the folder of the golden runs."""
    for pattern in (*TABLES, *TEXTS, "*.nc"):
        for path in sorted((folder / "output" / name).rglob(pattern)):
            if "chunks" not in path.parts and "columns.csv" not in path.name:
                yield path.relative_to(folder)


def difference(old: Path, new: Path) -> tuple[float, list[str]]:
    """Return the largest relative difference of numbers, and what else differs."""
    if not new.exists():
        return 0.0, ["missing"]
    if old.suffix == ".parquet":
        return _of_tables(pd.read_parquet(old), pd.read_parquet(new))
    if old.suffix == ".csv":
        return _of_tables(*(pd.read_csv(path, low_memory=False) for path in (old, new)))
    if old.suffix == ".nc":
        with xr.open_dataset(old) as first, xr.open_dataset(new) as second:
            missing = sorted(set(first.variables) ^ set(second.variables))
            numbers = [name for name in first.variables if name not in missing]
            pairs = ((first[name].values, second[name].values) for name in numbers)
            errors = [_of_arrays(*pair) for pair in pairs]
        return max(errors, default=0.0), [f"variables {missing}"] if missing else []
    lines = [VOLATILE.sub("", PACKED.sub(_unpack, path.read_text())) for path in (old, new)]
    return 0.0, [] if lines[0] == lines[1] else ["text"]


def _unpack(data: re.Match[str]) -> str:
    """Return the data that a page carries deflated, a character per byte."""
    # The first four bytes are the length of the texts, paths included
    return zlib.decompress(base64.b64decode(data[1]))[4:].decode("latin-1")


def _of_tables(old: pd.DataFrame, new: pd.DataFrame) -> tuple[float, list[str]]:
    """Return the largest relative difference of two tables, and columns and rows that differ."""
    columns = sorted(map(str, set(old) ^ set(new)))
    texts = [f"columns {columns}"] if columns else []
    if len(old) != len(new):
        return 0.0, [*texts, f"{len(old)} and {len(new)} rows"]
    largest = 0.0
    for name in (column for column in old if column in new):
        if all(pd.api.types.is_numeric_dtype(table[name]) for table in (old, new)):
            pair = (table[name].to_numpy(float, na_value=np.nan) for table in (old, new))
            largest = max(largest, _of_arrays(*pair))
            continue
        cells = [
            table[name].astype(str).str.replace(VOLATILE, "", regex=True) for table in (old, new)
        ]
        if not cells[0].equals(cells[1]):
            texts.append(f"{name}")
    return largest, texts


def _of_arrays(old: Any, new: Any) -> float:
    """Return the largest difference of two arrays over their size; infinity where none fits."""
    if old.shape != new.shape:
        return np.inf
    if old.dtype.kind not in "fiub":
        return 0.0 if (old == new).all() else np.inf
    old, new = old.astype(float), new.astype(float)
    if not np.array_equal(np.isnan(old), np.isnan(new)):
        return np.inf
    scale = np.maximum(np.maximum(abs(old), abs(new)), np.finfo(float).tiny)
    with np.errstate(invalid="ignore"):
        return float(np.nanmax(np.where(old == new, 0.0, abs(old - new) / scale), initial=0.0))


def main() -> None:
    """Make or compare golden runs."""
    parser = argparse.ArgumentParser(description=__doc__)
    commands = parser.add_subparsers(dest="command", required=True)
    maker = commands.add_parser("make")
    maker.add_argument("folder", type=Path)
    maker.add_argument("runs", nargs="*", metavar="RUN", help=f"of {', '.join(RUNS)}")
    comparison = commands.add_parser("compare")
    comparison.add_argument("old", type=Path)
    comparison.add_argument("new", type=Path)
    comparison.add_argument("--tolerance", type=float, default=1e-12)
    arguments = parser.parse_args()
    if arguments.command == "make":
        names = arguments.runs or list(RUNS)
        if unknown := sorted(set(names) - set(RUNS)):
            parser.error(f"no such run: {', '.join(unknown)}, one of {', '.join(RUNS)}")
        arguments.folder.mkdir(parents=True, exist_ok=True)
        real = [name for name in names if str(DATA) in "".join(RUNS[name])]
        absent = [] if DATA.is_dir() else real
        if absent:
            print(f"left out, no real data at {DATA}: {', '.join(absent)}")
        make(arguments.folder, [name for name in names if name not in absent])
    elif not compare(arguments.old, arguments.new, arguments.tolerance):
        sys.exit(1)


if __name__ == "__main__":
    main()
