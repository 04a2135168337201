"""
Figures of all benchmarks: one JSON file, and ``docs/benchmarks.md`` made of it.

    python tests/benchmarks/figures.py JSON [SCRIPT...]

runs the benchmarks (or only some scripts) and writes the page. Their figures replace those of
machines of the same maker (AMD, Intel) in the file; those of others stay. A script calls `note` for
every figure; run alone, it only prints.

Vectors are as wide as the command line chooses them; it leaves the choice to the compiler where
``NUMBA_CPU_NAME`` (e.g. as `llvmlite.binding.get_host_cpu_name` returns it) or
``NUMBA_CPU_FEATURES`` is set.
"""

import json
import math
import os
import platform
import re
import subprocess
import sys
from collections.abc import Iterable
from datetime import UTC, datetime
from importlib.metadata import PackageNotFoundError, version
from multiprocessing import current_process
from pathlib import Path
from typing import Any

FOLDER = Path(__file__).parent
PAGE, TEMPLATE = FOLDER.parents[1] / "docs" / "benchmarks.md", FOLDER / "page.md"
SCRIPTS = (
    *("start_up", "formats", "spectra", "stations", "pounding", "rows", "pair_estimates"),
    *("histories", "footprints", "screening"),
)

#: Feature in ``NUMBA_CPU_FEATURES`` by which the compiler uses full-width vectors.
FULL_WIDTH = "-prefer-256-bit"
#: Description of the processors, on Linux.
PROCESSORS = Path("/proc/cpuinfo")

#: File that takes one line per figure while the scripts run.
LINES = "PER_OBSPY_FIGURES"

#: Units of which less is better; of all others more is better.
LESS_IS_BETTER = ("s", "ms", "us", "ns", "GB")

#: Type of each field of a figure.
FIELDS: dict[str, type] = {
    **dict.fromkeys(("script", "name", "unit", "peer", "peer_version", "of", "remark"), str),
    **dict.fromkeys(("machine", "revision", "date"), str),
    **dict.fromkeys(("value", "load_before"), float),
}

Figure = dict[str, Any]


def note(
    name: str, value: float, unit: str, *, peer: str = "", of: str = "", remark: str = ""
) -> None:
    """
    Note one figure of the script that is run.

    Parameters
    ----------
    name : str
        Measured quantity; unique within the script.
    value : float
        Processor time, a rate, or memory.
    unit : str
        Of the value; see `LESS_IS_BETTER`.
    peer : str
        Distribution that was measured instead of this package, if any.
    of : str
        Figure of this package that does the same job as the peer.
    remark : str
        Differences or shares, in words.
    """
    path = os.environ.get(LINES)
    if not path:
        return
    figure = {"script": Path(sys.argv[0]).stem, "name": name, "value": float(f"{value:.4g}")}
    figure |= {"unit": unit, "peer": peer, "peer_version": _version(peer) if peer else ""}
    with Path(path).open("a", encoding="utf-8") as lines:
        lines.write(json.dumps({**figure, "of": of, "remark": remark}) + "\n")


def _version(distribution: str) -> str:
    """Return the version of an installed distribution."""
    try:
        return version(distribution)
    except PackageNotFoundError:
        return "unknown"


def machine() -> str:
    """Return processor, width of vectors, number of processors, system and Python in words."""
    model = platform.processor() or platform.machine()
    if PROCESSORS.is_file():
        facts = dict(re.findall(r"^(.*?)\s*: (.*)$", PROCESSORS.read_text("utf-8"), re.M))
        model = facts.get("model name", model)
        # Virtual machines give processors of several generations one name
        if {"cpu family", "model"} <= facts.keys():
            model += f" (family {facts['cpu family']}, model {facts['model']})"
    system = f"{platform.system()}, Python {platform.python_version()}"
    is_full = FULL_WIDTH in os.environ.get("NUMBA_CPU_FEATURES", "")
    vectors = "vectors of full width" if is_full else "width of vectors by the compiler"
    return f"{model}, {vectors}, {os.cpu_count()} processors, {system}"


def print_machine() -> None:
    """Print the machine of a benchmark, not once more by each process that it starts."""
    is_benchmark = Path(sys.argv[0]).resolve().parent == FOLDER.resolve()
    if is_benchmark and current_process().name == "MainProcess":
        print(machine(), flush=True)


def revision() -> str:
    """Return the git revision of the checkout, with + if it has changes."""
    git = ["git", "-C", str(FOLDER), "describe", "--always", "--dirty=+", "--exclude=*"]
    return subprocess.run(git, capture_output=True, text=True, check=True).stdout.strip()


def load_average() -> float:
    """Return how many processes wanted a processor in the last minute; 0 where unknown."""
    return os.getloadavg()[0] if hasattr(os, "getloadavg") else 0.0


