"""
The errors that a user can meet.

::

    PerError
    ├── RecordRejected   a record cannot be used; the run goes on without it
    ├── CatalogError     a file that the run needs (configuration, table, folder) is wrong
    │   ├── NothingUsable    a folder holds no record
    │   └── WrongOutput      a folder stands where a file is to be written, or the other way round
    ├── MissingExtra     an optional library is not installed
    └── TryLater         no input is wrong: the same command succeeds later
        ├── ServiceError     a service does not answer
        ├── WriteError       a file cannot be written: the disk is full, or a right is missing
        ├── MachineFault     memory is short, a device fails, or a process was killed
        ├── Unfinished       such faults left stations or chunks of pairs undone
        └── FolderInUse      another run holds the output folder

Wrong arguments of a function are plain ``ValueError``. Each class below is also the built-in error
it amounts to.
"""

from collections.abc import Iterable
from difflib import get_close_matches
from importlib.util import find_spec
from typing import Any, NamedTuple, Self
from unicodedata import category

#: Characters of a message that may quote a file: damaged files have words of a million.
LONGEST_MESSAGE = 1000


def printable(text: str) -> str:
    """
    Return a text on one line: control characters become blanks, undecodable bytes question marks.

    Examples
    --------
    >>> printable("CI.CLC" + chr(10) + "=A1")
    'CI.CLC =A1'
    """
    # Nearly all texts have none of these characters; letter by letter they take seconds
    if text.isprintable():
        return text
    known = text.encode("utf-8", "replace").decode("utf-8")
    return "".join(" " if category(letter)[0] == "C" else letter for letter in known)


def shortened(text: str, length: int = LONGEST_MESSAGE) -> str:
    """
    Return the beginning of a text that may quote a file, on one line.

    Examples
    --------
    >>> len(shortened("9" * 1_000_000)), shortened("line 3, dt: empty"), shortened("X" * 99, 5)
    (1000, 'line 3, dt: empty', 'XXXX…')
    """
    # Blanks of other widths as well
    known = printable(text[:length])
    if not known.isprintable():
        known = "".join(letter if letter.isprintable() else " " for letter in known)
    return known if len(text) <= length else f"{known[:-1]}…"


class PerError(Exception):
    """Any error that a user can mend, rather than an error of the program."""


class RecordRejected(PerError, ValueError):
    """
    A record is unfit for spectra, for one reason or several.

    Parameters
    ----------
    record : str
        Name of a refused file, or identifier of a refused trace.
    *reasons : str
        Every reason, each naming the field and the value.
    """

    def __init__(self, record: str, *reasons: str) -> None:
        self.record, self.reasons = shortened(record), tuple(map(shortened, reasons))
        super().__init__(self.record, *self.reasons)

    def __str__(self) -> str:
        return f"{self.record}: {'; '.join(self.reasons)}"


class CatalogError(PerError, ValueError):
    """
    A configuration, table or folder is wrong as a whole.

    Parameters
    ----------
    source : str
        The file or folder.
    problem : str
        The fault, naming field and value.
    """

    def __init__(self, source: str, problem: str) -> None:
        self.source, self.problem = source, shortened(problem)
        super().__init__(self.source, self.problem)

    def __str__(self) -> str:
        return f"{self.source}: {self.problem}"


class NothingUsable(CatalogError):
    """A folder is as it should be, but holds no record."""


class WrongOutput(CatalogError):
    """The name of a result, or of its folder, is that of another kind of file."""


class MissingExtra(PerError, ImportError):
    """
    An optional part of the package was asked for, but its libraries are not installed.

    Parameters
    ----------
    extra : str
        Name of the extra that installs them.
    modules : list of str
        Name of the missing library.
    """

    def __init__(self, extra: str, modules: list[str]) -> None:
        super().__init__(extra, modules)
        self.extra, self.modules = extra, modules

    def __str__(self) -> str:
        return f"{', '.join(self.modules)} not installed: pip install 'per_obspy[{self.extra}]'"


