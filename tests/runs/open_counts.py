"""Count how often files of some folders are opened, by whichever library or process (Linux)."""

import ctypes
import os
import struct
from collections import Counter

#: Events of inotify that are counted, and those that keep equal ones apart: the kernel joins equal
#: events that follow each other.
OPEN, OTHERS = 0x20, 0x01 | 0x02 | 0x08 | 0x10

#: Flags of inotify: more events than it keeps, and an event of a folder.
OVERFLOW, FOLDER = 0x4000, 0x40000000


class OpenCounts:
    """Opened files of some folders since the last question, without their subfolders."""

    def __init__(self, *folders):
        library = ctypes.CDLL(None, use_errno=True)
        self._watch = library.inotify_init1(os.O_NONBLOCK)
        self._folders = {}
        for folder in folders:
            number = library.inotify_add_watch(self._watch, os.fsencode(folder), OPEN | OTHERS)
            if number < 0:
                raise OSError(ctypes.get_errno(), f"cannot watch {folder}")
            self._folders[number] = folder

    def __call__(self):
        """Return the number of opens of each file, and begin again with none."""
        counts = Counter()
        for number, mask, name in self._events():
            assert not mask & OVERFLOW
            if mask & OPEN and not mask & FOLDER:
                counts[self._folders[number] / name] += 1
        return counts

    def _events(self):
        """Yield watch, mask and name of the events that wait."""
        while True:
            try:
                content = os.read(self._watch, 1 << 20)
            except BlockingIOError:
                return
            # A header of 16 bytes, then the name, filled up with zeros
            start = 0
            while start < len(content):
                number, mask, _, size = struct.unpack_from("iIII", content, start)
                name = content[start + 16 : start + 16 + size].rstrip(b"\0")
                yield number, mask, os.fsdecode(name)
                start += 16 + size

    def close(self):
        """End the watch."""
        os.close(self._watch)
