"""
Watch for earthquakes: look at their list, do the runs that are due, and keep revisions.

One pass looks at the list once and does everything that is due. The daemon is a loop of passes.
Whatever ends a pass, the next one goes on: state files are written whole, after everything that
they describe. A failure of one earthquake stops no other.
"""

import logging
from collections.abc import Callable, Mapping
from concurrent.futures import Executor
from contextlib import suppress
from datetime import UTC, datetime, timedelta
from pathlib import Path
from time import sleep
from typing import NamedTuple

from per_obspy.config import Run
from per_obspy.errors import PerError, ServiceError, TryLater, shortened
from per_obspy.files import content_hash
from per_obspy.jobs.output_folder import locked_folder
from per_obspy.machine import machine_fault
from per_obspy.operation.events.due import Task, due_task, is_paused, next_due, pause
from per_obspy.operation.events.event_feed import Feed, current_event, noted_poll, read_feed
from per_obspy.operation.events.event_run import (
    Watcher,
    arrivals_of,
    closed,
    done_task,
    judged,
    with_facts,
)
from per_obspy.operation.notification import Message, notify
from per_obspy.operation.events.relevance import Circle, circle_around, inventory_places
from per_obspy.operation.events.revisions import point_latest, revision_facts, revision_folder
from per_obspy.operation.events.state import (
    EventState,
    WatchState,
    changed,
    event_folder,
    iso,
    moment,
    read_event_states,
    read_watch_state,
    write_event_state,
    write_watch_state,
)
from per_obspy.operation.status import WatchStatus, write_status
from per_obspy.progress import Progress, silent
from per_obspy.records.fdsn.event_list import EventRow, quakeml_row
from per_obspy.termination import requested

log = logging.getLogger(__name__)
