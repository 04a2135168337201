"""Common part of all kinds of archives: members in their order, and their bytes."""

from abc import ABC, abstractmethod
from collections.abc import Iterator
from typing import IO, Any, NamedTuple

#: Largest piece that is unpacked at once, bytes.
PIECE = 2**20


class Member(NamedTuple):
    """
    A member as its archive describes it.

    Attributes
    ----------
    name : str
        As the archive has it.
    size : int
        Bytes after unpacking.
    place : object
        By which its archive finds it.
    problem : str
        Why it cannot be read; empty if it can.
    """

    name: str
    size: int
    place: Any
    problem: str


class Packed(ABC):
    """
    An open archive of one kind.

    Parameters
    ----------
    file : file object
        The archive, which is closed with it.
    """

    def __init__(self, file: IO[bytes]) -> None:
        self.file = file

    @abstractmethod
    def described(self) -> Iterator[Member]:
        """Yield all files in the order of the archive."""

    @abstractmethod
    def pieces(self, member: Member) -> Iterator[bytes]:
        """Yield the bytes of a member, never more than it declares."""

    def close(self) -> None:
        """Close the file."""
        self.file.close()
