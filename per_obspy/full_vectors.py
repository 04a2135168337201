"""
Full-width vectors on processors for which the compiler prefers half of them.

The compiler's tuning of Intel server cores prefers vectors of 256 bits where the core has 512. Both
are measured once per machine, in processes of their own; what was measured is stored with the
compiled kernels. The choice is an environment variable of this process and of those that it starts.
It is made for the command line only, before Numba is imported.
"""

import contextlib
import json
import os
import platform
import subprocess
import sys
from collections.abc import Mapping
from pathlib import Path

#: Description of the processors, on Linux, and the part of it that is read.
PROCESSORS, DESCRIPTION = Path("/proc/cpuinfo"), 8192

#: Variables by which a user chooses instead.
CHOSEN = ("NUMBA_CPU_NAME", "NUMBA_CPU_FEATURES")

#: Speed over that of half the width from which full width pays.
PAYS = 1.1

#: Feature that turns the preference off.
FULL_WIDTH = "-prefer-256-bit"

#: Longest measurement, s.
LONGEST = 120.0


def use_full_vectors() -> None:
    """Choose full-width vectors for this process and those it starts, where they are faster."""
    if "numba" in sys.modules or any(name in os.environ for name in CHOSEN):
        return
    model = wide_processor()
    if model:
        speeds = stored_speeds(model)
        if speeds and speeds["full"] > PAYS * speeds["half"]:
            os.environ["NUMBA_CPU_FEATURES"] = full_width_features()


def wide_processor() -> str:
    """Return the model of an Intel processor with vectors of 512 bits, else an empty text."""
    if platform.machine() != "x86_64" or not PROCESSORS.exists():
        return ""
    # facts of the first processor
    with PROCESSORS.open(errors="replace") as file:
        text = file.read(DESCRIPTION)
    facts = dict(line.partition(":")[::2] for line in text.split("\n\n")[0].splitlines())
    facts = {name.strip(): value.strip() for name, value in facts.items()}
    is_wide = "avx512f" in facts.get("flags", "").split()
    is_intel = facts.get("vendor_id") == "GenuineIntel"
    return facts.get("model name", "unknown") if is_wide and is_intel else ""


def full_width_features() -> str:
    """Return the features of this processor without the preference for half the width."""
    from llvmlite.binding import get_host_cpu_features

    return f"{get_host_cpu_features().flatten()},{FULL_WIDTH}"


def stored_speeds(model: str) -> dict[str, float]:
    """Return the speeds of a processor, measured now if they are not stored; empty if unknown."""
    path = _store()
    try:
        stored = json.loads(path.read_text())
        return {width: float(stored[model][width]) for width in ("half", "full")}
    except (OSError, ValueError, KeyError, TypeError):
        pass
    # without a place to store them they would be measured again and again
    if not os.access(path.parent, os.W_OK):
        return {}
    speeds = measured_speeds()
    if speeds:
        unfinished = path.with_name(f"{path.name}.{os.getpid()}")
        # a full disk is found by what is written there later
        with contextlib.suppress(OSError):
            unfinished.write_text(json.dumps({model: speeds}))
            unfinished.replace(path)
    return speeds


def measured_speeds() -> dict[str, float]:
    """Return billion multiply-adds per second at half and at full width; empty if one fails."""
    half, full = _speed({}), _speed({"NUMBA_CPU_FEATURES": full_width_features()})
    return {"half": half, "full": full} if half and full else {}


def _speed(variables: Mapping[str, str]) -> float:
    """Return the speed of a process with additional environment variables; 0 if it fails."""
    command = [sys.executable, "-m", "per_obspy.kernels.vector_width"]
    try:
        done = subprocess.run(
            command,
            env={**os.environ, **variables},
            capture_output=True,
            text=True,
            timeout=LONGEST,
            check=True,
        )
        return float(done.stdout)
    except (OSError, subprocess.SubprocessError, ValueError):
        return 0.0


def _store() -> Path:
    """Return the file of the speeds: in the folder of compiled kernels."""
    folder = os.environ.get("NUMBA_CACHE_DIR")
    caches = Path(folder) if folder else Path(__file__).parent / "kernels" / "__pycache__"
    return caches / "vector_speeds.json"
