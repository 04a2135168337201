"""Tar archives, plain or compressed by gzip, bzip2 or xz: members are anywhere in the file."""

import bz2
import gzip
import io
import lzma
import tarfile
import tempfile
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import IO, Any

from per_obspy.errors import shortened
from per_obspy.files import writing
from per_obspy.names import SHOWN
from per_obspy.records.archives.packed import PIECE, Member, Packed

#: first bytes of a compressed tar -> function that opens it
_UNPACKERS = {b"\x1f\x8b": gzip.open, b"BZh": bz2.open, b"\xfd7zXZ\x00": lzma.open}


class PackedTar(Packed):
    """
    A tar archive; of a compressed one an unpacked copy is in a temporary file without a name.

    Parameters
    ----------
    file : file object
        The archive.
    check : callable
        Called with the size of the unpacked copy as it grows, bytes; raises beyond the limits.
    """

    def __init__(self, file: IO[bytes], check: Callable[[int], None]) -> None:
        unpacker = _unpacker(file)
        super().__init__(file if unpacker is None else _unpacked(file, unpacker, check))

    def described(self) -> Iterator[Member]:
        """Yield all files, from their headers alone."""
        length = self.file.seek(0, io.SEEK_END)
        self.file.seek(0)
        yield from _tar_members(_Headers(self.file), length)

    def pieces(self, member: Member) -> Iterator[bytes]:
        """Yield the bytes of a member."""
        self.file.seek(member.place)
        left = member.size
        while left:
            piece = self.file.read(min(PIECE, left))
            if not piece:
                raise EOFError("the archive has become shorter")
            left -= len(piece)
            yield piece


def _unpacker(file: IO[bytes]) -> Any:
    """Return the decompressor of a compressed tar, by its first bytes; None if not compressed."""
    head = file.read(max(map(len, _UNPACKERS)))
    file.seek(0)
    found = (opened for mark, opened in _UNPACKERS.items() if head.startswith(mark))
    return next(found, None)


def _unpacked(packed: IO[bytes], unpacker: Any, check: Callable[[int], None]) -> IO[bytes]:
    """Return a temporary copy of a compressed tar, unpacked piece by piece."""
    copy, total = tempfile.TemporaryFile(prefix="per_obspy-"), 0  # noqa: SIM115 - kept open
    try:
        with packed, unpacker(packed) as source:
            while piece := source.read(PIECE):
                total += len(piece)
                check(total)
                with writing(Path(tempfile.gettempdir())):
                    copy.write(piece)
    except BaseException:
        copy.close()
        raise
    return copy


def _tar_members(headers: "_Headers", length: int) -> Iterator[Member]:
    """Yield the files of a tar from its headers alone; ``length`` is its size, bytes."""
    with tarfile.open(fileobj=headers, mode="r:") as packed:  # type: ignore[call-overload]
        while info := packed.next():
            packed.members.clear()
            is_whole = info.offset_data + info.size <= length
            if info.size < 0 or not (is_whole or _tar_problem(info)):
                raise tarfile.ReadError(f"{shortened(info.name, SHOWN)!r} is cut")
            if not info.isdir():
                yield Member(info.name, info.size, info.offset_data, _tar_problem(info))
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
        if not 0 <= size <= PIECE:
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
