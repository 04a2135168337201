"""
Archives as folders, whose members are read without unpacking them into any folder.

Understood are zip, and tar plain or compressed by gzip, bzip2 or xz. An archive is walked once and
stays open; of a compressed tar an unpacked copy is in a temporary file without a name. How much an
archive may unpack to is limited by ``[records.archives]`` of the configuration.
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
from abc import ABC, abstractmethod
from collections.abc import Iterator
from functools import lru_cache
from pathlib import Path
from typing import IO, Any, BinaryIO, NamedTuple

from per_obspy.config import Archives
from per_obspy.errors import PerError, RecordRejected, Rejection, reason_of, shortened
from per_obspy.files import writing
from per_obspy.names import SHOWN, name_problem

_ZIP, _TAR = (".zip",), (".tar", ".tar.gz", ".tgz", ".tar.bz2", ".tar.xz")

#: Reason of a rejection of a pipe, socket, device or folder.
IRREGULAR = "is no regular file"

#: Limits where no configuration gives others.
LIMITS = Archives()

#: errors of the standard library for damaged, encrypted or cut archives
_DAMAGES = (
    zipfile.BadZipFile,
    tarfile.TarError,
    zlib.error,
    lzma.LZMAError,
    EOFError,
    OSError,
    RuntimeError,
    KeyError,
    ValueError,
    OverflowError,
    struct.error,
)

#: first bytes of a compressed tar -> function that opens it
_UNPACKERS = {b"\x1f\x8b": gzip.open, b"BZh": bz2.open, b"\xfd7zXZ\x00": lzma.open}

#: Ways of packing a member of a zip that the standard library knows.
_METHODS = (zipfile.ZIP_STORED, zipfile.ZIP_DEFLATED, zipfile.ZIP_BZIP2, zipfile.ZIP_LZMA)

#: Size of an archive below which its ratio of unpacked to packed bytes says nothing.
_SMALL = 64 * 2**20

#: Largest read of a header of tar, and of a piece that is unpacked, bytes.
_PIECE = 2**20

#: Open archives that a process keeps.
_KEPT = 8


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
        What it may unpack to.

    Returns
    -------
    files : list of Path
        Sorted.
    rejected : list of Rejection
        Members that are not read, each with its reason.

    Raises
    ------
    RecordRejected
        If the archive is damaged or unpacks to more than the limits.
    """
    opened = _opened_archive(archive, limits)
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
    try:
        if archive is None:
            return _regular_file(path)
        return _opened_archive(archive, limits).read(path.relative_to(archive).as_posix())
    except PerError:
        raise
    except _DAMAGES as error:
        raise RecordRejected(str(path), f"cannot be read: {reason_of(error)}") from error


def read_file(path: Path, limits: Archives = LIMITS) -> bytes:
    """
    Return the content of a file, or of a member of an archive as ``archive_files`` names it.

    Raises
    ------
    RecordRejected
        If it cannot be read.
    """
    with open_file(path, limits) as file:
        try:
            return file.read()
        except OSError as error:
            raise RecordRejected(str(path), f"cannot be read: {reason_of(error)}") from error


def _regular_file(path: Path) -> BinaryIO:
    """Open a file; a pipe, a socket or a device could keep its reader waiting for ever."""
    if path.exists() and not path.is_file():
        raise RecordRejected(str(path), IRREGULAR)
    return path.open("rb")


def _archive_of(path: Path) -> Path | None:
    """Return the archive that holds a path, or None."""
    for parent in path.parents:
        if is_archive(parent) and parent.is_file():
            return parent
    return None


def _opened_archive(archive: Path, limits: Archives) -> "_Archive":
    """Return an archive, which is walked once as long as its file does not change."""
    try:
        facts = archive.stat()
        return _walked(archive, (facts.st_size, facts.st_mtime_ns), limits)
    except PerError:
        raise
    except _DAMAGES as error:
        reason = f"the archive is damaged: {reason_of(error)}"
        raise RecordRejected(str(archive), reason) from error


