"""
Run with configured notification of its first result, changed class counts and failures.

``notification.json`` in the output folder holds the latest message and the counts that it was
about, so that the same counts and the same failure are notified once.
"""

import logging
from collections.abc import Iterable, Mapping, Sequence
from pathlib import Path
from typing import Any

from per_obspy.config import Notify, Run, load
from per_obspy.errors import FolderInUse, PerError, WriteError, reason_of, shortened
from per_obspy.files import read_json, write_json
from per_obspy.progress import Progress, silent
from per_obspy.results.ranked_table import table_files
from per_obspy.runs.output_folder import Result, now
from per_obspy.runs.run import run
from per_obspy.watch.logs import without_secrets
from per_obspy.watch.notification import Message, notify

log = logging.getLogger(__name__)

#: File of the latest message in the folder of the results.
LATEST = "notification.json"


def notified_run(
    configuration: Path | Run,
    output: Path | None = None,
    progress: Progress = silent,
    executor: Any = None,
) -> Result:
    """
    Do a whole run with notification; parameters and errors are those of ``runs.run.run``.

    A message that cannot be delivered changes neither result nor exit code.
    """
    settings = configuration if isinstance(configuration, Run) else load(configuration, Run)
    if settings.notify.is_silent:
        return run(configuration, output, executor, progress)
    check_groups(settings)
    # A folder that another run holds is left alone
    folder = Path(output or settings.output).resolve()
    try:
        result = run(configuration, output, executor, progress)
    except FolderInUse:
        raise
    except PerError as error:
        notify_failure(settings.notify, folder, settings.name, str(error))
        raise
    notify_result(settings, result, settings.name)
    return result


def check_groups(settings: Run) -> None:
    """Raise ``CatalogError`` with the key of a group whose area cannot be read."""
    if settings.notify.groups:
        from per_obspy.watch.groups import check_areas

        check_areas(settings)


def notify_result(
    settings: Run, result: Result, name: str, shown: Path | None = None
) -> tuple[str, ...]:
    """
    Notify everybody and each group of a first result, or of one with changed class counts.

    Parameters
    ----------
    settings : Run
        Occasions, ways and groups of its section ``[notify]``.
    result : Result
        Of a run.
    name : str
        Beginning of the title.
    shown : Path, optional
        Folder whose page and summary people are shown, if not that of the result.

    Returns
    -------
    reasons : tuple of str
        One line per way that failed.
    """
    folder, record = result.folder, result.record
    if record["state"] != "complete":
        problem = "no pair or no station was usable"
        return notify_failure(settings.notify, folder, name, problem)
    place = shown or folder
    reasons = _notify_everybody(settings.notify, folder, name, place)
    if settings.notify.groups:
        reasons += _notify_groups(settings, folder, name, place, bool(record.get("simulated")))
    return reasons


def _notify_everybody(settings: Notify, folder: Path, name: str, place: Path) -> tuple[str, ...]:
    """Notify of the class counts of a whole result, of which a folder is shown."""
    # Counts that were notified before are no news
    counts = class_counts(place)
    earlier = read_json(folder / LATEST).get("classes")
    if earlier == counts:
        return ()
    # The title alone is enough for a small screen
    known = earlier if isinstance(earlier, dict) else None
    change = "first result" if known is None else f"changed from {_words(known)}"
    title = f"{name}: {_words(counts)} ({change})"
    text = _text(place / "summary.txt") or title
    message = Message("first" if known is None else "changed", title, text, _report_of(place))
    return _sent(settings, folder, message, {"classes": counts})


