"""
Kill the smallest run before its n-th change of the file system, for every n; then run it again.

Usage: ``python killed_runs.py FOLDER EVENT...``, events of Python's audit hook. Prints one JSON
object: the number of kills, and every fault of the runs that came after them. It is a program of
its own because only a process without threads can be forked safely.
"""

import json
import os
import shutil
import sys
from itertools import count
from pathlib import Path

sys.path.insert(0, str(Path(__file__).parent))

from small_run import InProcess, plain_figures, write_smallest_configuration

from per_obspy.files import is_part
from per_obspy.pipeline.run import run

#: Exit code of a process that was killed.
KILLED = 9

#: Results that must be the same after every kill.
COMPARED = ("risk.csv", "risk.parquet", "rejected.csv", "totals.csv", "pairs.csv")


def kill_at(number: int, events: list[str], folder: Path) -> None:
    """End this process before the n-th change of a folder, as a killed process ends."""
    left = number

    def hook(event: str, arguments: tuple[object, ...]) -> None:
        nonlocal left
        if event not in events or not str(arguments[0]).startswith(str(folder)):
            return
        if event == "open" and not set(str(arguments[1] or "")) & set("wax+"):
            return
        # A killed process runs no handler
        left -= 1
        if not left:
            os._exit(KILLED)

    sys.addaudithook(hook)


def ending_of(work) -> int:
    """Return the exit code of some work in a process of its own."""
    child = os.fork()
    if not child:
        code = 1
        try:
            work()
            code = 0
        finally:
            os._exit(code)
    return os.waitstatus_to_exitcode(os.waitpid(child, 0)[1])


def killed_run(configuration: Path, number: int, events: list[str]) -> None:
    """Run, and be killed before the n-th change."""
    kill_at(number, events, configuration.parent / "out")
    run(configuration, executor=InProcess())


def faults_after(configuration: Path, expected: dict[str, bytes]) -> list[str]:
    """Run again after a kill, and return the faults of the results."""
    if ending_of(lambda: run(configuration, executor=InProcess())):
        return ["the next run fails"]
    folder = configuration.parent / "out"
    faults = [name for name in expected if (folder / name).read_bytes() != expected[name]]
    return faults + [f"{path.name} is left" for path in folder.rglob("*") if is_part(path)]


def main(folder: Path, events: list[str]) -> None:
    """Kill runs until one completes, and print the faults after the kills."""
    with plain_figures():
        kill_and_repeat(folder, events)


def kill_and_repeat(folder: Path, events: list[str]) -> None:
    """Kill runs as `main` describes; figures are short files."""
    # The first run also compiles, so that the other ones are quick
    (folder / "whole").mkdir()
    whole = run(write_smallest_configuration(folder / "whole"), executor=InProcess()).folder
    expected = {name: (whole / name).read_bytes() for name in COMPARED}
    found = dict[int, list[str]]()
    for number in count(1):
        place = folder / str(number)
        place.mkdir()
        configuration = write_smallest_configuration(place)
        code = ending_of(lambda: killed_run(configuration, number, events))  # noqa: B023
        if code == 0:
            break
        faults = faults_after(configuration, expected)
        if code != KILLED or faults:
            found[number] = [*faults, f"exit code {code}"]
        shutil.rmtree(place)
    print(json.dumps({"kills": number - 1, "faults": found}))


if __name__ == "__main__":
    main(Path(sys.argv[1]), sys.argv[2:])
