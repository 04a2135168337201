"""
Damaged files through every reader, within limits of memory and time; run as a program.

    python tests/fuzzing/fuzz.py COUNT [SEED] [ENTRY ...]
    python tests/fuzzing/fuzz.py --again

reads COUNT damaged copies of every kind of file (``entries.py``) and prints one JSON line per kind:
the number of files that were read, refused, and at fault. A fault is any error but the package's
own, a message of many lines or characters, a number that is not finite, more than ``MEMORY``, more
than ``SECONDS``, or the end of the process. The copies at fault are kept in ``findings/ENTRY/``,
and ``--again``, which ``test_fuzzing.py`` does too, reads only those.
"""

import hashlib
import json
import logging
import random
import resource
import signal
import sys
import warnings
from collections import Counter
from collections.abc import Callable, Iterable
from multiprocessing import get_context
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any

import numpy as np

HERE = Path(__file__).parent
for folder in ("formats", "records", "inventory/footprints", "inventory/files", "fuzzing"):
    sys.path.insert(0, str(HERE.parent / folder))

from entries import Entry, entries  # noqa: E402 - found by the lines above
from mutants import damaged  # noqa: E402

from per_obspy.errors import PerError  # noqa: E402

#: Memory that all damaged files of a kind may take beside that of the program, bytes: the longest
#: file has a few MB, lists of its words take some 60 bytes for each.
MEMORY = 768 * 1024**2

#: Processor time that one damaged file may take, s: most take a few ms; it stops what never ends.
SECONDS = 10

#: Characters of a message.
LONGEST_MESSAGE = 2500

FINDINGS = HERE / "findings"

#: Return damaged copies, given a sample.
Copies = Callable[[bytes], Iterable[bytes]]


def problem_of(entry: Entry, content: bytes) -> str | None:
    """Return the fault of a reader with a file, ``refused``, or None if it was read."""
    with TemporaryDirectory() as folder:
        path = Path(folder, "in", entry.file)
        path.parent.mkdir()
        path.write_bytes(content)
        signal.setitimer(signal.ITIMER_PROF, SECONDS)
        try:
            return _wrong_numbers(list(entry.read(path)))
        except PerError as error:
            return _wrong_message(str(error))
        except MemoryError:
            return "it takes too much memory"
        except Exception as error:  # noqa: BLE001 - any other error is the fault that is looked for
            return f"{type(error).__name__}: {error}"[:200]
        finally:
            signal.setitimer(signal.ITIMER_PROF, 0)


def _wrong_message(message: str) -> str:
    """Return the fault in the message of a refusal, or ``refused``."""
    if len(message) > LONGEST_MESSAGE:
        return "a message of too many characters"
    return "refused" if message.isprintable() else "a message with control characters"


def _wrong_numbers(numbers: list[object]) -> str | None:
    """Return the fault in numbers that were read, or None; no number counts as refused."""
    if not numbers:
        return "refused"
    finite = all(np.isfinite(np.asarray(number, dtype=np.float64)).all() for number in numbers)
    return None if finite else "a number that is not finite"


def _too_long(*_: object) -> None:
    """End a file that takes too long."""
    raise TimeoutError(f"more than {SECONDS} s")


def limit() -> None:
    """Limit memory and time."""
    pages = int(Path("/proc/self/statm").read_text().split()[0])
    limit = pages * resource.getpagesize() + MEMORY
    resource.setrlimit(resource.RLIMIT_AS, (limit, limit))
    signal.signal(signal.SIGPROF, _too_long)


def fuzz(name: str, copies: Copies, folder: Path) -> None:
    """Read damaged copies of a kind of file; the result, and the last copy, are in a folder."""
    warnings.simplefilter("ignore")
    logging.disable()
    entry = entries()[name]
    sample = entry.content()
    if problem := problem_of(entry, sample):
        raise SystemExit(f"the sample itself is not read: {problem}")
    limit()
    outcomes: Counter[str | None] = Counter()
    faults = []
    for content in copies(sample):
        (folder / "current").write_bytes(content)
        problem = problem_of(entry, content)
        outcomes[problem] += 1
        if problem not in ("refused", None):
            faults.append(f"{keep(name, content)}: {problem}")
    result = {"read": outcomes[None], "refused": outcomes["refused"], "faults": faults}
    (folder / "result").write_text(json.dumps(result))


def new_copies(name: str, count: int, seed: int) -> Copies:
    """Return the generator of damaged copies, independent of the kinds read before."""
    chance = random.Random(f"{name} {seed}")
    return lambda sample: (damaged(sample, chance) for _ in range(count))


def kept_copies(name: str) -> Copies:
    """Return the readers of copies that caused faults before."""
    return lambda _: [path.read_bytes() for path in sorted((FINDINGS / name).iterdir())]


def keep(name: str, content: bytes) -> str:
    """Keep a file among the findings and return its name."""
    folder = FINDINGS / name
    folder.mkdir(parents=True, exist_ok=True)
    path = folder / hashlib.sha256(content).hexdigest()[:12]
    path.write_bytes(content)
    return str(path.relative_to(HERE))


def fuzz_apart(name: str, copies: Copies) -> dict[str, Any]:
    """Read damaged copies in a process of its own, which a fault may end."""
    with TemporaryDirectory() as place:
        folder = Path(place)
        # A copy of this process, which has the libraries already and no threads yet
        process = get_context("fork").Process(target=fuzz, args=(name, copies, folder))
        process.start()
        process.join()
        if process.exitcode == 0:
            return dict(json.loads((folder / "result").read_text()))
        # What it read when it ended is the finding
        current = folder / "current"
        kept = keep(name, current.read_bytes()) if current.exists() else name
        ended = f"{kept}: the process ended with {process.exitcode}"
        return {"read": 0, "refused": 0, "faults": [ended]}


def report(name: str, copies: Copies) -> None:
    """Read copies of a kind of file and print the result."""
    print(json.dumps({"entry": name, **fuzz_apart(name, copies)}), flush=True)


def main(arguments: list[str]) -> None:
    """Read new copies of every kind, or those that were at fault once."""
    if arguments == ["--again"]:
        for folder in sorted(FINDINGS.iterdir()):
            report(folder.name, kept_copies(folder.name))
        return
    # The first record loads what ObsPy needs; processes of all kinds have it then
    first = entries()["peer_at2"]
    problem_of(first, first.content())
    count, seed = int(arguments[0]), int((arguments[1:] or ["0"])[0])
    for name in arguments[2:] or entries():
        report(name, new_copies(name, count, seed))


if __name__ == "__main__":
    main(sys.argv[1:])