def _notify_groups(
    settings: Run, folder: Path, name: str, place: Path, simulated: bool
) -> tuple[str, ...]:
    """Notify each group whose pairs have changed and reach its threshold, or no longer do."""
    from per_obspy.watch.groups import counts_of, group_message

    failed = list[str]()
    for group in settings.notify.groups:
        latest = read_json(folder / LATEST)
        # A table without a column of one group holds up no other
        try:
            counts = counts_of(place, group, settings.screening.classes)
        except PerError as error:
            reason = shortened(f"notification of {group.name}: {error}", 300)
            log.warning("%s", reason)
            failed += _noted(folder, latest, [reason])
            continue
        # Each message is noted before the next one
        told = _told_groups(latest)
        earlier = told.get(group.name, {})
        if message := group_message(group, name, counts, earlier, simulated):
            message = message._replace(report=_report_of(place))
            facts = {"classes": latest.get("classes"), "groups": {**told, group.name: counts}}
            failed += _sent(settings.notify, folder, message, facts)
    return tuple(failed)


def _told_groups(latest: Mapping[str, Any]) -> dict[str, dict[str, int]]:
    """Return the counts that each group was told last; damaged ones count as none."""
    groups = latest.get("groups")
    return {
        name: counts
        for name, counts in (groups if isinstance(groups, dict) else {}).items()
        if isinstance(counts, dict) and all(isinstance(one, int) for one in counts.values())
    }


def _report_of(place: Path) -> Path:
    """Return the page of a result, or its summary where there is no page."""
    page = place / "report.html"
    return page if page.is_file() else place / "summary.txt"


def notify_failure(settings: Notify, folder: Path, name: str, reason: str) -> tuple[str, ...]:
    """
    Notify of a failure, unless the latest message of the folder was about the same.

    Returns
    -------
    reasons : tuple of str
        One line per way that failed.
    """
    reason, latest = without_secrets(reason), read_json(folder / LATEST)
    if latest.get("failure") == reason:
        return ()
    message = Message("failure", f"{name}: failed", reason)
    return _sent(settings, folder, message, {"classes": latest.get("classes"), "failure": reason})


def class_counts(folder: Path) -> dict[str, int]:
    """Return the number of pairs in each class of the risk table of a folder, worst first."""
    import duckdb

    table = table_files(folder)
    if not table:
        return {}
    query = "SELECT risk_class, count(*) FROM read_parquet(?) GROUP BY 1 ORDER BY min(rank)"
    with duckdb.connect() as database:
        rows = database.execute(query, [[str(path) for path in table]]).fetchall()
    return {str(label): int(count) for label, count in rows}


def _sent(
    settings: Notify, folder: Path, message: Message, facts: Mapping[str, object]
) -> tuple[str, ...]:
    """Deliver a message, and write its subject and the failed ways of delivery."""
    reasons = notify(settings, message)
    # What groups were told last stays
    told = _told_groups(read_json(folder / LATEST))
    latest = {"kind": message.kind, "time": now(), **({"groups": told} if told else {}), **facts}
    return _noted(folder, latest, reasons)


def _noted(folder: Path, latest: Mapping[str, object], reasons: Sequence[str]) -> tuple[str, ...]:
    """Write the latest message with the ways that failed; return them with a failure to write."""
    try:
        write_json(folder / LATEST, {**latest, "failed": list(reasons)})
    except WriteError as error:
        log.warning("%s", error)
        return (*reasons, str(error))
    return tuple(reasons)


def undelivered(folders: Iterable[Path]) -> str | None:
    """
    Return why the latest message about results in some folders was not delivered.

    Returns
    -------
    reason : str or None
        None if it was delivered, or there was none.
    """
    newest: tuple[str, int, dict[str, Any]] = ("", 0, {})
    for folder in folders:
        if latest := read_json(folder / LATEST):
            # Messages of one second are in the order of their files
            written = (folder / LATEST).stat().st_mtime_ns
            newest = max(
                newest, (str(latest.get("time")), written, latest), key=lambda one: one[:2]
            )
    failed = newest[2].get("failed")
    return shortened(str(failed[0]), 300) if isinstance(failed, list) and failed else None


def _words(counts: Mapping[str, object]) -> str:
    """Return class counts as words."""
    return ", ".join(f"{count} {label}" for label, count in counts.items()) or "none"


def _text(file: Path) -> str:
    """Return the text of a summary; empty where it cannot be read."""
    try:
        return file.read_text(encoding="utf-8")
    except (OSError, ValueError) as error:
        return f"{file.name}: {reason_of(error)}"