@lru_cache(_KEPT)
def _walked(archive: Path, version: tuple[int, int], limits: Archives) -> "_Archive":
    """Open an archive and walk it; a changed one has another size or time."""
    size, _ = version
    kind = _Zip if archive.name.lower().endswith(_ZIP) else _Tar
    opened = kind(archive, size, limits)
    try:
        opened.walk()
    except BaseException:
        opened.close()
        raise
    return opened


class _Member(NamedTuple):
    """A member as the archive describes it; ``problem`` is empty if it can be read."""

    name: str
    size: int
    place: Any
    problem: str


class _Archive(ABC):
    """
    An open archive, with its readable members by name and rejections of the others.

    Parameters
    ----------
    path : Path
        The file.
    size : int
        Of the file, bytes.
    limits : Archives
        What it may unpack to.
    """

    def __init__(self, path: Path, size: int, limits: Archives) -> None:
        self.path, self.size, self.limits = path, size, limits
        self.members: dict[str, _Member] = {}
        self.rejected: list[Rejection] = []

    @abstractmethod
    def described(self) -> Iterator[_Member]:
        """Yield all files in the order of the archive."""

    @abstractmethod
    def read(self, name: str) -> BinaryIO:
        """Return a member in memory."""

    @abstractmethod
    def close(self) -> None:
        """Close the file."""

    def __del__(self) -> None:
        self.close()

    def walk(self) -> None:
        """Find the members, each once; stop at the limits."""
        total = 0
        for number, member in enumerate(self.described(), start=1):
            if number > self.limits.most_members:
                raise self.too_large(f"holds more than {self.limits.most_members} files")
            total += 0 if member.problem else member.size
            self.check_total(total)
            problem = member.problem or self._problem(member)
            if problem:
                self._reject(member.name, problem)
                continue
            # The later member of two is the one that unpacking would leave
            name = _plain_name(member.name)
            if name in self.members:
                self._reject(name, "another member of this name comes later in the archive")
            self.members[name] = member

    def _problem(self, member: _Member) -> str:
        """Return why a member is not read; empty if it is."""
        problem = name_problem(_plain_name(member.name))
        if problem:
            return f"its name {problem}"
        if is_archive(Path(member.name)):
            return "is an archive inside an archive: unpack the outer one first"
        if member.size > self.limits.largest_member:
            limit = f"larger than records.archives.largest_member = {self.limits.largest_member}"
            return f"unpacks to {member.size} bytes, {limit}"
        return ""

    def _reject(self, name: str, reason: str) -> None:
        """Add a row for a member that is not read."""
        shown = shortened(name, SHOWN)
        row = Rejection("file", shown, f"{self.path}/{shown}", None, (reason,))
        self.rejected.append(row)

    def check_total(self, total: int) -> None:
        """Refuse the archive if it unpacks to more bytes than the limits allow."""
        limits = self.limits
        if total > limits.largest_total:
            limit = f"records.archives.largest_total = {limits.largest_total}"
            raise self.too_large(f"unpacks to more than {limit} bytes")
        if total > max(limits.largest_ratio * self.size, _SMALL):
            limit = f"records.archives.largest_ratio = {limits.largest_ratio:g}"
            raise self.too_large(f"unpacks to more than {limit} times its own size")

    def too_large(self, problem: str) -> RecordRejected:
        """Return the error of an archive beyond a limit."""
        return RecordRejected(str(self.path), f"the archive {problem}: unpack it by hand")


def _plain_name(name: str) -> str:
    """Return the name of a member without ``.`` in it, and with ``/`` between its folders."""
    parts = name.replace("\\", "/").split("/")
    # An empty first part is that of an absolute name
    inner = [part for part in parts[1:] if part not in ("", ".")]
    return "/".join([*([] if parts[0] == "." else parts[:1]), *inner])


class _Zip(_Archive):
    """A zip archive: its list of members is at its end."""

    def __init__(self, path: Path, size: int, limits: Archives) -> None:
        super().__init__(path, size, limits)
        self.packed: zipfile.ZipFile | None = None

    def described(self) -> Iterator[_Member]:
        self.packed = zipfile.ZipFile(self.path)
        for info in self.packed.infolist():
            if not info.is_dir():
                yield _Member(info.orig_filename, info.file_size, info, _packing_problem(info))

    def read(self, name: str) -> BinaryIO:
        assert self.packed is not None  # which walking opened
        member = _found(self, name)
        # Never more than was declared, whatever the packed bytes unpack to
        with self.packed.open(member.place) as file:
            return io.BytesIO(file.read(member.size))

    def close(self) -> None:
        if self.packed is not None:
            self.packed.close()


