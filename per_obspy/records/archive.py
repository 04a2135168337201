"""
Archives as folders, whose members are read without unpacking them into any folder.

Understood are zip, and tar plain or compressed by gzip, bzip2 or xz, also inside each other. An
archive is walked once and stays open; of a compressed tar, and of an archive inside another, a copy
is in a temporary file without a name. How much an archive may unpack to is limited by
``[records.archives]`` of the configuration: all archives inside it share one allowance of files and
bytes, so that a bomb of many levels ends as one of a single level does.
"""

import bz2
import gzip
import io
import lzma
import struct
import tarfile
import tempfile
import zipfile
import zlib
from collections.abc import Callable, Iterable, Iterator
from contextlib import ExitStack, contextmanager, nullcontext
from dataclasses import dataclass, replace
from functools import lru_cache
from pathlib import Path
from typing import IO, Any, BinaryIO, NamedTuple

from per_obspy.config import Archives
from per_obspy.errors import PerError, RecordRejected, Rejection, TryLater, reason_of, shortened
from per_obspy.files import opened_hash, writing
from per_obspy.names import SHOWN, name_problem

#: Reason of a rejection of a pipe, socket, device or folder.
IRREGULAR = "is no regular file"

#: Limits where no configuration gives others.
LIMITS = Archives()

#: Most files of an archive with all archives inside it, and most levels of these.
MOST_FILES, MOST_LEVELS = 1_000_000, 3

#: Size of an archive below which its ratio of unpacked to packed bytes is not checked.
SMALL = 64 * 2**20

#: Largest piece that is unpacked at once, bytes.
PIECE = 2**20

#: Ends of the names of archives.
_ZIP, _TAR = (".zip",), (".tar", ".tar.gz", ".tgz", ".tar.bz2", ".tar.xz")

#: Ways of packing a member of a zip that the standard library knows.
_METHODS = (zipfile.ZIP_STORED, zipfile.ZIP_DEFLATED, zipfile.ZIP_BZIP2, zipfile.ZIP_LZMA)

#: first bytes of a packed file -> function that opens it
UNPACKERS: dict[bytes, Any] = {
    b"\x1f\x8b": gzip.open,
    b"BZh": bz2.open,
    b"\xfd7zXZ\x00": lzma.open,
}

#: Errors of the standard library for damaged, encrypted or cut archives.
_DAMAGES = (
    *(zipfile.BadZipFile, tarfile.TarError, zlib.error, lzma.LZMAError, struct.error),
    *(EOFError, OSError, RuntimeError, KeyError, ValueError, OverflowError),
)

#: Open archives that a process keeps.
_KEPT = 8

_REPEATED = "another member of this name comes later in the archive"


def is_archive(path: Path) -> bool:
    """Check from its name whether a file is an archive."""
    return path.name.lower().endswith(_ZIP + _TAR)


def archive_files(archive: Path, limits: Archives = LIMITS) -> tuple[list[Path], list[Rejection]]:
    """
    List the files of an archive as paths below the path of the archive.

    Parameters
    ----------
    archive : Path
        Zip or tar.
    limits : Archives
        Limits of unpacking.

    Returns
    -------
    files : list of Path
        Sorted; those of archives inside are below the paths of these.
    rejected : list of Rejection
        Members that are not read, each with its reason.

    Raises
    ------
    RecordRejected
        If the archive is damaged or unpacks to more than the limits.
    """
    opened = _opened(archive, limits)
    return [archive / name for name in sorted(opened.members)], opened.rejected


def open_file(path: Path, limits: Archives = LIMITS) -> BinaryIO:
    """
    Open a file, or a member of an archive as ``archive_files`` names it.

    Raises
    ------
    RecordRejected
        If it cannot be read.
    """
    archive = _archive_of(path)
    with _refusal(path, "cannot be read"):
        if archive is not None:
            return _opened(archive, limits).open(path.relative_to(archive).as_posix())
        # A pipe, a socket or a device could keep its reader waiting for ever
        if path.exists() and not path.is_file():
            raise RecordRejected(str(path), IRREGULAR)
        return path.open("rb")


