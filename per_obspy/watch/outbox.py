"""
Messages about watched earthquakes that wait for delivery: ``outbox.json`` in an event's folder.

A message waits on the disk before the state of its run is written, and leaves when it was
delivered or all ways of delivery have failed. The next watcher delivers what a killed one has left:
each message at least once, and twice only if the watcher is killed between the delivery and the
note of it.
"""

import json
import logging
from pathlib import Path
from typing import Any

from per_obspy.errors import PerError, shortened
from per_obspy.files import remove_file, written_whole
from per_obspy.runs.output_folder import RECORD, Result
from per_obspy.watch.event_settings import Watcher
from per_obspy.watch.notified_run import notify_failure, notify_result
from per_obspy.watch.revisions import WORK, revision_folder
from per_obspy.watch.state import EventState, event_folder, noted_faults

log = logging.getLogger(__name__)

#: File of the message that waits.
OUTBOX = "outbox.json"

#: Bytes of the largest such file that is read.
LARGEST = 1 << 20


def message_waits(watcher: Watcher, state: EventState, failure: str | None = None) -> None:
    """
    Put the message about a run into the folder of its earthquake, in place of an earlier one.

    Parameters
    ----------
    watcher : Watcher
        Settings and folder.
    state : EventState
        Of the earthquake after the run.
    failure : str, optional
        Why the run failed; otherwise it has a result.

    Raises
    ------
    WriteError
        If the machine cannot write.
    """
    if watcher.settings.notify.is_silent:
        return
    content = {"revision": state.revision, "failure": failure}
    with written_whole(_file(watcher, state)) as part:
        part.write_text(json.dumps(content, indent=1), encoding="utf-8")


def deliver(watcher: Watcher, state: EventState) -> None:
    """Deliver the message of an earthquake that waits, if there is one, and remove it."""
    file = _file(watcher, state)
    if not file.is_file():
        return
    content = _content(file) or {}
    # A result that cannot be read holds up no later message
    faults = list[PerError]()
    with noted_faults(faults):
        _deliver(watcher, state, content)
    for fault in faults:
        log.warning("message about %s: %s", shortened(state.event_id, 80), fault)
    remove_file(file)


def _deliver(watcher: Watcher, state: EventState, content: dict[str, Any]) -> None:
    """Deliver a message; one about counts or a failure that people know is not sent again."""
    settings, label = watcher.settings.notify, f"{watcher.settings.name}: {state.event_id}"
    folder = event_folder(watcher.folder, state.event_id)
    work, failure, number = folder / WORK, content.get("failure"), content.get("revision")
    if not isinstance(number, int):
        return
    if failure is not None:
        notify_failure(settings, work, label, str(failure))
        return
    # The folder of the runs works on: people are shown the revision, which never changes
    shown = revision_folder(folder, number) if number else None
    record = _content((shown or work) / RECORD)
    if record is not None and "state" in record:
        notify_result(settings, Result(work, record, did_nothing=False), label, shown)


def deliver_waiting(watcher: Watcher, states: dict[str, EventState]) -> None:
    """Deliver the messages that a watcher has left that was killed."""
    for state in states.values():
        deliver(watcher, state)


def _file(watcher: Watcher, state: EventState) -> Path:
    """Return the file of the message of an earthquake."""
    return event_folder(watcher.folder, state.event_id) / OUTBOX


def _content(file: Path) -> dict[str, Any] | None:
    """Return the content of a JSON file; None without one, or if it is damaged."""
    try:
        with file.open(encoding="utf-8") as text:
            found = json.loads(text.read(LARGEST))
    except (OSError, ValueError):
        return None
    return found if isinstance(found, dict) else None
