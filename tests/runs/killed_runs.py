"""
Copy the folder of the smallest run before its n-th change of the file system, for every n; go on.

Usage: ``python killed_runs.py FOLDER EVENT...``, events of Python's audit hook. Such a copy is what
a process leaves that is killed at this moment: part files, the lock, tables of earlier stages. A
run goes on in each of them. Prints one JSON object: the number of copies, and every fault of the
runs in them. It is a program of its own because only a process without threads can be forked
safely, and because an audit hook stays for ever.
"""

import json
import os
import shutil
import sys
from itertools import count
from pathlib import Path

sys.path.insert(0, str(Path(__file__).parent))

from small_run import InProcess, plain_reports, write_smallest_configuration

from per_obspy.files import is_part
from per_obspy.runs.run import run

#: Results that must be the same after every kill.
COMPARED = ("risk.csv", "risk.parquet", "rejected.csv", "totals.csv", "pairs.csv")


def copy_before_changes(events: list[str], out: Path, copies: Path) -> None:
    """Copy a folder before each change in it, as a killed process leaves it."""
    number = count(1)
    is_copied = False

    def hook(event: str, arguments: tuple[object, ...]) -> None:
        nonlocal is_copied
        if is_copied or event not in events or not str(arguments[0]).startswith(str(out)):
            return
        if event == "open" and not set(str(arguments[1] or "")) & set("wax+"):
            return
        # The copy itself changes files
        is_copied = True
        shutil.copytree(out, copies / str(next(number)))
        is_copied = False

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


def faults_of(configuration: Path, expected: dict[str, bytes]) -> list[str]:
    """Run, and return the faults of the results."""
    try:
        run(configuration, executor=InProcess())
    except Exception as error:  # noqa: BLE001 - whatever it is, it is the fault that is looked for
        return [f"the next run fails: {error!r}"]
    folder = configuration.parent / "out"
    faults = [name for name in expected if (folder / name).read_bytes() != expected[name]]
    return faults + [f"{path.name} is left" for path in folder.rglob("*") if is_part(path)]


def main(folder: Path, events: list[str]) -> None:
    """Go on from every copy of a run, and print the faults."""
    with plain_reports():
        copy_and_go_on(folder, events)


def copy_and_go_on(folder: Path, events: list[str]) -> None:
    """Copy and go on as `main` describes; figures and page are short files."""
    # The first run also compiles, so that the other ones are quick
    (folder / "whole").mkdir()
    whole = run(write_smallest_configuration(folder / "whole"), executor=InProcess()).folder
    expected = {name: (whole / name).read_bytes() for name in COMPARED}
    copies, place = folder / "copies", folder / "again"
    for made in (copies, place / "out"):
        made.mkdir(parents=True)
    configuration, out = write_smallest_configuration(place), place / "out"

    def copied_run() -> None:
        copy_before_changes(events, out, copies)
        run(configuration, executor=InProcess())

    # In a process that ends: part files of a living one would stay
    found = {0: ["the run that is copied fails"]} if ending_of(copied_run) else {}
    left = sorted(copies.iterdir(), key=lambda copy: int(copy.name))
    for copy in left:
        shutil.rmtree(out)
        copy.rename(out)
        if faults := faults_of(configuration, expected):
            found[int(copy.name)] = faults
    print(json.dumps({"kills": len(left), "faults": found}))


if __name__ == "__main__":
    main(Path(sys.argv[1]), sys.argv[2:])
