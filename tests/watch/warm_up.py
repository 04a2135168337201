"""
Kernels that a command still compiles after ``per-obspy warm-up``, by hand: some minutes.

    python tests/watch/warm_up.py [FOLDER]

Compiles into an empty NUMBA_CACHE_DIR, then runs the smoke run and the demonstration with exact
histories, and 40 of its pairs with buildings that yield, one command after the other. Every
compiled kernel is a file, so that new files are kernels that the warm-up has missed; the exit code
is 1 if there is one. A folder keeps what was compiled by the warm-up for the next time.
"""

import os
import subprocess
import sys
import tempfile
from pathlib import Path

import pandas as pd

CHECKOUT = Path(__file__).parents[2]
SMOKE, DEMO = (CHECKOUT / "workflows" / name for name in ("smoke.toml", "demo.toml"))
PAIRS = CHECKOUT / "catalogs" / "demo" / "pairs.csv"


def compiled(folder: Path) -> set[str]:
    """Return the names of the compiled kernels in a folder."""
    return {path.name for path in folder.rglob("*.nbc")}


def call(folder: Path, *arguments: str) -> None:
    """Run a command with its kernels in a folder, on two processes."""
    command = [sys.executable, "-m", "per_obspy", *arguments]
    subprocess.run(command, env=os.environ | {"NUMBA_CACHE_DIR": str(folder)}, check=True)


def yielding_pairs(path: Path) -> Path:
    """Write 40 pairs of the demonstration, of which every second building can yield."""
    pairs = pd.read_csv(PAIRS, comment="#").head(40)
    pairs["yield_displacement_1"] = [0.01, None] * 20
    pairs.to_csv(path, index=False)
    return path


def main(kernels: Path, output: Path) -> int:
    """Print the kernels that each command adds; return the exit code."""
    if not compiled(kernels):
        call(kernels, "warm-up")
    known = compiled(kernels)
    print(f"warm-up: {len(known)} kernels")
    yielding = yielding_pairs(output / "yielding.csv")
    commands = {
        "smoke run": (str(SMOKE),),
        "demonstration, exact": (str(DEMO), "--set", "screening.exact=true"),
        "yielding pairs": (str(output / "demonstration, exact" / "simulated"), str(yielding)),
    }
    missed = 0
    for name, arguments in commands.items():
        folder = str(output / name)
        call(kernels, "run", *arguments, "-o", folder, "--set", "workers=2", "--quiet")
        new = compiled(kernels) - known
        known |= new
        missed += len(new)
        print(f"{name}: {len(new)} more {sorted(new) or ''}", flush=True)
    return 1 if missed else 0


if __name__ == "__main__":
    with tempfile.TemporaryDirectory() as temporary:
        work = Path(temporary)
        kept = Path(sys.argv[1]) if len(sys.argv) > 1 else work / "kernels"
        sys.exit(main(kept, work))