def require_extra(extra: str, *modules: str) -> None:
    """Raise :class:`MissingExtra` if a module of an optional feature is not installed."""
    missing = [module for module in modules if find_spec(module) is None]
    if missing:
        raise MissingExtra(extra, missing)


def did_you_mean(word: str, known: Iterable[str]) -> str:
    """
    Return a question that suggests the known word closest to a mistyped one, or an empty text.

    Examples
    --------
    >>> did_you_mean("Heigth", ["height", "gap"])
    ', did you mean height?'
    """
    names = {name.lower(): name for name in known}
    alike = get_close_matches(word.lower(), names, n=1, cutoff=0.7)
    return f", did you mean {names[alike[0]]}?" if alike else ""


def reason_of(error: Exception) -> str:
    """
    Return the message of an error; for one of the operating system without its number and path.

    Examples
    --------
    >>> reason_of(FileNotFoundError(2, "No such file or directory", "pairs.csv"))
    'No such file or directory'
    """
    return error.strerror if isinstance(error, OSError) and error.strerror else str(error)


class TryLater(PerError):
    """No input is wrong: the same command succeeds once its surroundings allow it."""


class ServiceError(TryLater, ConnectionError):
    """A service cannot be reached or answers with an error."""


class WriteError(TryLater, OSError):
    """
    A file cannot be written: the disk is full, or the right to write is missing.

    Parameters
    ----------
    path : str
        The file or folder.
    reason : str
        The reason, and the mend.
    """

    def __init__(self, path: str, reason: str) -> None:
        super().__init__(path, reason)
        self.path, self.reason = path, reason

    def __str__(self) -> str:
        return f"{self.path}: cannot be written: {self.reason}"


class MachineFault(TryLater, OSError):
    """
    Work failed for a reason that lies in the machine: short memory, a failing device or network.

    Parameters
    ----------
    reason : str
        The fault, naming the file if there is one.
    """


class Unfinished(TryLater):
    """
    Faults of the machine left some tasks undone; the same command goes on with them.

    Parameters
    ----------
    *faults : str
        Name of each task and its fault.
    """

    #: Tasks that the message names.
    SHOWN = 10

    def __init__(self, *faults: str) -> None:
        super().__init__(*faults)
        self.faults = faults

    def __str__(self) -> str:
        others = len(self.faults) - self.SHOWN
        more = f" and {others} more" if others > 0 else ""
        return (
            f"unfinished: {'; '.join(self.faults[: self.SHOWN])}{more}; all else is kept, the "
            "same command goes on where it stopped"
        )


class FolderInUse(TryLater, BlockingIOError):
    """
    Another run holds the output folder.

    Parameters
    ----------
    folder : str
        The output folder.
    holder : str
        The run that holds it.
    """

    def __init__(self, folder: str, holder: str) -> None:
        super().__init__(folder, holder)
        self.folder, self.holder = folder, holder

    def __str__(self) -> str:
        return f"{self.folder}: another run holds this folder: {self.holder}; try again after it"


class Rejection(NamedTuple):
    """
    One row of ``rejected.csv``: a rejected record, pair or file, with every reason.

    Attributes
    ----------
    kind : str
        ``"record"``, ``"pair"``, ``"file"``, ``"station"``, ``"service"`` or ``"building"``.
    name : str
        Identifier of the trace, station, service or pair.
    source : str
        The file it came from.
    row : int or None
        Line of the file, for tables (the header is line 1).
    reasons : tuple of str
        Each names the field and the value.
    """

    kind: str
    name: str
    source: str
    row: int | None
    reasons: tuple[str, ...]

    @classmethod
    def stored(cls, values: list[Any]) -> Self:
        """Return a row as JSON keeps it."""
        kind, name, source, row, reasons = values
        return cls(kind, name, source, row, tuple(reasons))
