"""Files that appear whole or not at all, what a file seems to be, and the hash that tells whether one has changed."""

import errno
import hashlib
import os
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

from per_obspy.errors import CatalogError

#: How files of other kinds begin.
SIGNATURES = {
    b"%PDF": "a PDF document",
    b"PK\x03\x04": "a ZIP archive, as Excel workbooks are",
    b"\xd0\xcf\x11\xe0": "an old Excel workbook",
    b"PAR1": "a Parquet table",
    b"SQLite format 3": "an SQLite database, as GeoPackages are",
    b"\x89HDF": "an HDF5 file, as netCDF files are",
    b"\x1f\x8b": "a file packed by gzip",
    b"\x89PNG": "a PNG picture",
    b"<": "an XML or HTML document",
}

#: The disk or its rights stand against writing, which is no mistake of the program.
UNWRITABLE = {
    errno.EACCES,
    errno.EPERM,
    errno.EROFS,
    errno.ENOSPC,
    errno.EDQUOT,
    errno.ENOTDIR,
    errno.EISDIR,
}


def looks_like(path: Path) -> str:
    """
    Return what a file seems to be by its first bytes; empty if they are no known ones.

    Examples
    --------
    >>> import tempfile
    >>> file = Path(tempfile.mkdtemp()) / "table.csv"
    >>> _ = file.write_bytes(b"%PDF-1.4")
    >>> looks_like(file)
    'a PDF document'
    """
    with path.open("rb") as file:
        head = file.read(16)
    if not head:
        return "an empty file"
    return next((kind for start, kind in SIGNATURES.items() if head.startswith(start)), "")


def told_apart(path: Path, expected: str, error: Exception) -> str:
    """Return why a file is not what is expected: what it is instead, or else what its reader says in a sentence."""
    kind = looks_like(path)
    known = kind and expected not in kind
    return f"not a {expected}: {f'it is {kind}' if known else str(error).partition('; ')[0].rstrip('.')}"


@contextmanager
def written_whole(path: Path) -> Iterator[Path]:
    """
    Give a temporary path beside the final one, renamed to it when the block ends well and removed otherwise.

    Parameters
    ----------
    path : Path
        Final name; its folder is made if need be.

    Yields
    ------
    Path
        Where to write. It keeps the suffix, because many writers go by it.

    Raises
    ------
    CatalogError
        If the folder cannot be made or written to, or the disk is full.

    Examples
    --------
    >>> import tempfile
    >>> final = Path(tempfile.mkdtemp()) / "table.csv"
    >>> with written_whole(final) as part:
    ...     _ = part.write_text("gap")
    >>> final.read_text()
    'gap'
    """
    try:
        path.parent.mkdir(parents=True, exist_ok=True)
    except OSError as error:
        raise CatalogError(
            str(path), f"cannot be written: {path.parent}: {error.strerror}"
        ) from error
    part = path.with_name(f".{path.stem}.{os.getpid()}.part{path.suffix}")
    try:
        yield part
        part.replace(path)
    except OSError as error:
        if error.errno not in UNWRITABLE:
            raise
        raise CatalogError(str(path), f"cannot be written: {error.strerror}") from error
    finally:
        part.unlink(missing_ok=True)


def file_hash(path: Path) -> str:
    """Return the SHA-256 of a file's bytes, in hexadecimal."""
    with path.open("rb") as file:
        return hashlib.file_digest(file, "sha256").hexdigest()