def _packing_problem(info: zipfile.ZipInfo) -> str:
    """Return why a member of a zip cannot be unpacked; empty if it can."""
    if info.flag_bits & 1:
        return "is encrypted: unpack it first"
    if info.compress_type not in _METHODS:
        return f"is packed by method {info.compress_type}, which is unknown: unpack it first"
    return ""


def _found(archive: _Archive, name: str) -> _Member:
    """Return a readable member by its name."""
    if name not in archive.members:
        raise RecordRejected(
            f"{archive.path}/{name}", "cannot be read: the archive has no such file"
        )
    return archive.members[name]


class _Tar(_Archive):
    """A tar archive, of a compressed one an unpacked copy: members are anywhere in it."""

    def __init__(self, path: Path, size: int, limits: Archives) -> None:
        super().__init__(path, size, limits)
        self.file: IO[bytes] | None = None

    def described(self) -> Iterator[_Member]:
        self.file = self.path.open("rb")
        unpacker = _unpacker(self.file)
        if unpacker is not None:
            self.file = self._unpacked(self.file, unpacker)
        length = self.file.seek(0, io.SEEK_END)
        self.file.seek(0)
        yield from _tar_members(_Headers(self.file), length)

    def _unpacked(self, packed: IO[bytes], unpacker: Any) -> IO[bytes]:
        """Return a temporary copy of a compressed tar, unpacked piece by piece."""
        copy, total = tempfile.TemporaryFile(prefix="per_obspy-"), 0  # noqa: SIM115 - kept open
        try:
            with packed, unpacker(packed) as source:
                while piece := source.read(_PIECE):
                    total += len(piece)
                    self.check_total(total)
                    with writing(Path(tempfile.gettempdir())):
                        copy.write(piece)
        except BaseException:
            copy.close()
            raise
        return copy

    def read(self, name: str) -> BinaryIO:
        assert self.file is not None  # which walking opened
        member = _found(self, name)
        self.file.seek(member.place)
        content = self.file.read(member.size)
        if len(content) < member.size:
            raise EOFError("the archive has become shorter")
        return io.BytesIO(content)

    def close(self) -> None:
        if self.file is not None:
            self.file.close()


def _unpacker(file: IO[bytes]) -> Any:
    """Return what unpacks a compressed tar, by its first bytes; None if it is not compressed."""
    head = file.read(max(map(len, _UNPACKERS)))
    file.seek(0)
    found = (opened for mark, opened in _UNPACKERS.items() if head.startswith(mark))
    return next(found, None)


def _tar_members(headers: "_Headers", length: int) -> Iterator[_Member]:
    """Yield the files of a tar from its headers alone; ``length`` is its size, bytes."""
    with tarfile.open(fileobj=headers, mode="r:") as packed:  # type: ignore[call-overload]
        while info := packed.next():
            packed.members.clear()
            is_whole = info.offset_data + info.size <= length
            if info.size < 0 or not (is_whole or _tar_problem(info)):
                raise tarfile.ReadError(f"{shortened(info.name, SHOWN)!r} is cut")
            if not info.isdir():
                yield _Member(info.name, info.size, info.offset_data, _tar_problem(info))
        # Damage in the middle ends the walk like the end itself
        headers.require_end(packed.offset)


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
        if not 0 <= size <= _PIECE:
            raise tarfile.ReadError(f"a header of {size} bytes")
        return self._file.read(size)

    def seek(self, position: int) -> int:
        """Go forwards, or back by the one byte that tarfile reads to see whether data are cut."""
        if position < self._file.tell() - 1:
            raise tarfile.ReadError("a header that leads back")
        return self._file.seek(position)

    def require_end(self, position: int) -> None:
        """Raise an error unless the mark of the end, a block of zeros, is at a position."""
        self._file.seek(position)
        if self._file.read(tarfile.BLOCKSIZE) != bytes(tarfile.BLOCKSIZE):
            raise tarfile.ReadError(f"no header and no end mark at byte {position}")