def read_file(path: Path, limits: Archives = LIMITS) -> bytes:
    """
    Return the content of a file, or of a member of an archive as ``archive_files`` names it.

    Raises
    ------
    RecordRejected
        If it cannot be read.
    """
    with open_file(path, limits) as file, _refusal(path, "cannot be read"):
        return file.read()


def hash_if_readable(path: Path) -> str:
    """Return the hash of a file or of a member of an archive, empty if it cannot be read."""
    try:
        with open_file(path) as file:
            return opened_hash(file)
    except (OSError, RecordRejected):
        return ""  # reading the station gives the reason


@contextmanager
def _refusal(path: Path, problem: str) -> Iterator[None]:
    """Turn any error of damage into a rejection with its reason."""
    try:
        yield
    except PerError:
        raise
    except _DAMAGES as error:
        raise RecordRejected(str(path), f"{problem}: {reason_of(error)}") from error


def _archive_of(path: Path) -> Path | None:
    """Return the archive on the disk that holds a path, or None."""
    archives = (parent for parent in path.parents if is_archive(parent) and parent.is_file())
    return next(archives, None)


def _opened(archive: Path, limits: Archives) -> "Archive":
    """Return an archive, which is walked once as long as its file does not change."""
    with _refusal(archive, "the archive is damaged"):
        facts = archive.stat()
        return _walked(archive, (facts.st_size, facts.st_mtime_ns), limits)


@lru_cache(_KEPT)
def _walked(archive: Path, version: tuple[int, int], limits: Archives) -> "Archive":
    """Open an archive and walk it; a changed one has another size or time."""
    allowance = Allowance(str(archive), version[0], limits)
    return Archive(str(archive), archive.open("rb"), allowance)


@dataclass
class Allowance:
    """
    Files and bytes that an archive may still unpack to, with all archives inside it.

    Parameters
    ----------
    path : str
        The outermost archive, for messages.
    size : int
        Of its file, bytes.
    limits : Archives
        From the configuration.
    files, total : int
        Files counted so far, and their size, bytes.
    """

    path: str
    size: int
    limits: Archives
    files: int = 0
    total: int = 0

    def spend(self, size: int) -> None:
        """Count one file of some bytes."""
        self.files += 1
        self.check(size)
        self.total += size

    def check(self, size: int) -> None:
        """Refuse the archive if that many bytes more are beyond the limits."""
        limits, total = self.limits, self.total + size
        # The sum of all files, and its ratio to the archive as it is stored
        if self.files > MOST_FILES:
            problem = f"{MOST_FILES} files"
        elif total > limits.largest_total:
            problem = f"records.archives.largest_total = {limits.largest_total} bytes"
        elif total > max(limits.largest_ratio * self.size, SMALL):
            problem = (
                f"records.archives.largest_ratio = {limits.largest_ratio:g} times its packed size"
            )
        else:
            return
        problem = f"the archive unpacks to more than {problem}"
        raise BeyondLimits(self.path, f"{problem}: unpack it by hand")


class BeyondLimits(RecordRejected):
    """An archive unpacks to more than the configuration allows."""


class _Member(NamedTuple):
    """A member as its archive describes it."""

    name: str
    size: int  # bytes, unpacked
    place: Any  # by which its archive finds it
    problem: str  # why it cannot be read; empty if it can
    inside: str = ""  # name of a file inside it, where it is an archive