def measured(scripts: Iterable[str], lines: Path) -> list[Figure]:
    """Run scripts one after the other and return their figures, with date, revision and load."""
    lines.unlink(missing_ok=True)
    environment = {**os.environ, LINES: str(lines), "OPENBLAS_NUM_THREADS": "1"}
    found: list[Figure] = []
    for script in scripts:
        print(f"== {script}", flush=True)
        before = load_average()
        command = [sys.executable, str(FOLDER / f"{script}.py")]
        subprocess.run(command, check=True, env=environment)
        state = {"machine": machine(), "load_before": round(before, 1), "revision": revision()}
        state["date"] = datetime.now(UTC).strftime("%Y-%m-%d")
        written = lines.read_text("utf-8").splitlines() if lines.is_file() else []
        found += [{**json.loads(line), **state} for line in written[len(found) :]]
    lines.unlink(missing_ok=True)
    return found


def read(path: Path) -> list[Figure]:
    """
    Read the figures of a file.

    Raises
    ------
    Damaged
        If it is no file of figures, or a figure lacks a field or has a value that is no measure.
    """
    try:
        figures: list[Figure] = json.loads(path.read_text("utf-8"))["figures"]
        problems = [problem for one in figures if (problem := _problem(one))]
    except (OSError, ValueError, KeyError, TypeError, AttributeError) as error:
        raise Damaged(f"{path}: no file of figures: {type(error).__name__} {error}") from error
    if problems:
        raise Damaged(f"{path}: {problems[0]}")
    return figures


class Damaged(ValueError):
    """A file of figures cannot be used; the message is one line."""


def _problem(figure: Figure) -> str:
    """Return the first fault of a figure, empty if there is none."""
    name = f"figure {figure.get('name')!r} of {figure.get('script')!r}"
    for field, kind in FIELDS.items():
        value = figure.get(field)
        known = (int, float) if kind is float else kind
        if not isinstance(value, known) or isinstance(value, bool):
            return f"{name}: {field} is {value!r}"
    # Ratios need a value above zero
    is_measure = math.isfinite(figure["value"]) and figure["value"] > 0.0
    return "" if is_measure else f"{name}: value is {figure['value']!r}"


def digits(value: float) -> str:
    """Return three digits of a number, without an exponent where it is large."""
    return f"{float(f'{value:.3g}'):.0f}" if abs(value) >= 1000.0 else f"{value:.3g}"


def tables(figures: list[Figure], script: str) -> str:
    """Return the figures of a script as a table for every machine, the last measured first."""
    own = [figure for figure in figures if figure["script"] == script]
    if not own:
        return "*Not measured in this run.*"
    machines = dict.fromkeys(figure["machine"] for figure in reversed(own))
    parts = ([one for one in own if one["machine"] == machine] for machine in machines)
    return "\n\n".join(map(_table, parts))


def _table(own: list[Figure]) -> str:
    """Return the figures of a script on one machine, after machine, date and versions."""
    values = {figure["name"]: figure["value"] for figure in own}
    rows = ["| figure | value | relative to ours | remark |", "|---|---|---|---|"]
    for one in own:
        ratio = digits(one["value"] / values[one["of"]]) if one["of"] in values else ""
        value = f"{digits(one['value'])} {one['unit']}"
        rows.append(f"| {one['name']} | {value} | {ratio} | {one['remark']} |")
    peers = sorted({f"{one['peer']} {one['peer_version']}" for one in own if one["peer"]})
    first = own[0]
    state = f"{first['machine']}; {first['date']}, revision {first['revision']}, "
    state += f"load before {first['load_before']}" + "".join(f"; {peer}" for peer in peers)
    return "\n".join([f"*{state}*", "", *rows])


def page(figures: list[Figure], template: str) -> str:
    """Return the page: the template, whose lines ``{{script}}`` become tables."""
    return re.sub(r"^\{\{(\w+)\}\}$", lambda name: tables(figures, name[1]), template, flags=re.M)


def main(path: Path, scripts: list[str]) -> None:
    """Measure, write the JSON file, and the page."""
    # A damaged file is found before hours of measurements
    kept = read(path) if path.is_file() else []
    found = measured(scripts or SCRIPTS, path.with_suffix(".lines"))
    # None of this maker is left from an earlier run of all
    again = {*(scripts or {figure["script"] for figure in kept})}
    own = machine().split()[0]
    kept = [one for one in kept if one["machine"].split()[0] != own or one["script"] not in again]
    figures = kept + found
    path.write_text(json.dumps({"figures": figures}, indent=1) + "\n", "utf-8")
    PAGE.write_text(page(figures, TEMPLATE.read_text("utf-8")), "utf-8")


# Every benchmark imports this module before Numba
print_machine()

if __name__ == "__main__":
    main(Path(sys.argv[1]), sys.argv[2:])
