"""
Status of a watched folder: one JSON file, replaced atomically.

The watcher writes it after every poll; ``per-obspy status`` and monitoring read it.
"""

import json
import os
import platform
from importlib.metadata import version
from pathlib import Path

from pydantic import ConfigDict, Field, ValidationError

from per_obspy.config.section import Moment, Section
from per_obspy.errors import CatalogError, reason_of, shortened
from per_obspy.files import written_whole

#: Name of the file in the folder that is watched into.
STATUS = "status.json"

#: Bytes of the largest status file that is read.
LARGEST = 1 << 20


class WatchStatus(Section):
    """
    State of a watcher after its latest poll.

    Attributes
    ----------
    last_poll : str or None
        Time of the latest poll that succeeded, ISO 8601, UTC; None: none did yet.
    events_open : int
        Number of earthquakes that are still updated.
    last_error : str or None
        Reason why the latest poll or update failed; None: it succeeded.
    next_due : str or None
        Time at which the watcher works next, ISO 8601, UTC; None: it has ended for good.
    failures : int
        Number of polls and updates in succession that failed.
    last_notification_error : str or None
        Reason why the latest message was not delivered; None: it was, or there was none.
    ignored : tuple of str
        Listed earthquakes without runs, each with the reason, the latest last.
    running : bool
        Whether the process stays between polls, rather than being started by a timer.
    pid : int
        Number of the process that wrote the status.
    host : str
        Name of its machine.
    version : str
        Of per_obspy.
    """

    # Later versions may write more
    model_config = ConfigDict(frozen=True, extra="ignore", allow_inf_nan=False)

    last_poll: Moment | None = None
    events_open: int = Field(0, ge=0)
    last_error: str | None = None
    next_due: Moment | None = None
    failures: int = Field(0, ge=0)
    last_notification_error: str | None = None
    ignored: tuple[str, ...] = ()
    running: bool = False
    pid: int = Field(default_factory=os.getpid, ge=0)
    host: str = Field(default_factory=platform.node)
    version: str = Field(default_factory=lambda: version("per_obspy"))


def write_status(folder: Path, status: WatchStatus) -> Path:
    """
    Write the status of a watched folder, whole or not at all, and return its file.

    Raises
    ------
    WriteError
        If the machine cannot write.
    """
    file = folder / STATUS
    with written_whole(file) as part:
        text = json.dumps(status.model_dump(mode="json"), indent=1)
        part.write_text(f"{text}\n", encoding="utf-8")
    return file


def read_status(folder: Path) -> WatchStatus:
    """
    Read the status of a watched folder.

    Raises
    ------
    CatalogError
        If the folder has no status, or a damaged one.
    """
    file = folder / STATUS
    try:
        with file.open(encoding="utf-8") as text:
            return WatchStatus.model_validate_json(text.read(LARGEST))
    except ValidationError as error:
        problem = _first_fault(error)
    except (OSError, ValueError) as error:
        problem = shortened(reason_of(error), 200)
    raise CatalogError(str(file), f"not the status of a watcher: {problem}")


def _first_fault(error: ValidationError) -> str:
    """Return field and reason of the first fault of a status file."""
    fault = error.errors()[0]
    place = ".".join(map(str, fault["loc"]))
    return f"{place}: {fault['msg']}" if place else fault["msg"]
