"""
An archive with the files in it, those of archives inside it included.

All of them share one allowance of files and bytes, so that a bomb of many levels ends as one of a
single level does. Of the archives inside an archive only the one that was read last stays open.
"""

import io
import lzma
import struct
import tarfile
import tempfile
import zipfile
import zlib
from pathlib import Path
from typing import IO, BinaryIO, NamedTuple

from per_obspy.config import Archives
from per_obspy.errors import RecordRejected, Rejection, reason_of, shortened
from per_obspy.files import writing
from per_obspy.names import SHOWN, name_problem
from per_obspy.records.archives.packed import Member, Packed
from per_obspy.records.archives.tar_archive import PackedTar
from per_obspy.records.archives.zip_archive import PackedZip

#: Ends of the names of archives.
ZIP, TAR = (".zip",), (".tar", ".tar.gz", ".tgz", ".tar.bz2", ".tar.xz")

#: Errors of the standard library for damaged, encrypted or cut archives.
DAMAGES = (
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

#: Size of an archive below which its ratio of unpacked to packed bytes is not checked.
SMALL = 64 * 2**20

_REPEATED = "another member of this name comes later in the archive"


def is_archive(path: Path) -> bool:
    """Check from its name whether a file is an archive."""
    return path.name.lower().endswith(ZIP + TAR)


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
    """

    def __init__(self, path: str, size: int, limits: Archives) -> None:
        self.path, self.size, self.limits = path, size, limits
        self.files = self.total = 0

    def spend(self, size: int) -> None:
        """Count one file of some bytes."""
        self.files += 1
        if self.files > self.limits.most_members:
            raise self._too_large(f"holds more than {self.limits.most_members} files")
        self.check(size)
        self.total += size

    def check(self, size: int) -> None:
        """Refuse the archive if that many bytes more are beyond the limits."""
        limits, total = self.limits, self.total + size
        # The sum of all files, and its ratio to the archive as it is stored
        if total > limits.largest_total:
            limit = f"records.archives.largest_total = {limits.largest_total}"
            raise self._too_large(f"unpacks to more than {limit} bytes")
        if total > max(limits.largest_ratio * self.size, SMALL):
            limit = f"records.archives.largest_ratio = {limits.largest_ratio:g}"
            raise self._too_large(f"unpacks to more than {limit} times its packed size")

    def _too_large(self, problem: str) -> "BeyondLimits":
        """Return the error of an archive beyond a limit."""
        return BeyondLimits(self.path, f"the archive {problem}: unpack it by hand")


class BeyondLimits(RecordRejected):
    """An archive unpacks to more than the configuration allows."""


class _Inside(NamedTuple):
    """Path of a file in an archive inside an archive: names of that archive and of the file."""

    archive: str
    name: str


class WalkedArchive:
    """
    An open archive, with its readable members by name and rejections of the others.

    Parameters
    ----------
    name : str
        Path for messages; it ends with the kind of the archive.
    file : file object
        The archive.
    allowance : Allowance
        Limits of unpacking.
    level : int
        1 for the outermost archive, 2 for one inside it, and so on.

    Attributes
    ----------
    members : dict
        Name -> member; names of files in inner archives begin with the name of their archive.
    rejected : list of Rejection
        Members that are not read, each with its reason.
    """

    def __init__(self, name: str, file: IO[bytes], allowance: Allowance, level: int = 1) -> None:
        self.name, self.allowance, self.level = name, allowance, level
        self.members: dict[str, Member] = {}
        self.rejected: list[Rejection] = []
        self._file = file
        self._packed: Packed | None = None
        # Archives inside, of which one is open
        self._archives: dict[str, Member] = {}
        self._inner: tuple[str, WalkedArchive] | None = None
        try:
            self._packed = self._opened()
            inner = self._walk(self._packed)
            for archive in inner.values():
                self._enter(archive)
        except BaseException:
            self.close()
            raise

    def _opened(self) -> Packed:
        """Return the archive as one of its kind."""
        if self.name.lower().endswith(ZIP):
            return PackedZip(self._file)
        return PackedTar(self._file, self.allowance.check)

    def close(self) -> None:
        """Close the file, and the archive inside that is open."""
        if self._inner is not None:
            self._inner[1].close()
        if self._packed is not None:
            self._packed.close()
        self._file.close()

    def __del__(self) -> None:
        self.close()

    def read(self, name: str) -> BinaryIO:
        """Return a member in memory."""
        if name not in self.members:
            problem = "cannot be read: the archive has no such file"
            raise RecordRejected(f"{self.name}/{name}", problem)
        member = self.members[name]
        if isinstance(member.place, _Inside):
            return self._inner_archive(member.place.archive).read(member.place.name)
        assert self._packed is not None  # which walking opened
        return io.BytesIO(b"".join(self._packed.pieces(member)))

    def _walk(self, packed: Packed) -> dict[str, Member]:
        """Find the members, each once, and return the archives among them; stop at the limits."""
        inner: dict[str, Member] = {}
        for member in packed.described():
            self.allowance.spend(0 if member.problem else member.size)
            problem = member.problem or self._problem(member)
            if problem:
                self._reject(member.name, problem)
                continue
            # The later member of two is the one that unpacking would leave
            name = _plain_name(member.name)
            group = inner if is_archive(Path(name)) else self.members
            if name in group:
                self._reject(name, _REPEATED)
            group[name] = member._replace(name=name)
        return inner

    def _problem(self, member: Member) -> str:
        """Return why a member is not read; empty if it is."""
        limits = self.allowance.limits
        # A name that leads elsewhere, an archive too deep, a file too large
        problem = name_problem(_plain_name(member.name))
        if problem:
            return f"its name {problem}"
        if is_archive(Path(member.name)) and self.level >= limits.most_levels:
            limit = f"records.archives.most_levels = {limits.most_levels}"
            return f"is an archive inside archives, deeper than {limit}: unpack the outer one first"
        if member.size > limits.largest_member:
            limit = f"larger than records.archives.largest_member = {limits.largest_member}"
            return f"unpacks to {member.size} bytes, {limit}"
        return ""

    def _enter(self, archive: Member) -> None:
        """Add the files of an archive inside; a damaged one is a rejection."""
        # Its list of members is kept, the archive itself only until the next is entered
        try:
            walked = self._unpacked(archive, self.allowance)
        except BeyondLimits:
            raise
        except (*DAMAGES, RecordRejected) as error:
            reason = reason_of(error) if isinstance(error, DAMAGES) else str(error)
            self._reject(archive.name, f"the archive is damaged: {reason}")
            return
        self._keep(archive.name, walked)
        self._archives[archive.name] = archive
        for name, member in walked.members.items():
            place = _Inside(archive.name, name)
            whole = f"{archive.name}/{name}"
            if whole in self.members:
                self._reject(whole, _REPEATED)
            self.members[whole] = Member(whole, member.size, place, "")
        self.rejected += walked.rejected

    def _unpacked(self, archive: Member, allowance: Allowance) -> "WalkedArchive":
        """Return an archive inside, walked, from a copy in a temporary file without a name."""
        assert self._packed is not None  # which walking opened
        copy = tempfile.TemporaryFile(prefix="per_obspy-")  # noqa: SIM115 - kept open
        try:
            for piece in self._packed.pieces(archive):
                with writing(Path(tempfile.gettempdir())):
                    copy.write(piece)
            copy.seek(0)
        except BaseException:
            copy.close()
            raise
        return WalkedArchive(f"{self.name}/{archive.name}", copy, allowance, self.level + 1)

    def _inner_archive(self, name: str) -> "WalkedArchive":
        """Return an archive inside, which is unpacked again unless it was read last."""
        if self._inner is None or self._inner[0] != name:
            # The first walk has shown that it is within the limits
            spent = self.allowance
            fresh = Allowance(spent.path, spent.size, spent.limits)
            self._keep(name, self._unpacked(self._archives[name], fresh))
        assert self._inner is not None  # which the line above made
        return self._inner[1]

    def _keep(self, name: str, walked: "WalkedArchive") -> None:
        """Keep one archive inside open, and close the one before."""
        if self._inner is not None:
            self._inner[1].close()
        self._inner = (name, walked)

    def _reject(self, name: str, reason: str) -> None:
        """Add a row for a member that is not read."""
        shown = shortened(name, SHOWN)
        row = Rejection("file", shown, f"{self.name}/{shown}", None, (reason,))
        self.rejected.append(row)


def _plain_name(name: str) -> str:
    """Return the name of a member without ``.`` in it, and with ``/`` between its folders."""
    parts = name.replace("\\", "/").split("/")
    # An empty first part is that of an absolute name
    inner = [part for part in parts[1:] if part not in ("", ".")]
    return "/".join([*([] if parts[0] == "." else parts[:1]), *inner])
