"""
Damaged copies of the sample files, read within a limit of memory; run as a program.

    python tests/formats/mutations.py COUNT [SEED]

reads COUNT damaged files of every format and prints one JSON line with the number of files read,
refused and at fault. Each fault names the sample, the number of the copy and the error.
"""

import io
import json
import random
import resource
import sys
from collections import Counter
from pathlib import Path

import numpy as np
from format_samples import SAMPLES, Sample
from obspy import Stream
from obspy.core.util.base import ENTRY_POINTS
from obspy.core.util.misc import buffered_load_entry_point

from per_obspy.errors import RecordRejected

#: memory that one file may take beside that of the interpreter, bytes: the longest damaged file
#: has 1 MB, lists of its lines and words take some 60 bytes for each of them
MEMORY = 256 * 1024**2

#: lengths of the words that are put into a file, characters; 1 000 000 once asked for 80 GiB
LENGTHS = (45, 400, 3000, 40_000, 1_000_000)
LETTERS = (
    b"1",
    b"0",
    b"9",
    b".",
    b"-",
    b" ",
    b"A",
    b"e",
    b"1 ",
    b"\n",
    b"1\n",
    b":",
    b"\x00",
    b"/",
)
WORDS = (b"-999", b"999999999999", b"1E300", b"nan", b"", b"\n", b"*****", b"-", b"0", b"1e-300")


def damaged(content: bytes, chance: random.Random) -> bytes:
    """Return a copy with one to three pieces replaced, one of them by a long word at times."""
    for _ in range(chance.randint(1, 3)):
        place = chance.randrange(len(content) + 1)
        size = chance.choice((0, 1, 5, 12, 80, 400))
        kind = chance.randrange(5)
        # A word, noise, the piece itself twice, a long word, or a long word in a number's place
        if kind == 0:
            piece = chance.choice(WORDS)
        elif kind == 1:
            piece = chance.randbytes(size)
        elif kind == 2:
            piece = content[place : place + size] * 2
        else:
            letters = chance.choice(LETTERS)
            piece = letters * (chance.choice(LENGTHS) // len(letters))
        content = content[:place] + piece + content[place + size :]
    return content


def problem_of(sample: Sample, content: bytes) -> str | None:
    """Return what is wrong with the answer to a damaged file, None, or ``refused``."""
    try:
        stream = reader(sample.name)(io.BytesIO(content))
    except RecordRejected as rejection:
        return "refused" if len(str(rejection)) < 1000 else "a message of over 1000 characters"
    except MemoryError:
        return "it takes too much memory"
    except Exception as error:  # noqa: BLE001 - any other error is the fault that is looked for
        return f"{type(error).__name__}: {error}"[:200]
    return wrong_samples(stream)


def reader(name: str):
    """Return the function that reads a format."""
    point = ENTRY_POINTS["waveform"][name]
    return buffered_load_entry_point(
        point.dist.name, f"obspy.plugin.waveform.{point.name}", "readFormat"
    )


def wrong_samples(stream: Stream) -> str | None:
    """Return what is wrong with a stream that was read, or None."""
    for trace in stream:
        if not np.isfinite(trace.data).all() or not 0 < trace.stats.delta < np.inf:
            return f"{trace.id} has samples or an interval that are not finite"
    return None


def limit_memory() -> None:
    """Limit the address space to that in use and ``MEMORY``."""
    pages = int(Path("/proc/self/statm").read_text().split()[0])
    limit = pages * resource.getpagesize() + MEMORY
    resource.setrlimit(resource.RLIMIT_AS, (limit, limit))


def main(count: int, seed: int = 0) -> None:
    """Read damaged files of every format and print the result."""
    for sample in SAMPLES.values():
        problem_of(sample, sample.text.encode("latin-1"))
    limit_memory()
    outcomes: Counter[str] = Counter()
    faults = []
    for name, sample in SAMPLES.items():
        # The same copies whichever formats are read before
        chance = random.Random(f"{name} {seed}")
        for number in range(count):
            problem = problem_of(sample, damaged(sample.text.encode("latin-1"), chance))
            outcomes[problem if problem in ("refused", None) else "fault"] += 1
            if problem not in ("refused", None):
                faults.append(f"{name} {number}: {problem}")
    print(json.dumps({"read": outcomes[None], "refused": outcomes["refused"], "faults": faults}))


if __name__ == "__main__":
    main(*map(int, sys.argv[1:]))
