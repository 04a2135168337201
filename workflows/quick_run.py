"""
From two folders to a table: a recorded session, written as docs/quick_run.md.

Run it as ``python workflows/quick_run.py``; real data are those of PER_OBSPY_DATA, else of
``../shared/data``. The records are those of Ridgecrest 2019 (M7.1). The outlines are a quarter of
San José that is moved to Ridgecrest, so that records and buildings meet: the results hold for
no town.
"""

import os
import re
import shutil
import subprocess
import sys
import tempfile
import time
from pathlib import Path

import numpy as np
import pyogrio
import shapely

CHECKOUT = Path(__file__).resolve().parents[1]
DATA = Path(os.environ.get("PER_OBSPY_DATA", CHECKOUT.parent / "shared" / "data"))
PAGE = CHECKOUT / "docs" / "quick_run.md"

#: Ridgecrest, longitude and latitude, degrees.
TOWN = np.array([-117.67, 35.625])

#: What is typed, and what is said of it.
SESSION = (
    (
        "ls buildings; ls records | head -5",
        "Two folders: what a survey drew, and what an agency sent.",
    ),
    ("per-obspy info records", "What are they?"),
    ("per-obspy info buildings", ""),
    ("per-obspy run records buildings -o out", "One command to the table."),
    ("per-obspy info out", "What came out:"),
    ("head -4 out/risk.csv | cut -d, -f1-6", ""),
    ("per-obspy run records buildings -o out | head -1", "The same command again ends at once."),
    (
        "per-obspy run records buildings -o out --set screening.exat=false",
        "Every key of the configuration can be set, and a mistyped one is found.",
    ),
    ("per-obspy init", "For later: a configuration with every key and its help."),
    ("grep -v '^#' run.toml | grep . | head -6", ""),
    ("sed -n '/^.processing.$/,/^#order/p' run.toml", ""),
    ("per-obspy run . -o out | head -1", "It is the same run, which is complete."),
)

HEAD = """# A quick run

<!-- no block is run: workflows/quick_run.py records this page from real records in five minutes -->

From two folders to a table, as it was typed and printed; `python workflows/quick_run.py` records it
again. The records are real (Ridgecrest 2019, M7.1, eleven stations). The outlines are a quarter of
San José, **moved** to Ridgecrest so that records and buildings meet: the numbers describe no
town. Lines that count stations are shortened, and long lines end with `…`. Kernels were compiled
before; the very first run of an installation takes one to two minutes more.

"""


def main() -> None:
    """Type the session in an empty folder and write the page."""
    with tempfile.TemporaryDirectory() as folder:
        desk = Path(folder)
        fill(desk)
        parts, started = [HEAD], time.monotonic()
        for command, words in SESSION:
            began = time.monotonic()
            output = typed(command, desk)
            seconds = f"  # {time.monotonic() - began:.0f} s"
            parts.append(f"{words}\n\n" if words else "")
            is_ours = command.startswith("per-obspy")
            parts.append(f"```console\n$ {command}{seconds if is_ours else ''}\n{output}```\n\n")
    parts.append(f"All of it took {time.monotonic() - started:.0f} s on two cores.\n")
    PAGE.write_text("".join(parts), encoding="utf-8")
    print(PAGE)


def fill(desk: Path) -> None:
    """Put records and outlines on the desk."""
    shutil.copytree(DATA / "records" / "ridgecrest2019_mseed", desk / "records")
    layer = DATA / "inventories" / "footprints" / "san_jose_pilot_region_all_fields.gpkg"
    meta, _, geometries, fields = pyogrio.raw.read(layer)
    outlines = shapely.from_wkb(geometries)
    # Longitudes widen with the latitude, so that widths in metres stay
    centre = shapely.get_coordinates(outlines[shapely.is_valid_input(outlines)]).mean(axis=0)[:2]
    wider = np.cos(np.deg2rad(centre[1])) / np.cos(np.deg2rad(TOWN[1]))
    moved = shapely.transform(outlines, lambda xy: TOWN + (xy - centre) * [wider, 1.0])
    (desk / "buildings").mkdir()
    pyogrio.raw.write(
        desk / "buildings" / "quarter.gpkg",
        shapely.to_wkb(moved),
        fields,
        meta["fields"],
        crs=meta["crs"],
        geometry_type=meta["geometry_type"],
    )


def typed(command: str, desk: Path) -> str:
    """Return the output of a command, with the folder of the desk as ~ and progress shortened."""
    program = f"{sys.executable} -m per_obspy"
    done = subprocess.run(
        command.replace("per-obspy", program),
        shell=True,  # pipes are part of the session
        cwd=desk,
        stdout=subprocess.PIPE,
        stderr=subprocess.STDOUT,
        text=True,
        check=False,
    )
    text = done.stdout.replace(str(desk), "~").replace("python -m per_obspy", "per-obspy")
    lines = [line for line in text.splitlines() if not is_step(line)]
    return "".join(f"{line if len(line) <= 120 else line[:119] + '…'}\n" for line in lines)


def is_step(line: str) -> bool:
    """Return whether a line only counts, between the first and the last of its stage."""
    step = re.fullmatch(r".*: (\d+) of (\d+)", line)
    return step is not None and step[1] != step[2]


if __name__ == "__main__":
    main()
