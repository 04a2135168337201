"""Zip archives: the list of members is at the end of the file."""

import zipfile
from collections.abc import Iterator
from typing import IO

from per_obspy.records.archives.packed import PIECE, Member, Packed

#: Ways of packing a member that the standard library knows.
_METHODS = (zipfile.ZIP_STORED, zipfile.ZIP_DEFLATED, zipfile.ZIP_BZIP2, zipfile.ZIP_LZMA)


class PackedZip(Packed):
    """A zip archive."""

    def __init__(self, file: IO[bytes]) -> None:
        super().__init__(file)
        self.packed = zipfile.ZipFile(file)

    def described(self) -> Iterator[Member]:
        """Yield all files of the list."""
        for info in self.packed.infolist():
            if not info.is_dir():
                yield Member(info.orig_filename, info.file_size, info, _packing_problem(info))

    def pieces(self, member: Member) -> Iterator[bytes]:
        """Yield the bytes of a member."""
        # Never more than was declared, whatever the packed bytes unpack to
        left = member.size
        with self.packed.open(member.place) as file:
            while piece := file.read(min(PIECE, left)):
                left -= len(piece)
                yield piece


def _packing_problem(info: zipfile.ZipInfo) -> str:
    """Return why a member cannot be unpacked; empty if it can."""
    if info.flag_bits & 1:
        return "is encrypted: unpack it first"
    if info.compress_type not in _METHODS:
        return f"is packed by method {info.compress_type}, which is unknown: unpack it first"
    return ""