class Archive:
    """
    An open archive, with its readable members by name and rejections of the others.

    Parameters
    ----------
    name : str
        Path for messages; it ends with the kind of the archive.
    file : file object
        The archive, which is closed with this object.
    allowance : Allowance
        Limits of unpacking.
    level : int
        1 for the outermost archive, 2 for one inside it, and so on.

    Attributes
    ----------
    members : dict
        Name -> member, which for a file of an archive inside is that archive.
    rejected : list of Rejection
        Members that are not read, each with its reason.
    """

    def __init__(self, name: str, file: IO[bytes], allowance: Allowance, level: int = 1) -> None:
        self.name, self.allowance, self.level = name, allowance, level
        self.members: dict[str, _Member] = {}
        self.rejected: list[Rejection] = []
        self._file = file
        self._zip: zipfile.ZipFile | None = None
        # Of the archives inside, the one that was read last stays open
        self._inner: tuple[str, Archive] | None = None
        if name.lower().endswith(_ZIP):
            self._zip = zipfile.ZipFile(file)
        else:
            self._file = _plain_tar(file, allowance)
        for archive in self._walk():
            self._enter(archive)

    def __del__(self) -> None:
        self._file.close()

    def open(self, name: str) -> BinaryIO:
        """Return a member in memory."""
        if name not in self.members:
            problem = "cannot be read: the archive has no such file"
            raise RecordRejected(f"{self.name}/{name}", problem)
        member = self.members[name]
        if not member.inside:
            return io.BytesIO(b"".join(self._pieces(member)))
        if self._inner is None or self._inner[0] != member.name:
            # The first walk has shown that it is within the limits
            fresh = replace(self.allowance, files=0, total=0)
            self._inner = member.name, self._unpacked(member, fresh)
        return self._inner[1].open(member.inside)

    def listed(self) -> Iterator[_Member]:
        """Yield all files as the archive describes them, in its order."""
        return _tar_members(self._file) if self._zip is None else _zip_members(self._zip)

    def _pieces(self, member: _Member) -> Iterator[bytes]:
        """Yield the bytes of a member, never more than it declares."""
        left = member.size
        if self._zip is None:
            self._file.seek(member.place)
        # A file of a zip is closed, that of a tar is the archive itself
        with self._zip.open(member.place) if self._zip else nullcontext(self._file) as file:
            while piece := file.read(min(PIECE, left)):
                left -= len(piece)
                yield piece
        if left and self._zip is None:
            raise EOFError("the archive has become shorter")

    def _walk(self) -> Iterable[_Member]:
        """Find the members, each once, and return the archives among them; stop at the limits."""
        inner: dict[str, _Member] = {}
        for member in self.listed():
            self.allowance.spend(0 if member.problem else member.size)
            name = _plain_name(member.name)
            if problem := member.problem or self._problem(name, member.size):
                self._reject(member.name, problem)
                continue
            # The later member of two is the one that unpacking would leave
            group = inner if is_archive(Path(name)) else self.members
            if name in group:
                self._reject(name, _REPEATED)
            group[name] = member._replace(name=name)
        return inner.values()

    def _problem(self, name: str, size: int) -> str:
        """Return why a member is not read; empty if it is."""
        limits = self.allowance.limits
        # A name that leads elsewhere, an archive too deep, a file too large
        if problem := name_problem(name):
            return f"its name {problem}"
        if is_archive(Path(name)) and self.level >= MOST_LEVELS:
            return f"is an archive deeper than {MOST_LEVELS} levels: unpack the outer one first"
        if size > limits.largest_member:
            limit = f"larger than records.archives.largest_member = {limits.largest_member}"
            return f"unpacks to {size} bytes, {limit}"
        return ""

    def _enter(self, archive: _Member) -> None:
        """Add the files of an archive inside; a damaged one is a rejection."""
        try:
            walked = self._unpacked(archive, self.allowance)
        except (BeyondLimits, TryLater):
            raise
        except _DAMAGES as error:
            self._reject(archive.name, f"the archive is damaged: {reason_of(error)}")
            return
        self._inner = archive.name, walked
        # Names inside begin with the name of their archive
        for name in walked.members:
            whole = f"{archive.name}/{name}"
            if whole in self.members:
                self._reject(whole, _REPEATED)
            self.members[whole] = archive._replace(inside=name)
        self.rejected += walked.rejected

    def _unpacked(self, archive: _Member, allowance: Allowance) -> "Archive":
        """Return an archive inside, walked."""
        copy = _temporary_copy(self._pieces(archive))
        return Archive(f"{self.name}/{archive.name}", copy, allowance, self.level + 1)

    def _reject(self, name: str, reason: str) -> None:
        """Add a row for a member that is not read."""
        row = shortened(name, SHOWN)
        self.rejected.append(Rejection("file", row, f"{self.name}/{row}", None, (reason,)))


def _plain_name(name: str) -> str:
    """Return the name of a member without ``.`` in it, and with ``/`` between its folders."""
    first, *others = name.replace("\\", "/").split("/")
    # An empty first part is that of an absolute name
    inner = [part for part in others if part not in ("", ".")]
    return "/".join(inner if first == "." else [first, *inner])


