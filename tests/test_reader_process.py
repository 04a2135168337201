"""The process of readers: values, errors, limits of time and memory, ends by a fault."""

import os
import time
from pathlib import Path

import pytest

from per_obspy import reader_process
from per_obspy.errors import RecordRejected
from per_obspy.reader_process import BeyondLimits, Limits, read_apart

ROOMY = Limits(20.0, 1 << 30)

linux = pytest.mark.skipif(not Path("/proc/self/statm").exists(), reason="limits of Linux")


#: Programs for ``eval`` and ``exec``, which the process can import.
TURN = "while True: pass"
FILL = "len(bytearray({}))"
REJECT = "from per_obspy.errors import RecordRejected; raise RecordRejected('a.gcf', 'one', 'two')"
ODD = """
class Odd(Exception):
    def __init__(self, one, other):
        super().__init__(one)
raise Odd(1, 2)
"""
#: The place of answers must stay theirs, whatever a library prints.
SAY = "[__import__('os').write(1, b'noise of a library'), {!r}][1]"


def say(text: str) -> str:
    return read_apart(ROOMY, eval, SAY.format(text))


def test_values_and_errors_come_back():
    assert say("a") == "a"
    with pytest.raises(RecordRejected) as rejection:
        read_apart(ROOMY, exec, REJECT)
    assert rejection.value.reasons == ("one", "two")
    with pytest.raises(RuntimeError, match="Odd"):
        read_apart(ROOMY, exec, ODD)
    # One process answers all of them
    assert read_apart(ROOMY, os.getpid) == read_apart(ROOMY, os.getpid) != os.getpid()


@linux
def test_a_reader_that_never_ends_is_stopped_and_the_next_file_is_read():
    start = time.monotonic()
    with pytest.raises(BeyondLimits, match="more than 1 s of processor time"):
        read_apart(Limits(1.0, 1 << 30), exec, TURN)
    # The limit is in whole seconds of processor time: others share the machine
    assert time.monotonic() - start < 20.0
    assert say("b") == "b"


def test_a_reader_that_sleeps_is_stopped_by_the_clock(monkeypatch):
    monkeypatch.setattr(reader_process, "_PATIENCE", 1.0)
    assert say("c") == "c"
    with pytest.raises(BeyondLimits, match="more than 1 s"):
        read_apart(Limits(1.0, 1 << 30), time.sleep, 60.0)


@linux
def test_memory_is_limited_beside_that_of_the_program():
    assert read_apart(Limits(20.0, 256 << 20), eval, FILL.format(64 << 20)) == 64 << 20
    with pytest.raises(BeyondLimits, match="more than 256 MiB of memory"):
        read_apart(Limits(20.0, 256 << 20), eval, FILL.format(1 << 30))
    # The limit belongs to one call
    assert read_apart(ROOMY, eval, FILL.format(512 << 20)) == 512 << 20


@pytest.mark.parametrize(("function", "reason"), [(os._exit, "code 7"), (os.abort, "memory")])
def test_a_fault_below_python_ends_only_the_reader(function, reason):
    arguments = (7,) if function is os._exit else ()
    with pytest.raises(BeyondLimits, match=reason):
        read_apart(ROOMY, function, *arguments)
    assert say("d") == "d"


def test_a_copy_of_the_program_has_a_reader_of_its_own():
    # would catch answers that reach the other process
    ours = read_apart(ROOMY, os.getpid)
    child = os.fork()
    if child == 0:
        os._exit(0 if read_apart(ROOMY, os.getpid) != ours else 1)
    assert os.waitstatus_to_exitcode(os.waitpid(child, 0)[1]) == 0
    assert read_apart(ROOMY, os.getpid) == ours
