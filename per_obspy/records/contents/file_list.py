"""Files below a folder, and whatever else is there that cannot be read."""

import os
import stat
from pathlib import Path

from per_obspy.errors import CatalogError, Rejection, reason_of
from per_obspy.files import is_part
from per_obspy.records.archives.archive_files import IRREGULAR

#: Beginnings and ends of names of documents, and of files that systems leave.
_TITLES = ("readme", "read_me", "licence", "license", "disclaimer", "copying", "citation")
_SUFFIXES = (
    *(".pdf", ".htm", ".html", ".md", ".rtf", ".doc", ".docx", ".ps", ".eps", ".svg"),
    *(".png", ".gif", ".jpg", ".jpeg", ".kml", ".kmz", ".md5", ".sha256"),
)
_HIDDEN = (".ds_store", "thumbs.db", "desktop.ini")


def files_below(folder: Path) -> tuple[list[Path], list[Rejection]]:
    """
    Return the files below a folder, sorted, and whatever else is there that cannot be read.

    Folders that cannot be listed, links without a target or to a folder, pipes, sockets and
    devices are rejections; the rest goes on. Part files of this package are passed over.

    Raises
    ------
    CatalogError
        If it is no folder.
    """
    if not folder.is_dir():
        raise CatalogError(str(folder), "is neither a folder nor a regular file")
    unlisted: list[OSError] = []
    paths, rejected = [], []
    # Links to folders are among the folders, and are not entered
    for parent, folders, names in os.walk(folder, onerror=unlisted.append):
        for path in (Path(parent, name) for name in (*folders, *names)):
            problem = _problem(path)
            if problem:
                rejected.append(Rejection("file", path.name, str(path), None, (problem,)))
            elif not path.is_dir() and not is_part(path):
                paths.append(path)
    # An error may come in the middle of a folder
    for error in unlisted:
        path = Path(error.filename or folder)
        reason = f"the folder cannot be listed: {reason_of(error)}"
        rejected.append(Rejection("file", path.name, str(path), None, (reason,)))
    return sorted(paths), sorted(rejected)


def _problem(path: Path) -> str:
    """Return why an entry of a folder is neither a file nor a folder; empty if it is one."""
    try:
        kind = path.stat().st_mode
    except OSError as error:
        if path.is_symlink():
            return f"is a link without a target: {reason_of(error)}"
        return f"cannot be read: {reason_of(error)}"
    # Folders behind links could hold each other
    if stat.S_ISDIR(kind):
        is_link = path.is_symlink()
        return "is a link to a folder, which is not followed: name that folder" if is_link else ""
    return "" if stat.S_ISREG(kind) else IRREGULAR


def is_document(path: Path) -> bool:
    """
    Check from its name whether a file is for people: documents that agencies pack with records.

    >>> is_document(Path("a.zip/README.TXT")), is_document(Path("plot.pdf"))
    (True, True)
    >>> is_document(Path("readme/CE1.V2"))
    False
    """
    name = path.name.lower()
    # macOS packs an additional file with each file
    is_hidden = name.startswith("._") or name in _HIDDEN
    return is_hidden or name.startswith(_TITLES) or name.endswith(_SUFFIXES)
