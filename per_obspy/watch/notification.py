"""
Messages about results and failures, by a command or by Apprise.

A message that cannot be delivered is a warning in the log and a returned reason, never an error.
Addresses of services hold secrets: they come from the environment or a private file, reach the
process that delivers by its standard input, and are in no log.
"""

import logging
import os
import stat
import subprocess
import sys
import time
from collections.abc import Mapping, Sequence
from pathlib import Path
from signal import SIGKILL
from typing import NamedTuple

from per_obspy.config.watch import AppriseUrls, Group, Kind, Notify
from per_obspy.errors import MissingExtra, PerError, reason_of, require_extra, shortened

log = logging.getLogger(__name__)

#: Characters of the longest text that is sent.
LONGEST_TEXT = 20_000

#: Bytes of the largest file of URLs.
LARGEST_FILE = 1 << 16

#: Exit code of the process that delivers where services refuse, with their number on its output.
UNDELIVERED = 4


class Message(NamedTuple):
    """A message about one earthquake or run."""

    #: ``"first"``, ``"changed"`` or ``"failure"``.
    kind: Kind
    #: One line.
    title: str
    #: Summary of the result, or the reason of the failure.
    text: str
    #: Page with the result; None if there is none.
    report: Path | None = None
    #: Who gets it; None: everybody.
    group: Group | None = None


def notify(settings: Notify, message: Message) -> tuple[str, ...]:
    """
    Deliver a message in every configured way, and return the reasons of failures; never raise.

    Parameters
    ----------
    settings : Notify
        Occasions and ways.
    message : Message
        Is delivered if its kind is among the occasions.

    Returns
    -------
    reasons : tuple of str
        One line per way that failed, without any secret.
    """
    if message.kind not in settings.on:
        return ()
    report = [f"Report: {message.report}"] if message.report else []
    body = "\n\n".join([message.text.strip()[:LONGEST_TEXT], *report]) + "\n"
    # Every way is tried, whatever became of the others
    reasons = []
    for deliver in (_by_command, _by_apprise):
        try:
            deliver(settings, message, body)
        except (PerError, OSError, ValueError) as error:
            reason = shortened(f"notification by {deliver.__name__[4:]}: {reason_of(error)}", 300)
            log.warning("%s", reason)
            reasons.append(reason)
    if not reasons and not settings.is_silent:
        log.info("notified: %s", shortened(message.title, 200))
    return tuple(reasons)


class _Undelivered(PerError):
    """Failure to deliver a message."""


def _by_command(settings: Notify, message: Message, body: str) -> None:
    """Start the configured command with the message, if there is one."""
    group = message.group
    if not settings.command or (group and not group.address):
        return
    known = {
        "PER_OBSPY_KIND": message.kind,
        "PER_OBSPY_TITLE": shortened(message.title, 200),
        "PER_OBSPY_REPORT": str(message.report or ""),
        "PER_OBSPY_FOLDER": str(message.report.parent if message.report else ""),
        "PER_OBSPY_GROUP": group.name if group else "",
        "PER_OBSPY_ADDRESS": group.address if group else "",
    }
    # Addresses of services are no business of the command
    inherited = dict(os.environ)
    for place in (settings, *settings.groups):
        inherited.pop(place.apprise_urls_variable or "", None)
    code = _ended(settings.command, body, {**inherited, **known}, settings.timeout)
    if code:
        raise _Undelivered(f"{settings.command[0]} ended with exit code {code}")


def _by_apprise(settings: Notify, message: Message, body: str) -> None:
    """Deliver a message to the services of the configured URLs, if there are any."""
    urls = _urls(message.group or settings)
    if not urls:
        return
    try:
        require_extra("notify", "apprise")
    except MissingExtra as error:
        raise _Undelivered(str(error)) from error
    # A process of its own can be ended when its time is over, and shows no secret
    program = (sys.executable, "-m", "per_obspy.watch.apprise_delivery")
    title = shortened(message.title, 200)
    given = "\n".join([str(len(urls)), *urls, title, body])
    code = _ended(program, given, dict(os.environ), settings.timeout)
    if code:
        what = "not delivered by all" if code == UNDELIVERED else f"exit code {code} of"
        raise _Undelivered(f"{what} of its {len(urls)} services")


def _urls(settings: AppriseUrls) -> list[str]:
    """Return the configured Apprise URLs."""
    if settings.apprise_urls_variable:
        text = os.environ.get(settings.apprise_urls_variable, "")
        if not text.strip():
            name = settings.apprise_urls_variable
            raise _Undelivered(f"the environment has no variable {name} with URLs")
        return text.split()
    if settings.apprise_urls_file:
        return _private_text(settings.apprise_urls_file).split()
    return []


def _private_text(file: Path) -> str:
    """Return the content of a file that only its owner may read."""
    # A pipe without a writer does not block
    flags = getattr(os, "O_NONBLOCK", 0)
    with open(file, "rb", opener=lambda path, more: os.open(path, more | flags)) as opened:
        # The rights are those of the file that is read, whatever its name leads to later
        facts = os.fstat(opened.fileno())
        if not stat.S_ISREG(facts.st_mode):
            raise _Undelivered(f"{file}: is no regular file")
        if os.name == "posix" and facts.st_mode & (stat.S_IRWXG | stat.S_IRWXO):
            mode = stat.S_IMODE(facts.st_mode)
            raise _Undelivered(f"{file}: mode {mode:o} lets others read it: chmod 600 {file}")
        content: bytes = opened.read(LARGEST_FILE)
    return content.decode("utf-8")


def _ended(
    program: Sequence[str], given: str, environment: Mapping[str, str], timeout: float
) -> int:
    """Run a program with text as its input, and return its exit code; end it when time is over."""
    process = subprocess.Popen(
        program,
        stdin=subprocess.PIPE,
        stdout=subprocess.DEVNULL,
        stderr=subprocess.DEVNULL,
        env=environment,
        start_new_session=True,
    )
    # Whatever the program started ends with it
    started = time.monotonic()
    try:
        process.communicate(given.encode("utf-8", "replace"), timeout=timeout)
    except subprocess.TimeoutExpired as error:
        seconds = time.monotonic() - started
        raise _Undelivered(f"{program[0]} was ended after {seconds:.0f} s") from error
    finally:
        _end_group(process)
    return process.returncode


def _end_group(process: "subprocess.Popen[bytes]") -> None:
    """End a program with everything that it started, if it still works."""
    if process.poll() is not None:
        return
    if os.name == "posix":
        os.killpg(process.pid, SIGKILL)
    else:
        process.kill()
    process.wait()
