"""Files that appear whole or not at all, and the hash that tells whether one has changed."""

import hashlib
import os
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path


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

    Examples
    --------
    >>> import tempfile
    >>> final = Path(tempfile.mkdtemp()) / "table.csv"
    >>> with written_whole(final) as part:
    ...     _ = part.write_text("gap")
    >>> final.read_text()
    'gap'
    """
    path.parent.mkdir(parents=True, exist_ok=True)
    part = path.with_name(f".{path.stem}.{os.getpid()}.part{path.suffix}")
    try:
        yield part
        part.replace(path)
    finally:
        part.unlink(missing_ok=True)


def file_hash(path: Path) -> str:
    """Return the SHA-256 of a file's bytes, in hexadecimal."""
    with path.open("rb") as file:
        return hashlib.file_digest(file, "sha256").hexdigest()
