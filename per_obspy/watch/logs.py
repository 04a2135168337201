"""
Logs of a command: one line per event, on standard error and as text or JSON in a file.

Everything is logged under the logger ``per_obspy``, so that programs that use the package decide
themselves. Passwords and tokens of addresses are masked.
"""

import json
import logging
import re
import sys
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from datetime import UTC, datetime
from pathlib import Path
from typing import Any

from typing_extensions import override

from per_obspy.errors import PerError, printable, shortened
from per_obspy.files import writing

#: Logger of the package, and that of its progress.
ROOT = logging.getLogger("per_obspy")
PROGRESS = logging.getLogger("per_obspy.progress")

#: User and password of an address, and values of keys that are secrets.
_USER = re.compile(r"(?<=://)\S*@")
_SECRET = re.compile(r"(?i)\b(token|password|passwd|secret|api_?key)(=|: ?)[^\s&;,]+")


@contextmanager
def logging_to(
    file: Path | None, as_json: bool = False, quiet: bool = False, timed: bool = False
) -> Iterator[None]:
    """
    Log the events of a block by the options of a command, with an error that ends it.

    Parameters
    ----------
    file : Path or None
        Text or JSON lines are appended to it; None: there is no file.
    as_json : bool
        Whether the file has one JSON object per line.
    quiet : bool
        Whether standard error gets warnings and errors only.
    timed : bool
        Whether lines on standard error begin with their time.

    Raises
    ------
    WriteError
        If the file cannot be written.
    """
    # Standard error is for people, the file for machines
    console = logging.StreamHandler(sys.stderr)
    console.setLevel(logging.WARNING if quiet else logging.INFO)
    console.setFormatter(_TextLine() if timed else _ConsoleLine())
    # Some events the command prints itself
    console.addFilter(lambda record: not getattr(record, "printed", False))
    handlers = [console, *_file_handlers(file, as_json)]
    # Handlers of other programs that use the package stay as they are
    level = ROOT.level
    ROOT.setLevel(logging.INFO)
    for handler in handlers:
        ROOT.addHandler(handler)
    try:
        yield
    except PerError as error:
        _log_end(str(error))
        raise
    except (KeyboardInterrupt, SystemExit) as error:
        if getattr(error, "code", 1):
            _log_end(f"ended by {type(error).__name__}")
        raise
    finally:
        for handler in handlers:
            ROOT.removeHandler(handler)
            handler.close()
        ROOT.setLevel(level)


def _file_handlers(file: Path | None, as_json: bool) -> list[logging.Handler]:
    """Return the handler of the log file, if there is one."""
    if file is None:
        return []
    with writing(file):
        file.parent.mkdir(parents=True, exist_ok=True)
        handler = _File(file, encoding="utf-8")
    handler.setFormatter(_JsonLine() if as_json else _TextLine())
    return [handler]


def _log_end(reason: str) -> None:
    """Log the error that ended a block, in the file only: the command prints it."""
    ROOT.error("%s", reason, extra={"printed": True})


class _File(logging.FileHandler):
    """Log file; if it cannot be written, one line reports that and the work continues."""

    has_failed = False

    @override
    def handleError(self, record: logging.LogRecord) -> None:
        if not self.has_failed:
            self.has_failed = True
            print(f"per-obspy: {self.baseFilename}: the log cannot be written", file=sys.stderr)

    @override
    def close(self) -> None:
        with suppress(OSError):
            super().close()


def log_progress(stage: str, done: int, total: int) -> None:
    """Log a step of progress."""
    facts = {"stage": stage, "done": done, "total": total}
    PROGRESS.info("%s: %d of %d", stage, done, total, extra={"facts": facts})


def without_secrets(text: str) -> str:
    """
    Return a text in which users, passwords and tokens of addresses are masked.

    Examples
    --------
    >>> without_secrets("GET https://me:secret@example.org/a?token=abc&x=1 failed")
    'GET https://***@example.org/a?token=***&x=1 failed'
    """
    return _SECRET.sub(r"\1\2***", _USER.sub("***@", text))


class _Line(logging.Formatter):
    """One line per event, without control characters and secrets."""

    def text(self, record: logging.LogRecord) -> str:
        """Return the message of an event; of an exception its last line."""
        message = record.getMessage()
        if record.exc_info and record.exc_info[1] is not None:
            error = record.exc_info[1]
            message = f"{message}: {type(error).__name__}: {error}"
        return shortened(without_secrets(printable(message)))


class _ConsoleLine(_Line):
    """A line for people: warnings begin with the name of the program."""

    @override
    def format(self, record: logging.LogRecord) -> str:
        prefix = "per-obspy: " if record.levelno >= logging.WARNING else ""
        return prefix + self.text(record)


class _TextLine(_Line):
    """A line with time (UTC), level and process."""

    @override
    def format(self, record: logging.LogRecord) -> str:
        level = record.levelname.lower()
        return f"{_moment(record)} {level} per-obspy[{record.process}]: {self.text(record)}"


class _JsonLine(_Line):
    """A line with one JSON object."""

    @override
    def format(self, record: logging.LogRecord) -> str:
        event: dict[str, Any] = {
            "time": _moment(record),
            "level": record.levelname.lower(),
            "logger": record.name,
            "process": record.process,
            "event": self.text(record),
        }
        return json.dumps(event | getattr(record, "facts", {}))


def _moment(record: logging.LogRecord) -> str:
    """Return the time of an event, ISO 8601, UTC."""
    return datetime.fromtimestamp(record.created, UTC).isoformat(timespec="milliseconds")