def _temporary_copy(pieces: Iterable[bytes]) -> IO[bytes]:
    """Write pieces to a temporary file without a name, which closes if one cannot be written."""
    with ExitStack() as on_failure:
        copy = on_failure.enter_context(tempfile.TemporaryFile(prefix="per_obspy-"))
        for piece in pieces:
            with writing(Path(tempfile.gettempdir())):
                copy.write(piece)
        copy.seek(0)
        on_failure.pop_all()
    return copy


def _zip_members(packed: zipfile.ZipFile) -> Iterator[_Member]:
    """Yield the files in the list at the end of a zip."""
    for info in packed.infolist():
        problem = ""
        if info.flag_bits & 1:
            problem = "is encrypted: unpack it first"
        elif info.compress_type not in _METHODS:
            problem = f"is packed by method {info.compress_type}, which is unknown: unpack it first"
        if not info.is_dir():
            yield _Member(info.orig_filename, info.file_size, info, problem)


def _plain_tar(file: IO[bytes], allowance: Allowance) -> IO[bytes]:
    """Return a tar as it is, or a copy of a compressed one."""
    head = file.read(max(map(len, UNPACKERS)))
    file.seek(0)
    if not head.startswith((*UNPACKERS,)):
        return file
    with file:
        return _temporary_copy(unpacked(file, head, allowance.check))


def unpacked(packed: IO[bytes], head: bytes, check: Callable[[int], None]) -> Iterator[bytes]:
    """
    Yield the bytes of a file piece by piece, unpacked if gzip, bzip2 or xz packed it.

    Parameters
    ----------
    packed : file object
        At its beginning.
    head : bytes
        Its first bytes, which tell how it is packed.
    check : callable
        Called with the number of unpacked bytes as it grows, so that a bomb is refused before it
        fills memory or disk; raises beyond a limit.
    """
    openers = (opened for mark, opened in UNPACKERS.items() if head.startswith(mark))
    total = 0
    with next(openers, nullcontext)(packed) as source:
        while piece := source.read(PIECE):
            total += len(piece)
            check(total)
            yield piece


def _tar_members(file: IO[bytes]) -> Iterator[_Member]:
    """Yield the files of a tar, from their headers alone."""
    length = file.seek(0, io.SEEK_END)
    file.seek(0)
    with tarfile.open(fileobj=_Headers(file), mode="r:") as packed:  # type: ignore[call-overload]
        while info := packed.next():
            packed.members.clear()
            problem = _tar_problem(info)
            is_whole = info.offset_data + info.size <= length
            if info.size < 0 or not (is_whole or problem):
                raise tarfile.ReadError(f"{shortened(info.name, SHOWN)!r} is cut")
            if not info.isdir():
                yield _Member(info.name, info.size, info.offset_data, problem)
        # Damage in the middle ends the walk like the end itself, which is a block of zeros
        file.seek(packed.offset)
        if file.read(tarfile.BLOCKSIZE) != bytes(tarfile.BLOCKSIZE):
            raise tarfile.ReadError(f"no header and no end mark at byte {packed.offset}")


def _tar_problem(info: tarfile.TarInfo) -> str:
    """Return why a member of a tar is no file to read; empty if it is one."""
    if info.issym() or info.islnk():
        return "is a link, which is not followed"
    if info.issparse():
        return "is a sparse file: unpack it first"
    return "" if info.isreg() else "is no file but a device or pipe"


class _Headers:
    """
    A tar file of which headers are read only, forwards and in small pieces.

    A damaged size would otherwise ask for the memory it names, or lead back for ever.
    """

    def __init__(self, file: IO[bytes]) -> None:
        self._file = file
        self.tell = file.tell

    def read(self, size: int) -> bytes:
        """Return the next bytes."""
        if not 0 <= size <= PIECE:
            raise tarfile.ReadError(f"a header of {size} bytes")
        return self._file.read(size)

    def seek(self, position: int) -> int:
        """Go forwards, or back by the one byte that tarfile reads to see whether data are cut."""
        if position < self._file.tell() - 1:
            raise tarfile.ReadError("a header that leads back")
        return self._file.seek(position)
